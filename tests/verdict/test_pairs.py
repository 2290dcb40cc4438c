"""Two mistakes at once, new single ones, peaks without a cause, and the time of the search."""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from io import StringIO

import numpy as np
import pytest
from rich.console import Console

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.engines.native.damped_verlet import simulate_damped_verlet
from hertzchain.limits import Deadline
from hertzchain.report.console import print_document
from hertzchain.report.judgement import of_judgement
from hertzchain.scene.pulse import PROFILES, profile_named
from hertzchain.scene.terms import DampingLaw
from hertzchain.verdict import causes
from hertzchain.verdict.case import Case, Cause
from hertzchain.verdict.mistaken import (
    OTHER_PROFILES,
    Mistakes,
    Runs,
    damped_verlet_peaks,
    mistaken_scene,
)
from hertzchain.verdict.pairs import Pair, can_be_paired
from hertzchain.verdict.slips import slips_of_stretch
from hertzchain.verdict.step_causes import round_steps
from tests.conftest import paper_scene
from tests.effort import effort

SCENE = paper_scene("cosine-triangular", 2.0, 2.0)
assert isinstance(SCENE.shock, hc.Pulse)
PULSE = replace(SCENE.shock, momentum_ratio=None, rise_time=SCENE.rise_time)
IN_SECONDS = replace(SCENE, shock=PULSE)
STEP = 2e-6


@dataclass(frozen=True)
class Planted:
    """A mistake: its change of a scene, its effect on peaks, its step, and its name."""

    words: str
    scene: Callable[[hc.Scene], hc.Scene] = lambda scene: scene
    scale: float = 1.0
    dt: float | None = None


def with_chain(**other: object) -> Callable[[hc.Scene], hc.Scene]:
    return lambda scene: replace(scene, chain=replace(scene.chain, **other))  # type: ignore[arg-type]


def with_pulse(**other: object) -> Callable[[hc.Scene], hc.Scene]:
    return lambda scene: replace(scene, shock=replace(scene.shock, **other))  # type: ignore[arg-type]


PLANTED = {
    "stiffness": Planted("contact stiffness 2 times", with_chain(young_modulus=2 * 193e9)),
    "step": Planted("velocity Verlet with steps of", dt=STEP),
    "damping": Planted(
        "damping of restitution 0.9",
        lambda scene: replace(scene, contact=hc.Contact("restitution", restitution=0.9)),
    ),
    "profile": Planted("profile triangular in place of", with_pulse(profile="triangular")),
    "granules": Planted("a chain of 61 granules", with_chain(granules=61)),
    "units": Planted("in units of lbf", scale=1 / 4.4482216152605),
}


def peaks_of(*mistakes: Planted) -> FloatArray:
    """Peaks of the scene with mistakes, by the engines that users have."""
    scene, scale = IN_SECONDS, 1.0
    dt = next((one.dt for one in mistakes if one.dt), None)
    for one in mistakes:
        scene, scale = one.scene(scene), scale * one.scale
    run = hc.Native(rtol=1e-8) if dt is None else hc.Native("velocity-verlet", dt)
    return scale * run.run(scene).peak_force[:59]


def judged(peaks: FloatArray, scene: hc.Scene = SCENE) -> hc.Judgement:
    return hc.judge(scene, peaks, tolerance=1e-6)


QUICK = {("stiffness", "profile")}
NOT_BOTH = {("stiffness", "units"), ("step", "damping")}
"""Pairs of which one is named, or none: others do nearly the same, or runs take too long."""


def slow(*case: object) -> object:
    return pytest.param(*case, marks=pytest.mark.slow)


