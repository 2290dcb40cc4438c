"""Eq. 1 as ``equations`` writes it, in NumPy: by SciPy's ``solve_ivp``, or by the paper's method.

The compiled loops are compared with these runs. All is in natural units.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.native.equations import Chain
from hertzchain.engines.native.plan import Walker
from hertzchain.engines.native.simulation import Run, Simulation, accurate, start_of
from hertzchain.errors import RunFailed
from hertzchain.limits import Deadline, refuse_memory
from hertzchain.observables.error_bound import SAFETIES, diverged
from hertzchain.observables.first_pulse import Signals
from hertzchain.observables.samples import DampedLaw, Recorder, Samples
from hertzchain.observables.watch import Watch
from hertzchain.scene.chain import force_scale
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg

LONGEST = 0.2
"""The longest step of SciPy, natural time units of the fastest contact (chosen): a granule that
flies at another does not pass through its contact within a step."""

SAMPLES = 4
"""Samples of the dense output in the longest step of damped contacts (chosen): forces bend where
contacts close. Elastic contacts need none but the ends of steps, as third derivatives are known
there."""

BLOCK_SAMPLES = 256
"""Samples that are processed together: with 60 granules they fit into a cache of 1 MB."""

NUMBERS_PER_SAMPLE = 20
"""Numbers kept for each granule and sample of a block (counted)."""


def integrate(
    scene: Scene, chain: Chain, tolerance: float, longest: float, counted: list[int],
    samples: int = SAMPLES,
) -> Iterator[tuple[Leg, Samples]]:  # fmt: skip
    """Integrate a scene by SciPy; yield each leg with successive samples, the first one known.

    A call of DOP853 ends at a corner of the shock and, unless the chain is plain, where a contact
    opens or closes: a dashpot's force jumps there, and no method of order 8 keeps its order across
    a kink. ``tolerance`` is in natural units; ``longest`` is the longest step, with ``samples``
    samples of damped contacts in it; force evaluations are appended to ``counted``. RunFailed where
    SciPy fails.
    """
    from scipy.integrate import solve_ivp

    units, granules = scene.units, scene.bodies
    u, v = start_of(scene)
    is_damped = chain.is_damped
    # SciPy's error is a mean that includes resting granules, and scales with displacements of
    # granules that fly off: a part of 1 lost 1.4e-6 of the demo's energy at 2e-8, 0.01 7e-9. SciPy
    # takes no relative tolerance below 3e-14.
    relative = max(0.01 * tolerance, 3e-14)
    absolute = 0.01 * tolerance * force_scale(scene.momentum_ratio)
    for in_si in scene.schedule(scene.end_time):
        leg = in_si.in_units(units.time, units.force, units.length)
        if leg.stroke is not None:
            u, v = on_stroke(leg, u, v)
        time = leg.start
        while time < leg.end:
            acting, changes = chain, None
            if not scene.is_plain:
                # Granules ahead of the wave rest within errors of this size.
                acting, changes = _until_a_change(chain, u, 10.0 * absolute)

            def rates(
                time: float, state: FloatArray, leg: Leg = leg, acting: Chain = acting
            ) -> Any:
                u, v = state[:granules], state[granules:]
                pull = acting.acceleration(u, _force(leg, time), v if is_damped else None)
                return np.concatenate([v, pull])

            run = solve_ivp(
                rates, (time, leg.end), np.concatenate([u, v]), method="DOP853",
                rtol=relative, atol=absolute, max_step=longest, dense_output=is_damped,
                events=changes,
            )  # fmt: skip
            counted.append(run.nfev)
            if not run.success or not run.t[-1] > time:
                raise RunFailed(f"SciPy: {run.message}")
            begin, time = time, float(run.t[-1])
            seen, states = run.t, run.y.T
            if run.sol is not None:
                count = max(1, math.ceil((time - begin) / longest * samples))
                seen = np.union1d(np.linspace(begin, time, count + 1), run.t)
                states = run.sol(seen).T
            u, v = np.split(run.y[:, -1], 2)
            yield leg, samples_of(chain, leg, seen, *np.split(states, 2, axis=1))


def _until_a_change(chain: Chain, at_start: FloatArray, opened: float) -> tuple[Chain, Any]:
    """Return the chain without the contacts that are open, and an event of SciPy that ends a call.

    It ends where an open contact closes, or a closed one opens. One that has a gap of ``opened`` is
    open.
    """
    granules, closed = at_start.size, chain.overlap(at_start) > -opened / 2
    threshold, sign = np.where(closed, -opened, 0.0), np.where(closed, 1.0, -1.0)

    def event(_: float, state: FloatArray) -> float:
        return float(np.min(sign * (chain.overlap(state[:granules]) - threshold)))

    event.terminal = True  # type: ignore[attr-defined]
    acting = chain._replace(stiffness=chain.stiffness * closed, damping=chain.damping * closed)
    return acting, event


def _force(leg: Leg, time: float) -> float:
    return 0.0 if leg.ramp is None else float(leg.ramp.force(time))


def law_of(chain: Chain) -> DampedLaw:
    """Return the law of the contacts of a chain, for its ``Watch``."""
    return DampedLaw(chain.stiffness, chain.damping, chain.damping_exponent, chain.attraction)


def on_stroke(leg: Leg, displacement: FloatArray, velocity: FloatArray) -> tuple[FloatArray, ...]:
    """Return the motion of all granules when a stroke begins, with that of the piston set."""
    assert leg.stroke is not None
    displacement, velocity = displacement.copy(), velocity.copy()
    displacement[0], velocity[0] = leg.stroke.displacement_at(leg.start), leg.stroke.velocity
    return displacement, velocity


def samples_of(
    chain: Chain, leg: Leg, time: FloatArray, displacement: FloatArray, velocity: FloatArray
) -> Samples:
    """Return samples of states on a leg, (samples, granules); StepUnstable if they diverge."""
    if not np.all(np.isfinite(velocity[-1])):
        raise diverged("native")
    ramp, overlap, rate = leg.ramp, chain.overlap(displacement), chain.closing(velocity)
    is_damped, jerk = chain.is_damped, None
    force = chain.contact_force(overlap, rate if is_damped else None)
    if not is_damped:  # damping has no rate where it begins
        jerk = chain.jerk(overlap, rate, ramp.force_rate(time) if ramp else 0.0)
    moved = chain.moved_by(force, ramp.force(time) if ramp else 0.0)
    return Samples(time, displacement, velocity, moved, overlap, force, jerk)


def simulation_of(
    scene: Scene, chain: Chain, start: FloatArray, blocks: Iterable[tuple[Leg, Samples]],
    deadline: Deadline, recorder: Recorder | None = None, first: bool = False,
    late: float = 0.0,
) -> Simulation:  # fmt: skip
    """Return the results of a run from blocks of samples; all is in natural units.

    The first sample of a block is the last of the block before. ``start`` is displacement and
    velocity, shape (2, granules). ``late`` is the part of a step by which the velocities that damp
    the motion are late: 1/2 in velocity Verlet, as in LAMMPS.
    ``first``: the results include first pulses. Raises StepUnstable if the chain has far more
    energy than it was given, TooExpensive if the run has taken longer than the deadline.
    """
    signals = Signals.of(scene).in_units(scene.units) if first else None
    watch = Watch(scene, law_of(chain), chain.inverse_mass, signals, recorder)
    given, steps = chain.energy(*start), 0
    displacement, velocity = start
    for leg, samples in blocks:
        if deadline.left <= 0:
            raise deadline.passed()
        watch.update(samples, leg, late * leg.dt)
        steps += samples.time.size - 1
        displacement, velocity = samples.displacement[-1], samples.velocity[-1]
    constant = np.sum(chain.mass * chain.constant * displacement)
    energy = chain.energy(displacement, velocity) - constant
    if not abs(energy) <= 10 * (abs(given) + watch.exchanged):
        raise diverged("native")
    return Simulation(
        displacement, velocity, watch.peaks, given + watch.work, np.sum(chain.mass * velocity),
        energy, steps, steps, wall_impulse=watch.seen.wall_impulse,
        piston_impulse=watch.seen.piston_impulse, dissipated=watch.seen.dissipated,
    )  # fmt: skip


def simulate_in_scipy(
    scene: Scene, tolerance: float, deadline: Deadline, recorder: Recorder | None = None,
    longer: float = 1.0, first: bool = False, samples: int = SAMPLES,
) -> Simulation:  # fmt: skip
    """Integrate a scene once, with a tolerance; steps may be longer by a factor.

    ``first``: first pulses are wanted. ``samples``: see ``integrate``.
    """
    chain, counted = Chain.of(scene), list[int]()
    longest = longer * (LONGEST * scene.contact_time) / scene.units.time
    blocks = integrate(scene, chain, tolerance, longest, counted, samples)
    run = simulation_of(scene, chain, start_of(scene), blocks, deadline, recorder, first)
    return replace(run, evaluations=sum(counted))


def accurate_in_scipy(
    scene: Scene, rtol: float, deadline: Deadline, recorder: Recorder | None = None,
    first: bool = False,
) -> Run:  # fmt: skip
    """Integrate with three tolerances, until peaks have the wanted accuracy; the last is returned.

    The differences of the three bound the error, as for the compiled adaptive steps.
    """

    def integrated(tolerance: float, longer: float, is_wanted: bool) -> Simulation:
        kept = recorder if is_wanted else None
        return simulate_in_scipy(scene, tolerance, deadline, kept, longer, first)

    return Run("scipy", LONGEST * scene.contact_time, *accurate(integrated, rtol))


def judging_peaks(scene: Scene, deadline: Deadline) -> tuple[FloatArray, float]:
    """Return peak forces, (contacts,), to some 1e-10, and a bound of their relative error.

    It follows from the difference to a second run of SciPy, with a looser tolerance.
    """
    is_elastic, tolerance = scene.contact is None, 5e-11
    # A dashpot that opens and closes within a step is missed: the second run has shorter ones.
    ways = ((tolerance, 1.0), (20.0 * tolerance, 1.0 if is_elastic else 0.6))
    tight, loose = (
        simulate_in_scipy(scene, each, deadline, None, longest, False, 4 * SAMPLES).peaks
        for each, longest in ways
    )
    # A difference of two runs can be small by chance. Measured in 180 elastic chains with weak
    # pulses: an error of 18 tolerances with a difference of 2.4. Dampers end the late collisions
    # that do so.
    least = (20.0 if is_elastic else 1.2) * tolerance
    errors = SAFETIES["erratic"].bounds([tight.differences(loose)], least=least)
    return np.asarray(tight.force), errors.largest


@dataclass(frozen=True, eq=False)
class RungeKutta:
    """A scene of elastic contacts for the paper's own method, with the methods of ``Prepared``."""

    scene: Scene
    deadline: Deadline
    first: bool = False  # whether first pulses are wanted

    def simulate(
        self, legs: Sequence[Leg], walker: Walker, recorder: Recorder | None = None,
        leave_behind: bool = False,  # noqa: ARG002 - as Prepared
    ) -> Simulation:  # fmt: skip
        """Integrate the scene once, on legs [s, N] that are cut; no granule is left behind."""
        scene, units = self.scene, self.scene.units
        refuse_memory(8.0 * NUMBERS_PER_SAMPLE * BLOCK_SAMPLES * scene.bodies)
        chain, start = Chain.of(scene), start_of(scene)
        natural = [leg.in_units(units.time, units.force, units.length) for leg in legs]
        blocks = runge_kutta(chain, natural, start)
        run = simulation_of(scene, chain, start, blocks, self.deadline, recorder, self.first)
        return replace(run, evaluations=run.steps * walker.stepper.stages)


