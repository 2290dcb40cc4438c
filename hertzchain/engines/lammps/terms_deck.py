"""The commands that make a chain with terms: unlike granules, gaps, striker, wall, static load.

LAMMPS gets E and nu of each material, radius and density of each granule, and positions; it makes
masses and contact stiffnesses by itself. Pairs of two materials are written out, as LAMMPS of 2021
and 2022 mixes them wrongly.
"""

from __future__ import annotations

import numpy as np

from hertzchain.engines.external.terms import (
    Material,
    load_commands,
    materials_of,
    refuse_long,
    wall_position,
)
from hertzchain.engines.lammps.dialect import NO_FRICTION, WALL
from hertzchain.errors import RunFailed
from hertzchain.scene.granules import Granules
from hertzchain.scene.scene import Scene
from hertzchain.scene.terms import Wall

PAIR_STYLE = "granular"
"""The only pair style that has a stiffness for each pair of materials."""


def granules(scene: Scene, pair_style: str) -> list[str]:
    """The commands between the start of a deck and its motion: granules and contacts.

    RunFailed where LAMMPS cannot have the scene, or not with this pair style.
    """
    check_pair_style(scene, pair_style)
    each = scene.granules
    refuse_long("a LAMMPS deck of", scene)
    materials, kinds = materials_of("LAMMPS", each)
    return [
        *_moduli(materials),
        "",
        *_granules(each, kinds, len(materials)),
        "",
        "pair_style granular",
        *_pairs(len(materials)),
        f"neighbor {float(np.min(each.radius)) / 2!r} bin",
    ]


def check_pair_style(scene: Scene, pair_style: str) -> None:
    """Raise RunFailed for a pair style that has not the contacts of a scene with terms."""
    if pair_style != PAIR_STYLE:
        raise RunFailed(
            f"pair style {pair_style} has one stiffness for all contacts: take {PAIR_STYLE} for a"
            f" scene with {' and '.join(scene.terms)}"
        )


def _moduli(materials: list[Material]) -> list[str]:
    lines = ["# Young's modulus [Pa] and Poisson's ratio of each material"]
    for number, (modulus, poisson) in enumerate(materials, start=1):
        lines += [
            f"variable E{number} index {modulus!r}",
            f"variable nu{number} index {poisson!r}",
        ]
    return lines


def _granules(granules: Granules, kinds: list[int], types: int) -> list[str]:
    """The granules one by one, as they lie at the start: touching, apart or pressed."""
    position, radius = granules.position.tolist(), granules.radius.tolist()
    low, high = position[0] - 2 * radius[0], position[-1] + 2 * radius[-1]
    widest = 2 * max(radius)
    lines = [
        f"region box block {low!r} {high!r} {-widest!r} {widest!r} {-widest!r} {widest!r} &",
        "    units box",
        f"create_box {types} box",
    ]
    for kind, place in zip(kinds, position, strict=True):
        lines.append(f"create_atoms {kind} single {place!r} 0.0 0.0 units box")
    lines.append("# The diameter first: the density needs it to make a mass.")
    density = granules.density.tolist()
    for number, (each, of_mass) in enumerate(zip(radius, density, strict=True), start=1):
        lines += [
            f"set atom {number} diameter {2 * each!r}",
            f"set atom {number} density {of_mass!r}",
        ]
    return lines


def _pairs(materials: int) -> list[str]:
    """Contacts of each pair: hertz takes 4/3 E*, with 1/E* the sum of (1 - nu^2) / E of both."""
    lines = []
    for i in range(1, materials + 1):
        for j in range(i, materials + 1):
            compliance = f"(1-v_nu{i}^2)/v_E{i}+(1-v_nu{j}^2)/v_E{j}"
            lines += [
                f"variable k{i}_{j} equal 4/3/({compliance})",
                f"pair_coeff {i} {j} hertz ${{k{i}_{j}}} 0.0 {NO_FRICTION}",
            ]
    return lines


def held(scene: Scene) -> list[str]:
    """The wall, forces that are always there, and the striker's velocity."""
    lines = [f"group last id {scene.chain.granules}"]
    if scene.wall is not None:
        last = materials_of("LAMMPS", scene.granules)[1][-1]
        lines += [
            f"variable k_wall equal {_wall(scene.wall, last)}",
            f"fix {WALL} last wall/gran granular hertz ${{k_wall}} 0.0 {NO_FRICTION} &",
            f"    xplane NULL {wall_position(scene)!r} contacts",
        ]
    return [*lines, *load_commands(scene)]


def _wall(wall: Wall, own: int) -> str:
    """4/3 E* of the contact with the wall, from the material of the last granule."""
    compliance = f"(1-v_nu{own}^2)/v_E{own}"
    if wall.kind == "rigid":
        return f"4/3/({compliance})"
    if wall.kind == "same":
        return f"4/3/(2*{compliance})"
    return f"4/3/({compliance}+(1-{wall.poisson_ratio!r}^2)/{wall.young_modulus!r})"
