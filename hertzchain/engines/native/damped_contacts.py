"""Damped contacts, compiled: their forces, when they begin and end, and their highest forces.

Contact i lies ahead of granule i, and every array has an entry for it: at a free end stiffness,
damping and ``on`` of the last are 0. An array of forces has one entry more: entry 0 is the applied
force on granule 0, entry i + 1 that of contact i; the last entry is the applied force on any other
granule. In a step each contact keeps its mode: 1 in ``on`` means that
F = k d^(3/2) + c d^q d' without a limit, 0 that F = 0. So all is smooth within a step, and where a
mode has to change is a root of a smooth function.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from hertzchain.observables.compiling import ONE, compiled
from hertzchain.observables.interpolant import (
    hermite,
    quintic,
    slope_at,
    value_at,
)
from hertzchain.observables.observer import acting_force, acting_rate, power_of

PARTS = 8
"""Parts of a step in which a beginning or an end is searched."""


# Loops over all granules take single arrays: passing a whole chain costs more than a short loop.


@compiled
def forces(
    u: Any, v: Any, on: Any, f: Any, power: Any, stiffness: Any, damping: Any, gap: Any,
    exponent: float, hi: int,
) -> None:  # fmt: skip
    """Fill in the force of each contact and the power that it dissipates.

    The elastic energy of a contact that overlaps without a force counts as dissipated already.
    """
    for i in range(np.uint64(0), np.uint64(hi)):
        d = u[i] - u[i + ONE] - gap[i]
        w = v[i] - v[i + ONE]
        d = d if d > 0.0 else 0.0
        elastic = stiffness[i] * d * np.sqrt(d)
        force = on[i] * (elastic + damping[i] * power_of(d, exponent) * w)
        f[i + ONE] = force
        power[i] = (force - on[i] * elastic) * w


@compiled
def accelerations(f: Any, a: Any, inverse_mass: Any, constant: Any, hi: int, pushed: int) -> None:
    """Fill in the acceleration of each granule."""
    for i in range(np.uint64(0), np.uint64(hi)):
        a[i] = (f[i] - f[i + ONE]) * inverse_mass[i] + constant[i]
    if pushed > 0:
        a[pushed] += f[f.size - 1] * inverse_mass[pushed]


@compiled
def force_rates(
    u: Any, v: Any, a: Any, on: Any, rate: Any, stiffness: Any, damping: Any, gap: Any,
    exponent: float, hi: int,
) -> None:  # fmt: skip
    """Fill in the rate of the force of each contact."""
    for i in range(np.uint64(0), np.uint64(hi)):
        d = u[i] - u[i + ONE] - gap[i]
        w = v[i] - v[i + ONE]
        bend = a[i] - a[i + ONE]
        steep = exponent * w * w / d if d > 1e-60 else 0.0
        d = d if d > 0.0 else 0.0
        damped = damping[i] * power_of(d, exponent) * (steep + bend)
        rate[i + ONE] = on[i] * (1.5 * stiffness[i] * np.sqrt(d) * w + damped)


@compiled
def lightest(i: int, c: Any) -> float:
    """1 / mass of the lighter granule of contact i; a wall is the heavier one."""
    ahead = c.inverse_mass[i + 1] if i + 1 < c.inverse_mass.size else 0.0
    return max(c.inverse_mass[i], ahead)


@compiled
def law(d: float, w: float, i: int, c: Any) -> float:
    """Force of contact i at overlap d and closing speed w, without a limit; 0 for d <= 0."""
    return acting_force(d, w, c.stiffness[i], c.damping[i], c.exponent)


@compiled
def law_rate(d: float, w: float, bend: float, i: int, c: Any) -> float:
    """Rate of the force of ``law``; ``bend`` is the second derivative of the overlap."""
    return acting_rate(d, w, bend, c.stiffness[i], c.damping[i], c.exponent)


@compiled
def margin(d: float, w: float, i: int, pressing: bool, c: Any) -> float:
    """Positive while contact i presses or may press: its overlap, or its force over d^q if less.

    The force over d^q, k d^(3/2 - q) + c d', is smooth where d^q is not.
    """
    if c.attraction or c.damping[i] == 0.0:
        return d
    length = abs(d)
    reduced = (
        c.stiffness[i] * length * math.sqrt(length) / max(power_of(length, c.exponent), 1e-300)
    )
    reduced = math.copysign(reduced, d) + c.damping[i] * w
    if pressing:
        # With an overlap of 0 a contact that has just begun would look as if it ended.
        return reduced if d > 0.0 or w > 0.0 else min(d, reduced)
    return min(d, reduced)


@compiled
def overlap_curve(start: Any, end: Any, gap: Any, i: int, h: float) -> Any:
    """The overlap of contact i within a step, a polynomial in (t - t_start) / h."""
    u0, v0, a0, u1, v1, a1 = start.u, start.v, start.a, end.u, end.v, end.a
    return quintic(
        u0[i] - u0[i + 1] - gap[i], v0[i] - v0[i + 1], a0[i] - a0[i + 1],
        u1[i] - u1[i + 1] - gap[i], v1[i] - v1[i + 1], a1[i] - a1[i + 1], h,
    )  # fmt: skip


@compiled
def first_change(curve: Any, h: float, i: int, pressing: bool, c: Any) -> float:
    """Place in a step, from 0 to 1, where contact i first ends (``pressing``) or begins, or 2."""
    sign = -1.0 if pressing else 1.0
    left, at_left = 0.0, sign * margin(curve[0], curve[1] / h, i, pressing, c)
    for part in range(1, PARTS + 1):
        right = part / PARTS
        at_right = sign * margin(value_at(curve, right), slope_at(curve, right) / h, i, pressing, c)
        if at_right > 0.0:
            if at_left > 0.0:
                return left
            return _root(curve, h, i, pressing, sign, left, right, at_left, at_right, c)
        left, at_left = right, at_right
    return 2.0


@compiled
def _root(
    curve: Any, h: float, i: int, pressing: bool, sign: float, left: float, right: float,
    at_left: float, at_right: float, c: Any,
) -> float:  # fmt: skip
    """The root between left and right, by the method of Illinois."""
    side = 0
    for _ in range(60):
        s = (left * at_right - right * at_left) / (at_right - at_left)
        if s <= left:
            return left
        if s >= right:
            return right
        value = sign * margin(value_at(curve, s), slope_at(curve, s) / h, i, pressing, c)
        left, right, at_left, at_right, side = _narrowed(
            left, right, at_left, at_right, s, value, value > 0.0, side
        )
        if right - left < 1e-15 or value == 0.0:
            break
    return right


@compiled
def _narrowed(
    left: float, right: float, at_left: float, at_right: float, s: float, value: float,
    is_beyond: bool, side: int,
) -> Any:  # fmt: skip
    """Narrow the bracket of a root, with s before or beyond it, by the method of Illinois.

    If the same end stays twice in a row, its value is halved. ``side`` is the end that moved last.
    """
    if is_beyond:
        return left, s, at_left / 2 if side == 1 else at_left, value, 1
    return s, right, value, at_right / 2 if side == -1 else at_right, -1


@compiled
def jerk(rate: Any, i: int, c: Any) -> float:
    """The jerk of a granule, from how fast forces grow; 0 for the wall."""
    if i == c.inverse_mass.size:
        return 0.0
    net = rate[i] - rate[i + 1]
    if i == c.pushed and i > 0:
        net += rate[rate.size - 1]
    return float(net * c.inverse_mass[i])


@compiled
def end_of_septic(at: Any, i: int, c: Any) -> Any:
    """The overlap of contact i and its first three derivatives at the start or end of a step."""
    return (
        at.u[i] - at.u[i + 1] - c.gap[i], at.v[i] - at.v[i + 1], at.a[i] - at.a[i + 1],
        jerk(at.r, i, c) - jerk(at.r, i + 1, c),
    )  # fmt: skip


@compiled
def septic(start: Any, end: Any, i: int, h: float, c: Any) -> Any:
    """The overlap of contact i within a step, a polynomial of degree 7 in (t - t_start) / h."""
    return hermite(end_of_septic(start, i, c), end_of_septic(end, i, c), h)


@compiled
def keep_history(
    record: Any, kept: int, start: Any, end: Any, on: Any, hi: int, begin: float, until: float,
    c: Any,
) -> int:  # fmt: skip
    """Fill in the wanted times up to the end of a step; returns how many are filled in now."""
    h = until - begin
    while kept < record.time.size and record.time[kept] <= until:
        s = (record.time[kept] - begin) / h
        for i in range(hi):
            before = (start.u[i], start.v[i], start.a[i], jerk(start.r, i, c))
            after = (end.u[i], end.v[i], end.a[i], jerk(end.r, i, c))
            curve = hermite(before, after, h)
            record.displacement[kept, i] = value_at(curve, s)
            record.velocity[kept, i] = slope_at(curve, s) / h
            if i < record.contact_force.shape[1] and on[i] > 0.0:
                curve = septic(start, end, i, h, c)
                force = law(value_at(curve, s), slope_at(curve, s) / h, i, c)
                record.contact_force[kept, i] = force if c.attraction else max(force, 0.0)
        kept += 1
    return kept


@compiled
def held(u: Any, i: int, c: Any) -> float:
    """Elastic energy of contact i."""
    d = u[i] - u[i + 1] - c.gap[i]
    return float(0.4 * c.stiffness[i] * d * d * math.sqrt(d)) if d > 0.0 else 0.0
