"""The table of slips: how a mistake changes a scene, how peaks are tested for it, and its name.

A slip in a number is a factor in ``slips_of``; ``FAMILIES`` try whole mistakes. Mistakes with the
same peaks are named together: a stiffer chain, a lighter one and a longer pulse are similar.
"""

from __future__ import annotations

import contextlib
import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.dialect import BEFORE_ROOT_2, WITH_ROOT_2, tsuji
from hertzchain.engines.native.backend import Native
from hertzchain.engines.native.plan import METHODS, Method
from hertzchain.engines.native.simulation import simulate
from hertzchain.errors import RunFailed, SceneError, StepUnstable, TooExpensive
from hertzchain.limits import Deadline
from hertzchain.observables.error_bound import stable_step
from hertzchain.observables.result import Result
from hertzchain.observables.samples import Recorder
from hertzchain.observables.wave import FREE_END
from hertzchain.scene.keys import keys_of
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg
from hertzchain.scene.shocks import PROFILES, Ramp
from hertzchain.scene.terms import DAMPING, Contact, DampingLaw
from hertzchain.theory.restitution import damping_ratio, of_ratio


class Limits(NamedTuple):
    """Limits of the search for a cause; a size is a root mean square of relative differences.

    Those without a reason are chosen: ``tests/test_slips.py`` has what is named on either side.
    """

    factor: float = 0.003  # largest relative distance of a fitted factor from a slip that is named
    contacts: int = 6  # fewest judged contacts: fewer fit a curve with one parameter too easily
    size: float = 1e-7  # of differences: 10 times the error of trial runs
    errors: float = 10.0  # size of the differences over the error of the reference
    accuracy: float = 1e-4  # of fits, as a part of the differences
    cause: float = 0.1  # largest part of the differences that a cause leaves
    alike: float = 3.0  # largest part that is left by mistakes named together, over the smallest
    # Largest part that a hint leaves. In 60 random mixtures of three mistakes the nearest named one
    # of them in 30 of 31 that left less, in 7 of 13 that left more (measured).
    hint: float = 0.07
    damping: float = 1 / 3  # largest part that damping leaves of what is left without damping
    rounding: float = 0.1  # largest difference of rounded peaks
    alone: float = (
        100.0  # difference of a contact that is off alone, over the next: mistakes stay below
    )
    noise: float = 0.1  # largest size of noise
    noisy_contacts: int = 12  # fewest contacts that can look like noise
    outlier: float = 4.0  # largest difference of noise over its size: once in 300 sets of 60
    shift: float = 3.0  # largest mean of noise in its standard errors: samples are all too low
    # Mean square jump over mean square, from contact to contact: 2 for noise, 0.3 off for 59
    # contacts; 0.1 for waves, and 1 where only the last contact is off (derived).
    jumps: float = 1.2


LIMITS = Limits()

# ---- Slips in a number

_UNITS = {
    "kN": 1e3, "MN": 1e6, "mN": 1e-3, "uN": 1e-6, "dyn": 1e-5, "kgf": 9.80665, "lbf": 4.4482216,
}  # fmt: skip
"""Units in which forces are written [N]."""

_FACTORS = {
    "stiffness": {
        "effective modulus E/(1 - nu^2) in place of half of it": 2.0,
        "effective modulus halved twice": 0.5,
        "the factor 2/3 is missing": 1.5,
        "the factor 4/3 is missing": 0.75,
        "R in place of the effective radius R/2": 2**0.5,
        "E in dyn/cm^2 taken for Pa": 10.0,
        "E in GPa taken for Pa": 1e-9,
        "E in MPa taken for Pa": 1e-6,
    },
    # A wrong radius also changes the mass: these are factors of the length of the pulse.
    "pulse": {
        "diameter taken for radius": 2 ** (-4 / 3),
        "radius taken for diameter": 2 ** (4 / 3),
        "radius in cm taken for m": 100 ** (-4 / 3),
        "radius in mm taken for m": 1000 ** (-4 / 3),
    },
    "mass": {
        "diameter taken for radius in the mass": 8.0,
        "radius taken for diameter in the mass": 1 / 8,
        "half the mass": 0.5,
        "twice the mass": 2.0,
        "density in g/cm^3 taken for kg/m^3": 1e-3,
    },
    "viscoelastic": {"the factor 3/2 is missing": 2 / 3, "the factor 3/2 is applied twice": 3 / 2},
    "dashpot": {"half of the coefficient": 0.5, "twice the coefficient": 2.0},
    "force": {
        "half of F0": 0.5,
        "twice F0": 2.0,
        **{f"F0 in {unit} taken for N": 1 / _UNITS[unit] for unit in ("kgf", "lbf")},
        **{f"F0 in N taken for {unit}": _UNITS[unit] for unit in ("kgf", "lbf")},
    },
    "peaks": {f"in units of {unit}": 1 / newton for unit, newton in _UNITS.items()},
}
"""The factor by which a slip multiplies a number, by the number and the words for the slip."""

