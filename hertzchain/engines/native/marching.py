"""An integration by the compiled kernels.

It is loaded when the first run begins, because Numba is loaded with it.
"""

from __future__ import annotations

from hertzchain.arrays import Array, FloatArray
from hertzchain.engines.native import elastic, elastic_state
from hertzchain.engines.native.elastic_state import Outcome, Seen, Steps
from hertzchain.engines.native.equations import Chain
from hertzchain.engines.native.kernel_input import coefficients
from hertzchain.engines.native.methods import SymplecticNystrom, Walker


def steps_of(rows: FloatArray, walker: Walker, softest: float = 1.0) -> Steps:
    """Return the steps of a walker on legs from ``kernel_input.leg_rows``.

    ``softest`` is that of ``kernel_input``: an opening contact costs in proportion to stiffness
    over mass.
    """
    stepper = walker.stepper
    assert isinstance(stepper, SymplecticNystrom)  # NumPy integrates with other methods
    is_verlet, tolerance = stepper.order == 2, walker.tolerance * softest
    return Steps(rows, *coefficients(stepper), is_verlet, tolerance, walker.starting)


def march(
    steps: Steps,
    granules: int,
    start: FloatArray,
    chain: Chain | None,
    moving: int,
    leave_behind: bool,
    seen: Seen,
    control: FloatArray,
) -> tuple[Outcome, Array, Array]:
    """Return what happened, and displacement and velocity at the end, shape (N,).

    The arguments are those of ``elastic.march``.
    """
    state = elastic_state.at_the_start(steps, granules)
    outcome = elastic.march(
        steps, state, granules, start, chain, moving, leave_behind, seen, control
    )
    return outcome, state.rows[0, :granules], state.rows[1, :granules]
