"""Checks that floating point can represent the numbers of a scene."""

from __future__ import annotations

import math
import sys

import numpy as np

from hertzchain.scene.granules import Granules


def are_normal(*values: float) -> bool:
    """Return whether all values are positive normal numbers, so that they lose no digits."""
    return all(sys.float_info.min <= value < math.inf for value in values)


def hold_digits(granules: Granules, force: float, has_piston: bool) -> bool:
    """Return whether granules, contacts and the overlaps under a force [N] are normal numbers.

    The infinite mass of a piston is allowed.
    """
    mass = granules.mass[1:] if has_piston else granules.mass
    values = [
        *(granules.radius**3, mass, granules.stiffness, granules.contact_mass),
        force / granules.stiffness,
    ]
    return are_normal(*(float(edge(value)) for value in values for edge in (np.min, np.max)))
