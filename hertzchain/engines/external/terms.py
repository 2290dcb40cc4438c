"""Terms of a scene as codes with absolute coordinates and materials have them."""

from __future__ import annotations

from hertzchain.scene.scene import Scene

ALL_TERMS = ("unlike granules", "gaps", "striker", "wall", "precompression", "gravity")
"""All that a scene can have."""

MOST_GRANULES = 100_000
"""A deck names each of them (chosen)."""

_RIGID = 1e30
"""Young's modulus of a rigid wall over that of the last granule, for codes whose walls all have
one: what it yields is below round-off (chosen)."""


def wall_position(scene: Scene) -> float:
    """Where the wall stands, granule 1 at 0 [m]."""
    assert scene.wall is not None
    each = scene.granules
    overlap = float(each.static_overlap[-1])
    return float(each.position[-1] + each.radius[-1]) + scene.wall.gap - overlap


def wall_material(scene: Scene) -> tuple[float, float]:
    """Young's modulus [Pa] and Poisson's ratio of the wall."""
    wall, each = scene.wall, scene.granules
    assert wall is not None
    last = float(each.young_modulus[-1])
    if wall.kind == "rigid":
        return _RIGID * last, 0.0
    if wall.kind == "same":
        return last, float(each.poisson_ratio[-1])
    assert wall.young_modulus is not None
    assert wall.poisson_ratio is not None
    return wall.young_modulus, wall.poisson_ratio
