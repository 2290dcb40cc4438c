"""Checks that the parts of a scene are possible together."""

from __future__ import annotations

import math
import sys
from itertools import pairwise
from typing import Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.errors import SceneError, require
from hertzchain.scene.chain import Chain
from hertzchain.scene.granules import Granules
from hertzchain.scene.moving import Moving
from hertzchain.scene.shock import Shock
from hertzchain.scene.striker import Striker
from hertzchain.scene.terms import DAMPING, Wall


def refuse_impossible(scene: Any) -> None:
    """Raise a SceneError for parts that exclude one another.

    Gravity needs a wall or a fixed granule at the far end, a static load needs closed contacts, a
    sine needs a static load of at least its amplitude, and a near wall leaves no room for a striker
    or piston.
    """
    chain: Chain = scene.chain
    shock: Shock = scene.shock
    pressed, contact, gauges = scene.precompression, scene.contact, scene.gauges
    walls: dict[str, Wall | None] = {"wall": scene.wall, "near_wall": scene.near_wall}
    for gauge in gauges:
        gauge.check(chain.granules, *(one is not None for one in walls.values()))
    uncertain = scene.uncertain
    names = [one.name for one in uncertain]
    for name in names:
        require(names.count(name) == 1, name, None, "is uncertain twice: delete one of them")
    for section, one in walls.items():
        for name, value in one.own_damping.items() if one is not None else ():
            law = next(law for law, parameter in DAMPING.items() if parameter == name)
            allowed = f'needs [contact] damping = "{law}", whose {name} is that of other contacts'
            is_law = contact is not None and contact.damping == law
            require(is_law, f"{section}.{name}", value, allowed)
    allowed = f"leave it out: granule 1 is the {shock.noun}, and nothing stands behind it"
    stands = scene.near_wall is None or shock.impact_velocity is None
    require(stands, "near_wall", None, allowed)
    allowed = f"must be at most {chain.granules}, the granules of the chain"
    require(shock.granule <= chain.granules, "shock.granule", shock.granule, allowed)
    force = 0.0 if pressed is None else pressed.force
    loads = force > 0 and scene.near_wall is None
    fixed = _refuse_fixed(chain, shock, walls, shock.loaded_granule if loads else None)
    if isinstance(shock, Moving | Striker):
        _refuse_no_meeting(chain, shock, walls)
    shock.check_load(0.0 if fixed[: shock.granule].any() else force)
    loaded = isinstance(shock, Striker) and shock.loaded
    allowed = "needs [precompression]: leave it out for a striker in a chain without a static load"
    require(pressed is not None or not loaded, "striker.loaded", None, allowed)
    if pressed is None:
        return
    if scene.wall is None and pressed.gravity and not fixed[-1]:
        allowed = "needs a [wall], or a fixed last granule, which carries the weight of the chain"
        raise SceneError("precompression.gravity", pressed.gravity, allowed)
    closed = "must be 0 with [precompression], which presses all contacts from the start"
    require(not isinstance(chain.gap, tuple) and chain.gap == 0, "chain.gap", None, closed)
    for section, one in walls.items():
        require(one is None or one.gap == 0, f"{section}.gap", one and one.gap, closed)


def _refuse_fixed(
    chain: Chain, shock: Shock, walls: dict[str, Wall | None], loaded: int | None
) -> FloatArray:
    """Return which granules are fixed.

    Raises a SceneError for fixed ones that move, are pushed, or touch nothing that moves.
    ``loaded`` is the granule that a static load pushes, counted from 0.
    """
    fixed = np.broadcast_to(chain.fixed, chain.granules)
    velocity = np.broadcast_to(chain.velocity, chain.granules)
    held = np.append(fixed, walls["wall"] is not None)
    pushed = None if isinstance(shock, Moving) else shock.granule - 1
    for k in np.flatnonzero(fixed).tolist():
        ahead = "the wall" if k + 1 == chain.granules else f"granule {k + 2}"
        for wrong, allowed in (
            (k == 0 and walls["near_wall"], "is next to the near wall: free it"),
            (held[k + 1], f"is next to {ahead}, which does not move either: free one of them"),
            (velocity[k] != 0, "has a velocity at the start: leave out one of both"),
            (k == pushed, f"must not be fixed: the {shock.noun} moves it"),
            (k == loaded, "must not be fixed: the static load presses it"),
        ):
            require(not wrong, f"fixed granule {k + 1}", None, allowed)
    return fixed


def _refuse_no_meeting(
    chain: Chain, shock: Moving | Striker, walls: dict[str, Wall | None]
) -> None:
    """Raise a SceneError if no granules collide because of their velocities at the start.

    A load that would make them meet later is not enough: the first collision is the unit of force.
    """
    along = chain.velocity if isinstance(chain.velocity, tuple) else (chain.velocity,) * 2
    allowed = (
        "missing section: give [shock], [striker] or a velocity of granules, in [chain],"
        " [[chain.segments]] or their table"
    )
    require(isinstance(shock, Striker) or any(along), "[shock]", None, allowed)
    if isinstance(shock, Striker):
        along = (shock.velocity, *along[1:])
    along = (*([0.0] if walls["near_wall"] else ()), *along, *([0.0] if walls["wall"] else ()))
    meet = any(one > ahead for one, ahead in pairwise(along))
    allowed = (
        "with these no granule meets another or a wall, which some must do, also under a load:"
        " a positive velocity is towards the far end"
    )
    require(meet, "velocities at the start", None, allowed)


# Floating point


def are_normal(*values: float) -> bool:
    """Return whether all values are positive normal numbers, so that they lose no digits."""
    return all(sys.float_info.min <= value < math.inf for value in values)


def hold_digits(granules: Granules, force: float) -> bool:
    """Return whether granules, contacts and the overlaps under a force [N] are normal numbers.

    Infinite masses, of a piston and of fixed granules, are allowed.
    """
    mass = granules.mass[np.isfinite(granules.mass)]
    values = [
        *(granules.radius**3, mass, granules.stiffness, granules.contact_mass),
        force / granules.stiffness,
    ]
    return are_normal(*(float(edge(value)) for value in values for edge in (np.min, np.max)))


def is_representable(scene: Any) -> bool:
    """Return whether all quantities of a scene, and intermediate results, are normal numbers.

    Every divisor is checked before it is used.
    """
    force = scene.peak_force
    if scene.is_plain:
        chain = scene.chain
        mass, stiffness = chain.granule_mass, chain.contact_stiffness
        of_chain = (chain.radius**3, mass, chain.young_modulus / 3, stiffness, force)
        if not are_normal(*of_chain) or not are_normal(force / stiffness):
            return False
    elif not hold_digits(scene.granules, force):
        return False
    mass, units = scene.first_contact[1], scene.units
    of_units = (units.length, mass * units.length, units.time**2, units.velocity)
    if not are_normal(*of_units, units.momentum, units.energy):
        return False
    times = [ramp.end for ramp in scene.ramps[:1]]
    return are_normal(scene.momentum_ratio, *times, scene.end_time)
