"""The commands of LIGGGHTS for a chain with terms: unlike granules, gaps, wall, static load.

LIGGGHTS gets E and nu of each material, radius and density of each granule, and positions; it makes
masses and contact stiffnesses by itself.
"""

from __future__ import annotations

import numpy as np

from hertzchain.engines.external.terms import (
    Material,
    load_commands,
    materials_of,
    refuse_long,
    wall_material,
    wall_position,
)
from hertzchain.scene.granules import Granules
from hertzchain.scene.scene import Scene

WALL_FORCE = "f_force_wall[1]"
"""A column of a dump: the force of the wall on a granule [N], which is negative."""


def granules(scene: Scene) -> list[str]:
    """The commands between the start of a deck and its motion: granules and contacts.

    RunFailed for a scene whose deck would be too long.
    """
    each = scene.granules
    refuse_long("a LIGGGHTS deck of", scene)
    materials, kinds = materials_of("LIGGGHTS", each)
    if scene.wall is not None:
        materials.append(wall_material(scene))  # a type that no granule has
    return [
        *_granules(each, kinds, len(materials)),
        "# Wide enough for the nearest neighbours, too narrow for the next; looked at every step.",
        f"neighbor {float(np.min(each.radius)) / 2!r} bin",
        "neigh_modify delay 0",
        "",
        *_contacts(materials),
    ]


def _granules(granules: Granules, kinds: list[int], types: int) -> list[str]:
    """The granules one by one, as they lie at the start: touching, apart or pressed."""
    position, radius = granules.position.tolist(), granules.radius.tolist()
    low, high, widest = position[0] - radius[0], position[-1] + radius[-1], max(radius)
    across = f"{-widest!r} {widest!r}"
    density = granules.density.tolist()
    return [
        f"region chain block {low!r} {high!r} {across} {across} units box",
        f"create_box {types} chain",
        "# One by one; granule 1 is at x = 0, where coordinates have most digits.",
        *(
            f"create_atoms {kind} single {place!r} 0.0 0.0 units box"
            for kind, place in zip(kinds, position, strict=True)
        ),
        *(
            f"set atom {number} diameter {2 * own!r} density {heavy!r}    # m, kg/m^3"
            for number, (own, heavy) in enumerate(zip(radius, density, strict=True), start=1)
        ),
    ]


def _contacts(materials: list[Material]) -> list[str]:
    """Hertz's law between all materials."""
    modulus, poisson = (" ".join(map(repr, column)) for column in zip(*materials, strict=True))
    types = len(materials)
    return [
        "# Hertz's law without damping (coefficient of restitution 1) and tangential force.",
        f"fix young_modulus all property/global youngsModulus peratomtype {modulus}",
        f"fix poisson_ratio all property/global poissonsRatio peratomtype {poisson}",
        f"fix restitution all property/global coefficientRestitution peratomtypepair {types} &",
        *(f"    {' '.join(['1.0'] * types)} &" for _ in range(types - 1)),
        f"    {' '.join(['1.0'] * types)}",
        "pair_style gran model hertz tangential off",
        "pair_coeff * *",
    ]


def held(scene: Scene) -> list[str]:
    """The wall, forces that are always there, and the striker's velocity."""
    lines = [f"group last id {scene.chain.granules}"]
    if scene.wall is not None:
        kind = len(materials_of("LIGGGHTS", scene.granules)[0]) + 1
        lines += [
            "fix wall all wall/gran model hertz tangential off store_force yes &",
            f"    primitive type {kind} xplane {wall_position(scene)!r}",
        ]
    return [*lines, *load_commands(scene)]
