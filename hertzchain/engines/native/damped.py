"""One integration of a chain whose contacts are damped."""

from __future__ import annotations

import functools
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.native.equations import Chain
from hertzchain.engines.native.kernel_input import room_for
from hertzchain.engines.native.simulation import Simulation
from hertzchain.observables.contact_errors import Peaks

if TYPE_CHECKING:
    from hertzchain.engines.native.damped_advance import Method

_MOVING = 8
"""Number of granules in the window at the start of a run."""

_ROUNDED = 1e-14
"""Limit below which products of coefficients are 0 up to rounding; all others are far above."""


def integrate_damped(
    chain: Chain,
    rows: FloatArray,
    start: FloatArray,
    tolerance: float,
    longest: float,
    record: Any = None,
    control: FloatArray | None = None,
    most_work: float = math.inf,
    longer: float = 1.0,
) -> Simulation:
    """Integrate a chain of damped contacts with the compiled kernel.

    Parameters
    ----------
    chain
        The chain to integrate.
    rows
        Legs of the applied force, from ``kernel_input.leg_rows``, shape (legs, 8).
    start
        Displacement and velocity at the start, shape (2, granules), or (0, 0) for a chain at rest.
    tolerance
        Error of the velocities in a step over the largest velocity.
    longest
        The longest step, 0.8 of the natural time unit of the fastest contact.
    record, control
        An ``elastic_state.Record``, and the array that stops the run, as in ``elastic.march``.
    most_work
        Force evaluations of a granule after which the run ends; a step counts as further 500.
    longer
        By how much steps may be longer, also those that strong dampers allow; at most 1.5.
    """
    from hertzchain.engines.native import damped_advance, damped_kernel
    from hertzchain.engines.native.damped_state import at_the_start
    from hertzchain.engines.native.elastic_state import Seen

    granules, contacts = chain.inverse_mass.size, chain.stiffness.size
    record = room_for(None, granules) if record is None else record
    # The front of a wave moves granules smoothly, but not across a gap or under a static load.
    has_front = start.size == 0 and not chain.gap.any() and not chain.constant.any()
    force, time = np.zeros(contacts), np.full(contacts, np.nan)
    method = _method()
    state = at_the_start(granules, method.nodes.size)
    found = damped_kernel.march(
        rows, method, chain.padded(), start if start.size else np.zeros((2, granules)),
        _MOVING if has_front else granules, tolerance, longer * longest,
        longer * damped_advance.STABLE, most_work, state, Seen(force, time, record),
        np.zeros(3) if control is None else control,
    )  # fmt: skip
    peaks = Peaks(force, time, time < found.end)
    return Simulation.of(found, state.start.u[:granules], state.start.v[:granules], peaks)


@functools.cache
def _method() -> Method:
    """Return the coefficients of DOP853 in the form of the kernel."""
    from scipy.integrate import DOP853

    from hertzchain.engines.native.damped_advance import Method

    rows = np.concatenate([DOP853.A, [DOP853.B]])
    squares = rows @ rows[:-1]
    squares[abs(squares) < _ROUNDED] = 0.0
    return Method(np.array(DOP853.C), rows, squares, DOP853.E5[:-1], DOP853.E3[:-1])
