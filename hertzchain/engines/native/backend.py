"""The native backend: runs a scene and returns its result."""

from __future__ import annotations

import functools
import math
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from importlib.metadata import version
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from hertzchain.arrays import FloatArray
from hertzchain.engines.native import damped_runs
from hertzchain.engines.native import plan as plans
from hertzchain.engines.native.plan import METHODS, Method, Walker
from hertzchain.engines.native.simulation import Prepared, Run, Simulation, simulate, work_of
from hertzchain.errors import POSITIVE, HertzchainError, StepUnstable, is_positive, require
from hertzchain.limits import RTOL, TIGHTEST, TIME_LIMIT, Deadline, check_time_limit
from hertzchain.observables import error_bound
from hertzchain.observables.error_bound import ContactErrors
from hertzchain.observables.first_pulse import check_wanted, finds_end, usually_wanted
from hertzchain.observables.gauges import readings
from hertzchain.observables.peaks import times_of_peaks
from hertzchain.observables.result import Balance, Result
from hertzchain.observables.samples import History, Recorder, wanted_times
from hertzchain.scene.scene import (
    Scene,
    SceneLike,
    largest_overlap_ratio,
    refuse_deep_overlap,
    to_scene,
)
from hertzchain.scene.schedule import Leg

if TYPE_CHECKING:
    from hertzchain.engines.native.as_written import RungeKutta
    from hertzchain.observables.compiling import Watched


_SECOND_ACCURACY_RATIO = 1e-3
"""Accuracy of the second accurate run, which gives the error, over that of the first (chosen)."""

_REFINED_WORK_RATIO = 5.0
"""Work of refined steps, over that of equal ones, where all granules fly at others (measured: 4
to 7)."""

_ADAPTIVE_WORK, _ADAPTIVE_SHARE_OF_WORK = 1e7, 0.1
"""Work of a run, in force evaluations of a granule, above which adaptive steps are tried first:
about 10 ms (chosen). Their first run may take this share of the work: its evaluations cost four
times as much (measured). Where the first run is given up, the whole usually takes a tenth
longer."""

_LOOSER_RUN_RTOL = 1e-9
"""Accuracy below which errors of pulses are differences from a looser run, not from a tighter one
(chosen)."""

_FEW_CONTACTS = 3
"""Contacts below which a third run is made: one difference of so few may be small by chance.

In one of 3,000 random scenes, of two granules, it was 60 times too small.
"""

_LEAST_DIFFERENCE_RATIO = 10.0
"""Least ratio of a difference to the error of the accurate run (chosen)."""

_END_RTOL, _MOST_END_WORK = 1e-6, 1e9
"""Accuracy of a run for its end alone, and its largest work, in force evaluations of a granule:
half a minute on a fast machine, and the same end on any."""


