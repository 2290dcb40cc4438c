"""All that is measured in a run, from its samples: peaks, first pulses, a history, and work."""

from __future__ import annotations

from typing import Any

from hertzchain.arrays import Array
from hertzchain.observables.contact_errors import Peaks
from hertzchain.observables.damped_law import DampedLaw
from hertzchain.observables.first_pulse import Contacts
from hertzchain.observables.history import Recorder
from hertzchain.observables.notes import NoteTaker
from hertzchain.observables.peaks import PeakWatch
from hertzchain.observables.samples import Samples
from hertzchain.observables.work import times_on_held, work_done
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg


class Watch:
    """Watches a run of a scene, in the units of its samples.

    Parameters
    ----------
    scene
        The scene: which granules are pushed, fixed or a piston.
    law
        The law of its contacts.
    inverse_mass
        1 / mass of each granule, shape (granules,); 0 for a piston.
    contacts
        The contacts, where first pulses are wanted.
    recorder
        Filled in, where a history is wanted.
    unit
        The natural unit of force.
    """

    def __init__(
        self, scene: Scene, law: DampedLaw, inverse_mass: Array, contacts: Contacts | None,
        recorder: Recorder | None, unit: float = 1.0,
    ) -> None:  # fmt: skip
        held = times_on_held(law.stiffness.size, scene.wall is not None, scene.granules.fixed)
        self.seen = PeakWatch(law, inverse_mass, held, scene.piston is not None)
        self.recorder, self._law, self._pushed = recorder, law, scene.pushed
        self._notes = None if contacts is None else NoteTaker(contacts, inverse_mass, unit)
        self.work: Any = 0.0  # of the applied force and the piston
        self.exchanged: Any = 0.0  # the same, with all parts counted as positive

    def update(self, samples: Samples, leg: Leg, late: float) -> None:
        """Add samples on a leg; ``late`` is the delay of the velocities that damped the motion."""
        before = self.seen.piston_impulse
        self.seen.update(samples, late)
        if self._notes is not None:
            self._notes.update(samples, late)
        if self.recorder is not None:
            self.recorder.update(samples, self._law)
        if leg.ramp is not None:
            self._add(work_done(samples, leg.ramp, self._pushed))
        if leg.stroke is not None:
            self._add((self.seen.piston_impulse - before) * leg.stroke.velocity)

    def _add(self, work: Any) -> None:
        self.work, self.exchanged = self.work + work, self.exchanged + abs(work)

    @property
    def peaks(self) -> Peaks:
        """Peaks and first pulses of the contacts."""
        seen, notes = self.seen, self._notes
        first = None if notes is None else notes.first_pulses(seen.force)
        return Peaks(seen.force, seen.time, seen.passed, first)
