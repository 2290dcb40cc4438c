"""An integration by the compiled kernels, whose state grows where the window needs more room.

It is loaded when the first run begins, because Numba is loaded with it.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hertzchain.arrays import Array, FloatArray
from hertzchain.engines.native import elastic, elastic_state
from hertzchain.engines.native.elastic_chain import Record
from hertzchain.engines.native.elastic_state import COUNTS, TOTALS, Outcome, State
from hertzchain.engines.native.equations import Chain
from hertzchain.engines.native.kernel_input import coefficients
from hertzchain.engines.native.methods import Stepper, SymplecticNystrom


def march(
    rows: FloatArray,
    stepper: Stepper,
    dtype: type[np.floating[Any]],
    tolerance: float,
    starting: float,
    granules: int,
    start: FloatArray,
    chain: Chain | None,
    moving: int,
    leave_behind: bool,
    force: FloatArray,
    time: FloatArray,
    record: Record,
    control: FloatArray,
) -> tuple[Outcome, Array, Array]:
    """Return what happened, and displacement and velocity at the end, shape (N,).

    The arguments are those of ``elastic.march``; ``rows`` are its legs.
    """
    assert isinstance(stepper, SymplecticNystrom)  # NumPy integrates with other methods
    columns = granules + 1
    if leave_behind and chain is None:
        columns = min(columns, elastic_state.least_columns(stepper.stages))
    state, is_verlet = at_the_start(stepper, columns, dtype), stepper.order == 2
    while True:
        outcome = elastic.march(
            rows, *coefficients(stepper), state, is_verlet, tolerance, starting, granules, start,
            chain, moving, leave_behind, force, time, record, control,
        )  # fmt: skip
        if outcome.status != elastic_state.NO_ROOM:
            return outcome, state.rows[0, :granules], state.rows[1, :granules]
        state = elastic_state.with_room(state, granules, stepper.stages)


def at_the_start(stepper: SymplecticNystrom, columns: int, dtype: type[np.floating[Any]]) -> State:
    """Return a state for the start of a run."""
    kicks, drifts = coefficients(stepper)
    return State(
        np.zeros((6, columns), dtype),
        np.zeros(5 + kicks.size + drifts.size, dtype),
        np.zeros(COUNTS, np.int64),
        np.zeros(TOTALS),
    )
