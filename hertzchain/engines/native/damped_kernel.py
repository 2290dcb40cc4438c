"""Chains of damped contacts, integrated by an explicit Runge-Kutta method with adaptive steps.

A step is taken with the mode of each contact kept (see ``damped_contacts``). If a contact ought to
have changed its mode meanwhile, and that matters, the step is repeated up to there. The force of a
contact that begins with a closing speed grows as t^q: the first step after that is taken in
tau = t^(1/m), in which the motion is smooth, and the free flight is left out of what is integrated:
then the overlap, w tau^m and less, has all its digits in every stage.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from hertzchain.arrays import Array, FloatArray
from hertzchain.engines.native import damped_contacts, damped_events, damped_step, kernels
from hertzchain.engines.native.damped_contacts import (
    Contacts,
    energy,
    held,
    keep_history,
)
from hertzchain.engines.native.damped_events import (
    EVENT,
    IDLE,
    begins,
    cost,
    earliest,
    hidden_maximum,
    in_wrong_mode,
    keep_ends,
    keep_maxima,
    lateness,
    start_modes,
)
from hertzchain.engines.native.damped_step import (
    error_ratio,
    errors,
    evaluate,
    rate_of_dampers,
    take_step,
)
from hertzchain.engines.native.kernels import (
    END,
    PLACE,
    START,
    VELOCITY,
    Record,
    _is_stopped,
    compiled,
    compiled_and_kept_with,
)

DONE, DIVERGED, STOPPED, TOO_MANY = range(4)
"""How a run ended; the last: more steps than allowed."""

_DIVERGED_ENERGY = 10.0
"""Energy over the energy given to the chain in a run that has diverged."""

_LOOK = 1_000_000
"""Granules times steps between two looks at whether the run is to be stopped: about 50 ms."""

_FRESH, _STRICTER = 0.25, 0.1
"""The longest first step of a contact over that of others, and what error it may have: estimates
in tau can be small by chance."""

_RELOCATED = 8
"""Most repetitions of a step for one change of modes; two or three are usual."""

_OF_STROKE = 0.25
"""The first step of a stroke of the piston over the longest step and the stroke: a short stroke is
not one step in both of two runs that are to tell errors from one another (chosen)."""

_STABLE = 5.0
"""Longest step times the rate at which dampers stop motions: there the method leaves 0.06 of such a
motion, and above 6.4 it makes it grow (derived from its coefficients). With longer steps errors
grow to what is allowed, and modes change to and fro with them."""

_STRONG = 4.0
"""The rate, natural units, above which errors of forces are larger than those of velocities: that
of a damper of 1 between granules of mass 1."""

_FINEST = 1e-13
"""Error of a step over the largest speed, at least: less is rounding (chosen)."""

_SHORTEST = 1e-14
"""Shortest step over the time."""

_SLOW = 1e-3
"""Speed below which errors are no longer judged by the largest speed, natural units."""


class Method(NamedTuple):
    """Coefficients of an ``EmbeddedRungeKutta``; shape (stages,).

    ``rows``, of shape (stages + 1, stages), ends with the weights; ``squares`` is their product
    with the rows of the stages, which makes displacements of accelerations.
    """

    nodes: FloatArray
    rows: FloatArray
    squares: FloatArray
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
    piston_impulse: float


@compiled
def _copy(what: Any, to: Any, lo: int, hi: int) -> None:
    for i in range(np.uint64(lo), np.uint64(hi)):
        to[i] = what[i]


@compiled
def _is_diverged(left: float, given: float, total: Any, c: Any) -> bool:
    """Whether the chain has far more energy than it was given; see ``kernels._is_diverged``."""
    if c.inertia[0] == 0.0:
        return not abs(left) <= _DIVERGED_ENERGY * (abs(given) + total[4])
    return not left <= _DIVERGED_ENERGY * (given + total[0])


@compiled_and_kept_with(damped_contacts, damped_events, damped_step, kernels)
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
    p0, p1, lost = np.zeros(granules), np.zeros(granules), np.zeros(granules)
    k, bent = np.zeros((method.nodes.size, granules)), np.zeros(method.rows.shape)
    # Work, what was dissipated, impulses of wall and piston, work of a piston without its sign.
    gained, total = np.zeros(4), np.zeros(5)
    u0[:granules], v0[:granules] = start[0], start[1]
    fresh = start_modes(u0, v0, on, c)
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
        if c.inertia[0] == 0.0:
            u0[0], v0[0] = leg[PLACE], leg[VELOCITY]
            d, w = u0[0] - u0[1] - c.gap[0], v0[0] - v0[1]
            allowed = tolerance * max(abs(w), _SLOW)
            evaluate(u0, v0, a0, f0, r0, p0, on, leg, time, hi, c)
            if in_wrong_mode(u0, v0, f0, on, 0, IDLE * allowed, c):  # its velocity has jumped
                total[1] += held(u0, 0, c) * (2.0 * on[0] - 1.0)
                on[0] = 1.0 - on[0]
            if on[0] > 0.0 and begins(d, w, 0, min(following, longest), allowed, c):
                fresh = True
        evaluate(u0, v0, a0, f0, r0, p0, on, leg, time, hi, c)
        keep_ends(peak_force, peak_time, f0, time, hi)
        following = min(following, longest / 4)
        if c.inertia[0] == 0.0:
            following = min(following, _OF_STROKE * longest * (end - time))
        while status == DONE and time < end:
            rate = max(rate_of_dampers(u0, on, hi, c), _STABLE / longest)
            following = min(following, _STABLE / rate)
            strength = max(1.0, min(rate / _STRONG, tolerance / _FINEST))
            h, tried, target, smooth = following, 0, -1, following
            if time + 1.01 * h >= end:
                h = end - time
            shortest = _SHORTEST * (1.0 + abs(time))
            while True:
                m = root if fresh else 1
                if fresh:
                    h = min(h, _FRESH * longest)
                if fresh and kept < record.time.size and record.time[kept] > time + shortest:
                    h = min(h, record.time[kept] - time)
                hi = take_step(
                    u0, v0, a0, f0, p0, u1, v1, f, power, lost, k, on, method.rows, method.squares,
                    bent, method.nodes, leg, time, h, m, hi, c, gained,
                )  # fmt: skip
                evaluations += method.nodes.size
                spent += method.nodes.size * hi
                e5, e3, fastest = errors(
                    v0, v1, k, method.fifth, method.third, h if m == 1 else h ** (1.0 / m), hi,
                    power, lost,
                )  # fmt: skip
                allowed = tolerance * max(fastest, _SLOW)
                judged = allowed * (_STRICTER if fresh else 1.0) / strength
                error = error_ratio(e5, e3, judged)
                if error > 1.0 and h > shortest:
                    h *= max(0.1, 0.9 * error ** (-1 / 8)) ** m
                    smooth = h
                    continue
                after = time + h if h < end - time else end
                evaluate(u1, v1, a1, f1, r1, p1, on, leg, after, hi, c)
                if h > shortest and tried < _RELOCATED:
                    s, which = earliest(
                        u0, v0, a0, f0, r0, u1, v1, a1, f1, r1, on, hi, h, allowed, c
                    )
                    if which >= 0:
                        tried += 1
                        if s * h > shortest:
                            h, target = s * h, which
                            continue
                        d, w = u0[which] - u0[which + 1] - c.gap[which], v0[which] - v0[which + 1]
                        total[1] += held(u0, which, c) * (2.0 * on[which] - 1.0)
                        on[which] = 1.0 - on[which]
                        fresh = fresh or (on[which] > 0.0 and begins(d, w, which, h, allowed, c))
                        evaluate(u0, v0, a0, f0, r0, p0, on, leg, time, hi, c)
                        keep_ends(peak_force, peak_time, f0, time, hi)
                        continue
                if fresh and h > shortest and hidden_maximum(f0, r0, f1, r1, peak_force, h, hi):
                    h /= 4
                    smooth = h
                    continue
                break
            begin, time = time, after
            steps += 1
            for item in range(4):
                total[item] += gained[item]
            if c.inertia[0] == 0.0:
                total[4] += abs(gained[0])
            if not fresh:
                keep_maxima(
                    u0, v0, a0, r0, u1, v1, a1, r1, f0, f1, peak_force, peak_time, begin, h, hi, c
                )
            keep_ends(peak_force, peak_time, f1, time, hi)
            if kept < record.time.size and record.time[kept] <= time:
                kept = keep_history(
                    record, kept, u0, v0, a0, r0, u1, v1, a1, r1, on, hi, begin, time, c
                )
            grown = min(4.0, 0.9 * max(error, 1e-10) ** (-1 / 8))
            following = max(smooth, h * grown) if target >= 0 else h * grown**m
            was_fresh, fresh, changed = fresh, False, False
            for i in range(hi):
                wrong = in_wrong_mode(u1, v1, f1, on, i, IDLE * allowed, c)
                d, w = u1[i] - u1[i + 1] - c.gap[i], v1[i] - v1[i + 1]
                if i == target and not wrong:
                    ending = on[i] > 0.0
                    late = lateness(d, w, a1[i] - a1[i + 1], i, c)
                    wrong = cost(d, w, (d, w), late, ending, i, c) <= EVENT * allowed
                if wrong:
                    changed = True
                    total[1] += held(u1, i, c) if on[i] > 0.0 else -held(u1, i, c)
                    on[i] = 1.0 - on[i]
                    if on[i] > 0.0 and begins(d, w, i, following, allowed, c):
                        fresh = True
            _copy(u1, u0, 0, hi)
            _copy(v1, v0, 0, hi)
            if changed:
                evaluate(u0, v0, a0, f0, r0, p0, on, leg, time, hi, c)
                keep_ends(peak_force, peak_time, f0, time, hi)
            else:
                _copy(a1, a0, 0, hi)
                _copy(f1, f0, 0, hi + 1)
                _copy(r1, r0, 0, hi + 1)
                _copy(p1, p0, 0, hi)
            if was_fresh and not fresh:
                following = min(following, h)
            if steps >= most_steps:
                status = TOO_MANY
            if spent >= _LOOK:
                spent = 0
                control[1], control[2] = time, control[2] + 1
                if _is_stopped(control):
                    status = STOPPED
                elif _is_diverged(energy(u0, v0, hi, c), given, total, c):
                    status = DIVERGED
        if status != DONE:
            break
    left = energy(u0, v0, hi, c)
    momentum = 0.0
    for i in range(hi):
        if on[i] == 0.0:
            total[1] -= held(u0, i, c)
        momentum += v0[i] / c.inertia[i] if c.inertia[i] > 0.0 else 0.0
    if status == DONE and _is_diverged(left, given, total, c):
        status = DIVERGED
    found = Found(
        status, steps, evaluations, time, given + total[0], total[1], momentum, left, total[2],
        total[3],
    )  # fmt: skip
    return found, u0[:granules], v0[:granules]
