"""The force law of contacts, damped or not, in any units, for the code that watches a run."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.contact import hertz
from hertzchain.observables.samples import Samples
from hertzchain.scene.natural_units import NaturalUnits
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg


@dataclass(frozen=True, eq=False)
class DampedLaw:
    """Force law F = k d^(3/2) + c d^q d' of contacts that overlap; 0 for open contacts.

    Parameters
    ----------
    stiffness, damping
        k and c of each contact, shape (contacts,).
    exponent
        q of all contacts.
    attraction
        Whether F may be negative; if not, negative values are set to 0.
    """

    stiffness: FloatArray
    damping: FloatArray
    exponent: float
    attraction: bool

    @classmethod
    def of(cls, scene: Scene) -> DampedLaw:
        """Return the law of the contacts of a scene, in SI units; elastic ones have c = 0."""
        granules, contact = scene.granules, scene.contact
        if contact is None:
            return cls.of_elastic(granules.stiffness)
        assert granules.damping is not None
        return cls(granules.stiffness, granules.damping, contact.exponent, contact.attraction)

    @classmethod
    def of_elastic(cls, stiffness: FloatArray) -> DampedLaw:
        """Return the law of elastic contacts."""
        return cls(stiffness, np.zeros_like(stiffness), 0.5, attraction=False)

    def in_units(self, units: NaturalUnits) -> DampedLaw:
        """Return the same law with all quantities in other units."""
        per_rate = units.velocity * units.length**self.exponent / units.force
        return replace(
            self,
            stiffness=self.stiffness * (units.length**1.5 / units.force),
            damping=self.damping * per_rate,
        )

    def elastic(self, overlap: FloatArray, contacts: Any = slice(None)) -> FloatArray:
        """Elastic force without damping; the last axis of the overlaps has some or all contacts."""
        return np.asarray(hertz.force_of(self.stiffness[contacts], overlap))

    @cached_property
    def is_damped(self) -> bool:
        """Whether any contact loses energy."""
        return bool(self.damping.any())

    def damper(
        self, overlap: FloatArray, rate: FloatArray, contacts: Any = slice(None)
    ) -> FloatArray:
        """Force that damping adds to the elastic force; rates have the shape of the overlaps."""
        added = self.damping[contacts] * self._power(overlap) * rate
        if self.attraction:
            return np.asarray(added)
        return np.asarray(np.maximum(added, -self.elastic(overlap, contacts)))

    def _power(self, overlap: FloatArray) -> FloatArray:
        """Powers of overlaps with the exponent of damping; 0 for open contacts."""
        pressed = np.maximum(overlap, 0.0)
        if self.exponent == 0:
            return np.where(overlap > 0, 1.0, 0.0)
        return np.sqrt(np.sqrt(pressed)) if self.exponent == 0.25 else pressed**self.exponent

    def force(
        self, overlap: FloatArray, rate: FloatArray, contacts: Any = slice(None)
    ) -> FloatArray:
        """Total force of contacts, limited to 0 where contacts do not attract."""
        return self.elastic(overlap, contacts) + self.damper(overlap, rate, contacts)

    def with_rate(
        self, force: FloatArray, overlap: FloatArray, felt: FloatArray, rate: FloatArray
    ) -> FloatArray:
        """Convert forces that a backend computed with the rate ``felt`` to the rate ``rate``.

        All arrays have the shape (samples, contacts). Velocity Verlet computes forces before it has
        the velocity of that time; codes use the velocity half a step earlier.
        """
        found = force + (self.force(overlap, rate) - self.force(overlap, felt))
        return found if self.attraction else np.maximum(found, 0.0)


def true_forces(samples: Samples, law: DampedLaw, leg: Leg) -> Samples:
    """Return samples of velocity Verlet whose forces use the velocities of the samples.

    The given samples have forces computed with the velocities half a step earlier, as in LAMMPS. At
    the start of a leg, where forces are computed again, the velocities of that time are used.
    """
    overlap, rate, growth = samples.overlap_derivatives[:3]
    late = np.where(samples.time > leg.start, leg.dt / 2, 0.0)[:, np.newaxis]
    force = law.with_rate(samples.contact_force, overlap, rate - late * growth, rate)
    return replace(samples, contact_force=force)
