"""Samples: the state of the chain at successive times, as a simulation returns it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hertzchain.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class Samples:
    """States of a chain at the ends of successive intervals on one leg, in the backend's own units.

    Overlaps are stored, because a backend knows them to more digits than differences of
    displacements.
    """

    time: FloatArray  # increasing, shape (samples,)
    displacement: FloatArray  # shape (samples, granules), as velocity and acceleration
    velocity: FloatArray
    acceleration: FloatArray
    overlap: FloatArray  # shape (samples, contacts), negative where there is a gap
    contact_force: FloatArray  # shape (samples, contacts); with a wall its contact is the last
    jerk: FloatArray | None = None  # rate of the acceleration, as it, where known

    @property
    def granule_derivatives(self) -> tuple[FloatArray, ...]:
        """Displacement and its time derivatives, as many as are known."""
        known = (self.displacement, self.velocity, self.acceleration)
        return known if self.jerk is None else (*known, self.jerk)

    @property
    def overlap_derivatives(self) -> tuple[FloatArray, ...]:
        """Overlap and its time derivatives, as many as are known."""
        contacts = self.overlap.shape[1]
        return (self.overlap, *(closing(d, contacts) for d in self.granule_derivatives[1:]))

    @cached_property
    def of_contacts(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Times, overlaps and three derivatives, (4, samples, contacts), and forces: for kernels.

        Derivatives that are not known are NaN.
        """
        force = np.ascontiguousarray(self.contact_force)
        return self.time, _of_four(self.overlap_derivatives), force

    def of_granules(self, which: slice = slice(None)) -> tuple[FloatArray, FloatArray]:
        """Times, displacements and three derivatives of some granules, (4, samples, granules)."""
        return self.time, _of_four([values[:, which] for values in self.granule_derivatives])


def _of_four(known: Sequence[FloatArray]) -> FloatArray:
    return np.array([*known, np.full_like(known[0], np.nan)][:4])


def closing(values: FloatArray, contacts: int) -> FloatArray:
    """Return the changes of overlaps from the motions of granules, shape (samples, contacts).

    The motions have the shape (samples, granules). If there are as many contacts as granules, the
    last contact is that with a wall, which does not move.
    """
    between = values[:, :-1] - values[:, 1:]
    if contacts == between.shape[1]:
        return between
    return np.concatenate([between, values[:, -1:]], axis=1)
