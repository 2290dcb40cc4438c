"""The commands of a LAMMPS deck for a scene: pure text, nothing is run here.

LAMMPS gets only E and nu of each material, radius, density and position of each granule, never the
contact stiffness or the mass computed here, so that a mistake in either shows, except for contacts
whose stiffness was measured. Plain chains are
made on a lattice, granules of other scenes one by one; pairs of two materials are written out, as
LAMMPS of 2021 and 2022 mixes them wrongly. The backend and decks that judge themselves have the
same commands.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace

import numpy as np

from hertzchain.engines.external.terms import (
    LET_GO_PISTON,
    MOST_MATERIALS,
    force_on_ramp,
    load_commands,
    materials_of,
    motion_commands,
    numbered,
    push_command,
    refuse_long,
    stroke_commands,
    wall_position,
    weighty_density,
)
from hertzchain.engines.lammps.dialect import (
    LET_GO,
    NO_FRICTION,
    PAIR_STYLES,
    WALL,
    damping_of,
    refuse_old,
)
from hertzchain.errors import RunFailed, require
from hertzchain.scene.chain import Chain
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg
from hertzchain.scene.shocks import Ramp
from hertzchain.scene.terms import Contact

START = (
    "units si",
    "atom_style sphere",
    "# The box follows the chain along x; nothing is periodic, so there are no ghosts.",
    "boundary s f f",
    "comm_modify vel yes",
)
_ANY = "granular"
"""Pair style with a law for each pair of types; the others have one law for all pairs."""


def set_up(scene: Scene, pair_style: str = "granular", version: str | None = None) -> str:
    """Return the commands that create the chain at rest; RunFailed for too old a LAMMPS."""
    if version is not None:
        refuse_old(scene, version)
    return "\n".join([*start(scene), "", *chain(scene, pair_style)]) + "\n"


def start(scene: Scene) -> tuple[str, ...]:
    """Return the commands before the granules."""
    if scene.bodies > 1:
        return START
    # A box that follows a single granule would have no length: it never gets smaller than at first.
    return tuple(line.replace(" s f f", " m f f") for line in START)


def chain(scene: Scene, pair_style: str) -> list[str]:
    """Return the commands after ``start``: granules, contacts, motion, and supports and loads."""
    refuse_pair_style(scene, pair_style)
    return [*granules(scene, pair_style), "", *motion_commands(scene), *held(scene)]


def refuse_pair_style(scene: Scene, pair_style: str) -> None:
    """Raise RunFailed for a pair style without the contacts of a scene."""
    check_pair_style(pair_style)
    if pair_style == _ANY or scene.is_plain:
        return
    several = scene.measures_contacts or scene.near_wall is not None or len(_kinds(scene)[0]) > 1
    if several or scene.contact is not None:
        raise RunFailed(
            f"pair style {pair_style} has one law for all contacts, elastic and of one material:"
            f" take {_ANY}"
        )


def check_pair_style(pair_style: str) -> None:
    """Refuse a pair style that is not in PAIR_STYLES."""
    names = ", ".join(PAIR_STYLES)
    require(pair_style in PAIR_STYLES, "pair_style", pair_style, f"must be one of {names}")


def leg_commands(scene: Scene, leg: Leg, before: Leg | None) -> list[str]:
    """Return the commands between two legs: step and force, where they change."""
    if leg.stroke is not None:
        end = [LET_GO_PISTON] if before is not None else []
        return [*end, f"timestep {leg.dt!r}", *stroke_commands(leg.stroke)]
    lines = [] if before is not None and before.dt == leg.dt else [f"timestep {leg.dt!r}"]
    pushed = before is not None and before.ramp is not None
    if leg.ramp is not None:
        lines.append(f"variable force equal {force_formula(leg.ramp)}")
        if not pushed:
            lines.append(push_command(scene))
    elif pushed:
        lines.append(LET_GO)
    return lines


def force_formula(ramp: Ramp) -> str:
    """Return the force on a ramp as a LAMMPS formula of the elapsed ``time``."""
    elapsed = f"(time-{ramp.start!r})" if ramp.start else "time"
    return force_on_ramp(ramp, f"{elapsed}/{ramp.end - ramp.start!r}")


def granules(scene: Scene, pair_style: str) -> list[str]:
    """Return the commands between the start of a deck and its motion: granules and contacts."""
    chain = scene.chain
    if scene.is_plain:  # which may have so many granules that a list of them is too long
        kinds, radius = [_Kind(chain.young_modulus, chain.poisson_ratio)], chain.radius
        atoms, law = _lattice(chain), list(PAIR_STYLES[pair_style])
    else:
        kinds, of_each = _kinds(scene)
        radius = float(np.min(scene.granules.radius))
        atoms = _one_by_one(scene, of_each, len(kinds))
        law = list(PAIR_STYLES[pair_style])
        if pair_style == _ANY:
            law = [f"pair_style {_ANY}", *_pairs(kinds, scene, of_each[:2])]
    return [
        *_moduli(kinds),
        "",
        *atoms,
        "",
        *law,
        "# Wide enough for the nearest neighbours, too narrow for the next.",
        f"neighbor {radius / 2!r} bin",
    ]


@dataclass(frozen=True)
class _Kind:
    """A type of granules; with radius [m] and density [kg/m^3] if its contacts need the mass.

    Where contacts were measured, ``bonds`` has A / sqrt(R*) of the contacts behind and ahead [Pa],
    and the granule's place modulo 3: so a pair of types is one contact.
    """

    young_modulus: float
    poisson_ratio: float
    radius: float | None = None
    density: float | None = None
    bonds: tuple[float, float, int] | None = None


def _kinds(scene: Scene) -> tuple[list[_Kind], list[int]]:
    """Return the types of granules along the chain, and each granule's, from 1: see ``_alike``."""
    kinds, numbers = _alike(scene)
    # Only the contact of the near wall's granule has the stiffness of a plane.
    if scene.near_wall is not None and numbers[0] in numbers[1:]:
        return [*kinds, kinds[numbers[0] - 1]], [len(kinds) + 1, *numbers[1:]]
    return kinds, numbers


