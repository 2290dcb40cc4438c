"""Moves granules and reads the forces on them; the places follow from the sizes of the chain."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.reading.granules import Granules, granules_of
from hertzchain.engines.lammps.reading.hooks import Readings
from hertzchain.engines.lammps.reading.session import DeckFix, Session, Stage
from hertzchain.engines.lammps.reading.units import Units
from hertzchain.scene.scene import Scene

_READINGS = 2000
"""Readings of the applied force while the shock lasts: a force that is held over more of them is
detected, and a line between two is right to 1e-6 of a pulse."""

_CONTACT_STEPS = 50  # time steps of a deck in a contact time, where that is unknown (chosen)
_SHOCK = 20.0  # duration of a shock in contact times, without a scene (chosen)

DEPTHS = (-0.1, 0.01, 0.1, 0.3, 1.0, 3.0)
"""Overlaps that are tried, over that of the scene's natural unit of length.

Chosen: peaks are between 0.01 and 5 of the largest applied force, so that overlaps are up to 3; the
first is a gap."""

DAMPED = (
    (1.0, 0.5), (1.0, -0.5), (0.1, 0.5), (0.1, -0.5), (1.0, 0.05), (1.0, -0.05), (0.01, -1.0),
)  # fmt: skip
"""Overlaps, as above, and closing speeds over the scene's natural unit of velocity.

In the last, granules part so fast that any damping pulls unless it is limited."""

SPIN_STEP = 0.05
"""Time step over the contact time, to build up history-dependent friction: chosen, short."""


@dataclass(frozen=True)
class Sizes:
    """Expected sizes of a chain, which set where it is probed; they are not used to judge it.

    Without a scene they follow from the deck's own contacts, as Hertz's law has no length scale.
    """

    overlap: float = 1e-3  # of contacts [smallest radius]; of steel in centimetres under 100 N
    contact_time: float | None = None  # natural unit [s]; None: from the contacts, or the step
    shock_time: float | None = None  # that forces are applied [s]; None: as the contact time
    wall_gap: float = 0.0  # in front of a wall [m]

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
        """The contact time, in the deck's unit, where no contact of the deck gives it."""
        return _CONTACT_STEPS * dt if self.contact_time is None else self.contact_time / units.time

    def between(self, units: Units, contact_time: float) -> float:
        """Time between two readings of the applied force, in the deck's unit."""
        if self.shock_time is None or self.contact_time is None:
            return _SHOCK * contact_time / _READINGS
        if units.name == "lj":
            return self.shock_time / _READINGS * contact_time / self.contact_time
        return self.shock_time / _READINGS / units.time


class Prober:
    """Moves granules to given places and reads the forces on them there."""

    def __init__(self, stage: Stage) -> None:
        self.stage, self.lammps = stage, stage.lammps
        self.granules = granules_of(stage.lammps)

    def ask(
        self, place: FloatArray, velocity: FloatArray, spin: FloatArray, steps: int = 0
    ) -> tuple[Readings, FloatArray]:
        """Return forces on granules at places, with velocities and spins, shape (granules, 3) each.

        All are in the order and along the axes of the chain. Also returns the places as LAMMPS has
        them.
        """
        self.lammps.put(
            {
                name: self.granules.by_id(values)
                for name, values in (("x", place), ("v", velocity), ("omega", spin))
            }
        )
        found: list[Readings] = []
        self.stage.hooks.run(f"run {steps} post no", steps, max(steps, 1), found.append)
        seen = found[-1]
        where = self.granules.moved_from(self.granules.along(seen.position[-1]))
        return seen, where

    def of_pairs(self, seen: Readings) -> FloatArray:
        """Forces of contacts, shape (granules, 3)."""
        return self.granules.along(seen.of_pairs[-1])

    def of_fixes(self, seen: Readings, walls: bool) -> FloatArray:
        """Forces of all fixes that are walls, or of all other fixes, shape (granules, 3)."""
        total = np.zeros((self.granules.count, 3))
        for fix, force in by_fix(self.stage, seen, self.granules):
            if fix.is_wall == walls:
                total += force[-1]
        return total


def by_fix(
    stage: Stage, seen: Readings, granules: Granules
) -> Iterator[tuple[DeckFix, FloatArray]]:
    """Force of each fix, in the order and along the axes of the chain, (readings, granules, 3)."""
    forces = np.moveaxis(seen.of_fixes, 1, 0)
    for source, force in zip(stage.hooks.sources[1:], forces, strict=True):
        assert source is not None
        yield stage.fixes[source], granules.along(force)


def members(lammps: Session, group: str, granules: Granules) -> NDArray[np.bool_]:
    """Tell which granules are in a group now, by increasing coordinate, shape (granules,)."""
    return np.asarray(lammps.members(group)[granules.order])
