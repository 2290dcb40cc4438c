"""Observation of one run of another code, and its results."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.contact import hertz
from hertzchain.engines.external import readings
from hertzchain.engines.external.rescaling import Softening, round_off
from hertzchain.engines.external.terms import wall_position
from hertzchain.errors import OverlapTooLarge, RunFailed
from hertzchain.limits import refuse_memory
from hertzchain.observables.contact_errors import Peaks
from hertzchain.observables.error_bound import SHORTER, diverged
from hertzchain.observables.first_pulse import Signals
from hertzchain.observables.result import Balance
from hertzchain.observables.samples import DampedLaw, Recorder, Samples
from hertzchain.observables.watch import PeakWatch, Watch
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg

_BYTES = 180  # least bytes of memory for a granule in a reading; measured for a dump: 187


def refuse_large(legs: Sequence[Leg], strides: Sequence[int], granules: int) -> None:
    """Refuse a run whose readings do not fit into memory."""
    refuse_memory(float(_BYTES) * readings.count_readings(legs, strides) * granules)


class Observation:
    """Observes a run of the scene that a code was given, in the units of the true scene.

    Scene and legs are the true ones; ``made`` relates them to the similar ones that the code was
    given; ``times`` are those of a history [s], if one is wanted; ``code`` is the name in messages;
    ``first``: first pulses are wanted.
    """

    def __init__(
        self, scene: Scene, scaling: Softening, legs: Sequence[Leg], times: FloatArray | None,
        code: str, first: bool = False,
    ) -> None:  # fmt: skip
        self._scene, self._scaling, self._legs, self.code = scene, scaling, tuple(legs), code
        self.legs = [scaling.leg(leg) for leg in legs]  # the legs given to the code
        self._fastest, self._law = _fastest(scene), DampedLaw.of(scene)
        self._signals, wall = Signals.of(scene) if first else None, scene.wall is not None
        self._recorder = None if times is None else Recorder(times, scene.bodies, wall)
        self._given = 0.0
        self._samples: Samples | None = None
        self._velocity = np.zeros(scene.bodies)

    def begin(self, at_rest: readings.Granules) -> None:
        """Store the granules of the code before the shock; refuse a wrong number of them."""
        count, wanted = at_rest.mass.size, self._scene.bodies
        if count != wanted:
            raise RunFailed(
                f"{self.code} made {count} granules of a chain of {wanted}: do not trust this"
                " version with it"
            )
        if self._scene.piston is not None:
            at_rest = replace(at_rest, mass=np.append(math.inf, at_rest.mass[1:]))
        fixed = self._scene.granules.is_fixed
        at_rest = replace(at_rest, mass=np.where(fixed, math.inf, at_rest.mass))
        self._at_rest = at_rest
        self._watch = Watch(
            self._scene, self._law, 1 / at_rest.mass, self._signals, self._recorder,
            self._scene.units.force,
        )  # fmt: skip
        scene = self._scaling.scene(self._scene)
        self._held = _held(scene)
        self._law_given = None if scene.contact is None else DampedLaw.of(scene)

    def update(
        self, number: int, time: FloatArray, arrays: FloatArray,
        wall_force: FloatArray | None = None,
    ) -> None:  # fmt: skip
        """Add successive readings on a leg; the first repeats the last of the call before.

        All values are those of the scene given to the code: number of the leg, from 0; times [s],
        shape (readings,); positions [m], velocities [m/s] and net forces [N] along the chain, shape
        (readings, 3, granules), with the force on the wall, if there is one [N], shape (readings,).
        Motion that has diverged raises StepUnstable, granules that touch the next but one
        OverlapTooLarge.
        """
        if not np.all(np.isfinite(arrays)):
            raise diverged(self.code)
        leg = self._legs[number]
        leg_given = self.legs[number]
        seen = readings.samples(
            time, arrays, self._at_rest, leg_given, self._held, wall_force, self._law_given
        )
        self._refuse_second_neighbours(seen)
        samples = self._scaling.true(seen)
        if self._samples is None:
            before = arrays[0, 1] / self._scaling.time
            self._given = self._energy(samples, 0, before)
        if np.max(np.abs(samples.velocity)) > 2 * self._fastest:
            raise diverged(self.code)
        self._watch.update(samples, leg, leg.dt / 2)
        self._samples = samples
        self._velocity = arrays[-1, 1] / self._scaling.time

    def replay(
        self, at_rest: readings.Granules, arrays: FloatArray, strides: Sequence[int],
        wall_force: FloatArray | None = None,
    ) -> None:  # fmt: skip
        """Add all readings that a run left in files, at the given steps of each leg.

        Arrays and the force on the wall are those of ``update``; a corner has two readings, with
        the force before and after it. Other numbers of readings raise RunFailed.
        """
        wanted = readings.count_readings(self.legs, strides)
        if len(arrays) != wanted:
            raise RunFailed(
                f"{self.code} left {len(arrays)} readings, not the {wanted} it was asked for"
            )
        self.begin(at_rest)
        at = 0
        for number, (leg, stride) in enumerate(zip(self.legs, strides, strict=True)):
            time = readings.reading_times(leg, stride)
            for first in range(0, time.size - 1, readings.BLOCK):
                span = slice(first, min(first + readings.BLOCK + 1, time.size))
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

    def _refuse_second_neighbours(self, seen: Samples) -> None:
        """Refuse overlaps so deep that granules would touch the next but one, or pass it."""
        alone = np.max(seen.overlap)
        together = np.max(seen.overlap[:, :-1] + seen.overlap[:, 1:], initial=0.0)
        if max(alone, together) >= np.min(self._at_rest.diameter):
            raise OverlapTooLarge(
                f"{self.code} would push granules through one another: {SHORTER}, or else"
                " a smaller force or a stiffer material"
            )

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


def _fastest(scene: Scene) -> float:
    """Half an upper bound of all velocities [m/s]; faster granules mean a diverged motion."""
    # All energy in one granule of the smallest mass; static contacts have energy too.
    lightest = float(np.min(scene.granules.mass))
    at_rest = hertz.energy_of(scene.granules.static_force, scene.granules.static_overlap)
    static = float(np.sum(at_rest))
    flying = 0.5 * float((scene.granules.moved * scene.granules.velocity)[1:].sum())
    if scene.piston is not None:
        moved = scene.granules.as_if_free.mass[1:]
        # All granules thrown ahead, and all contacts pressed by the scene's unit of force.
        energy = 2 * float(np.sum(moved)) * scene.piston.impact_velocity**2 + static
        energy += moved.size * scene.units.energy
    else:
        # The two halves of a cycle of a sine cancel in the impulse, but not in the velocities.
        pushed = math.fsum(abs(ramp.impulse) for ramp in scene.ramps)
        momentum = pushed + abs(float(scene.granules.moved[0]))
        energy = momentum**2 / (2 * scene.pushed_mass) + static
    return 10.0 * math.sqrt(2 * (energy + flying) / lightest)


def _held(scene: Scene) -> readings.Held:
    """Return loads and wall of the scene that a code computes; ``Held()`` without terms."""
    pressed, wall = scene.precompression, scene.wall
    place = None if wall is None else wall_position(scene)
    pushed = scene.pushed
    if pressed is None:
        return readings.Held(wall=place, pushed=pushed)
    second = pressed.force if scene.shock.loaded_granule else 0.0
    return readings.Held(pressed.gravity, second, scene.held_load, place, pushed)


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
