"""Finds the pulse in a recording: without baseline, from start to end, never negative."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.errors import HertzchainError, is_finite, require
from hertzchain.pulses.corners import impulse_of
from hertzchain.pulses.noise import LEAST, Noise, noise_before, noise_within, resolution_of
from hertzchain.pulses.recording import LEAST_SAMPLES, Recording

_LEAVES_NOISE = 5.0
"""Threshold in standard deviations of averages (chosen): Gaussian noise exceeds it in 3 of 10
million.
"""

_LEAST_BASELINE = 10  # widths of a pulse at half its height over the time before it; chosen

_WINDOWS = 20  # averages over a width of the pulse at half its height; chosen
_OTHER_PULSE = 0.05  # least height of another pulse that counts, over the largest; chosen
_OVER_SCATTER = 20.0
"""Least height of another pulse over the lowest quartile of the absolute averages before the
largest; chosen: 6.4 standard deviations of Gaussian noise, and more than a drift has."""
_MOST_SAMPLES = 20_000  # most samples of a pulse; more are averaged, 2 or more at a time; chosen
_SURE = 5.0  # standard deviations, as for the start of a pulse; chosen
_RETURN = 0.01  # of F0: the slope of a pulse that ends with its recording is off by less, measured
_TAIL = 50  # samples of a recording over those in its tail; chosen
_FLAT = 5  # samples of the largest force from which on a top may be cut off; chosen
_PILED = 8  # times as many as are within a digit below it; chosen, above what a crest has


@dataclass(frozen=True)
class Given:
    """Options of a pulse given by the user.

    Parameters
    ----------
    baseline
        Value of the file without a force, in the unit of its column; by default the mean before the
        pulse.
    start, end
        Times in the recording [s]; by default where averages of the force leave the noise, and
        where they are last above it.
    """

    baseline: float | None = None
    start: float | None = None
    end: float | None = None


@dataclass(frozen=True, eq=False)
class Signal:
    """The pulse in a recording.

    Parameters
    ----------
    time
        Times of its samples from its start, which is 0 [s], shape (samples,).
    force
        Without the baseline, at least 0 [N], shape (samples,).
    start
        Its start in the recording [s].
    baseline
        Baseline that was subtracted [N].
    baseline_samples
        Number of samples of which it is the mean; 0 if it was given or nothing was subtracted.
    noise
        Noise of the force.
    given
        Options given by the user.
    left_out
        Impulse of the recording before the start and after the end [N s].
    remarks
        Changes, and remarks to check, as labels and texts.
    warnings
        Sentences on what makes the numbers of the pulse wrong; usually empty.
    """

    time: FloatArray
    force: FloatArray
    start: float
    baseline: float
    baseline_samples: int
    noise: Noise
    given: Given
    left_out: tuple[float, float]
    remarks: tuple[tuple[str, str], ...]
    warnings: tuple[str, ...] = ()


def pulse_of(recording: Recording, given: Given = Given()) -> Signal:
    """Find the pulse in a recording.

    Raises
    ------
    HertzchainError
        If there is no pulse, or one that pulls, or for an impossible option.
    """
    time, force = recording.time, recording.force
    step = float(time[-1] - time[0]) / (time.size - 1)
    remarks: list[tuple[str, str]] = []
    resolution = resolution_of(force)
    given_first = None if given.start is None else _place(time, "--start", given.start)
    given_last = None if given.end is None else _place(time, "--end", given.end)
    inside = slice(given_first or 0, time.size if given_last is None else given_last + 1)
    possible = given.baseline is None or is_finite(given.baseline)
    require(possible, "--baseline", given.baseline, "must be a finite number")
    known = None if given.baseline is None else given.baseline * recording.newtons
    level = _rough_level(force, known)
    if force[inside].size < LEAST_SAMPLES:
        raise _no_pulse(time, inside.start, inside.stop - 1)
    crest = inside.start + int(np.argmax(force[inside]))
    _refuse_pull(force[inside], level)
    rising, falling = _half_heights(force, level, crest)
    window = max(1, (falling - rising) // _WINDOWS) // 2 * 2 + 1
    averages = averaged(force, window)
    before = _foot(averages, level, crest)
    if given_first is not None:
        before = min(before, given_first)
    least = max(LEAST, (falling - rising) // _LEAST_BASELINE)
    _refuse_two(time, averages[:before] - level, float(force[crest]) - level, crest)
    level, noise = _noise(force, before, least, known, step, resolution)
    limit = _threshold(noise, window, step, float(force[crest]) - level)
    quiet = np.flatnonzero(averages[: rising + 1] <= level + limit)
    above = np.flatnonzero(averages > level + limit)
    if not above.size:
        raise HertzchainError(
            f"no pulse stands out of the noise, {noise.deviation:.2g} N: name another column with"
            " --force, or say with --start and --end where the pulse is"
        )
    first = (int(quiet[-1]) if quiet.size else 0) if given_first is None else given_first
    last = min(int(above[-1]) + 1, time.size - 1) if given_last is None else given_last
    if last - first + 1 < LEAST_SAMPLES:
        raise _no_pulse(time, first, last)
    samples = before if known is None and before >= least else 0
    height = float(force[crest]) - level
    found = (
        no_return(force, level, height, step, noise, known, samples)
        if given_last is None
        else None,
        cut_off(force[inside], resolution),
    )
    samples_inside = force[first : last + 1] - level
    clean = without_negative(samples_inside, window, limit)
    clock = time[first : last + 1] - time[first]
    left = (
        impulse_of(time[: first + 1], force[: first + 1] - level),
        impulse_of(time[last:], force[last:] - level),
    )
    remarks += _remarks(recording, samples_inside, known, level, noise, samples)
    many = -(-clean.size // _MOST_SAMPLES)
    if many > 1:
        clock, clean = binned(clock, many), binned(clean, many)
        clock -= clock[0]
        remarks.append(("averaged", f"{many} samples at a time, to {clean.size:,}"))
    return Signal(
        clock, clean, float(time[first]), level, samples, noise, given, left, tuple(remarks),
        tuple(warning for warning in found if warning is not None),
    )  # fmt: skip


def _no_pulse(time: FloatArray, first: int, last: int) -> HertzchainError:
    """Return the error for too few samples."""
    there = max(last - first + 1, 0)
    return HertzchainError(
        f"there are {there} samples from {time[first]:.6g} s to {time[max(last, 0)]:.6g} s, a pulse"
        f" needs {LEAST_SAMPLES}: delete them if they are a spike, or give --start and --end in"
        " times of the file"
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


def _rough_level(force: FloatArray, given: float | None) -> float:
    """Return the approximate baseline [N]: the median of the first samples."""
    crest = int(np.argmax(np.abs(force - np.median(force[:LEAST_SAMPLES]))))
    return float(np.median(force[: max(LEAST_SAMPLES, crest // 8)])) if given is None else given


def _refuse_pull(force: FloatArray, level: float) -> None:
    up, down = float(force.max()) - level, level - float(force.min())
    if down > up:
        raise HertzchainError(
            f"the largest signal, {-down:.3g} N, pulls; a pulse pushes: turn it with --scale (-1,"
            " or N for each unit with a minus) or, if the recording begins in its pulse, say with"
            " --baseline what the column has without a force"
        )
    if up == 0:
        raise HertzchainError("all forces are equal: there is no pulse in this column")


def _refuse_two(time: FloatArray, before: FloatArray, height: float, crest: int) -> None:
    """Refuse a recording in which averages before the pulse have a pulse of their own."""
    if not before.size:
        return
    at, scatter = int(np.argmax(before)), float(np.quantile(np.abs(before), 0.25))
    if before[at] > max(_OTHER_PULSE * height, _OVER_SCATTER * scatter):
        raise HertzchainError(
            f"a pulse of {before[at]:.3g} N, at {time[at]:.6g} s, comes before the largest, of"
            f" {height:.3g} N at {time[crest]:.6g} s: delete the samples of one of them, or give"
            " --start and --end to keep both"
        )


def _half_heights(force: FloatArray, level: float, crest: int) -> tuple[int, int]:
    """Return the indices at which the force crosses half its height, before and after the crest."""
    below = force < level + 0.5 * (force[crest] - level)
    before, after = np.flatnonzero(below[:crest]), np.flatnonzero(below[crest:])
    rising = int(before[-1]) if before.size else 0
    return rising, crest + int(after[0]) if after.size else force.size - 1


def _foot(averages: FloatArray, level: float, crest: int) -> int:
    """Return the number of samples that are certainly before the pulse.

    They end before half height by twice the time from a quarter to three quarters of the height: a
    cosine pulse needs 1.5 times, a straight rise once.
    """
    height = averages[crest] - level
    quarter, half, most = (
        int(places[-1])
        if (places := np.flatnonzero(averages[:crest] < level + part * height)).size
        else 0
        for part in (0.25, 0.5, 0.75)
    )
    return max(0, half - 2 * (most - quarter) - 1)


def _noise(
    force: FloatArray,
    before: int,
    least: int,
    known: float | None,
    step: float,
    resolution: float,
) -> tuple[float, Noise]:
    """Return the baseline [N] and the noise, from the samples before the pulse if they suffice."""
    if before < least:
        return known or 0.0, noise_within(force, step, resolution)
    quiet = force[:before]
    return float(quiet.mean()) if known is None else known, noise_before(quiet, step, resolution)


def _threshold(noise: Noise, window: int, step: float, height: float) -> float:
    """Return the threshold of averages over a window [N]; round-off without noise.

    The density, from few blocks, is used only where it shows correlated noise.
    """
    white, slow = noise.deviation / np.sqrt(window), noise.density / np.sqrt(window * step)
    of_averages = min(noise.deviation, max(white, slow))
    return max(_LEAVES_NOISE * float(of_averages), 1e-9 * height)


def _place(time: FloatArray, option: str, wanted: float) -> int:
    """Return the first sample at or after the time of an option."""
    inside = is_finite(wanted) and time[0] <= wanted <= time[-1]
    allowed = f"must be a time of the file, {time[0]:.6g} to {time[-1]:.6g} s"
    require(inside, option, wanted, allowed)
    return int(np.searchsorted(time, wanted))


def binned(values: FloatArray, many: int) -> FloatArray:
    """Return means of groups of values; the rest at the end is a group of its own."""
    starts: NDArray[np.intp] = np.arange(0, values.size, many)
    found: FloatArray = np.add.reduceat(values, starts) / np.diff(np.append(starts, values.size))
    return found


def _remarks(
    recording: Recording,
    inside: FloatArray,
    given: float | None,
    level: float,
    noise: Noise,
    samples: int,
) -> list[tuple[str, str]]:
    if given is not None:
        source = "given"
    elif samples:
        source = f"mean of {samples:,} samples before the pulse"
    else:
        source = "none taken off: too few samples before the pulse"
    of_column = level / recording.newtons
    shown = f"{of_column:.4g} in the file, " if recording.newtons != 1.0 else ""
    how = "before the pulse" if noise.samples.size else "as samples scatter about their neighbours"
    remarks = [
        ("baseline", f"{shown}{level:.4g} N ({source})"),
        ("noise", f"{noise.deviation:.2g} N, standard deviation {how}"),
    ]
    if negative := int(np.count_nonzero(inside < 0)):
        remarks.append(
            ("samples below 0", f"{negative:,}, the lowest {inside.min():.3g} N: set to 0")
        )
    return remarks


def no_return(
    force: FloatArray,
    level: float,
    height: float,
    step: float,
    noise: Noise,
    given: float | None,
    samples: int,
) -> str | None:
    """A sentence where a recording ends elsewhere than at its baseline [N], else None.

    The end is that of a straight line through the last samples: a pulse may end with its recording.
    The baseline is given, or the mean of samples before the pulse, or 0 where they are none.
    """
    tail = max(LEAST, force.size // _TAIL)
    if force.size < 2 * tail:
        return None
    at = np.arange(tail) - (tail - 1)
    slope, end = np.polyfit(at, force[-tail:], 1)
    del slope
    deviation = 2 * max(noise.deviation / np.sqrt(tail), noise.density / np.sqrt(tail * step))
    off = float(end) - level
    if abs(off) <= max(_SURE * deviation, _RETURN * height):
        return None
    if given is None and not samples:
        return (
            f"no baseline is taken off, as the recording begins with its pulse, and it ends"
            f" {off:+.2g} N from 0: say with --baseline what the column has without a force or, if"
            " the recording stops before the pulse does, with --end where the pulse ends"
        )
    begins = "begins at its baseline and ends" if given is None else "has a baseline given and ends"
    return (
        f"the recording {begins} {off:+.2g} N from it: either the baseline"
        " drifts, or the recording stops before the pulse does; say with --end where the pulse ends"
    )


def cut_off(force: FloatArray, resolution: float) -> str | None:
    """Return a sentence if the top of a pulse [N] may be cut off, else None.

    Several samples have the largest force, many more than are within a digit below it: a crest
    that is a parabola has at most 2.4 times as many, one of fourth order 5.3 times. Where values
    repeat, but too few for a known digit, it is the step from the largest force to the next.
    """
    top = float(force.max())
    lower = force[force < top]
    if resolution == 0 and 0 < np.unique(lower).size < lower.size:
        resolution = top - float(lower.max())
    equal = int(np.count_nonzero(force == top))
    below = int(np.count_nonzero((force < top) & (force > top - 1.5 * resolution)))
    if equal < _FLAT or equal <= _PILED * below:
        return None
    return (
        f"{equal} samples have the largest force, {top:.4g} N: if the range of the instrument cut"
        " the top off, F0 and impulse are too small"
    )
