"""A run of a chain of damped contacts, compiled: an explicit method with adaptive steps.

A step is taken with the mode of each contact kept (see ``damped_contacts``). If a contact should
have changed its mode within the step, and that matters, the step is repeated up to that time. The
force of a contact that begins with a closing speed grows as t^q: the first step after that is taken
in tau = t^(1/m), in which the motion is smooth, and the free flight is not integrated: then the
overlap, at most w tau^m, has all its digits in every stage.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.engines.native.damped_contacts import (
    EVENT,
    IDLE,
    TINY,
    Indices,
    Motion,
    accelerations,
    begins,
    cost,
    earliest,
    first_maximum,
    force_rates,
    forces,
    held,
    hidden_maximum,
    in_wrong_mode,
    keep_ends,
    keep_history,
    keep_maxima,
    lateness,
    observe,
    start_modes,
)
from hertzchain.engines.native.elastic_chain import (
    CHECK,
    DIVERGED,
    DONE,
    END,
    LOOK,
    PLACE,
    SHAPE,
    START,
    STOPPED,
    STUCK,
    TOO_MUCH,
    VELOCITY,
    Array,
    Outcome,
    Progress,
    Record,
    Seen,
    Start,
    applied_force,
    applied_force_rate,
    energy_of,
    has_piston,
    is_diverged,
    is_stopped,
    momentum_of,
)
from hertzchain.engines.native.equations import WINDOW, Chain
from hertzchain.observables.compiling import compiled, compiled_and_kept
from hertzchain.observables.observer import Watch, power_of, usual_end


class Room(NamedTuple):
    """Arrays that a step works with: forces, power, stages, coefficients, what it adds."""

    f: FloatArray
    power: FloatArray
    k: FloatArray
    bent: FloatArray
    gained: FloatArray


RUN = np.dtype(
    [
        (name, np.int64)
        for name in ("status", "hi", "kept", "steps", "evaluations", "changes", "steps_before")
    ]
    + [
        (name, np.float64)
        for name in (
            "time", "following", "allowed", "cost", "look", "time_before", "given", "work",
            "dissipated", "wall", "piston", "moved", "usual", "end", "next_end",
        )
    ]
    + [("fresh", np.bool_)],
    align=True,
)  # fmt: skip
"""Progress of a run, and its sums.

