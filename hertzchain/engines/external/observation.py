"""Readings of a code: as its dumps have them, and as samples in SI units."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.contact import hertz
from hertzchain.engines.external.accuracy import Softening, round_off
from hertzchain.engines.external.terms import wall_position
from hertzchain.errors import OverlapTooLarge, RunFailed
from hertzchain.limits import refuse_memory
from hertzchain.observables.error_bound import SHORTER, Peaks, diverged
from hertzchain.observables.first_pulse import Signals
from hertzchain.observables.result import Balance
from hertzchain.observables.samples import DampedLaw, Recorder, Samples, closing, true_forces
from hertzchain.observables.watch import PeakWatch, Watch
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg

_HEADER = 9  # lines before the granules of a frame: step, count, box, names of columns


def read_frames(path: Path, columns: tuple[str, ...]) -> tuple[FloatArray, FloatArray]:
    """Read a whole dump: steps, (frames,), and values, (frames, columns, granules)."""
    steps, values = zip(*read_blocks(path, columns), strict=True)
    return np.concatenate(steps), np.concatenate(values)


def read_blocks(
    path: Path, columns: tuple[str, ...], frames: int = 256
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Read as ``read_frames`` in blocks of frames; the dump has an ``id`` besides the columns."""
    try:
        with path.open(encoding="ascii") as file:
            head = list(itertools.islice(file, _HEADER))
            if not head:
                raise RunFailed(f"{path.name}: the dump of the run is empty")
            granules, names = int(head[3]), head[8].split()[2:]
            size, places = _HEADER + granules, [names.index(name) for name in columns]
            lines = itertools.chain(head, file)
            while block := list(itertools.islice(lines, frames * size)):
                steps = np.array(block[1::size], np.float64)
                rows = [row.split() for k, row in enumerate(block) if k % size >= _HEADER]
                table = np.array(rows, np.float64).reshape(len(steps), granules, len(names))
                order = np.argsort(table[..., names.index("id")])[..., np.newaxis]
                table = np.take_along_axis(table, order, axis=1)[..., places]
                yield steps, np.ascontiguousarray(np.moveaxis(table, 2, 1))
    except (OSError, UnicodeDecodeError) as problem:
        raise RunFailed(f"{path.name}: the run left no dump that can be read ({problem})") from None
    except (ValueError, IndexError):
        raise RunFailed(
            f"{path.name}: the dump of the run is cut off or has other columns: is the disk full?"
        ) from None


BLOCK = 256  # most readings passed on at a time


@dataclass(frozen=True, eq=False)
class Granules:
    """Granules of a code before the shock: [m], [kg], [m], shape (granules,) each.

    The mass of a piston is infinite.
    """

    position: FloatArray
    mass: FloatArray
    diameter: FloatArray

    @property
    def moving_mass(self) -> FloatArray:
        """Masses for momentum and energy of the chain [kg], shape (granules,); 0 for a piston."""
        return np.where(np.isinf(self.mass), 0.0, self.mass)


def contact_forces(net_force: FloatArray) -> FloatArray:
    """Force in each contact [N], (..., granules - 1), from net forces, (..., granules).

    Each is the sum of the net forces beyond it, added from the free end, where they are small.
    """
    return np.cumsum(net_force[..., :0:-1], axis=-1)[..., ::-1]


