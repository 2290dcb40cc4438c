"""Slips: each that is planted is named, and no other; the rules by which a cause is named."""

from __future__ import annotations

import functools
import math
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from io import StringIO

import numpy as np
import pint
import pytest
from rich.console import Console

import hertzchain as hc
from hertzchain import slips
from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.dialect import tsuji
from hertzchain.limits import Deadline
from hertzchain.report.console import print_document
from hertzchain.report.contents import of_judgement
from hertzchain.scene.shocks import profile_named
from hertzchain.slips import Case, Family, Fit, Mistake, in_words, slips_of, with_rise_time
from hertzchain.theory.restitution import damping_ratio, of_ratio
from hertzchain.verdict import judgement
from tests.conftest import STEEL, paper_scene

SCENES = ("cosine-triangular", 2.0, 2.0, 20), ("cosine", 0.3, 2.0, 20)


@dataclass(frozen=True)
class Planting:
    """A scene to plant mistakes in: as it is, with its rise time in seconds, and its peaks."""

    scene: hc.Scene
    in_seconds: hc.Scene
    truth: FloatArray

    def other(self, part: str, **other: object) -> FloatArray:
        """Peaks of a scene with other values in its chain or shock."""
        changed = replace(getattr(self.in_seconds, part), **other)
        return exact(replace(self.in_seconds, **{part: changed}))

    def samples(self, h: float) -> FloatArray:
        """Highest samples of an accurate run, ``h`` seconds apart."""
        times = np.arange(0.0, self.scene.end_time, h)
        history = hc.Native(rtol=1e-8).run(self.scene, record=times).history
        return np.asarray(history.contact_force.max(axis=0))

    def past_corners(self, sampled: bool) -> FloatArray:
        """Another code, in natural units: equal steps of 2 us, and parabolas or samples."""
        granules, unit = self.scene.chain.granules, self.scene.units
        dt = 2e-6 / unit.time
        u: FloatArray = np.zeros(granules)
        v, a, before = u, u, u[1:]
        highest = now = before
        times = dt * np.arange(math.ceil(self.scene.end_time / unit.time / dt) + 1)
        applied = self.scene.applied_force(np.asarray(times * unit.time, np.float64)) / unit.force
        for force in applied[1:]:
            half = v + dt / 2 * a
            u = u + dt * half
            after = np.maximum(u[:-1] - u[1:], 0) ** 1.5
            a = np.append(force, after) - np.append(after, 0)
            v = half + dt / 2 * a
            bend = np.minimum(before - 2 * now + after, -1e-300)
            turns = (now >= before) & (now > after) & (not sampled)
            top = np.where(turns, now - (after - before) ** 2 / (8 * bend), after)
            highest, before, now = np.maximum(highest, top), now, after
        return np.asarray(highest * unit.force)


@functools.cache
def planting(key: tuple[str, float, float, int]) -> Planting:
    scene = paper_scene(*key)
    return Planting(scene, with_rise_time(scene), exact(scene))


def exact(scene: hc.Scene) -> FloatArray:
    return hc.Native(rtol=1e-8, peaks_only=True).run(scene).peak_force


def verlet(at: Planting, dt: float) -> FloatArray:
    return hc.Native("velocity-verlet", dt).run(at.scene).peak_force


Plant = Callable[[Planting], FloatArray]


def chain(**other: object) -> Plant:
    return lambda at: at.other("chain", **other)


def pulse(**other: object) -> Plant:
    return lambda at: at.other("shock", **other)


def peaks(change: Callable[[FloatArray], FloatArray]) -> Plant:
    return lambda at: change(at.truth)


def damped(law: str, **parameter: float) -> Plant:
    contact = hc.Contact(law, **parameter)  # type: ignore[arg-type]
    return lambda at: exact(replace(at.scene, contact=contact))


def noisy(truth: FloatArray) -> FloatArray:
    return 1e-3 * truth * (1 + 2e-3 * np.random.default_rng(0).standard_normal(19))


