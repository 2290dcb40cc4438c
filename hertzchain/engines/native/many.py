"""Integrations of many plain scenes of one length by the compiled kernels, on all cores."""

from __future__ import annotations

import itertools
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextvars import Context, copy_context

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.engines.native.kernel_input import MOVING, coefficients, nothing_recorded
from hertzchain.engines.native.methods import SymplecticNystrom
from hertzchain.engines.native.refinement import Walker
from hertzchain.limits import Deadline

_PARTS_PER_CORE = 8
"""Number of parts of a batch (chosen), so that all cores end at about the same time."""

_LONGEST = 1000
"""Largest number of granules for runs in lanes: above it single runs with a window are as fast.
Lanes ran 1.7 times as many scenes at 500 granules, 1.0 times at 1,000 (measured).
"""

_LAST_SHAPE = 2
"""Largest code of a ramp's shape with a formula in the lanes; other scenes run one by one."""

Found = tuple[FloatArray, FloatArray, FloatArray, FloatArray]


def march_all(
    rows: FloatArray,
    walker: Walker,
    granules: int,
    leaves: NDArray[np.bool_],
    deadline: Deadline,
    cores: int,
) -> Found:
    """Return peak forces and times, (scenes, contacts); time reached and evaluations, (scenes,).

    ``rows`` has legs in the form of the kernels, shape (scenes, legs, 8); ``leaves`` is true for
    scenes whose granules may be dropped behind the wave, shape (scenes,). Raises TooExpensive after
    the deadline.
    """
    scenes = len(rows)
    force, time = np.zeros((scenes, granules - 1)), np.full((scenes, granules - 1), np.nan)
    found = force, time, np.zeros(scenes), np.zeros(scenes)
    control = np.zeros(3)
    unknown = np.max(rows[:, :, 3], initial=0.0) > _LAST_SHAPE
    if granules > _LONGEST or unknown:
        part = _one_by_one(rows, walker, granules, leaves, found, control)
        _on_cores(part, scenes, 1, control, deadline, cores)
        return found
    from hertzchain.engines.native.lanes_loops import LANES

    # The wave of a longer pulse is stronger and faster: similar scenes share a vector.
    pushed = np.max(rows[:, :, 1], axis=1, where=rows[:, :, 3] != 0, initial=0.0)
    order = np.lexsort((np.sum(rows[:, :, 2], axis=1), pushed))
    part = _side_by_side(rows[order], walker, granules, leaves[order], found, control)
    _on_cores(part, scenes, int(LANES), control, deadline, cores)
    for values in found:
        values[order] = values.copy()
    return found


def _side_by_side(
    rows: FloatArray, walker: Walker, granules: int, leaves: NDArray[np.bool_], found: Found,
    control: FloatArray,
) -> Callable[[slice], None]:  # fmt: skip
    """Return a function that integrates a part of the scenes side by side."""
    from hertzchain.engines.native import lanes_kernel

    assert isinstance(walker.stepper, SymplecticNystrom)

    def part(some: slice) -> None:
        lanes_kernel.march_lanes(
            rows[some], leaves[some], *coefficients(walker.stepper), _room(granules),
            walker.tolerance, walker.starting, *(values[some] for values in found), control,
        )  # fmt: skip

    return part


def _room(granules: int) -> FloatArray:
    """Return an array whose rows begin at cache lines: vectors across two take twice as long."""
    from hertzchain.engines.native.lanes_kernel import ROWS
    from hertzchain.engines.native.lanes_loops import VECTOR

    size = ROWS * (granules + 2) * VECTOR
    room = np.zeros(size + VECTOR, np.uint8)
    start = -room.ctypes.data % VECTOR
    return room[start : start + size].view(np.float64).reshape(ROWS, -1)


def _one_by_one(
    rows: FloatArray, walker: Walker, granules: int, leaves: NDArray[np.bool_], found: Found,
    control: FloatArray,
) -> Callable[[slice], None]:  # fmt: skip
    """Return a function that integrates a part of the scenes one after the other."""
    from hertzchain.engines.native import elastic_chain, elastic_state, marching

    force, time, end, evaluations = found
    leave_behind, at_rest = bool(np.all(leaves)), np.zeros((0, 0))

    def part(some: slice) -> None:
        for scene in range(some.start, min(some.stop, len(rows))):
            legs = rows[scene]
            taken = legs[legs[:, elastic_chain.STEPS] > 0]  # a leg without steps is left out
            seen = elastic_state.Seen(force[scene], time[scene], nothing_recorded())
            steps = marching.steps_of(taken, walker)
            outcome, _, _ = marching.march(
                steps, granules, at_rest, None, MOVING, leave_behind, seen, control
            )
            end[scene] = outcome.end
            diverged = outcome.status == elastic_state.DIVERGED
            evaluations[scene] = np.nan if diverged else outcome.evaluations

    return part


def _on_cores(
    part: Callable[[slice], None], scenes: int, together: int, control: FloatArray,
    deadline: Deadline, cores: int,
) -> None:  # fmt: skip
    """Run parts of the scenes, each a multiple of ``together``, in parallel on all cores."""
    size = together * max(1, -(-scenes // (together * cores * _PARTS_PER_CORE)))
    parts = [slice(start, start + size) for start in range(0, scenes, size)]
    limit = min(max(0.0, deadline.left), threading.TIMEOUT_MAX)
    with ThreadPoolExecutor(cores) as pool:
        try:
            contexts = [copy_context() for _ in parts]  # one cannot be entered twice at once
            list(pool.map(Context.run, contexts, itertools.repeat(part), parts, timeout=limit))
        except BaseException as problem:
            control[0] = -1
            pool.shutdown(cancel_futures=True)
            if isinstance(problem, TimeoutError):
                raise deadline.passed() from None
            raise
