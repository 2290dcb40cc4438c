"""Chains of damped contacts, integrated by an explicit Runge-Kutta method with adaptive steps.

A step is taken with the mode of each contact kept (see ``damped_contacts``). If a contact ought to
have changed its mode meanwhile, and that matters, the step is repeated up to there. The force of a
contact that begins with a closing speed grows as t^q: the first step after that is taken in
tau = t^(1/m), in which the motion is smooth, and the free flight is left out of what is integrated:
then the overlap, w tau^m and less, has all its digits in every stage.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from hertzchain.arrays import FloatArray
from hertzchain.engines.native.compiling import compiled
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
)
from hertzchain.engines.native.damped_state import (
    Counts,
    copy,
)
from hertzchain.engines.native.damped_step import (
    evaluate,
    largest_error,
    rate_of_dampers,
    take_step,
)
from hertzchain.engines.native.elastic_chain import energy_of
from hertzchain.engines.native.elastic_state import is_stopped
from hertzchain.engines.native.notes import note_damped

DONE, DIVERGED, STOPPED, TOO_MUCH, STUCK = range(5)
"""How a run ended; the last two: more work than allowed, and steps that do not advance."""

_MANY, _HARDLY = 5000, 1e-7
"""Number of steps after which a run has to have advanced, each by this part of the longest step
(chosen): within a second even in long chains."""

_DIVERGED_ENERGY = 10.0
"""Energy over the energy given to the chain in a run that has diverged."""

_LOOK = 1_000_000
"""Work between two looks at whether the run is to be stopped: about 4 ms."""

STEP = 500.0
"""Additional work of a step, in force evaluations of a granule (measured)."""

_FRESH, _STRICTER = 0.25, 0.001
"""The longest first step of a contact over that of others, and what error it may have: estimates
in tau can be small by chance, and with a tenth errors reach 64 tolerances."""

_RELOCATED = 8
"""Most repetitions of a step for one change of modes; two or three are usual."""

STABLE = 4.0
"""Longest step times the rate at which dampers stop motions. At 5 the method leaves 0.06 of such a
motion, at 6 half, and above 6.4 it makes it grow (derived from its coefficients). With longer
steps errors grow to what is allowed, and modes change to and fro with them."""

_STRONG = 4.0
"""The rate, natural units, above which errors of forces are larger than those of velocities: that
of a damper of 1 between granules of mass 1."""

_FINEST = 1e-13
"""Error of a step over the largest speed, at least: less is rounding (chosen)."""

_SHORTEST = 1e-14
"""Shortest step over the time."""

_GRAIN = 1e-15
"""Overlaps that displacements do not resolve, over the largest displacement: 4 units of its last
digit. A contact that is open by less can be at rest in no mode, and steps would not advance."""


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


@compiled
def grain(u: Any, hi: int) -> float:
    """Overlap below which displacements do not tell whether a contact is open."""
    farthest = 0.0
    for i in range(hi):
        farthest = max(farthest, abs(u[i]))
    return _GRAIN * farthest


@compiled
def is_diverged(left: float, given: float, total: Any, c: Any) -> bool:
    """Whether the chain has far more energy than it was given; see ``elastic_legs.is_diverged``."""
    if c.inverse_mass[0] == 0.0:
        return not abs(left) <= _DIVERGED_ENERGY * (abs(given) + total[4])
    return not left <= _DIVERGED_ENERGY * (given + total[0])


@compiled
def advance(
    state: Any, room: Any, c: Any, leg: Any, end: float, until_change: bool, counts: Any,
    method: Any, tolerance: float, slowest: float, longest: float, stable: float, most_work: float,
    given: float,
    total: Any, peak_force: Any, peak_time: Any, record: Any, control: Any, chosen: Any,
) -> Any:  # fmt: skip
    """Take steps up to a time or, with ``until_change``, until a contact begins or ends.

    Errors are judged by the largest speed of these granules, at least ``slowest``. Granule i of a
    part of the chain is ``chosen[i]`` of the chain.
    """
    u0, v0, on = state.u, state.v, state.on
    a0, f0, r0, p0 = room.a0, room.f0, room.r0, room.p0
    u1, v1, a1, f1, r1, p1 = room.u1, room.v1, room.a1, room.f1, room.r1, room.p1
    f, power, lost, k, bent, gained, progress = (
        room.f, room.power, room.lost, room.k, room.bent, room.gained, room.progress
    )  # fmt: skip
    time, following, fresh, hi, kept = (
        counts.time, counts.following, counts.fresh, counts.hi, counts.kept
    )  # fmt: skip
    steps, evaluations, look = counts.steps, counts.evaluations, counts.look
    allowed, status = counts.allowed, counts.status
    root = 4 if c.exponent == 1 else 2
    evaluate(u0, v0, a0, f0, r0, p0, on, leg, time, hi, c)
    keep_ends(peak_force, peak_time, f0, time, hi)
    # Steps that runs with other tolerances have, too: their differences do not tell its errors.
    changed, is_shared = False, True
    while status == DONE and time < end and not (changed and until_change):
        rate = max(rate_of_dampers(u0, on, hi, c), stable / longest)
        following = min(following, stable / rate)
        strength = max(1.0, min(rate / _STRONG, tolerance / _FINEST))
        h, tried, target, smooth, changed = following, 0, -1, following, False
        is_cut = False
        progress[3] += STEP
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
            progress[3] += method.nodes.size * hi
            error, fastest = largest_error(
                v0, v1, k, method.fifth, method.third, h if m == 1 else h ** (1.0 / m), hi,
                power, lost,
            )  # fmt: skip
            allowed = tolerance * max(fastest, slowest)
            judged = allowed * (_STRICTER if fresh else 1.0) / strength
            error /= judged
            if error > 1.0 and h > shortest:
                h *= max(0.1, 0.9 * error ** (-1 / 8)) ** m
                smooth = h
                continue
            after = time + h if h < end - time else end
            evaluate(u1, v1, a1, f1, r1, p1, on, leg, after, hi, c)
            if h > shortest and tried < _RELOCATED:
                idle = max(IDLE * allowed, grain(u1, hi))
                s, which = earliest(
                    u0, v0, a0, f0, r0, u1, v1, a1, f1, r1, on, hi, h, allowed, idle, c
                )
                if which >= 0:
                    tried += 1
                    if s * h > shortest:
                        h, target = s * h, which
                        continue
                    d, w = u0[which] - u0[which + 1] - c.gap[which], v0[which] - v0[which + 1]
                    total[1] += held(u0, which, c) * (2.0 * on[which] - 1.0)
                    on[which], changed = 1.0 - on[which], True
                    fresh = fresh or (on[which] > 0.0 and begins(d, w, which, h, allowed, c))
                    evaluate(u0, v0, a0, f0, r0, p0, on, leg, time, hi, c)
                    keep_ends(peak_force, peak_time, f0, time, hi)
                    if until_change and progress[2] < _RELOCATED:
                        progress[2] += 1
                        break  # before the step: other granules are concerned, too
                    continue
            if fresh and h > shortest and hidden_maximum(f0, r0, f1, r1, peak_force, h, hi):
                h /= 4
                smooth = h
                continue
            if is_shared and after == end and not fresh:
                # Where the maximum is at the end of a step, nothing is interpolated.
                s = first_maximum(u0, v0, a0, r0, u1, v1, a1, r1, f0, f1, peak_force, h, hi, c)
                if s < 1.0:
                    h, is_cut = h * s, True
                    continue
            progress[2] = 0
            break
        if progress[2] > 0:
            break
        begin, time, is_shared = time, after, is_cut
        steps += 1
        for item in range(4):
            total[item] += gained[item]
        if c.inverse_mass[0] == 0.0:
            total[4] += abs(gained[0])
        if not fresh:
            keep_maxima(
                u0, v0, a0, r0, u1, v1, a1, r1, f0, f1, peak_force, peak_time, begin, h, hi, c
            )
        keep_ends(peak_force, peak_time, f1, time, hi)
        if record.notes.shape[0] > 0:
            note_damped(
                record, peak_force, peak_time, u0, v0, a0, r0, u1, v1, a1, r1, f0, f1, begin, h,
                fresh, hi, c, chosen,
            )  # fmt: skip
        if kept < record.time.size and record.time[kept] <= time:
            kept = keep_history(
                record, kept, u0, v0, a0, r0, u1, v1, a1, r1, on, hi, begin, time, c
            )
        grown = min(4.0, 0.9 * max(error, 1e-10) ** (-1 / 8))
        following = max(smooth, h * grown) if target >= 0 else h * grown**m
        was_fresh, fresh = fresh, False
        least = grain(u1, hi)
        idle = max(IDLE * allowed, least)
        for i in range(hi):
            wrong = in_wrong_mode(u1, v1, f1, on, i, idle, c)
            d, w = u1[i] - u1[i + 1] - c.gap[i], v1[i] - v1[i + 1]
            if i == target and not wrong:
                ending = on[i] > 0.0
                late = lateness(d, w, a1[i] - a1[i + 1], i, c)
                wrong = cost(d, w, (d, w), late, ending, i, c) <= EVENT * allowed
                wrong = wrong or abs(d) <= least  # no shorter step comes nearer
            if wrong:
                changed = True
                total[1] += held(u1, i, c) if on[i] > 0.0 else -held(u1, i, c)
                on[i] = 1.0 - on[i]
                if on[i] > 0.0 and begins(d, w, i, following, allowed, c):
                    fresh = True
        copy(u1, u0, 0, hi)
        copy(v1, v0, 0, hi)
        if changed:
            evaluate(u0, v0, a0, f0, r0, p0, on, leg, time, hi, c)
            keep_ends(peak_force, peak_time, f0, time, hi)
        else:
            copy(a1, a0, 0, hi)
            copy(f1, f0, 0, hi + 1)
            copy(r1, r0, 0, hi + 1)
            copy(p1, p0, 0, hi)
        if was_fresh and not fresh:
            following = min(following, h)
        if progress[3] >= most_work:
            status = TOO_MUCH
        if steps >= progress[0] + _MANY:
            if not time > progress[1] + _MANY * _HARDLY * longest:
                status = STUCK
            progress[0], progress[1] = steps, time
        if progress[3] >= look:
            look = progress[3] + _LOOK
            control[1], control[2] = time, control[2] + 1
            if is_stopped(control):
                status = STOPPED
            elif is_diverged(energy_of(u0, v0, 0, hi, c), given, total, c):
                status = DIVERGED
    return Counts(
        time, following, fresh, hi, kept, steps, evaluations, look, allowed, status
    )  # fmt: skip
