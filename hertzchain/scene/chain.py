"""The chain: elastic spheres in a row, alike or not, touching or with gaps."""

from __future__ import annotations

import functools
import math
import reprlib
from collections.abc import Mapping
from dataclasses import dataclass, fields
from numbers import Integral, Real
from typing import Any

import numpy as np

from hertzchain.contact import hertz
from hertzchain.errors import POSITIVE, is_finite, is_positive, require

MOST_UNLIKE = 1_000_000
"""Largest number of granules in a scene with terms, which stores a dozen numbers for each (chosen).
"""

MOST_GRANULES = 2**31 - 1
"""Largest number of granules: LAMMPS's ids are 32-bit integers."""


PerGranule = Any
"""One number for all granules, or a sequence with one for each (kept as a tuple)."""

_POSITIVE_KEYS = {
    "radius": "m", "young_modulus": "Pa", "density": "kg/m^3", "yield_strength": "Pa",
}  # fmt: skip

MATERIAL = ("radius", "young_modulus", "poisson_ratio", "density")
"""Names of the properties of a granule."""


@dataclass(frozen=True, repr=False)
class Chain:
    """A row of spheres, in SI units.

    Except ``granules`` each is a number, or a sequence of N numbers where granules differ.

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
    gap
        Gap in front of each granule at the start, at least 0 [m]; the first granule has none.
    yield_strength
        Yield strength Y in tension [Pa], for a warning; None where it is unknown.

    Raises
    ------
    SceneError
        For a value outside what is stated above.
    """

    granules: int
    radius: PerGranule
    young_modulus: PerGranule
    poisson_ratio: PerGranule
    density: PerGranule
    gap: PerGranule = 0.0
    yield_strength: PerGranule | None = None

    def __post_init__(self) -> None:
        granules = self.granules
        is_integer = isinstance(granules, Integral) and not isinstance(granules, bool)
        allowed = f"must be an integer from 2 to {MOST_GRANULES}"
        require(is_integer and 2 <= granules <= MOST_GRANULES, "granules", granules, allowed)
        for key in (*MATERIAL, "gap", "yield_strength"):
            value = getattr(self, key)
            if isinstance(value, np.ndarray) and value.ndim == 0:
                value = value.item()
                object.__setattr__(self, key, value)
            if isinstance(value, list | tuple | np.ndarray):
                object.__setattr__(self, key, _for_each(key, value, granules))
            elif not (key == "yield_strength" and value is None):
                _check(key, value)
        to_plain_numbers(self)

    def __repr__(self) -> str:
        return short_repr(self)

    @property
    def section(self) -> Mapping[str, Any] | None:
        """The section [chain] with its segments, in SI; None if the scene file has no segments.

        A copy with other values, by ``dataclasses.replace``, has no section.
        """
        found: Mapping[str, Any] | None = self.__dict__.get("_section")
        return found

    @property
    def first_modulus(self) -> float:
        """E of granule 1 [Pa]."""
        modulus = self.young_modulus
        return float(modulus[0] if isinstance(modulus, tuple) else modulus)

    def _require_uniform(self, what: str) -> None:
        unlike = any(isinstance(getattr(self, key), tuple) for key in MATERIAL)
        allowed = "is a single number only in a chain of like granules: see Scene.granules"
        require(not unlike, what, None, allowed)

    @functools.cached_property
    def granule_mass(self) -> float:
        """Mass m = 4/3 pi R^3 rho of each granule of a uniform chain [kg]."""
        self._require_uniform("granule_mass")
        return granule_mass(self.radius, self.density)  # type: ignore[no-any-return]

    @functools.cached_property
    def contact_stiffness(self) -> float:
        """A in F = A overlap^(3/2) of a uniform chain [N m^(-3/2)]."""
        self._require_uniform("contact_stiffness")
        return hertz.stiffness_of_equals(  # type: ignore[no-any-return]
            self.radius, self.young_modulus, self.poisson_ratio
        )


def _for_each(key: str, values: Any, granules: int) -> Any:
    """Return one checked number for each granule, or the number itself where all are the same."""
    values = values.tolist() if isinstance(values, np.ndarray) else list(values)
    allowed = f"must be a number, or {granules} numbers, one for each granule"
    require(len(values) == granules, f"number of values of {key}", len(values), allowed)
    for number, value in enumerate(values, start=1):
        _check(key, value, f" of granule {number}")
    if key == "gap":
        values[0] = 0.0  # the first granule has no gap before it
    if len(set(values)) == 1:
        return float(values[0])
    return tuple(float(value) for value in values)


def _check(key: str, value: object, of: str = "") -> None:
    """Raise a SceneError for a value that is impossible for a granule."""
    if key in _POSITIVE_KEYS:
        unit = _POSITIVE_KEYS[key]
        require(is_positive(value), f"{key}{of}", value, f"{POSITIVE} [{unit}]")
    elif key == "gap":
        possible = is_finite(value) and value >= 0  # type: ignore[operator]
        require(possible, f"{key}{of}", value, "must be a finite number of at least 0 [m]")
    else:
        possible = is_finite(value) and -1.0 < value <= 0.5  # type: ignore[operator]
        allowed = "must be a number above -1 and at most 0.5"
        require(possible, f"{key}{of}", value, allowed)


def check_material(part: Any, optional: bool = False) -> None:
    """Raise a SceneError for an impossible material; optional values may be None."""
    for key in (*MATERIAL, "yield_strength"):
        value = getattr(part, key, None)
        if value is not None or not (optional or key == "yield_strength"):
            _check(key, value)


def granule_mass(radius: Any, density: Any) -> Any:
    """Mass m = 4/3 pi R^3 rho [kg] of granules, numbers or arrays."""
    return 4.0 / 3.0 * math.pi * radius**3 * density


def to_plain_numbers(part: Any) -> None:
    """Convert the numbers of a frozen object to Python's own, as files and decks show them."""
    for field in fields(part):
        value = getattr(part, field.name)
        if isinstance(value, Real) and not isinstance(value, bool):
            plain = int(value) if isinstance(value, Integral) else float(value)
            object.__setattr__(part, field.name, plain)


def short_repr(part: Any) -> str:
    """The repr of a frozen object, in which of long tuples only the first six values stand."""
    values = (f"{one.name}={reprlib.repr(getattr(part, one.name))}" for one in fields(part))
    return f"{type(part).__name__}({', '.join(values)})"
