"""The largest force of a pulse from a fit of its crest, and rows that have it.

The largest of the corners of few lines is no estimate of F0: of noisy corners it is the
highest, and lines of least squares meet above a crest that bows.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.pulses.corners import BOW, Corners, impulse_of, weights
from hertzchain.pulses.noise import LEAST, Noise

_DEGREE = 4  # of the polynomial: crests that lean and flat ones
_PARTS = (0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.98)  # of the height, above which it is fitted; chosen
_BRIDGE = 0.5
"""As ``corners.BRIDGE``, about a polynomial of degree 4: 0.40 to 0.56 was measured for 20 to 1000
samples."""
_NEAR = 0.25  # part of a line within which a corner is at the crest; chosen


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
        allowed = max(BOW * bend * length, _BRIDGE * density * math.sqrt(length))
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
    """Return lines led through a crest, by a corner near it or one more, and nowhere above it."""
    time, force = corners.time, np.minimum(corners.force, crest.force)
    line = int(np.clip(np.searchsorted(time, crest.time) - 1, 0, time.size - 2))
    part = (crest.time - time[line]) / (time[line + 1] - time[line])
    if _NEAR < part < 1 - _NEAR:
        return np.insert(time, line + 1, crest.time), np.insert(force, line + 1, crest.force)
    force[line + (part > 0.5)] = crest.force
    return time, force


def _squares_of_lines(time: FloatArray, force: FloatArray, weight: FloatArray, at: float) -> float:
    """Return the weighted squared differences from the best two lines that meet at a time."""
    part = (time - at) / (time[-1] - time[0])
    base = np.stack([np.ones_like(part), np.minimum(part, 0), np.maximum(part, 0)], axis=1)
    root = np.sqrt(weight / (time[-1] - time[0]))
    best = np.linalg.lstsq(base * root[:, np.newaxis], force * root, rcond=None)[0]
    return float(np.dot(weight, (force - base @ best) ** 2))
