"""What a run of damped contacts keeps between its steps, compiled."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.native.compiling import compiled
from hertzchain.engines.native.damped_contacts import keep_history


class State(NamedTuple):
    """A chain at the start of a step: shape (granules + 1,), modes of contacts (granules,)."""

    u: FloatArray
    v: FloatArray
    on: FloatArray


class Room(NamedTuple):
    """Arrays that a step works with: derivatives at its start, its end, and scratch."""

    a0: FloatArray
    f0: FloatArray
    r0: FloatArray
    p0: FloatArray
    u1: FloatArray
    v1: FloatArray
    a1: FloatArray
    f1: FloatArray
    r1: FloatArray
    p1: FloatArray
    f: FloatArray
    power: FloatArray
    lost: FloatArray
    k: FloatArray
    bent: FloatArray
    gained: FloatArray
    # Steps and time of the last look at whether steps advance; changes of modes without a step;
    # work so far, in force evaluations of a granule.
    progress: FloatArray


class Counts(NamedTuple):
    """Counters of a run, and what decides on its next step."""

    time: float
    following: float
    fresh: bool
    hi: int
    kept: int
    steps: int
    evaluations: int
    look: float
    allowed: float
    status: int


@compiled
def copy(what: Any, to: Any, lo: int, hi: int) -> None:
    """Copy a part of an array."""
    for i in range(np.uint64(lo), np.uint64(hi)):
        to[i] = what[i]


@compiled
def with_next(counts: Any, time: float, following: float, fresh: bool) -> Any:
    """Counters with another time, next step, and whether a contact has just begun."""
    return Counts(
        time, following, fresh, counts.hi, counts.kept, counts.steps, counts.evaluations,
        counts.look, counts.allowed, counts.status,
    )  # fmt: skip


@compiled
def in_part(counts: Any, hi: int) -> Any:
    """Counters for another number of granules."""
    return Counts(
        counts.time, counts.following, counts.fresh, hi, counts.kept, counts.steps,
        counts.evaluations, counts.look, counts.allowed, counts.status,
    )  # fmt: skip


@compiled
def fly(state: Any, room: Any, c: Any, end: float, counts: Any, record: Any) -> Any:
    """Move all granules to a time while no contact acts; constant forces do."""
    h = end - counts.time
    for i in range(c.inverse_mass.size):
        pull = c.constant[i]
        room.a0[i] = room.a1[i] = pull
        room.v1[i] = state.v[i] + h * pull
        room.u1[i] = state.u[i] + h * (state.v[i] + h * pull / 2)
    room.r0[:] = 0.0
    kept = keep_history(
        record, counts.kept, state.u, state.v, room.a0, room.r0, room.u1, room.v1, room.a1, room.r0,
        state.on, c.inverse_mass.size, counts.time, end, c,
    )  # fmt: skip
    copy(room.u1, state.u, 0, c.inverse_mass.size)
    copy(room.v1, state.v, 0, c.inverse_mass.size)
    return Counts(
        end, counts.following, counts.fresh, counts.hi, kept, counts.steps, counts.evaluations,
        counts.look, counts.allowed, counts.status,
    )  # fmt: skip
