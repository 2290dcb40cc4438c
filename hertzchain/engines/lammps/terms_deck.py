"""The commands for a chain with terms: different granules, moved ends, wall, loads, damping.

LAMMPS gets E and nu of each material, radius and density of each granule, and positions; it
computes masses and contact stiffnesses by itself. Pairs of two materials are written out, as LAMMPS
of 2021 and 2022 mixes them wrongly.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hertzchain.engines.external.terms import (
    MOST_MATERIALS,
    load_commands,
    materials_of,
    numbered,
    refuse_long,
    wall_position,
    weighty_density,
)
from hertzchain.engines.lammps.damped_deck import by_version, damping_of, refuse_wall
from hertzchain.engines.lammps.dialect import COEFF_RESTITUTION, NO_FRICTION, WALL
from hertzchain.errors import RunFailed
from hertzchain.scene.granules import Granules
from hertzchain.scene.scene import Scene
from hertzchain.scene.terms import Contact, Wall

PAIR_STYLE = "granular"
"""The only pair style with a stiffness for each pair of materials."""


def granules(scene: Scene, pair_style: str, version: str | None = COEFF_RESTITUTION) -> list[str]:
    """Return the commands between the start of a deck and its motion: granules and contacts.

    ``version`` is LAMMPS's, year month day, on which damping depends; None for a deck that checks
    it. RunFailed if LAMMPS, or this pair style, does not support the scene.
    """
    check_pair_style(scene, pair_style)
    each = scene.granules
    refuse_long("a LAMMPS deck of", scene)
    kinds, of_each = _kinds(scene)
    return [
        *_moduli(kinds),
        "",
        *_granules(each, of_each, len(kinds)),
        "",
        *([] if version is not None else by_version(scene)),
        "pair_style granular",
        *_pairs(kinds, scene.contact, version),
        f"neighbor {float(np.min(each.radius)) / 2!r} bin",
    ]


def check_pair_style(scene: Scene, pair_style: str) -> None:
    """Raise RunFailed for a pair style without the contacts of a scene with terms."""
    if pair_style != PAIR_STYLE:
        raise RunFailed(
            f"pair style {pair_style} has one stiffness for all contacts: take {PAIR_STYLE} for a"
            f" scene with {' and '.join(scene.terms)}"
        )


@dataclass(frozen=True)
class _Kind:
    """A type of granules; with radius [m] and density [kg/m^3] if its contacts need the mass."""

    young_modulus: float
    poisson_ratio: float
    radius: float | None = None
    density: float | None = None


def _kinds(scene: Scene) -> tuple[list[_Kind], list[int]]:
    """Return the types of granules in their order along the chain, and each granule's, from 1.

    LAMMPS's viscoelastic damping grows with m*, that of Kuwabara and Kono does not: so granules of
    different mass are of different types.
    """
    each = scene.granules
    if scene.contact is None or scene.contact.relaxation_time is None:
        materials, numbers = materials_of("LAMMPS", each)
        return [_Kind(*material) for material in materials], numbers
    density = weighty_density(each)
    columns = each.young_modulus, each.poisson_ratio, each.radius, density
    own = [_Kind(*row) for row in zip(*(column.tolist() for column in columns), strict=True)]
    kinds, numbers = numbered(own)
    if len(kinds) > MOST_MATERIALS:
        raise RunFailed(
            f"the granules are of {len(kinds)} kinds, and with viscoelastic damping a LAMMPS deck"
            f" has at most {MOST_MATERIALS}: take another damping, or native"
        )
    return kinds, numbers


def _moduli(kinds: list[_Kind]) -> list[str]:
    lines = ["# Young's modulus [Pa] and Poisson's ratio of each material"]
    for number, kind in enumerate(kinds, start=1):
        lines += [
            f"variable E{number} index {kind.young_modulus!r}",
            f"variable nu{number} index {kind.poisson_ratio!r}",
        ]
        if kind.radius is not None:
            sphere = f"4/3*PI*{kind.radius!r}^3*{kind.density!r}"
            lines.append(f"variable m{number} equal {sphere}")
    return lines


def _granules(granules: Granules, kinds: list[int], types: int) -> list[str]:
    """Return the commands for each granule at its start position: touching, apart or pressed."""
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
    density = weighty_density(granules).tolist()
    for number, (each, of_mass) in enumerate(zip(radius, density, strict=True), start=1):
        lines += [
            f"set atom {number} diameter {2 * each!r}",
            f"set atom {number} density {of_mass!r}",
        ]
    return lines


def _pairs(kinds: list[_Kind], contact: Contact | None, version: str | None) -> list[str]:
    """Yield each pair's law: hertz takes 4/3 E*, with 1/E* the sum of (1 - nu^2) / E of both."""
    lines = []
    for i in range(1, len(kinds) + 1):
        for j in range(i, len(kinds) + 1):
            k, mass = f"k{i}_{j}", f"v_m{i}*v_m{j}/(v_m{i}+v_m{j})"
            compliance = f"(1-v_nu{i}^2)/v_E{i}+(1-v_nu{j}^2)/v_E{j}"
            lines += [
                f"variable {k} equal 4/3/({compliance})",
                f"pair_coeff {i} {j} {_law(k, mass, contact, version)}",
            ]
    return lines


def _law(k: str, mass: str, contact: Contact | None, version: str | None) -> str:
    """Return the law of a pair or the wall, from the variable of 4/3 E* and the formula of m*."""
    if contact is None:
        return f"hertz ${{{k}}} 0.0 {NO_FRICTION}"
    number, words = damping_of(contact, version)
    if "{k}" in number:
        number = f"$({number.format(k=f'v_{k}', mass=mass)}:%.17g)"
    return f"hertz ${{{k}}} {number} {NO_FRICTION} {words}"


def held(scene: Scene, version: str | None = COEFF_RESTITUTION) -> list[str]:
    """Return the commands for the wall, the constant forces and the striker's velocity."""
    lines = [f"group last id {scene.chain.granules}"]
    if scene.wall is not None:
        refuse_wall(scene.contact, version)
        last = _kinds(scene)[1][-1]
        law = _law("k_wall", f"v_m{last}", scene.contact, version)
        lines += [
            f"variable k_wall equal {_wall(scene.wall, last)}",
            f"fix {WALL} last wall/gran granular {law} &",
            f"    xplane NULL {wall_position(scene)!r} contacts",
        ]
    return [*lines, *load_commands(scene)]


def _wall(wall: Wall, own: int) -> str:
    """Return 4/3 E* of the contact with the wall, from the material of the last granule."""
    compliance = f"(1-v_nu{own}^2)/v_E{own}"
    if wall.kind == "rigid":
        return f"4/3/({compliance})"
    if wall.kind == "same":
        return f"4/3/(2*{compliance})"
    return f"4/3/({compliance}+(1-{wall.poisson_ratio!r}^2)/{wall.young_modulus!r})"