@pytest.mark.parametrize(
    ("one", "other"),
    [pair if pair in QUICK else slow(*pair) for pair in itertools.combinations(PLANTED, 2)],
)
def test_two_mistakes_are_both_named(one: str, other: str) -> None:
    cause = judged(peaks_of(PLANTED[one], PLANTED[other])).cause or ""
    # A stiffness with a unit is also a stiffness with a force, which is named after it.
    cause = cause.split("; or ")[0]
    words = {PLANTED[one].words, PLANTED[other].words}
    found = {name for name in words if name in cause}
    if (one, other) in NOT_BOTH:
        assert len(cause.split(", together with ")) == len(found) or not cause
    else:
        assert found == words


@pytest.mark.parametrize(
    "name", ["granules", *(slow(name) for name in PLANTED if name != "granules")]
)
def test_one_mistake_is_named_alone(name: str) -> None:
    cause = judged(peaks_of(PLANTED[name])).cause or ""
    assert PLANTED[name].words in cause
    assert "together with" not in cause


def test_a_step_that_is_not_given_is_found() -> None:
    cause = judged(peaks_of(PLANTED["step"])).cause or ""
    assert f"velocity Verlet with steps of about {STEP:g} s" in cause


@pytest.mark.parametrize("sampled", [slow(False), True])
def test_a_round_step_past_the_corners_is_found(sampled: bool) -> None:
    """Steps of 2 us throughout, and peaks that are the highest samples."""
    contacts = SCENE.chain.granules - 1
    u, v = np.zeros(60), np.zeros(60)
    chain = SCENE.chain
    stiffness, mass = chain.contact_stiffness, chain.granule_mass
    times = np.arange(math.ceil(SCENE.end_time / STEP) + 1) * np.float64(STEP)
    applied = SCENE.applied_force(times)
    contact = np.zeros((times.size, contacts))
    for k, force in enumerate(applied):
        contact[k] = stiffness * np.maximum(-np.diff(u), 0.0) ** 1.5
        a = (np.append(force, contact[k]) - np.append(contact[k], 0.0)) / mass
        if k:
            v += STEP / 2 * a
        v += STEP / 2 * a
        u += STEP * v
    top = np.argmax(contact, axis=0)
    here = np.arange(contacts)
    before, most, after = (contact[top + off, here] for off in (-1, 0, 1))
    # Parabolas of steps of 0.14 natural units leave 1e-5 of the peaks.
    peaks = most - (after - before) ** 2 / (8 * (before - 2 * most + after))
    cause = judged(most if sampled else peaks).cause or ""
    what = "samples in place of maxima" if sampled else "what velocity Verlet"
    assert cause.startswith(what)
    assert "2e-06 s, past the corners of the pulse" in cause


def test_round_steps_are_not_tried_where_the_step_is_known() -> None:
    case = case_of(1.01 * truth(), dt=1e-6)
    assert list(round_steps(case)) == []


@functools.cache
def truth() -> FloatArray:
    return hc.Native("reference").run(SCENE).peak_force


def case_of(
    peaks: FloatArray, scene: hc.Scene = SCENE, dt: float | None = None, tolerance: float = 1e-6
) -> Case:
    reference = hc.Native("reference").run(scene)
    return Case(scene, reference, peaks, np.isfinite(peaks), dt, tolerance, Deadline(60.0))


# Single mistakes


def quarter_sine(scene: hc.Scene) -> FloatArray:
    """Peaks under a half sine, as a fine table of it."""
    t0 = scene.rise_time
    assert t0 is not None
    times = np.linspace(0.0, 2 * t0, 2001)
    force = np.maximum(100.0 * np.sin(np.pi / 2 * times / t0), 0.0)
    table = hc.PulseTable(tuple(times.tolist()), tuple(force.tolist()))
    return hc.Native(rtol=1e-8).run(replace(scene, shock=table)).peak_force


def test_a_half_sine_is_named() -> None:
    cause = judged(quarter_sine(SCENE)).cause or ""
    assert cause.startswith("profile half sine in place of cosine-triangular; leaves")


