"""Integration of Eq. 1 in natural units: legs, steps, and samples handed to whoever watches."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

import numpy as np

from hertzchain.arrays import Array, Scalar
from hertzchain.engines.native.equations import acceleration, contact_force, net_force, overlap
from hertzchain.engines.native.methods import State
from hertzchain.engines.native.refinement import Walker
from hertzchain.observables.error_bound import diverged
from hertzchain.observables.samples import Samples
from hertzchain.scene.pulse import Ramp
from hertzchain.scene.schedule import Leg

_BLOCK = 256
"""Samples handed on at a time: enough to spread NumPy's cost per call, little enough memory."""


def integrate(
    displacement: Array,
    legs: Iterable[Leg],
    walker: Walker,
    show: Callable[[Samples, Leg], object],
) -> tuple[State, int]:
    """Integrate a chain that is at rest at the start.

    Parameters
    ----------
    displacement
        At the start, shape (granules,); its precision is that of the run.
    legs
        The steps and the applied force, in natural units.
    walker
        Takes the steps.
    show
        Is called with successive samples and the leg that they lie on.

    Returns
    -------
    The state at the end, and the number of steps taken.

    Raises
    ------
    StepUnstable
        If the motion diverges: the step is too long for the method.
    """
    dtype = displacement.dtype.type
    rest = np.zeros_like(displacement)
    state = State(displacement, rest, rest)
    order, taken = walker.stepper.order, 0
    with np.errstate(over="ignore", invalid="ignore"):
        for leg in legs:
            applied = leg.ramp.force if leg.ramp is not None else _no_force
            start, end = dtype(leg.start), dtype(leg.end)
            h = (end - start) / leg.steps
            # Where the applied force jumps, the acceleration jumps with it.
            state = replace(state, acceleration=acceleration(state.displacement, applied(start)))
            block: list[tuple[Scalar, State]] = [(start, state)]
            for k in range(leg.steps):
                block += walker.advance(state, start + k * h, h, applied)
                state = block[-1][1]
                if k == leg.steps - 1:  # to the last digit, so that nothing falls between legs
                    block[-1] = (end, state)
                if len(block) > _BLOCK or k == leg.steps - 1:
                    show(_samples(block, leg.ramp, order), leg)
                    taken += len(block) - 1
                    block = block[-1:]
    return state, taken


def _samples(block: Sequence[tuple[Scalar, State]], ramp: Ramp | None, order: int) -> Samples:
    time = np.array([reached for reached, _ in block])
    displacement = np.array([state.displacement for _, state in block])
    velocity = np.array([state.velocity for _, state in block])
    if not np.all(np.isfinite(velocity[-1])):
        raise diverged("native")
    pressed = overlap(displacement)
    rate = ramp.force_rate(time) if ramp else 0.0
    jerk = _jerk(pressed, overlap(velocity), rate)
    if order == 2:
        # Velocity Verlet's velocities are central differences of its displacements: off by this.
        h = (time[-1] - time[0]) / (time.size - 1)
        velocity = velocity - h**2 / 6 * jerk
    return Samples(
        time=time,
        displacement=displacement,
        velocity=velocity,
        acceleration=np.array([state.acceleration for _, state in block]),
        overlap=pressed,
        contact_force=contact_force(pressed),
        jerk=jerk,
    )


def _jerk(overlap: Array, rate: Array, applied_rate: Array | float) -> Array:
    """Time derivative of Eq. 1: that of a contact force is 3/2 overlap^(1/2) rate."""
    return net_force(1.5 * np.sqrt(np.maximum(overlap, 0)) * rate, applied_rate)


def _no_force(_: Scalar) -> float:
    return 0.0