MISTAKES: dict[str, tuple[Plant, str]] = {
    "E halved": (chain(young_modulus=193e9 / 2), "contact stiffness 0.5 times"),
    "no nu": (chain(poisson_ratio=0.0), "E in place of E/(1 - nu^2)"),
    "no 2/3": (chain(young_modulus=1.5 * 193e9), "the factor 2/3 is missing"),
    "shear": (chain(young_modulus=193e9 / 2.6), "shear modulus in place of E"),
    "diameter": (chain(radius=9.5e-3), "diameter taken for radius"),
    "g/cm^3": (chain(density=7.958), "density in g/cm^3 taken for kg/m^3"),
    "dyn/cm^2": (chain(young_modulus=193e10), "E in dyn/cm^2 taken for Pa"),
    "printed": (chain(young_modulus=193e9**0.5), "Eq. 1 as printed"),
    # The diameter is 1 m when the density makes the mass.
    "mass": (chain(density=7958 / 0.0095**3), "density set before the diameter"),
    "longer": (lambda at: chain(granules=21)(at)[:-1], "a chain of 21 granules, not 20"),
    "shorter": (
        lambda at: np.append(chain(granules=19)(at), np.nan),
        "a chain of 19 granules, not 20",
    ),
    "force": (pulse(peak_force=110.0), "applied force 1.1 times"),
    "N": (pulse(peak_force=100 / 9.80665), "F0 in kgf taken for N"),
    "profile": (pulse(profile=profile_named("triangular")), "profile "),
    "longer decay": (
        pulse(duration_ratio=3.0),
        "duration ratio 3 in place of 2, at the same rise time",
    ),
    "shorter rise": (
        lambda at: at.other("shock", duration_ratio=3.0, rise_time=at.scene.rise_time * 2 / 3),
        "duration ratio 3 in place of 2, in a pulse that lasts as long",
    ),
    "kN": (peaks(lambda truth: 1e-3 * truth), "in units of kN"),
    "dyn": (peaks(lambda truth: 1e5 * truth), "in units of dyn"),
    "noisy kN": (peaks(noisy), "in units of kN; leaves"),
    "after": (peaks(lambda truth: np.append(truth[1:], np.nan)), "peak of contact i + 1"),
    "before": (peaks(lambda truth: np.append(np.nan, truth[:-1])), "peak of contact i - 1"),
    "far end": (peaks(lambda truth: truth[::-1]), "from the far end"),
    "one": (peaks(lambda truth: np.where(np.arange(19) == 3, 1.1, 1) * truth), "contact 5 alone"),
    "samples": (lambda at: at.samples(1.5e-6), "samples in place of maxima, 1.5e-06 s apart, of"),
    "3 digits": (
        peaks(lambda truth: np.array([float(f"{force:.3g}") for force in truth])),
        "rounding: these are the scene's own peaks to 3 digits",
    ),
    "steps": (lambda at: verlet(at, 1.5e-6), "velocity Verlet with steps of about 1.5e-06 s"),
    "corners": (lambda at: at.past_corners(False), "2e-06 s, past the corners of the pulse"),
    "sampled": (lambda at: at.past_corners(True), "samples in place of maxima, velocity Ver"),
    "Tsuji": (damped("restitution", restitution=0.819), "of restitution 0.819"),
    "dashpot": (damped("dashpot", coefficient=4.9), "by dashpots of 4.9 kg/s"),
    "viscoelastic": (
        damped("viscoelastic", relaxation_time=1.9e-8),
        "of viscoelastic spheres with the relaxation time 1.9e-08 s",
    ),
    "nothing": (peaks(lambda truth: 0 * truth), "no contact was pressed, or none was read"),
}
QUICK = {
    *("E halved", "no nu", "diameter", "printed", "shorter", "longer decay", "dyn"),
    *("noisy kN", "nothing", "far end", "3 digits", "corners", "Tsuji"),
}
"""The others are slow."""


@pytest.mark.parametrize(
    ("key", "name"),
    [
        pytest.param(SCENES[k % 2], name, marks=[pytest.mark.slow] * (name not in QUICK), id=name)
        for k, name in enumerate(MISTAKES)
    ],
)
def test_a_mistake_is_named(key: tuple[str, float, float, int], name: str) -> None:
    at = planting(key)
    plant, words = MISTAKES[name]
    judged = hc.judge(at.scene, plant(at), tolerance=5e-4)
    assert (judged.verdict, judged.remarks) == ("fail", ())
    assert words in (judged.cause or ""), judged.hint