_STRETCH = {"stiffness": 1 / 3, "mass": -1 / 2, "pulse": 1.0}
"""Powers of the factors in the length of the pulse in natural units."""


def slips_of(scene: Scene, number: str) -> dict[str, float]:
    """Return the factors of slips in one number that can be made in a scene, by their words.

    It is the stiffness, mass, force, peaks, a law of damping, or the stretch: the length of the
    pulse in natural units, by stiffness, mass and pulse.
    """
    if number == "stretch":
        return {
            words: factor**power
            for part, power in _STRETCH.items()
            for words, factor in slips_of(scene, part).items()
        }
    nu, radius = (float(x[0]) for x in (scene.granules.poisson_ratio, scene.granules.radius))
    more: dict[str, float] = {}
    if number == "stiffness":
        more = {
            "effective modulus E in place of E/(2 (1 - nu^2))": 2 * (1 - nu**2),
            "E in place of E/(1 - nu^2)": 1 - nu**2,
            "1 - nu in place of 1 - nu^2": 1 + nu,
            "shear modulus in place of E": 0.5 / (1 + nu),
        }
    elif number == "mass":  # spheres have the diameter 1 of LAMMPS when they get their mass
        more = {"density set before the diameter": (2 * radius) ** -3.0}
    elif number == "peaks":
        more = {"in units of F0": 1 / scene.units.force}
    elif number == "pulse" and (pulse := scene.pulse) is not None:
        more = {
            "duration taken for rise time": pulse.duration_ratio,
            "rise time taken for duration": 1 / pulse.duration_ratio,
        }
    elif number == "restitution" and scene.contact is not None and scene.contact.restitution:
        right = math.sqrt(5) * damping_ratio(e := scene.contact.restitution)
        more = {
            f"damping tsuji of LAMMPS {version} for {e:g}": tsuji(e, root_2) / right
            for version, root_2 in ((BEFORE_ROOT_2, False), (WITH_ROOT_2, True))
        }
        if not {"unlike granules", "wall", "near wall"} & set(scene.terms):
            more |= {"m in place of m*": 2**0.5, "m*/2 in place of m*": 0.5**0.5}
    return _FACTORS.get(number, {}) | more


def near(factors: dict[str, float], factor: float) -> list[str]:
    """Return the words of the factors near a fitted one, if they are not near 1, too.

    A factor that is clearly farther away than the nearest one is left out.
    """
    most = LIMITS.factor
    far = {words: abs(factor / q - 1) for words, q in factors.items() if abs(q - 1) > most}
    # Times the distance of the nearest factor: factors beyond it are not named (chosen)
    # Relative error of a fitted factor (measured with velocity Verlet)
    least = 3.0 * max(min(far.values(), default=0.0), 1e-4)
    return [
        words for words, off in far.items()
        if off < min(most, 0.1 * abs(factors[words] - 1), least)
    ]  # fmt: skip


def in_words(scene: Scene, number: str, factor: float) -> str:
    """Return words for a stretch, a force or peaks that are wrong by a factor."""
    names = near(slips_of(scene, number), factor)
    text = f"every peak {factor:.6g} times the true one"
    if number == "stretch":
        text = (
            f"contact stiffness {factor**3:.6g} times that of the scene, or mass {factor**-2:.6g}"
            f" times, or pulse {factor:.6g} times as long (peaks cannot tell these apart)"
        )
    elif number == "force":
        text = f"applied force {factor:.6g} times that of the scene"
    elif not names:
        if scene.pulse:
            names = ["another unit, or another applied force at the same LM_ratio"]
        else:  # by dimensions the peaks of a collision go as modulus^(2/5) (mass speed^2)^(3/5)
            modulus, mass, speed = factor ** (5 / 2), factor ** (5 / 3), factor ** (5 / 6)
            others = f"a modulus {modulus:.4g} times, a mass {mass:.4g} times"
            names = [f"another unit, {others} or a speed {speed:.4g} times that of the scene"]
    return _named(text, names)


