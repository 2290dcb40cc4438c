"""Integrations of a scene by the compiled kernels: by given steps, and by adaptive ones."""

from __future__ import annotations

import functools
import math
import threading
from collections.abc import Callable, Sequence
from contextvars import copy_context
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.native.equations import WINDOW, Chain
from hertzchain.engines.native.plan import SymplecticNystrom, Walker, round_off
from hertzchain.errors import RunFailed, TooExpensive
from hertzchain.limits import TIME_LIMIT, Deadline, refuse_memory
from hertzchain.observables.error_bound import SAFETIES, ContactErrors, Peaks, diverged
from hertzchain.observables.first_pulse import LATEST, Signals, finds_end, pulses_in, usual_end
from hertzchain.observables.samples import Recorder
from hertzchain.scene.chain import NaturalUnits, force_scale
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg
from hertzchain.scene.shocks import SHAPES

if TYPE_CHECKING:
    from hertzchain.engines.native.damped_kernel import Method
    from hertzchain.engines.native.elastic_chain import Outcome, Record, Steps
    from hertzchain.observables.observer import Watch


def is_single_pulse(scene: Scene) -> bool:
    """Return whether a scene is one of the paper's: a plain chain and a pulse.

    Of such scenes granules behind the wave may be dropped: see ``elastic.left_behind``.
    """
    return scene.pulse is not None and scene.is_plain


def softest(scene: Scene) -> float:
    """Return stiffness over mass of contact 2, divided by the largest of all contacts."""
    ratio = scene.granules.stiffness / scene.granules.contact_mass
    return float(ratio[scene.unit_contact] / np.max(ratio))


def start_of(scene: Scene, added: FloatArray | None = None) -> FloatArray:
    """Displacement and velocity at the start, with those added, natural units, shape (2, N)."""
    start = np.zeros((2, scene.bodies))
    if scene.striker is not None or scene.moves:
        start[1] = scene.granules.velocity / scene.units.velocity
    return start if added is None else start + added


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
    rows = np.zeros((len(legs), 8))
    for row, in_si in zip(rows, legs, strict=True):
        leg = in_si.in_units(units.time, units.force, units.length)
        row[:3] = leg.start, leg.end, leg.steps
        if (ramp := leg.ramp) is not None:
            low, high = SHAPES[ramp.shape].part
            start = (ramp.start - low * ramp.end) / (1 - low)
            end = (ramp.end - (1 - high) * start) / high
            first = (ramp.start_force - low * ramp.end_force) / (1 - low)
            last = (ramp.end_force - (1 - high) * first) / high
            row[3:] = code_of(ramp.shape), start, end, first, last
        if in_si.stroke is not None:
            row[6] = in_si.stroke.displacement_at(in_si.start) / units.length
            row[7] = in_si.stroke.velocity / units.velocity
    return rows


def steps_of(rows: FloatArray, walker: Walker, least: float = 1.0) -> Steps:
    """Return the steps of a walker on legs from ``leg_rows``.

    An opening contact costs in proportion to stiffness over mass; ``least`` comes from ``softest``.
    """
    from hertzchain.engines.native.elastic_chain import Steps

    stepper = walker.stepper
    assert isinstance(stepper, SymplecticNystrom)  # NumPy integrates with other methods
    return Steps(
        rows, np.array(stepper.kicks), np.array(stepper.drifts), stepper.order == 2,
        walker.tolerance * least, walker.starting,
    )  # fmt: skip


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
"""Least work of a long run, in force evaluations of a granule: about 0.01 s."""

