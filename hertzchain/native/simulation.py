"""One integration of a scene: by the compiled kernels, or by the plain NumPy that they follow."""

from __future__ import annotations

import functools
import math
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hertzchain.accuracy import refuse_meaningless
from hertzchain.arrays import Array, FloatArray, Scalar
from hertzchain.history import Recorder
from hertzchain.native.equations import contact_force, overlap
from hertzchain.native.integration import integrate
from hertzchain.native.methods import RungeKuttaNystrom, Stepper, SymplecticNystrom
from hertzchain.native.refinement import Walker
from hertzchain.peaks import PeakWatch
from hertzchain.samples import Samples
from hertzchain.scene import Scene
from hertzchain.schedule import Leg
from hertzchain.shock import Pulse
from hertzchain.similarity import NaturalUnits
from hertzchain.work import work_done

if TYPE_CHECKING:
    from hertzchain.native.kernels import Table

SHAPES = {"linear": 1, "cosine": 2}
"""How the kernels are told the shape of a ramp."""

_MOVING = 8
"""Granules that the window of a run starts with."""

_LONG_RUN = 1e8
"""Granules times force evaluations: about a tenth of a second."""


@dataclass(frozen=True, eq=False)
class Peaks:
    """Peak force of each contact and its time, and whether it has let up since: (contacts,)."""

    force: Any
    time: Any
    passed: NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class End:
    """Displacement and velocity at the end, shape (granules,)."""

    displacement: Any
    velocity: Any


@dataclass(frozen=True, eq=False)
class Simulation:
    """What one integration found, in natural units.

    Parameters
    ----------
    state
        At the end; NaN where granules were left behind.
    peaks
        Of all contacts.
    work, momentum, energy
        Done by the applied force; of all granules at the end.
    steps, evaluations
        Steps taken, and force evaluations; compiled runs count those of refused steps too.
    """

    state: End
    peaks: Peaks
    work: Scalar
    momentum: Scalar
    energy: Scalar
    steps: int
    evaluations: int


def simulate(
    scene: Scene,
    legs: Sequence[Leg],
    walker: Walker,
    recorder: Recorder | None = None,
    dtype: type[np.floating[Any]] = np.float64,
    leave_behind: bool = False,
    window: bool = True,
) -> Simulation:
    """Integrate a scene once, on given legs [s, N], with the compiled kernels.

    Parameters
    ----------
    scene, legs, walker
        What, on which steps, by which method.
    recorder
        What to record; it is filled in.
    dtype
        float64 or float32.
    leave_behind
        Whether only the peaks are wanted: granules that cannot change any are left behind, where
        that can be told.
    window
        Whether granules that the wave has not reached are left out.

    Raises
    ------
    RunFailed
        If the motion diverges: the step is too large for the method.
    """
    from hertzchain.native import kernels

    granules = scene.chain.granules
    leave_behind = leave_behind and can_leave_behind(scene)
    force = np.zeros(granules - 1)
    time = np.full(granules - 1, np.nan)
    times = np.zeros(0) if recorder is None else np.asarray(recorder.time, np.float64)
    record = kernels.Record(
        times,
        np.zeros((times.size, granules)),
        np.zeros((times.size, granules)),
        np.zeros((times.size, granules - 1)),
    )
    control = np.zeros(2)
    rows = leg_rows(legs, walker, scene.units)

    def run() -> Any:
        return kernels.march(
            rows, table(walker.stepper), np.zeros(0, dtype), walker.stepper.order == 2,
            walker.tolerance, walker.starting, granules, _MOVING if window else granules,
            leave_behind, force, time, record, control,
        )  # fmt: skip

    work = float(np.sum(rows[:, 2])) * walker.stepper.stages * granules
    outcome, displacement, velocity = run() if work < _LONG_RUN else stoppable(run, control)
    if outcome.status == kernels.DIVERGED:
        refuse_meaningless("native", math.inf)
    if recorder is not None:
        recorder.displacement[:] = record.displacement
        recorder.velocity[:] = record.velocity
        recorder.contact_force[:] = record.contact_force
    if leave_behind:
        displacement = velocity = np.full(granules, np.nan)
    return Simulation(
        End(displacement, velocity),
        Peaks(force, time, time < outcome.end),
        outcome.work,
        outcome.momentum,
        outcome.energy,
        outcome.steps,
        outcome.evaluations,
    )


