"""All that is measured in a run, from its samples: peaks, first pulses, a history, and work.

A peak is the true maximum of a contact force, between the samples too: see ``intervals``. Energy
lost in dampers is computed by the law of the scene, so that another law in a backend shows in the
balance of energy. A contact that is open at every sample gets no peak.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.observables.error_bound import Peaks
from hertzchain.observables.first_pulse import Signals, pulses_in
from hertzchain.observables.peaks import ESTIMATED, judged_contacts
from hertzchain.observables.samples import DampedLaw, Recorder, Samples
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg
from hertzchain.scene.shocks import Ramp

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(4)


def work_done(samples: Samples, ramp: Ramp, pushed: int = 0) -> float:
    """Return the integral of force times velocity of a granule over a leg, in the ramp's units.

    ``pushed`` is the granule, counted from 0.
    """
    from hertzchain.observables.intervals import motion_at

    h = np.diff(samples.time)[:, np.newaxis]
    times = np.ravel(samples.time[:-1, np.newaxis] + (_NODES + 1) / 2 * h)
    displacement, velocity = np.zeros((2, times.size, 1))
    motion_at(times, *samples.of_granules(slice(pushed, pushed + 1)), displacement, velocity)
    return float(np.sum(np.ravel(_WEIGHTS / 2 * h) * ramp.force(times) * velocity[:, 0]))


class PeakWatch:
    """Keeps the largest force of each contact, energy lost in dampers and impulses, from samples.

    ``force`` and ``time`` describe the peaks, (contacts,); times are NaN without a force. ``law``
    is that of the contacts, in the units of the samples; ``inverse_mass`` is 1 / mass of each
    granule, shape (granules,), 0 for those that move as a piston does; ``on_held`` says how often
    the force of each contact counts in that on a wall and fixed granules. If granule 1 is a piston,
    its impulse on granule 2 is kept, too.
    """

    def __init__(
        self,
        law: DampedLaw,
        inverse_mass: FloatArray,
        on_held: FloatArray | Sequence[float] = (),
        has_piston: bool = False,
    ) -> None:
        from hertzchain.observables.intervals import Loads
        from hertzchain.observables.observer import ROOM

        self.inverse_mass, self._has_piston = inverse_mass, has_piston
        self.signals, contacts = law.signals(), law.stiffness.size
        scale, at_most, at_least, at_touch, fastest, held, self.force = np.zeros((7, contacts))
        self.time = np.full(contacts, np.nan)
        held[: len(on_held)] = on_held
        is_integrated = law.is_damped | (held != 0) | (has_piston & (np.arange(contacts) == 0))
        self._loads = Loads(
            self.force, self.time, scale, np.zeros((2, contacts)), at_most, at_least, at_touch,
            fastest, held, is_integrated, np.zeros(3), np.zeros(ROOM),
        )  # fmt: skip
        self._until = 0.0

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
        # Fraction of a contact's highest maximum above which a second one may take its place
        # (chosen): errors of steps above that are refused
        return np.asarray(np.where(second > 0.5 * self.force, second, 0.0))

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

    def update(self, samples: Samples, late: float = 0.0) -> None:
        """Add samples; ``late`` is the delay of the velocities that damped the motion."""
        from hertzchain.observables.intervals import keep_loads

        self._until = float(samples.time[-1])
        keep_loads(
            self.signals, self._loads, *samples.of_contacts, np.append(self.inverse_mass, 0.0), late
        )  # fmt: skip


class Watch:
    """Watches a run of a scene, in the units of its samples.

    Law and ``inverse_mass`` are as for ``PeakWatch``; ``signals`` are given where first pulses are
    wanted; a ``recorder``, where a history is wanted, is filled in; ``unit`` is the natural unit of
    force.
    """

    def __init__(
        self, scene: Scene, law: DampedLaw, inverse_mass: FloatArray, signals: Signals | None,
        recorder: Recorder | None, unit: float = 1.0,
    ) -> None:  # fmt: skip
        contacts, fixed = law.stiffness.size, scene.granules.fixed
        held = np.zeros(contacts)
        held[-1] += scene.wall is not None
        held[fixed[fixed > 0] - 1] += 1
        held[fixed[fixed < contacts]] -= 1
        self.seen = PeakWatch(law, inverse_mass, held, scene.piston is not None)
        self.recorder, self._pushed = recorder, scene.pushed
        self._inverse_mass = np.append(inverse_mass, 0.0)
        self._observer = None if signals is None else signals.watch(unit)
        self.work: float = 0.0  # of the applied force and the piston
        self.exchanged: float = 0.0  # the same, with all parts counted as positive

    def update(self, samples: Samples, leg: Leg, late: float) -> None:
        """Add samples on a leg; ``late`` is the delay of the velocities that damped the motion."""
        before = self.seen.piston_impulse
        self.seen.update(samples, late)
        if self._observer is not None:
            from hertzchain.observables.intervals import observe_samples

            observe_samples(self._observer, *samples.of_contacts, self._inverse_mass, late)
        if self.recorder is not None:
            self.recorder.update(samples, self.seen.signals)
        if leg.ramp is not None:
            self._add(work_done(samples, leg.ramp, self._pushed))
        if leg.stroke is not None:
            self._add((self.seen.piston_impulse - before) * leg.stroke.velocity)

    def _add(self, work: float) -> None:
        self.work, self.exchanged = self.work + work, self.exchanged + abs(work)

    @property
    def peaks(self) -> Peaks:
        """Peaks and first pulses of the contacts."""
        seen = self.seen
        return Peaks(seen.force, seen.time, seen.passed, pulses_in(self._observer))
