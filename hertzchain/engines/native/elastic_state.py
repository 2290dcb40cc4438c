"""What a run of elastic contacts keeps between its steps, and what it found."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.observables.compiling import part

DONE, DIVERGED, STOPPED, TOO_MUCH, STUCK = range(5)
"""How a run ended. The last two occur with adaptive steps: more work than allowed, and steps that
do not advance."""

DEEPEST = 60
"""Most halvings of a step; with more, time would not advance."""

AHEAD = 8
"""Granules that the window grows by; a whole number of vectors."""

LEAST = math.sqrt(float(np.finfo(np.float64).tiny))
"""The least overlap, the smallest normal number. Kernels that take it from NumPy, or use
``np.all``, also load Numba's arraymath and SciPy's linear algebra: a fifth of the time of a short
command."""

PROGRESS = np.dtype(
    [
        (name, np.int64)
        for name in ("kept", "steps", "evaluations", "granule_evaluations")
    ]
    + [
        (name, np.float64)
        for name in (
            "time", "push", "given", "work", "wall", "piston", "moved", "momentum",
            "energy",
        )
    ],
    align=True,
)  # fmt: skip
"""What a run has added up: frames of a history, steps, force evaluations; time of its start,
applied force of the moment; energy at the start, work, impulses of wall and piston, work that a
piston did and took, both counted as positive; momentum and energy of what was left behind."""


class Steps(NamedTuple):
    """Which steps are taken.

    ``legs``, shape (legs, 8), have the steps and the applied force: see ``elastic_chain.START``;
    ``kicks`` and ``drifts`` are the method: see ``methods.SymplecticNystrom``; ``verlet`` says
    whether velocities are those of velocity Verlet: see ``elastic_chain.motion_of_granule``;
    ``tolerance`` and ``starting`` are as in ``methods.Walker``, 0 for steps as given.
    """

    legs: FloatArray
    kicks: FloatArray
    drifts: FloatArray
    verlet: bool
    tolerance: float
    starting: float


class Record(NamedTuple):
    """Where to keep a history: the wanted times, (times,), and what is known then, (times, ...)."""

    time: FloatArray
    displacement: FloatArray
    velocity: FloatArray
    contact_force: FloatArray


class Seen(NamedTuple):
    """Results of a run for the contacts; the run fills them in.

    Peak forces and times are zero and NaN at the start, shape (N - 1,), or (N,) with a wall, which
    is last. The times of the record increase; the rest of it is zero at the start.
    """

    force: FloatArray
    time: FloatArray
    record: Record


class State(NamedTuple):
    """All that a run changes; allocated outside of the kernels, which then need no memory.

    Parameters
    ----------
    rows
        The motion, zero at the start, shape (6, columns): displacement, velocity and acceleration,
        then the same three at the start of the step. There are N + 1 columns.
    progress
        Zero at the start, shape (1,): see ``PROGRESS``.
    """

    rows: FloatArray
    progress: Any


class Outcome(NamedTuple):
    """Results of a run besides its peaks.

    Parameters
    ----------
    status, end
        DONE or one of the next constants; time reached.
    steps, evaluations, granule_evaluations
        Steps taken; force evaluations of the whole chain, also those of refused steps, with
        adaptive steps those of single granules; force evaluations counted granule by granule.
    work
        Done by the applied force or the piston, and the energy at the start.
    momentum, energy
        Of all granules but a piston, those left behind too; the energy with that in constant
        forces.
    wall_impulse, piston_impulse, dissipated
        Integrals of the forces on the wall and of the piston on granule 2 over time, 0 without one;
        energy lost in dampers.
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
    dissipated: float


@part
def is_stopped(control: Any) -> bool:
    """Whether a run is to end: see ``control`` of ``elastic.march``."""
    return control[0] < 0 or 0 < control[0] <= control[2]


def at_the_start(granules: int) -> State:
    """Return a state for the start of a run."""
    return State(np.zeros((6, granules + 1)), np.zeros(1, PROGRESS))
