"""Eq. 1 integrated in plain NumPy, written like the formulas, in natural units.

The compiled kernels compute the same up to round-off. Any floating-point precision of NumPy works.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hertzchain.arrays import Array, Scalar
from hertzchain.engines.native.equations import acceleration, contact_force, jerk, overlap
from hertzchain.engines.native.methods import RungeKuttaNystrom, Stepper, SymplecticNystrom
from hertzchain.engines.native.refinement import Refined, Walker
from hertzchain.engines.native.simulation import End, Peaks, Simulation
from hertzchain.observables.error_bound import diverged
from hertzchain.observables.history import Recorder
from hertzchain.observables.peaks import PeakWatch
from hertzchain.observables.samples import Samples
from hertzchain.observables.work import work_done
from hertzchain.scene.pulse import Ramp
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg

AppliedForce = Callable[[Any], Any]
"""Function that gives the force on the first granule at a time, in the precision of that time."""

_BLOCK = 256
"""Samples passed on at a time (chosen): NumPy's cost per call is small, and so is the memory."""


@dataclass(frozen=True)
class State:
    """Displacement, velocity and acceleration of all granules, each of shape (granules,)."""

    displacement: Array
    velocity: Array
    acceleration: Array


def step(stepper: Stepper, state: State, time: Scalar, h: Scalar, applied: AppliedForce) -> State:
    """Take one step of length h from ``time``."""
    if isinstance(stepper, SymplecticNystrom):
        return _symplectic_step(stepper, state, time, h, applied)
    return _runge_kutta_step(stepper, state, time, h, applied)


def _symplectic_step(
    stepper: SymplecticNystrom, state: State, time: Scalar, h: Scalar, applied: AppliedForce
) -> State:
    displacement = state.displacement.copy()
    velocity = state.velocity.copy()
    kick = state.acceleration
    for b, a in zip(stepper.kicks, stepper.drifts, strict=False):
        velocity += b * h * kick
        displacement += a * h * velocity
        time += a * h
        kick = acceleration(displacement, applied(time))
    velocity += stepper.kicks[-1] * h * kick
    return State(displacement, velocity, kick)


def _runge_kutta_step(
    stepper: RungeKuttaNystrom, state: State, time: Scalar, h: Scalar, applied: AppliedForce
) -> State:
    u, v = state.displacement, state.velocity
    accelerations = [state.acceleration]
    for c, row in zip(stepper.nodes[1:], stepper.position, strict=True):
        there = u + c * h * v
        for a, earlier in zip(row, accelerations, strict=True):
            there += a * h * h * earlier
        accelerations.append(acceleration(there, applied(time + c * h)))
    displacement, velocity = u + h * v, v.copy()
    for weight, known in zip(stepper.position_weights, accelerations, strict=True):
        displacement += weight * h * h * known
    for weight, known in zip(stepper.velocity_weights, accelerations, strict=True):
        velocity += weight * h * known
    last = acceleration(displacement, applied(time + h))
    return State(displacement, velocity + stepper.last_weight * h * last, last)


def _walk(
    walker: Walker, state: State, time: Scalar, h: Scalar, applied: AppliedForce
) -> Iterator[tuple[Scalar, State]]:
    """Go from ``time`` to ``time + h``; yield time and state after each step."""
    waiting = [(time, h)]
    while waiting:
        time, h = waiting.pop()
        following = step(walker.stepper, state, time, h, applied)
        if isinstance(walker, Refined) and _crosses_kink(walker, state, following, time, h):
            waiting += [(time + h / 2, h / 2), (time, h / 2)]
        else:
            state = following
            yield time + h, state


