"""The best values of keys: those for which a number of a scene's result is least or largest."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from hertzchain.arrays import Array
from hertzchain.engines.native.backend import Native
from hertzchain.errors import HertzchainError, TooExpensive, did_you_mean, require
from hertzchain.fits.free import GAIN, free_of
from hertzchain.limits import TIME_LIMIT, Deadline
from hertzchain.observables.definitions import context_of
from hertzchain.observables.result import Result
from hertzchain.scene.given import SceneLike, to_scene
from hertzchain.scene.scene import Scene
from hertzchain.showing import ShowProgress, telling
from hertzchain.sweeps.columns import COUNTS, numbers_of, unit_of
from hertzchain.sweeps.keys import base_values

_ACCURATE = 1e-6
"""Accuracy of runs: a hundredth of the tolerance of the search."""

_TOLERANCE = 1e-4
"""Relative spread of values at which the search ends (chosen)."""

_EACH, _MOST = 8, 40
"""Scenes of a generation for each key, and the most generations (chosen): 1,000 runs for 3 keys."""

_AT_END = 1e-3
"""Part of a range within which a value counts as at its end."""

_NO_NUMBERS = {*COUNTS, "error_estimate", "wanted_error", "far_field_error", "speed_error"}
"""Numbers of a run that are not quantities of the chain."""


@dataclass(frozen=True, eq=False, repr=False)
class Optimum:
    """The best values that were found.

    Parameters
    ----------
    scene
        The scene with these values.
    number
        The number that is least or largest, by its name in a sweep.
    value, before
        The number with these values, and with those of the scene that was given.
    values, start
        The best values of the keys, and those in the scene that was given, None for none.
    remarks
        Sentences on values at the ends of their ranges; usually empty.
    runs
        Number of runs.
    """

    scene: Scene
    number: str
    value: float
    before: float
    values: Mapping[str, float]
    start: Mapping[str, float | None]
    remarks: tuple[str, ...]
    runs: int

    def to_dict(self) -> dict[str, Any]:
        """Return the optimum as a JSON object."""
        return {
            "number": self.number,
            "value": self.value,
            "before": self.before,
            "parameters": [
                {"key": key, "value": value, "unit": unit_of(key), "start": self.start[key]}
                for key, value in self.values.items()
            ],
            "runs": self.runs,
            "remarks": list(self.remarks),
            **context_of(self.scene),
        }

    def __repr__(self) -> str:
        from hertzchain.report.cards import card

        facts = [(self.number, f"{self.value:.5g}, before {self.before:.5g}")]
        for key, value in self.values.items():
            before = self.start[key]
            was = "not in the scene before" if before is None else f"before {before:.4g}"
            facts.append((key, f"{value:.4g} {unit_of(key)}, {was}"))
        facts += [("runs", f"{self.runs:,}"), *(("remark", one) for one in self.remarks)]
        return card("Optimum", facts)


def optimum(
    scene: SceneLike,
    number: str,
    free: Sequence[str],
    *,
    largest: bool = False,
    ties: Mapping[str, str] | None = None,
    seed: int = 0,
    time_limit: float = TIME_LIMIT,
    progress: ShowProgress = None,
) -> Optimum:
    """Search for the values of keys for which a number is least, over their whole ranges.

    SciPy's ``differential_evolution`` finds the best of several minima; Nelder and Mead's method
    then refines it.

    Parameters
    ----------
    scene
        A scene with all of the keys, or the path of its file.
    number
        A number of the result as a sweep names it, such as ``wall_peak_force_N``, or
        ``gauge_1_width_s``, the width of the first pulse in the first gauge.
    free
        Keys with their ranges: ``["chain.segments.1.radius=4 mm:9 mm"]``.
    largest
        Whether the number is to be largest.
    ties
        Formulas of keys that follow from others, as for ``sweep``.
    seed
        Seed of the evolution: the same gives the same values.
    time_limit, progress
        As for ``fit``.

    Raises
    ------
    SceneError
        For a number that the scene does not have, and keys that cannot vary.
    TooExpensive
        If it takes longer than the time limit.
    """
    from scipy.optimize import Bounds, differential_evolution, minimize

    scene, deadline = to_scene(scene), Deadline(time_limit)
    known = _numbers(_run(scene, deadline))
    allowed = f"is no number of this scene, which has {', '.join(known)}"
    require(number in known, number, None, allowed + did_you_mean(number, known))
    chosen = free_of(scene, free, ties)
    for key, is_given in zip(chosen.keys, chosen.is_given, strict=True):
        require(key != GAIN, key, None, "is of measured forces: leave it out")
        require(is_given, key, None, f"must have a range: {key}=LOW:HIGH")
    sign, runs = -1.0 if largest else 1.0, 1
    size = abs(known[number]) or 1.0

    def cost(x: Array) -> float:
        nonlocal runs
        runs += 1
        try:
            found = _numbers(_run(chosen.scene(scene, x), deadline)).get(number)
        except TooExpensive:
            raise
        except HertzchainError:  # an impossible scene is not the best
            return np.inf
        return np.inf if found is None else sign * found / size

    bounds = Bounds(chosen.low, chosen.high)
    with telling(progress) as report_progress:
        report_progress(f"native: scenes by which {number} is {'largest' if largest else 'least'}")
        found = differential_evolution(
            cost, bounds, x0=np.ones(len(chosen.keys)), popsize=_EACH, maxiter=_MOST,
            tol=_TOLERANCE, polish=False, seed=seed, init="sobol",
        )  # fmt: skip
        allowed = f"have no possible scene with {number} within their ranges"
        require(bool(np.isfinite(found.fun)), " and ".join(chosen.keys), None, allowed)
        best = minimize(
            cost, found.x, method="Nelder-Mead", bounds=bounds,
            options={"xatol": _TOLERANCE, "fatol": _TOLERANCE},
        )  # fmt: skip
    near = np.minimum(best.x - chosen.low, chosen.high - best.x) / (chosen.high - chosen.low)
    before = base_values(scene, chosen.keys).items()
    start = {key: value if np.isfinite(value) else None for key, value in before}
    said = "is at an end of its range: a wider one may give more"
    remarks = tuple(f"{chosen.keys[k]} {said}" for k in np.flatnonzero(near < _AT_END))
    return Optimum(
        chosen.scene(scene, best.x), number, sign * float(best.fun) * size, known[number],
        chosen.values(best.x), start, remarks, runs,
    )  # fmt: skip


def _run(scene: Scene, deadline: Deadline) -> Result:
    if deadline.left <= 0:
        raise deadline.passed()
    return Native(rtol=_ACCURATE, time_limit=deadline.left, peaks_only=True).run(scene)


def _numbers(found: Result) -> dict[str, float]:
    """Return the numbers of a result by their names in sweeps, and the widths in gauges."""
    widths = {f"gauge_{k}_width_s": one.width for k, one in enumerate(found.gauges or (), start=1)}
    every = {**numbers_of(found), **widths}
    return {
        name: float(value)
        for name, value in every.items()
        if name not in _NO_NUMBERS and value is not None and np.isfinite(value)
    }