def _named(text: str, names: list[str]) -> str:
    return f"{text}: {' or '.join(names)}" if names else text


# ---- Wrong peaks, and how a mistake is tried on them


def jumps_like_noise(values: FloatArray) -> bool:
    """Return whether values jump from contact to contact like noise about 0.

    For noise the mean square of jumps is twice that of the values (von Neumann).
    """
    return bool(np.sum(np.diff(values) ** 2) >= LIMITS.jumps * np.sum(values**2))


class Fit(NamedTuple):
    """The parameter of a mistake that explains a case best."""

    value: float
    left: float  # the part of the differences that it leaves (``Case.residual``)
    rest: FloatArray | None = None  # residual of each judged contact; None if not kept

    @property
    def leaves_noise(self) -> bool:
        """Whether the residuals are known and jump from contact to contact like noise."""
        return self.rest is not None and jumps_like_noise(self.rest)


@dataclass(frozen=True, eq=False)
class Case:
    """Peaks to be explained."""

    scene: Scene
    reference: Result  # reference peaks of the scene
    given: FloatArray  # peak forces in question [N], shape (N - 1,), NaN where there is none
    judged: NDArray[np.bool_]  # the judged contacts, shape (N - 1,)
    dt: float | None  # their step [s], if known
    tolerance: float  # largest relative difference that passes
    deadline: Deadline  # time limit of the search
    of_first_pulses: bool  # whether the peaks are those of first pulses

    @property
    def differences(self) -> FloatArray:
        """Relative differences of the judged contacts from the reference."""
        return self.given[self.judged] / self.reference.peak_force[self.judged] - 1.0

    @property
    def size(self) -> float:
        """Size of the differences: the residual of the reference itself."""
        return self.residual(self.reference.peak_force) if self.judged.any() else 0.0

    def residual(self, peak_force: FloatArray) -> float:
        """Part of the differences that other peaks [N], (N - 1,), leave, in logarithms."""
        left = self.left(peak_force)
        return float(np.sqrt(np.mean(left**2))) if left.size else math.inf

    def left(self, peak_force: FloatArray) -> FloatArray:
        """Return the residual of each judged contact, without one that may be unknown at an end.

        If peaks are unknown in more contacts, nothing is returned: the mistake is impossible.
        """
        # Peaks below this fraction of the reference count as zero
        lowest = 1e-9 * self.reference.peak_force[self.judged]
        given, tried = (
            np.maximum(force[self.judged], lowest) for force in (self.given, peak_force)
        )
        is_number = np.isfinite(ratio := given / tried)
        return np.log(ratio[is_number]) if np.count_nonzero(~is_number) <= 1 else np.zeros(0)

    def of(self, scene: Scene, dt: float | None = None) -> FloatArray:
        """Return true peaks of another scene [N], or those of velocity Verlet at a step [s].

        Those of damped contacts are right to about 1e-8, by one run. They are NaN where there are
        none.
        """
        # Wanted accuracy of trial runs; smaller differences get no cause
        how: dict[str, Any] = {"rtol": 1e-8}
        if dt is not None:
            how = {"method": "velocity-verlet", "dt": dt}
        try:
            if scene.contact is not None:
                from hertzchain.engines.native import damped_runs

                # Tolerance of a step, damped contacts: peaks are right to 2e-8 (measured)
                damped = damped_runs.simulate_damped(
                    scene, 1e-8, self.deadline, first=self.of_first_pulses
                )
                force, first = damped.peaks.force, damped.peaks.first
                unit = scene.units.force
            else:
                run = Native(
                    **how, peaks_only=True, time_limit=max(self.deadline.left, 1e-3),
                    wanted="first" if self.of_first_pulses else "all",
                ).run(scene)  # fmt: skip
                force, first = run.peak_force, run.first_pulses if self.of_first_pulses else None
                unit = 1.0
            return np.asarray(unit * (force if first is None else np.nan_to_num(first.force)))
        except TooExpensive:
            raise
        except (RunFailed, SceneError):
            return np.full_like(self.given, np.nan)

    def fit(self, peaks: Callable[[float], FloatArray], trials: Sequence[float]) -> Fit:
        """Fit the parameter of a mistake that makes peaks [N].

        Trials increase; every valley is searched, because the best trial may not lie in the deepest
        one.
        """
        from scipy.optimize import minimize_scalar

        tried = [peaks(x) for x in trials]
        left = [self.residual(force) for force in tried]
        k = int(np.argmin(left))
        best, walled = Fit(trials[k], left[k], self.left(tried[k])), [math.inf, *left, math.inf]
        for k, value in enumerate(left if len(trials) > 1 else ()):
            if not math.isfinite(value) or value > min(walled[k], walled[k + 2]):
                continue
            bounds = trials[max(k - 1, 0)], trials[min(k + 1, len(trials) - 1)]
            square = minimize_scalar(
                lambda x: min(self.residual(peaks(x)), 1e100) ** 2,
                bounds=bounds,
                method="bounded",
                options={"xatol": 1e-9 * (bounds[1] - bounds[0])},
            )
            rest = self.left(force := peaks(float(square.x)))
            if self.residual(force) < best.left:
                best = Fit(float(square.x), self.residual(force), rest)
        return best