@dataclass(frozen=True)
class Native:
    """Eq. 1 integrated in natural units.

    Parameters
    ----------
    method
        ``reference``, ``srkn-11b``, ``velocity-verlet`` or ``rk4``; by default the
        cheapest that gives peaks of accuracy ``rtol``. ``scipy`` integrates Eq. 1 as
        ``equations.py`` writes it by ``scipy.integrate.solve_ivp``, a hundred times more slowly;
        ``rk4``, the paper's method, is plain NumPy, too.
    dt
        The largest step [s]; the default depends on the method: peaks right to about 1e-12
        (reference), 1e-8 (rk4), 1e-6 (velocity-verlet).
    rtol
        Wanted relative accuracy of the peaks, from 1e-10 to 0.01; excludes dt and all methods but
        ``scipy``. 1e-6 by default where neither a step nor another method is given.
        Where amplified rounding errors are larger, ``error_estimate`` of the result has the
        accuracy reached.
    peaks_only
        Whether only the peaks are wanted. Then, under one of the three pulses on a uniform chain,
        granules that cannot change any peak are dropped, and displacement and velocity at the end
        are NaN.
    time_limit
        Time limit of a run [s], without compiling.
    wanted
        The forces for which ``rtol`` holds: ``all`` for the largest force of each contact in the
        whole run, ``first`` for its first pulse, before anything is reflected. With ``first`` the
        result has ``first_pulses``, and ``errors`` contact by contact; it is refused only if no
        contact has a right digit. The default is ``first`` for scenes with a striker, a wall,
        unlike granules or gauges.

    Raises
    ------
    SceneError
        For an unknown method, an impossible step or accuracy, or options that exclude each other.
    """

    name: ClassVar[str] = "native"
    """Name of the engine in options and columns, and the backend of a result."""

    method: str | None = None
    dt: float | None = None
    rtol: float | None = None
    peaks_only: bool = False
    time_limit: float = TIME_LIMIT
    wanted: str | None = None

    def __post_init__(self) -> None:
        if self.method is not None:
            methods = (*METHODS, "scipy")
            names = ", ".join(methods)
            require(self.method in methods, "method", self.method, f"must be one of {names}")
        if self.dt is not None:
            require(is_positive(self.dt), "dt", self.dt, f"{POSITIVE} [s]")
        if self.rtol is not None:
            alone = self.method in (None, "scipy") and self.dt is None
            allowed = "chooses method and step: leave out method and dt, or rtol"
            require(alone, "rtol", self.rtol, allowed)
            plans.check(self.rtol)
        if self.method == "scipy":
            allowed = "must be left out for method scipy, which drops no granules"
            require(not self.peaks_only, "peaks_only", self.peaks_only, allowed)
            allowed = "must be left out for method scipy, which chooses its own steps"
            require(self.dt is None, "dt", self.dt, allowed)
        check_wanted(self.wanted)
        check_time_limit(self.time_limit)

    def run(self, scene: SceneLike, record: ArrayLike | None = None) -> Result:
        """Simulate a scene.

        Parameters
        ----------
        scene
            What to simulate, or the path of its file.
        record
            When to keep displacement, velocity and contact force: increasing times [s] within the
            run, or a whole number of frames, equally spaced from 0 to the end; not with
            ``peaks_only``.

        Raises
        ------
        SceneError
            For anything but a scene or the path of its file, or for impossible times.
        StepUnstable
            If the given step is so long that the motion diverges.
        Unpredictable
            If the motion amplifies rounding errors until no digit is left.
        OverlapTooLarge
            If granules would be pressed into one another by more than a radius.
        TooExpensive
            If it would take, or has taken, longer than the time limit.
        """
        scene = to_scene(scene)
        native = self if self.wanted else replace(self, wanted=usually_wanted(scene))
        error_bound.refuse_strong_dampers(scene)
        import hertzchain.engines.native.elastic  # noqa: F401 - loaded before any clock starts
        from hertzchain.observables.compiling import Watched

        versions(self.method)  # looked up once, which takes longer than most runs
        with Watched() as preparation:
            return native._run(scene, record, preparation)

    def _run(self, scene: Scene, record: ArrayLike | None, preparation: Watched) -> Result:
        """Run a scene as ``run`` does; ``preparation`` measures the time to prepare kernels."""
        begin = time.perf_counter()
        deadline = Deadline(self.time_limit, lambda: preparation.time)
        chooses = self.method in (None, "scipy") and self.dt is None
        # Piston and wall: the unit of force depends on the end.
        finds = chooses and self._first and self.method is None and record is None
        if not finds or scene.piston is not None:
            scene = with_end(scene, record, self.time_limit)
        recorder = times = None
        if record is not None:
            allowed = "must not be given with peaks_only, which leaves granules behind"
            require(not self.peaks_only, "record", record, allowed)
            times = wanted_times(record, scene.end_time)
            recorder = Recorder(times / scene.units.time, scene.bodies, scene.wall is not None)
        rtol = RTOL if self.rtol is None else self.rtol
        if not chooses and scene.contact is not None and self.method != "velocity-verlet":
            names = "must be velocity-verlet or left out for damped contacts"
            require(self.method in (None, "reference"), "method", self.method, names)
            allowed = "must be left out for damped contacts, or stand with method velocity-verlet"
            require(self.dt is None, "dt", self.dt, allowed)
            chooses, rtol = True, TIGHTEST
        if chooses:
            run = self.accurate_enough(scene, recorder, deadline, rtol)
            error_bound.refuse_meaningless("native", run.errors.least, too_long=False)
        else:
            run = self._as_asked(scene, recorder, deadline)
        simulation, errors = run.simulation, run.errors
        if self._first and finds_end(scene):
            scene = scene.until(simulation.end * scene.units.time)
        units = scene.units
        peak_force = simulation.peaks.force * units.force
        refuse_deep_overlap(largest_overlap_ratio(scene, peak_force))
        peak_time = times_of_peaks(peak_force, simulation.peaks.time * units.time)
        first, history, contacts = errors.known(simulation.peaks.first), None, len(scene.contacts)
        first, errors = (
            first and first.in_units(units.force, units.time),
            errors.in_units(units.time),
        )
        if recorder is not None and times is not None:
            history = recorder.history(
                times, units.length, units.velocity, units.force, scene.first_granule
            )
        return Result(
            scene=scene,
            backend=self.name,
            method=run.method,
            dt=run.longest_step,
            steps=simulation.steps,
            force_evaluations=simulation.evaluations,
            peak_force=peak_force,
            peak_time=peak_time,
            peak_passed=simulation.peaks.passed,
            error_estimate=errors.largest,
            displacement=simulation.displacement[scene.first_granule :] * units.length,
            velocity=simulation.velocity[scene.first_granule :] * units.velocity,
            balance=Balance(
                impulse=scene.given_impulse
                + float(simulation.piston_impulse - simulation.wall_impulse) * units.momentum,
                momentum=float(simulation.momentum) * units.momentum,
                work=float(simulation.work) * units.energy,
                energy=float(simulation.energy) * units.energy,
                dissipated=float(simulation.dissipated) * units.energy,
            ),
            history=history,
            wall_time=time.perf_counter() - begin - preparation.time,
            versions=versions(self.method),
            scheme=run.method,
            compile_time=preparation.compile_time,
            first_pulses=first and first.part(slice(contacts)),
            errors=errors.of_contacts(contacts),
            gauges=readings(scene, first, errors),
            engines=self._recorded,
        )

    @functools.cached_property
    def _recorded(self) -> tuple[Native, Native]:
        """Engines of two recorded runs: this one, and one whose errors are far from its own."""
        engine = replace(self, peaks_only=False)
        is_tight = self.method == "reference" or (self.rtol or RTOL) < _LOOSER_RUN_RTOL
        rtol = 10 * _LOOSER_RUN_RTOL if is_tight else TIGHTEST
        return engine, replace(engine, method=None, dt=None, rtol=rtol)

    def _as_asked(self, scene: Scene, recorder: Recorder | None, deadline: Deadline) -> Run:
        """Return a run with the given method and step."""
        name = self.method if self.method in METHODS else "reference"
        method, is_damped = METHODS[name], scene.contact is not None
        dt = self.dt if self.dt is not None else method.step * scene.contact_time
        legs = method.walker.cut(scene.schedule(dt))
        error_bound.refuse_unstable(scene, legs, method.interval, name)
        longest = max(leg.dt for leg in legs)
        is_long = longest > error_bound.SHORT * scene.contact_time
        if is_damped:
            run = by_velocity_verlet(scene, legs, deadline, recorder, first=self._first)
        else:
            prepared = self._prepared(scene, deadline)
            run = prepared.simulate(legs, method.walker, recorder, leave_behind=self.peaks_only)
        if is_damped or (not scene.is_plain and (method.walker.stepper.order == 2 or is_long)):
            errors = self._true_errors(scene, run, deadline)
        else:
            errors = _errors_of_steps(prepared, legs, method, run)
        error_bound.refuse_meaningless("native", errors.least, is_long)
        return Run(name, longest, run, errors)

    def _prepared(self, scene: Scene, deadline: Deadline) -> Prepared | RungeKutta:
        """Return the integrator of a scene with elastic contacts: compiled, or the paper's."""
        if self.method != "rk4":
            return Prepared.of(scene, deadline, first=self._first)
        from hertzchain.engines.native.as_written import RungeKutta

        return RungeKutta(scene, deadline, self._first)

    @property
    def _first(self) -> bool:
        """Whether first pulses are wanted."""
        return self.wanted == "first"

    def _true_errors(self, scene: Scene, run: Simulation, deadline: Deadline) -> ContactErrors:
        """Return bounds of the errors of a run, from an accurate run and the errors of that.

        Runs with other steps could have the same error, for example where a later blow is the
        hardest.
        """
        for rtol in (RTOL, _SECOND_ACCURACY_RATIO * RTOL):
            accurate = self.accurate_enough(scene, None, deadline, rtol)
            differences, errors = accurate.simulation.peaks.differences(run.peaks), accurate.errors
            if differences.wanted > _LEAST_DIFFERENCE_RATIO * errors.wanted:
                break
        error_bound.refuse_meaningless("native", errors.least, too_long=False)
        return differences.plus(errors)

    def accurate_enough(
        self, scene: Scene, recorder: Recorder | None, deadline: Deadline, rtol: float
    ) -> Run:
        """Return a run by the cheapest way to ``rtol``."""
        first = self._first
        if self.method == "scipy":
            from hertzchain.engines.native.as_written import accurate_in_scipy

            return accurate_in_scipy(scene, rtol, deadline, recorder, first)
        if scene.contact is not None:
            return damped_runs.accurate_enough(scene, rtol, deadline, recorder, first=first)
        hard = error_bound.amplifies_errors(scene)
        tries = hard and first
        plan = plans.first_plan(rtol, hard, first)
        prepared = self._prepared(scene, deadline)
        before, cost, adaptive, aim = math.inf, 0.0, None, rtol
        expensive, refined = math.inf if scene.is_plain else _ADAPTIVE_WORK, 1.0
        if not scene.is_plain:
            refined += _REFINED_WORK_RATIO * float(np.mean(scene.granules.gap > 0))
        for left in reversed(range(plans.TRIES)):
            legs = plan.legs(scene)
            cost = max(cost, refined * work_of(scene, legs, plan.walker.stepper.stages))
            if cost > expensive:
                expensive = 2 * cost
                with suppress(damped_runs.TooMuchWork, StepUnstable):
                    adaptive = damped_runs.accurate_enough(
                        scene, rtol, deadline, recorder, _ADAPTIVE_SHARE_OF_WORK * cost, first
                    )
                    if adaptive.errors.wanted <= rtol:
                        return adaptive
                    expensive = math.inf
            scene, legs, run = self._once(prepared, scene, plan, recorder)
            rising = run.peaks.any_rising
            if left and rising and (tries or not hard):
                # The result of such a contact is the force at one time, not a peak.
                tries, hard, plan, before = False, True, plans.cheapest(aim, hard=True), math.inf
                continue
            twice = scene.piston is not None or (before < math.inf and not scene.is_plain)
            twice |= len(scene.contacts) < _FEW_CONTACTS
            errors = _errors_of_plan(prepared, legs, plan, run, rising or twice)
            error, cost = errors.wanted, run.evaluations * scene.bodies
            if error <= rtol or plan.hopeless(error, before, cost):
                break
            if tries:
                tries, plan = False, plans.cheapest(aim, hard=True)
                continue
            if left and (finer := max(rtol * errors.share, TIGHTEST)) < aim:
                # A weak pulse on a large static force needs as many digits more of the total.
                aim, plan, before = finer, plans.cheapest(finer, hard=hard), math.inf
                continue
            if errors.share * error <= aim:
                break
            plan, before = plan.closer(rtol, error, has_terms=not scene.is_plain), error
        if adaptive is not None and adaptive.errors.wanted < error:
            how = scene, rtol, deadline, recorder
            return damped_runs.accurate_enough(*how, first=first) if recorder else adaptive
        return Run(plan.method, max(leg.dt for leg in legs), run, errors)

    def _once(
        self, prepared: Prepared | RungeKutta, scene: Scene, plan: plans.Plan,
        recorder: Recorder | None,
    ) -> tuple[Scene, tuple[Leg, ...], Simulation]:  # fmt: skip
        """Run a scene by a plan; return it with the end of its run, its legs, and the run."""
        legs, usual = plan.first_legs(scene, self._first)
        if math.isnan(usual):
            run = prepared.simulate(legs, plan.walker, recorder, leave_behind=self.peaks_only)
            return scene, legs, run
        assert isinstance(prepared, Prepared)
        run = prepared.simulate(legs, plan.walker, usual=usual)
        scene = scene.until(run.end * scene.units.time)
        return scene, plan.legs(scene), run


