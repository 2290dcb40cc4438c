"""Eq. 1 as it is written, with every term that a scene may have: the file to read first.

Granule i has the displacement u_i along the chain. Contact i lies between granules i and i + 1: in
tables and pages it has the paper's number, i + 1. A wall is the last contact, with a neighbour that
rests; a near wall is one more granule, in front, that rests. In natural units
(``scene.chain``), in which k, m and F0 of a plain chain are 1:

    overlap   d_i   = u_i - u_{i+1} - gap_i                    a static overlap is a negative gap
    force     F_i   = k_i d_i^(3/2) + c_i d_i^q d_i'           where d_i > 0, otherwise 0
    motion    u_i'' = (F_{i-1} - F_i) / m_i + constant_i       F_0 = F(t), the applied force;
    if it acts on another granule, F(t) is added there

Without attraction F_i is never below 0. Gravity and precompression are the constants. A striker is
granule 1 with a velocity at the start; any other granule may have one, too. A piston is granule 1
with 1/m = 0: it moves by its strokes. The paper's chain has k = m = 1, no gap, no damping and no
constants.

``as_written`` integrates these lines; the compiled kernels are compared with them.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.scene.scene import Scene

_NONE = np.zeros(0, np.int64)

WINDOW = 8
"""Granules with which the window of moving granules begins, and by which it grows: a whole number
of vectors."""


class Chain(NamedTuple):
    """A chain in natural units, of one floating-point precision.

    It is a tuple, so that the compiled kernels take it as it is.

    Parameters
    ----------
    stiffness
        k of each contact, shape (contacts,): one less than granules, or as many with a wall.
    inverse_mass
        1 / m of each granule, shape (granules,); 0 for a piston and fixed ones.
    gap
        Gap of each contact at the start, shape (contacts,); negative for a static overlap.
    constant
        Acceleration by gravity and precompression, shape (granules,).
    damping
        c of each contact, shape (contacts,).
    damping_exponent
        q of all contacts: 0 (dashpot), 0.25 (restitution), 0.5 (viscoelastic).
    attraction
        Whether the force of a damped contact may be negative while it overlaps.
    pushed
        Granule on which the applied force acts, counted from 0.
    fixed
        Granules that never move, counted from 0.
    """

    stiffness: FloatArray
    inverse_mass: FloatArray
    gap: FloatArray
    constant: FloatArray
    damping: FloatArray
    damping_exponent: float = 0.5
    attraction: bool = False
    pushed: int = 0
    fixed: Any = _NONE

    @classmethod
    def plain(cls, granules: int) -> Chain:
        """Return the paper's chain."""
        none, at_rest = np.zeros(granules - 1), np.zeros(granules)
        return cls(none + 1, at_rest + 1, none, at_rest, none)

    @classmethod
    def of(cls, scene: Scene) -> Chain:
        """Return the chain of a scene."""
        if scene.is_plain:
            return cls.plain(scene.chain.granules)
        granules, units, contact = scene.granules, scene.units, scene.contact
        mass_unit = units.force * units.time**2 / units.length
        damping, q = np.zeros(granules.stiffness.size), 0.5  # any q will do without damping
        if contact is not None:
            assert granules.damping is not None
            damping, q = granules.damping, contact.exponent
        stiffness, inverse_mass, gap, constant, damping = (
            np.array(values)
            for values in (
                granules.stiffness * (units.length**1.5 / units.force),
                mass_unit / granules.mass,
                (granules.gap - granules.static_overlap) / units.length,
                granules.constant_force / granules.mass * (units.time**2 / units.length),
                damping * (units.length**q * units.velocity / units.force),
            )
        )
        attraction = contact is not None and contact.attraction
        pushed, fixed = scene.pushed, granules.fixed.astype(np.int64)
        return cls(stiffness, inverse_mass, gap, constant, damping, q, attraction, pushed, fixed)

    def padded(self) -> Chain:
        """Return the chain for the kernels: with an entry for the free end, which never presses."""
        free = np.zeros(self.inverse_mass.size - self.stiffness.size)
        stiffness, gap, damping = (
            np.append(values, free) for values in (self.stiffness, self.gap, self.damping)
        )
        return self._replace(stiffness=stiffness, gap=gap, damping=damping)

    @property
    def has_wall(self) -> bool:
        """Whether the last contact is a wall's."""
        return self.stiffness.size == self.inverse_mass.size

    @property
    def is_damped(self) -> bool:
        """Whether any contact loses energy."""
        return bool(self.damping.any())

    @property
    def mass(self) -> FloatArray:
        """M of each granule, shape (granules,); 0 for a piston, which counts in no balance."""
        moves = self.inverse_mass > 0
        return np.where(moves, 1 / np.where(moves, self.inverse_mass, 1), 0)

    def closing(self, motion: FloatArray) -> FloatArray:
        """Return u_i - u_{i+1} of each contact, (..., contacts), from motions, (..., granules)."""
        between = motion[..., :-1] - motion[..., 1:]
        return np.concatenate([between, motion[..., -1:]], -1) if self.has_wall else between

    def overlap(self, displacement: FloatArray) -> FloatArray:
        """Return d_i, shape (..., contacts), of displacements, (..., granules)."""
        return self.closing(displacement) - self.gap

    def contact_force(self, overlap: FloatArray, rate: FloatArray | None) -> FloatArray:
        """Return F_i of overlaps, (..., contacts); where damped, of their rates too."""
        force = self.stiffness * hertz(overlap)
        if rate is not None:
            damper = self.damping * np.maximum(overlap, 0) ** self.damping_exponent * rate
            force = force + np.where(overlap > 0, damper, 0)
            if not self.attraction:
                force = np.maximum(force, 0)
        return force

    def moved_by(self, force: FloatArray, applied_force: FloatArray | float) -> FloatArray:
        """Return u_i'', shape (..., granules), of F_i, (..., contacts), and F(t), (...)."""
        net = net_force(force, applied_force, self.inverse_mass.size, self.pushed)
        return self.inverse_mass * net + self.constant

    def acceleration(
        self, displacement: FloatArray, applied_force: FloatArray | float, velocity: FloatArray |
        None = None,
    ) -> FloatArray:  # fmt: skip
        """Return u_i'' of a state, (..., granules); velocities are needed by damped contacts."""
        rate = None if velocity is None else self.closing(velocity)
        return self.moved_by(self.contact_force(self.overlap(displacement), rate), applied_force)

    def jerk(
        self, overlap: FloatArray, rate: FloatArray, applied_rate: FloatArray | float
    ) -> FloatArray:
        """Return u_i''' of elastic contacts, shape (..., granules); F'(t) has the shape (...)."""
        force_rate = 1.5 * self.stiffness * np.sqrt(np.maximum(overlap, 0)) * rate
        granules = self.inverse_mass.size
        return self.inverse_mass * net_force(force_rate, applied_rate, granules, self.pushed)

    def energy(self, displacement: FloatArray, velocity: FloatArray) -> Any:
        """Return the energy of motion and of the contacts of a state, without the constants."""
        overlap = np.maximum(self.overlap(displacement), 0)
        stored = 0.4 * np.sum(self.stiffness * hertz(overlap) * overlap)
        return 0.5 * np.sum(self.mass * velocity**2) + stored


def hertz(overlap: FloatArray) -> FloatArray:
    """Return d^(3/2) of each contact; 0 where granules are apart."""
    pressed = np.maximum(overlap, 0)
    return pressed * np.sqrt(pressed)


def net_force(
    force: FloatArray, applied_force: FloatArray | float, granules: int, pushed: int = 0
) -> FloatArray:
    """Return F_{i-1} - F_i, shape (..., granules), of F_i, (..., contacts), and F(t), (...)."""
    net = np.zeros((*force.shape[:-1], granules))
    net[..., pushed] = applied_force
    net[..., 1:] += force[..., : granules - 1]
    net[..., : force.shape[-1]] -= force
    return net
