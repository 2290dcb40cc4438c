"""Steps of a symplectic method for elastic contacts, compiled.

Force, kick and drift of a stage are one loop, so that a stage costs one square root per granule.
The force of an overlap r is r sqrt(r), written out in the loops (a function would round
differently). Only a window of the chain is computed: see ``elastic``.
"""

from __future__ import annotations

from typing import Any

import numpy as np

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
from hertzchain.engines.native.elastic_state import AHEAD, LEAST
from hertzchain.observables.compiling import ONE, compiled, part
from hertzchain.observables.interpolant import hertz_force


@compiled
def _first_kick(u: Any, v: Any, g: Any, kick: Any, drift: Any, lo: int, hi: int) -> None:
    """Kick by the known accelerations g, and drift."""
    for i in range(np.uint64(lo), np.uint64(hi)):
        v[i] += kick * g[i]
        u[i] += drift * v[i]


@compiled
def _kick_and_drift(
    u: Any, v: Any, g: Any, left: Any, kick: Any, drift: Any, lo: int, hi: int, chain: Any
) -> Any:
    """Force, kick and drift in one pass; the force ahead of the last granule is returned.

    Accelerations are kept in ``g``, unless it is None.
    """
    for i in range(np.uint64(lo), np.uint64(hi)):
        r = u[i] - u[i + ONE]
        if chain is not None:
            r -= chain.gap[i]
        r = r if r > LEAST else 0.0
        right = r * np.sqrt(r)
        if chain is not None:
            right *= chain.stiffness[i]
        net = left - right
        if chain is not None:
            net *= chain.inverse_mass[i]
            net += chain.constant[i]
        if g is not None:
            g[i] = net
        v[i] += kick * net
        u[i] += drift * v[i]
        left = right
    return left


@part
def accelerate_pushed(u: Any, g: Any, push: float, lo: int, chain: Any) -> None:
    """Acceleration of the granule under the applied force of the moment."""
    if chain is not None and chain.pushed > 0:
        lo = chain.pushed
        r = u[lo - 1] - u[lo] - chain.gap[lo - 1]
        r = r if r > LEAST else 0.0
        push += r * np.sqrt(r) * chain.stiffness[lo - 1]
    r = u[lo] - u[lo + 1]
    if chain is not None:
        r -= chain.gap[lo]
    r = r if r > LEAST else 0.0
    right = r * np.sqrt(r)
    if chain is not None:
        right *= chain.stiffness[lo]
    net = push - right
    if chain is not None:
        net *= chain.inverse_mass[lo]
        net += chain.constant[lo]
    g[lo] = net


@compiled
def keep_start(u: Any, v: Any, g: Any, u0: Any, v0: Any, a: Any, lo: int, hi: int) -> None:
    """Keep the motion at the start of a step in ``u0``, ``v0`` and ``a``."""
    for i in range(np.uint64(lo), np.uint64(hi)):
        u0[i], v0[i], a[i] = u[i], v[i], g[i]


@compiled
def symplectic_step(
    u: Any, v: Any, g: Any, run: Any, steps: Any, leg: Any, begin: float, h: float, lo: int,
    hi: int, granules: int, chain: Any,
) -> int:  # fmt: skip
    """Take one step of a symplectic Nystrom method; returns where the window ends now."""
    kicks, drifts = steps.kicks, steps.drifts
    pushed, push, time, stages = leg[SHAPE] != 0, run.push, begin, drifts.size
    first = chain is None or chain.pushed == 0
    _first_kick(u, v, g, h * kicks[0], h * drifts[0], lo, hi)
    for s in range(1, stages):
        if pushed:
            time += drifts[s - 1] * h
            push = applied_force(leg, time)
        behind = push if first else 0.0
        ahead = _kick_and_drift(u, v, None, behind, h * kicks[s], h * drifts[s], lo, hi, chain)
        if chain is not None and not first:
            more = h * kicks[s] * push * chain.inverse_mass[chain.pushed]
            v[chain.pushed] += more
            u[chain.pushed] += h * drifts[s] * more
        if ahead > 0:
            hi = min(hi + AHEAD, granules)
    if pushed:
        push = applied_force(leg, begin + h)
    run.push = push
    behind = push if first else 0.0
    ahead = _kick_and_drift(u, v, g, behind, h * kicks[stages], 0.0, lo, hi, chain)
    if chain is not None and not first:
        more = push * chain.inverse_mass[chain.pushed]
        g[chain.pushed] += more
        v[chain.pushed] += h * kicks[stages] * more
    if ahead > 0 and hi < granules:
        if chain is not None:
            ahead *= chain.inverse_mass[hi]
        g[hi] = ahead
        hi = min(hi + AHEAD, granules)
    return hi


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
