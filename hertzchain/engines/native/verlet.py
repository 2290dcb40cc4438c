"""Velocity Verlet of any chain at given steps, compiled, and of scenes with damped contacts.

Forces are due before a step has its velocities: damping and drag take those of half a step, as
LAMMPS forms them, so that F is F(x(t), v(t - dt/2)).
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.engines.external.accuracy import damped_interval_at
from hertzchain.engines.native.as_written import (
    BLOCK_SAMPLES,
    NUMBERS_PER_SAMPLE,
    law_of,
    simulation_of,
)
from hertzchain.engines.native.equations import Chain
from hertzchain.engines.native.simulation import Simulation, start_of
from hertzchain.limits import TIME_LIMIT, Deadline, refuse_memory
from hertzchain.observables.compiling import ONE, compiled, compiled_and_kept
from hertzchain.observables.error_bound import diverged
from hertzchain.observables.samples import Recorder, Samples, closing, true_forces
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg


class Walk(NamedTuple):
    """A chain that moves step by step, in any units.

    Parameters
    ----------
    chain
        The chain, with an entry for the free end.
    u, v, f, a, push
        Displacement, velocity, force of the contact behind, acceleration and applied force of each
        granule now, and an entry for the free end, shape (granules + 1,); changed by steps.
    pushed
        Granules on which forces are applied, counted from 0.
    power, drag
        The exponent of overlap in the law of each contact, with an entry for the free end, and the
        drag over velocity of each granule; both None for Hertz's contacts without drag, whose
        dampers have an exponent of a scene: the compiler makes vectors of their loops.
    """

    chain: Chain
    u: FloatArray
    v: FloatArray
    f: FloatArray
    a: FloatArray
    push: FloatArray
    pushed: NDArray[np.intp]
    power: FloatArray | None = None
    drag: FloatArray | None = None

    @classmethod
    def of(
        cls, chain: Chain, displacement: Any, velocity: Any, pushed: Any = (0,),
        power: FloatArray | None = None, drag: FloatArray | None = None,
    ) -> Walk:  # fmt: skip
        """Return a chain with all of its granules as they are at the start, (granules,) each."""
        u, v = (np.append(np.asarray(values, float), 0.0) for values in (displacement, velocity))
        if (
            power is None
            or drag is None
            or not (
                drag.any() or np.any(power != 1.5) or chain.damping_exponent not in (0.0, 0.25, 0.5)
            )
        ):
            power = drag = None
        else:
            power = np.append(power, np.full(v.size - 1 - power.size, 1.5))
        f, a, push = np.zeros((3, v.size))
        return cls(chain.padded(), u, v, f, a, push, np.array(pushed, np.intp), power, drag)


@compiled
def _evaluate(walk: Any, power: Any, drag: Any, least: float) -> None:
    """Fill in the force of each contact, at least ``least``, and the accelerations.

    ``power`` and ``drag`` are those of ``walk``: of an argument that is None the compiler drops the
    branches.
    """
    c, u, v, f, a = walk.chain, walk.u, walk.v, walk.f, walk.a
    granules = c.inverse_mass.size
    for i in range(np.uint64(0), np.uint64(granules)):
        d = u[i] - u[i + ONE] - c.gap[i]
        pressed = 1.0 if d > 0.0 else 0.0
        d = d if d > 0.0 else 0.0
        root = np.sqrt(d)
        elastic = c.stiffness[i] * d * root
        if power is not None and power[i] != 1.5:
            elastic = c.stiffness[i] * d ** power[i] if d > 0.0 else 0.0
        factor = pressed
        if c.damping_exponent == 0.5:
            factor = root
        elif c.damping_exponent == 0.25:
            factor = np.sqrt(root)
        elif power is not None and c.damping_exponent != 0.0:
            factor = d**c.damping_exponent if d > 0.0 else 0.0
        force = elastic + c.damping[i] * factor * (v[i] - v[i + ONE])
        f[i + ONE] = force if force > least else least
    for i in range(np.uint64(0), np.uint64(granules)):
        force = f[i] - f[i + ONE] + walk.push[i]
        if drag is not None:
            force -= drag[i] * v[i]
        a[i] = force * c.inverse_mass[i] + c.constant[i]


@compiled_and_kept()
def take_steps(
    walk: Walk, h: float, applied: FloatArray, led: FloatArray, stride: int, begins: bool,
    into: FloatArray,
) -> None:  # fmt: skip
    """Take equal steps, and keep states.

    ``h`` is the length of a step; ``applied`` are the forces on the pushed granules before the
    first step and after each, (steps + 1, pushed); ``led`` are displacements of a piston, shape
    (steps + 1,), or (0,) where they follow from its velocity, or without a piston. Where these
    steps ``begin`` a run, forces are computed before the first one. ``into`` is filled with
    displacements, velocities, accelerations and forces of contacts before the first step, after
    every ``stride``, and after the last; shape (4, states, granules).
    """
    u, v, a = walk.u, walk.v, walk.a
    granules, steps = walk.chain.inverse_mass.size, applied.shape[0] - 1
    least = -np.inf if walk.chain.attraction else 0.0
    kept = 0
    for step in range(steps + 1):
        if step > 0:
            for i in range(np.uint64(0), np.uint64(granules)):
                v[i] += h / 2 * a[i]
                u[i] += h * v[i]
            if led.size > 0:
                u[0], v[0] = led[step], (led[step] - led[step - 1]) / h
        if step > 0 or begins:
            for k in range(walk.pushed.size):
                walk.push[walk.pushed[k]] = applied[step, k]
            _evaluate(walk, walk.power, walk.drag, least)
        if step > 0:
            for i in range(np.uint64(0), np.uint64(granules)):
                v[i] += h / 2 * a[i]
        if step % stride == 0 or step == steps:
            for i in range(granules):
                into[0, kept, i], into[1, kept, i] = u[i], v[i]
                into[2, kept, i], into[3, kept, i] = a[i], walk.f[i + 1]
            kept += 1


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
    at_start, blocks = (
        start_of(scene, start),
        samples_of(scene, legs, deadline, start),
    )
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
    deadline = deadline or Deadline(TIME_LIMIT)
    chain, unit = Chain.of(scene), scene.units
    refuse_memory(8.0 * scene.bodies * NUMBERS_PER_SAMPLE * BLOCK_SAMPLES)
    law = law_of(chain)
    displacement, velocity = start_of(scene, start)
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
    deadline: Deadline, stride: int = 1, led: FloatArray | None = None, block: int = BLOCK_SAMPLES,
) -> Iterator[tuple[NDArray[np.intp], FloatArray]]:  # fmt: skip
    """Take equal steps; yield the kept steps and their states, (4, kept, granules), in blocks.

    The first state of a block is the last state of the block before. States are displacement,
    velocity, acceleration and force of the contact ahead of each granule, all in the units of
    ``walk``.
    ``applied`` gives the forces on the pushed granules after some steps, (steps, pushed);
    ``led`` is the displacement of a piston before the first step and after each, unless it follows
    from the velocity of granule 1. Raises TooExpensive.
    """
    for done, last in itertools.pairwise([*range(0, max(steps, 1), block * stride), steps]):
        if deadline.left <= 0:
            raise deadline.passed()
        kept = np.append(np.arange(done, last, stride), last)
        states = np.empty((4, kept.size, walk.chain.inverse_mass.size))
        forces = np.ascontiguousarray(applied(np.arange(done, last + 1)))
        led_now = np.zeros(0) if led is None else led[done : last + 1]
        take_steps(walk, dt, forces, led_now, stride, done == 0, states)
        yield kept, states


def stride_of(scene: Scene, leg: Leg) -> int:
    """Steps between two samples on a leg, as other codes with this step are read."""
    interval = damped_interval_at(scene, leg.dt)
    stride = int(min(interval / leg.dt, leg.steps))
    if leg.ramp is not None:  # eight samples at least, for the work of short pulses
        stride = min(stride, leg.steps // 8)
    return max(1, stride)


def _samples(time: FloatArray, states: FloatArray, gap: FloatArray) -> Samples:
    u, v, a, f = states
    overlap = closing(u, gap.size) - gap
    return Samples(time, u, v, a, overlap, f[:, : gap.size])
