"""Whether floating point can hold the numbers that a scene is computed with."""

from __future__ import annotations

import math
import sys

import numpy as np

from hertzchain.scene.granules import Granules


def are_normal(*values: float) -> bool:
    """Whether all values are positive and normal: no digit is lost in them."""
    return all(sys.float_info.min <= value < math.inf for value in values)


def hold_digits(granules: Granules, force: float, has_piston: bool) -> bool:
    """Whether granules and contacts, and the overlaps under a force [N], are normal numbers.

    The mass of a piston is infinite.
    """
    mass = granules.mass[1:] if has_piston else granules.mass
    values = [
        *(granules.radius**3, mass, granules.stiffness, granules.contact_mass),
        force / granules.stiffness,
    ]
    return are_normal(*(float(edge(value)) for value in values for edge in (np.min, np.max)))