_STEP_IN_EVALUATIONS = 500
"""Additional cost of a step, in force evaluations of a granule."""


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
    start: FloatArray  # displacement and velocity at the start, (2, N)
    moving: int  # number of granules that may move at the start
    softest: float  # see ``softest``
    signals: Signals | None = None  # where first pulses are wanted

    @classmethod
    def of(
        cls, scene: Scene, deadline: Deadline, start: FloatArray | None = None, first: bool = False
    ) -> Prepared:
        """Prepare a scene; ``first``: first pulses are wanted. For the others see ``simulate``."""
        assert scene.contact is None  # damped contacts: see simulate_damped
        chain = Chain.of(scene).padded() if first or not scene.is_plain else None
        # The front of a wave moves granules smoothly, but not across a gap or under a static load.
        has_front = start is None and (chain is None or not chain.gap.any())
        has_front = has_front and not scene.moves and scene.pushed == 0
        return cls(
            scene, deadline, start is None, chain,
            start_of(scene, start),
            WINDOW if has_front else scene.bodies, 1.0 if chain is None else softest(scene),
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
        if leave_behind:
            # It may be over once the front has reached the end, with the speed of a wave of height
            # 3 at most, 1.1 granules in a natural time unit; heights up to 2.2 were measured.
            share = min(1.0, granules / (1.1 * float(rows[-1, 1])))
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
        # A granule and force evaluation take 0.5 ns on a fast machine; 1.1 to 2 ns were measured.
        alone = least = 0.5e-9 * stages * float(np.sum(rows[:, 2]))  # one granule moves
        if single and not leave_behind:
            # The front has at least half the speed of a wave as strong as the shock (measured).
            reached = 0.4 * math.pow(force_scale(scene.momentum_ratio), 1 / 6) * rows[-1, 1]
            least *= max(1.0, min(scene.bodies, reached) / 2)
        if least > deadline.limit:
            advice = "; peaks alone take less: Native(peaks_only=True), or hertzchain run"
            is_enough = single and not leave_behind and recorder is None and alone < deadline.limit
            deadline.refuse(least, advice if is_enough else "")
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
        control[0] = 10.0  # checks, a million steps of a granule each: 0.1 s
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


# ---- Adaptive steps, for scenes beyond the uniform chain

_LONGEST = 0.8
"""Longest adaptive step, natural time units of the fastest contact."""

_LOOSEST_TOLERANCE, _TIGHTEST_TOLERANCE = 2e-5, 7e-13
"""Tolerances of adaptive steps: a thousandth of the wanted accuracy is enough above; below is
round-off."""

_SLOWEST = 1e-3
"""Speed below which errors are no longer judged by the largest speed, natural units (chosen)."""

_STABLE = 4.0
"""Longest step times the rate at which dampers stop motions. At 5 the method leaves 0.06 of such a
motion, at 6 half, and above 6.4 it makes it grow (derived from its coefficients). With longer steps
errors grow to the tolerance, and modes change to and fro."""


class TooMuchWork(RunFailed):
    """A run takes more work than allowed, or its steps do not advance."""


class Adaptive(NamedTuple):
    """Limits of adaptive steps, natural units.

    ``tolerance`` is the error of the velocities in a step over the largest velocity. Steps may be
    ``longer``, at most 1.5 times, than ``longest``, also those that strong dampers allow. The run
    ends after ``most_work`` force evaluations of a granule; a step counts as further 500.
    """

    tolerance: float
    longest: float
    longer: float = 1.0
    most_work: float = math.inf


def integrate_damped(
    chain: Chain, rows: FloatArray, start: FloatArray | None, steps: Adaptive,
    record: Record | None = None, control: FloatArray | None = None, watch: Watch | None = None,
    usual: float = math.nan,
) -> Simulation:  # fmt: skip
    """Integrate a chain of damped contacts with the compiled kernel.

    ``rows`` are legs of the applied force from ``simulation.leg_rows``; ``start`` is displacement
    and velocity, shape (2, granules), or None for a chain at rest. Record, control, watch and
    usual are as for ``elastic.march``.
    """
    from hertzchain.engines.native import damped_kernel
    from hertzchain.engines.native.damped_kernel import Steps, at_the_start
    from hertzchain.engines.native.elastic_chain import Seen, Start

    granules, contacts = chain.inverse_mass.size, chain.stiffness.size
    record = room_for() if record is None else record
    # The front of a wave moves granules smoothly, but not across a gap or under a static load.
    has_front = start is None and not chain.gap.any() and not chain.constant.any()
    has_front = has_front and chain.pushed == 0
    force, time = np.zeros(contacts), np.full(contacts, np.nan)
    method = _method()
    state = at_the_start(granules, method.nodes.size)
    outcome = damped_kernel.march(
        Steps(
            rows, method, steps.tolerance, _SLOWEST, steps.longer * steps.longest,
            steps.longer * _STABLE, steps.most_work,
        ),
        chain.padded(),
        Start(
            np.zeros((2, granules)) if start is None else start, WINDOW if has_front else granules
        ),
        state, Seen(force, time, record), watch, usual,
        np.zeros(3) if control is None else control,
    )  # fmt: skip
    peaks = Peaks(force, time, time < outcome.end)
    return Simulation.of(outcome, state.start.u[:granules], state.start.v[:granules], peaks)


@functools.cache
def _method() -> Method:
    """Return the coefficients of DOP853 in the form of the kernel."""
    from scipy.integrate import DOP853

    from hertzchain.engines.native.damped_kernel import Method

    rows = np.concatenate([DOP853.A, [DOP853.B]])
    squares = rows @ rows[:-1]
    squares[abs(squares) < 1e-14] = 0.0  # up to round-off; all others are far above
    return Method(np.array(DOP853.C), rows, squares, DOP853.E5[:-1], DOP853.E3[:-1])


def simulate_damped(
    scene: Scene, tolerance: float, deadline: Deadline, recorder: Recorder | None = None,
    longer: float = 1.0, most_work: float = math.inf, first: bool = False,
) -> Simulation:  # fmt: skip
    """Integrate a scene once; ``first``: first pulses are wanted, and the end if it is not given.

    With ``longer`` steps may be longer by that factor. Raises StepUnstable if the motion diverges,
    TooExpensive if the run has taken too long, TooMuchWork after ``most_work`` force evaluations of
    a granule.
    """
    from hertzchain.engines.native import elastic_chain

    if deadline.left <= 0:
        raise deadline.passed()
    recorded = 0 if recorder is None else 3 * recorder.time.size
    try:
        refuse_memory(8.0 * scene.bodies * (51 + recorded))  # numbers for each granule
    except TooExpensive as problem:
        if most_work < math.inf:  # another method takes less
            raise TooMuchWork(str(problem)) from problem
        raise
    units, usual, end_time = scene.units, math.nan, scene.end_time
    if first and finds_end(scene):
        usual, end_time = usual_end(scene), LATEST * end_time
    # Steps are cut by the integrator: of the legs only the corners count.
    rows = leg_rows(scene.until(end_time).schedule(end_time), units)
    signals = Signals.of(scene).in_units(units) if first else None
    record, control = room_for(recorder), np.zeros(3)
    steps = Adaptive(tolerance, _LONGEST * scene.contact_time / units.time, longer, most_work)
    is_at_rest = scene.striker is None and scene.piston is None and not scene.moves
    chain, start = Chain.of(scene), None if is_at_rest else start_of(scene)

    def integrate() -> tuple[Simulation, Watch | None]:
        watch = None if signals is None else signals.watch()
        return integrate_damped(chain, rows, start, steps, record, control, watch, usual), watch

    run = finished(integrate, control, deadline)
    if run.status == elastic_chain.STUCK:
        raise TooMuchWork(
            "the native run does not advance: a contact opens and closes within"
            " rounding errors; ask for less accuracy, or for a shorter end_time"
        )
    if run.status == elastic_chain.TOO_MUCH:
        raise TooMuchWork("the native run takes more work than it may")
    return run


Integrate = Callable[[float, float, bool], Simulation]


def first_tolerance(rtol: float) -> float:
    """Tolerance that is tried first for a wanted accuracy of the peaks.

    In 19 of 20 random chains no second is needed.
    """
    return max(min(0.02 * rtol, _LOOSEST_TOLERANCE), _TIGHTEST_TOLERANCE)


def accurate(integrate: Integrate, rtol: float) -> tuple[Simulation, ContactErrors]:
    """Return a run whose bounds of errors are at most ``rtol``, in a few tries, and these bounds.

    ``integrate`` makes a run from a tolerance, a factor for the longest step, and whether this run
    may be the result or only gives the error of another. The bound of the returned run may be
    larger: collisions can multiply rounding errors.
    """
    tolerance = first_tolerance(rtol)
    for left in reversed(range(5)):  # the most tolerances that are tried
        # One difference may be small by chance, but seldom both.
        rough, coarse = (
            integrate(looser * tolerance, longer, False)
            for looser, longer in ((30.0, 1.5), (4.0, 1.2))
        )
        run = integrate(tolerance, 1.0, True)
        differences = [run.peaks.differences(other.peaks) for other in (rough, coarse)]
        # What no difference shows: 1.5e-11 once, with the tightest tolerance
        rest = 2.5 * tolerance + 2e-11 + round_off(run.evaluations)
        # The difference from the much coarser run is ten times as large where errors go as the
        # tolerance.
        errors = SAFETIES["adaptive"].bounds(differences, (0.15, 1.0), rest)
        bound = errors.wanted
        if bound <= rtol or tolerance <= _TIGHTEST_TOLERANCE or not left:
            break
        tolerance = max(tolerance * max(0.5 * rtol / bound, 1e-3), _TIGHTEST_TOLERANCE)
    return run, errors


def accurate_by_events(
    scene: Scene, rtol: float, deadline: Deadline, recorder: Recorder | None = None,
    most_work: float = math.inf, first: bool = False,
) -> Run:  # fmt: skip
    """Return a run of the wanted accuracy, if it can be reached.

    The recorder has the history of that run, which is always the last. Raises TooMuchWork if the
    first and coarsest run takes more than ``most_work`` force evaluations of a granule, or another
    one more than five times as many.
    """
    allowed = iter((most_work,))

    def integrate(tolerance: float, longer: float, may_be_last: bool) -> Simulation:
        nonlocal scene
        kept, most = recorder if may_be_last else None, next(allowed, 5 * most_work)
        run = simulate_damped(
            scene, tolerance, deadline, kept, longer=longer, most_work=most, first=first
        )
        if first and finds_end(scene):
            scene = scene.until(run.end * scene.units.time)
        return run

    return Run("dop853", _LONGEST * scene.contact_time, *accurate(integrate, rtol))
