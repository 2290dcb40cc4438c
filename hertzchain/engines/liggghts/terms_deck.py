"""The commands of LIGGGHTS for a chain with terms: different granules, gaps, wall, load, damping.

LIGGGHTS gets E and nu of each material, radius and density of each granule, and positions; it
computes masses and contact stiffnesses by itself, except in viscoelastic contacts: see
``contacts``.
"""

from __future__ import annotations

import numpy as np

from hertzchain.engines.external.terms import (
    load_commands,
    refuse_long,
    wall_position,
    weighty_density,
)
from hertzchain.engines.liggghts.contacts import models, pair_commands, types_of
from hertzchain.scene.granules import Granules
from hertzchain.scene.scene import Scene


def wall_forces(scene: Scene) -> list[str]:
    """Return columns of a dump: the forces of the wall on a granule [N], whose sum is negative."""
    return [f"f_force_{name}[1]" for name, _, _ in _walls(scene)]


def granules(scene: Scene) -> list[str]:
    """Return the commands between the start of a deck and its motion: granules and contacts.

    RunFailed for a scene whose deck would be too long.
    """
    each = scene.granules
    refuse_long("a LIGGGHTS deck of", scene)
    types, kinds = types_of(scene)
    return [
        *_granules(each, kinds, len(types)),
        "# Wide enough for the nearest neighbours, too narrow for the next; looked at every step.",
        f"neighbor {float(np.min(each.radius)) / 2!r} bin",
        "neigh_modify delay 0",
        "",
        *pair_commands(types, scene.contact),
    ]


def _granules(granules: Granules, kinds: list[int], types: int) -> list[str]:
    """Return the commands for each granule at its start position: touching, apart or pressed."""
    position, radius = granules.position.tolist(), granules.radius.tolist()
    low, high, widest = position[0] - radius[0], position[-1] + radius[-1], max(radius)
    across = f"{-widest!r} {widest!r}"
    density = weighty_density(granules).tolist()
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


def held(scene: Scene) -> list[str]:
    """Return the commands for the wall, the constant forces and the striker's velocity."""
    lines = [f"group last id {scene.chain.granules}"]
    for name, model, options in _walls(scene):
        kind, place = len(types_of(scene)[0]), wall_position(scene)
        lines += [
            f"fix {name} all wall/gran model {model} tangential off store_force yes &",
            f"    primitive type {kind} xplane {place!r}{options}",
        ]
    return [*lines, *load_commands(scene)]


def _walls(scene: Scene) -> list[tuple[str, str, str]]:
    """Yield a wall for each model: name, model and options."""
    if scene.wall is None:
        return []
    names = ("wall", "wall_dashpot")
    return [(name, *model) for name, model in zip(names, models(scene.contact), strict=False)]
