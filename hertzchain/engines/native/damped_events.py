"""When damped contacts change their mode, whether that matters, and their highest forces, compiled.

See ``damped_contacts`` for what a mode is.
"""

from __future__ import annotations

import math
from typing import Any

from hertzchain.engines.native.damped_contacts import (
    end_of_septic,
    first_change,
    law,
    law_rate,
    lightest,
    overlap_curve,
)
from hertzchain.observables.compiling import compiled
from hertzchain.observables.interpolant import slope_at, value_at
from hertzchain.observables.observer import has_news, highest, look, power_of

EVENT = 0.1
"""Error of velocity that a late change of mode may cause, over the tolerance of a step."""

NEAR = 0.02
"""Part of a step at its ends (chosen) in which a maximum has no error by interpolation: it is that
of the middle times (4 s (1 - s))^4, 4e-5."""

IDLE = 1e-3
"""Forces and overlaps too small to change a mode, over the tolerance of a step."""


@compiled
def in_wrong_mode(at: Any, on: Any, i: int, idle: float, c: Any) -> bool:
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
def cost(d: float, w: float, at_change: Any, late: float, ending: bool, i: int, c: Any) -> float:
    """Error of velocity if contact i keeps its mode for a time ``late`` too long.

    ``at_change`` is overlap and closing speed when it should have changed; d and w are those now.
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
    held = lightest(i, c) * c.damping[i] * power_of(far, c.exponent) * speed
    return held * (late if c.exponent == 0 else min(late, far / max(speed, 1e-300)))


@compiled
def lateness(d: float, w: float, bend: float, i: int, c: Any) -> float:
    """How far in time contact i is from the change of its mode, before or after.

    The mode changes where the overlap is 0, or the force if a damper can make it 0 before that.
    """
    if w < 0.0 < d and not c.attraction and c.damping[i] > 0.0:
        force, rate = law(d, w, i, c), law_rate(d, w, bend, i, c)
        return abs(force / rate) if rate != 0.0 else 0.0
    return abs(d / w) if w != 0.0 else 0.0


@compiled
def begins(d: float, w: float, i: int, h: float, allowed: float, c: Any) -> bool:
    """Whether the force of a contact that begins now matters before a step h is over."""
    reached = w * h
    if w <= 0.0 or d > reached:
        return False
    return lightest(i, c) * h * law(reached, w, i, c) > EVENT * allowed


@compiled
def _dips(start: Any, end: Any, h: float, i: int, allowed: float, c: Any) -> bool:
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
    start: Any, end: Any, on: Any, hi: int, h: float, allowed: float, idle: float, c: Any
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
def keep_ends(seen: Any, f: Any, time: float, hi: int) -> None:
    """Keep the forces of an instant that are higher than all before."""
    for i in range(min(hi, seen.force.size)):
        if f[i + 1] > seen.force[i]:
            seen.force[i], seen.time[i] = f[i + 1], time


@compiled
def hidden_maximum(start: Any, end: Any, seen: Any, h: float, hi: int) -> bool:
    """Whether a force may have a maximum that matters within a step whose start is not smooth."""
    for i in range(min(hi, seen.force.size)):
        if end.r[i + 1] < 0.0 and (start.r[i + 1] > 0.0 or start.f[i + 1] == 0.0):
            above = -end.r[i + 1] * h
            if end.f[i + 1] + above > seen.force[i] and above > 1e-12 * end.f[i + 1]:
                return True
    return False


@compiled
def _maximum(start: Any, end: Any, i: int, above: float, h: float, c: Any) -> Any:
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
        c.exponent, 1.0 if c.attraction else 0.0,
    )  # fmt: skip
    return (force, s) if reach >= force > above else (0.0, 0.0)


@compiled
def keep_maxima(start: Any, end: Any, seen: Any, begin: float, h: float, hi: int, c: Any) -> None:
    """The maxima of contact forces within a step."""
    for i in range(min(hi, seen.force.size)):
        force, s = _maximum(start, end, i, seen.force[i], h, c)
        if force > 0.0:
            seen.force[i], seen.time[i] = force, begin + s * h


@compiled
def first_maximum(start: Any, end: Any, seen: Any, h: float, hi: int, c: Any) -> float:
    """Place in a step, from 0 to 1, of the first maximum that is not near an end of it; or 1."""
    first = 1.0
    for i in range(min(hi, seen.force.size)):
        force, s = _maximum(start, end, i, seen.force[i], h, c)
        if force > 0.0 and NEAR < s < min(first, 1.0 - NEAR):
            first = s
    return first


@compiled
def _acting(contact: int, chosen: Any, hi: int, c: Any) -> int:
    """Place in a part of the chain of one of its contacts; -1 where it is not there, or open."""
    for n in range(hi):
        if chosen[n] == contact and c.stiffness[n] > 0.0:
            return n
    return -1


@compiled
def observe(
    watch: Any, start: Any, end: Any, begin: float, h: float, fresh: bool, hi: int, c: Any,
    chosen: Any,
) -> None:  # fmt: skip
    """Look at the contacts, and at gauges in granules, within a step.

    A step that is ``fresh`` has no rates at its start. Contact i is ``chosen[i]`` of the chain; in
    a part of the chain contacts without stiffness are open, wherever their granules are.
    """
    nothing = (0.0, 0.0, 0.0, 0.0)
    contacts = watch.contacts[0]
    for n in range(min(hi, chosen.size)):
        k = chosen[n]
        if k < contacts:
            acting = n if c.stiffness[n] > 0.0 else -1
            _look(watch, k, acting, watch.signals[k].other, start, end, begin, h, fresh, c, nothing)
    for k in range(contacts, watch.signals.size):
        i = _acting(watch.signals[k].contact, chosen, hi, c)
        j = _acting(watch.signals[k].other, chosen, hi, c)
        if i >= 0 or j >= 0:
            _look(watch, k, i, j, start, end, begin, h, fresh, c, nothing)


@compiled
def _is_monotone(rise: float, end_rise: float, grown: float) -> bool:
    """Whether the cubic with these rates, times the step, and this growth has no extremum.

    It tells where an overlap is too small for its digits to give a force within the step.
    """
    if rise >= 0.0 and end_rise >= 0.0:
        return max(rise, end_rise) <= 3.0 * grown
    return rise <= 0.0 and end_rise <= 0.0 and min(rise, end_rise) >= 3.0 * grown


@compiled
def _look(
    watch: Any, k: int, i: int, j: int, start: Any, end: Any, begin: float, h: float, fresh: bool,
    c: Any, nothing: Any,
) -> None:  # fmt: skip
    """Look at a signal whose contacts are i and j here; -1 for none, or one that does not act."""
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
    look(watch, k, begin, h, first, last, before, after, 1.0, 1.0, f0, f1, smooth)


@compiled
def start_modes(u: Any, v: Any, on: Any, c: Any) -> bool:
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
