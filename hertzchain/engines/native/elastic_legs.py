"""What happens at the start of a run, between its legs, and in free flight, compiled."""

from __future__ import annotations

from typing import Any

from hertzchain.engines.native.compiling import part
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
from hertzchain.engines.native.elastic_state import (
    GIVEN,
    MOVED,
    PUSH,
    TIME,
    WORK,
)
from hertzchain.engines.native.elastic_step import (
    accelerate_first,
)
from hertzchain.engines.native.interpolant import hertz_force

DIVERGED_ENERGY = 10.0
"""Energy over the work done by the applied force in a run that has diverged. Where steps are
stable, but so long that the work of a short pulse is wrong, 2 was seen."""


@part
def is_diverged(energy: float, total: Any, chain: Any) -> bool:
    """Whether the chain has far more energy than it was given.

    A piston that goes back under a load takes more than it gave: constant forces do work then.
    """
    if has_piston(chain):
        return not abs(energy) <= DIVERGED_ENERGY * (total[MOVED] + abs(total[GIVEN]))
    return not energy <= DIVERGED_ENERGY * (total[WORK] + total[GIVEN])


@part
def flies_freely(chain: Any) -> bool:
    """Whether granules of a scene with terms move steadily where no contact presses."""
    if chain is None:
        return False
    loaded = 0
    for i in range(chain.constant.size):
        loaded += chain.constant[i] != 0
    return loaded == 0


@part
def free_flight(u: Any, v: Any, lo: int, hi: int, on_wall: int, wait: float, chain: Any) -> float:
    """How long all granules fly freely, at most ``wait``; 0 if a contact presses."""
    for i in range(lo, hi - 1 + on_wall):
        overlap, rate = overlap_of(u, i, chain), float(v[i] - v[i + 1])
        if overlap > 0.0:
            return 0.0
        if rate > 0.0:
            wait = min(wait, -overlap / rate)
    return wait


@part
def fly(u: Any, v: Any, wait: float, lo: int, hi: int) -> None:
    """Let granules fly."""
    for i in range(lo, hi):
        u[i] += v[i] * wait


@part
def begin_run(
    u: Any, v: Any, g: Any, granules: int, peak_force: Any, peak_time: Any, total: Any,
    chain: Any,
) -> None:  # fmt: skip
    """Accelerations, energy and forces of contacts at the start; the first granule's come later."""
    total[GIVEN] = energy_of(u, v, 0, granules, chain)
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
        if i < peak_force.size and force > 0:
            peak_force[i], peak_time[i] = force, total[TIME]


@part
def start_leg(
    leg: Any, u: Any, v: Any, g: Any, peak_force: Any, peak_time: Any, constants: Any, lo: int,
    chain: Any,
) -> None:  # fmt: skip
    """Change the applied force, or the motion of a piston, at the start of a leg.

    Doing this twice does no harm.
    """
    constants[PUSH] = applied_force(leg, leg[START])
    if has_piston(chain):
        u[0], v[0] = leg[PLACE], leg[VELOCITY]
        # A piston that turns round makes a maximum, which lies in neither of the steps.
        force = with_stiffness(hertz_force(overlap_of(u, 0, chain)), 0, chain)
        if force > peak_force[0]:
            peak_force[0], peak_time[0] = force, leg[START]
    accelerate_first(u, g, constants, lo, chain)


@part
def pushed_legs(legs: Any) -> int:
    """How many legs there are up to the last with a force."""
    found = 0
    for k in range(legs.shape[0]):
        if legs[k, SHAPE] != 0:
            found = k + 1
    return found


@part
def start_at(start: Any, u: Any, v: Any) -> None:
    """Set displacement and velocity of all granules."""
    for i in range(start.shape[1]):
        u[i], v[i] = start[0, i], start[1, i]
