"""Scenes with damped contacts by velocity Verlet, at the steps that are asked for."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.external.step_error import damped_interval_at
from hertzchain.engines.native.damped_runs import damped_contacts
from hertzchain.engines.native.kernel_input import leg_rows, start_of
from hertzchain.engines.native.simulation import End, Peaks, Simulation
from hertzchain.limits import TIME_LIMIT, Deadline, refuse_memory
from hertzchain.observables.damped_law import DampedLaw, true_forces
from hertzchain.observables.damped_watch import DampedWatch
from hertzchain.observables.error_bound import diverged
from hertzchain.observables.history import Recorder
from hertzchain.observables.samples import Samples, closing
from hertzchain.observables.work import work_done
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg

if TYPE_CHECKING:
    from hertzchain.engines.native.damped_verlet_kernel import Contacts

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
) -> Simulation:
    """Integrate a scene with damped contacts by velocity Verlet on given legs [s, N].

    The damping of a step takes velocities of half a step before, as LAMMPS forms it. The recorder,
    if there is one, has natural units. ``start`` is displacement and velocity added to those of the
    scene, natural units, shape (2, granules). Raises StepUnstable if the motion diverges,
    TooExpensive if the run has taken longer than the deadline, an hour by default.
    """
    chain = damped_contacts(scene)
    law = DampedLaw(chain.stiffness, chain.damping, chain.exponent, chain.attraction)
    watch = DampedWatch(law, chain.inertia, chain.wall, scene.piston is not None)
    moves = chain.inertia > 0  # all but a piston
    mass = np.where(moves, 1 / np.where(moves, chain.inertia, 1.0), 0.0)
    work = exchanged = 0.0
    samples: Samples | None = None
    for natural, seen in samples_of(scene, legs, deadline, start):
        if samples is None:
            work = _energy(law, mass, seen, 0)
            exchanged = abs(work)
        samples = seen
        pushed = watch.piston_impulse
        watch.update(samples, natural.dt / 2)
        done_now = 0.0
        if natural.stroke is not None:
            done_now = (watch.piston_impulse - pushed) * natural.stroke.velocity
        if natural.ramp is not None:
            done_now = float(work_done(samples, natural.ramp))
        work, exchanged = work + done_now, exchanged + abs(done_now)
        if recorder is not None:
            recorder.update(samples)
    assert samples is not None
    displacement, velocity = samples.displacement[-1], samples.velocity[-1]
    energy = _energy(law, mass, samples, -1) - float(np.sum(mass * chain.pull * displacement))
    if not abs(energy) <= 10 * exchanged:
        raise diverged("native")
    steps = sum(leg.steps for leg in legs)
    return Simulation(
        End(displacement, velocity),
        Peaks(watch.force, watch.time, watch.passed),
        work,
        float(np.sum(mass * velocity)),
        energy,
        steps,
        steps,
        wall_impulse=watch.wall_impulse,
        piston_impulse=watch.piston_impulse,
        dissipated=watch.dissipated,
    )


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
    granules, chain = scene.chain.granules, damped_contacts(scene)
    refuse_memory(8.0 * granules * 20 * _BLOCK)
    contacts = chain.stiffness.size
    made = verlet_contacts(scene)
    law = DampedLaw(chain.stiffness, chain.damping, chain.exponent, chain.attraction)
    u, v, f, a = (np.zeros(granules + 1) for _ in range(4))
    own = start_of(scene)
    for given in (own, start):
        if given is not None and given.size:
            u[:granules] += given[0]
            v[:granules] += given[1]
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
            take_steps(row, done, last, stride, made, u, v, f, a, states)
            if not np.all(np.isfinite(states)):
                raise diverged("native")
            time = natural.start + natural.dt * kept
            time[-1] = natural.end if last == leg.steps else time[-1]
            yield natural, true_forces(_samples(time, states, made.gap, contacts), law, natural)


def verlet_contacts(scene: Scene) -> Contacts:
    """The chain of a scene with damped contacts as the compiled steps take it."""
    from hertzchain.engines.native.damped_verlet_kernel import Contacts

    granules, chain = scene.chain.granules, damped_contacts(scene)
    return Contacts(
        _padded(chain.stiffness, granules),
        _padded(chain.damping, granules),
        _padded(chain.gap, granules),
        np.ascontiguousarray(chain.inertia, np.float64),
        np.ascontiguousarray(chain.pull, np.float64),
        round(4 * chain.exponent),
        chain.attraction,
    )


def _padded(values: FloatArray, granules: int) -> FloatArray:
    """With an entry for the free end, where nothing presses."""
    whole = np.zeros(granules)
    whole[: values.size] = values
    return whole


def stride_of(scene: Scene, leg: Leg) -> int:
    """Steps between two samples on a leg, where other codes with this step are read too."""
    interval = damped_interval_at(scene, leg.dt)
    stride = int(min(interval / leg.dt, leg.steps))
    if leg.ramp is not None:
        stride = min(stride, leg.steps // _SAMPLES_PER_RAMP)
    return max(1, stride)


def _samples(time: FloatArray, states: FloatArray, gap: FloatArray, contacts: int) -> Samples:
    u, v, a, f = (np.ascontiguousarray(states[:, k]) for k in range(4))
    overlap = closing(u, contacts) - gap[:contacts]
    return Samples(time, u, v, a, overlap, f[:, :contacts])


def _energy(law: DampedLaw, mass: FloatArray, samples: Samples, which: int) -> float:
    """Of motion and of contacts, at one of the samples."""
    overlap = np.maximum(samples.overlap[which], 0.0)
    kinetic = 0.5 * np.sum(mass * samples.velocity[which] ** 2)
    return float(kinetic + 0.4 * np.sum(law.elastic(overlap) * overlap))
