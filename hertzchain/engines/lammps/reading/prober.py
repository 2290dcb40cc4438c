"""Puts granules somewhere and reads what acts on them then, before a deck runs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.reading.granules import Granules, granules_of
from hertzchain.engines.lammps.reading.hooks import Readings
from hertzchain.engines.lammps.reading.player import Stage
from hertzchain.engines.lammps.reading.session import Session

DEPTHS = (-0.1, 0.01, 0.1, 0.3, 1.0, 3.0)
"""Overlaps that are tried, over that of the scene's natural unit of length.

Chosen: peaks are between 0.01 and 5 of the largest applied force, so that overlaps are up to 3; the
first is a gap."""

DAMPED = (
    (1.0, 0.5), (1.0, -0.5), (0.1, 0.5), (0.1, -0.5), (1.0, 0.05), (1.0, -0.05), (0.01, -1.0),
)  # fmt: skip
"""Overlaps, as above, and closing speeds over the scene's natural unit of velocity.

In the last, granules part so fast that any damping pulls, unless it is limited."""

SPIN_STEP = 0.05
"""Step with which friction gets a memory, over the contact time: chosen, short."""


class Prober:
    """Puts granules somewhere and reads what acts on them then."""

    def __init__(self, stage: Stage) -> None:
        self.stage, self.lammps = stage, stage.lammps
        self.granules = granules_of(stage.lammps, stage.boundary)

    def ask(
        self, place: FloatArray, velocity: FloatArray, spin: FloatArray, steps: int = 0
    ) -> tuple[Readings, FloatArray]:
        """Forces on granules at places, with velocities and spins, shape (granules, 3) each.

        All in the order and along the axes of the chain. Also the places as LAMMPS has them.
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
        """Forces of all fixes that are walls, or of all others, shape (granules, 3)."""
        fixes = self.stage.fixes
        total = np.zeros((self.granules.count, 3))
        for source, force in zip(self.stage.hooks.sources[1:], seen.of_fixes[-1], strict=True):
            assert source is not None
            if fixes[source].is_wall == walls:
                total += self.granules.along(force)
        return total


def members(lammps: Session, group: str, granules: Granules) -> NDArray[np.bool_]:
    """Which granules are in a group now, by increasing coordinate, shape (granules,)."""
    return np.asarray(lammps.members(group)[granules.order])
