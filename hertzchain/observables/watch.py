"""All that is measured in a run, from its samples: peaks, first pulses, a history, and work."""

from __future__ import annotations

from typing import Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.observables.contact_errors import Peaks
from hertzchain.observables.damped_law import DampedLaw
from hertzchain.observables.first_pulse import Signals, pulses_in
from hertzchain.observables.history import Recorder
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
    signals
        The signals, where first pulses are wanted.
    recorder
        Filled in, where a history is wanted.
    unit
        The natural unit of force.
    """

    def __init__(
        self, scene: Scene, law: DampedLaw, inverse_mass: FloatArray, signals: Signals | None,
        recorder: Recorder | None, unit: float = 1.0,
    ) -> None:  # fmt: skip
        held = times_on_held(law.stiffness.size, scene.wall is not None, scene.granules.fixed)
        self.seen = PeakWatch(law, inverse_mass, held, scene.piston is not None)
        self.recorder, self._pushed = recorder, scene.pushed
        self._inverse_mass = np.append(inverse_mass, 0.0)
        self._observer = None if signals is None else signals.watch(unit)
        self.work: Any = 0.0  # of the applied force and the piston
        self.exchanged: Any = 0.0  # the same, with all parts counted as positive

    def update(self, samples: Samples, leg: Leg, late: float) -> None:
        """Add samples on a leg; ``late`` is the delay of the velocities that damped the motion."""
        before = self.seen.piston_impulse
        self.seen.update(samples, late)
        if self._observer is not None:
            self._observe(samples, late)
        if self.recorder is not None:
            self.recorder.update(samples, self.seen.signals)
        if leg.ramp is not None:
            self._add(work_done(samples, leg.ramp, self._pushed))
        if leg.stroke is not None:
            self._add((self.seen.piston_impulse - before) * leg.stroke.velocity)

    def _observe(self, samples: Samples, late: float) -> None:
        """Look for first pulses."""
        from hertzchain.observables.intervals import observe_samples

        observe_samples(
            self._observer, *samples.of_contacts, self._inverse_mass, late
        )  # fmt: skip

    def _add(self, work: Any) -> None:
        self.work, self.exchanged = self.work + work, self.exchanged + abs(work)

    @property
    def peaks(self) -> Peaks:
        """Peaks and first pulses of the contacts."""
        seen = self.seen
        return Peaks(seen.force, seen.time, seen.passed, pulses_in(self._observer))
