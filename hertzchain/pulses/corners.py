"""Reduces many samples to few corners of straight lines that keep the impulse.

Samples are cut where they bend most until each piece follows a straight line, that is until the
integral of their difference is within the limit. The result is the polyline of least squares with
these corners. Its difference from the force has no impulse, and no first moment about any corner,
so that its effect on a chain falls with the length of the lines.

The largest of these corners is no estimate of F0: of noisy corners it is the highest, and lines of
least squares meet above a crest that bows. F0 is that of a fit of the crest, which lines are given.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.pulses.noise import LEAST, Noise

_Places = NDArray[np.intp]

_BOW = 0.1
"""Impulse of half a bow over height and length, rounded up: a parabola about its straight line of
least squares, which is the Legendre polynomial of degree 2, reaches 1 / sqrt(27) / 2 = 0.096."""

_BRIDGE = 0.8
"""Level that the integral of noise about its straight line exceeds in one of 10 lines, over density
and root of the length. Measured: 0.72 to 0.81 for white noise of 20 to 1000 samples.
"""

_TIP = 3.0  # limit of a tip, which has little impulse, over that of a bow; chosen
_OUTLIER = 6.0  # standard deviations of noise that no sample in millions exceeds
_SWEEPS = 2  # rounds in which corners are moved to their best places; chosen: a third changes few

_DEGREE = 4  # of the polynomial: crests that lean and flat ones
_PARTS = (0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.98)  # of the height, above which it is fitted; chosen
_BRIDGE_OF_CREST = 0.5
"""As ``_BRIDGE``, about a polynomial of degree 4: 0.40 to 0.56 was measured for 20 to 1000
samples."""
_NEAR = 0.25  # part of a line within which a corner is at the crest; chosen


@dataclass(frozen=True, eq=False)
class Corners:
    """A pulse as straight lines.

    Parameters
    ----------
    time
        Times of its corners, the first 0 [s], shape (corners,).
    force
        Forces at the corners, at least 0 [N], shape (corners,).
    places
        Indices of the corners among the samples.
    """

    time: FloatArray
    force: FloatArray
    places: _Places


def reduce(time: FloatArray, force: FloatArray, bend: float, noise: Noise) -> Corners:
    """Return the corners of straight lines that follow samples of a force.

    Parameters
    ----------
    time, force
        Times [s] and forces [N] of the samples, shape (samples,).
    bend
        Largest distance of the force from a line [N].
    noise
        Noise of the force: bends within it are not followed.
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
    return Corners(time[corners], _heights(time, force, weight, corners), corners)


def weights(time: FloatArray) -> FloatArray:
    """Weights of samples for the integral of straight lines: half the time between neighbours."""
    half = np.diff(time) / 2
    found: FloatArray = np.append(half, 0.0) + np.append(0.0, half)
    return found


def impulse_of(time: FloatArray, force: FloatArray) -> float:
    """Return the integral of a force that is linear between samples [N s]."""
    return float(np.dot(weights(time), force))


def _is_straight(time: FloatArray, force: FloatArray, bend: float, noise: Noise) -> bool:
    """Return whether samples follow their straight line of least squares closely enough."""
    if time.size < 3:
        return True
    length = float(time[-1] - time[0])
    weight, part = weights(time), (time - time[0]) / length
    centred = part - np.dot(weight, part) / length
    slope = np.dot(weight, centred * force) / np.dot(weight, centred**2)
    off = force - np.dot(weight, force) / length - slope * centred
    running = np.cumsum(0.5 * (off[1:] + off[:-1]) * np.diff(time))
    allowed = max(_BOW * bend * length, _BRIDGE * noise.density * math.sqrt(length))
    farthest = _TIP * bend + _OUTLIER * noise.deviation
    return bool(np.abs(running).max() <= allowed and np.abs(off).max() <= farthest)


def _sums(time: FloatArray, force: FloatArray, weight: FloatArray) -> FloatArray:
    """Return cumulative sums for squared differences from lines, shape (6, n + 1).

    Times are fractions of the duration and forces of the largest force, so that sums of squares
    keep their digits.
    """
    part, height = time / time[-1], force / max(float(force.max()), np.finfo(float).tiny)
    terms = np.stack([np.ones_like(part), part, part**2, height, part * height, height**2])
    return np.concatenate([np.zeros((6, 1)), np.cumsum(weight * terms, axis=1)], axis=1)


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


def _heights(
    time: FloatArray, force: FloatArray, weight: FloatArray, places: _Places
) -> FloatArray:
    """Return least squares at the corners, at least 0, with the impulse of the samples [N]."""
    from scipy.interpolate import make_lsq_spline

    clock = time[places] / time[-1]
    knots = np.concatenate([clock[:1], clock, clock[-1:]])
    lines = make_lsq_spline(time / time[-1], force, knots, 1, np.sqrt(weight / time[-1]))
    heights = np.maximum(lines.c, 0.0)
    return np.asarray(heights * (impulse_of(time, force) / impulse_of(time[places], heights)))


