"""Eq. 1 in natural units: mass, contact stiffness and largest applied force are 1."""

from __future__ import annotations

import numpy as np

from hertzchain.arrays import Array


def overlap(displacement: Array) -> Array:
    """Overlap u_i - u_{i+1} of each contact, negative where there is a gap.

    Parameters
    ----------
    displacement
        u, shape (..., granules).

    Returns
    -------
    Shape (..., granules - 1).
    """
    return displacement[..., :-1] - displacement[..., 1:]


def contact_force(overlap: Array) -> Array:
    """Hertz force in each contact, zero where the granules are apart (Eq. 1).

    Parameters
    ----------
    overlap
        Shape (..., contacts). Negative means a gap.
    """
    pressed = np.maximum(overlap, 0)
    return pressed * np.sqrt(pressed)


def net_force(contact_force: Array, applied_force: Array | float) -> Array:
    """Force on each granule: what pushes it on less what it passes on (Eq. 1).

    Parameters
    ----------
    contact_force
        Shape (..., granules - 1).
    applied_force
        F(t) on the first granule, shape (...).

    Returns
    -------
    Shape (..., granules); the acceleration too, as the mass is 1.
    """
    *times, contacts = contact_force.shape
    passed_on = np.zeros((*times, contacts + 2), contact_force.dtype)
    passed_on[..., 0] = applied_force
    passed_on[..., 1:-1] = contact_force
    return passed_on[..., :-1] - passed_on[..., 1:]


def jerk(overlap: Array, rate: Array, applied_rate: Array | float) -> Array:
    """Time derivative of Eq. 1: that of a contact force is 3/2 overlap^(1/2) rate.

    Parameters
    ----------
    overlap, rate
        Of each contact, and its rate, shape (..., contacts).
    applied_rate
        F'(t), shape (...).
    """
    return net_force(1.5 * np.sqrt(np.maximum(overlap, 0)) * rate, applied_rate)


def acceleration(displacement: Array, applied_force: float) -> Array:
    """Right-hand side of Eq. 1, shape (granules,)."""
    return net_force(contact_force(overlap(displacement)), applied_force)
