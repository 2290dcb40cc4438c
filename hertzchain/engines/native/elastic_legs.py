"""What happens at the start of a run and between its legs, compiled."""

from __future__ import annotations

from typing import Any

from hertzchain.engines.native.elastic_chain import (
    PLACE,
    SHAPE,
    START,
    VELOCITY,
    applied_force,
    energy_of,
    has_piston,
    overlap_of,
    with_stiffness,
)
from hertzchain.engines.native.elastic_step import accelerate_pushed
from hertzchain.observables.compiling import part
from hertzchain.observables.interpolant import hertz_force

DIVERGED_ENERGY = 10.0
"""Energy over the work done by the applied force in a run that has diverged. Stable steps that are
too long for the work of a short pulse gave up to 2 (measured)."""


@part
def is_diverged(energy: float, given: float, work: float, moved: float, chain: Any) -> bool:
    """Whether the chain has far more energy than it was given, at the start and by work.

    A piston that goes back under a load takes more energy than it gave, as constant forces do work.
    ``moved`` is the work of the piston, with both signs counted as positive.
    """
    if has_piston(chain):
        return not abs(energy) <= DIVERGED_ENERGY * (moved + abs(given))
    return not energy <= DIVERGED_ENERGY * (work + given)


@part
def begin_run(
    u: Any, v: Any, g: Any, start: Any, granules: int, seen: Any, run: Any, chain: Any
) -> None:
    """Accelerations, energy and contact forces at the start, without the applied force."""
    for i in range(start.shape[1]):
        u[i], v[i] = start[0, i], start[1, i]
    run.given = energy_of(u, v, 0, granules, chain)
    before = with_stiffness(hertz_force(overlap_of(u, 0, chain)), 0, chain)
    for i in range(granules):
        force = with_stiffness(hertz_force(overlap_of(u, i, chain)), i, chain)
        if i > 0:
            net = before - force
            if chain is not None:
                net *= chain.inverse_mass[i]
                net += chain.constant[i]
            g[i] = net
        before = force
        if i < seen.force.size and force > 0:
            seen.force[i], seen.time[i] = force, run.time


@part
def start_leg(leg: Any, u: Any, v: Any, g: Any, seen: Any, run: Any, lo: int, chain: Any) -> None:
    """Change the applied force, or the motion of a piston, at the start of a leg.

    Doing this twice does no harm.
    """
    run.push = applied_force(leg, leg[START])
    if has_piston(chain):
        u[0], v[0] = leg[PLACE], leg[VELOCITY]
        # A piston that turns round causes a maximum between two steps.
        force = with_stiffness(hertz_force(overlap_of(u, 0, chain)), 0, chain)
        if force > seen.force[0]:
            seen.force[0], seen.time[0] = force, leg[START]
    accelerate_pushed(u, g, run.push, lo, chain)


@part
def pushed_legs(legs: Any) -> int:
    """Number of legs up to the last one with a force."""
    found = 0
    for k in range(legs.shape[0]):
        if legs[k, SHAPE] != 0:
            found = k + 1
    return found
