"""Samples: the state of the chain at successive times, as a simulation hands it on."""

from __future__ import annotations

from dataclasses import dataclass

from hertzchain.arrays import Array


@dataclass(frozen=True, eq=False)
class Samples:
    """States of a chain at the ends of successive intervals on one leg.

    Overlaps are given beside displacements, as a backend knows them better than their difference.
    Units are the backend's own, SI or natural.

    Parameters
    ----------
    time
        Increasing, shape (samples,).
    displacement, velocity, acceleration
        Shape (samples, granules).
    overlap
        Shape (samples, granules - 1), negative where there is a gap.
    contact_force
        Shape (samples, granules - 1).
    jerk
        Time derivative of the acceleration, shape (samples, granules), where it is known.
    """

    time: Array
    displacement: Array
    velocity: Array
    acceleration: Array
    overlap: Array
    contact_force: Array
    jerk: Array | None = None

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
