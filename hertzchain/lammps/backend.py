"""The LAMMPS backend: scene in, result out."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from hertzchain.accuracy import (
    companion,
    refuse_meaningless,
    second_order_safety,
    second_order_step,
)
from hertzchain.arrays import FloatArray
from hertzchain.chain import POSITIVE, is_positive
from hertzchain.errors import RunFailed, require
from hertzchain.history import Recorder, wanted_times
from hertzchain.lammps import deck, reading
from hertzchain.lammps.engine import command, engine, version_of
from hertzchain.peaks import SIGNIFICANT, PeakWatch, largest_difference
from hertzchain.result import Balance, Result
from hertzchain.samples import Samples
from hertzchain.scene import Scene
from hertzchain.schedule import Leg
from hertzchain.work import work_done

WANTED_ERROR = 1e-6
"""Of the peaks, where no step is asked for: whether p is 9 or 10 can hang on 2e-5."""

_READING_INTERVAL = 0.1
"""Natural time units between two readings, at most."""

_READINGS_PER_RAMP = 16
"""At least, if there are so many steps."""

_TRIES = 3
"""Runs to get below the wanted error: the first estimate of the step may be a little too long."""

_BLOCK = 256
"""Readings handed on at a time."""

_PILOT_STEP = 0.04
"""Natural time units; the first of the runs that find the step for a wanted error."""


@dataclass(frozen=True)
class Lammps:
    """A generated deck, run through the ``lammps`` Python module.

    Parameters
    ----------
    dt
        The largest step [s]; by default the one whose estimated error is at most 1e-6.
    pair_style
        ``granular`` (with hertz/material) or ``gran/hertz/history``.
    read_every
        Steps between two readings of the state; by default so many that 0.1 natural time units
        pass at most.

    Raises
    ------
    SceneError
        For a pair style that does not exist, a step that is not a finite number above 0, or
        readings less than one step apart.
    """

    dt: float | None = None
    pair_style: str = "granular"
    read_every: int | None = None

    def __post_init__(self) -> None:
        names = ", ".join(deck.PAIR_STYLES)
        known = self.pair_style in deck.PAIR_STYLES
        require(known, "pair_style", self.pair_style, f"must be one of {names}")
        if self.dt is not None:
            require(is_positive(self.dt), "dt", self.dt, f"{POSITIVE} [s]")
        if self.read_every is not None:
            require(self.read_every >= 1, "read_every", self.read_every, "must be at least 1")

    def run(self, scene: Scene, record: ArrayLike | None = None) -> Result:
        """Simulate a scene.

        Parameters
        ----------
        scene
            What to simulate.
        record
            Increasing times [s] within the run at which to keep displacement, velocity and
            contact force.

        Raises
        ------
        BackendMissing
            If LAMMPS is not there.
        RunFailed
            If LAMMPS stops with an error, or the motion diverges.
        """
        begin = time.perf_counter()
        if scene.units.length > scene.chain.radius / 2:
            raise RunFailed(
                f"the overlap under {scene.units.force:.3g} N, {scene.units.length:.3g} m, is more"
                " than half a radius: LAMMPS would push granules through one another; take a"
                " smaller force or a stiffer material"
            )
        times = None if record is None else wanted_times(record, scene.end_time)
        legs, run, step_error, recorder = self._accurate_enough(scene, times)
        steps = sum(leg.steps for leg in legs)
        lost = round_off(scene, steps, run.peaks.force)
        if not lost < 1:
            raise RunFailed(
                "LAMMPS cannot resolve the overlaps of this scene beside its coordinates: take a"
                " larger force, a shorter chain or a softer material"
            )
        error = step_error + self._interpolation_error(scene, legs) + lost
        refuse_meaningless("LAMMPS", error)
        history = None if recorder is None or times is None else recorder.history(times)
        return Result(
            scene=scene,
            backend="lammps",
            method=f"velocity-verlet, {self.pair_style}",
            dt=max(leg.dt for leg in legs),
            steps=steps,
            force_evaluations=steps,
            peak_force=run.peaks.force,
            peak_time=run.peaks.time,
            peak_passed=run.peaks.passed,
            error_estimate=error,
            displacement=run.displacement,
            velocity=run.velocity,
            balance=run.balance,
            history=history,
            wall_time=time.perf_counter() - begin,
            versions={"lammps": run.version},
        )

    def _accurate_enough(
        self, scene: Scene, times: FloatArray | None
    ) -> tuple[tuple[Leg, ...], _Simulation, float, Recorder | None]:
        """Run with the step asked for, or with one whose error is as small as wanted.

        Returns
        -------
        The legs, the run on them, what its steps may cost the peaks, and what was recorded.
        """

        def peaks_at(dt: float) -> FloatArray:
            return self._rough_peaks(scene, scene.schedule(dt))

        unit = scene.units.time
        dt = self.dt or second_order_step(peaks_at, _PILOT_STEP * unit, WANTED_ERROR)
        for _ in range(_TRIES):
            legs = scene.schedule(dt)
            recorder = None if times is None else Recorder(times, scene.chain.granules)
            strides = [self._stride(scene, leg) for leg in legs]
            run = self._simulate(scene, legs, strides, recorder)
            error = self._step_error(scene, legs, run.peaks.force)
            # Below what round-off costs, shorter steps cannot help.
            lost = round_off(scene, sum(leg.steps for leg in legs), run.peaks.force)
            if self.dt is not None or error <= max(WANTED_ERROR, lost):
                break
            dt *= max(0.25, 0.9 * math.sqrt(WANTED_ERROR / error))
        return legs, run, error, recorder

    def _rough_peaks(self, scene: Scene, legs: Sequence[Leg]) -> FloatArray:
        """Peaks of a run that only tells the error of another: read as rarely as possible."""
        strides = [_steps_in(_READING_INTERVAL, scene, leg) for leg in legs]
        return self._simulate(scene, legs, strides).peaks.force

    def _simulate(
        self,
        scene: Scene,
        legs: Sequence[Leg],
        strides: Sequence[int],
        recorder: Recorder | None = None,
    ) -> _Simulation:
        """Run the deck of a scene once, reading it every so many steps of each leg."""
        peaks = PeakWatch(scene.chain.granules - 1)
        work = 0.0
        with engine() as lammps:
            command(lammps, deck.set_up(scene, self.pair_style))
            start = reading.snapshot(lammps, 0.0)
            mass, diameter = reading.masses(lammps), reading.diameters(lammps)
            before = None
            for leg, stride in zip(legs, strides, strict=True):
                command(lammps, "\n".join([*deck.leg_commands(leg, before), "run 0 post no"]))
                before = leg
                for shots in _read(lammps, leg, stride):
                    samples = reading.samples(shots, start.position, mass, diameter)
                    peaks.show(samples)
                    if leg.ramp is not None:
                        work += float(work_done(samples, leg.ramp))
                    if recorder is not None:
                        recorder.show(samples)
            return _Simulation(
                peaks,
                samples.displacement[-1],
                samples.velocity[-1],
                _balance(scene, samples, mass, work),
                version_of(lammps),
            )

    def _stride(self, scene: Scene, leg: Leg) -> int:
        """Steps between two readings on a leg.

        The velocities of velocity Verlet are not quite the slopes of its displacements: they
        differ by dt^2/6 times the jerk. A peak interpolated over an interval h is off by
        0.03 h dt^2 for that (measured, natural units); h is kept so short that it is 5e-9.
        """
        if self.read_every is not None:
            return self.read_every
        square = (leg.dt / scene.units.time) ** 2
        interval = _READING_INTERVAL
        if square * interval > 1.6e-7:
            interval = 1.6e-7 / square
        stride = _steps_in(interval, scene, leg)
        if leg.ramp is not None:  # the work of a short pulse needs readings too
            stride = min(stride, leg.steps // _READINGS_PER_RAMP)
        return max(1, stride)

    def _step_error(self, scene: Scene, legs: Sequence[Leg], peak_force: FloatArray) -> float:
        """Bound of what the steps cost the peaks, as a fraction."""
        other = companion(legs)
        difference = largest_difference(self._rough_peaks(scene, other.legs), peak_force)
        longest = max(leg.dt for leg in legs) / scene.units.time
        return second_order_safety(longest) * other.factor * difference

    def _interpolation_error(self, scene: Scene, legs: Sequence[Leg]) -> float:
        """Bound of what reading now and then costs the peaks, as a fraction.

        Quintic interpolation: 2e-3 h^6 measured (9e-6 at h = 0.4), and see _stride.
        """
        dt = max(leg.dt for leg in legs) / scene.units.time
        h = max(self._stride(scene, leg) * leg.dt for leg in legs) / scene.units.time
        return 4e-3 * h**6 + 0.04 * h * dt**2


def _steps_in(interval: float, scene: Scene, leg: Leg) -> int:
    """Steps of a leg in an interval [natural time units], at least one, at most all."""
    return max(1, int(min(leg.steps, interval * scene.units.time / leg.dt)))


def _read(lammps: Any, leg: Leg, stride: int) -> Iterator[list[reading.Snapshot]]:
    """Run a leg, reading every ``stride`` steps; yields runs of snapshots that overlap by one."""
    shots = [reading.snapshot(lammps, leg.start)]
    for done in range(0, leg.steps, stride):
        ahead = min(stride, leg.steps - done)
        command(lammps, f"run {ahead} pre no post no")
        reached = done + ahead
        time = leg.end if reached == leg.steps else leg.start + reached * leg.dt
        shots.append(reading.snapshot(lammps, time))
        if not np.all(np.isfinite(shots[-1].velocity)):
            refuse_meaningless("LAMMPS", math.inf)
        if len(shots) > _BLOCK:
            yield shots
            shots = shots[-1:]
    if len(shots) > 1:
        yield shots


def round_off(scene: Scene, steps: int, peak_force: FloatArray) -> float:
    """Bound of what absolute coordinates cost the peaks, as a fraction.

    LAMMPS forms the overlap from positions up to 2 R N, so it loses that many digits of it, and
    rounds again at each step. Measured against native velocity Verlet at the same steps, F0 from
    1e-6 to 1e4 N, N from 10 to 800: at most a third of this.

    Parameters
    ----------
    scene
        The scene.
    steps
        Number of steps.
    peak_force
        Of all contacts [N], shape (contacts,); the smallest that is judged loses most.
    """
    judged = peak_force[peak_force >= SIGNIFICANT * np.max(peak_force)]
    overlap = (np.min(judged) / scene.chain.contact_stiffness) ** (2 / 3)
    if overlap == 0:
        return 0.0 if not np.any(peak_force) else math.inf
    reach = 2 * scene.chain.radius * scene.chain.granules
    return float(np.finfo(np.float64).eps * reach / overlap * math.sqrt(steps))


@dataclass(frozen=True)
class _Simulation:
    """What one run of LAMMPS found, in SI units."""

    peaks: PeakWatch
    displacement: FloatArray
    velocity: FloatArray
    balance: Balance
    version: str


def _balance(scene: Scene, samples: Samples, mass: FloatArray, work: float) -> Balance:
    """Momentum and energy from the masses, forces and overlaps that LAMMPS holds."""
    velocity, force = samples.velocity[-1], samples.contact_force[-1]
    pressed = np.maximum(samples.overlap[-1], 0.0)
    energy = 0.5 * np.sum(mass * velocity**2) + 0.4 * np.sum(force * pressed)
    momentum = float(np.sum(mass * velocity))
    return Balance(scene.applied_impulse, momentum, work, float(energy))
