"""Damped contacts between samples: highest forces, energy lost in dampers, impulse on a wall.

Between two samples the overlap is the quintic that meets overlap, rate and acceleration. The force
there is the backend's own force at the sample with the larger overlap, times the ratio of forces
that the scene's law gives: wrong stiffness or damping in a backend still shows in its peaks. The
energy lost in dampers is computed by the scene's law, so that another law in a backend shows in the
balance of energy.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import Array
from hertzchain.observables import hermite
from hertzchain.observables.damped_law import DampedLaw
from hertzchain.observables.peaks import PeakWatch
from hertzchain.observables.samples import Samples
from hertzchain.observables.work import openings

Places = NDArray[np.intp]

_GAUSS = np.polynomial.legendre.leggauss(8)
_NODES, _WEIGHTS = (_GAUSS[0] + 1) / 2, _GAUSS[1] / 2

_NEAR = 0.98
"""Fraction of the largest force: below it no maximum is searched between the nodes (chosen)."""


class DampedWatch(PeakWatch):
    """Keeps peaks of damped contacts, the energy lost in them, and impulses of wall and piston."""

    def __init__(self, law: DampedLaw, has_wall: bool, has_piston: bool = False) -> None:
        super().__init__(law.stiffness.size)
        self._law, self._has_wall, self._has_piston = law, has_wall, has_piston
        self.dissipated = 0.0
        self.wall_impulse = 0.0
        self.piston_impulse = 0.0

    @property
    def rival(self) -> Array:
        """The second highest maximum of each contact, shape (contacts,); 0 for none."""
        return np.asarray(self._maxima[1])

    def update(self, samples: Samples, late: float = 0.0) -> None:
        """Add the samples and the intervals between them.

        ``late`` is the delay of the velocities that damped the motion. Work and impulse are
        computed with these velocities, because they moved the granules; peaks are computed with the
        true ones.
        """
        self._until = samples.time[-1]
        self._keep_samples(samples)
        overlap = samples.overlap
        interval, contact = np.nonzero((overlap[:-1] > 0) | (overlap[1:] > 0))
        if not interval.size:
            return
        part = _Part.of(samples, interval, contact, self._law)
        overlap, rate, growth = part.motion(part.places)
        felt = rate - late * growth
        damper = self._law.damper(overlap, felt, contact)
        self.dissipated += float(np.sum(part.worth * damper * rate))
        if self._has_wall or self._has_piston:
            impulse = part.worth * part.scale * (self._law.elastic(overlap, contact) + damper)
            if self._has_wall:
                self.wall_impulse += float(np.sum(impulse[:, contact == self.force.size - 1]))
            if self._has_piston:
                self.piston_impulse += float(np.sum(impulse[:, contact == 0]))
        force = part.scale * self._law.force(overlap, rate, contact)
        self._keep_maxima(samples, part, force)

    def _keep_samples(self, samples: Samples) -> None:
        largest = np.argmax(samples.contact_force, axis=0)
        columns = np.arange(self.force.size)
        force, time = samples.contact_force[largest, columns], samples.time[largest]
        self._keep(columns, force, time, samples.overlap[largest, columns])

    def _keep_maxima(self, samples: Samples, part: _Part, force: Array) -> None:
        """Keep the maxima within intervals and the force with which a contact begins."""
        ends = np.maximum(
            samples.contact_force[part.interval, part.contact],
            samples.contact_force[part.interval + 1, part.contact],
        )
        highest = np.argmax(force, axis=0)
        columns = np.arange(part.contact.size)
        # The overlap is not a polynomial across the jump of a dashpot's force at first touch.
        jumps = part.begins if self._law.exponent == 0 else np.zeros(columns.size, bool)
        reached = force[highest, columns]
        some = (reached > ends) & (reached >= _NEAR * self.force[part.contact]) & ~jumps
        if some.any():
            self._keep_found(part, *part.highest(some, highest[some], self._law))
        if jumps.any():
            self._keep_found(part, *part.at_begin(jumps, samples, self._law))

    def _keep_found(self, part: _Part, some: Places, force: Array, time: Array) -> None:
        contact = part.contact[some]
        for number, value in zip(contact, force, strict=True):
            pair = self._maxima[:, number]
            if value > pair[0]:
                pair[:] = value, pair[0]
            elif value > pair[1]:
                pair[1] = value
        self._keep(contact, force, time, np.zeros(contact.size))


@dataclass(frozen=True, eq=False)
class _Part:
    """Intervals in which contacts overlap, at the start or at the end; shape (n,) each."""

    interval: Places
    contact: Places
    start: Array  # time
    h: Array
    curve: Array  # coefficients of the overlap, shape (6, n)
    scale: Array  # force of the backend over that of the scene's law
    begins: NDArray[np.bool_]  # whether the contact begins within the interval
    places: Array  # nodes in the touching part, from 0 to 1, shape (nodes, n)
    worth: Array  # weights of the nodes, times h

    @classmethod
    def of(cls, samples: Samples, interval: Places, contact: Places, law: DampedLaw) -> _Part:
        derivatives = samples.overlap_derivatives[:3]
        h = np.diff(samples.time)[interval]
        first = [values[interval, contact] for values in derivatives]
        last = [values[interval + 1, contact] for values in derivatives]
        curve = hermite.coefficients(first, last, h)
        later = last[0] > first[0]
        crossing = np.minimum(first[0], last[0]) < 0
        opens = openings(curve, crossing, later)
        begin = np.where(later, opens, 0.0)
        length = np.where(later, 1.0, opens) - begin
        # Forces near an opening are smooth in the square root of the distance from there.
        whole, node = ~crossing, _NODES[:, np.newaxis]
        share = np.where(whole, node, node * node)
        places = begin + length * np.where(later, share, 1 - share)
        worth = _WEIGHTS[:, np.newaxis] * h * length * np.where(whole, 1.0, 2 * node)
        known = (
            samples.contact_force[interval, contact],
            samples.contact_force[interval + 1, contact],
        )
        harder = known[1] > known[0]
        force = np.where(harder, known[1], known[0])
        expected = law.force(
            np.where(harder, last[0], first[0]), np.where(harder, last[1], first[1]), contact
        )
        sure = (force > 0) & (expected > 0)
        scale = np.where(sure, force, 1.0) / np.where(sure, expected, 1.0)
        start = samples.time[interval]
        begins = (first[0] <= 0) & (last[0] > 0)  # also at 0: spheres that touch at the start
        return cls(interval, contact, start, h, curve, scale, begins, places, worth)

    def motion(self, places: Array, some: Any = slice(None)) -> tuple[Array, Array, Array]:
        """Overlaps, rates and accelerations at places in the intervals, shape (..., n)."""
        curve, h = self.curve[:, some], self.h[some]
        slope = hermite.derivative(curve)
        bend = hermite.derivative(slope)
        return (
            hermite.evaluate(curve, places),
            hermite.evaluate(slope, places) / h,
            hermite.evaluate(bend, places) / h**2,
        )

    def force(self, places: Array, law: DampedLaw, some: Any) -> Array:
        """Forces at places of some intervals, shape (..., n)."""
        overlap, rate, _ = self.motion(places, some)
        return np.asarray(self.scale[some] * law.force(overlap, rate, self.contact[some]))

    def highest(
        self, some: NDArray[np.bool_], node: Places, law: DampedLaw
    ) -> tuple[Places, Array, Array]:
        """Indices of intervals, their highest forces and the times of these forces."""
        which = np.flatnonzero(some)
        places = np.sort(self.places[:, which], axis=0)
        down = self.places[0, which] > self.places[-1, which]
        node = np.where(down, _NODES.size - 1 - node, node)
        columns = np.arange(which.size)
        low = np.where(node > 0, places[np.maximum(node - 1, 0), columns], 0.0)
        high = np.where(
            node < _NODES.size - 1, places[np.minimum(node + 1, _NODES.size - 1), columns], 1.0
        )
        for _ in range(40):  # thirds: the place to 1e-7, the force to its square
            third = (high - low) / 3
            left, right = low + third, high - third
            rises = self.force(left, law, which) < self.force(right, law, which)
            low, high = np.where(rises, left, low), np.where(rises, high, right)
        place = (low + high) / 2
        return which, self.force(place, law, which), self.start[which] + place * self.h[which]

    def at_begin(
        self, some: NDArray[np.bool_], samples: Samples, law: DampedLaw
    ) -> tuple[Places, Array, Array]:
        """Forces of dashpots at first touch, from the free flight before it."""
        which = np.flatnonzero(some)
        contact = self.contact[which]
        gap, rate, grown = (
            values[self.interval[which], contact] for values in samples.overlap_derivatives[:3]
        )
        # gap + rate t + grown t^2 / 2 = 0, without a difference of equal numbers
        root = np.sqrt(np.maximum(rate**2 - 2 * gap * grown, 0.0))
        with np.errstate(divide="ignore", invalid="ignore"):
            later = -2 * gap / (rate + root)
        sure = (rate > 0) & (later <= self.h[which])
        which, contact, later = which[sure], contact[sure], later[sure]
        closing = rate[sure] + grown[sure] * later
        force = self.scale[which] * law.damping[contact] * np.maximum(closing, 0.0)
        return which, force, self.start[which] + later
