"""Fits: values of a scene's keys by which it reads what was measured, with their intervals."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hertzchain.arrays import Array, FloatArray
from hertzchain.engines.native import Native
from hertzchain.errors import SceneError, require
from hertzchain.fits.fitted import NOISE_KNOWN, RARE, Fit, Parameter, limits_of
from hertzchain.fits.model import ACCURATE, GAIN, Model, lasting
from hertzchain.limits import TIME_LIMIT, Deadline
from hertzchain.scene.given import SceneLike, to_scene
from hertzchain.scene.scene import Scene
from hertzchain.scene.uncertain import Uncertain
from hertzchain.showing import ShowProgress, telling
from hertzchain.sweeps.columns import column_named, is_whole
from hertzchain.sweeps.keys import base_values, full_name
from hertzchain.verdict.traces.matching import aligned, expected
from hertzchain.verdict.traces.traces import read_traces

if TYPE_CHECKING:
    import pandas

_ALIKE = 1e-4
"""Ratio of the weakest combination's slope to the strongest's below which traces do not determine
it: the error of slopes themselves is about 1e-5."""

_UNKNOWN = 0.5
"""Relative deviation from which on a value is not known."""

_LEAST_SQUARE = 0.5
"""Least mean square of differences over the noise by which intervals are scaled. The noise may be
overestimated by what a coarsely sampled pulse bends; without any it is the least of the model."""

_OTHER_STARTS = (0.8, 1.25)
"""Start values over those of the scene, tried where more than noise remains as residual."""

_RANGE = 100.0
"""Greatest change of a value by a factor."""

_NEARBY = (-3.0, -1.0, 1.0, 3.0)
"""Standard deviations from the best values, along each axis of the covariance, at which a better
fit is looked for: forces that jump between two samples make local minima some deviations apart."""

_LOWER, _MOST_SEARCHES = 0.5, 8
"""Half the squared differences by which a fit is better, that of one deviation; and the most
searches, chosen."""

_ALIKE_AXES = 1.3
"""Ratio of deviations by slopes and by differences up to which another look is not worth it."""

_AT_END = 1e-6
"""Relative distance from an end of its range at which a value counts as at it: least squares stay
inside by less."""


def fit(
    scene: SceneLike,
    traces: Path | str | pandas.DataFrame | Sequence[Path | str | pandas.DataFrame],
    free: Sequence[str],
    *,
    columns: Mapping[str, str] | None = None,
    shift: bool = True,
    time_limit: float = TIME_LIMIT,
    progress: ShowProgress = None,
) -> Fit:
    """Fit values of a scene to measured forces over time, by least squares over native runs.

    Parameters
    ----------
    scene
        The scene with the values to start from, or the path of its file; its end does not matter.
    traces
        What gauges read, as for ``judge_traces``; several files or tables are fitted at once.
    free
        Keys to be fitted, such as ``chain.young_modulus``; ``gain`` is the measured over the
        true force, the same for all gauges.
    columns
        Columns of the files, as for ``judge_traces``.
    shift
        Whether the clock of each file begins at another time than the run, which is then fitted.
    time_limit
        Time limit of the whole fit [s].
    progress
        True for a line in the terminal or notebook on what is being done, or a function that is
        called with each such line.

    Raises
    ------
    SceneError
        For keys that cannot be fitted, or that these traces do not tell apart: it says what of them
        is known.
    HertzchainError
        For files that cannot be read.
    TooExpensive
        If it takes longer than the time limit.
    """
    scene, deadline = to_scene(scene), Deadline(time_limit)
    keys, start, bounds = _free(scene, free)
    is_list = isinstance(traces, Sequence) and not isinstance(traces, str)
    given: list[Any] = list(traces) if is_list else [traces]  # type: ignore[arg-type]
    require(len(given) > 0, "traces", None, "must be at least one file or table")
    measured = [read_traces(scene, one, columns or {}) for one in given]
    gauges = tuple(dict.fromkeys(gauge for one in measured for gauge in one.gauges))
    with telling(progress) as report_progress:
        report_progress("native: the scene as it is given")
        known = expected(scene, gauges, Native(rtol=1e-8, time_limit=time_limit))
        files = []
        for one in measured:
            own = known.of([gauges.index(gauge) for gauge in one.gauges])
            files.append(aligned(one, own, None if shift else 0.0))
        model = Model(scene, keys, start, bounds, known, files, deadline, is_shifted=shift)
        _refuse_alike(model.slopes(model.begin, ACCURATE), keys)
        best = None
        for x in _starts(model.begin, len(keys), bounds):
            if best is not None and best[1] <= NOISE_KNOWN and model.chance(best[2]) >= RARE:
                break
            report_progress(f"least squares from {_said(model.values(x))}")
            found = _least_squares(model, x, bounds)
            if best is None or found[1] < best[1]:
                best = found
    assert best is not None
    for key, value, least, most in zip(keys, best[0][: len(keys)], *bounds, strict=True):
        allowed = "is at the end of what it can be: start elsewhere, or leave it out"
        is_within = least * (1 + _AT_END) < value < most * (1 - _AT_END)
        require(bool(is_within), key, model.values(best[0])[key], allowed)
    return _of(model, scene, keys, start, *best)


def _free(
    scene: Scene, free: Sequence[str]
) -> tuple[list[str], list[float], tuple[FloatArray, FloatArray]]:
    """Return full names of keys, their start values, and the bounds of values over these."""
    is_list = isinstance(free, Sequence) and not isinstance(free, str) and len(free) > 0
    require(is_list, "free", free, "must be a list of keys, such as ['chain.young_modulus']")
    keys = [name if name == GAIN else full_name(name, scene) for name in free]
    require(len(set(keys)) == len(keys), "free", free, "names a key twice")
    start, low, high = [], [], []
    for key in keys:
        value: Any = 1.0 if key == GAIN else base_values(scene, [key])[key]
        is_number = isinstance(value, float) and not (key != GAIN and is_whole(key))
        allowed = (
            "cannot be fitted: the scene must have a number other than 0, and no whole number, from"
            " which the fit starts"
        )
        require(is_number and np.isfinite(value) and value != 0, key, value, allowed)
        least, most = limits_of(key)
        ends = sorted((least / value, most / value))
        start.append(float(value))
        low.append(max(ends[0], 1 / _RANGE))
        high.append(min(ends[1], _RANGE))
        allowed = f"must be within {least:g} and {most:g}, not at an end, to be fitted"
        require(low[-1] < 1 < high[-1], key, value, allowed)
    return keys, start, (np.array(low), np.array(high))


def _starts(
    begin: FloatArray, keys: int, bounds: tuple[FloatArray, FloatArray]
) -> list[FloatArray]:
    """Return where searches begin: at the scene's values, then with one key higher or lower."""
    found = [begin]
    for k in range(keys):
        for factor in _OTHER_STARTS:
            moved = begin.copy()
            moved[k] = np.clip(factor, bounds[0][k], bounds[1][k])
            found.append(moved)
    return found


