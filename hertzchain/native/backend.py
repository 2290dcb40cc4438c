"""The native backend: scene in, result out."""

from __future__ import annotations

import functools
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.metadata import version

from numpy.typing import ArrayLike

from hertzchain.accuracy import companion, refuse_meaningless, second_order_safety
from hertzchain.chain import POSITIVE, is_positive
from hertzchain.errors import require
from hertzchain.history import Recorder, wanted_times
from hertzchain.native import choice
from hertzchain.native.methods import (
    DPRKN_6,
    RUNGE_KUTTA_4,
    SRKN_6B,
    SRKN_11B,
    VELOCITY_VERLET,
)
from hertzchain.native.refinement import Fixed, Refined, Walker
from hertzchain.native.simulation import Simulation, can_leave_behind, simulate
from hertzchain.peaks import largest_difference
from hertzchain.result import Balance, Result
from hertzchain.scene import Scene, require_scene
from hertzchain.schedule import Leg

RTOL = 1e-6
"""Where nothing else is asked for: whether p is 9 or 10 can hang on 2e-5."""


@dataclass(frozen=True)
class Method:
    """How a named method runs.

    Parameters
    ----------
    walker
        Takes the steps.
    step
        The step taken where none is asked for, in natural units.
    floor
        Part of the error that does not depend on the step: what refinement leaves, 4e-12 at most
        in the paper's scenes.
    """

    walker: Walker
    step: float
    floor: float = 0.0


METHODS = {
    "reference": Method(Refined(SRKN_11B, tolerance=1e-10), step=0.05, floor=1e-11),
    "srkn-11b": Method(Fixed(SRKN_11B), step=0.2),
    "srkn-6b": Method(Fixed(SRKN_6B), step=0.1),
    "dprkn-6": Method(Fixed(DPRKN_6), step=0.1),
    "rk4": Method(Fixed(RUNGE_KUTTA_4), step=0.0125),
    "velocity-verlet": Method(Fixed(VELOCITY_VERLET), step=0.002),
}
"""reference: SRKN_11^b with refined steps. The others take steps as asked: two symplectic
Runge-Kutta-Nystrom methods of Blanes and Moan, one of Dormand, El-Mikkawy and Prince, the paper's
and that of LAMMPS."""


