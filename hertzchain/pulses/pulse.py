"""A measured pulse as a pulse table with few rows: found in its recording, without baseline."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.errors import HertzchainError, is_finite, require
from hertzchain.pulses.recording import (
    LEAST_NOISE_SAMPLES,
    LEAST_SAMPLES,
    Noise,
    Recording,
    noise_before,
    noise_within,
    resolution_of,
)
from hertzchain.scene.shocks import PulseTable

Places = NDArray[np.intp]

_HALF_BOW_IMPULSE = 0.1
"""Impulse of half a bow over height and length, rounded up: a parabola about its straight line of
least squares, which is the Legendre polynomial of degree 2, reaches 1 / sqrt(27) / 2 = 0.096."""

_NOISE_BRIDGE_LEVEL = 0.8
"""Level that the integral of noise about its straight line exceeds in one of 10 lines, over density
and root of the length. Measured: 0.72 to 0.81 for white noise of 20 to 1000 samples.
"""

_TIP_OVER_BOW = 3.0  # limit of a tip, which has little impulse, over that of a bow; chosen
_OUTLIER_DEVIATIONS = 6.0  # standard deviations that no sample in millions exceeds by noise


def corners_of(time: FloatArray, force: FloatArray, bend: float, noise: Noise) -> Places:
    """Return the indices of samples at corners of straight lines that follow a force.

    ``bend`` is the largest distance of the force from a line [N]; bends within the noise are not
    followed.
    """
    sums = _sums(time, force)

    def is_straight(first: int, last: int) -> bool:
        samples = slice(first, last + 1)
        return _is_straight(time[samples], force[samples], bend, noise)

    places, open_lines = {0, time.size - 1}, [(0, time.size - 1)]
    while open_lines:
        first, last = open_lines.pop()
        if not is_straight(first, last):
            middle = _best_cut(sums, first, last)
            places.add(middle)
            open_lines += [(first, middle), (middle, last)]
    kept = sorted(places)
    for _ in range(2):  # rounds in which corners move to their best places: a third changes few
        at = 1
        while at < len(kept) - 1:
            before, after = kept[at - 1], kept[at + 1]
            if is_straight(before, after):
                del kept[at]
                continue
            moved = _best_cut(sums, before, after)
            if is_straight(before, moved) and is_straight(moved, after):
                kept[at] = moved
            at += 1
    return np.array(kept)


def _weights(time: FloatArray) -> FloatArray:
    """Weights of samples for the integral of straight lines: half the time between neighbours."""
    return np.convolve(np.diff(time), (0.5, 0.5))


def heights(time: FloatArray, force: FloatArray, places: Places) -> FloatArray:
    """Return least squares at the corners, at least 0, with the impulse of the samples [N]."""
    from scipy.interpolate import make_lsq_spline

    clock = time[places] / time[-1]
    knots = np.concatenate([clock[:1], clock, clock[-1:]])
    lines = make_lsq_spline(time / time[-1], force, knots, 1, np.sqrt(_weights(time) / time[-1]))
    height = np.maximum(lines.c, 0.0)
    return np.asarray(height * (np.trapezoid(force, time) / np.trapezoid(height, time[places])))


def largest_bow(length: float, bend: float, noise: Noise) -> float:
    """Return the largest distance of a force from a line [N] of a length in time [s]."""
    return max(bend, _NOISE_BRIDGE_LEVEL / _HALF_BOW_IMPULSE * noise.density / math.sqrt(length))


def _is_straight(time: FloatArray, force: FloatArray, bend: float, noise: Noise) -> bool:
    """Return whether samples follow their straight line of least squares closely enough."""
    if time.size < 3:
        return True
    length = float(time[-1] - time[0])
    off = force - np.polynomial.Polynomial.fit(time, force, 1, w=np.sqrt(_weights(time)))(time)
    running = np.cumsum(0.5 * (off[1:] + off[:-1]) * np.diff(time))
    allowed = _HALF_BOW_IMPULSE * length * largest_bow(length, bend, noise)
    farthest = _TIP_OVER_BOW * bend + _OUTLIER_DEVIATIONS * noise.deviation
    return bool(np.abs(running).max() <= allowed and np.abs(off).max() <= farthest)


def _sums(time: FloatArray, force: FloatArray) -> FloatArray:
    """Return cumulative sums for squared differences from lines, shape (6, n + 1).

    Times are fractions of the duration and forces of the largest force, so that sums of squares
    keep their digits.
    """
    part, height = time / time[-1], force / max(float(force.max()), np.finfo(float).tiny)
    terms = np.stack([np.ones_like(part), part, part**2, height, part * height, height**2])
    return np.concatenate([np.zeros((6, 1)), np.cumsum(_weights(time) * terms, axis=1)], axis=1)


def _best_cut(sums: FloatArray, first: int, last: int) -> int:
    """Return the place where a cut gives the two lines nearest to the samples."""
    middle = np.arange(first + 1, last)
    left = sums[:, middle + 1] - sums[:, [first]]
    right = sums[:, [last + 1]] - sums[:, middle]
    return int(middle[np.argmin(_squares(left) + _squares(right))])


def _squares(sums: FloatArray) -> FloatArray:
    """Return least sums of squared differences from lines, (lines,), from sums, (6, lines)."""
    count, x, xx, y, xy, yy = sums
    slope, spread = xy - x * y / count, xx - x * x / count
    squares: FloatArray = yy - y * y / count - slope**2 / spread
    return squares


_SURE_DEVIATIONS = 5.0
"""Threshold in standard deviations of averages (chosen): Gaussian noise exceeds it in 3 of 10
million.
"""

_END_FORCE_RATIO = 0.01  # of F0: pulses that end with their recording are off by less (measured)


@dataclass(frozen=True, eq=False)
class Signal:
    """The pulse in a recording."""

    time: FloatArray  # of its samples from its start, which is 0 [s], shape (samples,)
    force: FloatArray  # without the baseline, at least 0 [N], shape (samples,)
    start: float  # in the recording [s]
    baseline: float  # that was subtracted [N]
    baseline_samples: int  # of which it is the mean; 0 if it was given or none was subtracted
    baseline_error: float  # its standard deviation [N]; 0 as above
    noise: Noise
    left_out: tuple[float, float]  # impulse before the start and after the end [N s]
    remarks: tuple[tuple[str, str], ...]  # changes, and remarks to check, as labels and texts
    warnings: tuple[str, ...] = ()  # reasons for wrong numbers of the pulse; usually empty


def pulse_of(
    recording: Recording,
    baseline: float | None = None,
    start: float | None = None,
    end: float | None = None,
) -> Signal:
    """Find the pulse in a recording.

    ``baseline`` is the value of the file without a force, in the unit of its column, by default the
    mean before the pulse; ``start`` and ``end`` are times in the recording [s], by default where
    averages of the force leave the noise, and where they are last above it. HertzchainError if
    there is no pulse, or one that pulls, or for an impossible option.
    """
    time, force = recording.time, recording.force
    step = float(time[-1] - time[0]) / (time.size - 1)
    resolution = resolution_of(force)
    given_first = None if start is None else _place(time, "--start", start)
    given_last = None if end is None else _place(time, "--end", end)
    inside = slice(given_first or 0, time.size if given_last is None else given_last + 1)
    possible = baseline is None or is_finite(baseline)
    require(possible, "--baseline", baseline, "must be a finite number")
    given_level = None if baseline is None else baseline * recording.newtons
    level = _rough_level(force) if given_level is None else given_level
    _refuse_few(time, inside.start, inside.stop - 1)
    crest = inside.start + int(np.argmax(force[inside]))
    _refuse_pull(force[inside], level)
    rising, falling = _half_heights(force, level, crest)
    window = max(1, (falling - rising) // 20) // 2 * 2 + 1
    averages = averaged(force, window)
    before = min(_foot(averages, level, crest), time.size if given_first is None else given_first)
    _refuse_two(time, averages[:before] - level, float(force[crest]) - level, crest)
    samples = 0
    # A baseline has at least a tenth of the width of the pulse
    if before < max(LEAST_NOISE_SAMPLES, (falling - rising) // 10):
        level, noise = given_level or 0.0, noise_within(force, step, resolution)
    else:
        noise = noise_before(force[:before], step, resolution)
        if given_level is None:
            samples, level = before, float(force[:before].mean())
    height = float(force[crest]) - level
    limit = max(_SURE_DEVIATIONS * min(noise.deviation, noise.of_mean(window, step)), 1e-9 * height)
    above = np.flatnonzero(averages > level + limit)
    if not above.size:
        raise HertzchainError(
            f"no pulse stands out of the noise, {noise.deviation:.2g} N: name another column with"
            " --force, or say with --start and --end where the pulse is"
        )
    quiet = np.flatnonzero(averages[: rising + 1] <= level + limit)
    first = int(quiet.max(initial=0)) if given_first is None else given_first
    last = min(int(above[-1]) + 1, time.size - 1) if given_last is None else given_last
    _refuse_few(time, first, last)
    samples_inside = force[first : last + 1] - level
    of_baseline = noise.of_mean(samples, step) if samples else 0.0
    parts = slice(first + 1), slice(last, None)
    left = [float(np.trapezoid(force[part] - level, time[part])) for part in parts]
    warnings = [cut_off(force[inside], resolution)]
    if given_last is None:
        impulse = float(np.trapezoid(samples_inside, time[first : last + 1]))
        is_level = given_level is not None or samples > 0
        off = no_return(force - level, height, step, noise, is_level)
        warnings.insert(0, off or left_out(time[last:], left[1], impulse, noise, of_baseline))
    is_given = given_level is not None
    remarks = _remarks(recording, samples_inside, level, noise, before, samples, is_given)
    return Signal(
        time[first : last + 1] - time[first],
        without_negative(samples_inside, window, limit),
        float(time[first]), level, samples, of_baseline, noise, (left[0], left[1]),
        remarks, tuple(filter(None, warnings)),
    )  # fmt: skip


def _remarks(
    recording: Recording, inside: FloatArray, level: float, noise: Noise, before: int,
    samples: int, is_given: bool,
) -> tuple[tuple[str, str], ...]:  # fmt: skip
    """Return the changes to samples, and remarks to check, as labels and texts."""
    source = "given" if is_given else f"mean of {samples:,} samples before the pulse"
    if not (is_given or samples):
        source = "none taken off: too few samples before the pulse"
    shown = f"{level / recording.newtons:.4g} in the file, " if recording.newtons != 1.0 else ""
    how = "before the pulse"
    if before < LEAST_NOISE_SAMPLES:
        how = "as samples scatter about their neighbours"
    remarks = [
        ("baseline", f"{shown}{level:.4g} N ({source})"),
        ("noise", f"{noise.deviation:.2g} N, standard deviation {how}"),
    ]
    if negative := int(np.count_nonzero(inside < 0)):
        lowest = f"{negative:,}, the lowest {inside.min():.3g} N: set to 0"
        remarks.append(("samples below 0", lowest))
    return tuple(remarks)


def _rough_level(force: FloatArray) -> float:
    """Return the approximate baseline [N]: the median of the first samples."""
    crest = int(np.argmax(np.abs(force - np.median(force[:LEAST_SAMPLES]))))
    return float(np.median(force[: max(LEAST_SAMPLES, crest // 8)]))


def _half_heights(force: FloatArray, level: float, crest: int) -> tuple[int, int]:
    """Return the indices at which the force crosses half its height, before and after the crest."""
    below = np.flatnonzero(force < level + 0.5 * (force[crest] - level))
    after = int(below[below > crest].min(initial=force.size - 1))
    return int(below[below < crest].max(initial=0)), after


def _refuse_few(time: FloatArray, first: int, last: int) -> None:
    """Refuse too few samples between two of them."""
    there = max(last - first + 1, 0)
    if there < LEAST_SAMPLES:
        raise HertzchainError(
            f"there are {there} samples from {time[first]:.6g} s to {time[max(last, 0)]:.6g} s, a"
            f" pulse needs {LEAST_SAMPLES}: delete them if they are a spike, or give --start and"
            " --end in times of the file"
        )


def averaged(values: FloatArray, window: int) -> FloatArray:
    """Return means over an odd number of samples, fewer at the ends; shape of the values."""
    import pandas

    means = pandas.Series(values).rolling(window, min_periods=1, center=True).mean()
    return means.to_numpy(np.float64)


def without_negative(force: FloatArray, window: int, limit: float) -> FloatArray:
    """Force without negative values; parts with a mean below ``limit`` are averaged first.

    Setting only the negative half of noise to 0 would add to the impulse.
    """
    averages = averaged(force, window)
    return np.maximum(np.where(averages < limit, averages, force), 0.0)


def _refuse_pull(force: FloatArray, level: float) -> None:
    up, down = float(force.max()) - level, level - float(force.min())
    if down > up:
        raise HertzchainError(
            f"the largest signal, {-down:.3g} N, pulls; a pulse pushes: turn it with --scale (-1"
            " for a column in N, otherwise minus the force in N of one unit of the column) or, if"
            " the recording begins in its pulse, say with --baseline what the column has without a"
            " force"
        )
    if up == 0:
        raise HertzchainError("all forces are equal: there is no pulse in this column")


def _refuse_two(time: FloatArray, before: FloatArray, height: float, crest: int) -> None:
    """Refuse a recording in which averages before the pulse have a pulse of their own."""
    if not before.size:
        return
    at, scatter = int(np.argmax(before)), float(np.quantile(np.abs(before), 0.25))
    # 20 quartiles are 6.4 standard deviations of Gaussian noise, and more than a drift has
    if before[at] > max(0.05 * height, 20 * scatter):
        raise HertzchainError(
            f"a pulse of {before[at]:.3g} N, at {time[at]:.6g} s, comes before the largest, of"
            f" {height:.3g} N at {time[crest]:.6g} s: delete the samples of one of them, or give"
            " --start and --end to keep both"
        )


def _foot(averages: FloatArray, level: float, crest: int) -> int:
    """Return the number of samples that are certainly before the pulse.

    They end before half height by twice the time from a quarter to three quarters of the height: a
    cosine pulse needs 1.5 times, a straight rise once.
    """
    height = averages[crest] - level
    quarter, half, most = (
        int(np.flatnonzero(averages[:crest] < level + part * height).max(initial=0))
        for part in (0.25, 0.5, 0.75)
    )
    return max(0, half - 2 * (most - quarter) - 1)


def _place(time: FloatArray, option: str, wanted: float) -> int:
    """Return the first sample at or after the time of an option."""
    inside = is_finite(wanted) and time[0] <= wanted <= time[-1]
    allowed = f"must be a time of the file, {time[0]:.6g} to {time[-1]:.6g} s"
    require(inside, option, wanted, allowed)
    return int(np.searchsorted(time, wanted))


def no_return(
    force: FloatArray, height: float, step: float, noise: Noise, is_level: bool
) -> str | None:
    """Return a sentence where a recording does not end at its baseline, which is 0 [N], else None.

    The pulse ends where a straight line through the last samples does: it may end with its
    recording. ``is_level`` is whether the baseline was given or measured.
    """
    tail = max(LEAST_NOISE_SAMPLES, force.size // 50)
    if force.size < 2 * tail:
        return None
    off = float(np.polyfit(np.arange(1 - tail, 1), force[-tail:], 1)[1])
    # The end of such a line has twice the deviation of a mean.
    if abs(off) <= max(_SURE_DEVIATIONS * 2 * noise.of_mean(tail, step), _END_FORCE_RATIO * height):
        return None
    baseline = "its baseline" if is_level else "0, as no baseline is taken off"
    return f"the recording ends {off:+.2g} N from {baseline}: {_WHAT_TO_SAY}"


_WHAT_TO_SAY = (
    "say with --baseline what the column has without a force or, if the recording drifts or stops"
    " before the pulse does, with --end where the pulse ends"
)


def left_out(
    time: FloatArray, left: float, impulse: float, noise: Noise, of_baseline: float
) -> str | None:
    """Return a sentence where the force after a pulse has part of the impulse, else None.

    ``left`` is its integral over the times after the pulse, ``impulse`` that of the pulse [N s],
    and ``of_baseline`` the standard deviation of the baseline [N].
    """
    seconds = float(time[-1] - time[0])
    of_noise = noise.of_mean(time.size, seconds / max(time.size - 1, 1)) if seconds else 0.0
    deviation = math.hypot(of_noise, of_baseline)
    if abs(left) <= max(_END_FORCE_RATIO * impulse, _SURE_DEVIATIONS * deviation * seconds):
        return None
    return (
        f"{abs(left) / impulse:.1%} of the impulse is left out, as after the pulse the force is"
        f" {left / seconds:+.2g} N from the baseline on average: {_WHAT_TO_SAY}"
    )


def cut_off(force: FloatArray, resolution: float) -> str | None:
    """Return a sentence if the top of a pulse [N] may be cut off, else None.

    Then several samples have the largest force, many more than lie within a digit below it: a crest
    that is a parabola has at most 2.4 times as many, one of fourth order 5.3 times. If values
    repeat too rarely to show the digit, it is taken as the step from the largest force to the next.
    """
    top = float(force.max())
    lower = force[force < top]
    if resolution == 0 and 0 < np.unique(lower).size < lower.size:
        resolution = top - float(lower.max())
    equal = int(np.count_nonzero(force == top))
    below = int(np.count_nonzero(lower > top - 1.5 * resolution))
    # A crest has fewer equal samples, and more within a digit below them
    if equal < 5 or equal <= 8 * below:
        return None
    return (
        f"{equal} samples have the largest force, {top:.4g} N: if the range of the instrument cut"
        " the top off, F0 and impulse are too small"
    )


MOST_ROWS = 80
"""Default of the most rows (chosen): codes begin a new step at each row, LAMMPS a new run."""

LEAST_ROWS = 3
_LEAST_BOW_RATIO = 1 / 3000
"""Bow of a line over F0 at which no further rows are added. Measured: peaks of 40 granules of
LM_ratio 0.1 to 10 under the three pulses changed by up to 2.9 bows, mostly by less than 1."""


class Value(NamedTuple):
    """A number with its standard deviation from noise and baseline."""

    value: float
    deviation: float


@dataclass(frozen=True, eq=False)
class MeasuredPulse:
    """A recording of a pulse, and the pulse table with few rows that replaces it."""

    recording: Recording
    signal: Signal
    table: PulseTable  # its impulse is that of the samples
    bend: float  # largest distance of the force from the lines of the table, apart from noise [N]

    @property
    def peak_force(self) -> Value:
        """F0 [N]: the highest row.

        Many lines of least squares of one length have the variance sqrt(3) density^2 / length at
        their corners, which follows from the inverse of their matrix, length / 6 (1, 4, 1). Lines
        about a parabola meet 2 / 3 of its bow above it; on average half of that, as bows are half
        of the largest allowed.
        """
        time, force = np.array(self.table.time), np.array(self.table.force)
        top = int(np.argmax(force))
        length = float(time[min(top + 1, time.size - 1)] - time[max(top - 1, 0)]) / 2
        of_corner = self.signal.noise.density * math.sqrt(math.sqrt(3) / length)
        bow = largest_bow(length, self.bend, self.signal.noise)
        return Value(float(force[top]), math.hypot(of_corner, bow / 3, self.signal.baseline_error))

    @property
    def impulse(self) -> Value:
        """The integral of the force [N s]."""
        duration = self.table.time[-1]
        noise = self.signal.noise.density * math.sqrt(duration)
        off = math.hypot(noise, self.signal.baseline_error * duration)
        return Value(float(np.trapezoid(self.table.force, self.table.time)), off)

    @property
    def rise_time(self) -> float:
        """The time in which the force first grows from 10 % to 90 % of F0 [s]."""
        force = np.maximum.accumulate(self.table.force)
        begin, end = np.interp(np.array([0.1, 0.9]) * force[-1], force, self.table.time)
        return float(end - begin)

    def to_text(self) -> str:
        """Return the table as CSV, with the header of pulse tables."""
        rows = zip(self.table.time, self.table.force, strict=True)
        return "time_s,force_N\n" + "".join(f"{time!r},{force!r}\n" for time, force in rows)

    def to_dict(self) -> dict[str, Any]:
        """Return everything except the samples, for JSON."""
        signal, names = self.signal, ("value", "standard_deviation")
        return {
            "read": dict(self.recording.facts),
            "changed": dict(signal.remarks),
            "warnings": list(signal.warnings),
            "baseline_N": signal.baseline,
            "baseline_samples": signal.baseline_samples,
            "noise_N": signal.noise.deviation,
            "start_s": signal.start,
            "duration_s": self.table.time[-1],
            "impulse_before_N_s": signal.left_out[0],
            "impulse_after_N_s": signal.left_out[1],
            "samples": int(self.recording.time.size),
            "samples_of_pulse": int(signal.time.size),
            "rows": len(self.table.time),
            "bend_N": self.bend,
            "peak_force_N": dict(zip(names, self.peak_force, strict=True)),
            "impulse_N_s": dict(zip(names, self.impulse, strict=True)),
            "rise_time_s": self.rise_time or None,  # 0 where noise left no rise
        }


def measured_pulse(recording: Recording, signal: Signal, rows: int = MOST_ROWS) -> MeasuredPulse:
    """Reduce a measured pulse to at most so many rows; SceneError for fewer than 3."""
    require(rows >= LEAST_ROWS, "--rows", rows, f"must be at least {LEAST_ROWS}")
    bend = _LEAST_BOW_RATIO * float(signal.force.max())
    places = corners_of(signal.time, signal.force, bend, signal.noise)
    while places.size > rows:
        bend *= 1.3
        places = corners_of(signal.time, signal.force, bend, signal.noise)
    force = heights(signal.time, signal.force, places)
    table = PulseTable(tuple(signal.time[places].tolist()), tuple(force.tolist()))
    return MeasuredPulse(recording, signal, table, bend)