def _crosses_kink(walker: Refined, before: State, after: State, time: Scalar, h: Scalar) -> bool:
    """Return whether a contact opens or closes so fast within a step that the step is halved."""
    r0, r1 = overlap(before.displacement), overlap(after.displacement)
    rate0, rate1 = overlap(before.velocity), overlap(after.velocity)
    rate = np.maximum(np.abs(rate0), np.abs(rate1))
    opens_or_closes = (r0 > 0) != (r1 > 0)
    within_a_step = np.minimum(np.abs(r0), np.abs(r1)) < rate * h
    turns_round = ((rate0 > 0) != (rate1 > 0)) | bool(time < walker.starting)
    felt = rate**3 * h**5 > (walker.tolerance * np.max(np.abs(after.velocity))) ** 2
    return bool(np.any((opens_or_closes | (within_a_step & turns_round)) & felt))


def integrate(
    displacement: Array,
    legs: Iterable[Leg],
    walker: Walker,
    update: Callable[[Samples, Leg], object],
    velocity: Array | None = None,
) -> tuple[State, int]:
    """Integrate a chain; return the state at the end, and the number of steps.

    The displacement at the start, shape (granules,), sets the precision; the velocity has the same
    shape and is 0 by default. Legs are in natural units. ``update`` is called with successive
    samples and their leg. Raises StepUnstable if the motion diverges.
    """
    dtype = displacement.dtype.type
    rest = np.zeros_like(displacement)
    state, taken = State(displacement, rest if velocity is None else velocity, rest), 0
    with np.errstate(over="ignore", invalid="ignore"):
        for leg in legs:
            applied = leg.ramp.force if leg.ramp is not None else lambda _: 0.0
            start, end = dtype(leg.start), dtype(leg.end)
            h = (end - start) / leg.steps
            # Where the applied force jumps, the acceleration jumps with it.
            state = replace(state, acceleration=acceleration(state.displacement, applied(start)))
            block: list[tuple[Scalar, State]] = [(start, state)]
            for k in range(leg.steps):
                block += _walk(walker, state, start + k * h, h, applied)
                state = block[-1][1]
                # exact to the last digit, so that no time falls between legs
                if k == leg.steps - 1:
                    block[-1] = (end, state)
                if len(block) > _BLOCK or k == leg.steps - 1:
                    update(_samples(block, leg.ramp, walker.stepper.order), leg)
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
    third = jerk(pressed, overlap(velocity), ramp.force_rate(time) if ramp else 0.0)
    if order == 2:
        # The error of velocity Verlet's velocities, which are central differences of displacements.
        h = (time[-1] - time[0]) / (time.size - 1)
        velocity = velocity - h**2 / 6 * third
    return Samples(
        time=time,
        displacement=displacement,
        velocity=velocity,
        acceleration=np.array([state.acceleration for _, state in block]),
        overlap=pressed,
        contact_force=contact_force(pressed),
        jerk=third,
    )


def simulate_in_numpy(
    scene: Scene,
    legs: Sequence[Leg],
    walker: Walker,
    recorder: Recorder | None = None,
    dtype: type[np.floating[Any]] = np.float64,
    start: Array | None = None,
) -> Simulation:
    """Integrate a scene once, on given legs [s, N], as ``simulate`` does with the kernels.

    Any floating-point precision of NumPy works. ``start`` has displacement and velocity in natural
    units, shape (2, granules); 0 by default.
    """
    units = scene.units
    watch = PeakWatch(scene.chain.granules - 1, dtype)
    work = dtype(0)

    def update(samples: Samples, leg: Leg) -> None:
        nonlocal work
        watch.update(samples)
        if leg.ramp is not None:
            work += work_done(samples, leg.ramp)
        if recorder is not None:
            recorder.update(samples)

    natural = [leg.in_units(units.time, units.force) for leg in walker.cut(legs)]
    if start is None:
        start = np.zeros((2, scene.chain.granules), dtype)
    state, steps = integrate(start[0], natural, walker, update, start[1])
    pressed = overlap(state.displacement)
    return Simulation(
        End(state.displacement, state.velocity),
        Peaks(watch.force, watch.time, watch.passed),
        work,
        np.sum(state.velocity),
        0.5 * np.sum(state.velocity**2) + 0.4 * np.sum(contact_force(pressed) * pressed),
        steps,
        steps * walker.stepper.stages,
    )
