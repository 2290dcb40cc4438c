"""Forces of contacts between samples, and where they are highest.

The overlap is the polynomial that matches all known derivatives at both ends. The force is that of
the law times a ratio: the backend's force over that of the law, at the end with the larger force.
So a wrong stiffness or damping in a backend still shows in its peaks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import Array
from hertzchain.observables import hermite
from hertzchain.observables.damped_law import DampedLaw
from hertzchain.observables.samples import Samples

_SHORTEST = 1e-9
"""Shortest time of contact in an interval, over the interval (chosen): lengths divide rates."""

_PLACES = np.linspace(0, 1, 9)[:, np.newaxis]
"""Places in an interval at which the rate of the force is computed, to find maxima between."""

_HALVINGS = 60
"""Bisections of a place in an interval, to the last digit of any precision."""

_GAUSS = np.polynomial.legendre.leggauss(8)
_NODES, _WEIGHTS = (_GAUSS[0][:, np.newaxis] + 1) / 2, _GAUSS[1][:, np.newaxis] / 2


@dataclass(frozen=True, eq=False)
class Curves:
    """The forces of contacts within n intervals; ``of`` and ``within`` construct them."""

    begin: Array  # time, shape (n,)
    h: Array
    contact: NDArray[np.intp]
    overlap: Array  # coefficients in (t - begin) / h, shape (degree + 1, n)
    scale: Array  # force of the backend over that of the law
    law: DampedLaw

    @classmethod
    def of(
        cls, start: Sequence[Array], end: Sequence[Array], begin: Array, h: Array,
        ends: tuple[Array, Array], contact: NDArray[np.intp], law: DampedLaw,
        otherwise: Array | float = 1.0,
    ) -> Curves:  # fmt: skip
        """Return the curves with given overlaps, their derivatives, and forces at both ends.

        Of four derivatives the last may be NaN, where it is not known. ``otherwise`` is the scale
        where no end is pressed.
        """
        overlap: Array = np.zeros((2 * len(start), h.size), h.dtype)
        smooth = np.isfinite(start[-1]) & np.isfinite(end[-1])
        for known, some in ((len(start), smooth), (3, ~smooth)):
            first, last = ([values[some] for values in at[:known]] for at in (start, end))
            overlap[: 2 * known, some] = hermite.coefficients(first, last, h[some])
        harder = ends[1] > ends[0]
        deep, rate = (np.where(harder, end[k], start[k]) for k in range(2))
        scale = law.scale_of(np.maximum(*ends), deep, rate, contact, otherwise)
        return cls(begin, h, contact, overlap, scale, law)

    @classmethod
    def within(
        cls, samples: Samples, interval: NDArray[np.intp], contact: NDArray[np.intp],
        law: DampedLaw,
    ) -> Curves:  # fmt: skip
        """Return the curves of contacts within intervals between samples."""
        start, end = (
            [values[interval + k, contact] for values in samples.overlap_derivatives]
            for k in range(2)
        )
        force, h = samples.contact_force, np.diff(samples.time)[interval]
        ends = force[interval, contact], force[interval + 1, contact]
        return cls.of(start, end, samples.time[interval], h, ends, contact, law)

    def part(self, some: Any) -> Curves:
        """Return the curves of some intervals."""
        return Curves(
            self.begin[some], self.h[some], self.contact[some], self.overlap[:, some],
            self.scale[some], self.law,
        )  # fmt: skip

    @cached_property
    def _rate(self) -> Array:
        """Coefficients of the derivative with respect to (t - begin) / h."""
        return hermite.derivative(self.overlap)

    def motion(self, s: Array) -> tuple[Array, Array]:
        """Overlaps and their rates at places of the intervals, from 0 to 1, shape (..., n)."""
        return hermite.evaluate(self.overlap, s), hermite.evaluate(self._rate, s) / self.h

    def bend(self, s: Array) -> Array:
        """Second derivatives of overlaps at places of the intervals, shape (..., n)."""
        return hermite.evaluate(hermite.derivative(self._rate), s) / self.h / self.h

    def force(self, s: Array) -> Array:
        """Force at places of the intervals, shape (..., n)."""
        return np.asarray(self.scale * self.law.force(*self.motion(s), self.contact))

    def _rises(self, s: Array) -> NDArray[np.bool_]:
        """Whether forces grow at places of the intervals, shape (..., n)."""
        return self.law.growth(*self.motion(s), self.bend(s), self.contact) > 0

    def maxima(self) -> tuple[NDArray[np.intp], Array]:
        """Return the interval and the place, from 0 to 1, of each maximum within intervals."""
        rises = self._rises(_PLACES.astype(self.h.dtype))
        place, which = np.nonzero(rises[:-1] & ~rises[1:])
        low, high = (_PLACES[place + k, 0].astype(self.h.dtype) for k in range(2))
        some = self.part(which)
        for _ in range(_HALVINGS):
            middle = (low + high) / 2
            rises = some._rises(middle)
            low, high = np.where(rises, middle, low), np.where(rises, high, middle)
        return which, high

    def highest(self) -> tuple[Array, Array]:
        """Return the largest force of each interval, its ends included, and its place, (n,)."""
        place = np.where(
            self.force(np.ones(self.h.size)) > self.force(np.zeros(self.h.size)), 1.0, 0.0
        )
        force = self.force(place)
        which, at = self.maxima()
        found = self.part(which).force(at)
        for k in np.argsort(found).tolist():
            if found[k] > force[which[k]]:
                force[which[k]], place[which[k]] = found[k], at[k]
        return force, place

    def nodes(self) -> tuple[Array, Array]:
        """Places in the touching part of intervals, (nodes, n), and their weights in integrals.

        Forces near an opening are smooth in the square root of the distance from there.
        """
        first, last = self.overlap[0], np.sum(self.overlap, axis=0)
        later, crossing = last > first, np.minimum(first, last) < 0
        opens = openings(self.overlap, crossing, later)
        begin = np.where(later, opens, 0.0)
        length = np.where(later, 1.0, opens) - begin
        share = np.where(crossing, _NODES * _NODES, _NODES)
        places = begin + length * np.where(later, share, 1 - share)
        return places, _WEIGHTS * self.h * length * np.where(crossing, 2 * _NODES, 1.0)


def openings(curve: Any, crossing: Any, later: Any) -> Any:
    """Return the s in [0, 1] where overlaps that are ``crossing`` pass 0, shape (intervals,).

    For other intervals return 0 where the end has the larger overlap, and 1 where the start has it.
    """
    found = np.where(later, 0.0, 1.0)
    if not np.any(crossing):
        return found
    part, rising = curve[:, crossing], later[crossing]
    low, high = np.zeros(rising.size), np.ones(rising.size)
    for _ in range(53):  # bisections: to the last digit
        middle = (low + high) / 2
        before = (hermite.evaluate(part, middle) > 0) != rising
        low, high = np.where(before, middle, low), np.where(before, high, middle)
    found[crossing] = (low + high) / 2
    return found


def first_touch(
    before: Sequence[Array], after: Array, h: Array
) -> tuple[Array, Array, Array, Array]:
    """Return when and how fast contacts close that are open at the start and pressed at the end.

    Parameters
    ----------
    before
        Overlap, its rate and the acceleration at the start of the interval, shape (n,) each.
    after
        The acceleration at the end by all forces but that of the contact itself.
    h
        Length of the interval.

    Returns
    -------
    Time from the start, rate and acceleration just before the contact closes, and a bound of the
    error of the rate: it holds while the acceleration lies between those of both ends.
    """
    overlap, rate, growth = before
    bend = (after - growth) / h
    low, high = np.zeros_like(h), h.copy()
    for _ in range(53):  # bisections: to the last digit
        middle = (low + high) / 2
        apart = overlap + middle * (rate + middle * (growth / 2 + middle * bend / 6)) < 0
        low, high = np.where(apart, middle, low), np.where(apart, high, middle)
    high = np.where(overlap < 0, high, 0.0)
    closing = rate + high * (growth + high * bend / 2)
    return high, closing, growth + high * bend, high * np.abs(after - growth)


def begin_at_touch(
    start: list[Array], end: Sequence[Array], begin: Array, h: Array, force: Array,
    inverse_mass: Array, law: DampedLaw, contact: NDArray[np.intp], late: float,
) -> tuple[NDArray[np.bool_], Array]:  # fmt: skip
    """Let intervals in which a dashpot closes begin there, as no polynomial crosses its jump.

    ``start``, ``begin`` and ``h`` are changed in place, shape (n,) each. ``force`` is that at the
    end, ``inverse_mass`` that of each granule, shape (granules,), ``late`` the delay of velocities.
    Returns which intervals these are (also those of spheres that touch at the start), and a bound
    of the error of the closing speed there.
    """
    jumps, doubt = (start[0] <= 0) & (end[0] > 0), np.zeros(h.size)
    if law.exponent != 0 or not jumps.any():
        return np.zeros(h.size, bool), doubt
    here = contact[jumps]
    damping, own = law.damping[here], inverse_mass[here] + np.append(inverse_mass, 0.0)[here + 1]
    felt = force[jumps] - late * damping * end[2][jumps]
    later, speed, growth, doubt[jumps] = first_touch(
        [values[jumps] for values in start[:3]], end[2][jumps] + own * felt, h[jumps]
    )
    start[0][jumps], start[1][jumps] = 0.0, speed
    start[2][jumps] = growth - own * damping * speed
    begin[jumps] += later
    h[jumps] = np.maximum(h[jumps] - later, _SHORTEST * h[jumps])
    return jumps, doubt