def test_a_run_that_ends_before_its_slow_wave_and_a_step_that_is_stated() -> None:
    at = planting(SCENES[0])
    heavy = replace(at.in_seconds.chain, density=7958.0 / 0.0095**3)
    ended = replace(at.in_seconds, chain=heavy, run=hc.Run(at.scene.end_time))
    cause = hc.judge(at.scene, exact(ended)).cause or ""
    assert "density set before the diameter" in cause
    assert "in a run that ends with that of the scene" in cause
    judged = hc.judge(at.scene, verlet(at, 1.5e-6), dt=1.5e-6)
    assert "velocity Verlet with steps of about 1.5e-06 s" in (judged.cause or "")


# Peaks without a cause


def noise(draw: np.random.Generator, truth: FloatArray) -> FloatArray:
    return truth * (1 + 10 ** draw.uniform(-9, -2) * draw.standard_normal(truth.size))


def smooth(draw: np.random.Generator, truth: FloatArray) -> FloatArray:
    x, waves = np.linspace(0, 1, truth.size), range(1, int(draw.integers(2, 6)))
    terms = [draw.standard_normal() * np.cos(np.pi * k * x + draw.uniform(0, 6)) for k in waves]
    return np.asarray(truth * np.exp(10 ** draw.uniform(-5, -0.7) * sum(terms)))


SEEDS = [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(1, 40))]


@pytest.mark.parametrize("make", [noise, pytest.param(smooth, marks=pytest.mark.slow)])
@pytest.mark.parametrize("seed", SEEDS)
def test_random_peaks_have_no_cause(
    make: Callable[[np.random.Generator, FloatArray], FloatArray], seed: int
) -> None:
    at = planting(SCENES[0])
    judged = hc.judge(at.scene, make(np.random.default_rng(seed), at.truth), tolerance=1e-6)
    assert judged.cause is None
    if judged.verdict == "fail":
        assert (judged.hint or "").startswith("no single known mistake explains these peaks")
        assert ("look like noise" in (judged.hint or "")) is (make is noise)


# Factors

SCENE, NU = paper_scene("cosine-triangular", 2.0, 2.0, 30), 0.3
FACTORS = {
    "effective modulus E/(1 - nu^2) in place of half of it": (2, 1),
    "effective modulus E in place of E/(2 (1 - nu^2))": (2 * (1 - NU**2), 1),
    "effective modulus halved twice": (0.5, 1),
    "E in place of E/(1 - nu^2)": (1 - NU**2, 1),
    "1 - nu in place of 1 - nu^2": (1 + NU, 1),
    "shear modulus in place of E": (1 / 2.6, 1),
    "the factor 2/3 is missing": (3 / 2, 1),
    "the factor 4/3 is missing": (3 / 4, 1),
    "R in place of the effective radius R/2": (2**0.5, 1),
    "diameter taken for radius": (2**0.5, 8),
    "radius taken for diameter": (2**-0.5, 1 / 8),
    "diameter taken for radius in the mass": (1, 8),
    "radius taken for diameter in the mass": (1, 1 / 8),
    "half the mass": (1, 0.5),
    "twice the mass": (1, 2),
    "density in g/cm^3 taken for kg/m^3": (1, 1e-3),
    "E in dyn/cm^2 taken for Pa": (10, 1),
    "radius in cm taken for m": (10, 1e6),
    "radius in mm taken for m": (1000**0.5, 1e9),
    "E in GPa taken for Pa": (1e-9, 1),
    "E in MPa taken for Pa": (1e-6, 1),
    "density set before the diameter": (1, 0.0095**-3),
}
"""Factors of stiffness and mass: the stiffness goes as E R^(1/2), the mass as R^3."""


def test_slips_of_the_chain_follow_from_its_stiffness_and_mass() -> None:
    # The natural time goes as m^(1/2) A^(-1/3) at the same force.
    expected = {name: a ** (1 / 3) * m**-0.5 for name, (a, m) in FACTORS.items()}
    expected |= {"duration taken for rise time": 2.0, "rise time taken for duration": 0.5}
    assert slips_of(SCENE, "stretch") == pytest.approx(expected, rel=1e-12, abs=0)