def _errors_of_plan(
    prepared: Prepared | RungeKutta, legs: Sequence[Leg], plan: plans.Plan, run: Simulation,
    twice: bool,
) -> ContactErrors:  # fmt: skip
    """Return bounds of the errors of a planned run, from one run or two with other steps.

    Two further runs are made where a contact is still pressed at the end: forces at one time vary
    erratically with the step, one difference may be small by chance, and none falls with a power of
    the step. The same holds for rounding errors that collisions amplify: two runs are made for
    pistons, and for scenes beyond a uniform chain if the plan before was not accurate enough.
    Without the third run the errors of two of 9,404 random runs were 2 and 3.5 times their bounds,
    when short legs had as many steps in the second run as in the third.
    """
    coarser = plan.other_legs(legs)
    others = [coarser]
    if twice:
        pairs = zip(error_bound.finer_run(legs).legs, coarser, strict=True)
        others.append(
            tuple(leg.in_steps(leg.steps + (leg.steps == other.steps)) for leg, other in pairs)
        )
    differences = [_difference(run, prepared, other, plan.coarser) for other in others]
    return plan.safety.bounds(differences, rest=plan.least(run.evaluations))


def _difference(
    run: Simulation, prepared: Prepared | RungeKutta, legs: Sequence[Leg], walker: Walker
) -> ContactErrors:
    """Return the differences from a run on other legs; it drops granules where it may."""
    return run.peaks.differences(prepared.simulate(legs, walker, leave_behind=True).peaks)


