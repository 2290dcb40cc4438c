"""Overlaps, speeds and times at which a deck is probed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from hertzchain.engines.lammps.reading.units import Units
from hertzchain.scene.scene import Scene

_READINGS = 2000
"""Readings of the applied force while the shock lasts: a force that is held over more of them is
detected, and a line between two is right to 1e-6 of a pulse."""

_CONTACT_STEPS = 50  # of a deck's time steps in a contact time where neither is known (chosen)
_SHOCK = 20.0  # contact times that a shock lasts where no scene says how long (chosen)


@dataclass(frozen=True)
class Sizes:
    """Sizes that are expected of a chain; they say where it is probed, and judge nothing.

    Without a scene they are those of a deck's own contacts: Hertz's law has no size of its own.

    Parameters
    ----------
    overlap
        Overlap of contacts [smallest radius]; by default as steel spheres of centimetres under
        100 N.
    contact_time
        Natural unit of time [s]; None: from the deck's contacts, or its step.
    shock_time
        How long forces are applied [s]; None: in proportion to the contact time.
    wall_gap
        Gap in front of a wall [m].
    """

    overlap: float = 1e-3
    contact_time: float | None = None
    shock_time: float | None = None
    wall_gap: float = 0.0

    @classmethod
    def of(cls, scene: Scene) -> Self:
        """The sizes of a scene."""
        return cls(
            overlap=scene.units.length / float(np.min(scene.granules.radius)),
            contact_time=scene.contact_time,
            shock_time=scene.pulse_end if scene.pulse_end > 0 else scene.end_time,
            wall_gap=0.0 if scene.wall is None else scene.wall.gap,
        )

    def without_contacts(self, units: Units, dt: float) -> float:
        """The contact time, in the deck's unit, where no contact of the deck tells it."""
        return _CONTACT_STEPS * dt if self.contact_time is None else self.contact_time / units.time

    def between(self, units: Units, contact_time: float) -> float:
        """Time between two readings of the applied force, in the deck's unit."""
        if self.shock_time is None or self.contact_time is None:
            return _SHOCK * contact_time / _READINGS
        if units.name == "lj":
            return self.shock_time / _READINGS * contact_time / self.contact_time
        return self.shock_time / _READINGS / units.time
