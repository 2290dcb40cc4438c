"""Eq. 1 in natural units: mass, contact stiffness and largest applied force are 1."""

from __future__ import annotations

import numpy as np

from hertzchain.arrays import Array


def overlap(displacement: Array) -> Array:
    """Overlaps u_i - u_{i+1}, (..., granules - 1), of u, (..., granules); < 0 in a gap."""
    return displacement[..., :-1] - displacement[..., 1:]


def contact_force(overlap: Array) -> Array:
    """Hertz force of each contact, shape (..., contacts); 0 where granules are apart (Eq. 1)."""
    pressed = np.maximum(overlap, 0)
    return pressed * np.sqrt(pressed)


def net_force(contact_force: Array, applied_force: Array | float) -> Array:
    """Return the net force on each granule, shape (..., granules) (Eq. 1).

    It equals the acceleration, because the mass is 1. Contact forces have the shape (..., granules
    - 1), F(t) on the first granule the shape (...).
    """
    *times, contacts = contact_force.shape
    passed_on = np.zeros((*times, contacts + 2), contact_force.dtype)
    passed_on[..., 0] = applied_force
    passed_on[..., 1:-1] = contact_force
    return passed_on[..., :-1] - passed_on[..., 1:]


def jerk(overlap: Array, rate: Array, applied_rate: Array | float) -> Array:
    """Return the time derivative of Eq. 1; that of a contact force is 3/2 overlap^(1/2) rate.

    Overlaps and their rates have the shape (..., contacts), the applied F'(t) the shape (...).
    """
    return net_force(1.5 * np.sqrt(np.maximum(overlap, 0)) * rate, applied_rate)


def acceleration(displacement: Array, applied_force: float) -> Array:
    """Return the right-hand side of Eq. 1, shape (granules,)."""
    return net_force(contact_force(overlap(displacement)), applied_force)
