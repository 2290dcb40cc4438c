"""Chains of damped contacts, integrated by an explicit Runge-Kutta method with adaptive steps.

A step is taken with the mode of each contact kept (see ``damped_contacts``). If a contact ought to
have changed its mode meanwhile, and that matters, the step is repeated up to there. The force of a
contact that begins with a closing speed grows as t^q: the first step after that is taken in
tau = t^(1/m), in which the motion is smooth, and the free flight is left out of what is integrated:
then the overlap, w tau^m and less, has all its digits in every stage.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from hertzchain.arrays import Array, FloatArray
from hertzchain.engines.native import damped_contacts, kernels
from hertzchain.engines.native.damped_contacts import (
    Contacts,
    accelerations,
    applied,
    applied_rate,
    energy,
    first_change,
    force_rates,
    forces,
    held,
    highest,
    keep_history,
    law,
    overlap_curve,
)
from hertzchain.engines.native.kernels import (
    END,
    ONE,
    SHAPE,
    START,
    Record,
    _copy,
    _is_stopped,
    _larger,
    compiled,
    compiled_and_kept,
)

DONE, DIVERGED, STOPPED, TOO_MANY = range(4)
"""How a run ended; the last: more steps than allowed."""

_AHEAD = 8
"""Granules that the window of moving granules grows by."""

_LEAST = 1e-60
"""A force below which a granule ahead of the front stays at rest."""

_DIVERGED_ENERGY = 10.0
"""Energy over the energy given to the chain in a run that has diverged."""

_LOOK = 1_000_000
"""Granules times steps between two looks at whether the run is to be stopped: about 50 ms."""

_EVENT = 0.1
"""What a mode that changes late may cost in velocity, over the tolerance of a step."""

_IDLE = 1e-3
"""Forces and overlaps that change no mode, over the tolerance of a step."""

_FRESH, _STRICTER = 0.25, 0.1
"""The longest first step of a contact over that of others, and what error it may have: estimates
in tau can be small by chance."""

_RELOCATED = 8
"""Most repetitions of a step for one change of modes; two or three are usual."""

_SHORTEST = 1e-14
"""Shortest step over the time."""

_SLOW = 1e-3
"""Speed below which errors are no longer judged by the largest speed, natural units."""


class Method(NamedTuple):
    """Coefficients of ``methods.EmbeddedRungeKutta``: shapes (stages,), ``rows`` (stages, stages)."""

    nodes: FloatArray
    rows: FloatArray
    weights: FloatArray
    fifth: FloatArray
    third: FloatArray


class Found(NamedTuple):
    """What a run found besides its peaks; see ``damped.Simulated``."""

    status: int
    steps: int
    evaluations: int
    end: float
    given: float
    dissipated: float
    momentum: float
    energy: float
    wall_impulse: float


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
def _step(
    u0: Any, v0: Any, u1: Any, v1: Any, f: Any, power: Any, ku: Any, kv: Any, on: Any, rows: Any,
    nodes: Any, weights: Any, leg: Any, begin: float, h: float, m: int, hi: int, c: Any, gained: Any,
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


@kernels._compiled_without_nan
def _error(v0: Any, v1: Any, kv: Any, fifth: Any, third: Any, size: float, hi: int) -> Any:
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
def _ratio(e5: float, e3: float, allowed: float) -> float:
    """The error of a step over what is allowed."""
    both = e5 * e5 + 0.01 * e3 * e3
    return e5 * e5 / math.sqrt(both) / allowed if both > 0.0 else 0.0


@compiled
def _differs(u: Any, v: Any, f: Any, on: Any, i: int, idle: float, c: Any) -> bool:
    """Whether contact i is in a mode that it ought not to have."""
    d = u[i] - u[i + 1] - c.gap[i]
    if on[i] > 0.0:
        return d < -idle or (f[i + 1] < -idle and not c.attraction)
    if d <= 0.0 or (c.stiffness[i] == 0.0):
        return False
    w = v[i] - v[i + 1]
    if c.attraction:
        return d > idle or w > 0.0
    return law(d, w, i, c) > idle


@compiled
def _cost(d: float, w: float, at_change: Any, late: float, ending: bool, i: int, c: Any) -> float:
    """What it costs in velocity that contact i keeps its mode for a time ``late`` too long.

    ``at_change`` is overlap and closing speed when it should have changed; d and w are those now.
    """
    if not ending:
        reached = max(d, abs(w) * late)
        return c.lightest[i] * late * abs(law(reached, abs(w), i, c))
    far, speed = max(at_change[0], 0.0), abs(at_change[1])
    if c.attraction:
        return c.lightest[i] * late * law(speed * late, speed, i, c)
    if c.damping[i] == 0.0:
        return c.lightest[i] * late * law(speed * late, 0.0, i, c)
    if d > 0.0:
        return c.lightest[i] * late * abs(law(d, w, i, c))
    held = c.lightest[i] * c.damping[i] * damped_contacts.power_of(far, c.quarters) * speed
    return held * (late if c.quarters == 0 else min(late, far / max(speed, 1e-300)))


@compiled
def _earliest(
    u0: Any, v0: Any, a0: Any, u1: Any, v1: Any, a1: Any, f1: Any, on: Any, hi: int, h: float,
    allowed: float, c: Any,
) -> Any:  # fmt: skip
    """When, from 0 to 1, a mode first changes in a step, where that matters, and whose; 2: never."""
    first, which = 2.0, -1
    idle = _IDLE * allowed
    for i in range(hi):
        d1 = u1[i] - u1[i + 1] - c.gap[i]
        pressing = on[i] > 0.0
        if pressing and d1 >= -idle and (f1[i + 1] >= -idle or c.attraction):
            continue
        d0 = u0[i] - u0[i + 1] - c.gap[i]
        w0, w1 = v0[i] - v0[i + 1], v1[i] - v1[i + 1]
        differs = _differs(u1, v1, f1, on, i, idle, c)
        if not differs:
            # It may change and change back within the step.
            if pressing or not (w0 > 0.0 and w1 < 0.0 and d0 + w0 * h > 0.0):
                continue
            if c.stiffness[i] == 0.0:
                continue
        curve = overlap_curve(u0, v0, a0, u1, v1, a1, c.gap, i, h)
        s = first_change(curve, h, i, pressing, c)
        if s >= first:
            continue
        at = (kernels._value(curve, s), kernels._slope(curve, s) / h)
        d, w = d1, w1
        if not differs:
            d, w = kernels._value(curve, 0.5), max(w0, -w1)
        if _cost(d, w, at, (1.0 - s) * h, pressing, i, c) > _EVENT * allowed:
            first, which = s, i
    return first, which


@compiled
def _begins(d: float, w: float, i: int, h: float, allowed: float, c: Any) -> bool:
    """Whether the force of a contact that begins now matters before a step h is over."""
    reached = w * h
    if w <= 0.0 or d > reached:
        return False
    return c.lightest[i] * h * law(reached, w, i, c) > _EVENT * allowed


@compiled
def _end(
    u: Any, v: Any, a: Any, f: Any, r: Any, power: Any, on: Any, leg: Any, time: float, hi: int,
    c: Any,
) -> None:  # fmt: skip
    """Forces, how fast they grow, and accelerations of a state."""
    f[0], r[0] = applied(leg, time), applied_rate(leg, time)
    forces(u, v, on, f, power, c.stiffness, c.damping, c.gap, c.quarters, hi)
    accelerations(f, a, c.inertia, c.pull, hi)
    force_rates(u, v, a, on, r, c.stiffness, c.damping, c.gap, c.quarters, hi)


@compiled
def _keep_ends(peak_force: Any, peak_time: Any, f: Any, time: float, hi: int) -> None:
    for i in range(min(hi, peak_force.size)):
        if f[i + 1] > peak_force[i]:
            peak_force[i], peak_time[i] = f[i + 1], time


@compiled
def _hidden_maximum(f0: Any, r0: Any, f1: Any, r1: Any, peak: Any, h: float, hi: int) -> bool:
    """Whether a force may have a maximum that matters within a step whose start is not smooth."""
    for i in range(min(hi, peak.size)):
        if r1[i + 1] < 0.0 and (r0[i + 1] > 0.0 or f0[i + 1] == 0.0):
            above = -r1[i + 1] * h
            if f1[i + 1] + above > peak[i] and above > 1e-12 * f1[i + 1]:
                return True
    return False


@compiled
def _keep_maxima(
    u0: Any, v0: Any, a0: Any, r0: Any, u1: Any, v1: Any, a1: Any, r1: Any, f0: Any, f1: Any,
    peak_force: Any, peak_time: Any, begin: float, h: float, hi: int, c: Any,
) -> None:  # fmt: skip
    """The maxima of contact forces within a step."""
    for i in range(min(hi, peak_force.size)):
        if r0[i + 1] > 0.0 and r1[i + 1] <= 0.0:
            reach = max(f0[i + 1], f1[i + 1]) + h * max(r0[i + 1], -r1[i + 1])
            if reach > peak_force[i]:
                force, s = highest(u0, v0, a0, r0, u1, v1, a1, r1, i, h, c)
                if force > peak_force[i]:
                    peak_force[i], peak_time[i] = force, begin + s * h


@compiled
def _start_modes(u: Any, v: Any, on: Any, c: Any) -> bool:
    """Modes at the start; returns whether a contact begins with a closing speed."""
    fresh = False
    for i in range(on.size):
        d, w = u[i] - u[i + 1] - c.gap[i], v[i] - v[i + 1]
        on[i] = 0.0
        if c.stiffness[i] > 0.0 and (d > 0.0 or (d == 0.0 and w >= 0.0)):
            on[i] = 1.0
            fresh = fresh or (d == 0.0 and w > 0.0)
    return fresh


@compiled_and_kept
def march(
    legs: FloatArray,
    method: Method,
    c: Contacts,
    start: FloatArray,
    moving: int,
    tolerance: float,
    longest: float,
    most_steps: int,
    peak_force: FloatArray,
    peak_time: FloatArray,
    record: Record,
    control: FloatArray,
) -> tuple[Found, Array, Array]:
    """Integrate a chain of damped contacts.

    Parameters
    ----------
    legs
        The applied force, shape (legs, 8): see ``kernels.START`` and what follows. Steps end where
        legs do; how many steps a leg is cut into does not matter.
    method, c
        Coefficients and chain.
    start
        Displacement and velocity at the start, shape (2, granules).
    moving
        Granules that may move at the start; all for a run without a front.
    tolerance
        Error of a step over the largest speed.
    longest
        The longest step, natural units.
    most_steps
        After so many the run ends as TOO_MANY.
    peak_force, peak_time
        Filled in; zero and NaN at the start, shape (contacts,), with a wall (granules,).
    record, control
        As for ``kernels.march``.

    Returns
    -------
    What happened, then displacement and velocity at the end, shape (granules,).
    """
    granules = c.inertia.size
    u0, v0, a0 = np.zeros(granules + 1), np.zeros(granules + 1), np.zeros(granules + 1)
    u1, v1, a1 = np.zeros(granules + 1), np.zeros(granules + 1), np.zeros(granules + 1)
    f0, r0, f1, r1 = (
        np.zeros(granules + 1), np.zeros(granules + 1), np.zeros(granules + 1),
        np.zeros(granules + 1),
    )  # fmt: skip
    f, power, on = np.zeros(granules + 1), np.zeros(granules), np.zeros(granules)
    stages = method.nodes.size
    ku, kv = np.zeros((stages, granules)), np.zeros((stages, granules))
    rows = np.zeros((stages + 1, stages))
    rows[:stages], rows[stages] = method.rows, method.weights
    gained, total = np.zeros(3), np.zeros(3)
    u0[:granules], v0[:granules] = start[0], start[1]
    fresh = _start_modes(u0, v0, on, c)
    root = 4 if c.quarters == 1 else 2
    given = energy(u0, v0, granules, c)
    hi = min(moving, granules)
    time, following, kept, steps, evaluations, spent = legs[0, START], longest / 64, 0, 0, 0, 0
    status = DONE
    if _is_stopped(control):
        status = STOPPED
    for number in range(legs.shape[0]):
        leg = legs[number]
        end = leg[END]
        _end(u0, v0, a0, f0, r0, power, on, leg, time, hi, c)
        _keep_ends(peak_force, peak_time, f0, time, hi)
        following = min(following, longest / 4)
        while status == DONE and time < end:
            h, tried, target, smooth = min(following, longest), 0, -1, following
            if time + 1.01 * h >= end:
                h = end - time
            shortest = _SHORTEST * (1.0 + abs(time))
            while True:
                m = root if fresh else 1
                if fresh:
                    h = min(h, _FRESH * longest)
                if fresh and kept < record.time.size and record.time[kept] > time + shortest:
                    h = min(h, record.time[kept] - time)
                hi = _step(
                    u0, v0, u1, v1, f, power, ku, kv, on, rows, method.nodes, method.weights, leg,
                    time, h, m, hi, c, gained,
                )  # fmt: skip
                evaluations += stages
                spent += stages * hi
                e5, e3, fastest = _error(
                    v0, v1, kv, method.fifth, method.third, h if m == 1 else h ** (1.0 / m), hi
                )
                allowed = tolerance * max(fastest, _SLOW)
                error = _ratio(e5, e3, allowed * (_STRICTER if fresh else 1.0))
                if error > 1.0 and h > shortest:
                    h *= max(0.1, 0.9 * error ** (-1 / 8)) ** m
                    smooth = h
                    continue
                after = time + h if h < end - time else end
                _end(u1, v1, a1, f1, r1, power, on, leg, after, hi, c)
                if h > shortest and tried < _RELOCATED:
                    s, which = _earliest(u0, v0, a0, u1, v1, a1, f1, on, hi, h, allowed, c)
                    if which >= 0:
                        tried += 1
                        if s * h > shortest:
                            h, target = s * h, which
                            continue
                        d, w = u0[which] - u0[which + 1] - c.gap[which], v0[which] - v0[which + 1]
                        total[1] += held(u0, which, c) * (2.0 * on[which] - 1.0)
                        on[which] = 1.0 - on[which]
                        fresh = fresh or (on[which] > 0.0 and _begins(d, w, which, h, allowed, c))
                        _end(u0, v0, a0, f0, r0, power, on, leg, time, hi, c)
                        _keep_ends(peak_force, peak_time, f0, time, hi)
                        continue
                if fresh and h > shortest and _hidden_maximum(f0, r0, f1, r1, peak_force, h, hi):
                    h /= 4
                    smooth = h
                    continue
                break
            begin, time = time, after
            steps += 1
            for k in range(3):
                total[k] += gained[k]
            if not fresh:
                _keep_maxima(
                    u0, v0, a0, r0, u1, v1, a1, r1, f0, f1, peak_force, peak_time, begin, h, hi, c
                )
            _keep_ends(peak_force, peak_time, f1, time, hi)
            if kept < record.time.size and record.time[kept] <= time:
                kept = keep_history(
                    record, kept, u0, v0, a0, r0, u1, v1, a1, r1, on, hi, begin, time, c
                )
            grown = min(4.0, 0.9 * max(error, 1e-10) ** (-1 / 8))
            following = max(smooth, h * grown) if target >= 0 else h * grown**m
            was_fresh, fresh, changed = fresh, False, False
            for i in range(hi):
                wrong = _differs(u1, v1, f1, on, i, _IDLE * allowed, c)
                d, w = u1[i] - u1[i + 1] - c.gap[i], v1[i] - v1[i + 1]
                if i == target and not wrong:
                    ending = on[i] > 0.0
                    late = abs(d / w) if w != 0.0 else 0.0
                    if ending and not c.attraction and c.damping[i] > 0.0:
                        late = abs(f1[i + 1] / r1[i + 1]) if r1[i + 1] != 0.0 else 0.0
                    wrong = _cost(d, w, (d, w), late, ending, i, c) <= _EVENT * allowed
                if wrong:
                    changed = True
                    total[1] += held(u1, i, c) if on[i] > 0.0 else -held(u1, i, c)
                    on[i] = 1.0 - on[i]
                    if on[i] > 0.0 and _begins(d, w, i, following, allowed, c):
                        fresh = True
            _copy(u1, u0, 0, hi)
            _copy(v1, v0, 0, hi)
            if changed:
                _end(u0, v0, a0, f0, r0, power, on, leg, time, hi, c)
                _keep_ends(peak_force, peak_time, f0, time, hi)
            else:
                _copy(a1, a0, 0, hi)
                _copy(f1, f0, 0, hi + 1)
                _copy(r1, r0, 0, hi + 1)
            if was_fresh and not fresh:
                following = min(following, h)
            if steps >= most_steps:
                status = TOO_MANY
            if spent >= _LOOK:
                spent = 0
                control[1], control[2] = time, control[2] + 1
                if _is_stopped(control):
                    status = STOPPED
                elif not energy(u0, v0, hi, c) <= _DIVERGED_ENERGY * (given + total[0]):
                    status = DIVERGED
        if status != DONE:
            break
    left = energy(u0, v0, hi, c)
    momentum = 0.0
    for i in range(hi):
        if on[i] == 0.0:
            total[1] -= held(u0, i, c)
        momentum += v0[i] / c.inertia[i]
    if status == DONE and not left <= _DIVERGED_ENERGY * (given + total[0]):
        status = DIVERGED
    found = Found(
        status, steps, evaluations, time, given + total[0], total[1], momentum, left, total[2]
    )
    return found, u0[:granules], v0[:granules]