def _errors_of_steps(
    prepared: Prepared | RungeKutta, legs: Sequence[Leg], method: Method, run: Simulation
) -> ContactErrors:
    """Return bounds of the errors of a run with a given method and step."""
    scene, walker, rising = prepared.scene, method.walker, run.peaks.any_rising
    # Errors at steps of 0.6 natural time units and more do not predict those at longer steps.
    stable = min(error_bound.stable_step(scene, method.interval), scene.contact_time)
    others = [error_bound.coarser_run(legs, stable)]
    longest = max(leg.dt for leg in legs) / scene.contact_time
    if not walker.tolerance or longest > error_bound.SHORT or rising:
        others.append(error_bound.finer_run(legs))
    # If cut again, different legs could get the same steps.
    cut = replace(walker, cosine_steps=1)
    differences = [_difference(run, prepared, other.legs, cut) for other in others]
    safety = error_bound.SAFETIES[method.safety]
    if walker.stepper.order == 2:
        safety = error_bound.second_order_safety(scene, longest, rising)
    rest = method.floor + plans.round_off(run.evaluations)
    return safety.bounds(differences, [other.weight for other in others], rest)


def by_velocity_verlet(
    scene: Scene, legs: Sequence[Leg], deadline: Deadline | None = None,
    recorder: Recorder | None = None, start: FloatArray | None = None, first: bool = False,
) -> Simulation:  # fmt: skip
    """Integrate a scene with elastic or damped contacts once by velocity Verlet.

    Arguments are as for ``simulation.simulate``; with damped contacts ``first`` says whether first
    pulses are wanted.
    """
    if scene.contact is None:
        walker = METHODS["velocity-verlet"].walker
        return simulate(scene, legs, walker, recorder, deadline=deadline, start=start)
    from hertzchain.engines.native.verlet import simulate_damped_verlet

    return simulate_damped_verlet(scene, legs, deadline, recorder, start, first)