@dataclass(frozen=True)
class Mistake:
    """A known mistake: its words, how its peaks are computed, and how its parameter is fitted."""

    words: Callable[[Any], str]  # its words, from its parameter
    peaks: Callable[[Any], FloatArray]  # peaks [N], (N - 1,), or NaN
    trials: Sequence[float] = (0.0,)  # parameters to begin with, increasing; one if none is fitted
    most: float = math.inf  # residual from which on it is not named

    def tried(self, case: Case) -> Fit:
        """Return the parameter that explains a case best."""
        fit = case.fit(self.peaks, self.trials)
        return fit if fit.left < self.most else Fit(fit.value, math.inf)


def fixed(words: str, peak_force: FloatArray) -> Mistake:
    """Return a mistake without a parameter."""
    return Mistake(lambda _: words, lambda _: peak_force)


# ---- Mistakes in chain, pulse and peaks

_FAR = 3.0  # logarithm of the longest pulse tried over the scene's; the shortest is as far


def with_rise_time(scene: Scene) -> Scene:
    """Return the same scene with the rise time in seconds, which stays in another chain."""
    if (pulse := scene.pulse) is None:
        return scene
    return replace(scene, shock=replace(pulse, momentum_ratio=None, rise_time=scene.rise_time))


def _peaks(case: Case, **parts: dict[str, Any]) -> FloatArray:
    """Return the peaks with other values in parts of the scene, at its rise time in seconds [N]."""
    scene = with_rise_time(case.scene)
    changed: Any = {part: replace(getattr(scene, part), **other) for part, other in parts.items()}
    return case.of(replace(scene, **changed))


def _stiffness(case: Case) -> Iterator[Mistake]:
    scene, chain = with_rise_time(case.scene), case.scene.chain
    modulus: Any = chain.young_modulus
    yield Mistake(
        lambda x: in_words(scene, "stretch", math.exp(x)),
        lambda x: _peaks(case, chain={"young_modulus": math.exp(3 * x) * modulus}),
        np.linspace(-_FAR, _FAR, 31).tolist(),
    )
    # Beyond the range of fits: the contact force as the paper prints it, sqrt(2 R E).
    text = "contact stiffness of Eq. 1 as printed, with E under the root"
    yield fixed(text, _peaks(case, chain={"young_modulus": modulus**0.5}))
    for words, stretch in slips_of(scene, "stretch").items():
        if abs(math.log(stretch)) <= _FAR:
            continue
        text = f"{words}, which makes the pulse {stretch:.3g} times as long in natural units"
        # Computed with another mass: granules of such a soft chain would pass each other.
        heavy = {"density": chain.density * stretch**-2}
        whole = _peaks(case, chain=heavy)
        yield fixed(text, whole)
        ended = _peaks(case, chain=heavy, run={"end_time": case.scene.end_time})
        if case.residual(ended) < case.residual(whole) / 2:  # otherwise the wave has passed by then
            yield fixed(f"{text}, in a run that ends with that of the scene", ended)