def _alike(scene: Scene) -> tuple[list[_Kind], list[int]]:
    """Return the types of granules of the same kind, and each granule's, from 1.

    LAMMPS's viscoelastic damping grows with m*, that of Kuwabara and Kono does not: so granules of
    different mass are of different types.
    """
    each = scene.granules
    has_mass = scene.contact is not None and scene.contact.damping == "viscoelastic"
    if not has_mass and not scene.measures_contacts:
        materials, numbers = materials_of("LAMMPS", each)
        return [_Kind(*material) for material in materials], numbers
    density = weighty_density(each)
    columns = each.young_modulus, each.poisson_ratio, each.radius, density
    of_each = [_Kind(*row) for row in zip(*(column.tolist() for column in columns), strict=True)]
    if scene.measures_contacts:
        bonds = [0.0, *_bonds(scene), 0.0]
        turns = 3 if len({*bonds[1:-1]}) > 1 else 1
        of_each = [
            replace(kind, bonds=(bonds[k], bonds[k + 1], k % turns)) if has_mass
            else _Kind(1.0, 0.0, bonds=(bonds[k], bonds[k + 1], k % turns))
            for k, kind in enumerate(of_each)
        ]  # fmt: skip
    kinds, numbers = numbered(of_each)
    if len(kinds) > MOST_MATERIALS:
        raise RunFailed(
            f"the granules are of {len(kinds)} kinds, and with viscoelastic damping or measured"
            f" contacts a LAMMPS deck has at most {MOST_MATERIALS}: take native"
        )
    return kinds, numbers


def _bonds(scene: Scene) -> list[float]:
    """Return A / sqrt(R*) of the contacts between bodies [Pa], which LAMMPS calls 4/3 E*."""
    each = scene.granules
    reduced = each.radius[:-1] * each.radius[1:] / (each.radius[:-1] + each.radius[1:])
    bonds: list[float] = (each.stiffness[: reduced.size] / np.sqrt(reduced)).tolist()
    return bonds


def _moduli(kinds: list[_Kind]) -> list[str]:
    lines = ["# Young's modulus [Pa] and Poisson's ratio of each material"]
    if kinds[0].bonds is not None:
        lines = ["# The stiffness of each contact was measured: there is no Young's modulus."]
    for number, kind in enumerate(kinds, start=1):
        if kind.bonds is None:
            lines += [
                f"variable E{number} index {kind.young_modulus!r}",
                f"variable nu{number} index {kind.poisson_ratio!r}",
            ]
        if kind.radius is not None:
            sphere = f"4/3*PI*{kind.radius!r}^3*{kind.density!r}"
            lines.append(f"variable m{number} equal {sphere}")
    return lines


def _lattice(chain: Chain) -> list[str]:
    """Return the commands that make alike granules that touch."""
    return [
        "# Sites a diameter apart; granule 1 is at x = 0, where coordinates have most digits.",
        f"lattice sc {2 * chain.radius!r}",
        f"region chain block -0.5 {chain.granules - 0.5!r} -0.5 0.5 -0.5 0.5",
        "create_box 1 chain",
        "# In the region: the box is 1e-4 longer at both ends, which may hold more granules.",
        "create_atoms 1 region chain",
        *_spheres([(chain.radius, chain.density, chain.granules)]),
    ]


