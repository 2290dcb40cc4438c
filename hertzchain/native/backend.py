"""The native backend: scene in, result out."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from hertzchain.accuracy import companion, refuse_meaningless, second_order_safety
from hertzchain.arrays import Array, Scalar
from hertzchain.chain import POSITIVE, is_positive
from hertzchain.errors import require
from hertzchain.history import Recorder, wanted_times
from hertzchain.native.equations import contact_force, overlap
from hertzchain.native.integration import integrate
from hertzchain.native.refinement import Fixed, Refined, Walker
from hertzchain.native.steppers import SRKN_11B, VELOCITY_VERLET, RungeKutta4, State
from hertzchain.peaks import PeakWatch, largest_difference
from hertzchain.result import Balance, Result
from hertzchain.samples import Samples
from hertzchain.scene import Scene
from hertzchain.schedule import Leg
from hertzchain.work import work_done


@dataclass(frozen=True)
class Method:
    """How a named method runs.

    Parameters
    ----------
    walker
        Takes the steps.
    evaluations
        Force evaluations in a step.
    step
        The step taken where none is asked for, in natural units.
    floor
        Part of the error that does not depend on the step: what refinement leaves, 4e-12 at most
        in the paper's scenes.
    """

    walker: Walker
    evaluations: int
    step: float
    floor: float = 0.0


METHODS = {
    "reference": Method(Refined(SRKN_11B, tolerance=1e-10), 11, step=0.05, floor=1e-11),
    "rk4": Method(Fixed(RungeKutta4()), 4, step=0.0125),
    "velocity-verlet": Method(Fixed(VELOCITY_VERLET), 1, step=0.002),
}
"""reference: SRKN_11^b with refined steps; rk4: the paper's; velocity-verlet: that of LAMMPS."""


@dataclass(frozen=True)
class Native:
    """Eq. 1 integrated in natural units.

    Parameters
    ----------
    method
        ``reference``, ``rk4`` or ``velocity-verlet``.
    dt
        The largest step [s]; by default one that suits the method: peaks right to about 1e-12
        (reference), 1e-8 (rk4), 1e-6 (velocity-verlet).

    Raises
    ------
    SceneError
        For a method that does not exist or a step that is not a finite number above 0.
    """

    method: str = "reference"
    dt: float | None = None

    def __post_init__(self) -> None:
        names = ", ".join(METHODS)
        require(self.method in METHODS, "method", self.method, f"must be one of {names}")
        if self.dt is not None:
            require(is_positive(self.dt), "dt", self.dt, f"{POSITIVE} [s]")

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
        RunFailed
            If the step is so large that the motion diverges.
        """
        begin = time.perf_counter()
        method = METHODS[self.method]
        dt = self.dt if self.dt is not None else method.step * scene.units.time
        legs = scene.schedule(dt)
        units = scene.units
        recorder = history = None
        if record is not None:
            times = wanted_times(record, scene.end_time)
            recorder = Recorder(times / units.time, scene.chain.granules)
        run = simulate(scene, legs, method.walker, recorder)
        if recorder is not None:
            history = recorder.history(times, units.length, units.velocity, units.force)
        peak_force = run.peaks.force
        evaluations = run.steps * method.evaluations
        error = _error_bound(scene, legs, method, peak_force, evaluations)
        refuse_meaningless("native", error)
        return Result(
            scene=scene,
            backend="native",
            method=self.method,
            dt=max(leg.dt for leg in legs),
            steps=run.steps,
            force_evaluations=evaluations,
            peak_force=peak_force * units.force,
            peak_time=run.peaks.time * units.time,
            peak_passed=run.peaks.passed,
            error_estimate=error,
            displacement=np.asarray(run.state.displacement * units.length, np.float64),
            velocity=np.asarray(run.state.velocity * units.velocity, np.float64),
            balance=_balance(scene, run),
            history=history,
            wall_time=time.perf_counter() - begin,
            versions={"numpy": version("numpy")},
        )


@dataclass(frozen=True)
class Simulation:
    """What one integration found, in natural units."""

    state: State
    peaks: PeakWatch
    work: Scalar
    steps: int


def simulate(
    scene: Scene,
    legs: Sequence[Leg],
    walker: Walker,
    recorder: Recorder | None = None,
    dtype: type[np.floating[Any]] = np.float64,
    displacement: Array | None = None,
) -> Simulation:
    """Integrate a scene once, on given legs [s, N], watching peaks and work.

    Parameters
    ----------
    scene, legs, walker, recorder, dtype
        What, on which steps, by which method, recording what, in which precision.
    displacement
        Where the granules are at the start, natural units, shape (granules,); 0 by default.
    """
    units = scene.units
    peaks = PeakWatch(scene.chain.granules - 1, dtype)
    work = dtype(0)

    def show(samples: Samples, leg: Leg) -> None:
        nonlocal work
        peaks.show(samples)
        if leg.ramp is not None:
            work += work_done(samples, leg.ramp)
        if recorder is not None:
            recorder.show(samples)

    natural = [leg.in_units(units.time, units.force) for leg in legs]
    if displacement is None:
        displacement = np.zeros(scene.chain.granules, dtype)
    state, steps = integrate(displacement, natural, walker, show)
    return Simulation(state, peaks, work, steps)


def _error_bound(
    scene: Scene,
    legs: Sequence[Leg],
    method: Method,
    peak_force: np.ndarray,
    evaluations: int,
) -> float:
    other = companion(legs)
    round_off = 4 * np.finfo(np.float64).eps * np.sqrt(evaluations)
    peaks = simulate(scene, other.legs, method.walker).peaks.force
    difference = largest_difference(peaks, peak_force)
    # Of a method of higher order more than the whole difference: an opening contact leaves errors
    # that are erratic from step to step.
    longest = max(leg.dt for leg in legs) / scene.units.time
    higher = 3.0 if longest <= 0.6 else 30.0  # 6 was needed at 1.5 natural time units
    safety = second_order_safety(longest) if method.walker.stepper.order == 2 else higher
    return float(safety * other.factor * difference + method.floor + round_off)


def _balance(scene: Scene, run: Simulation) -> Balance:
    pressed = overlap(run.state.displacement)
    energy = 0.5 * np.sum(run.state.velocity**2) + 0.4 * np.sum(contact_force(pressed) * pressed)
    return Balance(
        impulse=scene.applied_impulse,
        momentum=float(np.sum(run.state.velocity)) * scene.units.momentum,
        work=float(run.work) * scene.units.energy,
        energy=float(energy) * scene.units.energy,
    )
