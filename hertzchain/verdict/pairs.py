"""Two mistakes at once: the pair of known mistakes that explains wrong peaks, if one does.

Logarithms of small effects add up. So every pair is tried on what each of its mistakes does alone,
and those that come near are made together and fitted.
"""

from __future__ import annotations

import itertools
import math
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.scene.pulse import Pulse, PulseTable
from hertzchain.scene.scene import Scene
from hertzchain.verdict.case import Case
from hertzchain.verdict.families import Family, families, words_of
from hertzchain.verdict.mistaken import Mistakes, Runs
from hertzchain.verdict.slips import scale_in_words

FEWEST = 12  # contacts: two parameters and the choice among 700 pairs fit fewer too easily (chosen)

_FINE = 12  # parameters between two trials of a mistake, by interpolation
_ALIKE = 3  # pairs of mistakes in the same two things that are
_MOST = 100  # pairs that are made together and fitted; the right one was among the first 10
_MOST_RUNS = 3500  # plain runs of fits, a second; others count in proportion
_DAMPED_RUN, _DAMPED_STEPS = 8, 40  # plain runs that a damped one takes, and one by velocity Verlet
_ROUNDS = 12  # of a fit; most end after five
_GOOD, _FEW_ROUNDS = 1e-4, 4  # of the differences: rounds where a pair leaves no more than that
_ENOUGH = 1e-6  # of the differences: a fit that leaves no more is done
_PROMISING = 0.2  # of the differences and effects: most that is left where they add up; 0.08 seen
_HOPEFUL = 0.05  # of the differences: fits that leave more have to get better by a third a round
_SPREADS, _LEAPS = (0.04, 0.004), 21  # of logarithms of steps, and how many are tried
_AT_FREE_END = 1e-6  # relative; what a granule more changes there, at least

_SHIFTED = {
    1: "contact i has the peak of contact i + 1",
    -1: "contact i has the peak of contact i - 1",
}


@dataclass(frozen=True)
class Pair:
    """Two mistakes with their parameters, and what they leave."""

    families: tuple[Family, ...]
    made: Mistakes
    scale: float  # of all peaks; 1 where that is not one of the two
    numbers: str  # how contacts are numbered, if that is one of the two
    left: float

    @property
    def kinds(self) -> frozenset[str]:
        """Of what they are mistakes."""
        found = frozenset[str]().union(*(family.kinds for family in self.families))
        found |= {"scale"} if self.scale != 1 else frozenset()
        return found | ({"numbers"} if self.numbers else frozenset())

    def words(self, scene: Scene) -> str:
        """What the two are called."""
        names = [words_of(scene, family, self.made) for family in self.families]
        if self.scale != 1:
            names.append(scale_in_words(scene, self.scale))
        return ", together with ".join([*names, self.numbers] if self.numbers else names)


@dataclass(frozen=True, eq=False)
class _Curve:
    """Logarithms of what a mistake makes of the peaks, over its parameter."""

    family: Family
    parameter: FloatArray  # shape (points,)
    change: FloatArray  # shape (points, contacts)


@dataclass(frozen=True, eq=False)
class _Given:
    """Peaks in question, numbered as they may be, as logarithms over the truth."""

    wanted: FloatArray  # shape (contacts,), NaN where there is none
    numbers: str

    @property
    def known(self) -> NDArray[np.bool_]:
        """Where there are any, shape (contacts,)."""
        return np.isfinite(self.wanted)


@dataclass(frozen=True, eq=False)
class _Seed:
    """A pair to begin a fit with, and what is left if its mistakes add up."""

    left: float  # mean square
    effect: float  # that of what each of them does
    given: _Given
    families: tuple[Family, ...]
    start: tuple[float, ...]
    scaled: bool


def can_be_paired(case: Case) -> bool:
    """Whether pairs can be sought: uniform chains under a pulse, with enough contacts."""
    pulse = isinstance(case.scene.shock, Pulse | PulseTable)
    enough = np.count_nonzero(case.judged) >= FEWEST
    return bool(case.scene.is_plain and pulse and enough)


def pairs(case: Case) -> list[Pair]:
    """The pairs that leave the least, best first. Raises TooExpensive at the deadline."""
    runs = Runs(case.scene, case.deadline)
    curves = [
        curve
        for family in families(case.scene, case.dt)
        if (curve := _curve(case, runs, family)) is not None
    ]
    seeds = [seed for given in _numberings(case) for seed in _seeds(curves, given)]
    found: list[Pair] = []
    for seed in _best(seeds, case.size**2):
        if _runs_taken(runs) > _MOST_RUNS:
            break
        done = any(pair.left < _GOOD * case.size for pair in found)
        found.append(_Fit(case, runs, seed, _FEW_ROUNDS if done else _ROUNDS).pair())
    return sorted(found, key=lambda pair: pair.left)