def with_end(scene: Scene, record: ArrayLike | None = None, time_limit: float = math.inf) -> Scene:
    """Return a scene with the end of its run [s], the same for every engine.

    An end that is given stays. By default, scenes with a striker, a wall or unlike granules end at
    twice the time at which the first pulse of every contact is over, plus three natural time units;
    at latest at ``Scene.end_time`` where pulses are over by then. All other scenes end there.

    Parameters
    ----------
    scene
        What to simulate.
    record
        Times at which the motion is recorded [s], if any: the end is not before them, but at latest
        at ``Scene.end_time``.
    time_limit
        Time limit of the run that finds the end [s], without compiling; beyond it, or with too much
        work, the end is ``Scene.end_time``.
    """
    if not finds_end(scene):
        return scene
    end = _end_of(scene, time_limit)
    if record is not None and np.ndim(record) == 1:
        with suppress(TypeError, ValueError):  # no times: the engine refuses them in words
            last = float(np.max(np.asarray(record, np.float64), initial=0.0))
            end = max(end, min(last, scene.end_time))
    return scene.until(end)


def _end_of(scene: Scene, time_limit: float) -> float:
    """The end that one run finds, without a bound of its error."""
    from hertzchain.observables.compiling import Watched

    plan = plans.cheapest(_END_RTOL, checked=False)
    # The wanted run itself reports why one is refused.
    with Watched() as preparation, suppress(HertzchainError):
        deadline = Deadline(time_limit, lambda: preparation.time)
        if scene.contact is not None:
            error_bound.refuse_strong_dampers(scene)
            run = damped_runs.simulate_damped(
                scene, _END_RTOL, deadline, most_work=_MOST_END_WORK, first=True
            )
        elif work_of(scene, plan.legs(scene), plan.walker.stepper.stages) > _MOST_END_WORK:
            return scene.end_time
        else:
            legs, usual = plan.first_legs(scene, first=True)
            run = Prepared.of(scene, deadline, first=True).simulate(legs, plan.walker, usual=usual)
        return run.end * scene.units.time
    return scene.end_time


def motion_at(scene: Scene, time: FloatArray, rtol: float, deadline: Deadline) -> History:
    """Return the motion at some times [s] within the scene's run, for many like scenes.

    It is a run that ``Native`` tries for ``rtol``, without the runs that bound the error, which are
    half of the work or more. Nothing is refused.
    """
    units = scene.units
    recorder = Recorder(time / units.time, scene.bodies, scene.wall is not None)
    if scene.contact is None:
        plan = plans.cheapest(rtol, hard=error_bound.amplifies_errors(scene))
        Prepared.of(scene, deadline).simulate(plan.legs(scene), plan.walker, recorder)
    else:
        damped_runs.simulate_damped(scene, damped_runs.first_tolerance(rtol), deadline, recorder)
    in_si = units.length, units.velocity, units.force
    return recorder.history(time, *in_si, scene.first_granule)


@functools.cache
def versions(method: str | None = None) -> Mapping[str, str]:
    """Return the versions of the software that computes by a method."""
    by_scipy = {"numpy": version("numpy"), "scipy": version("scipy")}
    return by_scipy if method == "scipy" else {"numpy": version("numpy"), "numba": version("numba")}