def _force(case: Case) -> Iterator[Mistake]:
    scene = with_rise_time(case.scene)
    yield Mistake(
        lambda x: in_words(scene, "force", math.exp(x)),
        lambda x: case.of(replace(scene, shock=scene.shock.stretched(force=math.exp(x)))),
        np.linspace(-5.0, 5.0, 41).tolist(),
    )


def _written(case: Case) -> Iterator[Mistake]:
    expected, unknown = case.reference.peak_force, [np.nan]
    # The least squares of relative residuals.
    factor = float(np.mean(case.given[case.judged] / expected[case.judged]))
    text = "no contact was pressed, or none was read"
    text = in_words(case.scene, "peaks", factor) if factor > 0 else text
    yield fixed(text, factor * expected)
    yield fixed("contact i has the peak of contact i + 1", np.append(expected[1:], unknown))
    yield fixed("contact i has the peak of contact i - 1", np.append(unknown, expected[:-1]))
    yield fixed("contacts are numbered from the far end", expected[::-1])


def _granules(case: Case) -> Iterator[Mistake]:
    granules = case.scene.chain.granules
    for other in (granules - 1, granules + 1):
        peaks = np.append(_peaks(case, chain={"granules": other}), np.nan)[: case.given.size]
        yield fixed(f"a chain of {other} granules, not {granules}", peaks)


def _pulse(case: Case) -> Iterator[Mistake]:
    pulse, rise_time = case.scene.pulse, case.scene.rise_time
    if pulse is None or rise_time is None:
        return
    n, trials = pulse.duration_ratio, np.linspace(-2.0, 2.0, 9).tolist()

    def ratio(x: float) -> float:
        return 1 + math.exp(x) * (n - 1)

    def words(x: float, kept: str) -> str:
        return f"duration ratio {ratio(x):.4g} in place of {n:g}, {kept}"

    def longer(x: float, whole: bool) -> FloatArray:
        rise = rise_time * n / ratio(x) if whole else rise_time
        return _peaks(case, shock={"duration_ratio": ratio(x), "rise_time": rise})

    for whole, kept in ((False, "at the same rise time"), (True, "in a pulse that lasts as long")):
        yield Mistake(partial(words, kept=kept), partial(longer, whole=whole), trials)
    for other in PROFILES:
        if other != pulse.profile:
            text = f"profile {other} in place of {pulse.profile}"
            yield fixed(text, _peaks(case, shock={"profile": other}))


# ---- Mistakes by steps and samples

_VERLET: Method = METHODS["velocity-verlet"]
# usual steps, over a power of ten of seconds (chosen)
_ROUND = (1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 7.5, 8.0)


def velocity_verlet(
    scene: Scene, legs: Sequence[Leg], deadline: Deadline
) -> tuple[FloatArray, FloatArray]:
    """Return peaks by velocity Verlet [N]: interpolated maxima, and the highest samples."""
    unit = scene.units
    run = simulate(scene, legs, _VERLET.walker, deadline=deadline)
    starts = np.concatenate([leg.start + leg.dt * np.arange(leg.steps) for leg in legs])
    nodes = np.append(starts, legs[-1].end) / unit.time
    # The highest sample is next to the peak: a second, equal run is sampled only there.
    after = np.searchsorted(nodes, run.peaks.time[np.isfinite(run.peaks.time)])
    close = np.clip(np.concatenate([after - 1, after, after + 1]), 0, nodes.size - 1)
    recorder = Recorder(np.unique(nodes[close]), scene.bodies, scene.wall is not None)
    simulate(scene, legs, _VERLET.walker, recorder, deadline=deadline)
    sampled = np.max(recorder.contact_force, axis=0, initial=0.0)
    return run.peaks.force * unit.force, sampled * unit.force