def test_a_force_in_steps_is_named() -> None:
    t0 = SCENE.rise_time
    assert t0 is not None
    times = np.linspace(0.0, 2 * t0, 11)[:-1]
    force = SCENE.applied_force(times)
    ends = np.append(times[1:], 2 * t0) * (1 - 1e-9)
    rows = np.stack([times, ends], axis=1).ravel()
    forces = np.repeat(force, 2)
    table = hc.PulseTable(tuple(rows.tolist()), tuple(forces.tolist()))
    peaks = hc.Native(rtol=1e-8).run(replace(SCENE, shock=table)).peak_force
    cause = judged(peaks).cause or ""
    assert cause.startswith("force held constant in 10 steps of the pulse; leaves")


@pytest.mark.parametrize(
    ("ratio", "kept", "words"),
    [
        slow(3.0, "rise", "duration ratio 3 in place of 2, at the same rise time"),
        (3.0, "whole", "duration ratio 3 in place of 2, in a pulse that lasts as long"),
    ],
)
def test_another_duration_ratio_is_named(ratio: float, kept: str, words: str) -> None:
    t0 = SCENE.rise_time
    assert t0 is not None
    rise = t0 if kept == "rise" else t0 * 2 / ratio
    pulse = replace(PULSE, duration_ratio=ratio, rise_time=rise)
    peaks = hc.Native(rtol=1e-8).run(replace(SCENE, shock=pulse)).peak_force
    assert (judged(peaks).cause or "").startswith(words)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"young_modulus": 1.5 * 193e9}, "the factor 2/3 is missing"),
        slow({"young_modulus": 193e9 / 2.6}, "shear modulus in place of E"),
        slow({"density": 7.958}, "density in g/cm^3 taken for kg/m^3"),
        slow({"young_modulus": 1930e9}, "E in dyn/cm^2 taken for Pa"),
        # The diameter is 1 m when the density makes the mass.
        ({"density": 7958.0 / 0.0095**3}, "density set before the diameter"),
    ],
)
def test_slips_in_the_chain_are_named(change: dict[str, float], words: str) -> None:
    peaks = hc.Native(rtol=1e-8).run(with_chain(**change)(IN_SECONDS)).peak_force
    assert words in (judged(peaks).cause or "")


def test_a_run_that_ends_before_the_wave_is_through_is_named() -> None:
    heavy = with_chain(density=7958.0 / 0.0095**3)(IN_SECONDS)
    ended = replace(heavy, run=hc.Run(SCENE.end_time))
    cause = judged(hc.Native(rtol=1e-8).run(ended).peak_force).cause or ""
    assert cause.startswith("density set before the diameter")
    assert "in a run that ends with that of the scene" in cause


@pytest.mark.slow
def test_a_force_in_kilograms_is_named() -> None:
    for factor, words in ((9.80665, "F0 in N taken for kgf"), (1 / 9.80665, "F0 in kgf taken")):
        scene = replace(IN_SECONDS, shock=replace(PULSE, peak_force=100.0 * factor))
        assert words in (judged(hc.Native(rtol=1e-8).run(scene).peak_force).cause or "")


def test_slips_of_a_mass_follow_from_the_radius() -> None:
    # The mass goes as the diameter cubed, the stretch as the mass to the power of -1/2.
    assert slips_of_stretch(SCENE)["density set before the diameter"] == pytest.approx(
        (0.0095**3) ** 0.5, rel=1e-12, abs=0
    )


# Peaks without a cause


def noise(draw: np.random.Generator) -> FloatArray:
    return truth() * (1 + 10 ** draw.uniform(-9, -2) * draw.standard_normal(59))


def smooth(draw: np.random.Generator) -> FloatArray:
    x, waves = np.linspace(0, 1, 59), range(1, int(draw.integers(2, 6)))
    size = 10 ** draw.uniform(-5, -0.7)
    return truth() * np.exp(
        size
        * sum(draw.standard_normal() * np.cos(np.pi * k * x + draw.uniform(0, 6)) for k in waves)
    )


