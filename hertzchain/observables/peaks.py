"""Peaks: the true maximum of each contact force, between the samples too: see ``intervals``.

The energy lost in dampers is computed by the scene's law, so that another law in a backend shows in
the balance of energy. A contact that is open at every sample gets no peak.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.observables.damped_law import DampedLaw
from hertzchain.observables.samples import Samples

SIGNIFICANT = 1e-3  # of the largest peak; lower ones are not judged: no error estimate covers them
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
        self, law: DampedLaw, inverse_mass: FloatArray, on_held: Any = (), has_piston: bool = False
    ) -> None:
        from hertzchain.observables.intervals import Loads
        from hertzchain.observables.observer import ROOM, signals_of

        self.inverse_mass, self._has_piston = inverse_mass, has_piston
        contacts = np.arange(law.stiffness.size)
        nothing, held = np.zeros(contacts.size), np.zeros(contacts.size)
        held[: len(on_held)] = on_held
        self.signals = signals_of(contacts, np.full(contacts.size, -1), nothing, law)
        is_first = has_piston & (contacts == 0)
        self._loads = Loads(
            force=np.zeros(contacts.size), time=np.full(contacts.size, np.nan),
            scale=np.zeros(contacts.size), maxima=np.zeros((2, contacts.size)),
            at_most=np.zeros(contacts.size), at_least=np.zeros(contacts.size),
            at_touch=np.zeros(contacts.size), fastest=np.zeros(contacts.size), on_held=held,
            is_integrated=law.is_damped | (held != 0) | is_first, sums=np.zeros(3),
            room=np.zeros(ROOM),
        )  # fmt: skip
        self._until = 0.0

    @property
    def force(self) -> FloatArray:
        """Peak force of each contact, (contacts,)."""
        return self._loads.force

    @property
    def time(self) -> FloatArray:
        """Times of peaks, (contacts,); NaN where there was no force."""
        return self._loads.time

    @property
    def dissipated(self) -> float:
        """Energy lost in dampers."""
        return float(self._loads.sums[0])

    @property
    def wall_impulse(self) -> float:
        """Impulse on a wall and fixed granules."""
        return float(self._loads.sums[1])

    @property
    def piston_impulse(self) -> float:
        """Impulse of a piston."""
        return float(self._loads.sums[2]) if self._has_piston else 0.0

    @property
    def rival(self) -> FloatArray:
        """Second highest maxima, (contacts,): with other steps they may be the highest.

        0 where there is none above half of the highest: whether lower ones were kept depends on
        what came before.
        """
        second = self._loads.maxima[1]
        return np.asarray(np.where(second > _RIVALS * self.force, second, 0.0))

    @property
    def reading_error(self) -> float:
        """Bound of the relative error of judged peaks from the samples next to first touches."""
        judged = judged_contacts(self.force, ESTIMATED)
        force, most, least = (
            values[judged] for values in (self.force, self._loads.at_most, self._loads.at_least)
        )
        return float(np.max(np.maximum(most - force, force - least) / force, initial=0.0))

    @property
    def touch_share(self) -> float:
        """Largest ratio, of all contacts, of a dashpot's first closing speed to its largest."""
        at_touch, fastest = self._loads.at_touch, self._loads.fastest
        judged = judged_contacts(self.force, ESTIMATED) & (fastest > 0)
        return float(np.max(at_touch[judged] / fastest[judged], initial=0.0))

    @property
    def passed(self) -> NDArray[np.bool_]:
        """True for contacts whose force has fallen again after a peak, shape (contacts,)."""
        return self.time < self._until  # False for NaN

    @property
    def any_rising(self) -> bool:
        """True if a judged contact has its largest force at the end."""
        return any_rising(self.force, self.passed)

    def update(self, samples: Samples, late: float = 0.0) -> None:
        """Add samples; ``late`` is the delay of the velocities that damped the motion."""
        from hertzchain.observables.intervals import keep_loads

        self._until = float(samples.time[-1])
        keep_loads(
            self.signals, self._loads, *samples.of_contacts, np.append(self.inverse_mass, 0.0), late
        )  # fmt: skip


def judged_contacts(peak_force: FloatArray, significant: float = SIGNIFICANT) -> NDArray[np.bool_]:
    """True for contacts whose peak is at least a fraction of the largest, shape (..., contacts)."""
    largest = peak_force.max(axis=-1, keepdims=True, initial=0.0)
    return np.asarray((peak_force >= significant * largest) & (peak_force > 0))


def any_rising(force: FloatArray, passed: NDArray[np.bool_]) -> bool:
    """Return whether a judged contact was pressed hardest at the end; arguments (contacts,)."""
    return not passed.all() and bool(np.any(judged_contacts(force, ESTIMATED) & ~passed))


def times_of_peaks(peak_force: FloatArray, peak_time: FloatArray) -> FloatArray:
    """Times of peaks; NaN where a force far ahead of the wave underflows to 0."""
    time = peak_time.copy()
    time[peak_force <= 0] = np.nan
    return time


def largest_difference(
    peak_force: FloatArray, expected: FloatArray, significant: float = SIGNIFICANT
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
