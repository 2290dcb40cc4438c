"""Reduces many samples to few corners of straight lines that keep the impulse.

Samples are cut where they bend most until each piece follows a straight line, that is until the
integral of their difference is within the limit. The result is the polyline of least squares with
these corners. Its difference from the force has no impulse, and no first moment about any corner,
so that its effect on a chain falls with the length of the lines.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.pulses.noise import Noise

Places = NDArray[np.intp]

_BOW = 0.1
"""Impulse of half a bow over height and length, rounded up: a parabola about its straight line of
least squares, which is the Legendre polynomial of degree 2, reaches 1 / sqrt(27) / 2 = 0.096."""

_BRIDGE = 0.8
"""Level that the integral of noise about its straight line exceeds in one of 10 lines, over density
and root of the length. Measured: 0.72 to 0.81 for white noise of 20 to 1000 samples.
"""

_TIP = 3.0  # limit of a tip, which has little impulse, over that of a bow; chosen
_OUTLIER = 6.0  # standard deviations that no sample in millions exceeds by noise
_ROUNDS = 2  # rounds in which corners are moved to their best places; chosen: a third changes few


def corners_of(time: FloatArray, force: FloatArray, bend: float, noise: Noise) -> Places:
    """Return the indices of samples at corners of straight lines that follow a force.

    Parameters
    ----------
    time, force
        Times [s] and forces [N] of the samples, shape (samples,).
    bend
        Largest distance of the force from a line [N].
    noise
        Noise of the force: bends within it are not followed.
    """
    sums = _sums(time, force)

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
    for _ in range(_ROUNDS):
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


def weights(time: FloatArray) -> FloatArray:
    """Weights of samples for the integral of straight lines: half the time between neighbours."""
    half = np.diff(time) / 2
    found: FloatArray = np.append(half, 0.0) + np.append(0.0, half)
    return found


def impulse_of(time: FloatArray, force: FloatArray) -> float:
    """Return the integral of a force that is linear between samples [N s]."""
    return float(np.dot(weights(time), force))


def heights(time: FloatArray, force: FloatArray, places: Places) -> FloatArray:
    """Return least squares at the corners, at least 0, with the impulse of the samples [N]."""
    from scipy.interpolate import make_lsq_spline

    clock = time[places] / time[-1]
    knots = np.concatenate([clock[:1], clock, clock[-1:]])
    lines = make_lsq_spline(time / time[-1], force, knots, 1, np.sqrt(weights(time) / time[-1]))
    found = np.maximum(lines.c, 0.0)
    return np.asarray(found * (impulse_of(time, force) / impulse_of(time[places], found)))


def largest_bow(length: float, bend: float, noise: Noise) -> float:
    """Return the largest distance of a force from a line [N] of a length in time [s]."""
    return max(bend, _BRIDGE / _BOW * noise.density / math.sqrt(length))


def _is_straight(time: FloatArray, force: FloatArray, bend: float, noise: Noise) -> bool:
    """Return whether samples follow their straight line of least squares closely enough."""
    if time.size < 3:
        return True
    length = float(time[-1] - time[0])
    off = force - np.polynomial.Polynomial.fit(time, force, 1, w=np.sqrt(weights(time)))(time)
    running = np.cumsum(0.5 * (off[1:] + off[:-1]) * np.diff(time))
    allowed = _BOW * length * largest_bow(length, bend, noise)
    farthest = _TIP * bend + _OUTLIER * noise.deviation
    return bool(np.abs(running).max() <= allowed and np.abs(off).max() <= farthest)


def _sums(time: FloatArray, force: FloatArray) -> FloatArray:
    """Return cumulative sums for squared differences from lines, shape (6, n + 1).

    Times are fractions of the duration and forces of the largest force, so that sums of squares
    keep their digits.
    """
    part, height = time / time[-1], force / max(float(force.max()), np.finfo(float).tiny)
    terms = np.stack([np.ones_like(part), part, part**2, height, part * height, height**2])
    return np.concatenate([np.zeros((6, 1)), np.cumsum(weights(time) * terms, axis=1)], axis=1)


def _best_cut(sums: FloatArray, first: int, last: int) -> int:
    """Return the place where a cut gives the two lines nearest to the samples."""
    middle = np.arange(first + 1, last)
    left = sums[:, middle + 1] - sums[:, [first]]
    right = sums[:, [last + 1]] - sums[:, middle]
    return int(middle[np.argmin(_squares(left) + _squares(right))])


def _squares(sums: FloatArray) -> FloatArray:
    """Return least sums of squared differences from lines, (lines,), from sums, (6, lines)."""
    one, x, xx, y, xy, yy = sums
    slope, spread = xy - x * y / one, xx - x * x / one
    found: FloatArray = yy - y * y / one - slope**2 / spread
    return found
