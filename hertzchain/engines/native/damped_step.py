"""A step of an explicit Runge-Kutta method for damped contacts, and its error, compiled."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from hertzchain.engines.native.damped_contacts import (
    accelerations,
    applied,
    applied_rate,
    force_rates,
    forces,
)
from hertzchain.engines.native.kernels import (
    ONE,
    _compiled_without_nan,
    _larger,
    compiled,
)

_AHEAD = 8
"""Granules that the window of moving granules grows by."""

_LEAST = 1e-60
"""A force below which a granule ahead of the front stays at rest."""


@compiled
def _add_three(
    total: Any, one: float, j: int, two: float, m: int, three: float, n: int, k: Any, hi: int
) -> None:
    for i in range(np.uint64(0), np.uint64(hi)):
        total[i] += one * k[j, i] + two * k[m, i] + three * k[n, i]


@compiled
def _combine(total: Any, size: float, row: Any, s: int, k: Any, stages: int, hi: int) -> None:
    """Add the stages with a row of coefficients, three at a time."""
    first = second = waiting = 0
    for j in range(stages):
        if row[s, j] == 0.0:
            continue
        if waiting == 2:
            _add_three(
                total, size * row[s, first], first, size * row[s, second], second,
                size * row[s, j], j, k, hi,
            )  # fmt: skip
            waiting = 0
        elif waiting == 1:
            second, waiting = j, 2
        else:
            first, waiting = j, 1
    if waiting == 2:
        for i in range(np.uint64(0), np.uint64(hi)):
            total[i] += size * row[s, first] * k[first, i] + size * row[s, second] * k[second, i]
    elif waiting == 1:
        for i in range(np.uint64(0), np.uint64(hi)):
            total[i] += size * row[s, first] * k[first, i]


@compiled
def _fly(u: Any, v: Any, u0: Any, v0: Any, time: float, hi: int) -> None:
    for i in range(np.uint64(0), np.uint64(hi)):
        u[i] = u0[i] + time * v0[i]
        v[i] = v0[i]


@compiled
def _keep_stage(
    ku: Any, kv: Any, s: int, v: Any, v0: Any, f: Any, inertia: Any, pull: Any, scale: float,
    hi: int,
) -> None:  # fmt: skip
    for i in range(np.uint64(0), np.uint64(hi)):
        ku[s, i] = scale * (v[i] - v0[i])
    for i in range(np.uint64(0), np.uint64(hi)):
        kv[s, i] = scale * ((f[i] - f[i + ONE]) * inertia[i] + pull[i])


@compiled
def _sum(of: Any, hi: int) -> float:
    total = 0.0
    for i in range(hi):
        total += of[i]
    return total


@compiled
def take_step(
    u0: Any, v0: Any, u1: Any, v1: Any, f: Any, power: Any, ku: Any, kv: Any, on: Any, rows: Any,
    nodes: Any, weights: Any, leg: Any, begin: float, h: float, m: int, hi: int, c: Any,
    gained: Any,
) -> int:  # fmt: skip
    """Take one step in t^(1/m); returns where the window ends.

    ``gained`` gets the work of the applied force, what was dissipated, and the wall's impulse.
    """
    granules = c.inertia.size
    size = h if m == 1 else h ** (1.0 / m)
    stages = nodes.size
    gained[0], gained[1], gained[2] = 0.0, 0.0, 0.0
    for s in range(stages + 1):
        tau = size if s == stages else nodes[s] * size
        past, scale = tau, 1.0
        if m > 1:
            past, scale = tau**m, m * tau ** (m - 1)
        _fly(u1, v1, u0, v0, past, hi)
        _combine(u1, size, rows, s, ku, min(s, stages), hi)
        _combine(v1, size, rows, s, kv, min(s, stages), hi)
        if s == stages:
            break
        f[0] = applied(leg, begin + past)
        forces(u1, v1, on, f, power, c.stiffness, c.damping, c.gap, c.quarters, hi)
        if f[hi] > _LEAST and hi < granules:
            grown = min(hi + _AHEAD, granules)
            for j in range(stages):
                for i in range(hi, grown):
                    ku[j, i], kv[j, i] = 0.0, 0.0
            hi = grown
        _keep_stage(ku, kv, s, v1, v0, f, c.inertia, c.pull, scale, hi)
        if weights[s] != 0.0:
            part = size * weights[s] * scale
            gained[0] += part * f[0] * v1[0]
            gained[1] += part * _sum(power, hi)
            gained[2] += part * f[granules]
    return hi


@_compiled_without_nan
def errors(v0: Any, v1: Any, kv: Any, fifth: Any, third: Any, size: float, hi: int) -> Any:
    """The two estimates of the error of the velocities, and the largest velocity."""
    e5, e3, fastest = 0.0, 0.0, 0.0
    f0, f5, f6, f7 = fifth[0], fifth[5], fifth[6], fifth[7]
    f8, f9, f10, f11 = fifth[8], fifth[9], fifth[10], fifth[11]
    t0, t5, t6, t7 = third[0], third[5], third[6], third[7]
    t8, t9, t10, t11 = third[8], third[9], third[10], third[11]
    for i in range(np.uint64(0), np.uint64(hi)):
        k0, k5, k6, k7 = kv[0, i], kv[5, i], kv[6, i], kv[7, i]
        k8, k9, k10, k11 = kv[8, i], kv[9, i], kv[10, i], kv[11, i]
        five = f0 * k0 + f5 * k5 + f6 * k6 + f7 * k7 + f8 * k8 + f9 * k9 + f10 * k10 + f11 * k11
        three = t0 * k0 + t5 * k5 + t6 * k6 + t7 * k7 + t8 * k8 + t9 * k9 + t10 * k10 + t11 * k11
        e5 = _larger(e5, abs(five))
        e3 = _larger(e3, abs(three))
        fastest = _larger(fastest, _larger(abs(v0[i]), abs(v1[i])))
    return size * e5, size * e3, fastest


@compiled
def error_ratio(e5: float, e3: float, allowed: float) -> float:
    """The error of a step over what is allowed."""
    both = e5 * e5 + 0.01 * e3 * e3
    return e5 * e5 / math.sqrt(both) / allowed if both > 0.0 else 0.0


@compiled
def evaluate(
    u: Any, v: Any, a: Any, f: Any, r: Any, power: Any, on: Any, leg: Any, time: float, hi: int,
    c: Any,
) -> None:  # fmt: skip
    """Forces, how fast they grow, and accelerations of a state."""
    f[0], r[0] = applied(leg, time), applied_rate(leg, time)
    forces(u, v, on, f, power, c.stiffness, c.damping, c.gap, c.quarters, hi)
    accelerations(f, a, c.inertia, c.pull, hi)
    force_rates(u, v, a, on, r, c.stiffness, c.damping, c.gap, c.quarters, hi)