def past_corners(scene: Scene, dt: float) -> list[Leg] | None:
    """Return equal steps that ignore the corners of the pulse; None for too many of them."""
    in_pulse = math.ceil(min(scene.ramps[-1].end, scene.end_time) / dt)
    # Most legs of one step (chosen): half a second
    if in_pulse > 100_000:
        return None
    nodes = dt * np.arange(in_pulse + 1, dtype=np.float64)
    force = scene.applied_force(nodes)
    ends = zip(itertools.pairwise(nodes), itertools.pairwise(force), strict=True)
    legs = [Leg(a, b, 1, Ramp(a, b, f, g, "linear")) for (a, b), (f, g) in ends]
    if (after := math.ceil(scene.end_time / dt) - in_pulse) > 0:
        legs.append(Leg(float(nodes[-1]), float(nodes[-1] + after * dt), after, None))
    return legs


def _long_steps(case: Case) -> Iterator[Mistake]:
    """Yield velocity Verlet with too long steps, whose length is fitted."""
    longest = 0.8 * stable_step(case.scene, _VERLET.interval)
    trials = (longest * np.geomspace(0.02, 1.0, 14)).tolist()
    yield Mistake(
        lambda dt: f"the error of velocity Verlet with steps of about {dt:.3g} s",
        lambda dt: case.of(case.scene, dt),
        trials,
    )


def steps_and_samples(case: Case) -> Iterator[Mistake]:
    """Yield samples in place of maxima, and steps across corners, at the step given.

    If none is given they are tried at usual steps, and samples of an accurate run, too.
    """
    if case.dt is not None:
        yield from _with_step(case, case.dt)
        return
    longest = stable_step(case.scene, _VERLET.interval)
    shortest = 0.01 * longest  # shorter steps change the peaks by 1e-5 or less
    decades = range(math.floor(math.log10(shortest)), math.ceil(math.log10(longest)))
    for decade, digits in itertools.product(decades, _ROUND):
        dt = float(f"{digits}e{decade}")
        if shortest <= dt <= longest:
            with contextlib.suppress(StepUnstable):
                yield from _with_step(case, dt)
            text = f"samples in place of maxima, {dt:.3g} s apart, of an accurate run"
            yield fixed(text, _accurate_samples(case, dt))


def _accurate_samples(case: Case, apart: float) -> FloatArray:
    """Return the highest samples of the true contact forces [N], at multiples of an interval."""
    before = np.floor(case.reference.peak_time[case.judged] / apart)  # the highest is next to it
    times = np.unique(np.minimum(apart * np.append(before, before + 1), case.scene.end_time))
    # Accuracy of runs that are sampled: samples are off by 1e-5 or more
    native = Native(rtol=1e-6, time_limit=max(case.deadline.left, 1e-3))
    history = native.run(case.scene, record=times).history
    assert history is not None
    return np.asarray(history.contact_force.max(axis=0))


def _with_step(case: Case, dt: float) -> Iterator[Mistake]:
    step = f"velocity Verlet with steps of {dt:.3g} s"
    across = f"{step}, past the corners of the pulse"
    for legs, how in ((case.scene.schedule(dt), step), (past_corners(case.scene, dt), across)):
        if legs is not None:
            interpolated, sampled = velocity_verlet(case.scene, legs, case.deadline)
            yield fixed(f"samples in place of maxima, {how}", sampled)
            yield fixed(f"what {how} has", interpolated)


# ---- Mistakes in damping

# logarithms of trial coefficients of damping, natural units; sqrt(5) is a restitution of 0
_COEFFICIENTS = np.log(np.geomspace(1e-6, 2.2, 14)).tolist()


def damping(case: Case) -> Iterator[Mistake]:
    """Yield no damping, contacts that pull or not, and each law with any coefficient."""
    scene, right, without = case.scene, case.scene.contact, case.size
    pulls = right is not None and right.attraction
    walls: Any = {name: wall.damped(None) for name in ("wall", "near_wall")
                  if (wall := getattr(scene, name)) is not None}  # fmt: skip

    def peaks(contact: Contact | None) -> FloatArray:
        return case.of(replace(scene, contact=contact, **walls))

    def fitted(law: DampingLaw, log: float) -> FloatArray:
        return peaks(contact_of(scene, law, log, pulls))

    if right is not None:
        elastic = peaks(None)
        without = case.residual(elastic)
        yield fixed("no damping", elastic)
        text = "contacts that are kept from pulling" if pulls else "contacts that pull as they open"
        yield fixed(text, peaks(replace(right, attraction=not pulls)))
    for law in DAMPING:
        words = partial(damping_in_words, scene, law)
        yield Mistake(words, partial(fitted, law), _COEFFICIENTS, LIMITS.damping * without)