@dataclass(frozen=True)
class Crest:
    """The largest force of a pulse.

    Parameters
    ----------
    time, force
        Where it is [s], and its size [N].
    polynomial
        Force [N] over time [s] near it; its domain is the part of the pulse that it follows [s].
    """

    time: float
    force: float
    polynomial: np.polynomial.Polynomial

    def smooth(self, time: FloatArray, force: FloatArray) -> FloatArray:
        """Return forces at times, those of the crest from its polynomial [N]."""
        first, last = self.polynomial.domain
        inside = (time >= first) & (time <= last)
        found: FloatArray = np.where(inside, self.polynomial(time), force)
        return found


def crest_of(
    time: FloatArray, force: FloatArray, corners: Corners, bend: float, noise: Noise
) -> Crest | None:
    """Return the crest of a pulse, from its widest part that a polynomial follows.

    None where there is no such part, or where two lines that meet are nearer to the samples, as at
    the tip of a triangle.

    Parameters
    ----------
    time, force
        Times [s] and forces [N] of the samples, shape (samples,).
    corners
        Their straight lines.
    bend
        Largest distance of the force from a line [N].
    noise
        Noise of the force.
    """
    top = int(np.argmax(corners.force))
    middle = int(np.searchsorted(time, corners.time[top]))
    line = np.interp(time, corners.time, corners.force)
    for part in _PARTS:
        below = np.flatnonzero(line < part * line[middle])
        first = int(below[below < middle].max(initial=-1)) + 1
        last = int(below[below > middle].min(initial=time.size))
        if last - first < LEAST:
            return None
        clock, samples = time[first:last], force[first:last]
        length, weight = float(clock[-1] - clock[0]), weights(clock)
        fitted = np.polynomial.Polynomial.fit(clock, samples, _DEGREE, w=np.sqrt(weight / length))
        off = samples - fitted(clock)
        running = np.cumsum(0.5 * (off[1:] + off[:-1]) * np.diff(clock))
        # The density is known from few blocks: it is not below that of white noise.
        density = max(noise.density, noise.deviation * math.sqrt(length / (clock.size - 1)))
        allowed = max(_BOW * bend * length, _BRIDGE_OF_CREST * density * math.sqrt(length))
        if np.abs(running).max() > allowed:
            continue
        of_lines = _squares_of_lines(clock, samples, weight, time[middle])
        flat = fitted.deriv().roots()
        inside = flat[(flat.imag == 0) & (flat.real > clock[0]) & (flat.real < clock[-1])].real
        if of_lines < np.dot(weight, off**2) or not inside.size:
            return None
        at = float(inside[np.argmax(fitted(inside))])
        return Crest(at, float(fitted(at)), fitted)
    return None


def with_crest(corners: Corners, crest: Crest | None) -> Corners:
    """Return corners with the largest force of a crest, and with the same impulse.

    They are returned as they are without a crest, and where no scale of the other forces gives this
    impulse.
    """
    if crest is None:
        return corners
    clock, force = _through(corners, crest)
    impulse, weight = impulse_of(corners.time, corners.force), weights(clock)
    free = force < crest.force
    while free.any():
        left = impulse - crest.force * float(np.sum(weight[~free]))
        scaled = np.where(free, left / np.dot(weight[free], force[free]) * force, crest.force)
        if left > 0 and scaled.max() <= crest.force:
            return replace(corners, time=clock, force=scaled)
        free &= (left > 0) & (scaled < crest.force)
    return corners


def _through(corners: Corners, crest: Crest) -> tuple[FloatArray, FloatArray]:
    """Return lines cut off at a crest or, where they are all below it, led through it."""
    time, force, peak = corners.time, corners.force.copy(), crest.force
    if force.max() > peak:
        rise = np.flatnonzero((force[1:] > peak) != (force[:-1] > peak))
        part = (peak - force[rise]) / (force[rise + 1] - force[rise])
        crossings = time[rise] + part * (time[rise + 1] - time[rise])
        low = force <= peak
        clock = np.append(time[low], crossings)
        order = np.argsort(clock, kind="stable")
        return clock[order], np.append(force[low], np.full(crossings.size, peak))[order]
    line = int(np.clip(np.searchsorted(time, crest.time) - 1, 0, time.size - 2))
    part = (crest.time - time[line]) / (time[line + 1] - time[line])
    if _NEAR < part < 1 - _NEAR:
        return np.insert(time, line + 1, crest.time), np.insert(force, line + 1, peak)
    force[line + (part > 0.5)] = peak
    return time, force


def _squares_of_lines(time: FloatArray, force: FloatArray, weight: FloatArray, at: float) -> float:
    """Return the weighted squared differences from the best two lines that meet at a time."""
    part = (time - at) / (time[-1] - time[0])
    base = np.stack([np.ones_like(part), np.minimum(part, 0), np.maximum(part, 0)], axis=1)
    root = np.sqrt(weight / (time[-1] - time[0]))
    best = np.linalg.lstsq(base * root[:, np.newaxis], force * root, rcond=None)[0]
    return float(np.dot(weight, (force - base @ best) ** 2))
