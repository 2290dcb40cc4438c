"""Peaks: the true maximum of each contact force, between the samples too.

Between two samples the overlap is interpolated, and the force is the backend's own at the end where
it is larger, scaled between the samples by the scene's law: see ``curves``. A wrong stiffness or
damping in a backend still shows in its peaks. The energy lost in dampers is computed by the scene's
law, so that another law in a backend shows in the balance of energy. A contact that is open at
every sample gets no peak.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import Array, FloatArray
from hertzchain.observables.curves import Curves, begin_at_touch
from hertzchain.observables.damped_law import DampedLaw
from hertzchain.observables.samples import Samples

SIGNIFICANT = 1e-3  # of the largest peak; lower ones are not judged: no error estimate covers them
_COUNTS = 1e-4
"""Fraction of the largest force below which a maximum between samples does not count: the front of
a wave grows by powers of ten within an interval, which may seem a maximum."""
_RIVALS = 0.5
"""Fraction of a contact's highest maximum above which a second one may take its place (chosen):
errors of steps above that are refused."""
ESTIMATED = 0.5 * SIGNIFICANT  # lowest peaks by which two runs are compared: one may be low in both


class PeakWatch:
    """Keeps the largest force of each contact, energy lost in dampers and impulses, from samples.

    Parameters
    ----------
    law
        The law of the contacts, in the units of the samples.
    inverse_mass
        1 / mass of each granule, shape (granules,), 0 for those that move as a piston does.
    on_held
        How often the force of each contact counts in that on a wall and fixed granules, as
        ``times_on_held`` says.
    has_piston
        Whether granule 1 is a piston: then its impulse on granule 2 is kept, too.
    """

    def __init__(
        self, law: DampedLaw, inverse_mass: Array, on_held: Any = (), has_piston: bool = False
    ) -> None:
        self._law, self.inverse_mass = law, inverse_mass
        self._has_piston = has_piston
        self._held = {k: float(on_held[k]) for k in np.flatnonzero(on_held).tolist()}
        self.wall_impulse = self.piston_impulse = self.dissipated = 0.0
        self.force: Any = np.zeros_like(law.stiffness)
        self.time = np.full_like(self.force, np.nan)
        self._scale = np.zeros_like(self.force)  # the backend's force over that of the law
        self._maxima = np.zeros((2, *self.force.shape), self.force.dtype)  # the two highest
        # The peaks if errors of the forces at first touch are added or subtracted.
        self._at_most, self._at_least = np.zeros_like(self.force), np.zeros_like(self.force)
        # Largest closing speeds: as a dashpot begins to act, and of all samples.
        self._at_touch, self._fastest = np.zeros_like(self.force), np.zeros_like(self.force)
        self._until = self.force.dtype.type(0)
        # Contacts whose force is integrated.
        self._counted = np.full(self.force.shape, law.is_damped)
        self._counted[[*self._held, *[0] * has_piston]] = True

    @property
    def rival(self) -> Array:
        """Second highest maxima, (contacts,): with other steps they may be the highest.

        0 where there is none above half of the highest: whether lower ones were kept depends on
        what came before.
        """
        second = self._maxima[1]
        return np.asarray(np.where(second > _RIVALS * self.force, second, 0.0))

    @property
    def reading_error(self) -> float:
        """Bound of the relative error of judged peaks from the samples next to first touches."""
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
    def passed(self) -> NDArray[np.bool_]:
        """True for contacts whose force has fallen again after a peak, shape (contacts,)."""
        return self.time < self._until  # False for NaN

    @property
    def any_rising(self) -> bool:
        """True if a judged contact has its largest force at the end."""
        return any_rising(self.force, self.passed)

    def update(self, samples: Samples, late: float = 0.0) -> None:
        """Add the samples and the intervals between them.

        ``late`` is the delay of the velocities that damped the motion. Work and impulse are
        computed with these velocities, because they moved the granules; peaks are computed with the
        true ones.
        """
        self._until = samples.time[-1]
        overlap, rate, change = samples.overlap_derivatives[:3]
        self._keep_samples(samples, overlap, rate)
        pressed = overlap > 0
        np.maximum(self._fastest, np.max(np.where(pressed, rate, 0.0), axis=0), out=self._fastest)
        # Upper bounds of overlap and rate, with the largest changes that both ends allow.
        h = np.diff(samples.time)[:, np.newaxis]
        change, speed = (h * (abs(d[:-1]) + abs(d[1:])) for d in (change, rate))
        reach = np.maximum(overlap[:-1], overlap[1:]) + speed + h * change
        bound = self._scale * self._law.force(reach, speed / h + change)
        some = bound > np.maximum(self._maxima[1], _COUNTS * np.max(self.force, initial=0.0))
        some |= (pressed[:-1] | pressed[1:]) & self._counted
        interval, contact = np.nonzero(some)
        if interval.size:
            self._add(samples, interval, contact, late)

    def _keep_samples(self, samples: Samples, overlap: Array, rate: Array) -> None:
        """Keep the largest samples, and the ratio of their forces to those of the law."""
        largest, columns = np.argmax(samples.contact_force, axis=0), np.arange(self.force.size)
        force, time = samples.contact_force[largest, columns], samples.time[largest]
        larger = force > self.force
        scale = self._law.scale_of(
            force, overlap[largest, columns], rate[largest, columns], otherwise=self._scale
        )
        self._scale = np.where(larger, scale, self._scale)
        self._keep(columns, force, time)
        np.maximum(self._at_least, force, out=self._at_least)

    def _add(
        self,
        samples: Samples,
        interval: NDArray[np.intp],
        contact: NDArray[np.intp],
        late: float,
    ) -> None:
        """Add intervals of contacts: their integrals, maxima, and forces at first touch."""
        law, derivatives = self._law, samples.overlap_derivatives
        begin, h = samples.time[interval], np.diff(samples.time)[interval]
        start, end = ([d[interval + k, contact] for d in derivatives] for k in range(2))
        force = samples.contact_force
        ends = force[interval, contact], force[interval + 1, contact]
        jumps, doubt = begin_at_touch(
            start, end, begin, h, ends[1], self.inverse_mass, law, contact, late
        )
        curves = Curves.of(start, end, begin, h, ends, contact, law, self._scale[contact])
        self._integrate(curves.part(self._counted[contact]), late)
        which, place = curves.maxima()
        found = curves.part(which)
        highest, time = found.force(place), found.begin + place * found.h
        some = (highest > _COUNTS * np.max(self.force)) & ~jumps[which]
        self._keep_found(found.contact[some], highest[some], time[some])
        if jumps.any():
            closing = np.maximum(start[1][jumps], 0.0)
            damper = curves.scale[jumps] * law.damping[contact[jumps]]
            at_touch = damper * closing
            # Right after a jump velocity Verlet is of first order: maxima there are not sure.
            after = curves.part(jumps).highest()[0]
            error = np.maximum(damper * doubt[jumps], after - at_touch)
            self._keep_found(contact[jumps], at_touch, begin[jumps], error)
            for largest in (self._at_touch, self._fastest):
                np.maximum.at(largest, contact[jumps], closing)

    def _integrate(self, part: Curves, late: float) -> None:
        """Add the energy lost in dampers, and the impulses of wall and piston."""
        contact, (places, worth) = part.contact, part.nodes()
        overlap, rate = part.motion(places)
        damper = self._law.damper(overlap, rate - late * part.bend(places), contact)
        self.dissipated += float(np.sum(worth * damper * rate))
        if self._held or self._has_piston:
            impulse = worth * part.scale * (self._law.elastic(overlap, contact) + damper)
            for held, times in self._held.items():
                self.wall_impulse += times * float(np.sum(impulse[:, contact == held]))
            if self._has_piston:
                self.piston_impulse += float(np.sum(impulse[:, contact == 0]))

    def _keep_found(
        self, contact: NDArray[np.intp], force: Array, time: Array, error: Array | float = 0.0
    ) -> None:
        """Keep maxima between samples, whose forces may have an error."""
        np.maximum.at(self._at_most, contact, force + error)
        np.maximum.at(self._at_least, contact, force - error)
        for number, value in zip(contact, force, strict=True):
            pair = self._maxima[:, number]
            if value > pair[0]:
                pair[:] = value, pair[0]
            elif value > pair[1]:
                pair[1] = value
        self._keep(contact, force, time)

    def _keep(self, contacts: NDArray[np.intp], force: Array, time: Array) -> None:
        """Replace kept forces by later ones that are as large or larger, contact by contact."""
        order = np.argsort(force, kind="stable")  # if a contact has several, the largest is last
        contacts, force, time = contacts[order], force[order], time[order]
        larger = force > self.force[contacts]
        self.force[contacts[larger]] = force[larger]
        self.time[contacts[larger]] = time[larger]


def judged_contacts(peak_force: Array, significant: float = SIGNIFICANT) -> NDArray[np.bool_]:
    """True for contacts whose peak is at least a fraction of the largest, shape (..., contacts)."""
    largest = peak_force.max(axis=-1, keepdims=True, initial=0.0)
    return np.asarray((peak_force >= significant * largest) & (peak_force > 0))


def any_rising(force: Array, passed: NDArray[np.bool_]) -> bool:
    """Return whether a judged contact was pressed hardest at the end; arguments (contacts,)."""
    return not passed.all() and bool(np.any(judged_contacts(force, ESTIMATED) & ~passed))


def times_of_peaks(peak_force: FloatArray, peak_time: FloatArray) -> FloatArray:
    """Times of peaks; NaN where a force far ahead of the wave underflows to 0."""
    time = peak_time.copy()
    time[peak_force <= 0] = np.nan
    return time


def largest_difference(
    peak_force: Array, expected: Array, significant: float = SIGNIFICANT
) -> float:
    """Largest relative difference of the peaks that are judged: see ``judged_contacts``.

    Both arrays have the shape (contacts,). Where no force is expected the result is 0, or 1 if
    there is any.
    """
    if peak_force.shape != expected.shape:
        raise ValueError(f"must have equal shapes, got {peak_force.shape} and {expected.shape}")
    largest = expected.max()
    if largest == 0:
        return float(peak_force.any())
    # As judged_contacts, but quicker: every short run asks for this.
    judged = expected >= significant * largest
    ratio = peak_force[judged] / expected[judged]
    return float(abs(ratio - 1.0).max())
