"""What a run of damped contacts keeps between its steps, compiled."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.native.damped_contacts import keep_history
from hertzchain.observables.compiling import compiled


class Motion(NamedTuple):
    """A chain at the start or at the end of a step, shape (granules + 2,).

    Displacements, velocities, accelerations; forces, how fast they grow, and the power that
    contacts dissipate: see ``damped_contacts``.
    """

    u: FloatArray
    v: FloatArray
    a: FloatArray
    f: FloatArray
    r: FloatArray
    power: FloatArray


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
"""How far a run has come, and what it has added up.

How it ended; granules 0 to hi - 1 move; frames of a history, steps, evaluations; changes of modes
without a step; steps and time of the last look at whether steps advance. Then the next step, the
error that it may have, the work so far in force evaluations of a granule, and when to look next;
energy at the start, work, what was dissipated, impulses of wall and piston, work of a piston
without its sign; the end if contacts are never pressed, the end by the pulses so far, and when to
look at them next; and whether a contact has just begun."""


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
def copy(what: Any, to: Any, lo: int, hi: int) -> None:
    """Copy a part of an array."""
    for i in range(np.uint64(lo), np.uint64(hi)):
        to[i] = what[i]


@compiled
def fly(start: Any, end: Any, on: Any, run: Any, c: Any, until: float, record: Any) -> None:
    """Move all granules to a time while no contact acts; constant forces do."""
    h, granules = until - run.time, c.inverse_mass.size
    for i in range(granules):
        pull = c.constant[i]
        start.a[i] = end.a[i] = pull
        end.v[i] = start.v[i] + h * pull
        end.u[i] = start.u[i] + h * (start.v[i] + h * pull / 2)
    start.r[:] = end.r[:] = 0.0
    run.kept = keep_history(record, run.kept, start, end, on, granules, run.time, until, c)
    copy(end.u, start.u, 0, granules)
    copy(end.v, start.v, 0, granules)
    run.time = until


NEVER = math.inf


@compiled
def is_moving(u: Any, v: Any, on: Any, i: int, c: Any) -> bool:
    """Whether contact i acts; one that only touches, between granules at rest, does not."""
    if on[i] == 0.0:
        return False
    return bool(v[i] != 0.0 or v[i + 1] != 0.0 or u[i] - u[i + 1] - c.gap[i] > 0.0)


@compiled
def any_moving(u: Any, v: Any, on: Any, c: Any) -> bool:
    """Whether any contact acts, or overlaps while its damper holds its force at 0.

    Such a contact may press again before it has opened, where a load bends the flight.
    """
    found = False
    for i in range(on.size):
        overlaps = c.stiffness[i] > 0.0 and u[i] - u[i + 1] - c.gap[i] > 0.0
        found = found or overlaps or is_moving(u, v, on, i, c)
    return found


@compiled
def clusters(u: Any, v: Any, on: Any, is_pushed: bool, c: Any, inside: Any) -> bool:
    """Find the contacts to compute, those that act and one on either side; return if any acts.

    ``inside`` is filled in, shape (granules,). With ``is_pushed`` granule 1 is among them.
    """
    size, found = on.size, False
    acts = is_pushed
    for i in range(size):
        # A contact that only touches acts as soon as its neighbour does.
        acts = is_moving(u, v, on, i, c) or (acts and (on[i] > 0.0 or i == 0))
        inside[i] = acts
    acts = False
    for i in range(size - 1, -1, -1):
        acts = inside[i] or (acts and on[i] > 0.0)
        inside[i] = acts
        found = found or acts
    before = False
    for i in range(size):
        acts = inside[i]
        inside[i] = acts or before or (i + 1 < size and inside[i + 1])
        before = acts
    return found


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
def next_touch(u: Any, v: Any, on: Any, since: Any, time: float, inside: Any, c: Any) -> Any:
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
def fly_on(u: Any, v: Any, since: Any, time: float, lo: int, hi: int) -> None:
    """Bring granules in free flight to a time."""
    for i in range(lo, hi):
        u[i] += v[i] * (time - since[i])
        since[i] = time


@compiled
def gather(c: Any, inside: Any, into: Any, chosen: Any) -> int:
    """Copy the granules of the contacts ``inside``; return their number.

    ``chosen`` is filled in with their numbers. Where the next granule is not one of them, or is
    that of another cluster, there is no contact.
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
