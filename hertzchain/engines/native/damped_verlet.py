"""Velocity Verlet of any chain at given steps, and of scenes with damped contacts."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.engines.external.accuracy import damped_interval_at
from hertzchain.engines.native.as_written import law_of, simulation_of, start_of_motion
from hertzchain.engines.native.equations import Chain
from hertzchain.engines.native.simulation import Simulation
from hertzchain.limits import TIME_LIMIT, Deadline, refuse_memory
from hertzchain.observables.error_bound import diverged
from hertzchain.observables.samples import Recorder, Samples, closing, true_forces
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg

if TYPE_CHECKING:
    from hertzchain.engines.native.damped_verlet_kernel import Walk

_SAMPLES_PER_RAMP = 8
"""Least number of samples, if there are so many steps, for the work of short pulses (chosen)."""

_BLOCK = 256
"""Samples that are processed together: with 60 granules they fit into a cache of 1 MB."""

_NOT_LED = np.zeros(0)


def simulate_damped_verlet(
    scene: Scene, legs: Sequence[Leg], deadline: Deadline | None = None,
    recorder: Recorder | None = None, start: FloatArray | None = None, first: bool = False,
) -> Simulation:  # fmt: skip
    """Integrate a scene with damped contacts by velocity Verlet on given legs [s, N].

    The damping of a step takes velocities of half a step before, as LAMMPS forms it. The recorder,
    if there is one, has natural units. ``start`` is displacement and velocity added to those of the
    scene, natural units, shape (2, granules); ``first``: first pulses are wanted. Raises
    StepUnstable if the motion diverges, TooExpensive if the run has taken longer than the deadline,
    an hour by default.
    """
    deadline = deadline or Deadline(TIME_LIMIT)
    at_start, blocks = start_of_motion(scene, start), samples_of(scene, legs, deadline, start)
    run = simulation_of(
        scene, Chain.of(scene), at_start, blocks, deadline, recorder, first, late=0.5
    )
    steps = sum(leg.steps for leg in legs)
    return replace(run, steps=steps, evaluations=steps)


def samples_of(
    scene: Scene, legs: Sequence[Leg], deadline: Deadline | None = None,
    start: FloatArray | None = None, every: int | None = None,
) -> Iterator[tuple[Leg, Samples]]:  # fmt: skip
    """The samples of a run, block by block, each with its leg, in natural units.

    The first sample of a block is the last sample of the block before. They are ``every`` steps
    apart, and at the ends of legs; by default as in readings of other codes. Forces are computed
    with the velocities of the samples. The other arguments are those of ``simulate_damped_verlet``.
    """
    from hertzchain.engines.native.damped_verlet_kernel import Walk

    deadline = deadline or Deadline(TIME_LIMIT)
    chain, unit = Chain.of(scene), scene.units
    refuse_memory(8.0 * scene.bodies * 20 * _BLOCK)
    law = law_of(chain)
    displacement, velocity = start_of_motion(scene, start)
    walk = Walk.of(chain, displacement, velocity, (chain.pushed,))
    for leg in legs:
        stride = every or stride_of(scene, leg)
        natural = leg.in_units(unit.time, unit.force, unit.length)
        if natural.stroke is not None:
            walk.u[0] = natural.stroke.displacement_at(natural.start)
            walk.v[0] = natural.stroke.velocity

        def time_at(steps: NDArray[np.intp], leg: Leg = natural) -> FloatArray:
            return np.where(steps < leg.steps, leg.start + leg.dt * steps, leg.end)

        def applied(steps: NDArray[np.intp], leg: Leg = natural) -> FloatArray:
            force = 0.0 if leg.ramp is None else leg.ramp.force(time_at(steps, leg))
            return np.broadcast_to(force, steps.shape)[:, np.newaxis]

        for kept, states in states_of(walk, natural.dt, leg.steps, applied, deadline, stride):
            if not np.all(np.isfinite(states)):
                raise diverged("native")
            yield natural, true_forces(_samples(time_at(kept), states, chain.gap), law, natural)


def states_of(
    walk: Walk, dt: float, steps: int, applied: Callable[[NDArray[np.intp]], FloatArray],
    deadline: Deadline, stride: int = 1, led: FloatArray = _NOT_LED, block: int = _BLOCK,
) -> Iterator[tuple[NDArray[np.intp], FloatArray]]:  # fmt: skip
    """Take equal steps; yield the kept steps and their states, (4, kept, granules), in blocks.

    The first state of a block is the last state of the block before. States are displacement,
    velocity, acceleration and force of the contact ahead of each granule, all in the units of
    ``walk``.
    ``applied`` gives the forces on the pushed granules after some steps, (steps, pushed);
    ``led`` is the displacement of a piston before the first step and after each, unless it follows
    from the velocity of granule 1. Raises TooExpensive.
    """
    from hertzchain.engines.native.damped_verlet_kernel import take_steps

    for done, last in itertools.pairwise([*range(0, max(steps, 1), block * stride), steps]):
        if deadline.left <= 0:
            raise deadline.passed()
        kept = np.append(np.arange(done, last, stride), last)
        states = np.empty((4, kept.size, walk.chain.inverse_mass.size))
        forces = np.ascontiguousarray(applied(np.arange(done, last + 1)))
        take_steps(walk, dt, forces, led[done : last + 1], stride, done == 0, states)
        yield kept, states


def stride_of(scene: Scene, leg: Leg) -> int:
    """Steps between two samples on a leg, as other codes with this step are read."""
    interval = damped_interval_at(scene, leg.dt)
    stride = int(min(interval / leg.dt, leg.steps))
    if leg.ramp is not None:
        stride = min(stride, leg.steps // _SAMPLES_PER_RAMP)
    return max(1, stride)


def _samples(time: FloatArray, states: FloatArray, gap: FloatArray) -> Samples:
    u, v, a, f = states
    overlap = closing(u, gap.size) - gap
    return Samples(time, u, v, a, overlap, f[:, : gap.size])
