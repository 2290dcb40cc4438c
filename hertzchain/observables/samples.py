"""Samples: the state of the chain at successive times, as a simulation returns it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hertzchain.arrays import Array


@dataclass(frozen=True, eq=False)
class Samples:
    """States of a chain at the ends of successive intervals on one leg, in the backend's own units.

    Overlaps are stored, because a backend knows them to more digits than differences of
    displacements.
    """

    time: Array  # increasing, shape (samples,)
    displacement: Array  # shape (samples, granules), as velocity and acceleration
    velocity: Array
    acceleration: Array
    overlap: Array  # shape (samples, contacts), negative where there is a gap
    contact_force: Array  # shape (samples, contacts); with a wall its contact is the last
    jerk: Array | None = None  # rate of the acceleration, shape (samples, granules), where known

    @property
    def granule_derivatives(self) -> tuple[Array, ...]:
        """Displacement and its time derivatives, as many as are known."""
        known = (self.displacement, self.velocity, self.acceleration)
        return known if self.jerk is None else (*known, self.jerk)

    @property
    def overlap_derivatives(self) -> tuple[Array, ...]:
        """Overlap and its time derivatives, as many as are known."""
        contacts = self.overlap.shape[1]
        return (self.overlap, *(closing(d, contacts) for d in self.granule_derivatives[1:]))


def closing(values: Array, contacts: int) -> Array:
    """Return the changes of overlaps from the motions of granules, shape (samples, contacts).

    The motions have the shape (samples, granules). If there are as many contacts as granules, the
    last contact is that with a wall, which does not move.
    """
    between = values[:, :-1] - values[:, 1:]
    if contacts == between.shape[1]:
        return between
    return np.concatenate([between, values[:, -1:]], axis=1)
