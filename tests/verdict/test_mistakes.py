"""Known mistakes, planted one at a time: each is named, and what is none is not."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.arrays import Array, FloatArray
from hertzchain.limits import Deadline
from hertzchain.scene.pulse import profile_named
from hertzchain.verdict import step_mistakes
from hertzchain.verdict.case import Case
from hertzchain.verdict.mistakes import with_rise_time
from tests.conftest import paper_scene

SCENES = ("cosine-triangular", 2.0, 2.0, 20), ("cosine", 0.3, 2.0, 20)


@dataclass(frozen=True)
class Planting:
    """A scene to plant mistakes in: as it is, with its rise time in seconds, and its peaks."""

    scene: hc.Scene
    in_seconds: hc.Scene
    truth: FloatArray

    def chain(self, **other: object) -> FloatArray:
        """Peaks of another chain."""
        chain = replace(self.in_seconds.chain, **other)  # type: ignore[arg-type]
        return exact(replace(self.in_seconds, chain=chain))

    def pulse(self, **other: object) -> FloatArray:
        """Peaks under another pulse."""
        shock = replace(self.in_seconds.shock, **other)
        return exact(replace(self.in_seconds, shock=shock))

    def samples(self, h: float) -> FloatArray:
        """Highest samples of an accurate run, ``h`` seconds apart."""
        times = np.arange(0.0, self.scene.end_time, h)
        history = hc.Native(rtol=1e-8).run(self.scene, record=times).history
        return np.asarray(history.contact_force.max(axis=0))


@functools.cache
def planting(key: tuple[str, float, float, int]) -> Planting:
    scene = paper_scene(*key)
    return Planting(scene, with_rise_time(scene), exact(scene))


def exact(scene: hc.Scene) -> FloatArray:
    return hc.Native(rtol=1e-8, peaks_only=True).run(scene).peak_force


def judged(at: Planting, peaks: Array, tolerance: float = 5e-4) -> hc.Judgement:
    return hc.judge(at.scene, peaks, tolerance=tolerance)


def plain_code(scene: hc.Scene, dt: float, sampled: bool) -> FloatArray:
    """Another code, in natural units: equal steps, past the corners, and parabolas or samples."""
    granules, unit = scene.chain.granules, scene.units
    u: Array = np.zeros(granules)
    v: Array = np.zeros(granules)
    highest: Array = np.zeros(granules - 1)
    before = now = highest
    times = dt * np.arange(math.ceil(scene.end_time / unit.time / dt) + 1)
    applied = scene.applied_force(np.asarray(times * unit.time, np.float64)) / unit.force
    a: Array = np.zeros(granules)
    for k in range(1, times.size):
        half = v + dt / 2 * a
        u = u + dt * half
        after = np.maximum(u[:-1] - u[1:], 0) ** 1.5
        a = np.append(applied[k], after) - np.append(after, 0)
        v = half + dt / 2 * a
        bend = np.minimum(before - 2 * now + after, -1e-300)
        turns = (now >= before) & (now > after) & (not sampled)
        top = np.where(turns, now - (after - before) ** 2 / (8 * bend), after)
        highest, before, now = np.maximum(highest, top), now, after
    return np.asarray(highest * unit.force)


def verlet(at: Planting, dt: float) -> FloatArray:
    return hc.Native("velocity-verlet", dt).run(at.scene).peak_force


def damped(at: Planting, damping: hc.Contact) -> FloatArray:
    return exact(replace(at.scene, contact=damping))


def past_the_corners(at: Planting, sampled: bool) -> FloatArray:
    """Peaks of steps of 2 us throughout, or the highest samples."""
    return plain_code(at.scene, 2e-6 / at.scene.units.time, sampled=sampled)


Plant = Callable[[Planting], Array]

CHAIN: dict[str, tuple[Plant, str]] = {
    "E halved": (lambda at: at.chain(young_modulus=193e9 / 2), "contact stiffness 0.5 times"),
    "E 3 % off": (lambda at: at.chain(young_modulus=1.03 * 193e9), "contact stiffness 1.03 times"),
    "E 8 times": (lambda at: at.chain(young_modulus=8 * 193e9), "contact stiffness 8 times"),
    "no nu": (lambda at: at.chain(poisson_ratio=0.0), "E in place of E/(1 - nu^2)"),
    "no 2/3": (lambda at: at.chain(young_modulus=1.5 * 193e9), "the factor 2/3 is missing"),
    "shear": (lambda at: at.chain(young_modulus=193e9 / 2.6), "shear modulus in place of E"),
    "diameter": (lambda at: at.chain(radius=9.5e-3), "diameter taken for radius"),
    "g/cm^3": (lambda at: at.chain(density=7.958), "density in g/cm^3 taken for kg/m^3"),
    "dyn/cm^2": (lambda at: at.chain(young_modulus=193e10), "E in dyn/cm^2 taken for Pa"),
    "printed": (lambda at: at.chain(young_modulus=193e9**0.5), "Eq. 1 as printed"),
    # The diameter is 1 m when the density makes the mass.
    "mass": (lambda at: at.chain(density=7958 / 0.0095**3), "density set before the diameter"),
    "longer": (
        lambda at: at.chain(granules=at.scene.chain.granules + 1)[:-1],
        "a chain of 21 granules, not 20",
    ),
    "shorter": (
        lambda at: np.append(at.chain(granules=at.scene.chain.granules - 1), np.nan),
        "a chain of 19 granules, not 20",
    ),
}
PULSE: dict[str, tuple[Plant, str]] = {
    "force": (lambda at: at.pulse(peak_force=110.0), "applied force 1.1 times"),
    "kgf": (lambda at: at.pulse(peak_force=980.665), "F0 in N taken for kgf"),
    "N": (lambda at: at.pulse(peak_force=100 / 9.80665), "F0 in kgf taken for N"),
    "profile": (lambda at: at.pulse(profile=profile_named("triangular")), "profile "),
    "longer decay": (
        lambda at: at.pulse(duration_ratio=3.0),
        "duration ratio 3 in place of 2, at the same rise time",
    ),
    "shorter rise": (
        lambda at: at.pulse(duration_ratio=3.0, rise_time=(at.scene.rise_time or 0) * 2 / 3),
        "duration ratio 3 in place of 2, in a pulse that lasts as long",
    ),
}
PEAKS: dict[str, tuple[Plant, str]] = {
    "kN": (lambda at: 1e-3 * at.truth, "in units of kN"),
    "dyn": (lambda at: 1e5 * at.truth, "in units of dyn"),
    "F0": (lambda at: 0.01 * at.truth, "in units of F0"),
    "lbf": (lambda at: at.truth / 4.4482216, "in units of lbf"),
    "kgf read": (lambda at: at.truth / 9.80665, "in units of kgf"),
    "noisy kN": (
        lambda at: 1e-3 * at.truth * (1 + 2e-3 * np.random.default_rng(0).standard_normal(19)),
        "in units of kN; leaves",
    ),
    "after": (lambda at: np.append(at.truth[1:], np.nan), "peak of contact i + 1"),
    "before": (lambda at: np.append(np.nan, at.truth[:-1]), "peak of contact i - 1"),
    "far end": (lambda at: at.truth[::-1], "from the far end"),
    "one": (lambda at: np.where(np.arange(19) == 3, 1.1, 1) * at.truth, "contact 5 alone"),
    "samples": (lambda at: at.samples(1.5e-6), "samples in place of maxima, 1.5e-06 s apart, of"),
    "rare samples": (lambda at: at.samples(4e-6), "samples in place of maxima, 4e-06 s apart, of"),
    "3 digits": (
        lambda at: np.array([float(f"{force:.3g}") for force in at.truth]),
        "rounding: these are the scene's own peaks to 3 digits",
    ),
    "whole": (lambda at: np.round(at.truth), "rounding: these are the scene's own peaks to "),
}
MOTION: dict[str, tuple[Plant, str]] = {
    "steps": (lambda at: verlet(at, 1.5e-6), "velocity Verlet with steps of about 1.5e-06 s"),
    "corners": (lambda at: past_the_corners(at, False), "2e-06 s, past the corners of the pulse"),
    "sampled": (lambda at: past_the_corners(at, True), "samples in place of maxima, velocity Ver"),
    "Tsuji": (
        lambda at: damped(at, hc.Contact("restitution", restitution=0.819)),
        "of restitution 0.819",
    ),
    "dashpot": (
        lambda at: damped(at, hc.Contact("dashpot", coefficient=4.9)),
        "by dashpots of 4.9 kg/s",
    ),
    "viscoelastic": (
        lambda at: damped(at, hc.Contact("viscoelastic", relaxation_time=1.9e-8)),
        "of viscoelastic spheres with the relaxation time 1.9e-08 s",
    ),
}
MISTAKES = CHAIN | PULSE | PEAKS | MOTION
SLOW = "shear", "N", "kgf read", "samples", "dashpot"


@pytest.mark.parametrize(
    ("key", "name"),
    [
        pytest.param(
            SCENES[k % 2], name, marks=[pytest.mark.slow] * (k % 3 > 0 or name in SLOW), id=name
        )
        for k, name in enumerate(MISTAKES)
    ],
)
def test_a_mistake_is_named(key: tuple[str, float, float, int], name: str) -> None:
    at = planting(key)
    plant, words = MISTAKES[name]
    found = judged(at, plant(at))
    assert found.verdict == "fail"
    assert found.remarks == ()
    assert words in (found.cause or ""), found.hint


def test_steps_past_the_corners_of_a_pulse() -> None:
    """One leg each in the pulse, and one for all behind it; none for more than 100,000 of them."""
    scene = paper_scene(*SCENES[0])
    last = scene.ramps[-1].end
    legs = step_mistakes._past_corners(scene, last / 9.5) or []
    assert [leg.steps for leg in legs] == [*[1] * 10, math.ceil(scene.end_time / last * 9.5) - 10]
    assert legs[-1].end == pytest.approx(sum(leg.steps for leg in legs) * last / 9.5)
    assert step_mistakes._past_corners(scene, last / 100_000.5) is None


def test_usual_steps_are_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    """Up to the longest stable step: five mistakes of each."""
    monkeypatch.setattr(step_mistakes, "_ROUND", (5.0,))
    at = planting(SCENES[0])
    truth = hc.Native("reference").run(at.scene)
    case = Case(at.scene, truth, at.truth, np.ones(19, bool), None, 5e-4, Deadline(60.0), False)
    named = [one.words(0.0) for one in step_mistakes.steps_and_samples(case)]
    for step in ("5e-07 s", "5e-06 s"):
        assert sum(f"velocity Verlet with steps of {step}" in name for name in named) == 4
        assert sum(f"samples in place of maxima, {step} apart" in name for name in named) == 1
    assert len(named) == 10


def test_a_table_has_no_rise_time() -> None:
    table = hc.PulseTable((0.0, 1e-5, 2e-5), (0.0, 10.0, 0.0))
    scene = replace(paper_scene(*SCENES[0]), shock=table)
    assert with_rise_time(scene) is scene


def test_what_ends_a_cause() -> None:
    """A run that ends before its slow wave; nothing pressed at all; a step that is known."""
    at = planting(SCENES[0])
    heavy = replace(at.in_seconds.chain, density=7958.0 / 0.0095**3)
    ended = exact(replace(at.in_seconds, chain=heavy, run=hc.Run(at.scene.end_time)))
    cause = judged(at, ended).cause or ""
    assert "density set before the diameter" in cause
    assert "in a run that ends with that of the scene" in cause
    cause = judged(at, 0 * at.truth).cause or ""
    assert cause.startswith("no contact was pressed, or none was read")
    found = hc.judge(at.scene, verlet(at, 1.5e-6), dt=1.5e-6)
    assert "velocity Verlet with steps of about 1.5e-06 s has" in (found.cause or "")


# Peaks without a cause


def noise(draw: np.random.Generator, truth: FloatArray) -> FloatArray:
    return truth * (1 + 10 ** draw.uniform(-9, -2) * draw.standard_normal(truth.size))


def smooth(draw: np.random.Generator, truth: FloatArray) -> FloatArray:
    x, waves = np.linspace(0, 1, truth.size), range(1, int(draw.integers(2, 6)))
    size = 10 ** draw.uniform(-5, -0.7)
    return truth * np.exp(
        size
        * sum(draw.standard_normal() * np.cos(np.pi * k * x + draw.uniform(0, 6)) for k in waves)
    )


SEEDS = [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(1, 40))]


@pytest.mark.parametrize("make", [noise, pytest.param(smooth, marks=pytest.mark.slow)])
@pytest.mark.parametrize("seed", SEEDS)
def test_random_peaks_have_no_cause(
    make: Callable[[np.random.Generator, FloatArray], FloatArray], seed: int
) -> None:
    at = planting(SCENES[0])
    found = judged(at, make(np.random.default_rng(seed), at.truth), 1e-6)
    assert found.cause is None
    if found.verdict == "fail":
        assert (found.hint or "").startswith("no single known mistake explains these peaks")
        assert ("look like noise" in (found.hint or "")) is (make is noise)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(30))
def test_of_three_mistakes_none_is_named_that_was_not_made(seed: int) -> None:
    at = planting(SCENES[0])
    draw = np.random.default_rng(seed)
    stiffness, longer, force = np.exp(draw.uniform(0.2, 0.7, 3) * draw.choice([-1, 1], 3))
    profile = profile_named(str(draw.choice(["cosine", "triangular"])))
    pulse = hc.Pulse(profile, 100.0 * float(force), 1 + float(longer), at.in_seconds.rise_time)
    chain = replace(at.scene.chain, young_modulus=193e9 * float(stiffness))
    cause = judged(at, exact(hc.Scene(chain, pulse))).cause or ""
    for other in ("damping", "velocity Verlet", "granules", "samples", "numbered", "pull"):
        assert other not in cause, cause
