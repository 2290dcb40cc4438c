"""One integration of a scene by the compiled kernels."""

from __future__ import annotations

import functools
import math
import threading
from collections.abc import Callable, Sequence
from contextvars import copy_context
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.native.equations import Chain
from hertzchain.engines.native.plan import SymplecticNystrom, Walker
from hertzchain.errors import RunFailed
from hertzchain.limits import TIME_LIMIT, Deadline, refuse_memory
from hertzchain.observables.error_bound import ContactErrors, Peaks, diverged
from hertzchain.observables.first_pulse import LATEST, Signals, pulses_in
from hertzchain.observables.samples import Recorder
from hertzchain.scene.chain import NaturalUnits, force_scale
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg
from hertzchain.scene.shocks import SHAPES

if TYPE_CHECKING:
    from hertzchain.engines.native.elastic_chain import Outcome, Record, Steps
    from hertzchain.observables.observer import Watch

MOVING = 8
"""Number of granules in the window at the start of a run."""


def is_single_pulse(scene: Scene) -> bool:
    """Return whether a scene is one of the paper's: a plain chain and a pulse.

    Of such scenes granules behind the wave may be dropped: see ``elastic.left_behind``.
    """
    return scene.pulse is not None and scene.is_plain


def softest(scene: Scene) -> float:
    """Return stiffness over mass of contact 2, divided by the largest of all contacts."""
    ratio = scene.granules.stiffness / scene.granules.contact_mass
    return float(ratio[scene.unit_contact] / np.max(ratio))


def start_of(scene: Scene) -> FloatArray:
    """Displacement and velocity at the start, natural units, shape (2, N); (0, 0) at rest."""
    if scene.striker is None and scene.piston is None and not scene.moves:
        return np.zeros((0, 0))
    start = np.zeros((2, scene.bodies))
    start[1] = scene.granules.velocity / scene.units.velocity
    return start


def code_of(shape: str) -> int:
    """Return the kernels' number of a shape of ramps; RunFailed for a shape without one."""
    code = SHAPES[shape].code
    if code is None:
        raise RunFailed(f"the kernels have no formula for a ramp of shape {shape}")
    return code


def leg_rows(legs: Sequence[Leg], units: NaturalUnits) -> FloatArray:
    """Return legs [s, N] for the kernels, in natural units, shape (legs, 8).

    A quarter of a sine is one half of a cosine ramp; no leg reaches the other half, which has half
    of the growth.
    """
    rows = []
    for leg in legs:
        row = [leg.start / units.time, leg.end / units.time, leg.steps, 0.0, 0.0, 0.0, 0.0, 0.0]
        if leg.ramp is not None:
            ramp = leg.ramp
            start, end = ramp.start / units.time, ramp.end / units.time
            first, last = ramp.start_force / units.force, ramp.end_force / units.force
            low, high = SHAPES[ramp.shape].part
            start, end = (start - low * end) / (1 - low), (end - (1 - high) * start) / high
            first, last = (first - low * last) / (1 - low), (last - (1 - high) * first) / high
            row[3:8] = code_of(ramp.shape), start, end, first, last
        if leg.stroke is not None:
            row[6] = leg.stroke.displacement_at(leg.start) / units.length
            row[7] = leg.stroke.velocity / units.velocity
        rows.append(row)
    return np.array(rows, np.float64)


@functools.cache
def _coefficients(stepper: SymplecticNystrom) -> tuple[FloatArray, FloatArray]:
    """Return the kicks and the drifts of a method for the kernels."""
    return np.array(stepper.kicks), np.array(stepper.drifts)


def steps_of(rows: FloatArray, walker: Walker, least: float = 1.0) -> Steps:
    """Return the steps of a walker on legs from ``leg_rows``.

    An opening contact costs in proportion to stiffness over mass; ``least`` comes from ``softest``.
    """
    from hertzchain.engines.native.elastic_chain import Steps

    stepper = walker.stepper
    assert isinstance(stepper, SymplecticNystrom)  # NumPy integrates with other methods
    is_verlet, tolerance = stepper.order == 2, walker.tolerance * least
    return Steps(rows, *_coefficients(stepper), is_verlet, tolerance, walker.starting)


@functools.cache
def _nothing_recorded() -> Record:
    return room_for(Recorder(np.zeros(0), 0, wall=True))


def room_for(recorder: Recorder | None = None) -> Record:
    """Return the arrays of a recorder for a history, all zero; empty ones without a recorder."""
    if recorder is None:
        return _nothing_recorded()
    from hertzchain.engines.native.elastic_chain import Record

    arrays = recorder.displacement, recorder.velocity, recorder.contact_force
    for values in arrays:
        values[:] = 0.0
    return Record(np.asarray(recorder.time, np.float64), *arrays)


LONG_RUN = 1e7
"""Granules times force evaluations of a short run: about 0.01 s."""

_STEP_IN_EVALUATIONS = 500
"""Additional cost of a step, in force evaluations of a granule."""

