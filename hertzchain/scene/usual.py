"""Values of a scene that are a thousand times off the usual ones, perhaps by a wrong unit."""

from __future__ import annotations

from typing import Any

import numpy as np

from hertzchain.scene.keys import keys_of
from hertzchain.scene.parts import OTHERS, key_named
from hertzchain.scene.scene import Scene


def unusual_values(scene: Scene) -> list[str]:
    """Return values that may have a wrong unit, each with its key and the usual range.

    Zero is never returned.
    """
    parts: dict[str, Any] = {"chain": scene.chain, scene.shock.section: scene.shock}
    parts |= {name: getattr(scene, name) for name in OTHERS}
    found = (
        unusual(f"{name}.{key}", getattr(part, key))
        for name, part in parts.items()
        if part is not None
        for key in keys_of(type(part))
    )
    remarks = [remark for remark in found if remark is not None]
    if scene.shock.rows and scene.ramps:  # the forces of a table are no keys
        remarks += filter(None, [unusual("shock.peak_force", scene.peak_force)])
    return remarks


def unusual(name: str, values: Any) -> str | None:
    """Return the first value of a parameter that may have a wrong unit, with the usual range.

    None where there is none: zero, None and keys without a usual range are never one.
    """
    key = key_named(name)
    if key is None or key.usual is None:
        return None
    low, high = key.usual
    given = np.atleast_1d(np.asarray(values, np.float64))
    size = np.abs(given[given != 0])  # None becomes NaN, which no range excludes
    outside = size[(size < low) | (size > high)]
    if not outside.size:
        return None
    unit = key.unit
    return f"{name} = {outside[0]:g} {unit} (usually {low:g} to {high:g} {unit})"
