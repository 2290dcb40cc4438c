"""A case: wrong peaks of a scene, and how a known mistake is tried on them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.engines.native.backend import Native
from hertzchain.errors import RunFailed, SceneError, TooExpensive
from hertzchain.limits import Deadline
from hertzchain.observables.result import Result
from hertzchain.scene.scene import Scene

_RTOL = 1e-8  # wanted accuracy of trial runs; smaller differences get no cause

_TOLERANCE = 1e-8  # tolerance of a step, damped contacts: peaks are right to 2e-8 (measured)
# Mean square jump over mean square residual: 2 for noise, 0.3 off for 59 contacts; 0.1 for waves,
# and 1 where only the last contact is off, as in chains of another length (derived).
_NOISE = 1.2
_LOWEST = 1e-9  # peaks below this fraction of the reference count as zero


def jumps_like_noise(values: FloatArray) -> bool:
    """Return whether values jump from contact to contact like noise about 0.

    For noise the mean square of jumps is twice that of the values (von Neumann).
    """
    return bool(np.sum(np.diff(values) ** 2) >= _NOISE * np.sum(values**2))


@dataclass(frozen=True, eq=False)
class Found:
    """The parameter of a mistake that explains a case best."""

    value: Any
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
        lowest = _LOWEST * self.reference.peak_force[self.judged]
        ratio = np.maximum(self.given[self.judged], lowest) / np.maximum(
            peak_force[self.judged], lowest
        )
        known = np.isfinite(ratio)
        return np.log(ratio[known]) if np.count_nonzero(~known) <= 1 else np.zeros(0)

    def of(self, scene: Scene, dt: float | None = None) -> FloatArray:
        """Return true peaks of another scene [N], or those of velocity Verlet at a step [s].

        They are NaN where there are none.
        """
        try:
            if scene.contact is not None:
                return self._damped(scene)
            method: dict[str, Any] = {"rtol": _RTOL}
            if dt is not None:
                method = {"method": "velocity-verlet", "dt": dt}
            native = Native(
                **method, peaks_only=True, time_limit=max(self.deadline.left, 1e-3),
                wanted="first" if self.of_first_pulses else "all",
            )  # fmt: skip
            run = native.run(scene)
            first = run.first_pulses if self.of_first_pulses else None
            return run.peak_force if first is None else np.nan_to_num(first.force)
        except TooExpensive:
            raise
        except (RunFailed, SceneError):
            return np.full_like(self.given, np.nan)

    def _damped(self, scene: Scene) -> FloatArray:
        """Return peaks of a scene with damped contacts, right to about 1e-8, by one run."""
        from hertzchain.engines.native import damped_runs

        wants = self.of_first_pulses
        run = damped_runs.simulate_damped(scene, _TOLERANCE, self.deadline, first=wants)
        first = run.peaks.first
        peaks = run.peak_force if first is None else np.nan_to_num(first.force)
        return np.asarray(peaks * scene.units.force)

    def fit(self, made: Callable[[float], FloatArray], trials: Sequence[float]) -> Found:
        """Fit the parameter of a mistake that makes peaks [N].

        Trials increase; every valley is searched, because the best trial may not lie in the deepest
        one.
        """
        from scipy.optimize import minimize_scalar

        tried = [made(x) for x in trials]
        left = [self.residual(peaks) for peaks in tried]
        k = int(np.argmin(left))
        best = Found(trials[k], left[k], self.left(tried[k]))
        for k in _valleys(left) if len(trials) > 1 else ():
            bounds = trials[max(k - 1, 0)], trials[min(k + 1, len(trials) - 1)]
            square = minimize_scalar(
                lambda x: min(self.residual(made(x)), 1e100) ** 2,
                bounds=bounds,
                method="bounded",
                options={"xatol": 1e-9 * (bounds[1] - bounds[0])},
            )
            peaks = made(float(square.x))
            if self.residual(peaks) < best.left:
                best = Found(float(square.x), self.residual(peaks), self.left(peaks))
        return best


@dataclass(frozen=True)
class Mistake:
    """A known mistake: its words, how its peaks are computed, and how its parameter is fitted."""

    words: Callable[[Any], str]  # its words, from its parameter
    made: Callable[[Any], FloatArray]  # peaks [N], (N - 1,), or NaN
    trials: Sequence[float] = (0.0,)  # parameters to begin with, increasing; one if none is fitted
    most: float = math.inf  # residual from which on it is not named

    def tried(self, case: Case) -> Found:
        """Return the parameter that explains a case best."""
        found = case.fit(self.made, self.trials)
        return found if found.left < self.most else Found(found.value, math.inf)


def fixed(words: str, peak_force: FloatArray) -> Mistake:
    """Return a mistake without a parameter."""
    return Mistake(lambda _: words, lambda _: peak_force)


def _valleys(values: Sequence[float]) -> list[int]:
    """Return the indices of finite values no higher than their neighbours."""
    walled = [math.inf, *values, math.inf]
    return [
        k
        for k, value in enumerate(values)
        if math.isfinite(value) and value <= min(walled[k], walled[k + 2])
    ]
