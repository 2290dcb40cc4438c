"""Fits: values of a scene's keys that reproduce measured forces, with their intervals."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.native.backend import Native
from hertzchain.errors import SceneError, require
from hertzchain.lab.model import (
    LEAST_NOISE,
    SLOPE_RTOL,
    Free,
    Model,
    OfPeaks,
    OfTraces,
    free_of,
    is_of_instrument,
    lasting,
    limits_of,
    unit_of_key,
    with_unit,
)
from hertzchain.limits import TIME_LIMIT, Deadline
from hertzchain.observables.result import context_of
from hertzchain.progress import ShowProgress, telling
from hertzchain.scene.scene import Scene, SceneLike, to_scene
from hertzchain.scene.terms import Uncertain
from hertzchain.sweeps.design import sobol_points
from hertzchain.verdict.results import COLUMNS, read
from hertzchain.verdict.traces import (
    Traces,
    aligned,
    expected_of,
    is_traces,
    names_in,
    read_records,
)

MOST_MEAN_SQUARE = 1.35
"""Mean square of differences over the noise above which they are not noise: noise is known to 5 %
from 200 samples, and enters squared."""

MOST_RESIDUAL = 0.1
"""Relative residual of peaks above which it is not their noise (chosen)."""

LEAST_CHANCE = 1e-2
"""Probability of lasting differences below which they are not noise (chosen): with 1e-3 a tenth of
the wrong models that differed by more than 3 u_val were not detected (measured)."""

NORMAL_95 = 1.959964
"""Standard deviations of a normal distribution with 95 % on both sides."""


@dataclass(frozen=True)
class Parameter:
    """A fitted value.

    Parameters
    ----------
    key
        Its key in the scene file, ``gain``, or one of a gauge such as ``gauge_6.drift``. Where
        several files have the gauge, the number of the file follows: ``gauge_6.drift[2]``.
    value, start
        The fitted value, and that of the given scene, in SI units; 0 for what is added to a force.
    deviation
        Its standard deviation.
    unit
        The unit, as text; empty for a pure number.
    """

    key: str
    value: float
    start: float
    deviation: float
    unit: str

    @property
    def interval_95(self) -> tuple[float, float]:
        """Ends of the interval that holds the true value in 95 of 100 experiments."""
        half, (least, most) = NORMAL_95 * self.deviation, limits_of(self.key)
        return max(self.value - half, least), min(self.value + half, most)

    def to_dict(self) -> dict[str, Any]:
        """Return the parameter as a JSON object."""
        return {
            "key": self.key,
            "value": self.value,
            "interval_95": list(self.interval_95),
            "unit": self.unit,
            "start": self.start,
        }


@dataclass(frozen=True, eq=False, repr=False)
class Fit:
    """A scene fitted to traces.

    Parameters
    ----------
    scene
        The scene with the fitted values, which are ``uncertain`` in it.
    parameters
        The values, with deviations.
    correlation
        Correlations of the values, shape (parameters, parameters).
    shifts
        Time on the clock of each file at which the run begins [s].
    mean_square
        Mean square of the differences over the noise: 1 if they are noise and nothing else.
    autocorrelation
        Correlation of differences with those of the next sample: 0 for white noise.
    samples, runs
        Number of compared samples, and of runs.
    chance
        Probability that noise causes differences that last as long as these.
    noise_is_known
        False for peaks, whose relative noise is that of the differences.
    of_recordings
        Sentences on recordings, such as clipped ones and those that drift; usually none.
    """

    scene: Scene
    parameters: tuple[Parameter, ...]
    correlation: FloatArray
    shifts: tuple[float, ...]
    mean_square: float
    autocorrelation: float
    samples: int
    runs: int
    chance: float
    noise_is_known: bool = True
    of_recordings: tuple[str, ...] = ()

    @property
    def is_noise(self) -> bool:
        """Whether the scene differs from the measurement by no more than noise."""
        return not self._is_large and self.chance >= LEAST_CHANCE

    @property
    def _is_large(self) -> bool:
        return self.mean_square > (MOST_MEAN_SQUARE if self.noise_is_known else MOST_RESIDUAL**2)

    @property
    def remarks(self) -> tuple[str, ...]:
        """Sentences on the residual and on clipped recordings; usually none."""
        residual = math.sqrt(self.mean_square)
        of_peaks = f"{residual:.0%} of the peaks, more than measuring explains"
        large = f"{residual:.2g} times the noise" if self.noise_is_known else of_peaks
        left = (
            f"the residual is {large}: something other than the fitted values differs from the"
            " scene, and the intervals are widened by that"
        )
        lasts = (
            "the residual is no larger than the noise, but lasts for half a pulse or several"
            f" contacts, as noise does in less than one of {1 / LEAST_CHANCE:,.0f} fits:"
            " something other than the fitted values differs from the scene, and the intervals do"
            " not count it"
        )
        if self.is_noise:
            return self.of_recordings
        return (left if self._is_large else lasts, *self.of_recordings)

    def to_dict(self) -> dict[str, Any]:
        """Return the fit as a JSON object."""
        return {
            "parameters": [parameter.to_dict() for parameter in self.parameters],
            "correlation": self.correlation.tolist(),
            "shift_s": list(self.shifts),
            "residuals": {
                f"mean_square_over_{'noise' if self.noise_is_known else 'peaks'}": self.mean_square,
                "autocorrelation": self.autocorrelation,
                "chance": self.chance,
                "samples": self.samples,
            },
            "runs": self.runs,
            "remarks": list(self.remarks),
            **context_of(self.scene),
        }

    def __repr__(self) -> str:
        from hertzchain.report.contents import card

        facts = []
        for parameter in self.parameters:
            # Two digits more than are known, so that value and interval belong together.
            digits = max(3, 2 - math.floor(math.log10(parameter.deviation / abs(parameter.value))))
            low, high = (f"{end:.{digits}g}" for end in parameter.interval_95)
            value = f"{parameter.value:.{digits}g} {parameter.unit}".rstrip()
            facts.append((parameter.key, f"{value}, 95 % within {low} to {high}"))
        if len(self.parameters) > 1:
            size = np.abs(np.tril(self.correlation, -1))
            places = np.unravel_index(size.argmax(), size.shape)
            both = " and ".join(self.parameters[int(k)].key for k in places)
            facts.append(("strongest correlation", f"{size.max():.3f}, {both}"))
        residual = ("residual over the noise", f"{self.mean_square**0.5:.3g}")
        if not self.noise_is_known:
            residual = ("residual over the peaks", f"{self.mean_square**0.5:.2g}")
        shifts = ", ".join(f"{shift:.6g}" for shift in self.shifts)
        facts += [("the run begins at", f"{shifts} s of the measured clock")] if shifts else []
        facts += [
            residual,
            ("samples, runs", f"{self.samples:,}, {self.runs:,}"),
            *(("remark", remark) for remark in self.remarks),
        ]
        return card("Fit", facts)


if TYPE_CHECKING:
    import pandas

    Measured = Path | str | pandas.DataFrame | Mapping[int, float]

_LEAST_SLOPE_RATIO = 1e-4
"""Ratio of the weakest combination's slope to the strongest's below which traces do not determine
it: the error of slopes themselves is about 1e-5."""

_NAMED_SHARE = 0.05
"""Least change of a key, over the largest of a combination, that is named (chosen)."""

_UNKNOWN_DEVIATION = 0.5
"""Relative deviation from which on a value is not known."""

_LEAST_MEAN_SQUARE = 0.5
"""Least mean square of differences over the noise by which intervals are scaled. The curvature of a
coarsely sampled pulse may lead to a too large noise; without noise the least noise of the model is
used."""

_MOST_SEARCHES, _START_RANGE = 8, (0.8, 1.25)
"""Most further searches: from starts where granules fly or the residual is more than noise, spread
evenly over the given ranges, and the range around the scene's values otherwise (chosen: of four
none came to the best minimum in experiment 322 of ``validation/experiments.py``); and from better
values near a minimum."""

_NEARBY_DEVIATIONS = (-3.0, -1.0, 1.0, 3.0)
"""Standard deviations from the best values, along each axis of the covariance, at which a better
fit is searched: forces that jump between two samples cause local minima some deviations apart."""

_LEAST_DECREASE = 1.0
"""Decrease of squared differences by which a fit is better: that of one deviation."""

_LAST_FTOL, _SMOOTHED_FTOL, _MOST_SEARCH_STEPS = 1e-6, 1e-4, 25
"""Relative decrease of squares at which a search ends, 1e-3 of a deviation in 2,000 samples; that
of a smoothed one; and the most steps (chosen): where forces jump, searches do not converge."""

_EQUAL_DEVIATION_RATIO, _MOST_DEVIATION_ROUNDS = 1.1, 4
"""Ratio of successive deviations up to which they count as equal; and the most repetitions of their
computation (chosen)."""

_END_RATIO = 1e-6
"""Relative distance from an end of its range at which a value counts as at it: least squares stay
inside by less."""


_CLOCKS = ("shared", "own", "run")


def fit(
    scene: SceneLike,
    traces: Measured | Sequence[Measured],
    free: Sequence[str],
    *,
    columns: Mapping[str, str] | None = None,
    clock: str = "shared",
    time_limit: float = TIME_LIMIT,
    progress: ShowProgress = None,
) -> Fit:
    """Fit values of a scene to measured forces over time, by least squares over native runs.

    Parameters
    ----------
    scene
        The scene with the values to start from, or the path of its file; its end matters for
        peaks alone.
    traces
        Forces of gauges over time, as for ``judge_traces``, or peak forces of contacts, as for
        ``judge``; several files or tables are fitted at once.
    free
        Keys to be fitted, such as ``chain.young_modulus``, with a range where wanted,
        ``chain.gap=1 um:9 um``; ``gain`` is the ratio of the measured to the true force, the same
        for all gauges. Of one gauge, named as its column without its unit: ``gauge_6.gain``,
        ``gauge_6.offset`` at the time 0 of the file [N], and ``gauge_6.drift`` [N/s].
    columns, progress
        As for ``judge_traces``.
    clock
        ``shared``: files of different gauges are channels of one record and share a clock, other
        files have their own, and the time at which the run begins is fitted. ``own``: each file has
        its own. ``run``: clocks are that of the run.
    time_limit
        Time limit of the whole fit [s].

    Raises
    ------
    SceneError
        For keys that cannot be fitted, or that these traces do not determine separately: the error
        gives the combination that is determined.
    HertzchainError
        For files that cannot be read.
    TooExpensive
        If it takes longer than the time limit.
    """
    allowed = f"must be one of {', '.join(_CLOCKS)}"
    require(clock in _CLOCKS, "clock", clock, allowed)
    scene, deadline = to_scene(scene), Deadline(time_limit)
    chosen = free_of(scene, free)
    is_list = isinstance(traces, Sequence) and not isinstance(traces, str)
    given: list[Any] = list(traces) if is_list else [traces]  # type: ignore[arg-type]
    are_files = all(
        isinstance(table, str | os.PathLike | Mapping) or hasattr(table, "select_dtypes")
        for table in given
    )
    require(len(given) > 0 and are_files, "traces", None, "must be at least one file or table")
    with telling(progress) as report_progress:
        report_progress("native: the scene as it is given")
        model: Model
        if any(_are_peaks(table, columns or {}) for table in given):
            allowed = "are of traces, and these are peaks: leave them out"
            require(clock == "shared" and not columns, "columns and the clock", None, allowed)
            model = OfPeaks(scene, chosen, [_peaks(scene, table) for table in given], deadline)
        else:
            measured = read_records(scene, given, columns or {}, clock == "own")
            model = _of_traces(scene, chosen, measured, deadline, is_shifted=clock != "run")
        _refuse_alike(model, model.slopes(model.begin, rtol=SLOPE_RTOL))
        flies = bool(np.any(np.greater(model.scene(model.begin).granules.gap, 0)))
        minima: list[_Minimum] = []
        for begin, widths in _searches(model):
            report_progress(f"least squares from {chosen.said(begin)}")
            minima.append(_least_squares(model, begin, widths))
            best = min(minima, key=lambda minimum: minimum.mean_square)
            # Where granules fly, the first minimum may be a wrong one even if only noise is left.
            is_noise = best.mean_square <= MOST_MEAN_SQUARE
            if not flies and is_noise and model.chance(best.off) >= LEAST_CHANCE:
                break
        best = _refined(model, best)
    _refuse_ends(chosen, best.x)
    return _of(model, scene, [best, *minima])


def _are_peaks(given: Any, columns: Mapping[str, str]) -> bool:
    if isinstance(given, Mapping) and not hasattr(given, "columns"):
        return True
    names = names_in(given)
    return set(COLUMNS) <= set(names) and not is_traces(names, columns)


def _peaks(scene: Scene, given: Any) -> FloatArray:
    """Return peak forces [N], shape (contacts,)."""
    allowed = f"must all be peaks, with the columns {' and '.join(COLUMNS)}, or all be traces"
    require(_are_peaks(given, {}), "files", None, allowed)
    return np.asarray(read(scene, given, "si", None).peak_force, np.float64)


def _of_traces(
    scene: Scene, free: Free, measured: list[Traces], deadline: Deadline, *, is_shifted: bool
) -> Model:
    first, files = free.scene(scene, np.ones(len(free.keys))), []
    runs = deadline.spend(
        lambda left: [
            expected_of(first, traces.gauges, Native(rtol=1e-8, time_limit=left))
            for traces in measured
        ]
    )
    for traces, expected in zip(measured, runs, strict=True):
        levelled, begin = aligned(traces, expected, None if is_shifted else 0.0)
        files.append((replace(traces, noise=levelled.noise), begin, expected))
    return OfTraces(scene, free, files, deadline, is_shifted=is_shifted)


def _searches(model: Model) -> Iterator[tuple[FloatArray, tuple[float, ...]]]:
    """Yield where searches begin, each with the widths over which it first smooths."""
    free, begin, count = model.free, model.begin, len(model.free.keys)
    yield begin, ()
    if model.widths:
        yield begin, model.widths
    low = np.where(free.is_given, free.low, np.maximum(free.low, _START_RANGE[0]))
    high = np.where(free.is_given, free.high, np.minimum(free.high, _START_RANGE[1]))
    for place in sobol_points(count, 0, np.arange(_MOST_SEARCHES)):
        yield np.append(low + place * (high - low), begin[count:]), model.widths


@dataclass(frozen=True, eq=False)
class _Minimum:
    """Variables at a minimum; differences over the noise there, mean square, and slopes."""

    x: FloatArray
    off: FloatArray
    mean_square: float
    slopes: FloatArray


def _least_squares(model: Model, begin: FloatArray, widths: Sequence[float]) -> _Minimum:
    from scipy.optimize import least_squares

    at = np.clip(begin, model.low, model.high)
    for width in (*widths, 0.0):
        solution = least_squares(
            model.differences, at, jac=model.slopes, args=(width,),
            bounds=(model.low, model.high), x_scale="jac",
            xtol=_SMOOTHED_FTOL if width else 1e-7, ftol=_SMOOTHED_FTOL if width else _LAST_FTOL,
            max_nfev=_MOST_SEARCH_STEPS,
        )  # fmt: skip
        at = solution.x
    mean_square = 2 * float(solution.cost) / max(model.size - model.offsets - at.size, 1)
    return _Minimum(at, np.asarray(solution.fun), mean_square, np.asarray(solution.jac))


def _refined(model: Model, minimum: _Minimum) -> _Minimum:
    """Return the best of minima some standard deviations apart, if the residual is noise."""
    for _ in range(_MOST_SEARCHES):
        better = None if minimum.mean_square > MOST_MEAN_SQUARE else _beside(model, minimum)
        if better is None:
            break
        minimum = _least_squares(model, better, ())
    return minimum


def _beside(model: Model, minimum: _Minimum) -> FloatArray | None:
    """Return better values several standard deviations away; None if there are no such values."""
    moves = _moves(_covariance(model, minimum.x, minimum.slopes, 1.0))
    ends = [minimum.x + far * move for move in moves.T for far in _NEARBY_DEVIATIONS]
    possible = [end for end in ends if model.allows(end)]
    squares = [float(np.sum(model.differences(end) ** 2)) for end in possible]
    if min(squares, default=np.inf) > float(np.sum(minimum.off**2)) - _LEAST_DECREASE:
        return None
    return np.asarray(possible[int(np.argmin(squares))])


def _of(model: Model, base: Scene, minima: Sequence[_Minimum]) -> Fit:
    """Return the fit of the first minimum."""
    best = minima[0]
    x, off, count = best.x, best.off, len(model.free.keys)
    slopes = model.slopes(x, rtol=SLOPE_RTOL)
    _refuse_alike(model, slopes)
    # Correlated samples carry less information than as many independent ones.
    along, wider = lasting(off)
    variance = max(best.mean_square, _LEAST_MEAN_SQUARE) * wider
    if not model.noise_is_known:
        variance = _unknown(off, x)
    covariance = _covariance(model, x, slopes, variance)
    covariance += _between(minima, covariance, variance)
    deviation = np.sqrt(np.diag(covariance))
    relative = deviation[:count] / np.abs(x[:count])
    worst = int(np.argmax(relative))
    if relative[worst] >= _UNKNOWN_DEVIATION:
        alone = _unknown_alone(model.given, relative[worst])
        raise _refusal(model, _moves(covariance[:count, :count])[:, -1], alone)
    parameters, correlation = _parameters(model, x, covariance, variance)
    uncertain = tuple(
        Uncertain(parameter.key, parameter.deviation)
        for parameter in parameters[:count]
        if not is_of_instrument(parameter.key)
    )
    gauges = model.gauges or base.gauges
    fitted = replace(model.scene(x), run=base.run, gauges=gauges, uncertain=uncertain)
    result = Fit(
        fitted, parameters, correlation, tuple(model.shifts(x).tolist()), best.mean_square, along,
        model.size, model.runs, model.chance(off), model.noise_is_known, model.remarks,
    )  # fmt: skip
    if result.is_noise:
        return result
    return replace(result, of_recordings=(*model.remarks, *model.drifts(off)))


def _unknown_alone(given: str, relative: float) -> str:
    alone = f"is not known from these {given}, to {relative:.0%} alone"
    if relative > 1:
        alone = f"these {given} do not depend on it beyond their noise"
    return f"{alone}: leave it out"


def _parameters(
    model: Model, x: FloatArray, covariance: FloatArray, variance: float
) -> tuple[tuple[Parameter, ...], FloatArray]:
    """Return the values of all keys and of what instruments add; correlations, (keys, keys)."""
    free, added, count = model.free, model.added(x), len(model.free.keys)
    moves = np.concatenate([np.eye(x.size)[:count] * np.array(free.start)[:, None], added.slopes])
    joint = moves @ covariance @ moves.T
    joint[count:, count:] += variance * added.covariance
    deviation = np.sqrt(np.diag(joint))
    keys = *free.keys, *added.keys
    values = *free.values(x).values(), *added.numbers
    starts = *free.start, *[0.0] * len(added.keys)
    parameters = []
    for key, value, start, off in zip(keys, values, starts, deviation.tolist(), strict=True):
        parameters.append(Parameter(key, float(value), start, off, unit_of_key(key)))
    return tuple(parameters), joint / np.outer(deviation, deviation)


def _refuse_ends(free: Free, x: FloatArray) -> None:
    """Raise a SceneError if a value is at an end of its range."""
    for k, (key, value) in enumerate(free.values(x).items()):
        low, high = sorted(free.start[k] * end[k] for end in (free.low, free.high))
        advice = "widen it" if free.is_given[k] else f"give a narrower one, {key}=LOW:HIGH"
        allowed = (
            f"{with_unit(key, value)} is at the end of what it can be, {low:g} to"
            f" {with_unit(key, high)}: {advice}, start elsewhere, or leave the key out"
        )
        is_within = free.low[k] * (1 + _END_RATIO) < x[k] < free.high[k] * (1 - _END_RATIO)
        require(bool(is_within), key, None, allowed)


def _unknown(off: FloatArray, x: FloatArray) -> float:
    """Return the variance of noise from differences, so that normal intervals hold 95 %."""
    from scipy.special import stdtrit  # quicker to load than scipy.stats

    left = off.size - x.size
    wider = float(stdtrit(left, 0.975)) / NORMAL_95
    return max(float(np.sum(off**2)) / left, LEAST_NOISE**2) * wider**2


def _covariance(model: Model, x: FloatArray, slopes: FloatArray, variance: float) -> FloatArray:
    """Return the covariance of the variables, from differences over their own deviations.

    ``variance`` is the variance of the noise. Slopes at a point are steeper where forces jump
    between two samples, as where damped contacts begin with a collision: intervals from slopes
    alone were up to three times too narrow there.
    """
    covariance = np.asarray(variance * np.linalg.pinv(slopes.T @ slopes), np.float64)
    for _ in range(_MOST_DEVIATION_ROUNDS):
        moves = _moves(covariance)
        over = np.array([_change(model, x, move, slopes) for move in moves.T])
        before, covariance = covariance, variance * moves @ np.linalg.pinv(over @ over.T) @ moves.T
        # A deviation of 0, where slopes are 0, has no ratio.
        if np.all(np.diag(covariance) <= _EQUAL_DEVIATION_RATIO**2 * np.diag(before)):
            break
    return np.asarray(covariance)


def _between(minima: Sequence[_Minimum], covariance: FloatArray, variance: float) -> FloatArray:
    """Return the covariance about the first of several minima whose order may be due to noise.

    Each has the weight of its likelihood; minima within a deviation of one another count once.
    """
    inverse, kept = np.linalg.pinv(covariance), list(minima[:1])
    for minimum in minima[1:]:
        ways = [minimum.x - other.x for other in kept]
        if all(way @ inverse @ way > 1 for way in ways):
            kept.append(minimum)
    squares = np.array([np.sum(minimum.off**2) for minimum in kept]) / variance
    weights = np.exp((squares[0] - squares) / 2)
    moves = np.stack([minimum.x - kept[0].x for minimum in kept])
    return np.asarray((weights / weights.sum() * moves.T) @ moves)


def _moves(covariance: FloatArray) -> FloatArray:
    """Return standard deviations along the axes of a covariance, one a column."""
    size, axes = np.linalg.eigh(covariance)
    return np.asarray(axes * np.sqrt(np.maximum(size, 0.0)))


def _change(model: Model, x: FloatArray, move: FloatArray, slopes: FloatArray) -> FloatArray:
    """Return how a move changes the differences; estimated from slopes if it leaves the range."""
    ends = x + move, x - move
    if not all(map(model.allows, ends)):
        return np.asarray(slopes @ move)
    high, low = map(model.differences, ends)
    return np.asarray((high - low) / 2)


def _refuse_alike(model: Model, slopes: FloatArray) -> None:
    """Raise a SceneError if some combination of the keys changes nothing that was measured."""
    key_slopes, shifts = np.split(slopes, [len(model.free.keys)], axis=1)
    if shifts.size:
        key_slopes = key_slopes - shifts @ np.linalg.lstsq(shifts, key_slopes, rcond=None)[0]
    _, strength, directions = np.linalg.svd(key_slopes, full_matrices=False)
    if strength[-1] > _LEAST_SLOPE_RATIO * strength[0]:
        return
    places = "contacts" if model.given == "peaks" else "gauges"
    alone = f"changes nothing at these {places} near this value: start elsewhere, or leave it out"
    raise _refusal(model, directions[-1], alone)


def _refusal(model: Model, nothing: FloatArray, alone: str) -> SceneError:
    """Return why keys are refused whose relative changes change ``nothing``; ``alone``: a key's."""
    moved = np.flatnonzero(np.abs(nothing) > _NAMED_SHARE * np.max(np.abs(nothing)))
    keys, changes = [model.free.keys[k] for k in moved], nothing[moved]
    if len(keys) == 1:
        return SceneError(keys[0], None, alone)
    if len(keys) == 2:
        what = f"known is {keys[0]} * ({keys[1]})^{-changes[0] / changes[1]:.3g}"
    else:
        parts = zip(keys, changes / changes[0], strict=True)
        by = ", ".join(f"{key} by {change:+.2g} %" for key, change in parts)
        what = f"a change of {by} changes nothing"
    allowed = f"cannot be told apart by these {model.given}: {what}; leave one of them out"
    return SceneError(" and ".join(keys), None, allowed)