def _one_by_one(scene: Scene, kinds: list[int], types: int) -> list[str]:
    """Return the commands that make each granule at its start: touching, apart or pressed."""
    refuse_long("a LAMMPS deck of", scene)
    each = scene.granules
    position, radius = each.position.tolist(), each.radius.tolist()
    low, high = position[0] - 2 * radius[0], position[-1] + 2 * radius[-1]
    across = f"{-2 * max(radius)!r} {2 * max(radius)!r}"
    spheres = itertools.groupby(zip(radius, weighty_density(each).tolist(), strict=True))
    return [
        f"region box block {low!r} {high!r} {across} {across} &",
        "    units box",
        f"create_box {types} box",
        *(
            f"create_atoms {kind} single {place!r} 0.0 0.0 units box"
            for kind, place in zip(kinds, position, strict=True)
        ),
        *_spheres([(*sphere, len(list(alike))) for sphere, alike in spheres]),
    ]


def _spheres(groups: list[tuple[float, float, int]]) -> list[str]:
    """Return the commands for radius, density and number of each group of granules."""
    lines, last = ["# The diameter first: the density needs it to make a mass."], 0
    for radius, density, count in groups:
        first, last = last + 1, last + count
        atoms = f"set atom {first}*{last}" if count > 1 else f"set atom {last}"
        lines += [f"{atoms} diameter {2 * radius!r}", f"{atoms} density {density!r}"]
    return lines


def _pairs(kinds: list[_Kind], scene: Scene, first: list[int]) -> list[str]:
    """Yield each pair's law: hertz takes 4/3 E*, with 1/E* the sum of (1 - nu^2) / E of both.

    ``first`` are the types of the first two granules. Where the first stands for a near wall, their
    4/3 E* is sqrt(2) times as large: R* is half the R of a sphere on a plane.
    """
    lines, near = [], scene.near_wall
    bonds = {}
    if scene.measures_contacts:
        numbers = _kinds(scene)[1]
        pairs = itertools.pairwise(numbers)
        bonds = dict(zip(map(frozenset, pairs), _bonds(scene), strict=True))
        lines = ["# A / sqrt(R*) of each pair of neighbours; the others never touch."]
    for i in range(1, len(kinds) + 1):
        for j in range(i, len(kinds) + 1):
            k, mass = f"k{i}_{j}", f"v_m{i}*v_m{j}/(v_m{i}+v_m{j})"
            modulus = f"4/3/((1-v_nu{i}^2)/v_E{i}+(1-v_nu{j}^2)/v_E{j})"
            plane, contact = "", scene.contact
            if near is not None and {i, j} == set(first):
                plane = "" if bonds else "sqrt(2)*"
                lines.append("# Fixed granule 1 stands for the near wall: a plane's stiffness.")
                if contact is not None and near.own_damping:
                    contact = contact.at(near)
            if scene.measures_contacts:
                modulus = repr(bonds.get(frozenset((i, j)), max(bonds.values(), default=1.0)))
            lines += [
                f"variable {k} equal {plane}{modulus}",
                f"pair_coeff {i} {j} {_law(k, mass, contact)}",
            ]
    return lines


def _law(k: str, mass: str, contact: Contact | None) -> str:
    """Return the law of a pair or the wall, from the variable of 4/3 E* and the formula of m*."""
    if contact is None:
        return f"hertz ${{{k}}} 0.0 {NO_FRICTION}"
    number, words = damping_of(contact)
    if "{k}" in number:
        number = f"$({number.format(k=f'v_{k}', mass=mass)}:%.17g)"
    return f"hertz ${{{k}}} {number} {NO_FRICTION} {words}"


def held(scene: Scene) -> list[str]:
    """Return the commands for the wall, the constant forces and the striker's velocity."""
    loaded = scene.wall is not None or scene.precompression is not None
    lines = [f"group last id {scene.bodies}"] if loaded else []
    if scene.wall is not None:
        last = _kinds(scene)[1][-1]
        contact = scene.contact
        if contact is not None and scene.wall.own_damping:
            contact = contact.at(scene.wall)
        law = _law("k_wall", f"v_m{last}", contact)
        lines += [
            f"variable k_wall equal {_wall(scene, last)}",
            f"fix {WALL} last wall/gran granular {law} &",
            f"    xplane NULL {wall_position(scene)!r} contacts",
        ]
    return [*lines, *load_commands(scene)]


def _wall(scene: Scene, last: int) -> str:
    """Return 4/3 E* of the contact with the wall, from the material of the last granule."""
    wall, each = scene.wall, scene.granules
    assert wall is not None
    if scene.measures_contacts:
        return repr(float(each.stiffness[-1]) / math.sqrt(float(each.radius[-1])))
    compliance = f"(1-v_nu{last}^2)/v_E{last}"
    if wall.kind == "rigid":
        return f"4/3/({compliance})"
    if wall.kind == "same":
        return f"4/3/(2*{compliance})"
    return f"4/3/({compliance}+(1-{wall.poisson_ratio!r}^2)/{wall.young_modulus!r})"
