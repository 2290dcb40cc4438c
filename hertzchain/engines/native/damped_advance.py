"""Chains of damped contacts, integrated by an explicit Runge-Kutta method with adaptive steps.

A step is taken with the mode of each contact kept (see ``damped_contacts``). If a contact should
have changed its mode within the step, and that matters, the step is repeated up to that time. The
force of a contact that begins with a closing speed grows as t^q: the first step after that is taken
in tau = t^(1/m), in which the motion is smooth, and the free flight is not integrated: then the
overlap, at most w tau^m, has all its digits in every stage.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from hertzchain.arrays import FloatArray
from hertzchain.engines.native.damped_contacts import (
    held,
    keep_history,
)
from hertzchain.engines.native.damped_events import (
    EVENT,
    IDLE,
    begins,
    cost,
    earliest,
    first_maximum,
    hidden_maximum,
    in_wrong_mode,
    keep_ends,
    keep_maxima,
    lateness,
    observe,
)
from hertzchain.engines.native.damped_state import copy
from hertzchain.engines.native.damped_step import (
    evaluate,
    largest_error,
    rate_of_dampers,
    take_step,
)
from hertzchain.engines.native.elastic_chain import energy_of, has_piston
from hertzchain.engines.native.elastic_legs import is_diverged
from hertzchain.engines.native.elastic_state import (
    DIVERGED,
    DONE,
    STOPPED,
    STUCK,
    TOO_MUCH,
    is_stopped,
)
from hertzchain.observables.compiling import compiled
from hertzchain.observables.observer import usual_end

_MANY, _HARDLY = 5000, 1e-7
"""Number of steps after which a run must have advanced, on average by this part of the longest step
(chosen): within a second even in long chains."""

CHECK = 4.0
"""Natural time units between two checks whether the run is over."""

_LOOK = 1_000_000
"""Work between two checks whether the run is to be stopped: about 4 ms."""

STEP = 500.0
"""Additional work of a step, in force evaluations of a granule (measured)."""

_FRESH, _STRICTER = 0.25, 0.001
"""The longest first step of a contact over that of others, and its tolerance over theirs: estimates
in tau can be small by chance, and with a tenth errors reach 64 tolerances."""

_RELOCATED = 8
"""Most repetitions of a step for one change of modes; two or three are usual."""

STABLE = 4.0
"""Longest step times the rate at which dampers stop motions. At 5 the method leaves 0.06 of such a
motion, at 6 half, and above 6.4 it makes it grow (derived from its coefficients). With longer steps
errors grow to the tolerance, and modes change to and fro."""

_STRONG = 4.0
"""The rate, natural units, above which errors of forces are larger than those of velocities: that
of a damper of 1 between granules of mass 1."""

_FINEST = 1e-13
"""Smallest tolerance of a step over the largest speed: below it is round-off (chosen)."""

_SHORTEST = 1e-14
"""Shortest step over the time reached."""

_GRAIN = 1e-15
"""Overlaps that displacements do not resolve, over the largest displacement: 4 units of its last
digit. A contact that is open by less can be at rest in no mode, and steps would not advance."""


class Method(NamedTuple):
    """Coefficients of an explicit method that estimates its error; shape (stages,).

    ``rows``, of shape (stages + 1, stages), ends with the weights; ``squares`` is their product
    with the rows of the stages, which makes displacements of accelerations. The error of a step h
    is e5^2 / sqrt(e5^2 + e3^2 / 100), where e5 and e3 are h times the sums of the stages with the
    weights ``fifth`` and ``third``.
    """

    nodes: FloatArray
    rows: FloatArray
    squares: FloatArray
    fifth: FloatArray
    third: FloatArray


@compiled
def grain(u: Any, hi: int) -> float:
    """Overlap below which displacements cannot show whether a contact is open."""
    farthest = 0.0
    for i in range(hi):
        farthest = max(farthest, abs(u[i]))
    return _GRAIN * farthest


@compiled
def change_mode(at: Any, on: Any, i: int, run: Any, c: Any) -> None:
    """Change the mode of a contact; its elastic energy counts as dissipated while it is off."""
    run.dissipated += held(at.u, i, c) * (2.0 * on[i] - 1.0)
    on[i] = 1.0 - on[i]


@compiled
def advance(
    start: Any, end: Any, on: Any, room: Any, c: Any, leg: Any, until: float, until_change: bool,
    run: Any, method: Any, tolerance: float, slowest: float, longest: float, stable: float,
    most_work: float, seen: Any, watch: Any, control: Any, chosen: Any,
) -> None:  # fmt: skip
    """Take steps up to a time or, with ``until_change``, until a contact begins or ends.

    Errors are judged by the largest speed of these granules, at least ``slowest``. Granule i of a
    part of the chain is ``chosen[i]`` of the chain.
    """
    record, leg_end = seen.record, until
    u0, v0, u1, v1 = start.u, start.v, end.u, end.v
    root = 4 if c.exponent == 1 else 2
    evaluate(start, on, leg, run.time, run.hi, c)
    keep_ends(seen, start.f, run.time, run.hi)
    # Runs with other tolerances have the same steps, so their differences do not show these errors.
    changed, is_shared = False, True
    while run.status == DONE and run.time < until and not (changed and until_change):
        time, fresh = run.time, run.fresh
        rate = max(rate_of_dampers(u0, on, run.hi, c), stable / longest)
        run.following = min(run.following, stable / rate)
        strength = max(1.0, min(rate / _STRONG, tolerance / _FINEST))
        h, tried, target, smooth, changed = run.following, 0, -1, run.following, False
        is_cut = False
        run.cost += STEP
        if time + 1.01 * h >= until:
            h = until - time
        shortest = _SHORTEST * (1.0 + abs(time))
        while True:
            m = root if fresh else 1
            if fresh:
                h = min(h, _FRESH * longest)
            if fresh and run.kept < record.time.size and record.time[run.kept] > time + shortest:
                h = min(h, record.time[run.kept] - time)
            hi = take_step(start, end, room, on, method, leg, time, h, m, run.hi, c)
            run.hi = hi
            run.evaluations += method.nodes.size
            run.cost += method.nodes.size * hi
            error, fastest = largest_error(
                v0, v1, room.k, method.fifth, method.third, h if m == 1 else h ** (1.0 / m), hi
            )  # fmt: skip
            allowed = run.allowed = tolerance * max(fastest, slowest)
            judged = allowed * (_STRICTER if fresh else 1.0) / strength
            error /= judged
            if error > 1.0 and h > shortest:
                h *= max(0.1, 0.9 * error ** (-1 / 8)) ** m
                smooth = h
                continue
            after = time + h if h < until - time else until
            evaluate(end, on, leg, after, hi, c)
            if h > shortest and tried < _RELOCATED:
                idle = max(IDLE * allowed, grain(u1, hi))
                s, which = earliest(start, end, on, hi, h, allowed, idle, c)
                if which >= 0:
                    tried += 1
                    if s * h > shortest:
                        h, target = s * h, which
                        continue
                    d, w = u0[which] - u0[which + 1] - c.gap[which], v0[which] - v0[which + 1]
                    change_mode(start, on, which, run, c)
                    changed = True
                    fresh = fresh or (on[which] > 0.0 and begins(d, w, which, h, allowed, c))
                    evaluate(start, on, leg, time, hi, c)
                    keep_ends(seen, start.f, time, hi)
                    if until_change and run.changes < _RELOCATED:
                        run.changes += 1
                        break  # before the step: it concerns other granules, too
                    continue
            if fresh and h > shortest and hidden_maximum(start, end, seen, h, hi):
                h /= 4
                smooth = h
                continue
            if is_shared and after == until and not fresh:
                # Where the maximum is at the end of a step, nothing is interpolated.
                s = first_maximum(start, end, seen, h, hi, c)
                if s < 1.0:
                    h, is_cut = h * s, True
                    continue
            run.changes = 0
            break
        run.fresh = fresh
        if run.changes > 0:
            break
        begin, run.time, is_shared = time, after, is_cut
        run.steps += 1
        run.work += room.gained[0]
        run.dissipated += room.gained[1]
        run.wall += room.gained[2]
        run.piston += room.gained[3]
        if has_piston(c):
            run.moved += abs(room.gained[0])
        if not fresh:
            keep_maxima(start, end, seen, begin, h, hi, c)
        keep_ends(seen, end.f, after, hi)
        if watch is not None:
            observe(watch, start, end, begin, h, fresh, hi, c, chosen)
        if run.kept < record.time.size and record.time[run.kept] <= after:
            run.kept = keep_history(record, run.kept, start, end, on, hi, begin, after, c)
        grown = min(4.0, 0.9 * max(error, 1e-10) ** (-1 / 8))
        run.following = max(smooth, h * grown) if target >= 0 else h * grown**m
        was_fresh, fresh = fresh, False
        least = grain(u1, hi)
        idle = max(IDLE * allowed, least)
        for i in range(hi):
            wrong = in_wrong_mode(end, on, i, idle, c)
            d, w = u1[i] - u1[i + 1] - c.gap[i], v1[i] - v1[i + 1]
            if i == target and not wrong:
                ending = on[i] > 0.0
                late = lateness(d, w, end.a[i] - end.a[i + 1], i, c)
                wrong = cost(d, w, (d, w), late, ending, i, c) <= EVENT * allowed
                wrong = wrong or abs(d) <= least  # a shorter step comes no nearer
            if wrong:
                changed = True
                change_mode(end, on, i, run, c)
                if on[i] > 0.0 and begins(d, w, i, run.following, allowed, c):
                    fresh = True
        copy(u1, u0, 0, hi)
        copy(v1, v0, 0, hi)
        if changed:
            evaluate(start, on, leg, after, hi, c)
            keep_ends(seen, start.f, after, hi)
        else:
            copy(end.a, start.a, 0, hi)
            copy(end.f, start.f, 0, hi + 1)
            copy(end.r, start.r, 0, hi + 1)
            last = end.f.size - 1
            start.f[last], start.r[last] = end.f[last], end.r[last]
            copy(end.power, start.power, 0, hi)
        if was_fresh and not fresh:
            run.following = min(run.following, h)
        run.fresh = fresh
        if watch is not None and after >= run.next_end:
            at = max(run.next_end, after - 1.0)
            run.end = max(usual_end(watch, run.usual, at, run.end), after)
            run.next_end = min(run.next_end + CHECK, run.end) if run.end > after else math.inf
            until = min(leg_end, run.end)
        if run.cost >= most_work:
            run.status = TOO_MUCH
        if run.steps >= run.steps_before + _MANY:
            if not after > run.time_before + _MANY * _HARDLY * longest:
                run.status = STUCK
            run.steps_before, run.time_before = run.steps, after
        if run.cost >= run.look:
            run.look = run.cost + _LOOK
            control[1], control[2] = after, control[2] + 1
            if is_stopped(control):
                run.status = STOPPED
            elif is_diverged(energy_of(u0, v0, 0, hi, c), run.given, run.work, run.moved, c):
                run.status = DIVERGED