LOOKS = 10.0
"""Number of checks, each after a million steps times granules, after which a run is long: 0.1 s."""

_PEAKS_ALONE = "; peaks alone take less: Native(peaks_only=True), or hertzchain run"

_FASTEST = 0.5e-9
"""Time of a granule and force evaluation on a fast machine [s]; measured 1.1e-9 to 2e-9."""

_FASTEST_FRONT = 1.1
"""Upper bound of the speed of a front [granules per natural time unit] (chosen): that of a wave of
height 3; heights up to 2.2 were measured.
"""


@dataclass(frozen=True, eq=False)
class Simulation:
    """Results of one integration, in natural units."""

    displacement: Any  # at the end, shape (granules,); NaN where granules were dropped
    velocity: Any
    peaks: Peaks
    work: float  # work of the applied force or the piston, plus the energy at the start
    momentum: float  # of all granules except a piston at the end
    energy: float  # of the same granules at the end, with that of constant forces
    steps: int
    evaluations: int  # evaluations of the force; compiled runs include refused steps
    wall_impulse: float = 0.0  # integral of the force on the wall
    piston_impulse: float = 0.0  # integral of the force of the piston
    dissipated: float = 0.0  # energy lost by damping
    end: float = math.nan  # time reached; NaN where it is the end that was given
    status: int = 0  # of compiled runs: ``elastic_chain.DONE`` or one of the next constants there

    @classmethod
    def of(cls, outcome: Outcome, displacement: Any, velocity: Any, peaks: Peaks) -> Simulation:
        """Return the results of a compiled run."""
        numbers = outcome._asdict()
        del numbers["granule_evaluations"]
        return cls(displacement, velocity, peaks, **numbers)


@dataclass(frozen=True, eq=False)
class Run:
    """A simulation, how it was made, and bounds of its errors, natural units."""

    method: str
    longest_step: float  # [s]
    simulation: Simulation
    errors: ContactErrors


def simulate(
    scene: Scene, legs: Sequence[Leg], walker: Walker, recorder: Recorder | None = None,
    leave_behind: bool = False, deadline: Deadline | None = None, start: FloatArray | None = None,
) -> Simulation:  # fmt: skip
    """Integrate a scene once, on given legs [s, N], with the compiled kernels.

    With ``leave_behind`` granules that cannot change any peak are dropped, in scenes where this is
    certain. The default deadline is an hour from now. ``start`` has displacement and velocity in
    natural units, shape (2, granules); by default the chain is at rest. Raises StepUnstable if the
    motion diverges, TooExpensive if the run would take, or has taken, too long.
    """
    prepared = Prepared.of(scene, deadline or Deadline(TIME_LIMIT), start)
    return prepared.simulate(walker.cut(legs), walker, recorder, leave_behind)


