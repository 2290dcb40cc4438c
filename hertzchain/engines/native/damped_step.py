"""A step of an explicit Runge-Kutta method for damped contacts, and its error, compiled."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from hertzchain.engines.native.damped_contacts import (
    accelerations,
    force_rates,
    forces,
)
from hertzchain.engines.native.elastic_chain import applied_force, applied_force_rate, has_piston
from hertzchain.observables.compiling import compiled
from hertzchain.observables.observer import power_of

_AHEAD = 8
"""Granules that the window of moving granules grows by."""

_LEAST = 1e-60
"""A force below which a granule ahead of the front stays at rest."""

_NO_ERROR = 1e-60
"""Square of an error that counts as 0."""


@compiled
def rate_of_dampers(u: Any, on: Any, hi: int, c: Any) -> float:
    """Bound of the rates at which the dampers that act now stop motions.

    No rate is larger than the largest sum of a row of the matrix of dampers over masses
    (Gershgorin).
    """
    fastest, before = 0.0, 0.0
    for i in range(hi):
        damping = on[i] * c.damping[i]
        if c.exponent > 0:
            damping *= power_of(max(u[i] - u[i + 1] - c.gap[i], 0.0), c.exponent)
        fastest = max(fastest, (before + damping) * c.inverse_mass[i])
        before = damping
    return 2.0 * fastest


@compiled
def _fly(u: Any, v: Any, u0: Any, v0: Any, time: float, hi: int) -> None:
    for i in range(np.uint64(0), np.uint64(hi)):
        u[i] = u0[i] + time * v0[i]
        v[i] = v0[i]


@compiled
def _combine(
    u: Any, v: Any, size: float, twice: Any, once: Any, s: int, k: Any, stages: int, hi: int
) -> None:
    """Add the stages with rows of coefficients.

    ``once`` makes velocities of scaled accelerations, ``twice`` displacements.
    """
    for j in range(stages):
        of_u, of_v = size * size * twice[s, j], size * once[s, j]
        if of_u != 0.0 or of_v != 0.0:
            for i in range(np.uint64(0), np.uint64(hi)):
                u[i] += of_u * k[j, i]
                v[i] += of_v * k[j, i]


@compiled
def _sum(of: Any, hi: int) -> float:
    total = 0.0
    for i in range(hi):
        total += of[i]
    return total


@compiled
def _bend(bent: Any, rows: Any, nodes: Any, size: float, m: int) -> None:
    """Coefficients of displacements in t^(1/m): rows times rows, weighted by dt/dtau of stages."""
    stages = nodes.size
    for s in range(stages + 1):
        for j in range(stages):
            bent[s, j] = 0.0
        for through in range(1, min(s, stages)):
            weighted = rows[s, through] * m * (nodes[through] * size) ** (m - 1)
            if weighted != 0.0:
                for j in range(through):
                    bent[s, j] += weighted * rows[through, j]


@compiled
def place_of_push(f: Any, c: Any) -> int:
    """Place of the applied force in an array of forces: see ``damped_contacts``."""
    return 0 if c.pushed == 0 else f.size - 1


@compiled
def force_on_held(f: Any, c: Any) -> float:
    """Force on the wall and on fixed granules together."""
    total = f[c.inverse_mass.size]
    for k in range(c.fixed.size):
        total += f[c.fixed[k]] - f[c.fixed[k] + 1]
    return float(total)


@compiled
def take_step(
    start: Any, end: Any, room: Any, on: Any, method: Any, leg: Any, begin: float, h: float, m: int,
    hi: int, c: Any,
) -> int:  # fmt: skip
    """Take one step in t^(1/m); returns where the window ends.

    ``room.gained`` gets the work of the applied force or the piston, the dissipated energy, and the
    impulses of wall and piston.
    """
    f, power, k, gained = room.f, room.power, room.k, room.gained
    u1, v1, rows, nodes = end.u, end.v, method.rows, method.nodes
    granules, stages = c.inverse_mass.size, nodes.size
    size = h if m == 1 else h ** (1.0 / m)
    twice = method.squares
    if m > 1:
        _bend(room.bent, rows, nodes, size, m)
        twice = room.bent
    gained[0], gained[1], gained[2], gained[3] = 0.0, 0.0, 0.0, 0.0
    place, is_piston = place_of_push(f, c), 1.0 if has_piston(c) else 0.0
    pushing = 1 if is_piston > 0.0 else place  # the contact of a piston, or the applied force
    # The first stage is the state itself; in t^(1/m) nothing moves yet.
    moves = 1.0 if m == 1 else 0.0
    for i in range(np.uint64(0), np.uint64(hi)):
        k[0, i] = moves * start.a[i]
    part = size * rows[stages, 0] * moves
    gained[0] += part * start.f[pushing] * start.v[c.pushed]
    gained[1] += part * _sum(start.power, hi)
    gained[2] += part * force_on_held(start.f, c)
    gained[3] += is_piston * part * start.f[1]
    for s in range(1, stages + 1):
        tau = size if s == stages else nodes[s] * size
        past, scale = tau, 1.0
        if m > 1:
            past, scale = tau**m, m * tau ** (m - 1)
        _fly(u1, v1, start.u, start.v, past, hi)
        _combine(u1, v1, size, twice, rows, s, k, min(s, stages), hi)
        if s == stages:
            break
        f[place] = applied_force(leg, begin + past)
        forces(u1, v1, on, f, power, c.stiffness, c.damping, c.gap, c.exponent, hi)
        if f[hi] > _LEAST and hi < granules:
            grown = min(hi + _AHEAD, granules)
            for j in range(stages):
                for i in range(hi, grown):
                    k[j, i] = 0.0
            for i in range(hi, grown):
                power[i] = 0.0
            hi = grown
        accelerations(f, k[s], c.inverse_mass, c.constant, hi, c.pushed)
        for i in range(np.uint64(0), np.uint64(hi)):
            k[s, i] *= scale
        if rows[stages, s] != 0.0:
            part = size * rows[stages, s] * scale
            gained[0] += part * f[pushing] * v1[c.pushed]
            gained[1] += part * _sum(power, hi)
            gained[2] += part * force_on_held(f, c)
            gained[3] += is_piston * part * f[1]
    return hi


@compiled
def largest_error(v0: Any, v1: Any, k: Any, fifth: Any, third: Any, size: float, hi: int) -> Any:
    """Estimate the largest error of a velocity, and find the largest velocity.

    An error is the square of one estimate over another of lower order, of the same granule: the
    quotient of the largest ones, of different granules, can be far too small.
    """
    error, fastest = 0.0, 0.0
    for i in range(np.uint64(0), np.uint64(hi)):
        by5 = by3 = 0.0
        for s in range(fifth.size):
            by5 += fifth[s] * k[s, i]
            by3 += third[s] * k[s, i]
        square = by5 * by5
        error = max(error, square / math.sqrt(square + 0.01 * by3 * by3 + _NO_ERROR))
        fastest = max(fastest, abs(v0[i]), abs(v1[i]))
    return size * error, fastest


@compiled
def evaluate(at: Any, on: Any, leg: Any, time: float, hi: int, c: Any) -> None:
    """Forces, their rates, and accelerations of a state."""
    place = place_of_push(at.f, c)
    at.f[place], at.r[place] = applied_force(leg, time), applied_force_rate(leg, time)
    forces(at.u, at.v, on, at.f, at.power, c.stiffness, c.damping, c.gap, c.exponent, hi)
    accelerations(at.f, at.a, c.inverse_mass, c.constant, hi, c.pushed)
    force_rates(at.u, at.v, at.a, on, at.r, c.stiffness, c.damping, c.gap, c.exponent, hi)