def _best(seeds: list[_Seed], size: float) -> list[_Seed]:
    """The best seeds, a few of mistakes in the same two things; ``size`` of the peaks, squared.

    Where two mistakes make up for each other, they add up less well.
    """
    best: list[_Seed] = []
    alike: Counter[tuple[object, ...]] = Counter()
    for seed in sorted(seeds, key=lambda seed: seed.left):
        kinds = *(family.kinds for family in seed.families), seed.scaled, seed.given.numbers
        alike[kinds] += 1
        if alike[kinds] <= _ALIKE and seed.left <= _PROMISING**2 * (size + seed.effect):
            best.append(seed)
    return best[:_MOST]


def _runs_taken(runs: Runs) -> float:
    """How many plain runs would have taken as long."""
    return sum(
        1 if not made.law else _DAMPED_STEPS if made.dt else _DAMPED_RUN for made in runs.kept
    )


def _numberings(case: Case) -> Iterator[_Given]:
    truth = case.reference.peak_force
    given = np.where(case.judged, case.given, np.nan)
    unknown = [np.nan]
    for numbers, peaks in (
        ("", given),
        (_SHIFTED[1], np.append(unknown, given[:-1])),
        (_SHIFTED[-1], np.append(given[1:], unknown)),
        ("contacts are numbered from the far end", given[::-1]),
    ):
        with np.errstate(divide="ignore", invalid="ignore"):
            wanted = np.log(peaks / np.where(truth > 0, truth, np.nan))
        wanted = np.where(np.isfinite(wanted), wanted, np.nan)
        if np.count_nonzero(np.isfinite(wanted)) >= FEWEST:
            yield _Given(wanted, numbers)


def _curve(case: Case, runs: Runs, family: Family) -> _Curve | None:
    """What a mistake does alone; None where it cannot be made."""
    from scipy.interpolate import PchipInterpolator

    truth = case.reference.peak_force
    made = [family.make(Mistakes(), x) for x in family.trials.tolist()]
    with np.errstate(divide="ignore", invalid="ignore"):
        change = np.log(np.array([runs.peaks(one) for one in made]) / truth)
    pressed = case.judged | np.all(np.isfinite(change), axis=0)
    there = np.all(np.isfinite(change[:, pressed[: truth.size]]), axis=1)
    if "granules" in family.kinds:  # a chain that is shorter lacks a contact
        there = np.array([True])
    trials, change = family.trials[there], change[there]
    if trials.size < min(4, family.trials.size):
        return None
    if not family.is_fitted:
        return _Curve(family, trials, change)
    points = np.arange(_FINE * (trials.size - 1) + 1) / _FINE
    parameter = np.interp(points, np.arange(trials.size), trials)
    fine = PchipInterpolator(trials, np.where(np.isfinite(change), change, 0.0))(parameter)
    fine[:, ~pressed] = np.nan
    return _Curve(family, parameter, fine)


def _seeds(curves: Sequence[_Curve], given: _Given) -> Iterator[_Seed]:
    """Pairs with the parameters at which their mistakes add up to the least."""
    for a, b in itertools.combinations(curves if not given.numbers else (), 2):
        if a.family.kinds & b.family.kinds:
            continue
        at = given.known & _felt(a) & _felt(b)
        off, change = given.wanted[at] - a.change[:, at], b.change[:, at]
        # |wanted - a - b|^2 of all their parameters
        left = np.sum(off**2, axis=1)[:, np.newaxis] - 2 * off @ change.T
        left += np.sum(change**2, axis=1)
        i, j = np.unravel_index(int(np.argmin(left)), left.shape)
        start = float(a.parameter[i]), float(b.parameter[j])
        mean = max(float(left[i, j]), 0.0) / np.count_nonzero(at)
        effect = float(np.mean(a.change[i, at] ** 2) + np.mean(change[j] ** 2))
        yield _Seed(mean, effect, given, (a.family, b.family), start, scaled=False)
    for curve in curves:
        at = given.known & _felt(curve)
        off = given.wanted[at] - curve.change[:, at]
        if given.numbers:
            left = np.mean(off**2, axis=1)
        elif "force" in curve.family.kinds:
            continue  # the same as another stiffness, where every peak is off
        else:
            left = np.var(off, axis=1)
        best = int(np.argmin(left))
        yield _Seed(
            float(left[best]),
            float(np.mean(curve.change[best, at] ** 2)),
            given,
            (curve.family,),
            (float(curve.parameter[best]),),
            scaled=not given.numbers,
        )
    if given.numbers:
        yield _Seed(float(np.nanvar(given.wanted)), 0.0, given, (), (), scaled=True)


def _felt(curve: _Curve) -> NDArray[np.bool_]:
    """Contacts where changes add up to those of another mistake."""
    known = np.all(np.isfinite(curve.change), axis=0)
    if "granules" not in curve.family.kinds:
        return np.asarray(known)
    with np.errstate(invalid="ignore"):
        return np.asarray(known & (np.abs(curve.change[0]) < _AT_FREE_END))


