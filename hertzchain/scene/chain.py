"""The chain: identical elastic spheres in a row, touching, at rest, under no load."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from numbers import Integral, Real
from typing import Any

import numpy as np

from hertzchain.errors import POSITIVE, is_finite, is_positive, require

MOST_GRANULES = 2**31 - 1
"""The ids of LAMMPS are 32-bit integers."""


@dataclass(frozen=True)
class Chain:
    """A uniform chain of spheres, in SI units.

    Parameters
    ----------
    granules
        N, from 2 to 2^31 - 1.
    radius
        R [m].
    young_modulus
        E [Pa].
    poisson_ratio
        nu, in (-1, 0.5].
    density
        rho [kg/m^3].

    Raises
    ------
    SceneError
        For a value outside what is stated above.
    """

    granules: int
    radius: float
    young_modulus: float
    poisson_ratio: float
    density: float

    def __post_init__(self) -> None:
        granules = self.granules
        is_integer = isinstance(granules, Integral) and not isinstance(granules, bool)
        allowed = f"must be an integer from 2 to {MOST_GRANULES}"
        require(is_integer and 2 <= granules <= MOST_GRANULES, "granules", granules, allowed)
        for key, unit in (("radius", "m"), ("young_modulus", "Pa"), ("density", "kg/m^3")):
            value = getattr(self, key)
            require(is_positive(value), key, value, f"{POSITIVE} [{unit}]")
        nu = self.poisson_ratio
        require(
            is_finite(nu) and -1.0 < nu <= 0.5,
            "poisson_ratio",
            nu,
            "must be a number above -1 and at most 0.5",
        )
        to_plain_numbers(self)

    @property
    def granule_mass(self) -> float:
        """Mass m = 4/3 pi R^3 rho [kg]."""
        return granule_mass(self.radius, self.density)  # type: ignore[no-any-return]

    @property
    def contact_stiffness(self) -> float:
        """A in F = A overlap^(3/2) [N m^(-3/2)]."""
        return contact_stiffness(  # type: ignore[no-any-return]
            self.radius, self.young_modulus, self.poisson_ratio
        )


def granule_mass(radius: Any, density: Any) -> Any:
    """Mass m = 4/3 pi R^3 rho [kg] of granules, numbers or arrays."""
    return 4.0 / 3.0 * math.pi * radius**3 * density


def contact_stiffness(radius: Any, young_modulus: Any, poisson_ratio: Any) -> Any:
    """A = sqrt(2R) E / (3 (1 - nu^2)) [N m^(-3/2)] (Eq. 1, corrected), of numbers or arrays.

    The scan of the paper has E under the root; Hertz's law has it outside.
    """
    root = math.sqrt if isinstance(radius, float) else np.sqrt
    return root(2.0 * radius) * (young_modulus / (3.0 * (1.0 - poisson_ratio**2)))


def to_plain_numbers(part: Any) -> None:
    """Make the numbers of a frozen object Python's own: files and decks must not know NumPy."""
    for field in fields(part):
        value = getattr(part, field.name)
        if isinstance(value, Real):
            plain = int(value) if isinstance(value, Integral) else float(value)
            object.__setattr__(part, field.name, plain)