@pytest.mark.parametrize(("scale", "word"), [(0.9, "modulus"), (1.1, "mass"), (1.2, "speed")])
def test_peaks_of_a_collision_tell_what_may_be_wrong(scale: float, word: str) -> None:
    """Peaks of a simulation with another modulus, density or speed of the striker."""
    scene = hc.Scene(hc.Chain(granules=8, **STEEL), hc.Striker(0.5))
    changed = {
        "modulus": lambda: replace(scene, chain=replace(scene.chain, young_modulus=193e9 * scale)),
        "mass": lambda: replace(scene, chain=replace(scene.chain, density=7958 * scale)),
        "speed": lambda: replace(scene, shock=hc.Striker(0.5 * scale)),
    }[word]()
    peaks = (
        hc.Native(rtol=1e-6).run(changed).peak_force / hc.Native(rtol=1e-6).run(scene).peak_force
    )
    assert f"{word} {scale:.4g} times" in in_words(scene, "peaks", round(float(peaks[3]), 5))


def test_units_of_force_are_those_of_pint() -> None:
    units: pint.UnitRegistry[float] = pint.UnitRegistry()
    force, written = slips_of(SCENE, "force"), slips_of(SCENE, "peaks")
    assert (force.pop("half of F0"), force.pop("twice F0")) == (0.5, 2.0)
    assert written.pop("in units of F0") == 1 / SCENE.units.force
    for words, factor in (force | written).items():
        names = re.findall(r"in (?:units of )?(\w+)(?: taken for (\w+))?", words)[0]
        asked, taken = (name if name != "uN" else "micronewton" for name in names)
        # Pound forces have seven digits here.
        newton = units.Quantity(1.0, taken or "newton").to(asked).magnitude
        assert factor == pytest.approx(newton, rel=1e-8, abs=0)


@pytest.mark.parametrize(
    ("nu", "stretch", "name", "within"),
    [
        (0.0, 2**0.5, "half the mass", 3e-3),
        # 1 - nu^2 changes the length of the pulse by 3.3e-3: a tenth of that.
        (0.1, 0.99 ** (1 / 3), "E in place of E/(1 - nu^2)", 3.3e-4),
    ],
)
def test_a_known_factor_is_named_where_it_is_near(
    nu: float, stretch: float, name: str, within: float
) -> None:
    scene = with_rise_time(SCENE)
    scene = replace(scene, chain=replace(scene.chain, poisson_ratio=nu))
    for off, named in ((0.9, True), (-0.9, True), (1.1, False), (-1.1, False)):
        words = in_words(scene, "stretch", stretch * (1 + off * within))
        assert (name in words) is named


# Damping

ELASTIC = paper_scene("cosine", 0.5, 2.0, 16)
ALPHA = math.sqrt(5) * damping_ratio(0.8)
ASKED = {
    "restitution": hc.Contact("restitution", restitution=0.8),
    "viscoelastic": hc.Contact("viscoelastic", relaxation_time=1e-6),
    "dashpot": hc.Contact("dashpot", coefficient=3.0),
}
E, TAU, C = ASKED.values()


def peaks_of(scene: hc.Scene) -> FloatArray:
    return hc.Native(rtol=1e-7).run(scene).peak_force


def times(factor: float) -> hc.Contact:
    """A restitution of 0.8 whose coefficient is off by a factor."""
    return hc.Contact("restitution", restitution=of_ratio(factor * damping_ratio(0.8), pulls=True))


def pulling(contact: hc.Contact) -> hc.Contact:
    return replace(contact, attraction=True)


ASKED_AND_MADE: list[tuple[hc.Contact | None, hc.Contact | None, str]] = [
    (None, hc.Contact("restitution", restitution=0.9), "damping of restitution 0.9$"),
    (None, hc.Contact("restitution", restitution=0.5432), "damping of restitution 0.543$"),
    (
        None,
        hc.Contact("viscoelastic", relaxation_time=1.234e-6),
        "damping of viscoelastic spheres with the relaxation time 1.23e-06 s$",
    ),
    (None, hc.Contact("dashpot", coefficient=3.456), "damping by dashpots of 3.46 kg/s$"),
    (None, pulling(C), "$"),
    (
        E,
        times(tsuji(0.8, False) / ALPHA),
        "damping of restitution 0.853 in place of 0.8 .*: damping tsuji of LAMMPS before.* 0.8$",
    ),
    (
        E,
        times(tsuji(0.8, True) / ALPHA),
        "damping of restitution 0.799 in place of 0.8 .*: damping tsuji of LAMMPS 2 Sep 2026 or",
    ),
    (E, None, "no damping$"),
    (TAU, None, "no damping$"),
    (C, None, "no damping$"),
    (E, pulling(E), "contacts that pull as they open$"),
    (pulling(C), C, "contacts that are kept from pulling$"),
    # Laws that leave a little more are named after it.
    (C, E, "damping of restitution 0.8 in place of damping by dashpots of 3 kg/s"),
    (E, times(math.sqrt(2)), r".*: m in place of m\*$"),
    (E, times(1.0029 * math.sqrt(2)), r".*: m in place of m\*$"),
    (E, times(1.0031 * math.sqrt(2)), r".*times the scene's\)$"),
    (TAU, hc.Contact("viscoelastic", relaxation_time=1e-6 / 1.5), ".*: the factor 3/2 is missing$"),
]
QUICK_DAMPING = (0, 2, 3, 4, 5, 6, 7, 10, 17)