@dataclass(frozen=True, eq=False)
class _Fit:
    """A search for the parameters with which two mistakes leave the least, by Levenberg."""

    case: Case
    runs: Runs
    seed: _Seed
    rounds: int  # at most

    def pair(self) -> Pair:
        """The pair with its parameters, near those to start from."""
        families, size = self.seed.families, self.case.size
        free = [k for k, family in enumerate(families) if family.is_fitted]
        x = np.array(self.seed.start)
        here = self.off(x)
        least, damping = _size(here), 1e-3
        for _ in range(self.rounds if free and math.isfinite(least) else 0):
            before = least
            slopes = np.array([_slope(self.off, x, k, families[k].step) for k in free])
            for _ in range(4):
                trial = self.moved(x, slopes, here, damping, free)
                there = self.off(trial)
                if _size(there) < least:
                    x, here, least = trial, there, _size(there)
                    damping = max(damping / 10, 1e-9)
                    break
                damping *= 10
            hopeful = 0.99 if least < _HOPEFUL * size else 0.7
            if least > hopeful * before or least < _ENOUGH * size:
                break
        damped = any("damping" in family.kinds for family in families)
        if least < _HOPEFUL * size and not damped:  # those take too long
            for k in free:
                if families[k].is_stepped:
                    x, least = self.polished(x, least, k, [other for other in free if other != k])
        scale, made = 1.0, self.made(x)
        if self.seed.scaled:
            scale = math.exp(float(np.mean(self.wanted(made))))
        return Pair(families, made, scale, self.seed.given.numbers, least)

    def polished(
        self, x: FloatArray, least: float, k: int, others: Sequence[int]
    ) -> tuple[FloatArray, float]:
        """Parameters near ``x`` that leave less, where one changes the peaks by leaps.

        Every value of that one is tried, and those that would leave the least with the others as
        they then should be.
        """
        for spread in _SPREADS:
            slopes = np.array([_slope(self.off, x, o, self.seed.families[o].step) for o in others])
            trials = []
            for shift in np.linspace(-spread, spread, _LEAPS):
                trial = x.copy()
                trial[k] += shift
                there = self.off(trial)
                if others and np.all(np.isfinite(there)):
                    change = np.linalg.lstsq(slopes.T, there, rcond=None)[0]
                    trial[list(others)] -= change
                    there = there - change @ slopes
                trials.append((_size(there), trial))
            for _, trial in sorted(trials, key=lambda one: one[0])[:3]:
                after = _size(self.off(trial))
                if after < least:
                    x, least = trial, after
        return x, least

    def made(self, x: FloatArray) -> Mistakes:
        """The mistakes with their parameters."""
        made = Mistakes()
        for family, value in zip(self.seed.families, x.tolist(), strict=True):
            made = family.make(made, value)
        return made

    def wanted(self, made: Mistakes) -> FloatArray:
        """What is left of the peaks that are given, where the mistakes can be made."""
        given, truth = self.seed.given, self.case.reference.peak_force
        peaks = self.runs.peaks(made)
        extra = self.made(np.array(self.seed.start)).granules
        at = given.known
        if extra < 0:
            at = at & (np.arange(at.size) < at.size + extra)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(given.wanted[at] - np.log(peaks[at] / truth[at]))

    def off(self, x: FloatArray) -> FloatArray:
        """What is left with parameters; a factor of all peaks is left out where it is fitted."""
        left = self.wanted(self.made(x))
        return left - np.mean(left) if self.seed.scaled else left

    def moved(
        self,
        x: FloatArray,
        slopes: FloatArray,
        here: FloatArray,
        damping: float,
        free: Sequence[int],
    ) -> FloatArray:
        """The next parameters, at most two trials away."""
        normal = slopes @ slopes.T
        normal += damping * np.diag(np.diag(normal))
        change = np.linalg.lstsq(normal, slopes @ here, rcond=None)[0]
        trial = x.copy()
        for k, step in zip(free, change.tolist(), strict=True):
            trials = self.seed.families[k].trials
            reach = 2 * float(trials[1] - trials[0])
            trial[k] = np.clip(x[k] - np.clip(step, -reach, reach), trials[0], trials[-1])
        return trial


def _slope(
    off: Callable[[FloatArray], FloatArray], x: FloatArray, k: int, step: float
) -> FloatArray:
    """How fast what is left changes with a parameter; 0 where nothing can be said."""
    low, high = x.copy(), x.copy()
    low[k] -= step / 2
    high[k] += step / 2
    return np.nan_to_num((off(high) - off(low)) / step, posinf=0.0, neginf=0.0)


def _size(values: FloatArray) -> float:
    """Root mean square; infinite where a value is not known."""
    found = float(np.sqrt(np.mean(values**2)))
    return found if math.isfinite(found) else math.inf
