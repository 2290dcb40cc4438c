"""Few corners instead of many samples: straight lines that keep the impulse.

Samples are cut where they bend most until each piece follows a straight line: until the integral of
their difference stays within what is allowed. The lines then are those of least squares among all
that meet at the corners. Their difference from the force has no impulse, and no first moment about
any corner, so that a chain feels it the less, the shorter the lines are.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.pulses.noise import Noise

_Places = NDArray[np.intp]

BOW = 0.1
"""Impulse of half a bow over height and length, rounded up: a parabola about its straight line of
least squares, which is the Legendre polynomial of degree 2, reaches 1 / sqrt(27) / 2 = 0.096."""

BRIDGE = 0.8
"""What the integral of noise about its straight line exceeds in one of 10 lines, over density and
root of the length. Measured: 0.72 to 0.81 for white noise of 20 to 1000 samples."""

_TIP = 3.0  # how far a tip, which has little impulse, may leave a line, over what a bow may; chosen
_OUTLIER = 6.0  # standard deviations of noise that no sample in millions is beyond
_SWEEPS = 2  # in which corners are moved to where they fit best; chosen: a third changes few


@dataclass(frozen=True, eq=False)
class Corners:
    """A pulse as straight lines.

    Parameters
    ----------
    time
        Of its corners, the first 0 [s], shape (corners,).
    force
        At the corners, at least 0 [N], shape (corners,).
    places
        Which samples they are, from 0.
    """

    time: FloatArray
    force: FloatArray
    places: _Places


def reduce(time: FloatArray, force: FloatArray, bend: float, noise: Noise) -> Corners:
    """The corners of straight lines that follow samples of a force.

    Parameters
    ----------
    time, force
        Of the samples, shape (samples,) [s], [N].
    bend
        How far the force may bow away from a line [N].
    noise
        Of the force: what it explains is not followed.
    """
    weight = weights(time)
    sums = _sums(time, force, weight)

    def is_straight(first: int, last: int) -> bool:
        here = slice(first, last + 1)
        return _is_straight(time[here], force[here], bend, noise)

    places, open_lines = {0, time.size - 1}, [(0, time.size - 1)]
    while open_lines:
        first, last = open_lines.pop()
        if not is_straight(first, last):
            middle = _best_cut(sums, first, last)
            places.add(middle)
            open_lines += [(first, middle), (middle, last)]
    kept = sorted(places)
    for _ in range(_SWEEPS):
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
    corners: _Places = np.array(kept)
    return Corners(time[corners], _not_negative(time, force, weight, corners), corners)


def weights(time: FloatArray) -> FloatArray:
    """Half the time between the neighbours of each sample: sums are integrals of straight lines."""
    half = np.diff(time) / 2
    found: FloatArray = np.append(half, 0.0) + np.append(0.0, half)
    return found


def impulse_of(time: FloatArray, force: FloatArray) -> float:
    """The integral of a force that is straight between samples [N s]."""
    return float(np.dot(weights(time), force))


def fit(
    time: FloatArray,
    force: FloatArray,
    weight: FloatArray,
    places: _Places,
    free: NDArray[np.bool_] | None = None,
) -> FloatArray:
    """Forces at the corners of the straight lines of least squares, shape (..., corners).

    Several forces, shape (..., samples), may be fitted at once. Corners that are not ``free`` are
    0; all are by default.
    """
    from scipy.linalg import solveh_banded

    count = places.size
    line = np.clip(np.searchsorted(places, np.arange(time.size), "right") - 1, 0, count - 2)
    part = (time - time[places[line]]) / (time[places[line + 1]] - time[places[line]])
    left, right = weight * (1 - part), weight * part
    band = np.zeros((2, count))
    band[0, 1:] = np.bincount(line, left * part, count)[:-1]
    band[1] = np.bincount(line, left * (1 - part), count)
    band[1, 1:] += np.bincount(line, right * part, count)[:-1]
    starts = places[:-1]
    sides = np.zeros((*force.shape[:-1], count))
    sides[..., :-1] = np.add.reduceat(left * force, starts, axis=-1)
    sides[..., 1:] += np.add.reduceat(right * force, starts, axis=-1)
    if free is not None:
        band[0, 1:] *= free[1:] & free[:-1]
        band[1, ~free], sides[..., ~free] = 1.0, 0.0
    solved: FloatArray = solveh_banded(band, np.moveaxis(sides, -1, 0))
    return np.moveaxis(solved, 0, -1)


def _is_straight(time: FloatArray, force: FloatArray, bend: float, noise: Noise) -> bool:
    """Whether samples follow their straight line of least squares as closely as they have to."""
    if time.size < 3:
        return True
    length = float(time[-1] - time[0])
    weight, part = weights(time), (time - time[0]) / length
    centred = part - np.dot(weight, part) / length
    slope = np.dot(weight, centred * force) / np.dot(weight, centred**2)
    off = force - np.dot(weight, force) / length - slope * centred
    running = np.cumsum(0.5 * (off[1:] + off[:-1]) * np.diff(time))
    allowed = max(BOW * bend * length, BRIDGE * noise.density * math.sqrt(length))
    farthest = _TIP * bend + _OUTLIER * noise.deviation
    return bool(np.abs(running).max() <= allowed and np.abs(off).max() <= farthest)


def _sums(time: FloatArray, force: FloatArray, weight: FloatArray) -> FloatArray:
    """Sums over all samples before each, of what squared differences from lines need: (6, n + 1).

    Times are parts of the whole and forces those of the largest, so that sums of squares keep
    their digits.
    """
    part, height = time / time[-1], force / max(float(force.max()), np.finfo(float).tiny)
    terms = np.stack([np.ones_like(part), part, part**2, height, part * height, height**2])
    return np.concatenate([np.zeros((6, 1)), np.cumsum(weight * terms, axis=1)], axis=1)


def _best_cut(sums: FloatArray, first: int, last: int) -> int:
    """Where a line is cut into two that are nearest to the samples, each by itself."""
    middle = np.arange(first + 1, last)
    left = sums[:, middle + 1] - sums[:, [first]]
    right = sums[:, [last + 1]] - sums[:, middle]
    return int(middle[np.argmin(_squares(left) + _squares(right))])


def _squares(sums: FloatArray) -> FloatArray:
    """Least sums of squared differences from straight lines, (lines,), from sums, (6, lines)."""
    one, x, xx, y, xy, yy = sums
    slope, spread = xy - x * y / one, xx - x * x / one
    found: FloatArray = yy - y * y / one - slope**2 / spread
    return found


def _not_negative(
    time: FloatArray, force: FloatArray, weight: FloatArray, places: _Places
) -> FloatArray:
    """Forces at the corners: those of least squares, at least 0, with the impulse of the samples.

    Where the best would be below 0 it is 0, and the others are the best with that.
    """
    free = np.ones(places.size, np.bool_)
    values = fit(time, force, weight, places)
    while np.any(values < 0):
        free &= values > 0
        values = fit(time, force, weight, places, free)
    return values * (impulse_of(time, force) / impulse_of(time[places], values))