@pytest.mark.parametrize(
    ("asked", "present", "words"),
    [
        pytest.param(*case, marks=[pytest.mark.slow] * (k not in QUICK_DAMPING))
        for k, case in enumerate(ASKED_AND_MADE)
    ],
)
def test_damping_is_named(asked: hc.Contact | None, present: hc.Contact | None, words: str) -> None:
    scene = replace(ELASTIC, contact=asked)
    judged = hc.judge(scene, peaks_of(replace(ELASTIC, contact=present)), tolerance=1e-6)
    assert judged.verdict == "fail"
    cause = (judged.cause or "").partition("; leaves")[0]
    assert re.match(words, cause), judged.cause or judged.hint


def test_noise_does_not_look_like_weak_damping_or_pulling() -> None:
    error = 1 + 1e-3 * np.random.default_rng(1).standard_normal(15)
    for asked, present in ((E, None), (None, C)):
        given = peaks_of(replace(ELASTIC, contact=present)) * error
        cause = hc.judge(replace(ELASTIC, contact=asked), given).cause or ""
        assert cause.startswith("no damping; leaves" if asked else "damping by dashpots of 3 kg/s")
        assert "contacts that pull" not in cause


def test_with_other_terms_damping_units_and_numbers_are_tried() -> None:
    """Before a wall, behind a striker; elastic scenes with terms, too."""
    elastic = hc.Scene(hc.Chain(12, **STEEL), hc.Striker(1.0), wall=hc.Wall("rigid"))
    present = replace(elastic, contact=hc.Contact("restitution", restitution=0.85))
    judged = hc.judge(elastic, peaks_of(present))
    assert (judged.cause or "").startswith("damping of restitution 0.85; leaves")
    tried = "units and numbers of the contacts; damping"
    assert judged.remarks == (f"causes that were tried in a scene with striker, wall: {tried}",)
    judged = hc.judge(replace(present, contact=E), peaks_of(present))
    assert (judged.cause or "").startswith("damping of restitution 0.85 in place of 0.8 ")
    for scene in (elastic, replace(elastic, chain=replace(elastic.chain, radius=[4e-3, 5e-3] * 6))):
        force = peaks_of(scene)
        for given, cause in ((force / 1000, "in units of kN"), (force[::-1], "from the far end")):
            assert cause in (hc.judge(scene, dict(enumerate(given.tolist(), 2))).cause or "")


# Limits

PLACE = np.arange(59)
"""Number of each contact of the demo, from 0."""


def case_of(truth: hc.Result, given: FloatArray, tolerance: float = 1e-3) -> Case:
    judged = judgement.judged_peaks(truth.peak_force, given)
    return Case(truth.scene, truth, given, judged, None, tolerance, Deadline(60.0), False)