def _with_true_derivatives(samples: Samples, mass: FloatArray, leg: Leg, pushed: int) -> Samples:
    """Return samples with the derivatives of the displacements, up to the third.

    A contact force F goes as r^(3/2), so with k = 3/2 F / r its derivatives are k r' and
    k (r'' + r'^2 / 2r). The jerk is right except for dt^2/12 times the fifth derivative.
    """
    dt = leg.dt
    velocity, acceleration = samples.velocity, samples.acceleration
    r = np.where(samples.contact_force > 0, samples.overlap, 1.0)
    rate, second = (closing(d, r.shape[1]) for d in (velocity, acceleration))
    stiffness = 1.5 * samples.contact_force / r
    # Within a step of the opening of a contact its force has no second derivative.
    growth = rate**2 / (2 * np.maximum(r, np.abs(rate) * dt))
    applied_rate, applied_second = _applied(samples.time, leg)
    jerk = _net(stiffness * rate, applied_rate, mass.size, pushed) / mass
    fourth = _net(stiffness * (second + growth), applied_second, mass.size, pushed) / mass
    true_rate = rate - dt**2 / 6 * closing(jerk, r.shape[1])
    return replace(
        samples,
        velocity=velocity - dt**2 / 6 * jerk,
        acceleration=acceleration - dt**2 / 12 * fourth,
        jerk=_net(stiffness * true_rate, applied_rate, mass.size, pushed) / mass,
    )


def _applied(time: FloatArray, leg: Leg) -> tuple[FloatArray, FloatArray]:
    """Return rate [N/s] and second derivative [N/s^2] of the applied force, shape (readings,)."""
    if leg.ramp is None:
        return np.zeros_like(time), np.zeros_like(time)
    rate = leg.ramp.force_rate
    return rate(time), (rate(time + leg.dt) - rate(time - leg.dt)) / (2 * leg.dt)


def _net(contact: FloatArray, applied: FloatArray, granules: int, pushed: int) -> FloatArray:
    """Net forces, or derivatives, from contact forces, (readings, contacts), and applied ones."""
    passed_on = np.zeros((contact.shape[0], granules + 1))
    passed_on[:, 1 : 1 + contact.shape[1]] = contact
    if pushed == 0:
        passed_on[:, 0] = applied
    net = passed_on[:, :-1] - passed_on[:, 1:]
    if pushed > 0:
        net[:, pushed] += applied
    return net


def stops(leg: Leg, stride: int) -> list[int]:
    """Return the steps of a leg with a reading: every ``stride``, the first and the last."""
    return [*range(0, leg.steps, stride), leg.steps]


def count_readings(legs: Sequence[Leg], strides: Sequence[int]) -> int:
    """Count the readings of a run without a list of them, which might not fit into memory."""
    return sum(len(range(0, leg.steps, n)) + 1 for leg, n in zip(legs, strides, strict=True))


def reading_times(leg: Leg, stride: int) -> FloatArray:
    """Return the times of the readings of a leg [s], shape (readings,)."""
    times = leg.start + leg.dt * np.array(stops(leg, stride))
    times[-1] = leg.end  # exact to the last digit, so that no time falls between legs
    return times


def refuse_large(legs: Sequence[Leg], strides: Sequence[int], granules: int) -> None:
    """Refuse a run whose readings do not fit into memory."""
    # Least bytes of memory for a granule in a reading; measured for a dump: 187
    refuse_memory(180.0 * count_readings(legs, strides) * granules)


