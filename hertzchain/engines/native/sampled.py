"""A run in plain NumPy as its samples tell it: peaks, history, momentum and energy."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from hertzchain.arrays import Array
from hertzchain.engines.native.equations import Chain
from hertzchain.engines.native.kernel_input import start_of
from hertzchain.engines.native.simulation import Simulation
from hertzchain.limits import Deadline
from hertzchain.observables.contact_errors import Peaks
from hertzchain.observables.damped_law import DampedLaw
from hertzchain.observables.damped_watch import DampedWatch
from hertzchain.observables.error_bound import diverged
from hertzchain.observables.first_pulse import Contacts
from hertzchain.observables.history import Recorder
from hertzchain.observables.notes import NoteTaker
from hertzchain.observables.peaks import PeakWatch
from hertzchain.observables.samples import Samples
from hertzchain.observables.work import times_on_held, work_done
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg


def state_at_start(scene: Scene, dtype: Any = np.float64, added: Array | None = None) -> Array:
    """Return displacement and velocity at the start, natural units, shape (2, granules)."""
    own = start_of(scene)
    start = own if own.size else np.zeros((2, scene.bodies))
    return (start if added is None else start + added).astype(dtype)


def on_stroke(leg: Leg, displacement: Array, velocity: Array) -> dict[str, Array]:
    """Return displacement and velocity of all granules, the piston's as its stroke begins."""
    assert leg.stroke is not None
    displacement, velocity = displacement.copy(), velocity.copy()
    displacement[0], velocity[0] = leg.stroke.displacement_at(leg.start), leg.stroke.velocity
    return {"displacement": displacement, "velocity": velocity}


def samples_of_states(
    chain: Chain, leg: Leg, time: Array, displacement: Array, velocity: Array
) -> Samples:
    """Return samples of states on a leg, (samples, granules); StepUnstable if they diverge."""
    if not np.all(np.isfinite(velocity[-1])):
        raise diverged("native")
    ramp, overlap, rate = leg.ramp, chain.overlap(displacement), chain.closing(velocity)
    force = chain.contact_force(overlap, rate)
    return Samples(
        time=time,
        displacement=displacement,
        velocity=velocity,
        acceleration=chain.moved_by(force, ramp.force(time) if ramp else 0.0),
        overlap=overlap,
        contact_force=force,
        # damping has no rate where it begins
        jerk=None
        if chain.is_damped
        else chain.jerk(overlap, rate, ramp.force_rate(time) if ramp else 0.0),
    )


def simulation_of(
    scene: Scene,
    chain: Chain,
    start: Array,
    blocks: Iterable[tuple[Leg, Samples]],
    deadline: Deadline,
    recorder: Recorder | None = None,
    is_verlet: bool = False,
    motion: Array | None = None,
    contacts: Contacts | None = None,
) -> Simulation:
    """Return what blocks of samples tell of a run; all is in natural units.

    The first sample of a block is the last of the block before. ``start`` is displacement and
    velocity, shape (2, granules). With ``is_verlet`` damping feels velocities of half a step
    before, as LAMMPS forms it. ``motion`` holds displacement and velocity at the end after the last
    block, where they are not those of its last sample. With ``contacts`` there are first pulses.
    Raises StepUnstable if the chain has far
    more energy than it was given, TooExpensive if the run has taken longer than the deadline.
    """
    dtype = start.dtype.type
    contacts_held = times_on_held(chain.stiffness.size, chain.has_wall, chain.fixed)
    ends = contacts_held, scene.piston is not None
    watch = PeakWatch(chain.stiffness.size, dtype, *ends)
    if chain.is_damped:
        law = DampedLaw(chain.stiffness, chain.damping, chain.exponent, chain.attraction)
        watch = DampedWatch(law, chain.inverse_mass, *ends)
    notes = None if contacts is None else NoteTaker(contacts, chain.inverse_mass)
    work = dtype(chain.energy(*start))
    exchanged, steps = abs(work), 0
    displacement, velocity = start
    for leg, samples in blocks:
        if deadline.left <= 0:
            raise deadline.passed()
        late, before = leg.dt / 2 if is_verlet else 0.0, watch.piston_impulse
        if notes is not None:
            notes.update(samples, late)
        watch.update(samples, late)
        done_now = 0.0 if leg.ramp is None else work_done(samples, leg.ramp, chain.pushed)
        if leg.stroke is not None:
            done_now = (watch.piston_impulse - before) * leg.stroke.velocity
        work, exchanged = work + done_now, exchanged + abs(done_now)
        if recorder is not None:
            recorder.update(samples)
        steps += samples.time.size - 1
        displacement, velocity = samples.displacement[-1], samples.velocity[-1]
    if motion is not None:
        displacement, velocity = motion
    constant = np.sum(chain.mass * chain.constant * displacement)
    energy = chain.energy(displacement, velocity) - constant
    if not abs(energy) <= 10 * exchanged:
        raise diverged("native")
    first = None if notes is None else notes.first_pulses(watch.force)
    return Simulation(
        displacement,
        velocity,
        Peaks(watch.force, watch.time, watch.passed, first),
        work,
        np.sum(chain.mass * velocity),
        energy,
        steps,
        steps,
        wall_impulse=watch.wall_impulse,
        piston_impulse=watch.piston_impulse,
        dissipated=watch.dissipated,
    )
