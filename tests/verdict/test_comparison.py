"""The comparison: verdicts on right results, and on results that were tampered with."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import hertzchain as hc
from hertzchain import theory
from hertzchain.arrays import FloatArray, apart
from hertzchain.errors import BackendMissing, SceneError, TooExpensive
from hertzchain.verdict.check import Check
from hertzchain.verdict.run_checks import is_quickly_written, reference_checks, yardstick_check
from tests.conftest import STEEL, paper_scene

SCENE = paper_scene("cosine-triangular", 2.0, 2.0, granules=16)


def failed(checks: Sequence[Check]) -> set[str]:
    return {check.name for check in checks if not check.passed}


OF_NATIVE = ["native: the reference method", "native: Eq. 1 as it is written"]
OF_LAMMPS = [
    "LAMMPS: the generated deck",
    "LAMMPS: reading the deck back",
    "native: velocity Verlet at the steps of LAMMPS",
]
"""What is said while a scene is compared."""


@pytest.fixture(scope="module")
def both() -> hc.Comparison:
    """Native and LAMMPS on a small scene."""
    said: list[str] = []
    compared = hc.compare(SCENE, progress=said.append)
    assert said == [*OF_NATIVE, *OF_LAMMPS]
    return compared


@pytest.fixture(scope="module")
def native_only() -> hc.Comparison:
    said: list[str] = []
    compared = hc.compare(SCENE, ["native"], progress=said.append)
    assert said == OF_NATIVE
    return compared


# Verdicts on right results

CHECKS_OF_NATIVE = {
    "native: momentum [N s]",
    "native: energy [J]",
    "native: error of the reference",
    "native: compiled against Eq. 1 as written",
}


@pytest.mark.lammps
def test_both_backends_pass(both: hc.Comparison) -> None:
    assert failed(both.checks) == set()
    assert both.verdict == "pass"
    assert not both.missing
    assert {check.name for check in both.checks} == CHECKS_OF_NATIVE | {
        "lammps: number of granules",
        "lammps: place of granules [m]",
        "lammps: distance from the axis [m]",
        "lammps: radius [m]",
        "lammps: mass [kg]",
        "lammps: stiffness of the contacts [N m^-1.5]",
        "lammps: exponent of the contact law",
        "lammps: damping [N]",
        "lammps: friction [N]",
        "lammps: constant force [N]",
        "lammps: velocity at the start [m/s]",
        "lammps: velocity across the chain [m/s]",
        "lammps: spin at the start [1/s]",
        "lammps: distance of neighbours [m]",
        "lammps: constant force across the chain [N]",
        "lammps: drag [N s/m]",
        "lammps: driven granules",
        "lammps: applied force [N]",
        "lammps: displacement, same steps",
        "lammps: velocity, same steps",
        "lammps: peaks, same steps",
        "lammps: peaks against the reference",
        "lammps: momentum [N s]",
        "lammps: energy [J]",
    }


# Results that were tampered with


@pytest.mark.parametrize("as_written", [False, True])
def test_eq_1_as_it_is_written_is_left_out_where_it_takes_long(
    as_written: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    said: list[str] = []
    monkeypatch.setattr("hertzchain.verdict.comparison.is_quickly_written", lambda _: False)
    compared = hc.compare(SCENE, ["native"], as_written=as_written, progress=said.append)
    names = {check.name for check in compared.checks}
    assert ("native: compiled against Eq. 1 as written" in names) == as_written
    assert said[0] == OF_NATIVE[0]
    assert (said[1] == OF_NATIVE[1]) == as_written
    assert said[1].endswith("ask for it with --as-written") != as_written


def test_what_takes_long_goes_by_evaluations_and_granules(native_only: hc.Comparison) -> None:
    """A thousand granules double the time of an evaluation; dampers take seven times as long."""
    damped = hc.Contact("restitution", restitution=0.9)
    for contact, most in ((None, 250_000 / 1.016), (damped, 250_000 / 7 / 1.016)):
        scene = replace(native_only.scene, contact=contact)
        for share, quick in ((0.99, True), (1.01, False)):
            evaluations = round(share * most)
            result = replace(native_only.native, scene=scene, force_evaluations=evaluations)
            assert is_quickly_written(result) == quick


def test_formulas_never_decide(native_only: hc.Comparison) -> None:
    nonsense = replace(native_only.formulas, eq6=1e9 * native_only.formulas.eq6)
    assert replace(native_only, formulas=nonsense).verdict == "pass"


@pytest.mark.parametrize(
    ("engines", "words"),
    [
        (["native", "edem"], "engines = 'edem': must be a backend or one of native, lammps, liggg"),
        ([SCENE], "must be a backend or one of native, lammps"),
        ("native", "engines = 'native': must be a list of names or backends"),
        (hc.Lammps(), "must be a list of names or backends"),
        (["lammps", hc.Lammps(rtol=1e-4)], "lammps is given twice"),
        ([hc.Native("rk4")], r"must be hertzchain.Native\(\"reference\"\)"),
    ],
    ids=["unknown", "no backend", "a name", "one backend", "twice", "another method"],
)
def test_engines_that_cannot_be_compared_are_refused(engines: Any, words: str) -> None:
    with pytest.raises(SceneError, match=words):
        hc.compare(SCENE, engines)


@pytest.mark.parametrize(
    "engine", [hc.Native("reference", time_limit=1e-9), hc.Lammps(time_limit=1e-9)]
)
def test_the_time_limit_of_a_backend_holds_for_the_reference(engine: hc.Native | hc.Lammps) -> None:
    with pytest.raises(TooExpensive):
        hc.compare(SCENE, [engine])


@pytest.mark.parametrize(
    ("measured", "expected", "words"),
    [
        (1.0, 2.0, ("1", "2")), (123.456, 123.456, ("123.5", "123.5")), (0.0, 2.0, ("0", "2")),
        (100.001, 100.0, ("100.001", "100")), (-3.0, -3.0002, ("-3", "-3.0002")),
        (1.0, 1 + 2**-52, ("1", "1.0000000000000002")),
    ],
)  # fmt: skip
def test_numbers_have_the_digits_that_tell_them_apart(
    measured: float, expected: float, words: tuple[str, str]
) -> None:
    assert apart(measured, expected) == words


def test_an_engine_that_is_missing_is_said_to_be(monkeypatch: pytest.MonkeyPatch) -> None:
    def run(*_: object) -> hc.Result:
        raise BackendMissing("there is no Yade")

    monkeypatch.setattr(hc.Yade, "run", run)
    comparison = hc.compare(SCENE, ["native", "yade"])
    assert (comparison.missing, comparison.verdict) == (True, "fail")
    assert failed(comparison.checks) == {"yade: not run"}


# Formulas


def test_formulas_vs_the_theory_with_p_and_wave_force_of_the_run(
    native_only: hc.Comparison,
) -> None:
    """Eq. 6 as corrected, by hand: LM 2, n 2, p 9."""
    force = native_only.native.peak_force
    contact = np.arange(2, 10)
    eq6 = force[10 - 2] * 2.0 ** (15 * (contact - 9) / (8 * contact * 9 * np.sqrt(2.0)))
    values = native_only.formulas
    assert values.eq6[:8] == pytest.approx(eq6, rel=1e-14, abs=0)
    j = (np.arange(2, 11) - 2) / 8
    eq9 = eq6[0] + (force[8] - eq6[0]) / 10 * (25 * j - 24 * j**2 + 9 * j**3)
    assert values.eq9[:9] == pytest.approx(eq9, rel=1e-14, abs=0)
    # Table 2 has 8.3 for this scene.
    assert values.transition_granules == pytest.approx(8.3, abs=0.05)
    # The paper's 7/10 over the exact coefficient.
    ratio = 0.7 / theory.solitary_wave.speed_coefficient()
    assert values.speed / values.exact_speed == pytest.approx(ratio, rel=1e-14, abs=0)


@pytest.mark.lammps
@pytest.mark.parametrize(
    ("peak_force", "momentum_ratio", "n"),
    [
        (1e-3, 0.5, 2.0),  # a weak shock: LAMMPS loses digits, which the tolerances know of
        (1.1e3, 0.077, 10.3),  # a short pulse: velocity Verlet's work is off by 3e-5
    ],
)
def test_scenes_hard_for_lammps_pass(peak_force: float, momentum_ratio: float, n: float) -> None:
    pulse = hc.Pulse("cosine-triangular", peak_force, n, momentum_ratio=momentum_ratio)
    scene = hc.Scene(hc.Chain(4, **STEEL), pulse)
    assert failed(hc.compare(scene).checks) == set()


# Against the reference, contact by contact

STRUCK = hc.Scene(hc.Chain(8, **STEEL), hc.Striker(1.0), wall=hc.Wall("rigid"))


@pytest.fixture(scope="module")
def reference() -> hc.Result:
    return hc.Native("reference").run(STRUCK)


def verdicts(result: hc.Result, reference: hc.Result) -> dict[str, bool]:
    return {
        check.kind.name.split()[0]: check.passed for check in reference_checks(result, reference)
    }


def other(reference: hc.Result, force: float = 0.0, late: float = 0.0) -> hc.Result:
    """The reference with errors of 1e-5 and 1e-9 s, and one first pulse off by these numbers."""
    first, errors = reference.first_pulses, reference.errors
    assert first is not None
    assert errors is not None
    size = first.force.size
    third: FloatArray = np.arange(size) == 3
    said = replace(errors, first=np.full(size, 1e-5), arrival=np.full(size, 1e-9))
    moved = replace(
        first, force=first.force * (1 + force * third), arrival=first.arrival + late * third
    )
    return replace(reference, first_pulses=moved, errors=said)


def test_no_clear_pulse_is_no_check(reference: hc.Result) -> None:
    """As where a piston presses a chain onto a wall: nothing comes alone."""
    first = reference.first_pulses
    assert first is not None
    blurred = replace(reference, first_pulses=replace(first, is_clear=first.is_clear & False))
    assert verdicts(other(reference), blurred) == {"peaks": True}


@pytest.mark.parametrize(("part", "passed"), [(3.0, False), (-3.0, False), (1 / 3, True)])
@pytest.mark.parametrize("what", ["first", "arrivals", "gauges"])
def test_numbers_of_the_wave(reference: hc.Result, what: str, part: float, passed: bool) -> None:
    """One is off by parts of what both say of their errors."""
    true, changed = reference, other(reference, force=part * 1e-5)
    if what == "arrivals":
        changed = other(reference, late=part * 1e-9)
    elif what == "gauges":
        gauges = hc.Gauge(granule=4), hc.Gauge(contact=3)
        true = hc.Native("reference").run(replace(STRUCK, gauges=gauges))
        gauge, two = true.gauges
        off = part * gauge.force * 2 * gauge.force_error
        changed = replace(true, gauges=(replace(gauge, force=gauge.force + off), two))
    right = dict.fromkeys(verdicts(true, true), True)
    assert set(right) >= {"peaks", "first", "arrivals", what}
    assert verdicts(changed, true) == right | {what: passed}


def test_a_pulse_that_is_missing_fails(reference: hc.Result) -> None:
    first, errors = reference.first_pulses, reference.errors
    assert first is not None
    assert errors is not None
    assert errors.first is not None
    gone = np.arange(first.force.size) == 3
    lacks = replace(
        reference,
        first_pulses=first.only(~gone),
        errors=replace(errors, first=np.where(gone, np.nan, errors.first)),
    )
    assert not verdicts(lacks, reference)["first"]
    # One of which no digit is known has an error: nothing is said of it.
    unknown = replace(lacks, errors=replace(errors, first=np.where(gone, 0.5, errors.first)))
    assert verdicts(unknown, reference)["first"]


def test_contacts_without_a_digit_are_not_judged(reference: hc.Result) -> None:
    errors = reference.errors
    assert errors is not None
    wrong = reference.peak_force.copy()
    wrong[3] *= 1.5
    chaotic = replace(errors, peak=np.where(np.arange(wrong.size) == 3, 0.6, errors.peak))
    assert verdicts(replace(reference, peak_force=wrong, errors=chaotic), reference)["peaks"]
    assert not verdicts(replace(reference, peak_force=wrong), reference)["peaks"]
    lost = replace(errors, peak=np.full(wrong.size, 1.5))
    assert "peaks" not in verdicts(replace(reference, errors=lost), reference)


def test_the_reference_is_asked_for_first_pulses(reference: hc.Result) -> None:
    """Late collisions may leave no digit of the peaks."""
    assert yardstick_check(replace(reference, error_estimate=1.0)).passed
    errors = reference.errors
    assert errors is not None
    assert errors.first is not None
    worse = replace(errors, first=errors.first + 3e-6)
    assert not yardstick_check(replace(reference, errors=worse)).passed


def test_runs_without_any_force_agree() -> None:
    """The striker has not crossed its gap yet."""
    scene = hc.Scene(hc.Chain(5, **STEEL, gap=1e-3), hc.Striker(1.0), hc.Run(1e-5))
    reference = hc.Native("reference").run(scene)
    assert verdicts(hc.Native().run(scene), reference) == {"peaks": True}
    pressed = replace(reference, peak_force=reference.peak_force + 1.0)
    assert verdicts(pressed, reference) == {"peaks": False}
