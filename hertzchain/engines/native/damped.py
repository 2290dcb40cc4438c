"""One integration of a chain whose contacts are damped."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.native.equations import Chain
from hertzchain.engines.native.kernel_input import room_for
from hertzchain.engines.native.methods import DOP853
from hertzchain.observables.contact_errors import Peaks
from hertzchain.observables.first_pulse import FirstPulses

if TYPE_CHECKING:
    from hertzchain.engines.native.damped_advance import Method

_MOVING = 8
"""Number of granules in the window at the start of a run."""

_ROUNDED = 1e-14
"""Limit below which products of coefficients are 0 up to rounding; all others are far above."""


@dataclass(frozen=True, eq=False)
class Simulated:
    """Results of one integration, in natural units."""

    status: int  # ``damped_advance.DONE`` or one of the next constants there
    displacement: FloatArray  # state at the end, shape (granules,)
    velocity: FloatArray
    peak_force: FloatArray  # shape (contacts,)
    peak_time: FloatArray  # NaN for a contact that was never pressed
    end: float  # time reached
    work: float  # work of the applied force or the piston, plus the energy at the start
    dissipated: float  # energy lost in the contacts
    momentum: float  # of all granules except a piston at the end
    energy: float  # of the same granules at the end, with that of constant forces
    wall_impulse: float  # integral of the force on the wall
    piston_impulse: float  # integral of the force of the piston
    steps: int
    evaluations: int  # of the forces of the granules computed, including refused steps
    first: FirstPulses | None = None

    @property
    def peaks(self) -> Peaks:
        """What the run saw of the contacts."""
        passed = self.peak_time < self.end
        return Peaks(self.peak_force, self.peak_time, passed, self.first)


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
) -> Simulated:
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
        An ``elastic_chain.Record``, and the array that stops the run, as in ``elastic.march``.
    most_work
        Force evaluations of a granule after which the run ends; a step counts as further 500.
    longer
        By how much steps may be longer, also those that strong dampers allow; at most 1.5.
    """
    from hertzchain.engines.native import damped_advance, damped_kernel

    granules, contacts = chain.inverse_mass.size, chain.stiffness.size
    record = room_for(None, granules) if record is None else record
    # The front of a wave moves granules smoothly, but not across a gap or under a static load.
    has_front = start.size == 0 and not chain.gap.any() and not chain.constant.any()
    force, time = np.zeros(contacts), np.full(contacts, np.nan)
    found, displacement, velocity = damped_kernel.march(
        rows, _method(), chain.padded(), start if start.size else np.zeros((2, granules)),
        _MOVING if has_front else granules, tolerance, longer * longest,
        longer * damped_advance.STABLE, most_work, force, time, record,
        np.zeros(3) if control is None else control,
    )  # fmt: skip
    return Simulated(
        found.status,
        displacement,
        velocity,
        force,
        time,
        found.end,
        found.given,
        found.dissipated,
        found.momentum,
        found.energy,
        found.wall_impulse,
        found.piston_impulse,
        found.steps,
        found.evaluations,
    )


@functools.cache
def _method() -> Method:
    """Return the coefficients of the method in the form of the kernel."""
    from hertzchain.engines.native.damped_advance import Method

    rows = np.zeros((DOP853.stages + 1, DOP853.stages))
    for row, known in zip(rows[1:], (*DOP853.rows, DOP853.weights), strict=True):
        row[: len(known)] = known
    squares = rows @ rows[:-1]
    squares[abs(squares) < _ROUNDED] = 0.0
    return Method(
        np.array(DOP853.nodes),
        rows,
        squares,
        np.array(DOP853.fifth),
        np.array(DOP853.third),
    )
