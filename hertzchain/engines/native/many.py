"""Integrations of many plain scenes of one length by the compiled kernels, on all cores."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextvars import copy_context
from typing import Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.native.kernel_input import MOVING, nothing_recorded, steps_of
from hertzchain.engines.native.methods import Walker
from hertzchain.limits import Deadline

_PARTS_PER_CORE = 8
"""Number of parts of a batch (chosen), so that all cores end at about the same time."""


def march_all(
    rows: FloatArray,
    walker: Walker,
    granules: int,
    deadline: Deadline,
    cores: int,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return peak forces and times, (scenes, contacts); time reached and evaluations, (scenes,).

    ``rows`` has the legs of one pulse each in the form of the kernels, shape (scenes, legs, 8).
    Raises TooExpensive after the deadline.
    """
    from hertzchain.engines.native import elastic, elastic_state

    scenes = len(rows)
    force, time = np.zeros((scenes, granules - 1)), np.full((scenes, granules - 1), np.nan)
    found = force, time, np.zeros(scenes), np.zeros(scenes)
    steps, control = steps_of(rows[0], walker), np.zeros(3)
    at_rest, nothing = np.zeros((0, 0)), nothing_recorded()

    def part(some: slice) -> None:
        state, blank = (elastic_state.at_the_start(granules) for _ in range(2))
        elastic.march_each(
            rows[some], steps, state, blank, granules, at_rest, MOVING, force[some], time[some],
            nothing, found[2][some], found[3][some], control,
        )  # fmt: skip

    size = max(1, -(-scenes // (cores * _PARTS_PER_CORE)))
    parts = [slice(start, start + size) for start in range(0, scenes, size)]
    limit = min(max(0.0, deadline.left), threading.TIMEOUT_MAX)
    with ThreadPoolExecutor(cores) as pool:
        try:
            list(pool.map(run_in_context(part), parts, timeout=limit))
        except BaseException as problem:
            control[0] = -1
            pool.shutdown(cancel_futures=True)
            if isinstance(problem, TimeoutError):
                raise deadline.passed() from None
            raise
    return found


def run_in_context(part: Callable[[Any], None]) -> Callable[[Any], None]:
    """Return a function for other threads, whose time for compiling counts for the run here."""
    context = copy_context()
    # One context cannot be entered twice at once.
    return lambda some: context.copy().run(part, some)
