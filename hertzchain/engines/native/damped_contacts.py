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
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.engines.native.elastic_chain import Array, Record, Seen
from hertzchain.engines.native.equations import Chain
from hertzchain.observables.compiling import ONE, compiled
from hertzchain.observables.observer import (
    PARTS,
    Polynomial,
    Step,
    Watch,
    acting_force,
    acting_rate,
    has_news,
    hermite,
    highest,
    look,
    power_of,
    quintic,
    slope_at,
    value_at,
)


class Motion(NamedTuple):
    """A chain at the start or at the end of a step, shape (granules + 2,).

    Displacements, velocities, accelerations; forces, how fast they grow, and the power that
    contacts dissipate.
    """

    u: FloatArray
    v: FloatArray
    a: FloatArray
    f: FloatArray
    r: FloatArray
    power: FloatArray


Indices = NDArray[np.int64]
Pair = tuple[float, float]
"""A value and its rate, or the two ends of a step."""
Stride = tuple[float, float, bool]
"""Begin and length of a step, and whether it is ``fresh``."""


# Loops over all granules take single arrays: passing a whole chain costs more than a short loop.


@compiled
def forces(
    u: Array, v: Array, on: Array, f: Array, power: Array, stiffness: Array, damping: Array,
    gap: Array, damping_exponent: float, hi: int,
) -> None:  # fmt: skip
    """Fill in the force of each contact and the power that it dissipates.

    The elastic energy of a contact that overlaps without a force counts as dissipated already.
    """
    for i in range(np.uint64(0), np.uint64(hi)):
        d = u[i] - u[i + ONE] - gap[i]
        w = v[i] - v[i + ONE]
        d = d if d > 0.0 else 0.0
        elastic = stiffness[i] * d * np.sqrt(d)
        force = on[i] * (elastic + damping[i] * power_of(d, damping_exponent) * w)
        f[i + ONE] = force
        power[i] = (force - on[i] * elastic) * w


@compiled
def accelerations(
    f: Array, a: Array, inverse_mass: Array, constant: Array, hi: int, pushed: int
) -> None:
    """Fill in the acceleration of each granule."""
    for i in range(np.uint64(0), np.uint64(hi)):
        a[i] = (f[i] - f[i + ONE]) * inverse_mass[i] + constant[i]
    if pushed > 0:
        a[pushed] += f[f.size - 1] * inverse_mass[pushed]


@compiled
def force_rates(
    u: Array, v: Array, a: Array, on: Array, rate: Array, stiffness: Array, damping: Array,
    gap: Array, damping_exponent: float, hi: int,
) -> None:  # fmt: skip
    """Fill in the rate of the force of each contact."""
    for i in range(np.uint64(0), np.uint64(hi)):
        d = u[i] - u[i + ONE] - gap[i]
        w = v[i] - v[i + ONE]
        bend = a[i] - a[i + ONE]
        steep = damping_exponent * w * w / d if d > TINY else 0.0
        d = d if d > 0.0 else 0.0
        damped = damping[i] * power_of(d, damping_exponent) * (steep + bend)
        rate[i + ONE] = on[i] * (1.5 * stiffness[i] * np.sqrt(d) * w + damped)


@compiled
def lightest(i: int, c: Chain) -> float:
    """1 / mass of the lighter granule of contact i; a wall is the heavier one."""
    ahead = c.inverse_mass[i + 1] if i + 1 < c.inverse_mass.size else 0.0
    return max(c.inverse_mass[i], ahead)


@compiled
def law(d: float, w: float, i: int, c: Chain) -> float:
    """Force of contact i at overlap d and closing speed w, without a limit; 0 for d <= 0."""
    return acting_force(d, w, c.stiffness[i], c.damping[i], c.damping_exponent)


@compiled
def law_rate(d: float, w: float, bend: float, i: int, c: Chain) -> float:
    """Rate of the force of ``law``; ``bend`` is the second derivative of the overlap."""
    return acting_rate(d, w, bend, c.stiffness[i], c.damping[i], c.damping_exponent)


