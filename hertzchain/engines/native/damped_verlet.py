"""Scenes with damped contacts by velocity Verlet, at the steps that are asked for."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from hertzchain.arrays import Array, FloatArray
from hertzchain.engines.external.step_error import damped_interval_at
from hertzchain.engines.native.equations import Chain
from hertzchain.engines.native.kernel_input import leg_rows
from hertzchain.engines.native.sampled import simulation_of, state_at_start
from hertzchain.engines.native.simulation import Simulation
from hertzchain.limits import TIME_LIMIT, Deadline, refuse_memory
from hertzchain.observables.damped_law import DampedLaw, true_forces
from hertzchain.observables.error_bound import diverged
from hertzchain.observables.first_pulse import Contacts
from hertzchain.observables.history import Recorder
from hertzchain.observables.samples import Samples, closing
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg

_SAMPLES_PER_RAMP = 8
"""At least, if there are so many steps: the work of a short pulse needs them (chosen)."""

_BLOCK = 256
"""Samples looked at together (chosen)."""


def simulate_damped_verlet(
    scene: Scene,
    legs: Sequence[Leg],
    deadline: Deadline | None = None,
    recorder: Recorder | None = None,
    start: FloatArray | None = None,
    first: bool = False,
) -> Simulation:
    """Integrate a scene with damped contacts by velocity Verlet on given legs [s, N].

    The damping of a step takes velocities of half a step before, as LAMMPS forms it. The recorder,
    if there is one, has natural units. ``start`` is displacement and velocity added to those of the
    scene, natural units, shape (2, granules); ``first``: first pulses are wanted. Raises
    StepUnstable if the motion diverges, TooExpensive if the run has taken longer than the deadline,
    an hour by default.
    """
    deadline = deadline or Deadline(TIME_LIMIT)
    at_start, blocks = state_at_start(scene, added=start), samples_of(scene, legs, deadline, start)
    run = simulation_of(
        scene, Chain.of(scene), at_start, blocks, deadline, recorder, is_verlet=True,
        contacts=Contacts.of(scene).in_units(scene.units) if first else None,
    )  # fmt: skip
    steps = sum(leg.steps for leg in legs)
    return replace(run, steps=steps, evaluations=steps)


def samples_of(
    scene: Scene,
    legs: Sequence[Leg],
    deadline: Deadline | None = None,
    start: FloatArray | None = None,
    every: int | None = None,
) -> Iterator[tuple[Leg, Samples]]:
    """The samples of a run, block by block, each with its leg, in natural units.

    The first sample of a block is the last of the block before. They are ``every`` so many steps
    and at the ends of legs; by default as readings of other codes. Forces are by the velocities of
    the samples. Otherwise as ``simulate_damped_verlet``.
    """
    from hertzchain.engines.native.damped_verlet_kernel import take_steps

    deadline = deadline or Deadline(TIME_LIMIT)
    granules, chain = scene.chain.granules, Chain.of(scene)
    refuse_memory(8.0 * granules * 20 * _BLOCK)
    padded = chain.padded()
    law = DampedLaw(chain.stiffness, chain.damping, chain.exponent, chain.attraction)
    u, v, f, a = (np.zeros(granules + 1) for _ in range(4))
    u[:granules], v[:granules] = state_at_start(scene, added=start)
    unit = scene.units
    for leg, row in zip(legs, leg_rows(legs, unit), strict=True):
        stride = every or stride_of(scene, leg)
        natural = leg.in_units(unit.time, unit.force, unit.length)
        if natural.stroke is not None:
            u[0] = natural.stroke.displacement_at(natural.start)
            v[0] = natural.stroke.velocity
        for done, last in itertools.pairwise([*range(0, leg.steps, _BLOCK * stride), leg.steps]):
            if deadline.left <= 0:
                raise deadline.passed()
            kept = np.array([*range(done, last, stride), last])
            states = np.zeros((kept.size, 4, granules))
            take_steps(row, done, last, stride, padded, u, v, f, a, states)
            if not np.all(np.isfinite(states)):
                raise diverged("native")
            time = natural.start + natural.dt * kept
            time[-1] = natural.end if last == leg.steps else time[-1]
            yield natural, true_forces(_samples(time, states, chain.gap), law, natural)


def stride_of(scene: Scene, leg: Leg) -> int:
    """Steps between two samples on a leg, where other codes with this step are read too."""
    interval = damped_interval_at(scene, leg.dt)
    stride = int(min(interval / leg.dt, leg.steps))
    if leg.ramp is not None:
        stride = min(stride, leg.steps // _SAMPLES_PER_RAMP)
    return max(1, stride)


def _samples(time: FloatArray, states: FloatArray, gap: Array) -> Samples:
    u, v, a, f = (np.ascontiguousarray(states[:, k]) for k in range(4))
    overlap = closing(u, gap.size) - gap
    return Samples(time, u, v, a, overlap, f[:, : gap.size])