@dataclass(frozen=True, eq=False)
class Prepared:
    """A scene in the form that the kernels take, for one run or several, on legs cut already."""

    scene: Scene
    deadline: Deadline
    own_start: bool  # whether the chain starts in its scene's own state
    chain: Chain | None  # None for a plain scene
    start: FloatArray  # displacement and velocity at the start, (2, N); (0, 0) at rest
    moving: int  # number of granules that may move at the start
    softest: float  # see ``softest``
    signals: Signals | None = None  # where first pulses are wanted

    @classmethod
    def of(
        cls, scene: Scene, deadline: Deadline, start: FloatArray | None = None, first: bool = False
    ) -> Prepared:
        """Prepare a scene; ``first``: first pulses are wanted. For the others see ``simulate``."""
        assert scene.contact is None  # damped contacts: see damped_runs
        initial = start_of(scene)
        chain = Chain.of(scene).padded() if first or not scene.is_plain else None
        # The front of a wave moves granules smoothly, but not across a gap or under a static load.
        has_front = start is None and (chain is None or not chain.gap.any())
        has_front = has_front and not scene.moves and scene.pushed == 0
        return cls(
            scene, deadline, start is None, chain,
            initial if start is None else start + initial if initial.size else start,
            MOVING if has_front else scene.bodies, 1.0 if chain is None else softest(scene),
            Signals.of(scene).in_units(scene.units) if first else None,
        )  # fmt: skip

    def simulate(
        self, legs: Sequence[Leg], walker: Walker, recorder: Recorder | None = None,
        leave_behind: bool = False, usual: float = math.nan,
    ) -> Simulation:  # fmt: skip
        """Integrate the scene once: see the function ``simulate``.

        With ``usual``, a time in natural units, the run finds its end itself, on legs that go on
        until the latest possible one: see ``elastic.march``.
        """
        from hertzchain.engines.native import elastic, elastic_chain

        # A first pulse may not be over when peaks are.
        may_leave = self.own_start and self.signals is None and is_single_pulse(self.scene)
        leave_behind = leave_behind and may_leave
        granules, contacts = self.scene.bodies, len(self.scene.contacts)
        stages, rows = walker.stepper.stages, leg_rows(legs, self.scene.units)
        work = work_of(self.scene, legs, stages) / (1.0 if math.isnan(usual) else LATEST)
        share = 1.0 if math.isnan(usual) else 1.0 / LATEST
        if leave_behind:  # it may be over once the front has reached the end
            share = min(1.0, granules / (_FASTEST_FRONT * float(rows[-1, 1])))
        self._refuse(rows, share * stages, leave_behind, recorder)
        record, steps = room_for(recorder), steps_of(rows, walker, self.softest)
        control = np.zeros(3)

        def run() -> tuple[Simulation, Watch | None]:
            force, time = np.zeros(contacts), np.full(contacts, np.nan)
            watch = None if self.signals is None else self.signals.watch()
            state = elastic_chain.at_the_start(granules)
            outcome = elastic.march(
                steps, self.chain, elastic_chain.Start(self.start, self.moving), state,
                elastic_chain.Seen(force, time, record), watch,
                elastic_chain.Ending(usual, leave_behind), control,
            )  # fmt: skip
            # A copy, so that the memory of the run is freed.
            u, v = state.rows[:2, :granules].copy()
            if leave_behind:
                u[:] = v[:] = np.nan
            return Simulation.of(outcome, u, v, Peaks(force, time, time < outcome.end)), watch

        return finished(run, control, self.deadline, work >= LONG_RUN)

    def _refuse(
        self, rows: FloatArray, stages: float, leave_behind: bool, recorder: Recorder | None
    ) -> None:
        """Raise TooExpensive for a run that is certain to take too long, or too much memory.

        ``stages`` are evaluations a step, times the share of the steps that are certain.
        """
        scene, deadline, single = self.scene, self.deadline, is_single_pulse(self.scene)
        alone = least = _FASTEST * stages * float(np.sum(rows[:, 2]))  # one granule moves
        if single and not leave_behind:
            # The front has at least half the speed of a wave as strong as the shock (measured).
            reached = 0.4 * math.pow(force_scale(scene.momentum_ratio), 1 / 6) * rows[-1, 1]
            least *= max(1.0, min(scene.bodies, reached) / 2)
        if least > deadline.limit:
            is_cheaper = single and not leave_behind and recorder is None and self.own_start
            is_cheaper = is_cheaper and alone < deadline.limit
            deadline.refuse(least, _PEAKS_ALONE if is_cheaper else "")
        if deadline.left <= 0:
            raise deadline.passed()
        arrays = 8 + (0 if recorder is None else 3 * recorder.time.size)
        refuse_memory(8.0 * arrays * scene.bodies)


def work_of(scene: Scene, legs: Sequence[Leg], stages: int) -> float:
    """Force evaluations of a granule in a run without refinement, at most."""
    steps = float(sum(leg.steps for leg in legs))
    return steps * (stages * scene.bodies + _STEP_IN_EVALUATIONS)


def finished(
    run: Callable[[], tuple[Simulation, Watch | None]], control: FloatArray, deadline: Deadline,
    is_long: bool = False,
) -> Simulation:  # fmt: skip
    """Return the records of a compiled run, with its first pulses; a long one can be stopped.

    A run that becomes long, as with many halved steps, begins again. Raises StepUnstable if the
    motion diverges.
    """
    from hertzchain.engines.native import elastic_chain

    if not is_long:
        control[0] = LOOKS
        simulation, watch = run()
        is_long = simulation.status == elastic_chain.STOPPED
    if is_long:
        control[:] = 0.0
        simulation, watch = stoppable(run, control, deadline)
    if simulation.status == elastic_chain.DIVERGED:
        raise diverged("native")
    if watch is None:
        return simulation
    return replace(simulation, peaks=replace(simulation.peaks, first=pulses_in(watch)))


def stoppable(run: Callable[[], Any], control: FloatArray, deadline: Deadline) -> Any:
    """Run long compiled work in a thread, so that an interrupt or the deadline stops it.

    ``run`` releases the interpreter lock; -1 as the first entry of ``control`` ends it. Raises
    TooExpensive if the work is not done by the deadline.
    """
    results: list[Any] = []
    failed: list[BaseException] = []
    # On Python 3.11 an interrupted join makes a thread seem dead that is not.
    done = threading.Event()

    def work() -> None:
        try:
            results.append(run())
        except BaseException as problem:  # raised again below
            failed.append(problem)
        finally:
            done.set()

    thread = threading.Thread(target=copy_context().run, args=(work,))
    try:
        thread.start()
        _wait(done, deadline)
    except BaseException:
        control[0] = -1
        if thread.ident is not None:  # a thread that is about to start ends right after its start
            done.wait()
        raise
    if failed:
        raise failed[0]
    return results[0]


def _wait(done: threading.Event, deadline: Deadline) -> None:
    """Wait for a thread to be done, in a function of its own.

    The jump back of a ``while`` is outside the ``try`` around it on Python 3.13, so a signal that
    arrives there would leave the work running.
    """
    while not done.wait(max(0.0, min(0.1, deadline.left))):
        if deadline.left <= 0 and not done.is_set():
            raise deadline.passed()