def contact_of(scene: Scene, law: DampingLaw, log: float, pulls: bool = False) -> Contact:
    """Return a law of damping by the logarithm of its coefficient in natural units.

    The coefficient is c in F = d^(3/2) + c d^q d', and alpha in the law of restitution.
    """
    units, strength = scene.units, math.exp(log)
    parameter = {
        "restitution": of_ratio(strength / math.sqrt(5), pulls=True),
        "viscoelastic": strength / 1.5 * units.time,
        "dashpot": strength * units.force * units.time / units.length,
    }[law]
    return Contact(law, attraction=pulls, **{DAMPING[law]: parameter})


def damping_in_words(scene: Scene, law: DampingLaw, log: float) -> str:
    """Return words for a law of damping with a fitted coefficient, in place of the scene's."""
    fitted, right = contact_of(scene, law, log), scene.contact
    if right is None:
        return _described(fitted)
    if right.damping != law:
        return f"{_described(fitted)} in place of {_described(right)}"
    if right.restitution is None:
        factor = fitted.parameter / right.parameter
    else:
        factor = math.exp(log) / math.sqrt(5) / damping_ratio(right.restitution)
    text = f"{_described(fitted)} in place of {_described(right).rpartition(_LAWS[law])[2].strip()}"
    text += f" (coefficient {factor:.4g} times the scene's)"
    return _named(text, near(slips_of(scene, law), factor))


_LAWS = {
    "restitution": "damping of restitution",
    "viscoelastic": "damping of viscoelastic spheres with the relaxation time",
    "dashpot": "damping by dashpots of",
}


def _described(contact: Contact) -> str:
    """Return a law in words, with three digits, as many as noisy peaks determine."""
    unit = "" if contact.restitution else f" {keys_of(Contact)[DAMPING[contact.damping]].unit}"
    return f"{_LAWS[contact.damping]} {contact.parameter:.3g}{unit}"


# ---- Families of mistakes, and the search for a cause


class Family(NamedTuple):
    """Mistakes in one thing."""

    name: str  # the quantity that is wrong
    mistakes: Callable[[Case], Iterator[Mistake]]  # raises TooExpensive at the case's deadline
    terms: tuple[str, ...] | None = ()  # terms that a scene may have; None for any
    is_costly: bool = False  # takes seconds: left out where another mistake explains everything


FAMILIES = (
    Family("stiffness, mass or duration", _stiffness, ("damping",)),
    Family("applied force", _force, ("damping",)),
    Family("units and numbers of the contacts", _written, None),
    Family("number of granules", _granules, ("damping",)),
    Family("the pulse", _pulse),
    Family("steps too long", _long_steps),
    Family("steps and samples", steps_and_samples, is_costly=True),
    Family("damping", damping, None, is_costly=True),
)
"""All families, in the order in which they are tried."""


def families_for(scene: Scene) -> list[Family]:
    """Return the families that can be tried in a scene."""
    terms = set(scene.terms)
    return [family for family in FAMILIES if family.terms is None or terms <= set(family.terms)]


class Explanation(NamedTuple):
    """Sentences on the cause of wrong peaks; None where there is no such sentence."""

    cause: str | None = None  # the mistake that explains the differences
    hint: str | None = None  # else the nearest slip, or that the differences look like noise
    remark: str | None = None  # causes that were not tried


