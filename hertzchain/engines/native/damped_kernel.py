"""A run of a chain of damped contacts, compiled: which granules are computed, from when to when."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from hertzchain.arrays import Array, FloatArray
from hertzchain.engines.native.compiling import compiled_and_kept
from hertzchain.engines.native.damped_advance import (
    DIVERGED,
    DONE,
    STOPPED,
    Method,
    advance,
    grain,
    is_diverged,
)
from hertzchain.engines.native.damped_contacts import (
    held,
)
from hertzchain.engines.native.damped_events import (
    IDLE,
    begins,
    in_wrong_mode,
    start_modes,
)
from hertzchain.engines.native.damped_flights import (
    NEVER,
    any_moving,
    clusters,
    fly_on,
    gather,
    next_touch,
)
from hertzchain.engines.native.damped_state import (
    Counts,
    Room,
    State,
    fly,
    in_part,
    with_next,
)
from hertzchain.engines.native.damped_step import (
    evaluate,
)
from hertzchain.engines.native.elastic_chain import (
    END,
    PLACE,
    SHAPE,
    START,
    VELOCITY,
    Record,
    energy_of,
)
from hertzchain.engines.native.elastic_state import is_stopped
from hertzchain.engines.native.equations import Chain

_SLOW = 1e-3
"""Speed below which errors are no longer judged by the largest speed, natural units."""


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


@compiled_and_kept()
def march(
    legs: FloatArray,
    method: Method,
    c: Chain,
    start: FloatArray,
    moving: int,
    tolerance: float,
    longest: float,
    stable: float,
    most_work: float,
    peak_force: FloatArray,
    peak_time: FloatArray,
    record: Record,
    control: FloatArray,
) -> tuple[Found, Array, Array]:
    """Integrate a chain of damped contacts.

    Parameters
    ----------
    legs
        The applied force, shape (legs, 8): see ``elastic_chain.START`` and what follows. Steps
        end where legs do; how many steps a leg is cut into does not matter.
    method, c
        Coefficients, and the chain with an entry for the free end.
    start
        Displacement and velocity at the start, shape (2, granules).
    moving
        Granules that may move at the start; all for a run without a front.
    tolerance
        Error of a step over the largest speed.
    longest
        The longest step, natural units.
    stable
        The longest step times the rate at which dampers stop motions.
    most_work
        Force evaluations of granules after which the run ends as TOO_MUCH.
    peak_force, peak_time
        Filled in; zero and NaN at the start, shape (contacts,), with a wall (granules,).
    record, control
        As for ``elastic.march``.

    Returns
    -------
    What happened, then displacement and velocity at the end, shape (granules,).
    """
    granules = c.inverse_mass.size
    state = State(np.zeros(granules + 1), np.zeros(granules + 1), np.zeros(granules))
    more = granules + 1
    room = Room(
        np.zeros(more), np.zeros(more), np.zeros(more), np.zeros(granules), np.zeros(more),
        np.zeros(more), np.zeros(more), np.zeros(more), np.zeros(more), np.zeros(granules),
        np.zeros(more), np.zeros(granules), np.zeros(granules),
        np.zeros((method.nodes.size, granules)), np.zeros(method.rows.shape), np.zeros(4),
        np.zeros(4),
    )  # fmt: skip
    # Work, what was dissipated, impulses of wall and piston, work of a piston without its sign.
    total = np.zeros(5)
    u, v, on = state.u, state.v, state.on
    u[:granules], v[:granules] = start[0], start[1]
    fresh = start_modes(u, v, on, c)
    given = energy_of(u, v, 0, granules, c)
    # Only a part of the chain is computed where granules fly, but not where loads move them all.
    parted = np.any(c.gap > 0.0) and not np.any(c.constant) and record.time.size == 0
    since = np.full(granules, legs[0, START])
    size = granules if parted else 0
    part = State(np.zeros(size + 1), np.zeros(size + 1), np.zeros(size))
    part_of_c = Chain(
        np.zeros(size), np.zeros(size), np.zeros(size), np.zeros(size), np.zeros(size), c.exponent,
        c.attraction,
    )  # fmt: skip
    part_force, part_time = np.zeros(size), np.zeros(size)
    inside, chosen = np.zeros(granules, np.bool_), np.zeros(size, np.int64)
    everyone = np.arange(granules)
    no_force = np.zeros(legs.shape[1])
    fastest = max(np.max(np.abs(v)), _SLOW)
    counts = Counts(
        legs[0, START], longest / 64, fresh, min(moving, granules), 0, 0, 0, 0.0,
        tolerance * fastest, STOPPED if is_stopped(control) else DONE,
    )  # fmt: skip
    for number in range(legs.shape[0]):
        leg = legs[number]
        end = leg[END]
        time, following, fresh = counts.time, counts.following, counts.fresh
        if parted:
            fly_on(u, v, since, time, 0, granules)
        if c.inverse_mass[0] == 0.0:
            u[0], v[0] = leg[PLACE], leg[VELOCITY]
            d, w = u[0] - u[1] - c.gap[0], v[0] - v[1]
            allowed = tolerance * max(abs(w), _SLOW)
            evaluate(u, v, room.a0, room.f0, room.r0, room.p0, on, leg, time, counts.hi, c)
            idle = max(IDLE * allowed, grain(u, counts.hi))
            if in_wrong_mode(u, v, room.f0, on, 0, idle, c):  # its velocity has jumped
                total[1] += held(u, 0, c) * (2.0 * on[0] - 1.0)
                on[0] = 1.0 - on[0]
            if on[0] > 0.0 and begins(d, w, 0, min(following, longest), allowed, c):
                fresh = True
        counts = with_next(counts, time, min(following, longest / 4), fresh)
        while counts.status == DONE and counts.time < end:
            time = counts.time
            is_pushed = leg[SHAPE] != 0.0
            acts = True
            room.progress[3] += granules
            if parted:
                acts = clusters(u, v, on, is_pushed, c, inside)
            elif not is_pushed and counts.hi == granules:
                acts = any_moving(u, v, on, c)
            touch, which = NEVER, -1
            if not parted and not acts:
                since[:] = time
            if parted or not acts:
                touch, which = next_touch(u, v, on, since, time, inside, c)
            stop = min(end, touch)
            if not acts:
                if not parted:
                    counts = fly(state, room, c, stop, counts, record)
                counts = with_next(counts, stop, min(counts.following, longest / 4), False)
            elif not parted:
                counts = advance(
                    state, room, c, leg, end, not is_pushed, counts, method, tolerance, _SLOW,
                    longest, stable, most_work, given, total, peak_force, peak_time, record,
                    control, everyone,
                )  # fmt: skip
            elif stop > time:
                many = gather(c, inside, part_of_c, chosen)
                for k in range(many):
                    i = chosen[k]
                    fly_on(u, v, since, time, i, i + 1)
                    part.u[k], part.v[k], part.on[k] = u[i], v[i], on[i] if inside[i] else 0.0
                    part_force[k], part_time[k] = 0.0, math.nan
                    if i < peak_force.size:
                        part_force[k], part_time[k] = peak_force[i], peak_time[i]
                part.u[many] = part.v[many] = 0.0  # the wall
                room.u1[many] = room.v1[many] = room.a0[many] = room.a1[many] = 0.0
                its = Chain(
                    part_of_c.stiffness[:many], part_of_c.inverse_mass[:many],
                    part_of_c.gap[:many], part_of_c.constant[:many], part_of_c.damping[:many],
                    c.exponent, c.attraction,
                )  # fmt: skip
                own = State(part.u[: many + 1], part.v[: many + 1], part.on[:many])
                counts = in_part(counts, many)
                counts = advance(
                    own, room, its, leg if chosen[0] == 0 else no_force, stop, True, counts, method,
                    tolerance, max(_SLOW, np.max(np.abs(v))), longest, stable, most_work, given,
                    total, part_force[:many], part_time[:many], record, control, chosen,
                )  # fmt: skip
                counts = in_part(counts, granules)
                for k in range(many):
                    i = chosen[k]
                    u[i], v[i], since[i] = own.u[k], own.v[k], counts.time
                    if inside[i]:
                        on[i] = own.on[k]
                    if part_time[k] >= 0.0:
                        peak_force[i], peak_time[i] = part_force[k], part_time[k]
            if which >= 0 and counts.time >= touch and counts.status == DONE:
                if parted:
                    fly_on(u, v, since, counts.time, which, min(which + 2, granules))
                on[which] = 1.0
                total[1] -= held(u, which, c)
                d, w = u[which] - u[which + 1] - c.gap[which], v[which] - v[which + 1]
                fresh = begins(d, w, which, counts.following, counts.allowed, c)
                counts = with_next(counts, counts.time, counts.following, counts.fresh or fresh)
        if counts.status != DONE:
            break
    if parted:
        fly_on(u, v, since, counts.time, 0, granules)
    left = energy_of(u, v, 0, counts.hi, c)
    momentum = 0.0
    for i in range(counts.hi):
        if on[i] == 0.0:
            total[1] -= held(u, i, c)
        momentum += v[i] / c.inverse_mass[i] if c.inverse_mass[i] > 0.0 else 0.0
    status = counts.status
    if status == DONE and is_diverged(left, given, total, c):
        status = DIVERGED
    found = Found(
        status, counts.steps, counts.evaluations, counts.time, given + total[0], total[1], momentum,
        left, total[2], total[3],
    )  # fmt: skip
    return found, u[:granules], v[:granules]