@compiled
def margin(d: float, w: float, i: int, pressing: bool, c: Chain) -> float:
    """Positive while contact i presses or may press: its overlap, or its force over d^q if less.

    The force over d^q, k d^(3/2 - q) + c d', is smooth where d^q is not.
    """
    if c.attraction or c.damping[i] == 0.0:
        return d
    length = abs(d)
    reduced = (
        c.stiffness[i]
        * length
        * math.sqrt(length)
        / max(power_of(length, c.damping_exponent), 1e-300)
    )
    reduced = math.copysign(reduced, d) + c.damping[i] * w
    if pressing:
        # With an overlap of 0 a contact that has just begun would look as if it ended.
        return reduced if d > 0.0 or w > 0.0 else min(d, reduced)
    return min(d, reduced)


@compiled
def overlap_curve(start: Motion, end: Motion, gap: Array, i: int, h: float) -> Any:
    """The overlap of contact i within a step, a polynomial in (t - t_start) / h."""
    u0, v0, a0, u1, v1, a1 = start.u, start.v, start.a, end.u, end.v, end.a
    return quintic(
        u0[i] - u0[i + 1] - gap[i], v0[i] - v0[i + 1], a0[i] - a0[i + 1],
        u1[i] - u1[i + 1] - gap[i], v1[i] - v1[i + 1], a1[i] - a1[i + 1], h,
    )  # fmt: skip


@compiled
def first_change(curve: Polynomial, h: float, i: int, pressing: bool, c: Chain) -> float:
    """Place in a step, from 0 to 1, where contact i first ends (``pressing``) or begins, or 2."""
    sign = -1.0 if pressing else 1.0
    left, at_left = 0.0, sign * margin(curve[0], curve[1] / h, i, pressing, c)
    for part in range(1, PARTS + 1):
        right = part / PARTS
        at_right = sign * margin(value_at(curve, right), slope_at(curve, right) / h, i, pressing, c)
        if at_right > 0.0:
            if at_left > 0.0:
                return left
            return _root(curve, h, i, pressing, (left, right, at_left, at_right), c)
        left, at_left = right, at_right
    return 2.0


@compiled
def _root(
    curve: Polynomial, h: float, i: int, pressing: bool, bracket: tuple[float, float, float, float],
    c: Chain,
) -> float:  # fmt: skip
    """The root within a bracket, two places and the values there, by the method of Illinois."""
    left, right, at_left, at_right = bracket
    sign, side = -1.0 if pressing else 1.0, 0
    for _ in range(60):
        s = (left * at_right - right * at_left) / (at_right - at_left)
        if s <= left:
            return left
        if s >= right:
            return right
        value = sign * margin(value_at(curve, s), slope_at(curve, s) / h, i, pressing, c)
        if value > 0.0:
            at_left = at_left / 2 if side == 1 else at_left
            right, at_right, side = s, value, 1
        else:
            at_right = at_right / 2 if side == -1 else at_right
            left, at_left, side = s, value, -1
        if right - left < 1e-15 or value == 0.0:
            break
    return right


@compiled
def jerk(rate: Array, i: int, c: Chain) -> float:
    """The jerk of a granule, from how fast forces grow; 0 for the wall."""
    if i == c.inverse_mass.size:
        return 0.0
    net = rate[i] - rate[i + 1]
    if i == c.pushed and i > 0:
        net += rate[rate.size - 1]
    return float(net * c.inverse_mass[i])


@compiled
def end_of_septic(at: Motion, i: int, c: Chain) -> Any:
    """The overlap of contact i and its first three derivatives at the start or end of a step."""
    return (
        at.u[i] - at.u[i + 1] - c.gap[i], at.v[i] - at.v[i + 1], at.a[i] - at.a[i + 1],
        jerk(at.r, i, c) - jerk(at.r, i + 1, c),
    )  # fmt: skip


@compiled
def keep_history(
    record: Record, kept: int, start: Motion, end: Motion, on: Array, hi: int, span: Pair, c: Chain
) -> int:
    """Fill in the wanted times up to the end of a step; returns how many are filled in now.

    ``span`` is the begin and the end of the step.
    """
    begin, until = span
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
                curve = hermite(end_of_septic(start, i, c), end_of_septic(end, i, c), h)
                force = law(value_at(curve, s), slope_at(curve, s) / h, i, c)
                record.contact_force[kept, i] = force if c.attraction else max(force, 0.0)
        kept += 1
    return kept