def can_leave_behind(scene: Scene) -> bool:
    """Whether it can be told that a granule will not matter any more: under one pulse only.

    After a second push, waves run behind one another in any order, and a broad packet can break up
    into waves that are stronger than anything in it was.
    """
    return isinstance(scene.shock, Pulse)


def stoppable(run: Callable[[], Any], control: FloatArray) -> Any:
    """Do long compiled work in a thread, so that an interrupt stops it.

    Parameters
    ----------
    run
        Does the work and lets go of the interpreter meanwhile.
    control
        Its first entry, set to 1, ends the work.
    """
    found: list[Any] = []
    failed: list[BaseException] = []

    def work() -> None:
        try:
            found.append(run())
        except BaseException as problem:  # raised again below
            failed.append(problem)

    thread = threading.Thread(target=work)
    thread.start()
    try:
        while thread.is_alive():
            thread.join(0.1)
    except BaseException:
        control[0] = 1
        thread.join()
        raise
    if failed:
        raise failed[0]
    return found[0]


def leg_rows(legs: Sequence[Leg], walker: Walker, units: NaturalUnits) -> FloatArray:
    """Legs [s, N] as the kernels take them: natural units, shape (legs, 8)."""
    rows = np.zeros((len(legs), 8))
    for row, leg in zip(rows, legs, strict=True):
        row[:3] = leg.start / units.time, leg.end / units.time, leg.steps * walker.parts(leg)
        if leg.ramp is not None:
            ramp = leg.ramp
            row[3:6] = SHAPES[ramp.shape], ramp.start / units.time, ramp.end / units.time
            row[6:8] = ramp.start_force / units.force, ramp.end_force / units.force
    return rows


@functools.cache
def table(stepper: Stepper) -> Table:
    """The coefficients of a method as the kernels take them."""
    from hertzchain.native import kernels

    none = np.zeros(0)
    if isinstance(stepper, SymplecticNystrom):
        kicks, drifts = np.array(stepper.kicks), np.array(stepper.drifts)
        return kernels.Table(kicks, drifts, none, np.zeros((0, 0)), none, none)
    assert isinstance(stepper, RungeKuttaNystrom)
    position = np.zeros((stepper.stages, stepper.stages))
    for row, known in zip(position[1:], stepper.position, strict=True):
        row[: len(known)] = known
    return kernels.Table(
        np.array([stepper.last_weight]),
        np.ones(1),
        np.array(stepper.nodes),
        position,
        np.array(stepper.velocity_weights),
        np.array(stepper.position_weights),
    )


def simulate_in_numpy(
    scene: Scene,
    legs: Sequence[Leg],
    walker: Walker,
    recorder: Recorder | None = None,
    dtype: type[np.floating[Any]] = np.float64,
    displacement: Array | None = None,
) -> Simulation:
    """Integrate a scene once, on given legs [s, N], with the equations as they are written.

    Parameters
    ----------
    scene, legs, walker, recorder, dtype
        What, on which steps, by which method, recording what, in any precision of NumPy.
    displacement
        Where the granules are at the start, natural units, shape (granules,); 0 by default.
    """
    units = scene.units
    watch = PeakWatch(scene.chain.granules - 1, dtype)
    work = dtype(0)

    def show(samples: Samples, leg: Leg) -> None:
        nonlocal work
        watch.show(samples)
        if leg.ramp is not None:
            work += work_done(samples, leg.ramp)
        if recorder is not None:
            recorder.show(samples)

    natural = [leg.in_units(units.time, units.force) for leg in legs]
    if displacement is None:
        displacement = np.zeros(scene.chain.granules, dtype)
    state, steps = integrate(displacement, natural, walker, show)
    pressed = overlap(state.displacement)
    return Simulation(
        End(state.displacement, state.velocity),
        Peaks(watch.force, watch.time, watch.passed),
        work,
        np.sum(state.velocity),
        0.5 * np.sum(state.velocity**2) + 0.4 * np.sum(contact_force(pressed) * pressed),
        steps,
        steps * walker.stepper.stages,
    )
