"""Terms of a scene in the form of codes with absolute coordinates and materials."""

from __future__ import annotations

import itertools
from collections.abc import Hashable, Sequence
from typing import TypeVar

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.errors import RunFailed
from hertzchain.scene.chain import Granules
from hertzchain.scene.scene import Scene
from hertzchain.scene.shocks import SHAPES, Ramp, Stroke

MOST_MATERIALS = 100
"""Most types of granules (chosen): a deck has numbers for each pair of types."""

OF_OTHER_CODES = (
    "unlike granules", "gaps", "striker", "piston", "local shock", "moving granules", "wall",
    "precompression", "gravity", "damping",
)  # fmt: skip
"""Terms that the decks of LIGGGHTS and Yade render, by their names in ``Scene.terms``."""

Material = tuple[float, float]  # E [Pa] and nu

_Kind = TypeVar("_Kind", bound=Hashable)


def weighty_density(granules: Granules) -> FloatArray:
    """Density of each body [kg/m^3], (bodies,), very large for a piston and fixed ones."""
    # Density of a piston over that of the granule (chosen), for codes whose damping depends on both
    # masses: the effect of its own mass is below round-off
    return np.where(np.isinf(granules.mass), 1e30, 1.0) * granules.density


def positions(scene: Scene) -> list[float]:
    """Return the position of each granule at the start [m].

    In a plain scene they are multiples of the diameter, with one rounding each; a sum has more.
    """
    if scene.is_plain:
        return [2 * scene.chain.radius * k for k in range(scene.chain.granules)]
    unlike: list[float] = scene.granules.position.tolist()
    return unlike


def wall_position(scene: Scene) -> float:
    """Return the position of the wall, with the first body at 0 [m]."""
    assert scene.wall is not None
    each = scene.granules
    overlap = float(each.static_overlap[-1])
    return float(each.position[-1] + each.radius[-1]) + scene.wall.gap - overlap


def wall_material(scene: Scene) -> tuple[float, float]:
    """Return Young's modulus [Pa] and Poisson's ratio of the wall."""
    wall, each = scene.wall, scene.granules
    assert wall is not None
    material = wall.material(float(each.young_modulus[-1]), float(each.poisson_ratio[-1]))
    return material["young_modulus"], material["poisson_ratio"]


def refuse_long(what: str, scene: Scene) -> None:
    """Raise RunFailed for a deck that would name too many granules; ``what`` begins the error."""
    # Most granules (chosen): a deck names each of them, in ten seconds
    count, most = scene.chain.granules, 100_000
    if count > most:
        raise RunFailed(f"{what} {count} granules would be too long: at most {most}")


def materials_of(code: str, granules: Granules) -> tuple[list[Material], list[int]]:
    """Materials along the chain, and each granule's material; RunFailed for too many in a deck."""
    columns = granules.young_modulus.tolist(), granules.poisson_ratio.tolist()
    materials, numbers = numbered(list(zip(*columns, strict=True)))
    if len(materials) > MOST_MATERIALS:
        raise RunFailed(
            f"the granules are of {len(materials)} materials, a {code} deck has at most"
            f" {MOST_MATERIALS}"
        )
    return materials, numbers


def numbered(kinds: Sequence[_Kind]) -> tuple[list[_Kind], list[int]]:
    """Return the kinds of granules, in order along the chain, and each granule's kind number."""
    numbers = {kind: k for k, kind in enumerate(dict.fromkeys(kinds), start=1)}
    return list(numbers), [numbers[kind] for kind in kinds]


def load_commands(scene: Scene) -> list[str]:
    """Return commands of LAMMPS and LIGGGHTS for constant forces and velocities at the start."""
    lines, pressed = [], scene.precompression
    if pressed is not None and pressed.gravity:
        those = "moving" if scene.holds else "all"
        lines.append(f"fix gravity {those} gravity {pressed.gravity!r} vector 1 0 0")
    if pressed is not None and pressed.force and scene.near_wall is None:
        group = "first"
        if scene.shock.loaded_granule:
            group = "loaded"
            lines.append(f"group {group} id {scene.shock.loaded_granule + 1}")
        lines.append(f"fix press {group} addforce {pressed.force!r} 0.0 0.0")
    if scene.held_load:
        lines.append(f"fix hold last addforce {-scene.held_load!r} 0.0 0.0")
    if scene.striker is not None or scene.piston is not None or scene.moves:
        lines += _velocity_commands(scene)
    return lines


def _velocity_commands(scene: Scene) -> list[str]:
    """Return the commands for velocities at the start, one for all neighbours with the same."""
    velocity = scene.granules.velocity.tolist()
    lines = [f"velocity first set {velocity[0]!r} 0.0 0.0 units box"]
    last = 1
    for along, alike in itertools.groupby(velocity[1:]):
        first, last = last + 1, last + len(list(alike))
        if along:
            lines += [
                f"group thrown id {first}:{last}",
                f"velocity thrown set {along!r} 0.0 0.0 units box",
                "group thrown delete",
            ]
    return lines


def motion_commands(scene: Scene) -> list[str]:
    """Return the commands of LAMMPS and LIGGGHTS for the motion of all granules but a piston."""
    about = "# In one dimension granules do not spin: fix nve is enough."
    pushed = [f"group pushed id {scene.pushed + 1}"] if scene.pushed else []
    left_out = ["fixed"] * scene.holds + ["first"] * (scene.piston is not None)
    if not left_out:
        return [about, "fix motion all nve", "group first id 1", *pushed]
    return [
        f"{about} {'Fixed ones are left out' if scene.holds else 'Granule 1 is moved'}.",
        "group first id 1",
        *(f"group fixed id {number}" for number in (scene.granules.fixed + 1).tolist()),
        f"group moving subtract all {' '.join(left_out)}",
        "fix motion moving nve",
        *pushed,
    ]


def push_command(scene: Scene) -> str:
    """Return the command of LAMMPS and LIGGGHTS that applies the variable ``force``."""
    return f"fix shock {'pushed' if scene.pushed else 'first'} addforce v_force 0.0 0.0"


def force_on_ramp(ramp: Ramp, fraction: str) -> str:
    """Return the force on a ramp as a formula of LAMMPS and LIGGGHTS, from its elapsed fraction."""
    growth = SHAPES[ramp.shape].for_lammps(fraction)
    return f"{ramp.start_force!r}+{ramp.end_force - ramp.start_force!r}*{growth}".replace("+-", "-")


def stroke_commands(stroke: Stroke) -> list[str]:
    """Return the commands of LAMMPS and LIGGGHTS that begin a stroke of the piston.

    Positions follow from the number of steps since the command, so ``LET_GO_PISTON`` stands before
    any change of the step or of that number.
    """
    velocity = f"{stroke.velocity!r} 0.0 0.0 units box"
    return [f"velocity first set {velocity}", f"fix piston first move linear {velocity}"]


LET_GO_PISTON = "unfix piston"
"""Command that ends a stroke."""
