"""One integration of a scene by the compiled kernels."""

from __future__ import annotations

import functools
import math
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray, Scalar
from hertzchain.engines.native.methods import RungeKuttaNystrom, Stepper, SymplecticNystrom
from hertzchain.engines.native.refinement import Walker
from hertzchain.errors import RunFailed
from hertzchain.limits import TIME_LIMIT, Deadline, refuse_memory
from hertzchain.observables.error_bound import diverged
from hertzchain.observables.history import Recorder
from hertzchain.observables.peaks import any_rising
from hertzchain.scene.natural_units import NaturalUnits, force_scale
from hertzchain.scene.pulse import Pulse
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg

if TYPE_CHECKING:
    from hertzchain.engines.native.kernels import Record, Table, Terms

_MOVING = 8
"""Number of granules in the window at the start of a run."""

_LONG_RUN = 1e7
"""Granules times force evaluations of a short run: about 0.01 s."""

_STEP_IN_EVALUATIONS = 500
"""Additional cost of a step, in force evaluations of a granule."""

_LOOKS = 10.0
"""Steps times granules after which a run counts as long, in millions: 0.1 s."""

_PEAKS_ALONE = "; peaks alone take less: Native(peaks_only=True), or hertzchain run"

_FASTEST = 0.5e-9
"""Time of a granule and force evaluation on a fast machine [s]; measured 1.1e-9 to 2e-9."""

_FASTEST_FRONT = 1.1
"""Upper bound of the speed of a front [granules per natural time unit] (chosen): that of a wave of
height 3; heights up to 2.2 were measured.
"""


@dataclass(frozen=True, eq=False)
class Peaks:
    """Peak force of each contact, its time, and whether the force has fallen since: (contacts,)."""

    force: Any
    time: Any
    passed: NDArray[np.bool_]

    @property
    def any_rising(self) -> bool:
        """True if a judged contact had its largest force at the end of the run."""
        return any_rising(self.force, self.passed)


@dataclass(frozen=True, eq=False)
class End:
    """Displacement and velocity at the end, shape (granules,)."""

    displacement: Any
    velocity: Any


@dataclass(frozen=True, eq=False)
class Simulation:
    """Results of one integration, in natural units."""

    state: End  # state at the end; NaN for granules that were dropped
    peaks: Peaks
    work: Scalar  # work of the applied force or the piston, plus the energy at the start
    momentum: Scalar  # of all granules except a piston at the end
    energy: Scalar  # of the same granules at the end, with that of constant forces
    steps: int
    evaluations: int  # evaluations of the force; compiled runs include refused steps
    wall_impulse: Scalar = 0.0  # integral of the force on the wall
    piston_impulse: Scalar = 0.0  # integral of the force of the piston
    dissipated: Scalar = 0.0  # energy lost by damping


