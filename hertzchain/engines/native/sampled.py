"""Results of a run in plain NumPy, from its samples: peaks, history, momentum and energy."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.native.equations import Chain
from hertzchain.engines.native.kernel_input import start_of
from hertzchain.engines.native.simulation import Simulation
from hertzchain.limits import Deadline
from hertzchain.observables.damped_law import DampedLaw
from hertzchain.observables.error_bound import diverged
from hertzchain.observables.first_pulse import Signals
from hertzchain.observables.history import Recorder
from hertzchain.observables.samples import Samples
from hertzchain.observables.watch import Watch
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg


def state_at_start(scene: Scene, added: FloatArray | None = None) -> FloatArray:
    """Return displacement and velocity at the start, natural units, shape (2, granules)."""
    own = start_of(scene)
    start = own if own.size else np.zeros((2, scene.bodies))
    return np.array(start if added is None else start + added)


def on_stroke(leg: Leg, displacement: FloatArray, velocity: FloatArray) -> dict[str, FloatArray]:
    """Return the motion of all granules when a stroke begins, with that of the piston set."""
    assert leg.stroke is not None
    displacement, velocity = displacement.copy(), velocity.copy()
    displacement[0], velocity[0] = leg.stroke.displacement_at(leg.start), leg.stroke.velocity
    return {"displacement": displacement, "velocity": velocity}


def samples_of_states(
    chain: Chain, leg: Leg, time: FloatArray, displacement: FloatArray, velocity: FloatArray
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
    start: FloatArray,
    blocks: Iterable[tuple[Leg, Samples]],
    deadline: Deadline,
    recorder: Recorder | None = None,
    is_verlet: bool = False,
    motion: FloatArray | None = None,
    signals: Signals | None = None,
) -> Simulation:
    """Return the results of a run from blocks of samples; all is in natural units.

    The first sample of a block is the last of the block before. ``start`` is displacement and
    velocity, shape (2, granules). With ``is_verlet`` damping is computed with the velocities half a
    step before, as in LAMMPS. ``motion`` holds displacement and velocity at the end after the last
    block, where they are not those of its last sample. With ``signals`` the results include first
    pulses. Raises StepUnstable if the chain has far more energy than it was given, TooExpensive if
    the run has taken longer than the deadline.
    """
    watch = Watch(scene, law_of(chain), chain.inverse_mass, signals, recorder)
    given, steps = chain.energy(*start), 0
    displacement, velocity = start
    for leg, samples in blocks:
        if deadline.left <= 0:
            raise deadline.passed()
        watch.update(samples, leg, leg.dt / 2 if is_verlet else 0.0)
        steps += samples.time.size - 1
        displacement, velocity = samples.displacement[-1], samples.velocity[-1]
    if motion is not None:
        displacement, velocity = motion
    constant = np.sum(chain.mass * chain.constant * displacement)
    energy = chain.energy(displacement, velocity) - constant
    if not abs(energy) <= 10 * (abs(given) + watch.exchanged):
        raise diverged("native")
    return Simulation(
        displacement,
        velocity,
        watch.peaks,
        given + watch.work,
        np.sum(chain.mass * velocity),
        energy,
        steps,
        steps,
        wall_impulse=watch.seen.wall_impulse,
        piston_impulse=watch.seen.piston_impulse,
        dissipated=watch.seen.dissipated,
    )


def law_of(chain: Chain) -> DampedLaw:
    """Return the law of the contacts of a chain, for its ``Watch``."""
    return DampedLaw(chain.stiffness, chain.damping, chain.exponent, chain.attraction)
