"""A run of a chain of damped contacts, compiled: which granules are computed, and when."""

from __future__ import annotations

import math

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.native.damped_advance import CHECK, Method, advance, change_mode, grain
from hertzchain.engines.native.damped_contacts import held
from hertzchain.engines.native.damped_events import IDLE, begins, in_wrong_mode, start_modes
from hertzchain.engines.native.damped_flights import (
    NEVER,
    any_moving,
    clusters,
    fly_on,
    gather,
    next_touch,
)
from hertzchain.engines.native.damped_state import Motion, State, fly
from hertzchain.engines.native.damped_step import evaluate
from hertzchain.engines.native.elastic_chain import (
    END,
    PLACE,
    SHAPE,
    START,
    VELOCITY,
    energy_of,
    has_piston,
    momentum_of,
)
from hertzchain.engines.native.elastic_legs import is_diverged
from hertzchain.engines.native.elastic_state import (
    DIVERGED,
    DONE,
    STOPPED,
    Outcome,
    Seen,
    is_stopped,
)
from hertzchain.engines.native.equations import Chain
from hertzchain.observables.compiling import compiled_and_kept
from hertzchain.observables.observer import Watch, usual_end

_SLOW = 1e-3
"""Speed below which errors are no longer judged by the largest speed, natural units."""


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
    state: State,
    seen: Seen,
    watch: Watch | None,
    usual: float,
    control: FloatArray,
) -> Outcome:
    """Integrate a chain of damped contacts.

    Parameters
    ----------
    legs
        The applied force, shape (legs, 8): see ``elastic_chain.START`` and what follows. Steps end
        where legs do; the number of steps in a leg has no effect.
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
    state
        Filled in, displacement and velocity at the end too.
    seen, watch, usual, control
        As for ``elastic.march``.

    Returns
    -------
    What happened.
    """
    granules, record = c.inverse_mass.size, seen.record
    begun, end, on, room, run = state.start, state.end, state.on, state.room, state.run[0]
    u, v = begun.u, begun.v
    u[:granules], v[:granules] = start[0], start[1]
    run.fresh = start_modes(u, v, on, c)
    run.given = energy_of(u, v, 0, granules, c)
    run.time, run.following, run.hi = legs[0, START], longest / 64, min(moving, granules)
    run.allowed = tolerance * max(np.max(np.abs(v)), _SLOW)
    run.status = STOPPED if is_stopped(control) else DONE
    run.usual, run.end, run.next_end = usual, math.inf, math.inf if math.isnan(usual) else CHECK
    # Where granules fly, only a part of the chain is computed; loads, however, move them all.
    parted = np.any(c.gap > 0.0) and not np.any(c.constant) and record.time.size == 0
    parted = parted and c.pushed == 0 and c.fixed.size == 0
    since = np.full(granules, run.time)
    size = granules if parted else 0
    part_u, part_v, part_on = np.zeros(size + 1), np.zeros(size + 1), np.zeros(size)
    part_of_c = Chain(
        np.zeros(size), np.zeros(size), np.zeros(size), np.zeros(size), np.zeros(size), c.exponent,
        c.attraction, 0, c.fixed,
    )  # fmt: skip
    part_force, part_time = np.zeros(size), np.zeros(size)
    inside, chosen = np.zeros(granules, np.bool_), np.zeros(size, np.int64)
    everyone = np.arange(granules)
    no_force = np.zeros(legs.shape[1])
    for number in range(legs.shape[0]):
        leg = legs[number]
        if parted:
            fly_on(u, v, since, run.time, 0, granules)
        if has_piston(c):
            u[0], v[0] = leg[PLACE], leg[VELOCITY]
            d, w = u[0] - u[1] - c.gap[0], v[0] - v[1]
            allowed = tolerance * max(abs(w), _SLOW)
            evaluate(begun, on, leg, run.time, run.hi, c)
            idle = max(IDLE * allowed, grain(u, run.hi))
            if in_wrong_mode(begun, on, 0, idle, c):  # its velocity has jumped
                change_mode(begun, on, 0, run, c)
            if on[0] > 0.0 and begins(d, w, 0, min(run.following, longest), allowed, c):
                run.fresh = True
        run.following = min(run.following, longest / 4)
        while run.status == DONE and run.time < min(leg[END], run.end):
            is_pushed = leg[SHAPE] != 0.0
            acts = True
            run.cost += granules
            if parted:
                acts = clusters(u, v, on, is_pushed, c, inside)
            elif not is_pushed and run.hi == granules:
                acts = any_moving(u, v, on, c)
            touch, which = NEVER, -1
            if not parted and not acts:
                since[:] = run.time
            if parted or not acts:
                touch, which = next_touch(u, v, on, since, run.time, inside, c)
            if watch is not None and not acts and run.next_end < math.inf:
                run.end = usual_end(watch, usual, run.time, run.end)
                run.next_end = run.end
            leg_end = min(leg[END], run.end)
            stop = min(leg_end, touch)
            if not acts:
                if not parted:
                    fly(begun, end, on, run, c, stop, record)
                run.time, run.fresh = stop, False
                run.following = min(run.following, longest / 4)
            elif not parted:
                advance(
                    begun, end, on, room, c, leg, leg_end, not is_pushed, run, method, tolerance,
                    _SLOW, longest, stable, most_work, seen, watch, control, everyone,
                )  # fmt: skip
            elif stop > run.time:
                many = gather(c, inside, part_of_c, chosen)
                for k in range(many):
                    i = chosen[k]
                    fly_on(u, v, since, run.time, i, i + 1)
                    part_u[k], part_v[k], part_on[k] = u[i], v[i], on[i] if inside[i] else 0.0
                    part_force[k], part_time[k] = 0.0, math.nan
                    if i < seen.force.size:
                        part_force[k], part_time[k] = seen.force[i], seen.time[i]
                part_u[many] = part_v[many] = 0.0  # the wall
                end.u[many] = end.v[many] = begun.a[many] = end.a[many] = 0.0
                its = Chain(
                    part_of_c.stiffness[:many], part_of_c.inverse_mass[:many],
                    part_of_c.gap[:many], part_of_c.constant[:many], part_of_c.damping[:many],
                    c.exponent, c.attraction, 0, c.fixed,
                )  # fmt: skip
                own = Motion(
                    part_u[: many + 1], part_v[: many + 1], begun.a, begun.f, begun.r, begun.power
                )
                run.hi = many
                # ``parted`` is true here: for a literal True all would be compiled a second time.
                advance(
                    own, end, part_on[:many], room, its, leg if chosen[0] == 0 else no_force, stop,
                    parted, run, method, tolerance, max(_SLOW, np.max(np.abs(v))), longest, stable,
                    most_work, Seen(part_force[:many], part_time[:many], record), watch, control,
                    chosen,
                )  # fmt: skip
                run.hi = granules
                for k in range(many):
                    i = chosen[k]
                    u[i], v[i], since[i] = part_u[k], part_v[k], run.time
                    if inside[i]:
                        on[i] = part_on[k]
                    if part_time[k] >= 0.0:
                        seen.force[i], seen.time[i] = part_force[k], part_time[k]
            if which >= 0 and run.time >= touch and run.status == DONE:
                if parted:
                    fly_on(u, v, since, run.time, which, min(which + 2, granules))
                on[which] = 1.0
                run.dissipated -= held(u, which, c)
                d, w = u[which] - u[which + 1] - c.gap[which], v[which] - v[which + 1]
                if begins(d, w, which, run.following, run.allowed, c):
                    run.fresh = True
        if run.status != DONE or run.time >= run.end:
            break
    if parted:
        fly_on(u, v, since, run.time, 0, granules)
    left = energy_of(u, v, 0, run.hi, c)
    for i in range(run.hi):
        if on[i] == 0.0:
            run.dissipated -= held(u, i, c)
    if run.status == DONE and is_diverged(left, run.given, run.work, run.moved, c):
        run.status = DIVERGED
    return Outcome(
        run.status, run.steps, run.evaluations, run.evaluations, run.time, run.given + run.work,
        momentum_of(v, 0, run.hi, c), left, run.wall, run.piston, run.dissipated,
    )  # fmt: skip
