"""Steps of a symplectic method for elastic contacts, compiled.

Force, kick and drift of a stage are one loop, so that a stage costs one square root per granule.
The force of an overlap r is r sqrt(r), written out in the loops (a function would round
differently). Only a window of the chain is computed: see ``elastic``.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hertzchain.engines.native.elastic_chain import SHAPE, applied_force
from hertzchain.engines.native.elastic_state import AHEAD, LEAST
from hertzchain.observables.compiling import ONE, compiled, part


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