How it ended; granules 0 to hi - 1 move; frames of a history, steps, evaluations; changes of modes
without a step; steps and time of the last look at whether steps advance. Then the next step, the
error that it may have, the work so far in force evaluations of a granule, and when to look next;
energy at the start, work, what was dissipated, impulses of wall and piston, work of a piston
without its sign; the end if contacts are never pressed, the end by the pulses so far, and when to
look at them next; and whether a contact has just begun."""


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


class Patch(NamedTuple):
    """The granules that are computed: the whole chain, or the parts of it that do not fly.

    Their motion at the start and the end of a step, modes of their contacts, room, and chain.
    """

    start: Motion
    end: Motion
    on: FloatArray
    room: Room
    c: Chain


class Steps(NamedTuple):
    """Rules for the choice of steps.

    ``legs``, shape (legs, 8), have the applied force: see ``elastic_chain.START``. A step ends
    where a leg ends; the column of numbers of steps has no effect. ``method`` has the coefficients.
    ``tolerance`` is the error of a step over the largest speed, which counts as at least
    ``slowest``; ``longest`` the longest step, natural units; ``stable`` that times the rate at
    which dampers stop motions; ``most_work`` the force evaluations of granules after which the run
    ends as TOO_MUCH.
    """

    legs: FloatArray
    method: Method
    tolerance: float
    slowest: float
    longest: float
    stable: float
    most_work: float


class State(NamedTuple):
    """All that a run changes; made and held outside of the kernels.

    The motion at the start and the end of a step, modes of contacts, shape (granules,), room, and
    ``RUN``, shape (1,).
    """

    start: Motion
    end: Motion
    on: FloatArray
    room: Room
    run: Any


def at_the_start(granules: int, stages: int) -> State:
    """Return a state for the start of a run."""
    start, end = (Motion(*np.zeros((6, granules + 2))) for _ in range(2))
    room = Room(
        np.zeros(granules + 2), np.zeros(granules), np.zeros((stages, granules)),
        np.zeros((stages + 1, stages)), np.zeros(4),
    )  # fmt: skip
    return State(start, end, np.zeros(granules), room, np.zeros(1, RUN))


@compiled
def copy(what: Array, to: Array, lo: int, hi: int) -> None:
    """Copy a part of an array."""
    for i in range(np.uint64(lo), np.uint64(hi)):
        to[i] = what[i]


@compiled
def fly(patch: Patch, run: Progress, until: float, record: Record) -> None:
    """Move all granules to a time while no contact acts; constant forces do."""
    start, end, on, c = patch.start, patch.end, patch.on, patch.c
    h, granules = until - run.time, c.inverse_mass.size
    for i in range(granules):
        pull = c.constant[i]
        start.a[i] = end.a[i] = pull
        end.v[i] = start.v[i] + h * pull
        end.u[i] = start.u[i] + h * (start.v[i] + h * pull / 2)
    start.r[:] = end.r[:] = 0.0
    run.kept = keep_history(record, run.kept, start, end, on, granules, (run.time, until), c)
    copy(end.u, start.u, 0, granules)
    copy(end.v, start.v, 0, granules)
    run.time = until


Flags = NDArray[np.bool_]

NEVER = math.inf


@compiled
def is_moving(u: Array, v: Array, on: Array, i: int, c: Chain) -> bool:
    """Whether contact i acts; one that only touches, between granules at rest, does not."""
    if on[i] == 0.0:
        return False
    return bool(v[i] != 0.0 or v[i + 1] != 0.0 or u[i] - u[i + 1] - c.gap[i] > 0.0)


@compiled
def any_moving(u: Array, v: Array, on: Array, c: Chain) -> bool:
    """Whether any contact acts, or overlaps while its damper holds its force at 0.

    Such a contact may press again before it has opened, where a load bends the flight.
    """
    any_moves = False
    for i in range(on.size):
        overlaps = c.stiffness[i] > 0.0 and u[i] - u[i + 1] - c.gap[i] > 0.0
        any_moves = any_moves or overlaps or is_moving(u, v, on, i, c)
    return any_moves


@compiled
def clusters(u: Array, v: Array, on: Array, is_pushed: bool, c: Chain, inside: Flags) -> bool:
    """Find the contacts to compute, those that act and one on either side; return if any acts.

    ``inside`` is filled in, shape (granules,). With ``is_pushed`` granule 1 is among them.
    """
    size, any_acts = on.size, False
    acts = is_pushed
    for i in range(size):
        # A contact that only touches acts as soon as its neighbour does.
        acts = is_moving(u, v, on, i, c) or (acts and (on[i] > 0.0 or i == 0))
        inside[i] = acts
    acts = False
    for i in range(size - 1, -1, -1):
        acts = inside[i] or (acts and on[i] > 0.0)
        inside[i] = acts
        any_acts = any_acts or acts
    before = False
    for i in range(size):
        acts = inside[i]
        inside[i] = acts or before or (i + 1 < size and inside[i + 1])
        before = acts
    return any_acts


@compiled
def _wait(d: float, w: float, bend: float) -> float:
    """Time until an overlap d, growing at w with the acceleration ``bend``, reaches 0 again."""
    d = min(d, 0.0)
    square = w * w - 2.0 * bend * d
    if square < 0.0:
        return NEVER
    root = math.sqrt(square)
    if w < 0.0:
        return (root - w) / bend if bend > 0.0 else NEVER
    if d == 0.0:
        return 0.0 if w > 0.0 or bend > 0.0 else NEVER
    return -2.0 * d / (w + root) if w + root > 0.0 else NEVER


@compiled
def next_touch(
    u: Array, v: Array, on: Array, since: Array, time: float, inside: Flags, c: Chain
) -> Any:
    """When open contacts that are not ``inside`` first touch in free flight, and which.

    Never, and -1, if none does.
    """
    size = on.size
    touch, which = NEVER, -1
    for i in range(size):
        if on[i] > 0.0 or c.stiffness[i] == 0.0 or inside[i]:
            continue
        w, bend = v[i], c.constant[i]
        d = u[i] + v[i] * (time - since[i]) - c.gap[i]
        if i + 1 < size:
            w -= v[i + 1]
            bend -= c.constant[i + 1]
            d -= u[i + 1] + v[i + 1] * (time - since[i + 1])
        if w <= 0.0 and bend <= 0.0:
            continue
        at = time + _wait(d, w, bend)
        if at < touch:
            touch, which = at, i
    return touch, which


@compiled
def fly_on(u: Array, v: Array, since: Array, time: float, lo: int, hi: int) -> None:
    """Bring granules in free flight to a time."""
    for i in range(lo, hi):
        u[i] += v[i] * (time - since[i])
        since[i] = time


@compiled
def gather(c: Chain, inside: Flags, into: Chain, chosen: Indices) -> int:
    """Copy the granules of the contacts ``inside``; return their number.

    ``chosen`` is filled in with their numbers. Where the next granule is not one of them, or
    belongs to another cluster, there is no contact.
    """
    many, last = 0, False
    for i in range(c.inverse_mass.size):
        if inside[i] or last:
            chosen[many] = i
            into.stiffness[many] = c.stiffness[i] if inside[i] else 0.0
            into.damping[many] = c.damping[i] if inside[i] else 0.0
            into.gap[many], into.constant[many] = c.gap[i], c.constant[i]
            into.inverse_mass[many] = c.inverse_mass[i]
            many += 1
        last = inside[i]
    return many


@compiled
def rate_of_dampers(u: Array, on: Array, hi: int, c: Chain) -> float:
    """Bound of the rates at which the dampers that act now stop motions.

    No rate is larger than the largest sum of a row of the matrix of dampers over masses
    (Gershgorin).
    """
    fastest, before = 0.0, 0.0
    for i in range(hi):
        damping = on[i] * c.damping[i]
        if c.damping_exponent > 0:
            damping *= power_of(max(u[i] - u[i + 1] - c.gap[i], 0.0), c.damping_exponent)
        fastest = max(fastest, (before + damping) * c.inverse_mass[i])
        before = damping
    return 2.0 * fastest


@compiled
def _fly(u: Array, v: Array, u0: Array, v0: Array, time: float, hi: int) -> None:
    for i in range(np.uint64(0), np.uint64(hi)):
        u[i] = u0[i] + time * v0[i]
        v[i] = v0[i]


@compiled
def _combine(
    u: Array, v: Array, size: float, twice: Array, once: Array, s: int, k: Array, hi: int
) -> None:
    """Add the stages before stage s with rows of coefficients.

    ``once`` makes velocities of scaled accelerations, ``twice`` displacements.
    """
    for j in range(min(s, k.shape[0])):
        of_u, of_v = size * size * twice[s, j], size * once[s, j]
        if of_u != 0.0 or of_v != 0.0:
            for i in range(np.uint64(0), np.uint64(hi)):
                u[i] += of_u * k[j, i]
                v[i] += of_v * k[j, i]


@compiled
def _sum(of: Array, hi: int) -> float:
    total = 0.0
    for i in range(hi):
        total += of[i]
    return total


@compiled
def _bend(bent: Array, rows: Array, nodes: Array, size: float, m: int) -> None:
    """Coefficients of displacements in t^(1/m): rows times rows, weighted by dt/dtau of stages."""
    stages = nodes.size
    for s in range(stages + 1):
        for j in range(stages):
            bent[s, j] = 0.0
        for through in range(1, min(s, stages)):
            weighted = rows[s, through] * m * (nodes[through] * size) ** (m - 1)
            if weighted != 0.0:
                for j in range(through):
                    bent[s, j] += weighted * rows[through, j]


@compiled
def place_of_push(f: Array, c: Chain) -> int:
    """Place of the applied force in an array of forces: see ``damped_contacts``."""
    return 0 if c.pushed == 0 else f.size - 1


@compiled
def force_on_held(f: Array, c: Chain) -> float:
    """Force on the wall and on fixed granules together."""
    total = f[c.inverse_mass.size]
    for k in range(c.fixed.size):
        total += f[c.fixed[k]] - f[c.fixed[k] + 1]
    return float(total)


@compiled
def take_step(
    patch: Patch, method: Method, leg: Array, begin: float, h: float, m: int, hi: int
) -> int:
    """Take one step in t^(1/m); returns where the window ends.

    ``room.gained`` gets the work of the applied force or the piston, the dissipated energy, and the
    impulses of wall and piston.
    """
    start, end, on, room, c = patch.start, patch.end, patch.on, patch.room, patch.c
    f, power, k, gained = room.f, room.power, room.k, room.gained
    u1, v1, rows, nodes = end.u, end.v, method.rows, method.nodes
    granules, stages = c.inverse_mass.size, nodes.size
    size = h if m == 1 else h ** (1.0 / m)
    twice = method.squares
    if m > 1:
        _bend(room.bent, rows, nodes, size, m)
        twice = room.bent
    gained[0], gained[1], gained[2], gained[3] = 0.0, 0.0, 0.0, 0.0
    place, is_piston = place_of_push(f, c), 1.0 if has_piston(c) else 0.0
    pushing = 1 if is_piston > 0.0 else place  # the contact of a piston, or the applied force
    # The first stage is the state itself; in t^(1/m) nothing moves yet.
    moves = 1.0 if m == 1 else 0.0
    for i in range(np.uint64(0), np.uint64(hi)):
        k[0, i] = moves * start.a[i]
    part = size * rows[stages, 0] * moves
    gained[0] += part * start.f[pushing] * start.v[c.pushed]
    gained[1] += part * _sum(start.power, hi)
    gained[2] += part * force_on_held(start.f, c)
    gained[3] += is_piston * part * start.f[1]
    for s in range(1, stages + 1):
        tau = size if s == stages else nodes[s] * size
        past, scale = tau, 1.0
        if m > 1:
            past, scale = tau**m, m * tau ** (m - 1)
        _fly(u1, v1, start.u, start.v, past, hi)
        _combine(u1, v1, size, twice, rows, s, k, hi)
        if s == stages:
            break
        f[place] = applied_force(leg, begin + past)
        forces(u1, v1, on, f, power, c.stiffness, c.damping, c.gap, c.damping_exponent, hi)
        if f[hi] > TINY and hi < granules:
            grown = min(hi + WINDOW, granules)
            for j in range(stages):
                for i in range(hi, grown):
                    k[j, i] = 0.0
            for i in range(hi, grown):
                power[i] = 0.0
            hi = grown
        accelerations(f, k[s], c.inverse_mass, c.constant, hi, c.pushed)
        for i in range(np.uint64(0), np.uint64(hi)):
            k[s, i] *= scale
        if rows[stages, s] != 0.0:
            part = size * rows[stages, s] * scale
            gained[0] += part * f[pushing] * v1[c.pushed]
            gained[1] += part * _sum(power, hi)
            gained[2] += part * force_on_held(f, c)
            gained[3] += is_piston * part * f[1]
    return hi


@compiled
def largest_error(
    v0: Array, v1: Array, k: Array, fifth: Array, third: Array, size: float, hi: int
) -> Any:
    """Estimate the largest error of a velocity, and find the largest velocity.

    An error is the square of one estimate over another of lower order, of the same granule: the
    quotient of the largest ones, of different granules, can be far too small.
    """
    error, fastest = 0.0, 0.0
    for i in range(np.uint64(0), np.uint64(hi)):
        by5 = by3 = 0.0
        for s in range(fifth.size):
            by5 += fifth[s] * k[s, i]
            by3 += third[s] * k[s, i]
        square = by5 * by5
        error = max(error, square / math.sqrt(square + 0.01 * by3 * by3 + TINY))
        fastest = max(fastest, abs(v0[i]), abs(v1[i]))
    return size * error, fastest


@compiled
def evaluate(at: Motion, on: Array, leg: Array, time: float, hi: int, c: Chain) -> None:
    """Forces, their rates, and accelerations of a state."""
    place = place_of_push(at.f, c)
    at.f[place], at.r[place] = applied_force(leg, time), applied_force_rate(leg, time)
    forces(at.u, at.v, on, at.f, at.power, c.stiffness, c.damping, c.gap, c.damping_exponent, hi)
    accelerations(at.f, at.a, c.inverse_mass, c.constant, hi, c.pushed)
    force_rates(at.u, at.v, at.a, on, at.r, c.stiffness, c.damping, c.gap, c.damping_exponent, hi)


_MOST_RELOCATIONS = 8
"""Most repetitions of a step for one change of modes; two or three are usual."""


@compiled
def grain(u: Array, hi: int) -> float:
    """Overlap below which displacements cannot show whether a contact is open.

    It is 4 units of the last digit of the largest displacement. A contact that is open by less can
    be at rest in no mode, and steps would not advance.
    """
    farthest = 0.0
    for i in range(hi):
        farthest = max(farthest, abs(u[i]))
    return 1e-15 * farthest


@compiled
def change_mode(at: Motion, on: Array, i: int, run: Progress, c: Chain) -> None:
    """Change the mode of a contact; its elastic energy counts as dissipated while it is off."""
    run.dissipated += held(at.u, i, c) * (2.0 * on[i] - 1.0)
    on[i] = 1.0 - on[i]


@compiled
def advance(
    patch: Patch, leg: Array, until: float, until_change: bool, run: Progress, steps: Steps,
    seen: Seen, watch: Watch, control: Array, chosen: Indices,
) -> None:  # fmt: skip
    """Take steps up to a time or, with ``until_change``, until a contact begins or ends.

    Errors are judged by the largest speed of these granules. Granule i of a patch is ``chosen[i]``
    of the chain.
    """
    start, end, on, room, c = patch.start, patch.end, patch.on, patch.room, patch.c
    method, tolerance, slowest = steps.method, steps.tolerance, steps.slowest
    longest, stable = steps.longest, steps.stable
    record, leg_end = seen.record, until
    u0, v0, u1, v1 = start.u, start.v, end.u, end.v
    root = 4 if c.damping_exponent == 1 else 2
    evaluate(start, on, leg, run.time, run.hi, c)
    keep_ends(seen, start.f, run.time, run.hi)
    # Runs with other tolerances have the same steps, so their differences do not show these errors.
    changed, is_shared = False, True
    while run.status == DONE and run.time < until and not (changed and until_change):
        time, fresh = run.time, run.fresh
        rate = max(rate_of_dampers(u0, on, run.hi, c), stable / longest)
        run.following = min(run.following, stable / rate)
        # Above a rate of 4, that of a damper of 1 between granules of mass 1, errors of forces are
        # larger than those of velocities. Tolerances below 1e-13 are round-off.
        strength = max(1.0, min(rate / 4.0, tolerance / 1e-13))
        h, tried, target, smooth, changed = run.following, 0, -1, run.following, False
        is_cut = False
        run.cost += 500.0  # what a step adds, in force evaluations of a granule (measured)
        if time + 1.01 * h >= until:
            h = until - time
        shortest = 1e-14 * (1.0 + abs(time))
        while True:
            m = root if fresh else 1
            if fresh:
                h = min(h, 0.25 * longest)
            if fresh and run.kept < record.time.size and record.time[run.kept] > time + shortest:
                h = min(h, record.time[run.kept] - time)
            hi = take_step(patch, method, leg, time, h, m, run.hi)
            run.hi = hi
            run.evaluations += method.nodes.size
            run.cost += method.nodes.size * hi
            error, fastest = largest_error(
                v0, v1, room.k, method.fifth, method.third, h if m == 1 else h ** (1.0 / m), hi
            )  # fmt: skip
            allowed = run.allowed = tolerance * max(fastest, slowest)
            # Estimates in tau can be small by chance: with a tenth errors reach 64 tolerances.
            judged = allowed * (0.001 if fresh else 1.0) / strength
            error /= judged
            if error > 1.0 and h > shortest:
                h *= max(0.1, 0.9 * error ** (-1 / 8)) ** m
                smooth = h
                continue
            after = time + h if h < until - time else until
            evaluate(end, on, leg, after, hi, c)
            if h > shortest and tried < _MOST_RELOCATIONS:
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
                    if until_change and run.changes < _MOST_RELOCATIONS:
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
            observe(watch, start, end, (begin, h, fresh), hi, c, chosen)
        if run.kept < record.time.size and record.time[run.kept] <= after:
            run.kept = keep_history(record, run.kept, start, end, on, hi, (begin, after), c)
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
        if run.cost >= steps.most_work:
            run.status = TOO_MUCH
        if run.steps >= run.steps_before + 5000:  # within a second even in long chains
            if not after > run.time_before + 5000 * 1e-7 * longest:
                run.status = STUCK
            run.steps_before, run.time_before = run.steps, after
        if run.cost >= run.look:
            run.look = run.cost + LOOK
            control[1], control[2] = after, control[2] + 1
            if is_stopped(control):
                run.status = STOPPED
            elif is_diverged(energy_of(u0, v0, 0, hi, c), run.given, run.work, run.moved, c):
                run.status = DIVERGED


@compiled_and_kept()
def march(
    steps: Steps, c: Chain, start: Start, state: State, seen: Seen, watch: Watch | None,
    usual: float, control: FloatArray,
) -> Outcome:  # fmt: skip
    """Integrate a chain of damped contacts; return what happened.

    Parameters
    ----------
    steps, c, start
        Which steps are taken, the chain with an entry for the free end, and how it starts.
    state, seen, watch, usual, control
        Filled in, displacement and velocity at the end too; the others as for ``elastic.march``,
        ``usual`` as in ``elastic_chain.Ending``.
    """
    granules, record, legs = c.inverse_mass.size, seen.record, steps.legs
    tolerance, longest, slowest = steps.tolerance, steps.longest, steps.slowest
    begun, end, on, room, run = state.start, state.end, state.on, state.room, state.run[0]
    u, v = begun.u, begun.v
    u[:granules], v[:granules] = start.motion[0], start.motion[1]
    run.fresh = start_modes(u, v, on, c)
    run.given = energy_of(u, v, 0, granules, c)
    run.time, run.following, run.hi = legs[0, START], longest / 64, min(start.moving, granules)
    run.allowed = tolerance * max(np.max(np.abs(v)), slowest)
    run.status = STOPPED if is_stopped(control) else DONE
    run.usual, run.end, run.next_end = usual, math.inf, math.inf if math.isnan(usual) else CHECK
    # Where granules fly, only a part of the chain is computed; loads, however, move them all.
    parted = np.any(c.gap > 0.0) and not np.any(c.constant) and record.time.size == 0
    parted = parted and c.pushed == 0 and c.fixed.size == 0
    since = np.full(granules, run.time)
    size = granules if parted else 0
    part_u, part_v, part_on = np.zeros(size + 1), np.zeros(size + 1), np.zeros(size)
    part_of_c = Chain(
        np.zeros(size), np.zeros(size), np.zeros(size), np.zeros(size), np.zeros(size),
        c.damping_exponent, c.attraction, 0, c.fixed,
    )  # fmt: skip
    part_force, part_time = np.zeros(size), np.zeros(size)
    inside, chosen = np.zeros(granules, np.bool_), np.zeros(size, np.int64)
    whole, everyone = Patch(begun, end, on, room, c), np.arange(granules)
    no_force = np.zeros(legs.shape[1])
    for number in range(legs.shape[0]):
        leg = legs[number]
        if parted:
            fly_on(u, v, since, run.time, 0, granules)
        if has_piston(c):
            u[0], v[0] = leg[PLACE], leg[VELOCITY]
            d, w = u[0] - u[1] - c.gap[0], v[0] - v[1]
            allowed = tolerance * max(abs(w), slowest)
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
                    fly(whole, run, stop, record)
                run.time, run.fresh = stop, False
                run.following = min(run.following, longest / 4)
            elif not parted:
                advance(
                    whole, leg, leg_end, not is_pushed, run, steps, seen, watch, control, everyone
                )
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
                group = Chain(
                    part_of_c.stiffness[:many], part_of_c.inverse_mass[:many],
                    part_of_c.gap[:many], part_of_c.constant[:many], part_of_c.damping[:many],
                    c.damping_exponent, c.attraction, 0, c.fixed,
                )  # fmt: skip
                motion = Motion(
                    part_u[: many + 1], part_v[: many + 1], begun.a, begun.f, begun.r, begun.power
                )
                run.hi = many
                # ``parted`` is true here: for a literal True all would be compiled a second time.
                peaks = Seen(part_force[:many], part_time[:many], record)
                advance(
                    Patch(motion, end, part_on[:many], room, group),
                    leg if chosen[0] == 0 else no_force, stop, parted, run,
                    Steps(
                        legs, steps.method, tolerance, max(slowest, np.max(np.abs(v))), longest,
                        steps.stable, steps.most_work,
                    ),
                    peaks, watch, control, chosen,
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