@pytest.mark.parametrize("make", [noise, smooth])
@pytest.mark.parametrize("seed", [0, *(slow(seed) for seed in range(1, 50))])
def test_random_peaks_have_no_cause(
    make: Callable[[np.random.Generator], FloatArray], seed: int
) -> None:
    found = judged(make(np.random.default_rng(seed)))
    assert found.cause is None
    if found.verdict == "fail" and found.largest_difference is not None:
        # Below 1e-7 nothing is sought.
        assert found.largest_difference < 1e-6 or (found.hint or "").startswith("no single known")


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(50))
def test_a_contact_that_is_off_is_all_that_is_named(seed: int) -> None:
    draw = np.random.default_rng(seed)
    contact = int(draw.integers(0, 56))
    peaks = truth() * (1 + 1e-8 * draw.standard_normal(59))
    peaks[contact] *= 1 + 10 ** draw.uniform(-4, -0.5)
    assert (judged(peaks).cause or "").startswith(f"contact {contact + 2} alone")


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(50))
def test_of_three_mistakes_none_is_named_that_was_not_made(seed: int) -> None:
    draw = np.random.default_rng(seed)
    stiffness, longer, force = np.exp(draw.uniform(0.2, 0.7, 3) * draw.choice([-1, 1], 3))
    others = [name for name in PROFILES if name != PULSE.profile]
    profile = profile_named(str(draw.choice(others)))
    pulse = replace(
        PULSE, profile=profile, duration_ratio=1 + float(longer), peak_force=100.0 * float(force)
    )
    chain = replace(SCENE.chain, young_modulus=193e9 * float(stiffness))
    peaks = hc.Native(rtol=1e-8).run(hc.Scene(chain, pulse)).peak_force
    cause = judged(peaks).cause or ""
    for other in ("damping", "velocity Verlet", "granules", "samples", "numbered", "late", "pull"):
        assert other not in cause, cause


# The rules


def found_with(
    monkeypatch: pytest.MonkeyPatch,
    single: float,
    *pairs: float,
    size: float = 0.01,
    tolerance: float = 1e-3,
    is_noise: bool = False,
) -> causes.Explanation:
    """Return the explanation for given residuals of one mistake and of pairs."""
    signs = np.where(np.arange(59) % 2, 1.0, -1.0)
    case = case_of(truth() * np.exp(size * signs), tolerance=tolerance)
    made = [Named((), Mistakes(), 1.0, f"pair {k}", left * size) for k, left in enumerate(pairs)]
    rest = single * size * signs if is_noise else None
    one = {"this": lambda case: iter([Cause("this", single * case.size, rest)])}
    monkeypatch.setattr(causes, "FINDERS", one)
    monkeypatch.setattr(causes, "pairs", lambda _: made)
    return causes.likely_cause(case)


class Named(Pair):
    """A pair whose name is given."""

    def words(self, _: hc.Scene) -> str:
        """The name."""
        return self.numbers


def test_a_pair_is_named_that_leaves_little(monkeypatch: pytest.MonkeyPatch) -> None:
    for left, named in ((0.0029, True), (0.0031, False)):
        found = found_with(monkeypatch, 0.5, left, 0.9)
        assert (found.cause is not None and "pair 0" in found.cause) is named
        assert (found.hint is None) is named


def test_a_pair_has_to_leave_a_tenth_of_what_one_does(monkeypatch: pytest.MonkeyPatch) -> None:
    for single, words in ((0.0098, "this; leaves"), (0.0102, "pair 0; leaves")):
        found = found_with(monkeypatch, single, 0.001, 0.9)
        assert (found.cause or "").startswith(words)


