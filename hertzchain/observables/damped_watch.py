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
from hertzchain.observables.curves import Curves, begin_at_touch
from hertzchain.observables.damped_law import DampedLaw
from hertzchain.observables.peaks import ESTIMATED, PeakWatch, judged_contacts
from hertzchain.observables.samples import Samples
from hertzchain.observables.work import openings

Places = NDArray[np.intp]

_GAUSS = np.polynomial.legendre.leggauss(8)
_NODES, _WEIGHTS = (_GAUSS[0] + 1) / 2, _GAUSS[1] / 2

_NEAR = 0.98
"""Fraction of the largest force: below it no maximum is searched between the nodes (chosen)."""


class DampedWatch(PeakWatch):
    """Keeps peaks of damped contacts, the energy lost in them, and impulses of wall and piston.

    Inverse masses are those of the granules, shape (granules,), 0 for those that move as a piston
    does.
    """

    def __init__(
        self, law: DampedLaw, inverse_mass: Array, on_held: Any = (), has_piston: bool = False
    ) -> None:
        super().__init__(law.stiffness.size, on_held=on_held, has_piston=has_piston)
        self._law, self.inverse_mass = law, inverse_mass
        # The peaks if errors of the forces at first touch are added or subtracted.
        self._at_most, self._at_least = np.zeros_like(self.force), np.zeros_like(self.force)
        # Largest closing speeds: as a dashpot begins to act, and of all samples.
        self._at_touch, self._fastest = np.zeros_like(self.force), np.zeros_like(self.force)

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
        curves = part.curves
        overlap, rate = curves.motion(part.places)
        felt = rate - late * part.growth()
        damper = self._law.damper(overlap, felt, contact)
        self.dissipated += float(np.sum(part.worth * damper * rate))
        if self._held or self._has_piston:
            impulse = part.worth * curves.scale * (self._law.elastic(overlap, contact) + damper)
            for held, times in self._held.items():
                self.wall_impulse += times * float(np.sum(impulse[:, contact == held]))
            if self._has_piston:
                self.piston_impulse += float(np.sum(impulse[:, contact == 0]))
        force = curves.scale * self._law.force(overlap, rate, contact)
        self._keep_maxima(samples, part, interval, force)

    def _keep_samples(self, samples: Samples) -> None:
        largest = np.argmax(samples.contact_force, axis=0)
        columns = np.arange(self.force.size)
        force, time = samples.contact_force[largest, columns], samples.time[largest]
        self._keep(columns, force, time, samples.overlap[largest, columns])
        np.maximum(self._at_least, force, out=self._at_least)

    def _keep_maxima(self, samples: Samples, part: _Part, interval: Places, force: Array) -> None:
        """Keep the maxima within intervals and the force with which a contact begins."""
        contact = part.curves.contact
        ends = np.maximum(
            samples.contact_force[interval, contact], samples.contact_force[interval + 1, contact]
        )
        highest = np.argmax(force, axis=0)
        reached = force[highest, np.arange(contact.size)]
        some = (reached > ends) & (reached >= _NEAR * self.force[contact]) & ~part.jumps
        if some.any():
            self._keep_found(contact[some], *part.highest(some, highest[some]))
        if part.jumps.any():
            which, at_touch, error = part.at_touch()
            # Right after a jump velocity Verlet is of first order: maxima there are not sure.
            error = np.maximum(error, reached[which] - at_touch)
            self._keep_found(contact[which], at_touch, part.curves.begin[which], error)
            speed = np.maximum(part.speed[which], 0.0)
            for largest in (self._at_touch, self._fastest):
                np.maximum.at(largest, contact[which], speed)

    def _keep_found(
        self, contact: Places, force: Array, time: Array, error: Array | float = 0.0
    ) -> None:
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

    curves: Curves
    jumps: NDArray[np.bool_]  # whether the force of a dashpot jumps at the start: at first touch
    doubt: Array  # bound of the error of the closing speed there
    places: Array  # nodes in the touching part, from 0 to 1, shape (nodes, n)
    worth: Array  # weights of the nodes, times h

    @classmethod
    def of(
        cls, samples: Samples, interval: Places, contact: Places, law: DampedLaw, mobility: Array,
        late: float,
    ) -> _Part:  # fmt: skip
        derivatives = samples.overlap_derivatives[:3]
        start, h = samples.time[interval], np.diff(samples.time)[interval]
        first = [values[interval, contact] for values in derivatives]
        last = [values[interval + 1, contact] for values in derivatives]
        known = (
            samples.contact_force[interval, contact],
            samples.contact_force[interval + 1, contact],
        )
        jumps, doubt = begin_at_touch(first, last, start, h, known[1], mobility, law, contact, late)
        curves = Curves.of(first, last, start, h, known, contact, law)
        rises, crossing = last[0] > first[0], np.minimum(first[0], last[0]) < 0
        opens = openings(curves.overlap, crossing, rises)
        begin = np.where(rises, opens, 0.0)
        length = np.where(rises, 1.0, opens) - begin
        # Forces near an opening are smooth in the square root of the distance from there.
        whole, node = ~crossing, _NODES[:, np.newaxis]
        share = np.where(whole, node, node * node)
        places = begin + length * np.where(rises, share, 1 - share)
        worth = _WEIGHTS[:, np.newaxis] * h * length * np.where(whole, 1.0, 2 * node)
        return cls(curves, jumps, doubt, places, worth)

    @property
    def speed(self) -> Array:
        """Closing speeds at the start."""
        return np.asarray(self.curves.overlap[1] / self.curves.h)

    def growth(self) -> Array:
        """Second derivatives of overlaps at the places."""
        bend = hermite.derivative(hermite.derivative(self.curves.overlap))
        return np.asarray(hermite.evaluate(bend, self.places) / self.curves.h**2)

    def highest(self, some: NDArray[np.bool_], node: Places) -> tuple[Array, Array]:
        """Highest forces of intervals, next to their highest nodes, and the times of these."""
        places = np.sort(self.places[:, some], axis=0)
        down = self.places[0, some] > self.places[-1, some]
        last, columns = _NODES.size - 1, np.arange(node.size)
        node = np.where(down, last - node, node)
        low = np.where(node > 0, places[np.maximum(node - 1, 0), columns], 0.0)
        high = np.where(node < last, places[np.minimum(node + 1, last), columns], 1.0)
        curves = self.curves.part(some)
        force, place = curves.highest_between(low, high)
        return force, curves.begin + place * curves.h

    def at_touch(self) -> tuple[Places, Array, Array]:
        """Indices of intervals that start at first touch, forces there, and bounds of errors."""
        which, curves = np.flatnonzero(self.jumps), self.curves
        damper = curves.scale[which] * curves.law.damping[curves.contact[which]]
        return which, damper * np.maximum(self.speed[which], 0.0), damper * self.doubt[which]