@dataclass(frozen=True)
class Explained:
    """What is said of peaks that are off, where mistakes leave given parts of the differences."""

    patch: pytest.MonkeyPatch
    truth: hc.Result

    def __call__(
        self, case: Case, noisy: bool = False, **left: float
    ) -> tuple[slips.Explanation, list[str]]:
        """Return the explanation, and the mistakes that were tried."""
        tried: list[str] = []
        noise = np.random.default_rng(0).standard_normal(case.judged.sum()) if noisy else None

        def family(name: str) -> Family:
            def mistakes(case: Case) -> Iterator[Mistake]:
                tried.append(name)
                yield Mistake(lambda _: name, lambda _: case.given, (left[name] * case.size,))

            return Family(name, mistakes)

        self.patch.setattr(Case, "fit", lambda _, __, trials: Fit(0.0, trials[0], noise))
        self.patch.setattr(slips, "FAMILIES", tuple(map(family, left)))
        return slips.likely_cause(case), tried

    def shared(self, size: float = 0.01, tolerance: float = 1e-3) -> Case:
        """Peaks that are off by the same: four too high, four too low, in turn; no noise."""
        signs = np.where(np.arange(59) % 8 < 4, 1.0, -1.0)
        return case_of(self.truth, self.truth.peak_force * np.exp(size * signs), tolerance)

    def cause(self, noisy: bool = False, tolerance: float = 1e-3, **left: float) -> str:
        """Return the cause that is named; empty without one."""
        result, _ = self(self.shared(0.01, tolerance), noisy, **left)
        assert (result.cause is None) != (result.hint is None)
        return result.cause or ""

    def hint(self, case: Case, left: float = 0.5) -> str:
        """Return what is said without a cause."""
        return self(case, this=left)[0].hint or ""

    def is_sought(self, case: Case) -> bool:
        """Whether any mistake is tried."""
        return bool(self(case, this=0.5)[1])

    def is_alone(self, times: float, contact: int = 5) -> bool:
        """Whether a contact that is so many times as far off as the others is said to be alone."""
        peaks = self.truth.peak_force * (1 + 1e-5)
        peaks[contact - 2] *= 1 + times * 1e-5 - 1e-5
        result, tried = self(case_of(self.truth, peaks), this=0.5)
        is_alone = (result.cause or "").startswith(f"contact {contact} alone")
        assert bool(tried) != is_alone
        return is_alone

    def is_noise(
        self, count: int = 59, size: float = 0.01, most: float = 2.5, shift: float = 0.0
    ) -> bool:
        """Whether differences look like noise: one is ``most`` times their size."""
        off = np.random.default_rng(3).uniform(-1, 1, count)
        off -= np.mean(off)
        off[8] = 0.0
        off[8] = most * np.sqrt(np.sum(off**2) / (count - most**2))
        if shift:  # of the mean, in its standard errors
            off += shift * np.std(off) / np.sqrt(count - shift**2) - np.mean(off)
        off = np.append(off * size / np.sqrt(np.mean(off**2)), np.zeros(59 - count))
        case = case_of(self.truth, self.truth.peak_force * (1 + off))
        return "look like noise" in self.hint(replace(case, judged=np.arange(59) < count))


@pytest.fixture
def explained(monkeypatch: pytest.MonkeyPatch, demo_reference: hc.Result) -> Explained:
    return Explained(monkeypatch, demo_reference)


def jumps(ratio: float) -> bool:
    """Two values whose mean square jump is a given part of their mean square."""
    angle = math.asin(1 - ratio) / 2
    return slips.jumps_like_noise(np.array([math.cos(angle), math.sin(angle)]))


Said = Callable[[Explained, float], bool]
EDGES: dict[str, tuple[float, Said, bool]] = {
    "contacts": (6, lambda at, x: at.is_sought(replace(at.shared(), judged=x > PLACE)), False),
    "size": (1e-7, lambda at, x: at.is_sought(at.shared(x)), False),
    "errors": (10.0, lambda at, x: at.is_sought(replace(at.shared(x * 1e-5),
        reference=replace(at.truth, error_estimate=1e-5))), False),
    "accuracy": (1e-4, lambda at, x: bool(at.cause(tolerance=1e-9, this=x)), True),
    "cause": (0.1, lambda at, x: bool(at.cause(this=x)), True),
    # What leaves more than is allowed is a part of the mistake, unless it is noise.
    "tolerance": (5e-4, lambda at, x: bool(at.cause(tolerance=x, this=0.05)), False),
    "cause, noise": (0.1, lambda at, x: bool(at.cause(True, 1e-6, this=x)), True),
    "alike": (3.0, lambda at, x: "this; or that;" in at.cause(this=0.01, that=0.01 * x), True),
    "alike, exact": (3.0, lambda at, x: "; or that;" in at.cause(this=0.0, that=1e-4 * x), True),
    "hint": (0.07, lambda at, x: "nearest is: this" in at.hint(at.shared(0.01, 1e-6), x), True),
    "alone": (100.0, Explained.is_alone, False),
    # Mistakes move the last two contacts by themselves.
    "alone, near the end": (59, lambda at, x: at.is_alone(1000.0, int(x)), True),
    "noise": (0.1, lambda at, x: at.is_noise(size=x), True),
    "noisy_contacts": (12, lambda at, x: at.is_noise(int(x), most=2.0), False),
    "outlier": (4.0, lambda at, x: at.is_noise(most=x), True),
    "shift": (3.0, lambda at, x: at.is_noise(shift=x), True),
    "jumps": (1.2, lambda _, x: jumps(x), False),
}  # fmt: skip
"""By a limit: its value, typed again; whether something is said at a value; the same below it."""

