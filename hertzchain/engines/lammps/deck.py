"""The commands of the LAMMPS backend for a scene: pure text, nothing is run here.

LAMMPS gets only E, nu, R and rho, never the contact stiffness or the mass computed here, so that a
mistake in either shows. ``decks.standalone`` uses the same pieces.
"""

from __future__ import annotations

from hertzchain.engines.external.terms import LET_GO_PISTON, PISTON_MOTION, stroke_commands
from hertzchain.engines.lammps import terms_deck
from hertzchain.engines.lammps.dialect import (
    COEFF_RESTITUTION,
    DEFAULT_SKIN,
    LET_GO,
    PAIR_STYLES,
    PUSH,
)
from hertzchain.errors import require
from hertzchain.scene.chain import Chain
from hertzchain.scene.ramp import SHAPES, Ramp
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg

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


def set_up(scene: Scene, pair_style: str = "granular", version: str = COEFF_RESTITUTION) -> str:
    """Return the commands that create the chain at rest, with one of ``PAIR_STYLES``.

    ``version`` is the LAMMPS's, year month day; damping depends on it.
    """
    check_pair_style(pair_style)
    if not scene.is_plain:
        made = terms_deck.granules(scene, pair_style, version)
        held = terms_deck.held(scene, version)
        motion = MOTION if scene.piston is None else PISTON_MOTION
        return "\n".join([*START, "", *made, "", *motion, *held]) + "\n"
    lines = [
        *START,
        "",
        *parameters(scene.chain),
        "",
        *GRANULES,
        "",
        *PAIR_STYLES[pair_style],
        *_neighbour_skin(scene.chain.radius),
        "",
        *MOTION,
    ]
    return "\n".join(lines) + "\n"


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
