"""Every tolerance of a verdict: three times the allowed error fails, a third of it passes."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.errors import SceneError
from hertzchain.observables.error_bound import highest_rate
from hertzchain.observables.result import LostDigits
from hertzchain.verdict import run_checks
from hertzchain.verdict.check import Check, Kind, within
from hertzchain.verdict.judgement import Judgement, judged
from hertzchain.verdict.run_checks import (
    balance_checks,
    reference_checks,
    same_steps_checks,
    yardstick_check,
)
from tests.conftest import STEEL, paper_scene

FREE = paper_scene("cosine", 1.0, 2.0, 5)
DASHPOT = hc.Contact("dashpot", coefficient=3.0)
SCENES = {
    "free": FREE,
    "short": paper_scene("triangular", 1e-3, 2.0, 5),
    "within the pulse": replace(FREE, run=hc.Run(0.7 * FREE.ramps[-1].end)),
    "wall": replace(FREE, wall=hc.Wall("rigid")),
    "piston": hc.Scene(hc.Chain(5, **STEEL), hc.Piston(0.5), hc.Run(1e-4)),
    "damped": replace(FREE, contact=DASHPOT),
    "damped wall": replace(FREE, contact=DASHPOT, wall=hc.Wall("rigid")),
    "damped piston": hc.Scene(hc.Chain(5, **STEEL), hc.Piston(0.5), hc.Run(1e-4), contact=DASHPOT),
}
LOST = 1e-9
ERROR = 1e-4


@functools.cache
def verlet(name: str, step: float) -> hc.Result:
    """Native velocity Verlet, whose states and peaks are those at the same steps."""
    scene = SCENES[name]
    return hc.Native("velocity-verlet", step * scene.contact_time).run(scene)


@functools.cache
def accurate(name: str) -> hc.Result:
    return hc.Native("reference").run(SCENES[name])


def check_of(checks: list[Check], name: str) -> Check:
    return next(check for check in checks if check.kind.name.startswith(name))


# At the same steps


def with_state(result: hc.Result, what: str, off: float, least: float) -> hc.Result:
    """Displacement or velocity of one granule off by a part of the largest, or of natural units."""
    values = getattr(result, what).copy()
    unit = result.scene.units.length if what == "displacement" else result.scene.units.velocity
    values[2] += off * max(float(np.max(np.abs(values))), least * unit)
    return replace(result, **{what: values})


def with_peak(result: hc.Result, off: float) -> hc.Result:
    peak_force = result.peak_force.copy()
    peak_force[1] *= 1 + off
    return replace(result, peak_force=peak_force)


def lossy(result: hc.Result, bound: float = LOST) -> hc.Result:
    return replace(result, lost_digits=LostDigits(1.0, bound, bound))


STATES = {
    "no loss": ("free", 100, 0.0, 1e-12),
    "lost": ("free", 100, LOST, 1e-12 + 10 * LOST),
    "many steps": ("free", 30_000_000, LOST, 1e-12 + 10 * LOST),
    "damped": ("damped", 290_000, LOST, 1e-12 + 10 * LOST),
    # As a random walk of the steps over 300,000.
    "damped, many steps": ("damped", 30_000_000, LOST, 1e-12 + 100 * LOST),
}


@pytest.mark.parametrize("case", STATES)
def test_states_at_the_same_steps(case: str) -> None:
    name, steps, lost, allowed = STATES[case]
    result = replace(verlet(name, 0.1), steps=steps)
    result = lossy(result, lost) if lost else result
    least = 1.0 if name == "damped" else 0.0
    for off, passed in ((3 * allowed, False), (allowed / 3, True), (-3 * allowed, False)):
        wrong = with_state(with_state(result, "velocity", off, least), "displacement", off, least)
        for check in same_steps_checks(wrong)[:2]:
            assert check.passed is passed
            assert passed or check.reason.endswith("largest at granule 3")


def readings(step: float) -> float:
    return 7e-9 * max(1.0, 0.01 / step) + 0.1 * step**4


@pytest.mark.parametrize(
    ("name", "step", "error", "more"),
    [
        ("free", 0.004, ERROR, lambda _: 0.0),
        ("free", 0.02, ERROR, lambda _: 0.0),
        ("free", 0.1, ERROR, lambda _: 0.0),
        ("wall", 0.1, 1.0, lambda step: 0.02 * step**2),
        ("wall", 0.002, 1.0, lambda _: 1e-7),
        ("wall", 0.05, 3e-6, lambda _: 3e-6),
        ("damped", 0.05, 1.0, lambda step: 0.2 * step**2),
        ("damped", 0.05, 3e-5, lambda _: 3e-5),
    ],
)
def test_peaks_at_the_same_steps(
    monkeypatch: pytest.MonkeyPatch,
    name: str,
    step: float,
    error: float,
    more: Callable[[float], float],
) -> None:
    monkeypatch.setattr(run_checks, "_grown", lambda *_: (0.0, 0.0, 0.0))
    result = replace(verlet(name, step), error_estimate=error)
    cut = result.dt / result.scene.contact_time
    for lost in (0.0, readings(cut) + more(cut)):
        allowed = readings(cut) + more(cut) + lost
        changed = lossy(result, lost) if lost else result
        for off, passed in ((3 * allowed, False), (allowed / 3, True)):
            assert check_of(same_steps_checks(with_peak(changed, off)), "peaks").passed is passed


@pytest.mark.parametrize(("name", "gain"), [("free", 3), ("damped", 1)])
def test_extrapolated_peaks_at_the_same_steps(name: str, gain: int) -> None:
    """The order is 2, and 1 where contacts are damped; the result has the steps of both runs."""
    scene, step = SCENES[name], 0.05
    coarse, fine = (
        hc.Native("velocity-verlet", most * scene.contact_time).run(scene)
        for most in (2 * step, step)
    )
    steps = sum(2 * leg.steps for leg in scene.schedule(2 * step * scene.contact_time))
    assert fine.steps == steps
    result = replace(
        fine,
        method="velocity-verlet, extrapolated",
        steps=3 * steps // 2,
        peak_force=fine.peak_force + (fine.peak_force - coarse.peak_force) / gain,
        error_estimate=1e-6,
    )
    cut = result.dt / scene.contact_time
    allowed = readings(cut) + (1e-6 if name == "damped" else 0.0)
    for off, passed in ((3 * allowed, False), (allowed / 3, True), (0.0, True)):
        assert check_of(same_steps_checks(with_peak(result, off)), "peaks").passed is passed


def test_differences_that_grow(monkeypatch: pytest.MonkeyPatch) -> None:
    """Three times the growth of one small difference is allowed, and said from 0.01 on."""
    result = lossy(verlet("free", 0.1))
    for grown in (1e-5, 2e-3, 5e-3):
        growth = grown, grown / 2, 2 * grown
        monkeypatch.setattr(run_checks, "_grown", lambda *_, growth=growth: growth)
        for off, passed in ((9 * grown, False), (grown, True)):
            check = check_of(same_steps_checks(with_state(result, "velocity", off, 0)), "velocity")
            assert check.passed is passed
            assert bool(check.remark) is (3 * grown > 0.01)
        peaks = readings(result.dt / FREE.contact_time) + 6 * grown
        for off, passed in ((3 * peaks, False), (peaks / 3, True)):
            assert check_of(same_steps_checks(with_peak(result, off)), "peaks").passed is passed


# Against the reference, and the reference itself


def test_peaks_against_the_reference() -> None:
    result = replace(accurate("free"), error_estimate=1e-5)
    reference = replace(accurate("free"), error_estimate=3e-5)
    for off, passed in ((1.2e-4, False), (-1.2e-4, False), (1.3e-5, True), (-1.3e-5, True)):
        assert reference_checks(with_peak(result, off), reference)[0].passed is passed


@pytest.mark.parametrize(("error", "passed"), [(3e-6, False), (3.3e-7, True)])
def test_the_error_of_the_reference(error: float, passed: bool) -> None:
    assert yardstick_check(replace(accurate("free"), error_estimate=error)).passed is passed


# Balances


@dataclass(frozen=True)
class Balanced:
    """A run that balances, and what may be missing: of the momentum [N s] and the energy [J]."""

    name: str
    method: str
    momentum: Callable[[hc.Result], float]
    energy: Callable[[hc.Result], float]
    changes: dict[str, Any] = field(default_factory=dict)


def impulse(result: hc.Result) -> float:
    return result.scene.largest_impulse


def by_piston(result: hc.Result) -> tuple[float, float]:
    """Impulse [N s] and work [J] of the largest force, all the time."""
    scene, force = result.scene, float(np.max(result.peak_force))
    return force * scene.end_time, force * scene.piston.distance(scene.end_time)


def damper(result: hc.Result) -> float:
    """A step over the time of the dampers."""
    return float(highest_rate(result.scene)) * result.dt


def ramp_work(result: hc.Result) -> float:
    """Twice the work that velocity Verlet lacks on rise and decay of a whole pulse [J]."""
    top = result.scene.peak_force
    rise, decay, _ = result.scene.schedule(result.dt)
    return (rise.dt**2 + decay.dt**2) * top**2 / (6 * result.scene.pushed_mass)


FEW, MANY, SURE = {"steps": 10}, {"steps": 10**6}, {"error_estimate": 1e-15}
UNSURE = {"error_estimate": ERROR, "steps": 10}
BALANCED = [
    Balanced(
        "free", "reference", lambda r: 1e-12 * impulse(r), lambda r: 1e-12 * r.balance.work,
        FEW | SURE,
    ),
    Balanced(
        "free", "reference", lambda r: 2.1e-11 * impulse(r),
        lambda r: 2 * ERROR * r.balance.work, MANY | {"error_estimate": ERROR},
    ),
    Balanced(
        "short", "velocity-verlet", lambda r: 1e-12 * impulse(r), ramp_work, FEW | SURE,
    ),
    Balanced(
        "within the pulse", "reference", lambda r: ERROR * impulse(r),
        lambda r: 2 * ERROR * r.balance.work, UNSURE,
    ),
    Balanced(
        "wall", "reference", lambda r: ERROR * impulse(r), lambda r: 2 * ERROR * r.balance.work,
        UNSURE,
    ),
    Balanced(
        "piston", "reference", lambda r: ERROR * (impulse(r) + by_piston(r)[0]),
        lambda r: 2 * ERROR * (r.balance.work + by_piston(r)[1]), UNSURE,
    ),
    Balanced(
        "damped", "velocity-verlet", lambda r: 1e-12 * impulse(r),
        lambda r: damper(r) * r.balance.dissipated + ramp_work(r), FEW | SURE,
    ),
    Balanced(
        "damped wall", "velocity-verlet", lambda r: 0.1 * damper(r) * impulse(r),
        lambda r: damper(r) * r.balance.dissipated + ramp_work(r), FEW | SURE,
    ),
    Balanced(
        "damped piston", "velocity-verlet",
        lambda r: 0.1 * damper(r) * (impulse(r) + by_piston(r)[0]),
        lambda r: damper(r) * (r.balance.dissipated + 0.1 * by_piston(r)[1]), FEW | SURE,
    ),
]  # fmt: skip


@pytest.mark.parametrize("case", BALANCED, ids=lambda case: f"{case.name}, {case.method}")
def test_balances(case: Balanced) -> None:
    run = accurate(case.name) if case.method == "reference" else verlet(case.name, 0.05)
    result = replace(run, **case.changes)
    balance = result.balance
    sent = balance.work - balance.dissipated
    for part, passed in ((3.0, False), (-3.0, False), (1 / 3, True), (-1 / 3, True)):
        momentum = balance.impulse + part * case.momentum(result)
        energy = sent + part * case.energy(result)
        wrong = replace(result, balance=replace(balance, momentum=momentum, energy=energy))
        checks = balance_checks(wrong)
        assert [check.passed for check in checks] == [passed, passed], [
            check.tolerance for check in checks
        ]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({}, "steps end at the corners of the pulse, so its impulse is exact"),
        ({"wall": hc.Wall("rigid")}, "as the force on the wall is integrated from its overlap"),
        ({"near_wall": hc.Wall("rigid")}, "as the force on the near wall is integrated from its"),
        ({"run": SCENES["within the pulse"].run}, "as the run ends within the pulse"),
        (
            {"shock": hc.Piston(0.5), "run": hc.Run(1e-4)},
            "as the force of the piston is integrated",
        ),
    ],
)
def test_a_balance_says_why_it_is_not_exact(changes: dict[str, Any], words: str) -> None:
    momentum, _ = balance_checks(hc.Native("reference").run(replace(FREE, **changes)))
    assert words in momentum.reason
    assert momentum.passed


# A judgement


def judgement(off: FloatArray, sampling: FloatArray | None = None) -> Judgement:
    reference = accurate("free")
    given = reference.peak_force * (1 + off)
    truth = reference.peak_force
    return Judgement(reference, truth, False, given, 1e-3, None, None, (), None, sampling)


@pytest.mark.parametrize(("sampling", "allowed"), [(None, 1e-3), (5e-4, 1.5e-3)])
def test_peaks_that_are_judged(sampling: float | None, allowed: float) -> None:
    errors = None if sampling is None else np.full(4, sampling)
    for part, passed in ((3.0, False), (-3.0, False), (1 / 3, True), (-1 / 3, True)):
        off = np.array([0.0, part * allowed, 0.0, 0.0])
        outcome = judgement(off, errors)
        assert outcome.passed.tolist() == [True, passed, True, True]
        assert (outcome.verdict == "pass") is passed


def test_a_contact_is_judged_from_a_thousandth_of_the_largest() -> None:
    reference = accurate("free")
    for part, counts in ((3e-3, True), (3.3e-4, False)):
        weak = reference.peak_force.copy()
        weak[3] = part * weak.max()
        seen = replace(reference, peak_force=weak)
        outcome = Judgement(seen, weak, False, weak, 1e-3, None, None, (), None, None)
        assert outcome.judged.tolist() == [True, True, True, counts]


def test_a_tolerance_is_ten_times_the_error_of_the_reference() -> None:
    peaks, error = accurate("free").peak_force, accurate("free").error_estimate
    assert hc.judge(FREE, peaks, tolerance=30 * error).verdict == "pass"
    with pytest.raises(SceneError, match="must be at least 10 times the error of the reference"):
        hc.judge(FREE, peaks, tolerance=3.3 * error)


@pytest.mark.parametrize(("sampling", "named"), [(None, False), (5e-4, True)])
def test_a_cause_leaves_what_is_allowed_with_samples(sampling: float | None, named: bool) -> None:
    scene = paper_scene("cosine", 1.0, 2.0, 10)
    # A slow wave over the contacts is not noise; its root mean square is 7e-4.
    wave = 1 + 1e-3 * np.cos(np.linspace(0, 2 * np.pi, 9))
    peaks = 1e-3 * hc.Native("reference").run(scene).peak_force * wave
    errors = None if sampling is None else np.full(9, sampling)
    outcome = judged(scene, peaks, 5e-4, None, errors, 60.0, lambda _: None)
    assert ("in units of kN" in (outcome.cause or "")) is named


# One number


@pytest.mark.parametrize(
    ("measured", "passed"),
    [(1.3, False), (0.7, False), (1.03, True), (0.97, True), (math.nan, False), (math.inf, False)],
)
def test_a_check(measured: float, passed: bool) -> None:
    check = within(Kind("it"), "native", measured, 1.0, 0.1, "a reason")
    assert check.passed is passed
    assert check.measured == (measured if math.isfinite(measured) else None)
    assert (check.expected, check.tolerance, check.name) == (1.0, 0.1, "native: it")
