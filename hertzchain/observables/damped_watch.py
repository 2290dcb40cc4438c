"""Damped contacts between samples: highest forces, energy lost in dampers, impulse on a wall.

Between two samples the overlap is the quintic that meets overlap, rate and acceleration. The force
there is the backend's own force at the sample with the larger overlap, times the ratio of forces
that the scene's law gives: wrong stiffness or damping in a backend still shows in its peaks. The
energy lost in dampers is computed by the scene's law, so that another law in a backend shows in the
balance of energy.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import Array
from hertzchain.observables import hermite
from hertzchain.observables.damped_law import DampedLaw
from hertzchain.observables.peaks import ESTIMATED, PeakWatch, judged_contacts
from hertzchain.observables.samples import Samples
from hertzchain.observables.work import openings

Places = NDArray[np.intp]

_GAUSS = np.polynomial.legendre.leggauss(8)
_NODES, _WEIGHTS = (_GAUSS[0] + 1) / 2, _GAUSS[1] / 2

_NEAR = 0.98
"""Fraction of the largest force: below it no maximum is searched between the nodes (chosen)."""


_SHORTEST = 1e-9
"""Shortest time of contact in an interval, over the interval (chosen): lengths divide rates."""


class DampedWatch(PeakWatch):
    """Keeps peaks of damped contacts, the energy lost in them, and impulses of wall and piston.

    Inverse masses are those of the granules, shape (granules,), 0 for those that move as a piston
    does.
    """

    def __init__(
        self, law: DampedLaw, inverse_mass: Array, has_wall: bool, has_piston: bool = False
    ) -> None:
        super().__init__(law.stiffness.size)
        self._law, self._has_wall, self._has_piston = law, has_wall, has_piston
        self.inverse_mass = inverse_mass
        # The peaks if errors of the forces at first touch are added or subtracted.
        self._at_most, self._at_least = np.zeros_like(self.force), np.zeros_like(self.force)
        # Largest closing speeds: as a dashpot begins to act, and of all samples.
        self._at_touch, self._fastest = np.zeros_like(self.force), np.zeros_like(self.force)
        self.dissipated = 0.0
        self.wall_impulse = 0.0
        self.piston_impulse = 0.0

    @property
    def rival(self) -> Array:
        """The second highest maximum of each contact, shape (contacts,); 0 for none."""
        return np.asarray(self._maxima[1])

    @property
    def reading_error(self) -> float:
        """Bound of the relative error of the judged peaks by the samples next to first touches."""
        judged = judged_contacts(self.force, ESTIMATED)
        force = self.force[judged]
        error = np.maximum(self._at_most[judged] - force, force - self._at_least[judged]) / force
        return float(np.max(error, initial=0.0))

    @property
    def touch_share(self) -> float:
        """Largest ratio, of all contacts, of a dashpot's first closing speed to its largest."""
        judged = judged_contacts(self.force, ESTIMATED) & (self._fastest > 0)
        return float(np.max(self._at_touch[judged] / self._fastest[judged], initial=0.0))

    @property
    def _mobility(self) -> Array:
        """Relative acceleration of both granules of each contact over its force."""
        contacts = self.force.size
        ahead = np.append(self.inverse_mass[1:], 0.0)
        return np.asarray((self.inverse_mass + ahead)[:contacts])

    def update(self, samples: Samples, late: float = 0.0) -> None:
        """Add the samples and the intervals between them.

        ``late`` is the delay of the velocities that damped the motion. Work and impulse are
        computed with these velocities, because they moved the granules; peaks are computed with the
        true ones.
        """
        self._until = samples.time[-1]
        self._keep_samples(samples)
        overlap, rate, _ = samples.overlap_derivatives
        pressed = np.max(np.where(overlap > 0, rate, 0.0), axis=0)
        np.maximum(self._fastest, pressed, out=self._fastest)
        interval, contact = np.nonzero((overlap[:-1] > 0) | (overlap[1:] > 0))
        if not interval.size:
            return
        part = _Part.of(samples, interval, contact, self._law, self._mobility, late)
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
        np.maximum(self._at_least, force, out=self._at_least)

    def _keep_maxima(self, samples: Samples, part: _Part, force: Array) -> None:
        """Keep the maxima within intervals and the force with which a contact begins."""
        ends = np.maximum(
            samples.contact_force[part.interval, part.contact],
            samples.contact_force[part.interval + 1, part.contact],
        )
        highest = np.argmax(force, axis=0)
        columns = np.arange(part.contact.size)
        reached = force[highest, columns]
        some = (reached > ends) & (reached >= _NEAR * self.force[part.contact]) & ~part.jumps
        if some.any():
            self._keep_found(part, *part.highest(some, highest[some], self._law))
        if part.jumps.any():
            which, at_touch, error = part.at_touch(self._law)
            # Right after a jump velocity Verlet is of first order: maxima there are not sure.
            error = np.maximum(error, reached[which] - at_touch)
            self._keep_found(part, which, at_touch, part.start[which], error)
            speed = np.maximum(part.curve[1, which] / part.h[which], 0.0)
            for largest in (self._at_touch, self._fastest):
                np.maximum.at(largest, part.contact[which], speed)

    def _keep_found(
        self, part: _Part, some: Places, force: Array, time: Array, error: Array | float = 0.0
    ) -> None:
        contact = part.contact[some]
        np.maximum.at(self._at_most, contact, force + error)
        np.maximum.at(self._at_least, contact, force - error)
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
    jumps: NDArray[np.bool_]  # whether the force of a dashpot jumps at the start: at first touch
    doubt: Array  # bound of the error of the closing speed there
    places: Array  # nodes in the touching part, from 0 to 1, shape (nodes, n)
    worth: Array  # weights of the nodes, times h

    @classmethod
    def of(
        cls,
        samples: Samples,
        interval: Places,
        contact: Places,
        law: DampedLaw,
        mobility: Array,
        late: float,
    ) -> _Part:
        derivatives = samples.overlap_derivatives[:3]
        start, h = samples.time[interval], np.diff(samples.time)[interval]
        first = [values[interval, contact] for values in derivatives]
        last = [values[interval + 1, contact] for values in derivatives]
        known = (
            samples.contact_force[interval, contact],
            samples.contact_force[interval + 1, contact],
        )
        jumps, doubt = np.zeros(h.size, bool), np.zeros(h.size)
        if law.exponent == 0:
            # Also at 0: spheres that touch at the start.
            jumps = (first[0] <= 0) & (last[0] > 0)
        if jumps.any():
            # The overlap is no polynomial across the jump: the interval starts at first touch.
            own, damping = mobility[contact[jumps]], law.damping[contact[jumps]]
            before = [values[jumps] for values in first]
            felt = known[1][jumps] - late * damping * last[2][jumps]
            after = last[2][jumps] + own * felt
            later, speed, growth, doubt[jumps] = first_touch(before, after, h[jumps])
            growth = growth - own * damping * speed
            first[0][jumps], first[1][jumps], first[2][jumps] = 0.0, speed, growth
            start[jumps] += later
            h[jumps] = np.maximum(h[jumps] - later, _SHORTEST * h[jumps])
        curve = hermite.coefficients(first, last, h)
        rises = last[0] > first[0]
        crossing = np.minimum(first[0], last[0]) < 0
        opens = openings(curve, crossing, rises)
        begin = np.where(rises, opens, 0.0)
        length = np.where(rises, 1.0, opens) - begin
        # Forces near an opening are smooth in the square root of the distance from there.
        whole, node = ~crossing, _NODES[:, np.newaxis]
        share = np.where(whole, node, node * node)
        places = begin + length * np.where(rises, share, 1 - share)
        worth = _WEIGHTS[:, np.newaxis] * h * length * np.where(whole, 1.0, 2 * node)
        harder = known[1] > known[0]
        force = np.where(harder, known[1], known[0])
        expected = law.force(
            np.where(harder, last[0], first[0]), np.where(harder, last[1], first[1]), contact
        )
        sure = (force > 0) & (expected > 0)
        scale = np.where(sure, force, 1.0) / np.where(sure, expected, 1.0)
        return cls(interval, contact, start, h, curve, scale, jumps, doubt, places, worth)

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

    def at_touch(self, law: DampedLaw) -> tuple[Places, Array, Array]:
        """Indices of intervals that start at first touch, forces there, and bounds of errors."""
        which = np.flatnonzero(self.jumps)
        damper = self.scale[which] * law.damping[self.contact[which]]
        speed = self.curve[1, which] / self.h[which]
        return which, damper * np.maximum(speed, 0.0), damper * self.doubt[which]


def first_touch(
    before: Sequence[Array], after: Array, h: Array
) -> tuple[Array, Array, Array, Array]:
    """When and how fast a contact closes that is open before an interval and pressed after it.

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