def likely_cause(case: Case, progress: Callable[[str], object] = lambda _: None) -> Explanation:
    """Return the mistake that explains the differences best.

    ``progress`` is called with a line before each family of mistakes.
    """
    size = case.size
    if size < max(LIMITS.size, LIMITS.errors * case.reference.error_estimate):
        return Explanation()
    if np.count_nonzero(case.judged) < LIMITS.contacts:
        few = f"a cause is named only if at least {LIMITS.contacts} contacts are judged"
        return Explanation(remark=few)
    if (text := _rounded(case) or _one_contact(case)) is not None:
        return Explanation(text)
    fits: list[tuple[Fit, Mistake]] = []
    remark = None
    for family in families_for(case.scene):
        if family.is_costly and any(fit.left <= LIMITS.accuracy * size for fit, _ in fits):
            continue  # no other mistake can leave as little
        progress(f"looking for the cause: {family.name}")
        try:
            fits += [(mistake.tried(case), mistake) for mistake in family.mistakes(case)]
        except TooExpensive:
            remark = f"some mistakes were not tried, since that takes too long: {family.name}"
            break
        except RunFailed:
            pass  # the mistake is impossible in this scene
    fits.sort(key=lambda pair: pair[0].left)
    least = fits[0][0].left if fits else math.inf
    # With more left than is allowed, a mistake explains only a part, unless the rest is noise.
    allowed = max(case.tolerance, LIMITS.accuracy * size)
    if least > LIMITS.cause * size or (least > allowed and not fits[0][0].leaves_noise):
        return Explanation(hint=_hint(case, fits, remark is None), remark=remark)
    alike = LIMITS.alike * max(least, LIMITS.accuracy * size)
    sentences = [mistake.words(fit.value) for fit, mistake in fits if fit.left <= alike]
    left = f"leaves {max(least / size, 1e-6):.1g} of the differences"
    return Explanation(f"{'; or '.join(dict.fromkeys(sentences))}; {left}", None, remark)


def _hint(case: Case, fits: list[tuple[Fit, Mistake]], all_tried: bool) -> str:
    """Return a sentence on the mistake nearest to the peaks, or on their noise."""
    text = "no single known mistake explains these peaks"
    if not all_tried or case.scene.terms:
        text = "no mistake that was tried explains these peaks"
    off = case.differences
    rms, most = float(np.sqrt(np.mean(off**2))), float(np.max(np.abs(off)))
    even = most <= LIMITS.outlier * rms and rms <= LIMITS.noise
    about_0 = abs(np.mean(off)) <= LIMITS.shift * rms / np.sqrt(off.size)
    if off.size >= LIMITS.noisy_contacts and even and about_0 and jumps_like_noise(off):
        return (
            f"{text}: the differences look like noise of {100 * rms:.2g} % about the scene's"
            f" own peaks, with which they agree to {100 * most:.2g} %"
        )
    if not fits or fits[0][0].left > LIMITS.hint * case.size:
        return f"{text}, and none leaves less than {100 * LIMITS.hint:g} % of the differences"
    fit, mistake = fits[0]
    left = f"it leaves {100 * fit.left / case.size:.2g} % of the differences"
    return f"{text}. The nearest is: {mistake.words(fit.value)}; {left}"


def _rounded(case: Case) -> str | None:
    """Return a sentence if the peaks are the scene's, rounded to a few digits or decimals."""
    given, expected = case.given[case.judged], case.reference.peak_force[case.judged]
    most = float(np.max(np.abs(case.differences)))
    if most > LIMITS.rounding:
        return None
    size = np.floor(np.log10(np.maximum(given, np.finfo(float).tiny)))
    units = {f"{count} digits": 10.0 ** (size - count + 1) for count in range(2, 8)}
    units |= {f"{10**-count} N": np.array(10.0**-count) for count in (-2, -1)}
    units |= {f"{count} decimals": np.array(10.0**-count) for count in range(7)}
    for place, unit in units.items():  # of the last digit
        is_round = np.allclose(given, unit * np.round(given / unit), rtol=1e-12, atol=0)
        # Half a unit of the last digit, and the rounding of binary numbers
        room = (0.5 + 1e-6) * unit + case.reference.error_estimate * expected
        if is_round and np.all(np.abs(given - expected) <= room):
            return (
                f"rounding: these are the scene's own peaks to {place}, which moves them by"
                f" {100 * most:.2g} % at most; write more digits"
            )
    return None


def _one_contact(case: Case) -> str | None:
    """Return a sentence if one contact alone is wrong; mistakes do that only at the free end."""
    off = np.abs(case.differences)
    *_, next_to, most = np.sort(off)
    contact = case.reference.contact[case.judged][int(np.argmax(off))]
    if most < LIMITS.alone * next_to or contact > case.scene.chain.granules - FREE_END:
        return None
    others = f"within {next_to:.1g} of the reference" if next_to else "right"
    return f"contact {contact} alone, as after a typing error: the others are {others}"
