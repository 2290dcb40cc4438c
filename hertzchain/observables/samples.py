"""Samples: the state of the chain at successive times, as a simulation hands it on."""

from __future__ import annotations

from dataclasses import dataclass

from hertzchain.arrays import Array


@dataclass(frozen=True, eq=False)
class Samples:
    """States of a chain at the ends of successive intervals on one leg, in the backend's own units.

    Overlaps are given, as a backend knows them better than the differences of displacements.
    """

    time: Array  # increasing, shape (samples,)
    displacement: Array  # shape (samples, granules), as velocity and acceleration
    velocity: Array
    acceleration: Array
    overlap: Array  # shape (samples, granules - 1), negative where there is a gap
    contact_force: Array  # shape (samples, granules - 1)
    jerk: Array | None = None  # rate of the acceleration, shape (samples, granules), where known

    @property
    def granule_derivatives(self) -> tuple[Array, ...]:
        """Displacement and its time derivatives, as many as are known."""
        known = (self.displacement, self.velocity, self.acceleration)
        return known if self.jerk is None else (*known, self.jerk)

    @property
    def overlap_derivatives(self) -> tuple[Array, ...]:
        """Overlap and its time derivatives, as many as are known."""
        rates = (values[:, :-1] - values[:, 1:] for values in self.granule_derivatives[1:])
        return (self.overlap, *rates)