class Observation:
    """Observes a run of the scene that a code was given, in the units of the true scene.

    Scene and legs are the true ones; ``scaling`` relates them to the similar scene that the code
    runs; ``times`` are the instants of a history [s], if it is wanted; ``code`` is the name in
    messages; with ``first``, first pulses are wanted.
    """

    def __init__(
        self, scene: Scene, scaling: Softening, legs: Sequence[Leg], times: FloatArray | None,
        code: str, first: bool = False,
    ) -> None:  # fmt: skip
        self._scene, self._scaling, self._legs, self.code = scene, scaling, tuple(legs), code
        self._similar = scaling.scene(scene)  # the scene given to the code, and its legs
        self.legs = [scaling.leg(leg) for leg in legs]
        self._law, self._law_given = DampedLaw.of(scene), DampedLaw.of(self._similar)
        self._signals, wall = Signals.of(scene) if first else None, scene.wall is not None
        self._recorder = None if times is None else Recorder(times, scene.bodies, wall)
        self._given = 0.0  # energy at the start [J]
        self._samples: Samples | None = None

    def begin(self, at_rest: Granules) -> None:
        """Store the granules of the code before the shock; refuse a wrong number of them."""
        scene, count = self._scene, at_rest.mass.size
        if count != scene.bodies:
            raise RunFailed(
                f"{self.code} made {count} granules of a chain of {scene.bodies}: do not trust this"
                " version with it"
            )
        held = scene.granules.is_fixed | ((scene.piston is not None) & (np.arange(count) == 0))
        self._at_rest = replace(at_rest, mass=np.where(held, math.inf, at_rest.mass))
        self._watch = Watch(
            scene, self._law, 1 / self._at_rest.mass, self._signals, self._recorder,
            scene.units.force,
        )  # fmt: skip

    def update(
        self, number: int, time: FloatArray, arrays: FloatArray,
        wall_force: FloatArray | None = None,
    ) -> None:  # fmt: skip
        """Add successive readings on a leg, at least two; the first repeats the last one before.

        All values are those of the scene given to the code: number of the leg, from 0; times [s],
        shape (readings,); positions [m], velocities [m/s] and net forces [N] along the chain, shape
        (readings, 3, granules), with the force on the wall, if there is one [N], shape (readings,).
        Motion that has diverged raises StepUnstable, granules that touch the next but one
        OverlapTooLarge.
        """
        if not np.all(np.isfinite(arrays)):
            raise diverged(self.code)
        seen = self._sampled(time, arrays, self.legs[number], wall_force)
        deepest = np.max(seen.overlap)
        deepest = np.max(seen.overlap[:, :-1] + seen.overlap[:, 1:], initial=deepest)
        if deepest >= np.min(self._at_rest.diameter):
            raise OverlapTooLarge(
                f"{self.code} would push granules through one another: {SHORTER}, or else"
                " a smaller force or a stiffer material"
            )
        before, self._samples = self._samples, self._scaling.true(seen)
        if before is None:
            start_velocity = arrays[0, 1] / self._scaling.time
            self._given = self._energy(self._samples, 0, start_velocity)
        leg = self._legs[number]
        self._watch.update(self._samples, leg, leg.dt / 2)
        self._velocity = arrays[-1, 1] / self._scaling.time

    def _sampled(
        self, time: FloatArray, arrays: FloatArray, leg: Leg, wall_force: FloatArray | None
    ) -> Samples:
        """Convert readings on a leg to samples with the derivatives of the positions.

        Velocity Verlet's own velocities and accelerations are central differences of its positions
        over a step: they differ from the derivatives by dt^2/6 times the third and dt^2/12 times
        the fourth derivative. These follow from the forces, with Hertz's exponent and without the
        stiffness. Of damped contacts the forces have an error of a lower order.
        """
        scene, rest, pressed = self._similar, self._at_rest, self._similar.precompression
        position, velocity, force = (np.ascontiguousarray(arrays[:, k]) for k in range(3))
        overlap = (rest.diameter[:-1] + rest.diameter[1:]) / 2 - np.diff(position, axis=-1)
        if scene.wall is not None:
            last = position[:, -1] + rest.diameter[-1] / 2 - wall_position(scene)
            overlap = np.column_stack([overlap, last])
        net = force - (0.0 if pressed is None else pressed.gravity) * rest.moving_mass
        if pressed is not None and scene.shock.loaded_granule:
            net[:, scene.shock.loaded_granule] -= pressed.force
        if scene.pushed > 0 and leg.ramp is not None:
            net[:, scene.pushed] -= leg.ramp.force(time)
        net[:, -1] += scene.held_load
        if wall_force is not None:
            net[:, -1] += wall_force
        contact_force = contact_forces(net)
        if wall_force is not None:
            contact_force = np.column_stack([contact_force, wall_force])
        # Granules that only touch may overlap by rounding of their positions; this is no contact.
        touching = overlap > np.finfo(np.float64).eps * np.max(np.abs(rest.position))
        states = Samples(
            time=time, displacement=position - rest.position, velocity=velocity,
            acceleration=force / rest.mass, overlap=overlap,
            contact_force=np.where(touching, contact_force, 0.0),
        )  # fmt: skip
        if scene.contact is not None:
            return true_forces(states, self._law_given, leg)
        return _with_true_derivatives(states, rest.mass, leg, scene.pushed)

    def replay(
        self, at_rest: Granules, arrays: FloatArray, strides: Sequence[int],
        wall_force: FloatArray | None = None,
    ) -> None:  # fmt: skip
        """Add all readings that a run left in files, at the given steps of each leg.

        Arrays and the force on the wall are those of ``update``; a corner has two readings, with
        the force before and after it. Other numbers of readings raise RunFailed.
        """
        wanted = count_readings(self.legs, strides)
        if len(arrays) != wanted:
            raise RunFailed(f"{self.code} wrote {len(arrays)} readings in place of {wanted}")
        self.begin(at_rest)
        at = 0
        for number, (leg, stride) in enumerate(zip(self.legs, strides, strict=True)):
            time = reading_times(leg, stride)
            for first in range(0, time.size - 1, BLOCK):
                span = slice(first, min(first + BLOCK + 1, time.size))
                block = slice(at + span.start, at + span.stop)
                on_wall = None if wall_force is None else wall_force[block]
                self.update(number, time[span], arrays[block], on_wall)
            at += time.size

    def simulation(self, version: str) -> Simulation:
        """Return the results after the last leg."""
        assert self._samples is not None
        return Simulation(
            scaling=self._scaling, legs=self._legs, peaks=self._watch.seen, seen=self._watch.peaks,
            displacement=self._samples.displacement[-1], velocity=self._velocity,
            balance=self._balance(self._samples), recorder=self._recorder, version=version,
        )  # fmt: skip

    def _balance(self, samples: Samples) -> Balance:
        """Momentum and energy from the masses, velocities, forces and overlaps of the code."""
        mass, velocity, scene = self._at_rest.moving_mass, self._velocity, self._scene
        energy = self._energy(samples, -1, velocity)
        if scene.precompression is not None:
            energy -= float(np.sum(scene.granules.constant_force * samples.displacement[-1]))
        momentum = float(np.sum(mass * velocity))
        seen, work = self._watch.seen, self._given + float(self._watch.work)
        impulse = scene.given_impulse + seen.piston_impulse - seen.wall_impulse
        return Balance(impulse, momentum, work, energy, seen.dissipated)

    def _energy(self, samples: Samples, which: int, velocity: FloatArray) -> float:
        """Kinetic and contact energy from forces, overlaps and velocities at one time [J]."""
        force, overlap = samples.contact_force[which], samples.overlap[which]
        force = force - self._law.damper(overlap, samples.overlap_derivatives[1][which])
        pressed = np.maximum(overlap, 0.0)
        kinetic = 0.5 * np.sum(self._at_rest.moving_mass * velocity**2)
        return float(kinetic + np.sum(hertz.energy_of(force, pressed)))


@dataclass(frozen=True, eq=False)
class Simulation:
    """Results of one run of another code, in SI units of the true scene."""

    scaling: Softening  # the similar scene that was computed
    legs: tuple[Leg, ...]
    peaks: PeakWatch
    seen: Peaks  # the same, with first pulses where they were wanted
    displacement: FloatArray  # displacement at the end [m], shape (bodies,)
    velocity: FloatArray  # velocity at the end [m/s], shape (bodies,)
    balance: Balance
    recorder: Recorder | None  # recorder of a history, if one was wanted
    version: str  # version of the code

    @property
    def steps(self) -> int:
        """Number of steps on all legs."""
        return sum(leg.steps for leg in self.legs)

    def round_off(self, scene: Scene) -> float:
        """Upper bound of the relative error of the peaks by absolute coordinates."""
        return round_off(scene, self.scaling, self.steps, self.peaks.force, self.displacement)
