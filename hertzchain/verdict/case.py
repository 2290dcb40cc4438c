"""A case: wrong peaks of a scene, which causes have to explain."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.engines.native import Native
from hertzchain.errors import RunFailed, SceneError, TooExpensive
from hertzchain.limits import Deadline
from hertzchain.observables.result import Result
from hertzchain.scene.scene import Scene

_TOLERANCE = 1e-8  # tolerance of a step, damped contacts: peaks are right to 2e-8 (measured)
# Mean square jump over mean square residual: 2 for noise, 0.3 off for 59 contacts; 0.1 for waves,
# and 1 where the last contact alone is off, as in chains of another length (derived).
_NOISE = 1.2
_LOWEST = 1e-9  # peaks below this fraction of the reference count as zero


@dataclass(frozen=True)
class Cause:
    """A mistake, in words, and the part of the differences that it leaves (``Case.residual``)."""

    sentence: str
    residual: float
    rest: FloatArray | None = None  # residual of each judged contact, if kept

    @property
    def leaves_noise(self) -> bool:
        """Whether the residuals are known and jump from contact to contact like noise.

        For noise the mean square of jumps is twice that of the residuals (von Neumann).
        """
        if self.rest is None:
            return False
        jumps = np.sum(np.diff(self.rest) ** 2)
        return bool(jumps >= _NOISE * np.sum(self.rest**2))


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
        found = float(np.sqrt(np.mean(self.left(peak_force) ** 2)))
        return found if math.isfinite(found) else math.inf

    def cause(self, sentence: str, peak_force: FloatArray) -> Cause:
        """Return the cause for a mistake and its peaks [N], shape (N - 1,)."""
        return Cause(sentence, self.residual(peak_force), self.left(peak_force))

    def left(self, peak_force: FloatArray) -> FloatArray:
        """Return the residual of each judged contact."""
        lowest = _LOWEST * self.reference.peak_force[self.judged]
        ratio = np.maximum(self.given[self.judged], lowest) / np.maximum(
            peak_force[self.judged], lowest
        )
        return np.asarray(np.log(ratio))

    def of(self, scene: Scene) -> FloatArray:
        """Return true peaks of another scene [N]; NaN where there are none."""
        try:
            if scene.contact is not None:
                return self._damped(scene)
            run = Native(rtol=1e-8, peaks_only=True, time_limit=max(self.deadline.left, 1e-3))
            return run.run(scene).peak_force
        except TooExpensive:
            raise
        except (RunFailed, SceneError):
            return np.full_like(self.given, np.nan)

    def _damped(self, scene: Scene) -> FloatArray:
        """Return peaks of a scene with damped contacts, right to about 1e-8, by one run."""
        from hertzchain.engines.native import damped_runs

        run = damped_runs.simulate_damped(scene, _TOLERANCE, self.deadline)
        between = scene.chain.granules - 1  # a wall's contact is the last
        return np.asarray(run.peak_force[:between] * scene.units.force)

    def fit(
        self, family: Callable[[float], FloatArray], trials: Sequence[float]
    ) -> tuple[float, float]:
        """Fit the parameter of a family of peaks [N]; return it and the residual.

        Trials increase; every valley is searched, because the best trial may not lie in the deepest
        one.
        """
        from scipy.optimize import minimize_scalar

        left = [self.residual(family(x)) for x in trials]
        k = int(np.argmin(left))
        best, least = trials[k], left[k]
        if not math.isfinite(least):
            return best, math.inf
        if len(trials) == 1:
            return best, least
        for k in _valleys(left):
            bounds = trials[max(k - 1, 0)], trials[min(k + 1, len(trials) - 1)]
            square = minimize_scalar(
                lambda x: min(self.residual(family(x)), 1e100) ** 2,
                bounds=bounds,
                method="bounded",
                options={"xatol": 1e-9 * (bounds[1] - bounds[0])},
            )
            found = self.residual(family(float(square.x)))
            if found < least:
                best, least = float(square.x), found
        return best, least


def _valleys(values: Sequence[float]) -> list[int]:
    """Return the indices of finite values no higher than their neighbours."""
    walled = [math.inf, *values, math.inf]
    return [
        k
        for k, value in enumerate(values)
        if math.isfinite(value) and value <= min(walled[k], walled[k + 2])
    ]