@compiled
def held(u: Array, i: int, c: Chain) -> float:
    """Elastic energy of contact i."""
    d = u[i] - u[i + 1] - c.gap[i]
    return float(0.4 * c.stiffness[i] * d * d * math.sqrt(d)) if d > 0.0 else 0.0


TINY = 1e-60
"""Forces, overlaps and squares of errors that count as 0."""

EVENT = 0.1
"""Error of velocity that a late change of mode may cause, over the tolerance of a step."""

IDLE = 1e-3
"""Forces and overlaps too small to change a mode, over the tolerance of a step."""


@compiled
def in_wrong_mode(at: Motion, on: Array, i: int, idle: float, c: Chain) -> bool:
    """Whether contact i is in a mode that it should not have.

    Under a strong damper a contact opens endlessly, with a force of almost 0 that would keep steps
    short: such a force is ignored.
    """
    d, w = at.u[i] - at.u[i + 1] - c.gap[i], at.v[i] - at.v[i + 1]
    if on[i] > 0.0:
        if c.attraction or c.damping[i] == 0.0:
            return d < -idle
        return d < -idle or at.f[i + 1] < (idle if w < 0.0 < d else -idle)
    if d <= 0.0 or (c.stiffness[i] == 0.0):
        return False
    if c.attraction:
        return d > idle or w > 0.0
    return law(d, w, i, c) > idle


@compiled
def cost(d: float, w: float, at_change: Pair, late: float, ending: bool, i: int, c: Chain) -> float:
    """Error of velocity if contact i keeps its mode for a time ``late`` too long.

    ``at_change`` has overlap and closing speed when the mode should have changed; d and w are the
    current ones.
    """
    if not ending:
        if at_change[0] > 0.0 and at_change[1] < 0.0:  # it opens, slowly enough to press again
            return lightest(i, c) * late * abs(law(d, w, i, c))
        reached = max(d, abs(w) * late)
        return lightest(i, c) * late * abs(law(reached, abs(w), i, c))
    far, speed = max(at_change[0], 0.0), abs(at_change[1])
    if c.attraction:
        return lightest(i, c) * late * law(speed * late, speed, i, c)
    if c.damping[i] == 0.0:
        return lightest(i, c) * late * law(speed * late, 0.0, i, c)
    if d > 0.0:
        return lightest(i, c) * late * abs(law(d, w, i, c))
    held = lightest(i, c) * c.damping[i] * power_of(far, c.damping_exponent) * speed
    return held * (late if c.damping_exponent == 0 else min(late, far / max(speed, 1e-300)))


@compiled
def lateness(d: float, w: float, bend: float, i: int, c: Chain) -> float:
    """Return the time between now and the change of mode of contact i, past or future.

    The mode changes where the overlap is 0, or the force if a damper can make it 0 before that.
    """
    if w < 0.0 < d and not c.attraction and c.damping[i] > 0.0:
        force, rate = law(d, w, i, c), law_rate(d, w, bend, i, c)
        return abs(force / rate) if rate != 0.0 else 0.0
    return abs(d / w) if w != 0.0 else 0.0


@compiled
def begins(d: float, w: float, i: int, h: float, allowed: float, c: Chain) -> bool:
    """Whether the force of a contact that begins now matters before a step h is over."""
    reached = w * h
    if w <= 0.0 or d > reached:
        return False
    return lightest(i, c) * h * law(reached, w, i, c) > EVENT * allowed


@compiled
def _dips(start: Pair, end: Pair, h: float, i: int, allowed: float, c: Chain) -> bool:
    """Whether contact i may end and begin again within a step with a noticeable effect.

    Start and end are value and rate of its force, with attraction of its overlap. If the force is
    convex, it is not below the point where the tangents meet.
    """
    fall, rise = start[1], end[1]
    if not fall < 0.0 < rise:
        return False
    lowest = start[0] + fall * (end[0] - start[0] - rise * h) / (fall - rise)
    if c.attraction:
        return bool(lowest < 0.0)
    return bool(-lightest(i, c) * h * lowest > EVENT * allowed)


