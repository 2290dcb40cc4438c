"""What a run of elastic contacts keeps between its steps, and what it found."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from hertzchain.arrays import Array, FloatArray
from hertzchain.engines.native.compiling import part

DONE, DIVERGED, STOPPED, NO_ROOM = range(4)
"""How a run ended. After NO_ROOM it goes on from where it was, in the state of ``with_room``."""

DEEPEST = 60
"""Halvings of a step; below that time does not move."""

AHEAD = 8
"""Granules that the window grows by; a whole number of vectors."""

MOST_LATE = 64
"""The most waves that are followed alone. Chosen."""

EPS, TINY = range(2)

SINGLE = float(np.finfo(np.float32).eps), float(np.finfo(np.float32).tiny)

DOUBLE = float(np.finfo(np.float64).eps), float(np.finfo(np.float64).tiny)
"""Rounding error and least number. Kernels that ask NumPy for them, or for ``np.all``, load Numba's
arraymath and SciPy's linear algebra with it, a fifth of the time that a short command takes."""


class State(NamedTuple):
    """All that a run changes; made and held outside of the kernels, which then need no memory.

    Parameters
    ----------
    rows
        The motion, zero at the start, shape (6, columns), in the precision of the run:
        displacement, velocity and acceleration, then the same three at the start of the step. There
        are N + 1 columns, or, where the window moves along, at least ``least_columns``.
    numbers
        Further numbers of that precision, zero at the start, shape (5 + coefficients of the
        method,): see ``ZERO``.
    counts, totals
        Zero at the start, shapes ``(COUNTS,)`` and ``(TOTALS,)``: see ``LO``.
    """

    rows: Array
    numbers: Array
    counts: Array
    totals: FloatArray


class Outcome(NamedTuple):
    """What a run found besides its peaks.

    Parameters
    ----------
    status
        DONE, DIVERGED, STOPPED or NO_ROOM.
    steps, evaluations
        Steps taken, and force evaluations of the chain, those of refused steps too.
    granule_evaluations
        Force evaluations counted granule by granule.
    end
        Time reached.
    work
        Done by the applied force or the piston, and the energy at the start.
    momentum, energy
        Of all granules but a piston, those left behind too; the energy with that in constant
        forces.
    wall_impulse
        Integral of the force on the wall over time; 0 at a free end.
    piston_impulse
        Integral of the force of the piston on granule 2 over time; 0 without a piston.
    """

    status: int
    steps: int
    evaluations: int
    granule_evaluations: int
    end: float
    work: float
    momentum: float
    energy: float
    wall_impulse: float
    piston_impulse: float


# What march keeps between two calls, by place in two arrays. GIVEN is the energy at the start,
# MOVED the work that a piston did and took, both counted as positive.
# LATE is the number of parts of the window behind the last, and behind it stand where each of them
# begins and ends, from the rearmost on. NUMBER is that of the leg, BASE the granule of column 0,
# ROOM where the seven numbers begin that ``highest_place`` needs.
LO, HI, WHOLE, PART, LEVEL, KEPT, STEPS_TAKEN, EVALUATIONS, GRANULE_EVALUATIONS, LATE = range(10)

NUMBER, BASE, BEGUN = range(LATE + 1 + 2 * MOST_LATE, LATE + 4 + 2 * MOST_LATE)

TIME, NEXT_CHECK, WORK, MOMENTUM, ENERGY, GIVEN, WALL, PISTON, MOVED, ROOM = range(10)

COUNTS, TOTALS = BEGUN + 1, ROOM + 7
"""Lengths of both arrays."""

ZERO, LEAST, PUSH, STEP, DIP_TIMES_STEP, COEFFICIENTS = range(6)
"""Places among the numbers of a run that have the precision of its state: 0, the least overlap that
is one, the applied force of the moment, the step, ``DIP`` times it, and where the coefficients of
the method begin, times the step or its square."""


@part
def is_stopped(control: Any) -> bool:
    """Whether a run is to end: see ``control`` of ``elastic.march``."""
    return control[0] < 0 or 0 < control[0] <= control[2]


@part
def margin_of(stages: int) -> int:
    """Columns ahead of the window that a step may need."""
    return AHEAD * (stages + 2)


def least_columns(stages: int) -> int:
    """Columns of a state whose window moves along."""
    return 1024 + 2 * margin_of(stages)


def with_room(state: State, granules: int, stages: int) -> State:
    """Return a state after NO_ROOM with its window at the beginning of its columns.

    They are twice as many if the window and what a step may need fill more than half of them.
    """
    count, columns = state.counts, state.rows.shape[1]
    first = count[LO] if count[LATE] == 0 else count[LATE + 1]
    width = count[HI] - first
    if width + margin_of(stages) > columns // 2:
        columns = min(2 * columns, granules + 1)
    rows = np.zeros((len(state.rows), columns), state.rows.dtype)
    rows[:3, :width] = state.rows[:3, first : first + width]
    rows[3, :width] = rows[0, :width]  # no step writes those of granules at rest
    count[BASE] += first
    count[[LO, HI]] -= first
    count[LATE + 1 : LATE + 1 + 2 * count[LATE]] -= first
    return state._replace(rows=rows)
