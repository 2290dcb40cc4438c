"""The commands of the LAMMPS backend for a scene: pure text, nothing is run here.

LAMMPS gets only E and nu of each material, radius, density and position of each granule, never the
contact stiffness or the mass computed here, so that a mistake in either shows. Alike granules that
touch are made in a group, others one by one; pairs of two materials are written out, as LAMMPS of
2021 and 2022 mixes them wrongly. Decks that judge themselves use the same pieces.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hertzchain.engines.external.terms import (
    LET_GO_PISTON,
    MOST_MATERIALS,
    PISTON_MOTION,
    load_commands,
    materials_of,
    numbered,
    refuse_long,
    stroke_commands,
    wall_position,
    weighty_density,
)
from hertzchain.engines.lammps.damped_deck import by_version, damping_of, refuse_wall
from hertzchain.engines.lammps.dialect import (
    COEFF_RESTITUTION,
    DEFAULT_SKIN,
    LET_GO,
    NO_FRICTION,
    PAIR_STYLES,
    PUSH,
    WALL,
)
from hertzchain.errors import RunFailed, require
from hertzchain.scene.chain import Chain
from hertzchain.scene.granules import Granules
from hertzchain.scene.ramp import SHAPES, Ramp
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg
from hertzchain.scene.terms import Contact, Wall

START = (
    "units si",
    "atom_style sphere",
    "# The box follows the chain along x; nothing is periodic, so there are no ghosts.",
    "boundary s f f",
    "comm_modify vel yes",
)

GRANULES = (
    "# Sites one diameter apart; granule 1 is at x = 0, where coordinates have most digits.",
    "lattice sc $(2*v_radius)",
    "region chain block -0.5 $(v_granules-0.5) -0.5 0.5 -0.5 0.5",
    "create_box 1 chain",
    "# In the region: the box is longer by 1e-4 at both ends, which may hold more granules.",
    "create_atoms 1 region chain",
    "# The diameter first: the density needs it to make a mass.",
    "set group all diameter $(2*v_radius)",
    "set group all density ${density}",
)

SKIN = (
    "# Wide enough for the nearest neighbours, too narrow for the next.",
    "neighbor $(v_radius/2) bin",
)

MOTION = (
    "# In one dimension granules do not spin: fix nve is enough.",
    "fix motion all nve",
    "group first id 1",
)


_WITH_TERMS = "granular"
"""The only pair style with a stiffness for each pair of materials."""


def set_up(scene: Scene, pair_style: str = "granular", version: str = COEFF_RESTITUTION) -> str:
    """Return the commands that create the chain at rest, with one of ``PAIR_STYLES``.

    ``version`` is the LAMMPS's, year month day; damping depends on it.
    """
    check_pair_style(pair_style)
    if scene.is_plain:
        law = [*PAIR_STYLES[pair_style], *_neighbour_skin(scene.chain.radius)]
        made, fixed = [*parameters(scene.chain), "", *GRANULES, "", *law], []
    else:
        made, fixed = granules(scene, pair_style, version), held(scene, version)
    motion = MOTION if scene.piston is None else PISTON_MOTION
    return "\n".join([*START, "", *made, "", *motion, *fixed]) + "\n"


def check_pair_style(pair_style: str) -> None:
    """Refuse a pair style that is not in PAIR_STYLES."""
    names = ", ".join(PAIR_STYLES)
    require(pair_style in PAIR_STYLES, "pair_style", pair_style, f"must be one of {names}")


def parameters(chain: Chain) -> list[str]:
    """Return the granules as variables that ``-var`` overrides."""
    return [
        f"variable granules index {chain.granules}",
        f"variable radius index {chain.radius!r}              # m",
        f"variable young_modulus index {chain.young_modulus!r}    # Pa",
        f"variable poisson_ratio index {chain.poisson_ratio!r}",
        f"variable density index {chain.density!r}            # kg/m^3",
    ]


def _neighbour_skin(radius: float) -> list[str]:
    """Command for LAMMPS's neighbour skin, where the default does not suit the granules."""
    if radius / 100 <= DEFAULT_SKIN["si"] <= radius:
        return []
    return list(SKIN)


def leg_commands(leg: Leg, before: Leg | None) -> list[str]:
    """Return the commands between two legs: step and force, where they change."""
    if leg.stroke is not None:
        end = [LET_GO_PISTON] if before is not None else []
        return [*end, f"timestep {leg.dt!r}", *stroke_commands(leg.stroke)]
    lines = [] if before is not None and before.dt == leg.dt else [f"timestep {leg.dt!r}"]
    pushed = before is not None and before.ramp is not None
    if leg.ramp is not None:
        lines.append(f"variable force equal {force_formula(leg.ramp)}")
        if not pushed:
            lines.append(PUSH)
    elif pushed:
        lines.append(LET_GO)
    return lines


def force_formula(ramp: Ramp) -> str:
    """Return the force on a ramp as a LAMMPS formula of the elapsed ``time``."""
    elapsed = f"(time-{ramp.start!r})" if ramp.start else "time"
    fraction = f"{elapsed}/{ramp.end - ramp.start!r}"
    growth = SHAPES[ramp.shape].for_lammps(fraction)
    return f"{ramp.start_force!r}+{ramp.end_force - ramp.start_force!r}*{growth}".replace("+-", "-")


def granules(scene: Scene, pair_style: str, version: str | None = COEFF_RESTITUTION) -> list[str]:
    """Return the commands between the start of a deck and its motion: granules and contacts.

    ``version`` is LAMMPS's, year month day, on which damping depends; None for a deck that checks
    it. RunFailed if LAMMPS, or this pair style, does not support the scene.
    """
    refuse_pair_style(scene, pair_style)
    each = scene.granules
    refuse_long("a LAMMPS deck of", scene)
    kinds, of_each = _kinds(scene)
    return [
        *_moduli(kinds),
        "",
        *_granules(each, of_each, len(kinds)),
        "",
        *([] if version is not None else by_version(scene)),
        f"pair_style {_WITH_TERMS}",
        *_pairs(kinds, scene.contact, version),
        f"neighbor {float(np.min(each.radius)) / 2!r} bin",
    ]


def refuse_pair_style(scene: Scene, pair_style: str) -> None:
    """Raise RunFailed for a pair style without the contacts of a scene with terms."""
    if pair_style != _WITH_TERMS:
        raise RunFailed(
            f"pair style {pair_style} has one stiffness for all contacts: take {_WITH_TERMS} for a"
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