@compiled
def earliest(
    start: Motion, end: Motion, on: Array, hi: int, h: float, allowed: float, idle: float, c: Chain
) -> Any:
    """Place in a step of the first change of mode that matters, from 0 to 1 or 2; its contact."""
    u0, v0, u1, v1 = start.u, start.v, end.u, end.v
    first, which = 2.0, -1
    for i in range(hi):
        d1 = u1[i] - u1[i + 1] - c.gap[i]
        pressing = on[i] > 0.0
        differs = not pressing or d1 < -idle or (end.f[i + 1] < -idle and not c.attraction)
        if not differs:
            # A force, or an overlap, may fall to 0 and rise again.
            if c.attraction:
                before = u0[i] - u0[i + 1] - c.gap[i], v0[i] - v0[i + 1]
                after = d1, v1[i] - v1[i + 1]
            else:
                before, after = (start.f[i + 1], start.r[i + 1]), (end.f[i + 1], end.r[i + 1])
            if _dips(before, after, h, i, allowed, c):
                curve = overlap_curve(start, end, c.gap, i, h)
                s = first_change(curve, h, i, pressing, c)
                if s < first:
                    first, which = s, i
            continue
        d0 = u0[i] - u0[i + 1] - c.gap[i]
        w0, w1 = v0[i] - v0[i + 1], v1[i] - v1[i + 1]
        differs = in_wrong_mode(end, on, i, idle, c)
        if not differs and (c.stiffness[i] == 0.0 or not (w0 > 0.0 and w1 < 0.0)):
            continue
        if not differs and d0 + w0 * h <= 0.0:
            continue
        curve = overlap_curve(start, end, c.gap, i, h)
        s = first_change(curve, h, i, pressing, c)
        if s >= first:
            continue
        at = (value_at(curve, s), slope_at(curve, s) / h)
        d, w = d1, w1
        if not differs:
            d, w = value_at(curve, 0.5), max(w0, -w1)
        if cost(d, w, at, (1.0 - s) * h, pressing, i, c) > EVENT * allowed:
            first, which = s, i
    return first, which


@compiled
def keep_ends(seen: Seen, f: Array, time: float, hi: int) -> None:
    """Keep the forces of an instant that are higher than all before."""
    for i in range(min(hi, seen.force.size)):
        if f[i + 1] > seen.force[i]:
            seen.force[i], seen.time[i] = f[i + 1], time


@compiled
def hidden_maximum(start: Motion, end: Motion, seen: Seen, h: float, hi: int) -> bool:
    """Whether a force may have a maximum that matters within a step whose start is not smooth."""
    for i in range(min(hi, seen.force.size)):
        if end.r[i + 1] < 0.0 and (start.r[i + 1] > 0.0 or start.f[i + 1] == 0.0):
            above = -end.r[i + 1] * h
            if end.f[i + 1] + above > seen.force[i] and above > 1e-12 * end.f[i + 1]:
                return True
    return False


@compiled
def _maximum(start: Motion, end: Motion, i: int, above: float, h: float, c: Chain) -> Any:
    """A maximum within a step of the force of contact i that is above a force, and its place."""
    f0, f1 = start.f[i + 1], end.f[i + 1]
    rise, end_rise, grown = start.r[i + 1] * h, end.r[i + 1] * h, f1 - f0
    if _is_monotone(rise, end_rise, grown):
        return 0.0, 0.0
    reach = max(f0, f1) + max(abs(rise), abs(end_rise))
    if not reach > above:
        return 0.0, 0.0
    force, s = highest(
        end_of_septic(start, i, c), end_of_septic(end, i, c), h, c.stiffness[i], c.damping[i],
        c.damping_exponent, 1.0 if c.attraction else 0.0,
    )  # fmt: skip
    return (force, s) if reach >= force > above else (0.0, 0.0)


@compiled
def keep_maxima(
    start: Motion, end: Motion, seen: Seen, begin: float, h: float, hi: int, c: Chain
) -> None:
    """The maxima of contact forces within a step."""
    for i in range(min(hi, seen.force.size)):
        force, s = _maximum(start, end, i, seen.force[i], h, c)
        if force > 0.0:
            seen.force[i], seen.time[i] = force, begin + s * h


@compiled
def first_maximum(start: Motion, end: Motion, seen: Seen, h: float, hi: int, c: Chain) -> float:
    """Place in a step, from 0 to 1, of the first maximum that is not near an end of it; or 1."""
    first = 1.0
    for i in range(min(hi, seen.force.size)):
        force, s = _maximum(start, end, i, seen.force[i], h, c)
        # Interpolation errs by (4 s (1 - s))^4 of its error in the middle of a step: 4e-5 here.
        if force > 0.0 and 0.02 < s < min(first, 1.0 - 0.02):
            first = s
    return first