def simulate(
    scene: Scene,
    legs: Sequence[Leg],
    walker: Walker,
    recorder: Recorder | None = None,
    dtype: type[np.floating[Any]] = np.float64,
    leave_behind: bool = False,
    window: bool = True,
    deadline: Deadline | None = None,
    start: FloatArray | None = None,
) -> Simulation:
    """Integrate a scene once, on given legs [s, N], with the compiled kernels.

    ``dtype`` is float64 or float32. With ``leave_behind`` granules that cannot change any peak are
    dropped, in scenes where this is certain; with ``window`` granules that the wave has not reached
    are not computed. The default deadline is an hour from now. ``start`` has displacement and
    velocity in natural units, shape (2, granules); by default the chain is at rest. Raises
    StepUnstable if the motion diverges, TooExpensive if the run would take, or has taken, too long.
    """
    from hertzchain.engines.native import kernels

    assert scene.contact is None  # damped contacts: see damped_runs
    granules = scene.chain.granules
    leave_behind = leave_behind and start is None and can_leave_behind(scene)
    deadline = deadline or Deadline(TIME_LIMIT)
    rows = leg_rows(walker.cut(legs), scene.units)
    work = float(np.sum(rows[:, 2])) * (walker.stepper.stages * granules + _STEP_IN_EVALUATIONS)
    if _FASTEST * work > deadline.limit:
        least = [_least_time(scene, rows, walker.stepper.stages, left) for left in (False, True)]
        can_leave = not leave_behind and recorder is None and start is None
        is_cheaper = can_leave and can_leave_behind(scene) and least[True] < deadline.limit
        deadline.refuse(least[leave_behind], _PEAKS_ALONE if is_cheaper else "")
    if deadline.left <= 0:
        raise deadline.passed()
    arrays = 2 if leave_behind else 8 + (0 if recorder is None else 3 * recorder.time.size)
    refuse_memory(8.0 * arrays * granules)
    contacts = granules - 1 if scene.wall is None else granules
    force, time = np.zeros(contacts), np.full(contacts, np.nan)
    record = _nothing_recorded()
    if recorder is not None:
        times = np.asarray(recorder.time, np.float64)
        record = kernels.Record(
            times,
            np.zeros((times.size, granules)),
            np.zeros((times.size, granules)),
            np.zeros(recorder.contact_force.shape),
        )
    control = np.zeros(3)

    terms = terms_of(scene)
    # The front of a wave moves granules smoothly, but not across a gap or under a static load.
    has_front = window and start is None and terms.gap is None
    moving = _MOVING if has_front else granules
    own = start_of(scene)
    start = own if start is None else start + own if own.size else start
    # An opening contact costs in proportion to stiffness over mass.
    tolerance = walker.tolerance * (1.0 if scene.is_plain else _softest(scene))

    def run() -> Any:
        return kernels.march(
            rows, table(walker.stepper), np.zeros(0, dtype), walker.stepper.order == 2,
            tolerance, walker.starting, granules, start, terms, moving, leave_behind, force, time,
            record, control,
        )  # fmt: skip

    is_long = work >= _LONG_RUN
    if not is_long:
        control[0] = _LOOKS
        outcome, displacement, velocity = run()
        # Steps may be halved so often that a short run becomes long.
        is_long = outcome.status == kernels.STOPPED
    if is_long:
        control[:], force[:], time[:] = 0.0, 0.0, np.nan
        outcome, displacement, velocity = stoppable(run, control, deadline)
    if outcome.status == kernels.DIVERGED:
        raise diverged("native")
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
        wall_impulse=outcome.wall_impulse,
        piston_impulse=outcome.piston_impulse,
    )


def _least_time(scene: Scene, rows: FloatArray, stages: int, leave_behind: bool) -> float:
    """Lower bound of the time of a run [s]: granules that must move, times steps and stages.

    While the force acts no granule is dropped, and the front moves along the chain with at least
    half the speed of a wave as strong as the shock (measured). Under a pulse table, which may push
    late and little, only the first granule is certain to move. After a striker the run may end at
    any time if granules are dropped.
    """
    granules = scene.chain.granules
    single = scene.is_plain and isinstance(scene.shock, Pulse)
    speed = 0.4 * math.pow(force_scale(scene.momentum_ratio), 1 / 6)
    evaluations = 0.0
    for row in rows:
        start, end, steps, shape = row[:4]
        moving = min(float(granules), speed * (start + end) / 2) if single else 1.0
        if leave_behind and not single:
            moving = 0.0
        elif shape == 0 and leave_behind:
            # The run continues only until the front has reached the end.
            steps *= max(0.0, min(1.0, (granules / _FASTEST_FRONT - start) / (end - start)))
            moving = 1.0
        evaluations += steps * stages * moving
    return _FASTEST * evaluations


def can_leave_behind(scene: Scene) -> bool:
    """Return whether granules behind the wave may be dropped: only after a single push.

    After a second push a broad packet can break up into waves stronger than any before. A push is a
    pulse, or a striker of any size. Different granules, gaps and walls reflect waves.
    """
    single = isinstance(scene.shock, Pulse) and scene.is_plain
    return single or scene.terms == ("striker",)


