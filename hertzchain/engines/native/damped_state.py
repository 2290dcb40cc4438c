"""What a run of damped contacts keeps between its steps, compiled."""

from __future__ import annotations

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