@dataclass(frozen=True)
class Native:
    """Eq. 1 integrated in natural units.

    Parameters
    ----------
    method
        One of METHODS; by default the cheapest that gives peaks of accuracy ``rtol``.
    dt
        The largest step [s]; by default one that suits the method: peaks right to about 1e-12
        (reference), 1e-8 (rk4), 1e-6 (velocity-verlet).
    rtol
        Wanted relative accuracy of the peaks, from 1e-10 to 0.01; 1e-6 where neither method nor dt
        is given either, and not to be given together with one of them.
    peaks_only
        Whether only the peaks are wanted. Under one of the three pulses granules that cannot change
        any are left behind then, so that there is no displacement and velocity at the end: NaN.

    Raises
    ------
    SceneError
        For a method that does not exist, a step or an accuracy that cannot be, or too much said.
    """

    method: str | None = None
    dt: float | None = None
    rtol: float | None = None
    peaks_only: bool = False

    def __post_init__(self) -> None:
        if self.method is not None:
            names = ", ".join(METHODS)
            require(self.method in METHODS, "method", self.method, f"must be one of {names}")
        if self.dt is not None:
            require(is_positive(self.dt), "dt", self.dt, f"{POSITIVE} [s]")
        if self.rtol is not None:
            alone = self.method is None and self.dt is None
            require(alone, "rtol", self.rtol, "chooses method and step: must not stand with them")
            choice.check(self.rtol)

    def run(self, scene: Scene, record: ArrayLike | None = None) -> Result:
        """Simulate a scene.

        Parameters
        ----------
        scene
            What to simulate.
        record
            Increasing times [s] within the run at which to keep displacement, velocity and
            contact force; not with ``peaks_only``.

        Raises
        ------
        SceneError
            For what is no scene, or times that cannot be.
        RunFailed
            If the step is so large that the motion diverges, or the wanted accuracy cannot be had.
        """
        require_scene(scene)
        begin = time.perf_counter()
        recorder = times = None
        if record is not None:
            allowed = "must not be given with peaks_only, which leaves granules behind"
            require(not self.peaks_only, "record", record, allowed)
            times = wanted_times(record, scene.end_time)
            recorder = Recorder(times / scene.units.time, scene.chain.granules)
        if self.method is None and self.dt is None:
            method, legs, run, error = self._accurate_enough(scene, recorder)
        else:
            method, legs, run, error = self._as_asked(scene, recorder)
        refuse_meaningless("native", error)
        units = scene.units
        history = None
        if recorder is not None and times is not None:
            history = recorder.history(times, units.length, units.velocity, units.force)
        return Result(
            scene=scene,
            backend="native",
            method=method,
            dt=max(leg.dt for leg in legs),
            steps=run.steps,
            force_evaluations=run.evaluations,
            peak_force=run.peaks.force * units.force,
            peak_time=run.peaks.time * units.time,
            peak_passed=run.peaks.passed,
            error_estimate=error,
            displacement=run.state.displacement * units.length,
            velocity=run.state.velocity * units.velocity,
            balance=_balance(scene, run),
            history=history,
            wall_time=time.perf_counter() - begin,
            versions=_versions(),
        )

    def _as_asked(
        self, scene: Scene, recorder: Recorder | None
    ) -> tuple[str, tuple[Leg, ...], Simulation, float]:
        """Method, legs, run and its error with the method and the step asked for."""
        name = self.method or "reference"
        method = METHODS[name]
        dt = self.dt if self.dt is not None else method.step * scene.units.time
        legs = scene.schedule(dt)
        run = simulate(scene, legs, method.walker, recorder, leave_behind=self.peaks_only)
        return name, legs, run, _error_bound(scene, legs, method, run)

    def _accurate_enough(
        self, scene: Scene, recorder: Recorder | None
    ) -> tuple[str, tuple[Leg, ...], Simulation, float]:
        """Method, legs, run and its error with the cheapest method and step that suffice."""
        rtol = RTOL if self.rtol is None else self.rtol
        hard = not can_leave_behind(scene) or bool(
            choice.is_hard(scene.momentum_ratio, scene.chain.granules)
        )
        plan = choice.plan(rtol, hard=hard)
        for _ in range(choice.TRIES):
            legs = scene.schedule(plan.step * scene.units.time)
            run = simulate(scene, legs, plan.walker, recorder, leave_behind=self.peaks_only)
            error = _estimate(scene, legs, plan, run)
            if error <= rtol:
                return plan.method, legs, run, error
            plan = plan.closer(rtol, error)
        raise choice.not_to_be_had(rtol, error)


def _estimate(scene: Scene, legs: Sequence[Leg], plan: choice.Plan, run: Simulation) -> float:
    """Upper bound of the error of the peaks, from a second run with other steps."""
    steps = choice.other_steps([leg.steps for leg in legs]).tolist()
    other = [replace(leg, steps=count) for leg, count in zip(legs, steps, strict=True)]
    coarse = simulate(scene, other, plan.coarser, leave_behind=True)
    difference = largest_difference(coarse.peaks.force, run.peaks.force)
    return float(plan.estimate(difference, run.evaluations))


def _error_bound(scene: Scene, legs: Sequence[Leg], method: Method, run: Simulation) -> float:
    other = companion(legs)
    peaks = simulate(scene, other.legs, method.walker, leave_behind=True).peaks.force
    difference = largest_difference(peaks, run.peaks.force)
    # Of a method of higher order more than the whole difference: an opening contact leaves errors
    # that are erratic from step to step.
    longest = max(leg.dt for leg in legs) / scene.units.time
    higher = 3.0 if longest <= 0.6 else 30.0  # 6 was needed at 1.5 natural time units
    safety = second_order_safety(longest) if method.walker.stepper.order == 2 else higher
    lost = choice.round_off(run.evaluations)
    return float(safety * other.factor * difference + method.floor + lost)


def _balance(scene: Scene, run: Simulation) -> Balance:
    return Balance(
        impulse=scene.applied_impulse,
        momentum=float(run.momentum) * scene.units.momentum,
        work=float(run.work) * scene.units.energy,
        energy=float(run.energy) * scene.units.energy,
    )


@functools.cache
def _versions() -> Mapping[str, str]:
    return {"numpy": version("numpy"), "numba": version("numba")}
