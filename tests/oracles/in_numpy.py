"""Symplectic steps of Eq. 1 in plain NumPy, in natural units.

Contacts are elastic: the tables of methods are for forces that do not depend on velocities.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.native.as_written import (
    on_stroke,
    samples_of,
    simulation_of,
)
from hertzchain.engines.native.equations import Chain
from hertzchain.engines.native.plan import Stepper, SymplecticNystrom, Walker
from hertzchain.engines.native.simulation import Simulation, softest, start_of
from hertzchain.limits import TIME_LIMIT, Deadline
from hertzchain.observables.samples import Recorder, Samples
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg

AppliedForce = Callable[[Any], Any]
"""Function that gives the force on the first granule at a time, in the precision of that time."""

_BLOCK = 256
"""Samples passed on together (chosen): enough for NumPy's cost per call, and little memory."""


@dataclass(frozen=True)
class State:
    """Displacement, velocity and acceleration of all granules, each of shape (granules,)."""

    displacement: FloatArray
    velocity: FloatArray
    acceleration: FloatArray


def step(
    chain: Chain, stepper: Stepper, state: State, time: float, h: float, applied: AppliedForce
) -> State:
    """Take one step of length h from ``time``."""
    assert isinstance(stepper, SymplecticNystrom)
    displacement = state.displacement.copy()
    velocity = state.velocity.copy()
    kick = state.acceleration
    for b, a in zip(stepper.kicks, stepper.drifts, strict=False):
        velocity += b * h * kick
        displacement += a * h * velocity
        time += a * h
        kick = chain.acceleration(displacement, applied(time))
    velocity += stepper.kicks[-1] * h * kick
    return State(displacement, velocity, kick)


def _walk(
    chain: Chain, walker: Walker, state: State, time: float, h: float, applied: AppliedForce
) -> Iterator[tuple[float, State]]:
    """Go from ``time`` to ``time + h``; yield time and state after each step."""
    waiting = [(time, h)]
    while waiting:
        time, h = waiting.pop()
        following = step(chain, walker.stepper, state, time, h, applied)
        if walker.tolerance > 0 and _crosses_kink(chain, walker, state, following, time, h):
            waiting += [(time + h / 2, h / 2), (time, h / 2)]
        else:
            state = following
            yield time + h, state


def _crosses_kink(
    chain: Chain, walker: Walker, before: State, after: State, time: float, h: float
) -> bool:
    """Return whether a contact opens or closes so fast within a step that the step is halved."""
    d0, d1 = chain.overlap(before.displacement), chain.overlap(after.displacement)
    rate0, rate1 = chain.closing(before.velocity), chain.closing(after.velocity)
    rate = np.maximum(np.abs(rate0), np.abs(rate1))
    opens_or_closes = (d0 > 0) != (d1 > 0)
    within_a_step = np.minimum(np.abs(d0), np.abs(d1)) < rate * h
    turns_round = ((rate0 > 0) != (rate1 > 0)) | bool(time < walker.starting)
    felt = rate**3 * h**5 > (walker.tolerance * np.max(np.abs(after.velocity))) ** 2
    return bool(np.any((opens_or_closes | (within_a_step & turns_round)) & felt))


def integrate(
    chain: Chain, legs: Iterable[Leg], walker: Walker, motion: FloatArray
) -> Iterator[tuple[Leg, Samples]]:
    """Integrate a chain; yield each leg with successive samples, of which the first is known.

    ``motion`` is displacement and velocity at the start, shape (2, granules), and after each yield
    at the end of the samples. Legs are in natural units. Raises StepUnstable if the motion
    diverges.
    """
    state = State(motion[0].copy(), motion[1].copy(), np.zeros_like(motion[0]))
    for leg in legs:
        applied = leg.ramp.force if leg.ramp is not None else lambda _: 0.0
        begin, end = leg.start, leg.end
        h = (end - begin) / leg.steps
        if leg.stroke is not None:
            u, v = on_stroke(leg, state.displacement, state.velocity)
            state = replace(state, displacement=u, velocity=v)
        # Where the applied force jumps, the acceleration jumps with it.
        pushed = chain.acceleration(state.displacement, applied(begin))
        state = replace(state, acceleration=pushed)
        block: list[tuple[float, State]] = [(begin, state)]
        for k in range(leg.steps):
            with np.errstate(over="ignore", invalid="ignore"):
                block += _walk(chain, walker, state, begin + k * h, h, applied)
            state = block[-1][1]
            # exact to the last digit, so that no time falls between legs
            if k == leg.steps - 1:
                block[-1] = (end, state)
            if len(block) > _BLOCK or k == leg.steps - 1:
                motion[:] = state.displacement, state.velocity
                yield leg, _samples(chain, leg, block, walker.stepper.order)
                block = block[-1:]


def _samples(chain: Chain, leg: Leg, block: Sequence[tuple[float, State]], order: int) -> Samples:
    time = np.array([reached for reached, _ in block])
    displacement = np.array([state.displacement for _, state in block])
    velocity = np.array([state.velocity for _, state in block])
    sampled = samples_of(chain, leg, time, displacement, velocity)
    if order > 2 or sampled.jerk is None:
        return sampled
    # The error of velocity Verlet's velocities, which are central differences of displacements.
    h = (time[-1] - time[0]) / (time.size - 1)
    return replace(sampled, velocity=velocity - h**2 / 6 * sampled.jerk)


def simulate_in_numpy(
    scene: Scene, legs: Sequence[Leg], walker: Walker, recorder: Recorder | None = None,
    start: FloatArray | None = None,
) -> Simulation:  # fmt: skip
    """Integrate a scene once, on given legs [s, N], as ``simulate`` does with the kernels.

    ``start`` has displacement and velocity in natural units, shape (2, granules), added to those of
    the scene; 0 by default.
    """
    units, chain = scene.units, Chain.of(scene)
    # An opening contact costs in proportion to stiffness over mass.
    walker = replace(walker, tolerance=walker.tolerance * softest(scene))
    natural = [leg.in_units(units.time, units.force, units.length) for leg in walker.cut(legs)]
    begin = start_of(scene, start)
    motion = begin.copy()
    blocks = integrate(chain, natural, walker, motion)
    deadline = Deadline(TIME_LIMIT)
    run = simulation_of(scene, chain, begin, blocks, deadline, recorder)
    # The velocities of samples of velocity Verlet are not those that move the granules.
    constant = np.sum(chain.mass * chain.constant * motion[0])
    return replace(
        run, displacement=motion[0], velocity=motion[1], momentum=np.sum(chain.mass * motion[1]),
        energy=chain.energy(*motion) - constant, evaluations=run.steps * walker.stepper.stages,
    )  # fmt: skip