def _least_squares(
    model: Model, begin: FloatArray, bounds: tuple[FloatArray, FloatArray]
) -> tuple[FloatArray, float, FloatArray]:
    """Return the best values, mean square, and differences over the noise."""
    from scipy.optimize import least_squares

    shifts = np.full(begin.size - bounds[0].size, np.inf)
    low, high = np.append(bounds[0], -shifts), np.append(bounds[1], shifts)
    begin = np.clip(begin, low, high)
    left = max(model.size - model.series - begin.size, 1)
    for search in range(_MOST_SEARCHES):
        found = least_squares(
            model.differences, begin, jac=model.slopes, bounds=(low, high),
            x_scale="jac", xtol=1e-7, ftol=1e-9,
        )  # fmt: skip
        mean_square = 2 * float(found.cost) / left
        # Far from noise it is no minimum that is meant: another start may find it.
        if mean_square > NOISE_KNOWN or search == _MOST_SEARCHES - 1:
            break
        better = _beside(model, found.x, found.cost, np.asarray(found.jac))
        if better is None:
            break
        begin = better
    return found.x, mean_square, np.asarray(found.fun)


def _of(
    model: Model, base: Scene, keys: list[str], start: list[float], x: FloatArray,
    mean_square: float, off: FloatArray,
) -> Fit:  # fmt: skip
    slopes = model.slopes(x, ACCURATE)
    _refuse_alike(slopes, keys)
    # Correlated samples carry less information than as many independent ones.
    along, wider = lasting(off)
    factor = max(mean_square, _LEAST_SQUARE) * wider
    covariance = np.asarray(np.linalg.inv(slopes.T @ slopes) * factor)
    moves = _moves(covariance)
    changes = [_change(model, x, move, slopes) for move in moves.T]
    covariance = _over(moves, changes) * factor
    deviation = np.sqrt(np.diag(covariance))
    count = len(keys)
    relative = deviation[:count] / np.abs(x[:count])
    worst = int(np.argmax(relative))
    allowed = f"is not known from these traces, to {relative[worst]:.0%} alone: leave it out"
    require(bool(relative[worst] < _UNKNOWN), keys[worst], None, allowed)
    parameters = tuple(
        Parameter(
            key, float(x[k]) * start[k], start[k], float(deviation[k]) * abs(start[k]), _unit(key)
        )
        for k, key in enumerate(keys)
    )
    correlation = (covariance / np.outer(deviation, deviation))[:count, :count]
    uncertain = tuple(Uncertain(one.key, one.deviation) for one in parameters if one.key != GAIN)
    fitted = replace(model.scene(x), run=base.run, gauges=model.gauges, uncertain=uncertain)
    return Fit(
        fitted, parameters, correlation, tuple(model.shifts(x).tolist()), mean_square, along,
        model.size, model.runs, model.chance(off),
    )  # fmt: skip