def runge_kutta(
    chain: Chain, legs: Iterable[Leg], start: FloatArray
) -> Iterator[tuple[Leg, Samples]]:
    """Integrate a chain by the classical method; yield each leg with successive samples.

    ``start`` is displacement and velocity, shape (2, granules); legs are in natural units.
    """
    u, v = start
    for leg in legs:
        if leg.stroke is not None:
            u, v = on_stroke(leg, u, v)
        block = [(leg.start, u, v)]
        h = leg.dt
        for k in range(leg.steps):
            begin = leg.start + k * h
            before, middle, after = (_force(leg, begin + part * h) for part in (0.0, 0.5, 1.0))
            with np.errstate(over="ignore", invalid="ignore"):
                first = chain.acceleration(u, before)
                second = chain.acceleration(u + h / 2 * v, middle)
                third = chain.acceleration(u + h / 2 * (v + h / 2 * first), middle)
                fourth = chain.acceleration(u + h * (v + h / 2 * second), after)
                u = u + h * (v + h / 6 * (first + second + third))
                v = v + h / 6 * (first + 2 * second + 2 * third + fourth)
            is_last = k == leg.steps - 1
            block.append((leg.end if is_last else begin + h, u, v))
            if len(block) > BLOCK_SAMPLES or is_last:
                states = (np.array(values) for values in zip(*block, strict=True))
                yield leg, samples_of(chain, leg, *states)
                block = block[-1:]
