"""Steps of a symplectic method for elastic contacts, compiled.

Force, kick and drift of a stage are one loop, so that one square root per granule is what a stage
costs. The force of an overlap r is r sqrt(r), written out in the loops (a function would round
elsewhere). Arrays hold a window of the chain: see ``elastic``.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hertzchain.engines.native.compiling import ONE, compiled, part
from hertzchain.engines.native.elastic_chain import SHAPE, applied_force
from hertzchain.engines.native.elastic_state import AHEAD, COEFFICIENTS, LEAST, PUSH, ZERO


@compiled
def _first_kick(u: Any, v: Any, g: Any, kick: Any, drift: Any, lo: int, hi: int) -> None:
    """Kick by the known accelerations g, and drift."""
    for i in range(np.uint64(lo), np.uint64(hi)):
        v[i] += kick * g[i]
        u[i] += drift * v[i]


@compiled
def _kick_and_drift(
    u: Any, v: Any, left: Any, kick: Any, drift: Any, least: Any, lo: int, hi: int,
    chain: Any,
) -> Any:  # fmt: skip
    """Force, kick and drift in one pass; the force ahead of the last granule is returned."""
    for i in range(np.uint64(lo), np.uint64(hi)):
        r = u[i] - u[i + ONE]
        if chain is not None:
            r -= chain.gap[i]
        r = r if r > least else least - least
        right = r * np.sqrt(r)
        if chain is not None:
            right *= chain.stiffness[i]
        net = left - right
        if chain is not None:
            net *= chain.inverse_mass[i]
            net += chain.constant[i]
        v[i] += kick * net
        u[i] += drift * v[i]
        left = right
    return left


@compiled
def _last_kick(
    u: Any, v: Any, g: Any, left: Any, kick: Any, least: Any, lo: int, hi: int,
    chain: Any,
) -> Any:  # fmt: skip
    """Force and kick; accelerations are kept, the force ahead of the last granule returned."""
    for i in range(np.uint64(lo), np.uint64(hi)):
        r = u[i] - u[i + ONE]
        if chain is not None:
            r -= chain.gap[i]
        r = r if r > least else least - least
        right = r * np.sqrt(r)
        if chain is not None:
            right *= chain.stiffness[i]
        net = left - right
        if chain is not None:
            net *= chain.inverse_mass[i]
            net += chain.constant[i]
        g[i] = net
        v[i] += kick * net
        left = right
    return left


@part
def accelerate_first(u: Any, g: Any, constants: Any, lo: int, chain: Any) -> None:
    """Acceleration of the first granule under the applied force of the moment."""
    r = u[lo] - u[lo + 1]
    if chain is not None:
        r -= chain.gap[lo]
    r = r if r > constants[LEAST] else constants[ZERO]
    right = r * np.sqrt(r)
    if chain is not None:
        right *= chain.stiffness[lo]
    net = constants[PUSH] - right
    if chain is not None:
        net *= chain.inverse_mass[lo]
        net += chain.constant[lo]
    g[lo] = net


@compiled
def keep_start(u: Any, v: Any, g: Any, u0: Any, v0: Any, a: Any, lo: int, hi: int) -> None:
    """Keep the motion at the start of a step."""
    for i in range(np.uint64(lo), np.uint64(hi)):
        u0[i], v0[i], a[i] = u[i], v[i], g[i]


@compiled
def back_to_the_start(
    u: Any, v: Any, g: Any, u0: Any, v0: Any, a: Any, lo: int, hi: int
) -> None:  # fmt: skip
    """Undo a step."""
    for i in range(np.uint64(lo), np.uint64(hi)):
        u[i], v[i], g[i] = u0[i], v0[i], a[i]


@compiled
def _end_step(
    u: Any, v: Any, g: Any, kick: Any, constants: Any, leg: Any, end: float, lo: int, hi: int,
    last: int, chain: Any,
) -> int:  # fmt: skip
    """Last kick of a step; returns where the window ends now."""
    if leg[SHAPE] != 0:
        constants[PUSH] = applied_force(leg, end)
    ahead = _last_kick(u, v, g, constants[PUSH], kick, constants[LEAST], lo, hi, chain)
    if ahead > 0 and hi < last:
        if chain is not None:
            ahead *= chain.inverse_mass[hi]
        g[hi] = ahead
        hi = min(hi + AHEAD, last)
    return hi


@compiled
def symplectic_step(
    u: Any, v: Any, g: Any, kicks: Any, drifts: Any, fractions: Any, constants: Any, leg: Any,
    begin: float, h: float, lo: int, hi: int, last: int,
    chain: Any,
) -> int:  # fmt: skip
    """Take one step of a symplectic Nystrom method; returns where the window ends now."""
    pushed, least = leg[SHAPE] != 0, constants[LEAST]
    time, stages = begin, drifts.size
    _first_kick(u, v, g, kicks[0], drifts[0], lo, hi)
    for s in range(1, stages):
        if pushed:
            time += fractions[s - 1] * h
            constants[PUSH] = applied_force(leg, time)
        ahead = _kick_and_drift(
            u, v, constants[PUSH], kicks[s], drifts[s], least, lo, hi, chain,
        )  # fmt: skip
        if ahead > 0:
            hi = min(hi + AHEAD, last)
    return _end_step(
        u, v, g, kicks[stages], constants, leg, begin + h, lo, hi, last, chain,
    )  # fmt: skip


@part
def scale_coefficients(h: float, numbers: Any, kicks: Any, drifts: Any) -> None:
    """Kicks, then drifts, times h, in the precision of the state."""
    for s in range(kicks.size):
        numbers[COEFFICIENTS + s] = kicks[s] * h
    for s in range(drifts.size):
        numbers[COEFFICIENTS + kicks.size + s] = drifts[s] * h