def test_other_pairs_have_to_leave_much_more(monkeypatch: pytest.MonkeyPatch) -> None:
    for other, named in ((0.0098, False), (0.0102, True)):
        found = found_with(monkeypatch, 0.5, 0.001, other)
        assert (found.cause is not None) is named
        assert ("Several pairs of mistakes do" in (found.hint or "")) is not named
    together = found_with(monkeypatch, 0.5, 0.001, 0.0029, 0.9).cause or ""
    assert together.startswith("pair 0; or pair 1; leaves")


def test_pairs_are_not_sought_where_one_is_enough_or_little_is_off(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for single, words in ((0.98e-4, "this"), (1.02e-4, "pair 0")):
        assert (found_with(monkeypatch, single, 1e-6, 0.9).cause or "").startswith(words)
    for size, words in ((0.98e-4, ""), (1.02e-4, "pair 0")):
        cause = found_with(monkeypatch, 0.5, 1e-6, 0.9, size=size).cause or ""
        assert cause.startswith(words)
        assert bool(cause) is bool(words)


def test_a_mistake_that_leaves_more_than_noise_is_a_hint(monkeypatch: pytest.MonkeyPatch) -> None:
    """If two mistakes leave half of what one leaves, more than one mistake is present."""
    for pair, named in ((0.026, True), (0.024, False)):
        found = found_with(monkeypatch, 0.05, pair, tolerance=1e-6, is_noise=True)
        assert (found.cause is not None) is named
        assert (found.hint is None) is named


@pytest.mark.parametrize("pairs", [(), (0.004,)])
def test_a_cause_leaves_no_more_than_is_allowed(
    pairs: tuple[float, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Unless that is noise: whoever mends a part of what is wrong has still to look further."""
    for tolerance, named in ((5.1e-4, True), (4.9e-4, False)):
        found = found_with(monkeypatch, 0.05, *pairs, tolerance=tolerance)
        assert (found.cause is not None) is named
        assert (found.hint is None) is named
    for tolerance, named in ((2.95e-5, True), (2.85e-5, False)):
        found = found_with(monkeypatch, 0.5, 0.0029, 0.9, tolerance=tolerance)
        assert (found.cause is not None) is named
        several = found_with(monkeypatch, 0.5, 0.0029, 0.02, tolerance=tolerance).hint or ""
        assert ("Several pairs" in several) is named
    # Fits are known to 1e-4 of the differences.
    for single, named in ((0.98e-4, True), (1.02e-4, False)):
        found = found_with(monkeypatch, single, tolerance=1e-9)
        assert (found.cause is not None) is named


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(12))
def test_of_three_mistakes_no_single_one_is_the_cause(seed: int) -> None:
    """A unit, and two that do little beside it: the unit with a factor that fits is not all."""
    draw = np.random.default_rng(seed)
    profile = str(draw.choice([name for name in PROFILES if name != PULSE.profile]))
    ratio = 2.0 * float(np.exp(draw.uniform(0.2, 0.6) * draw.choice([-1, 1])))
    pulse = replace(PULSE, profile=profile_named(profile), duration_ratio=max(ratio, 1.2))
    peaks = hc.Native(rtol=1e-8).run(replace(IN_SECONDS, shock=pulse)).peak_force / 9.80665
    found = hc.judge(SCENE, peaks)
    assert found.cause is None or "together with" in found.cause


def test_what_is_left_is_noise_where_it_jumps() -> None:
    draw = np.random.default_rng(0)
    assert Cause("", 0.0, draw.standard_normal(59)).leaves_noise
    assert not Cause("", 0.0, np.cos(np.linspace(0, 6, 59))).leaves_noise
    assert not Cause("", 0.0).leaves_noise  # as far as is known
    last_alone = np.append(1e-3 * draw.standard_normal(58), 1.0)
    assert not Cause("", 0.0, last_alone).leaves_noise
    # The square of jumps over that of values, of values 1 and x in turn: 2 (1 - x)^2 / (1 + x^2).
    for x, is_noise in ((0.2, True), (0.22, False)):
        rest = np.where(np.arange(1000) % 2, 1.0, x)
        assert Cause("", 0.0, rest).leaves_noise is is_noise


def test_the_hint_says_what_is_nearest_and_what_it_leaves(monkeypatch: pytest.MonkeyPatch) -> None:
    nothing = "no single known mistake explains these peaks"
    assert found_with(monkeypatch, 0.069, tolerance=1e-6).hint == (
        f"{nothing}. The nearest is: this; it leaves 6.9 % of the differences"
    )
    far = f"{nothing}, and none leaves less than 7 % of the differences"
    for left in (0.071, 0.5):
        assert found_with(monkeypatch, left, tolerance=1e-6).hint == far


def test_the_hint_of_a_scene_with_terms_says_what_was_tried() -> None:
    scene = replace(paper_scene("cosine", 1.0, 2.0, 16), wall=hc.Wall("rigid"))
    peaks = hc.Native("reference").run(scene).peak_force
    found = hc.judge(scene, peaks * (1 + 0.01 * np.random.default_rng(0).standard_normal(15)))
    assert found.cause is None
    assert (found.hint or "").startswith("no mistake that was tried explains these peaks")
    assert found.to_dict()["hint"] == found.hint
    document = of_judgement(found)
    assert [(one.name, one.advice) for one in document.verdict.failures] == [("Hint", found.hint)]
    assert f"Hint: {found.hint}" in document.cases[0].text
    text = StringIO()
    print_document(Console(file=text, width=1000), document)
    assert "\nNo mistake that was tried explains these peaks" in text.getvalue()
    assert "Likely cause" not in text.getvalue()


def test_pairs_need_a_dozen_contacts_of_a_plain_scene() -> None:
    for granules, sought in ((12, False), (13, True)):
        scene = paper_scene("cosine", 1.0, 2.0, granules)
        assert can_be_paired(case_of(np.ones(granules - 1), scene)) is sought
    damped = replace(SCENE, contact=hc.Contact("dashpot", coefficient=1.0))
    assert not can_be_paired(case_of(np.ones(59), damped))


# Deliberate mistakes


@pytest.mark.parametrize("profile", [name for name in OTHER_PROFILES if name in PROFILES])
def test_runs_are_right_to_a_ten_millionth(profile: str) -> None:
    made = Mistakes(stretch=1.3, force=0.8, profile=profile, duration=1.5, granules=1)
    found = Runs(SCENE, Deadline(60.0)).peaks(made)
    pulse = hc.Pulse(profile_named(profile), 80.0, 2.5, rise_time=SCENE.rise_time)
    chain = replace(SCENE.chain, granules=61, young_modulus=1.3**3 * 193e9)
    right = hc.Native("reference").run(hc.Scene(chain, pulse)).peak_force[:59]
    np.testing.assert_allclose(found, right, rtol=1e-7, atol=0)


@pytest.mark.parametrize("law", ["restitution", "viscoelastic", "dashpot"])
def test_damped_runs_of_velocity_verlet_are_near_those_of_the_engine(law: DampingLaw) -> None:
    scene = mistaken_scene(SCENE, Mistakes(law=law, strength=0.1))
    legs = scene.schedule(0.1 * scene.units.time)
    right = simulate_damped_verlet(scene, legs).peaks.force
    # Parabolas: 2.1e-4 of the peaks measured at this step.
    np.testing.assert_allclose(damped_verlet_peaks(scene, legs), right, rtol=3e-4, atol=0)


def test_a_run_that_cannot_be_has_no_peaks() -> None:
    runs = Runs(SCENE, Deadline(60.0))
    assert np.isnan(runs.peaks(Mistakes(dt=3.0))).all()


def test_looking_for_two_mistakes_takes_seconds() -> None:
    peaks = peaks_of(PLANTED["stiffness"], PLANTED["damping"])
    # In units of 0.03 s; 1.5 to 2.8 s measured, on two cores with a dozen processes.
    assert effort(lambda: judged(peaks)) < 130
