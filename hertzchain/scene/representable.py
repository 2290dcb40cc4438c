"""Checks that floating point can represent the numbers of a scene."""

from __future__ import annotations

import math
import sys
from typing import Any

import numpy as np

from hertzchain.scene.granules import Granules


def are_normal(*values: float) -> bool:
    """Return whether all values are positive normal numbers, so that they lose no digits."""
    return all(sys.float_info.min <= value < math.inf for value in values)


def hold_digits(granules: Granules, force: float) -> bool:
    """Return whether granules, contacts and the overlaps under a force [N] are normal numbers.

    Infinite masses, of a piston and of fixed granules, are allowed.
    """
    mass = granules.mass[np.isfinite(granules.mass)]
    values = [
        *(granules.radius**3, mass, granules.stiffness, granules.contact_mass),
        force / granules.stiffness,
    ]
    return are_normal(*(float(edge(value)) for value in values for edge in (np.min, np.max)))


def is_representable(scene: Any) -> bool:
    """Return whether all quantities of a scene, and intermediate results, are normal numbers.

    Every divisor is checked before it is used.
    """
    force = scene.peak_force
    if scene.is_plain:
        chain = scene.chain
        mass, stiffness = chain.granule_mass, chain.contact_stiffness
        of_chain = (chain.radius**3, mass, chain.young_modulus / 3, stiffness, force)
        if not are_normal(*of_chain) or not are_normal(force / stiffness):
            return False
    elif not hold_digits(scene.granules, force):
        return False
    mass, units = scene.first_contact[1], scene.units
    of_units = (units.length, mass * units.length, units.time**2, units.velocity)
    if not are_normal(*of_units, units.momentum, units.energy):
        return False
    times = [ramp.end for ramp in scene.ramps[:1]]
    return are_normal(scene.momentum_ratio, *times, scene.end_time)
