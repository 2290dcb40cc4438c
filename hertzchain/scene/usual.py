"""Values of a scene a thousand times off the usual ones, perhaps from a wrong unit."""

from __future__ import annotations

from typing import Any

import numpy as np

from hertzchain.scene.reading import UNITS
from hertzchain.scene.scene import Scene
from hertzchain.scene.shocks import KEYS

USUAL = {
    "radius": (1e-6, 0.5),  # grains of powder to boulders
    "young_modulus": (1e5, 2e12),  # soft gels to diamond
    "yield_strength": (1e4, 1e12),  # gels to diamond
    "density": (10.0, 3e4),  # foams to osmium
    "force": (1e-6, 1e7),
    "gravity": (1e-6, 1e4),
    "relaxation_time": (1e-12, 1.0),
    **{name: key.usual for name, key in KEYS.items() if key.usual is not None},
}
"""Ranges without a remark, in SI units; chosen: a thousand times beyond steel, glass and polymers
of 1 mm to 5 cm under 1 mN to 10 kN, or the range of real materials.
"""


def unusual_values(scene: Scene) -> list[str]:
    """Return values that may have a wrong unit, each with its key and the usual range.

    Zero is never one of them.
    """
    parts: dict[str, Any] = {
        "chain": scene.chain,
        scene.shock.section: scene.shock,
        "wall": scene.wall,
        "precompression": scene.precompression,
        "contact": scene.contact,
    }
    found = (
        unusual(f"{name}.{key}", getattr(part, key, None))
        for name, part in parts.items()
        for key in USUAL
    )
    return [remark for remark in found if remark is not None]


def unusual(name: str, values: Any) -> str | None:
    """Return the first value of a parameter that may have a wrong unit, with the usual range.

    None where there is none: zero, None and keys without a usual range are never one.
    """
    key = name.rpartition(".")[2]
    if key not in USUAL:
        return None
    low, high = USUAL[key]
    given = np.atleast_1d(np.asarray(values, np.float64))
    size = np.abs(given[given != 0])  # NaN, for None, is outside of no range
    outside = size[(size < low) | (size > high)]
    if not outside.size:
        return None
    unit = UNITS[key]
    return f"{name} = {outside[0]:g} {unit} (usually {low:g} to {high:g} {unit})"