def _beside(model: Model, x: FloatArray, cost: float, slopes: FloatArray) -> FloatArray | None:
    """Return better values some deviations beside others; None where there are none.

    Axes are those of the slopes, then those of differences over a deviation if they are others.
    """
    moves = _moves(np.linalg.pinv(slopes.T @ slopes))
    for _ in range(2):
        ends = [x + far * move for move in moves.T for far in _NEARBY]
        possible = [end for end in ends if model.allows(end)]
        off = [model.differences(end) for end in possible]
        costs = [0.5 * float(np.sum(one**2)) for one in off]
        if min(costs, default=cost) < cost - _LOWER:
            return np.asarray(possible[int(np.argmin(costs))])
        if len(possible) < len(ends):
            return None
        low, high = (off[_NEARBY.index(side) :: len(_NEARBY)] for side in (-1.0, 1.0))
        halves = [(far - near) / 2 for near, far in zip(low, high, strict=True)]
        other = _moves(_over(moves, halves))
        ratio = np.linalg.norm(other, axis=1) / np.linalg.norm(moves, axis=1)
        if np.max(ratio) < _ALIKE_AXES:
            return None
        moves = other
    return None


def _moves(covariance: Array) -> FloatArray:
    """Return standard deviations along the axes of a covariance, one a column."""
    size, axes = np.linalg.eigh(covariance)
    return np.asarray(axes * np.sqrt(np.maximum(size, 0.0)))


def _change(model: Model, x: FloatArray, move: FloatArray, slopes: FloatArray) -> FloatArray:
    """Return how differences change by a move, over the largest part of it that both ways allow.

    By slopes alone where a quarter of the move passes an end of what values can be.
    """
    for part in (1.0, 0.5, 0.25):
        ends = x + part * move, x - part * move
        if all(map(model.allows, ends)):
            high, low = map(model.differences, ends)
            return np.asarray((high - low) / (2 * part))
    return np.asarray(slopes @ move)


def _over(moves: FloatArray, changes: list[FloatArray]) -> FloatArray:
    """Return a covariance by the changes of differences along moves, but for their scale.

    Slopes at a point are steeper where forces jump between two samples, as where damped contacts
    begin with a collision: intervals from slopes alone were up to three times too narrow there.
    """
    over = np.array(changes)
    return np.asarray(moves @ np.linalg.pinv(over @ over.T) @ moves.T)


def _unit(key: str) -> str:
    """Return the unit of a key, as its column has it."""
    found = None if key == GAIN else re.search(r"\[(.*)\]", column_named(key).label)
    return found[1] if found else ""


def _said(values: Mapping[str, float]) -> str:
    return ", ".join(f"{key} = {value:.6g}" for key, value in values.items())


def _refuse_alike(slopes: FloatArray, keys: list[str]) -> None:
    """Raise a SceneError if some combination of the keys changes nothing that was measured."""
    count = len(keys)
    own, shifts = slopes[:, :count], slopes[:, count:]
    if shifts.size:
        own = own - shifts @ np.linalg.lstsq(shifts, own, rcond=None)[0]
    _, strength, directions = np.linalg.svd(own, full_matrices=False)
    if strength[-1] > _ALIKE * strength[0]:
        return
    if count == 1:
        raise SceneError(keys[0], None, "changes nothing at these gauges: leave it out")
    nothing: Array = directions[-1]
    moved = [k for k in range(count) if abs(nothing[k]) > 0.05 * np.max(np.abs(nothing))]
    if len(moved) == 1:
        raise SceneError(keys[moved[0]], None, "changes nothing at these gauges: leave it out")
    names = " and ".join(keys[k] for k in moved)
    if len(moved) == 2:
        first, second = moved
        power = -nothing[first] / nothing[second]
        what = f"known is {keys[first]} * ({keys[second]})^{power:.3g}"
    else:
        first = moved[0]
        parts = [f"{keys[k]} by {nothing[k] / nothing[first]:+.2g} %" for k in moved]
        what = f"a change of {', '.join(parts)} changes nothing"
    raise SceneError(
        names, None, f"cannot be told apart by these traces: {what}; leave one of them out"
    )