OF_RUNS = {"factor", "damping", "rounding"}
"""Limits that other tests reach by whole runs, or by rounded peaks."""


def test_each_limit_has_its_sides() -> None:
    names = {name.split(",")[0] for name in EDGES} - {"tolerance"}
    assert {*slips.LIMITS._fields} == names | OF_RUNS


@pytest.mark.parametrize("name", EDGES)
def test_both_sides_of_a_limit(name: str, explained: Explained) -> None:
    limit, is_said, below = EDGES[name]
    sides = (limit - 1, limit) if isinstance(limit, int) else (0.98 * limit, 1.02 * limit)
    assert [is_said(explained, side) for side in sides] == [below, not below]


def test_what_is_said(explained: Explained) -> None:
    nothing, truth = "no single known mistake explains these peaks", explained.truth
    assert explained.cause(this=0.0, that=2e-4) == "this; or that; leaves 1e-06 of the differences"
    far = f"{nothing}, and none leaves less than 7 % of the differences"
    assert explained.hint(explained.shared()) == far
    near = f"{nothing}. The nearest is: this; it leaves 6.9 % of the differences"
    assert explained.hint(explained.shared(0.01, 1e-6), 0.069) == near
    few = replace(explained.shared(), judged=PLACE < 5)
    assert explained(few)[0].remark == "a cause is named only if at least 6 contacts are judged"
    peaks = np.where(PLACE == 3, 0.0, truth.peak_force)
    said = "contact 5 alone, as after a typing error: the others are right"
    assert explained(case_of(truth, peaks))[0].cause == said


@pytest.mark.parametrize(
    ("rounded", "words"),
    [
        (lambda force: float(f"{force:.2g}"), "to 2 digits"),
        (lambda force: float(f"{force:.4g}"), "to 4 digits"),
        (lambda force: round(force, 1), "to 1 decimals"),
        (lambda force: round(force, -1), "to 10 N"),
        (lambda force: float(f"{force:.1g}"), None),
        (lambda force: max(round(force, -2), 100), None),
        (lambda force: float(f"{1.02 * force:.3g}"), None),
        (math.floor, None),
    ],
)
def test_rounding_is_named(
    explained: Explained, rounded: Callable[[float], float], words: str | None
) -> None:
    truth = hc.Native("reference").run(paper_scene("cosine", 1.0, 2.0, 16))
    peaks = truth.peak_force * np.linspace(0.6, 1.4, 15)  # in more than one decade
    truth = replace(truth, peak_force=peaks)
    given = np.array([rounded(float(force)) for force in peaks], np.float64)
    cause = explained(case_of(truth, given), this=0.5)[0].cause
    if words is None:
        assert cause is None
    else:
        assert (cause or "").startswith(f"rounding: these are the scene's own peaks {words},")


def test_the_hint_of_a_scene_with_terms_says_what_was_tried() -> None:
    scene = replace(paper_scene("cosine", 1.0, 2.0, 16), wall=hc.Wall("rigid"))
    peaks = hc.Native("reference").run(scene).peak_force
    judged = hc.judge(scene, peaks * (1 + 0.01 * np.random.default_rng(0).standard_normal(16)))
    assert judged.cause is None
    assert (judged.hint or "").startswith("no mistake that was tried explains these peaks")
    assert judged.to_dict()["hint"] == judged.hint
    document = of_judgement(judged)
    failures = [(failure.name, failure.advice) for failure in document.verdict.failures]
    assert failures == [("Hint", judged.hint)]
    text = StringIO()
    print_document(Console(file=text, width=1000), document)
    assert "\nNo mistake that was tried explains these peaks" in text.getvalue()
    assert "Likely cause" not in text.getvalue()