def terms_of(scene: Scene) -> Terms:
    """Return the terms of a scene for the kernels, in natural units; None for absent ones."""
    from hertzchain.engines.native import kernels

    if scene.is_plain:
        return kernels.PLAIN
    granules, units, size = scene.granules, scene.units, scene.chain.granules
    mass_unit = units.force * units.time**2 / units.length
    stiffness = np.ones(size)  # the last stays 1 at a free end, which is never pressed
    stiffness[: granules.stiffness.size] = granules.stiffness * (units.length**1.5 / units.force)
    opening = granules.gap - granules.static_overlap
    gap = np.zeros(size)
    gap[: opening.size] = opening / units.length
    return kernels.Terms(
        stiffness,
        mass_unit / granules.mass,
        None if not opening.any() else gap,
        None
        if not granules.constant_force.any()
        else granules.constant_force / granules.mass * (units.time**2 / units.length),
    )


def _softest(scene: Scene) -> float:
    """Return stiffness over mass of the first contact, divided by the largest of all contacts."""
    ratio = scene.granules.stiffness / scene.granules.contact_mass
    return float(ratio[0] / np.max(ratio))


def start_of(scene: Scene) -> FloatArray:
    """Displacement and velocity at the start, natural units, shape (2, N); (0, 0) at rest."""
    if scene.striker is None and scene.piston is None:
        return np.zeros((0, 0))
    start = np.zeros((2, scene.chain.granules))
    start[1, 0] = scene.start_velocity / scene.units.velocity
    return start


def stoppable(run: Callable[[], Any], control: FloatArray, deadline: Deadline) -> Any:
    """Run long compiled work in a thread, so that an interrupt or the deadline stops it.

    ``run`` releases the interpreter lock; -1 as the first entry of ``control`` ends it. Raises
    TooExpensive if the work is not done by the deadline.
    """
    found: list[Any] = []
    failed: list[BaseException] = []

    def work() -> None:
        try:
            found.append(run())
        except BaseException as problem:  # raised again below
            failed.append(problem)

    thread = threading.Thread(target=work)
    try:
        thread.start()
        _wait(thread, deadline)
    except BaseException:
        control[0] = -1
        if thread.is_alive():  # a thread that is about to start ends right after its start
            thread.join()
        raise
    if failed:
        raise failed[0]
    return found[0]


def _wait(thread: threading.Thread, deadline: Deadline) -> None:
    """Wait for a thread, in a function of its own.

    The jump back of a ``while`` is outside the ``try`` around it on Python 3.13, so a signal that
    arrives there would leave the work running.
    """
    while thread.is_alive():
        thread.join(max(0.0, min(0.1, deadline.left)))
        if deadline.left <= 0 and thread.is_alive():
            raise deadline.passed()


_CODES = {"linear": 1, "cosine": 2, "quarter-sine": 2, "quarter-cosine": 2}


def code_of(shape: str) -> int:
    """Return the kernels' number of a shape of ramps; RunFailed for an unknown shape."""
    if shape not in _CODES:
        raise RunFailed(f"the kernels have no formula for a ramp of shape {shape}")
    return _CODES[shape]


def leg_rows(legs: Sequence[Leg], units: NaturalUnits) -> FloatArray:
    """Return legs [s, N] for the kernels, in natural units, shape (legs, 8).

    A quarter of a sine is half of a cosine ramp, whose other half no leg reaches.
    """
    rows = []
    for leg in legs:
        row = [leg.start / units.time, leg.end / units.time, leg.steps, 0.0, 0.0, 0.0, 0.0, 0.0]
        if leg.ramp is not None:
            ramp = leg.ramp
            start, end = ramp.start / units.time, ramp.end / units.time
            first, last = ramp.start_force / units.force, ramp.end_force / units.force
            if ramp.shape == "quarter-sine":
                start, first = 2 * start - end, 2 * first - last
            elif ramp.shape == "quarter-cosine":
                end, last = 2 * end - start, 2 * last - first
            row[3:8] = code_of(ramp.shape), start, end, first, last
        if leg.stroke is not None:
            row[6] = leg.stroke.displacement_at(leg.start) / units.length
            row[7] = leg.stroke.velocity / units.velocity
        rows.append(row)
    return np.array(rows, np.float64)


@functools.cache
def _nothing_recorded() -> Record:
    from hertzchain.engines.native import kernels

    nothing = np.zeros((0, 0))
    return kernels.Record(np.zeros(0), nothing, nothing, nothing)


@functools.cache
def table(stepper: Stepper) -> Table:
    """Return the coefficients of a method for the kernels."""
    from hertzchain.engines.native import kernels

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