@compiled
def _acting(contact: int, chosen: Indices, hi: int, c: Chain) -> int:
    """Place in a part of the chain of one of its contacts; -1 where it is not there, or open."""
    for n in range(hi):
        if chosen[n] == contact and c.stiffness[n] > 0.0:
            return n
    return -1


@compiled
def observe(
    watch: Watch, start: Motion, end: Motion, span: Stride, hi: int, c: Chain, chosen: Indices
) -> None:
    """Look at the contacts, and at gauges in granules, within a step.

    ``span`` is the begin of the step, its length and whether it is ``fresh``, without rates at its
    start. Contact i is ``chosen[i]`` of the chain; in a part of the chain contacts without
    stiffness are open, wherever their granules are.
    """
    contacts = watch.contacts[0]
    for n in range(min(hi, chosen.size)):
        k = chosen[n]
        if k < contacts:
            acting = n if c.stiffness[n] > 0.0 else -1
            _look(watch, k, acting, watch.signals[k].other, start, end, span, c)
    for k in range(contacts, watch.signals.size):
        i = _acting(watch.signals[k].contact, chosen, hi, c)
        j = _acting(watch.signals[k].other, chosen, hi, c)
        if i >= 0 or j >= 0:
            _look(watch, k, i, j, start, end, span, c)


@compiled
def _is_monotone(rise: float, end_rise: float, grown: float) -> bool:
    """Whether the cubic with these rates, times the step, and this growth has no extremum.

    It shows where an overlap is too small for its digits to give a force within the step.
    """
    if rise >= 0.0 and end_rise >= 0.0:
        return max(rise, end_rise) <= 3.0 * grown
    return rise <= 0.0 and end_rise <= 0.0 and min(rise, end_rise) >= 3.0 * grown


@compiled
def _look(
    watch: Watch, k: int, i: int, j: int, start: Motion, end: Motion,
    span: tuple[float, float, bool], c: Chain,
) -> None:  # fmt: skip
    """Look at a signal whose contacts are i and j here; -1 for none, or one that does not act."""
    (begin, h, fresh), nothing = span, (0.0, 0.0, 0.0, 0.0)
    s = watch.signals[k]
    f0, f1, rise, end_rise = 0.0, 0.0, 0.0, 0.0
    for n in (i, j):
        if n >= 0:
            f0, f1 = f0 + s.weight * start.f[n + 1], f1 + s.weight * end.f[n + 1]
            rise, end_rise = (
                rise + s.weight * h * start.r[n + 1],
                end_rise + s.weight * h * end.r[n + 1],
            )
    smooth = not fresh and not _is_monotone(rise, end_rise, f1 - f0)
    reach = math.inf if fresh else abs(rise) + abs(end_rise)
    if not has_news(s, min(f0, f1) - reach, max(f0, f1) + reach):
        return
    first, last, before, after = nothing, nothing, nothing, nothing
    if i >= 0:
        first, last = end_of_septic(start, i, c), end_of_septic(end, i, c)
    if j >= 0:
        before, after = end_of_septic(start, j, c), end_of_septic(end, j, c)
    if fresh:
        first = first[0], first[1], first[2], math.nan
        before = before[0], before[1], before[2], math.nan
    look(watch, k, Step(begin, h, first, last, before, after, 1.0, 1.0), f0, f1, smooth)


@compiled
def start_modes(u: Array, v: Array, on: Array, c: Chain) -> bool:
    """Modes at the start; returns whether a contact begins with a closing speed."""
    fresh = False
    for i in range(on.size):
        d, w = u[i] - u[i + 1] - c.gap[i], v[i] - v[i + 1]
        on[i] = 0.0
        presses = w > 0.0 or (w == 0.0 and i + 1 != c.pushed)  # the shock opens the one behind it
        if c.stiffness[i] > 0.0 and (d > 0.0 or (d == 0.0 and presses)):
            on[i] = 1.0
            fresh = fresh or (d == 0.0 and w > 0.0)
    return fresh
