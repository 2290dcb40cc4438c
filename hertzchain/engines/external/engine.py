"""Engines that step by velocity Verlet in another code: their results and bounds of errors."""

from __future__ import annotations

import itertools
import math
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from hertzchain.arrays import FloatArray
from hertzchain.engines.external import accuracy
from hertzchain.engines.external.accuracy import predicted_loss, softening
from hertzchain.engines.external.observation import Observation, Simulation, refuse_large
from hertzchain.engines.external.program import find_program, run_program, work_folder
from hertzchain.errors import POSITIVE, RunFailed, Unpredictable, is_finite, is_positive, require
from hertzchain.limits import RTOL, TIGHTEST, TIME_LIMIT, Deadline, check_time_limit
from hertzchain.observables import error_bound
from hertzchain.observables.error_bound import ContactErrors, Peaks
from hertzchain.observables.first_pulse import check_wanted, usually_wanted
from hertzchain.observables.gauges import readings
from hertzchain.observables.result import LostDigits, Result
from hertzchain.observables.samples import History, wanted_times
from hertzchain.observables.watch import PeakWatch
from hertzchain.scene.scene import (
    Scene,
    SceneLike,
    largest_overlap_ratio,
    refuse_deep_overlap,
    refuse_terms,
    to_scene,
)
from hertzchain.scene.schedule import Leg

STABLE = 2.0  # largest product of step and frequency of velocity Verlet: see ``stable_step``

Code = Callable[[Scene, Sequence[Leg], Sequence[int], Observation], str]
"""Function that runs a scene with given steps and steps between readings on each leg, and passes
the readings to the observation. It returns the code's version.
"""


class ExternalEngine(ABC):
    """A backend that runs another code; a subclass is a frozen dataclass with further fields.

    The subclass defines how one run with given steps is started and read.
    """

    LABEL: ClassVar[str]  # name of the code in messages
    FASTEST: ClassVar[tuple[float, float]]  # time of a step, and more for each granule [s]
    TERMS: ClassVar[tuple[str, ...]] = ()  # terms that the code has, by their names in Scene.terms

    dt: float | None  # largest step [s]; None for one with an estimated error of at most ``rtol``
    read_every: int | None  # steps between readings, in the coarsest run; None for 0.3 time units
    rtol: float  # wanted relative error of the peaks, where no step is given
    extrapolated: bool  # peaks from two runs, one with half the steps of the other (Richardson)
    time_limit: float
    wanted: str | None

    def __post_init__(self) -> None:
        """Refuse impossible parameters."""
        check_time_limit(self.time_limit)
        check_wanted(self.wanted)
        if self.dt is not None:
            require(is_positive(self.dt), "dt", self.dt, f"{POSITIVE} [s]")
        if self.read_every is not None:
            require(self.read_every >= 1, "read_every", self.read_every, "must be at least 1")
        allowed = f"must be a number from {TIGHTEST:g} to below 1"
        require(is_finite(self.rtol) and TIGHTEST <= self.rtol < 1, "rtol", self.rtol, allowed)

    @property
    def name(self) -> str:
        """Name of the code in options and columns, and the backend of a result."""
        return self.LABEL.lower()

    @abstractmethod
    def method_of(self, scene: Scene) -> str:
        """Return the name of the method in the result."""

    @abstractmethod
    def code_of(self, scene: Scene, deadline: Deadline) -> Code:
        """Return the code for a scene or a similar one, after checking that it can run that."""

    def least_time(self, steps: int, granules: float) -> float:
        """Return the time of a run on a fast machine [s]."""
        return steps * (self.FASTEST[0] + granules * self.FASTEST[1])

    def runner(self, scene: Scene, deadline: Deadline) -> _Runner:
        """Return what runs a scene by the code with given steps."""
        refuse_terms(scene, self.LABEL, self.TERMS)
        return _Runner(scene, self, self.code_of(scene, deadline), deadline)

    def run(self, scene: SceneLike, record: ArrayLike | None = None) -> Result:
        """Simulate a scene; arguments and errors are as for ``Native.run``, and two more.

        Raises
        ------
        BackendMissing
            If the code is not installed.
        RunFailed
            If the code stops with an error or crashes, or cannot simulate this scene.
        """
        from hertzchain.engines.native.backend import with_end

        begin = time.perf_counter()
        scene = with_end(to_scene(scene), record, self.time_limit)
        times = None if record is None else wanted_times(record, scene.end_time)
        runner = self.runner(scene, Deadline(self.time_limit))
        error_bound.refuse_strong_dampers(scene)
        answer = runner.answer()
        simulation, peaks, errors = answer.run, answer.peaks, answer.errors
        if not answer.round_off < 1:
            raise Unpredictable(
                f"{self.LABEL} cannot resolve the overlaps of this scene in its coordinates: take"
                " a shorter chain or a shorter pulse"
            )
        dt = max(leg.dt for leg in simulation.legs)
        too_long = self.dt is not None and dt > error_bound.SHORT * scene.contact_time
        error_bound.refuse_meaningless(self.LABEL, errors.least, too_long)
        refuse_deep_overlap(largest_overlap_ratio(scene, peaks.force))
        history = None if times is None else runner.history(simulation.legs, times)
        first, contacts = errors.known(peaks.first), len(scene.contacts)
        errors = errors.in_units(scene.contact_time)
        engine: Any = self  # a dataclass
        return Result(
            scene=scene,
            backend=self.name,
            scheme="velocity-verlet",
            method=self.method_of(scene) + ", extrapolated" * runner.extrapolated,
            dt=dt,
            steps=answer.steps,
            force_evaluations=answer.steps,
            peak_force=peaks.force,
            peak_time=peaks.time,
            peak_passed=peaks.passed,
            error_estimate=errors.largest,
            displacement=simulation.displacement[scene.first_granule :],
            velocity=simulation.velocity[scene.first_granule :],
            balance=simulation.balance,
            history=history,
            wall_time=time.perf_counter() - begin,
            versions={self.name: simulation.version},
            lost_digits=LostDigits(
                simulation.scaling.scene(scene).chain.first_modulus,
                predicted_loss(scene, simulation.steps),
                answer.round_off,
            ),
            first_pulses=first and first.part(slice(contacts)),
            errors=errors.of_contacts(contacts),
            gauges=readings(scene, first, errors),
            engines=(replace(engine, dt=dt), replace(engine, dt=dt / 2)),
        )


@dataclass(frozen=True, eq=False)
class _Answer:
    """Peaks in SI units with bounds of their errors, and the run for all other results."""

    run: Simulation
    peaks: Peaks
    steps: int
    errors: ContactErrors  # arrivals in natural time units
    round_off: float


@dataclass(frozen=True)
class _Runner:
    """Runs one scene with one code and the options of its engine."""

    scene: Scene
    engine: ExternalEngine
    code: Code
    deadline: Deadline

    @property
    def order(self) -> int:
        """Order of velocity Verlet; 1 with damping, which uses velocities half a step earlier."""
        return 2 if self.scene.contact is None else 1

    @property
    def extrapolated(self) -> bool:
        """True if peaks are extrapolated: on request, or for damped contacts with high accuracy.

        Errors of dashpots that close at a speed are not proportional to a power of the step, and
        remain.
        """
        engine = self.engine
        # Relative error of the peaks below which first-order steps are too slow
        needed = self.order == 1 and engine.dt is None and engine.rtol < 1e-4
        return engine.extrapolated or (needed and not accuracy.touches_at_a_speed(self.scene))

    @property
    def _halvings(self) -> int:
        """Least number of halvings of the steps: two runs to extrapolate from, others to judge."""
        return 2 if self.order == 2 else 3

    @property
    def _has_rivals(self) -> bool:
        """True if a later blow may be the hardest one; damping weakens those."""
        return self.scene.contact is None and not self.scene.is_plain

    def answer(self) -> _Answer:
        return self._extrapolated() if self.extrapolated else self._plain()

    def peaks_alone(self, dt: float) -> tuple[FloatArray, int]:
        """Peak forces [N], (contacts,), and the number of steps, of one run or both needed."""
        legs = self.scene.schedule(2 * dt if self.engine.extrapolated else dt)
        strides = self.strides(legs)
        coarse = self.simulate(legs, strides)
        if not self.engine.extrapolated:
            return coarse.peaks.force, coarse.steps
        halved = tuple(leg.in_steps(2 * leg.steps) for leg in legs)
        finer = self.simulate(halved, [2 * stride for stride in strides])
        return self.extrapolated_from(coarse, finer).force, coarse.steps + finer.steps

    def history(self, legs: Sequence[Leg], times: FloatArray) -> History:
        """Record a history in a further run with closer readings; the peaks stay unchanged."""
        recorder = self.simulate(legs, self.strides(legs, recording=True), times).recorder
        assert recorder is not None
        return recorder.history(times, first=self.scene.first_granule)

    def simulate(
        self, legs: Sequence[Leg], strides: Sequence[int], times: FloatArray | None = None
    ) -> Simulation:
        scene, engine, steps = self.scene, self.engine, sum(leg.steps for leg in legs)
        error_bound.refuse_unstable(scene, legs, STABLE, "velocity-verlet")
        # Where coordinates would cost too many digits the code gets a similar scene; readings are
        # scaled back to the true scene at once.
        scaling = softening(scene, steps)
        self.deadline.refuse(engine.least_time(steps, scene.chain.granules))
        first = (engine.wanted or usually_wanted(scene)) == "first"
        seen = Observation(scene, scaling, legs, times, engine.LABEL, first)
        return seen.simulation(self.code(scaling.scene(scene), seen.legs, strides, seen))

    def _plain(self) -> _Answer:
        """Run with the given step, or with one whose error is as small as wanted."""

        def peaks_at(dt: float) -> FloatArray:
            return self._rough(self.scene.schedule(dt)).seen.wanted

        dt = self.engine.dt or self._step_for(peaks_at)
        # Most runs to get below the wanted error: the first step may be a little too long
        for _ in range(3):
            legs = self.scene.schedule(dt)
            strides = self.strides(legs)
            run = self.simulate(legs, strides)
            lost = run.round_off(self.scene)
            rest = accuracy.interpolation_error(self.scene, legs, strides)
            rest += run.peaks.reading_error + lost
            errors = self._errors_of_plain(legs, run, rest)
            if self._is_enough(errors, rest + lost):
                break
            excess = self.engine.rtol / errors.wanted
            if self.order == 2:
                dt *= max(0.25, 0.9 * math.sqrt(excess))
            else:
                dt *= max(0.05, 0.9 * excess)
        return _Answer(run, run.seen, run.steps, errors, lost)

    def extrapolated_from(self, coarse: Simulation, fine: Simulation) -> Peaks:
        """Return peaks extrapolated from two runs."""
        longest = max(leg.dt for leg in coarse.legs)
        return accuracy.extrapolate(coarse.seen, fine.seen, self.order, longest)

    def _extrapolated(self) -> _Answer:
        """Extrapolate from two runs, read at the same times; a third run gives the error.

        Damped contacts need a fourth run: two extrapolations can agree by chance.
        """
        needed = self._halvings + 1
        legs = self.scene.schedule(
            self._coarsest_step() if self.engine.dt is None else 2**self._halvings * self.engine.dt
        )
        strides = self.strides(legs)
        runs: list[Simulation] = []
        # Most halvings of the steps until an extrapolation is as good as wanted
        for k in range(needed + 6):
            finer = tuple(leg.in_steps(2**k * leg.steps) for leg in legs)
            apart = [2**k * stride for stride in strides]
            runs = [*runs[1 - needed :], self.simulate(finer, apart)]
            if len(runs) < needed:
                continue
            limits = [self.extrapolated_from(*pair) for pair in itertools.pairwise(runs)]
            after, last = limits[-1], runs[-1]
            grows, lost = 2**self.order, runs[-2].round_off(self.scene)
            lost = (grows * last.round_off(self.scene) + lost) / (grows - 1)
            rest = lost + accuracy.interpolation_error(self.scene, finer, apart)
            rest += (grows * last.peaks.reading_error + runs[-2].peaks.reading_error) / (grows - 1)
            errors = self._errors_of_extrapolated(limits, runs[-2].peaks, finer, last.peaks, rest)
            if self._is_enough(errors, rest + lost):
                break
        return _Answer(last, after, runs[-2].steps + last.steps, errors, lost)

    def _errors_of_extrapolated(
        self, extrapolated: Sequence[Peaks], before: PeakWatch, legs: Sequence[Leg],
        peaks: PeakWatch, rest: float,
    ) -> ContactErrors:  # fmt: skip
        """Return bounds of the errors of the last extrapolation; ``before`` has twice the step."""
        scene, last = self.scene, extrapolated[-1]
        gain, per_unit = accuracy.least_gain(scene), 1 / scene.contact_time
        pairs = itertools.pairwise(reversed(extrapolated))
        differences = [finer.differences(other).in_units(per_unit) for finer, other in pairs]
        weights = [gain**-later for later in range(len(differences))]
        safety, by_chance = accuracy.extrapolation_safety(scene, legs, peaks, last.any_rising)
        errors = safety.bounds(differences, weights, rest + by_chance)
        other, weight = before if self._has_rivals else None, 3 / (2**self.order - 1)
        rivals = accuracy.rival_errors(peaks, last.force, other, weight)
        return accuracy.with_rivals(errors, rivals, last, np.add)

    def _step_for(self, peaks_at: Callable[[float], FloatArray]) -> float:
        """Return the step [s] for the wanted error, by trials."""
        scene, wanted = self.scene, self.engine.rtol
        # Step of the first run in the search for a wanted error [natural time units]
        pilot = 0.04 * scene.contact_time
        if scene.contact is None:
            safety = error_bound.second_order_safety(scene, 0.0, rising=False)
            return error_bound.step_for(peaks_at, pilot, wanted, safety)
        longest = self._longest_damped_step
        safety = error_bound.first_order_safety(scene, rising=False)
        return min(error_bound.step_for(peaks_at, min(pilot, longest), wanted, safety, 1), longest)

    @property
    def _longest_damped_step(self) -> float:
        """Longest step that is chosen for damped contacts [s]: half of what is stable."""
        return 0.5 * error_bound.stable_step(self.scene, STABLE)

    def _coarsest_step(self) -> float:
        """Return the first step to extrapolate from [s]; longer steps cannot be extrapolated."""
        unit, part = self.scene.contact_time, self.engine.rtol / 1e-6
        if self.scene.contact is None:  # of fourth order
            # Step of the first of three extrapolated runs, for 1e-6 [natural time units]
            return min(0.065 * math.pow(part, 1 / 4), 0.4) * unit
        wanted = 0.1 * self.engine.rtol  # runs are read after each of these steps, or more rarely
        longest = min(
            self._longest_damped_step, accuracy.damped_interval(self.scene, wanted, wanted)
        )
        # Step of the first of four runs of damped contacts, for 1e-6 [natural time units]
        return min(min(0.008 * math.sqrt(part), 0.2) * unit, longest)

    def _is_enough(self, errors: ContactErrors, rest: float) -> bool:
        """Return whether shorter steps are unnecessary, or useless because of the other errors."""
        is_enough = errors.wanted <= self.engine.rtol or errors.share * errors.wanted <= rest
        return self.engine.dt is not None or is_enough

    def _rough(self, legs: Sequence[Leg]) -> Simulation:
        """Make a run that only estimates the error of another, read as rarely as possible."""
        return self.simulate(legs, [self._longest_stride(leg) for leg in legs])

    def strides(self, legs: Sequence[Leg], recording: bool = False) -> list[int]:
        """Return the steps between two readings on each leg."""
        if (given := self.engine.read_every) is not None:
            return [given] * len(legs)
        strides = []
        for leg in legs:
            stride = self._longest_stride(leg)
            if recording:
                # Interval [natural time units]; at 0.3 opening contacts leave 5e-5 in velocities
                stride = min(stride, int(0.1 * self.scene.contact_time / leg.dt))
            if leg.ramp is not None:
                # Least readings on a leg with enough steps, for the work of a short pulse
                stride = min(stride, leg.steps // 8)
            strides.append(max(1, stride))
        return strides

    def _longest_stride(self, leg: Leg) -> int:
        """Steps between readings that cost as much as round-off, or 0.1 of the wanted error."""
        scene, unit, given = self.scene, self.scene.contact_time, self.engine.dt
        wanted = 0.1 * self.engine.rtol
        if scene.contact is None:
            # Interval between readings [natural time units]: costs 7e-9 of a peak at dt = 0.01, and
            # grows as dt falls
            interval = 0.3 * math.pow(0.01 * unit / leg.dt, 1 / 8)
            if given is None:
                interval = min(interval, math.pow(wanted / accuracy.INTERPOLATION, 1 / 8))
            if error_bound.amplifies_errors(scene):
                # Error of a peak over the square of a given step [natural units]
                error = wanted if given is None else 0.02 * (leg.dt / unit) ** 2
                interval = min(interval, math.pow(error / accuracy.KINK, 1 / 3.5))
            interval *= unit
        elif not self.extrapolated:  # as native reads, so that only the steps count
            interval = accuracy.damped_interval_at(scene, leg.dt)
        elif given is None:
            interval = accuracy.damped_interval(scene, wanted, wanted)
        else:
            finest = leg.dt / 2**self._halvings
            by_steps = finest * max(1 / unit, error_bound.highest_rate(scene))
            interval = accuracy.damped_interval(scene, 0.01 * by_steps**2, 0.1 * by_steps)
        return max(1, int(min(leg.steps, interval / leg.dt)))

    def _errors_of_plain(self, legs: Sequence[Leg], run: Simulation, rest: float) -> ContactErrors:
        """Return bounds of the errors of a run, from runs with other steps."""
        scene, rising = self.scene, run.seen.any_rising
        stable, longest = error_bound.stable_step(scene, STABLE), max(leg.dt for leg in legs)
        natural_step = longest / scene.contact_time
        others = [error_bound.coarser_run(legs, stable, self.order)]
        safety = error_bound.second_order_safety(scene, natural_step, rising)
        if self.order == 1:  # contacts that close at a speed do so anywhere within a step
            safety = error_bound.first_order_safety(scene, rising)
        erratic = self.order == 1 or rising or error_bound.amplifies_errors(scene)
        # Step above which opening contacts may hide the error of two runs [natural time units]
        if erratic or natural_step > 0.05:
            others.append(error_bound.finer_run(legs, self.order))
        rough = [self._rough(other.legs) for other in others]
        weights, per_unit = [other.weight for other in others], 1 / scene.contact_time
        differences = [run.seen.differences(other.seen).in_units(per_unit) for other in rough]
        touch = accuracy.touch_error(scene, legs, run.peaks)
        errors = safety.bounds(differences, weights, rest, touch)
        if not self._has_rivals:
            return errors
        rivals = [
            accuracy.rival_errors(run.peaks, run.peaks.force, other.peaks, safety.factor * weight)
            for other, weight in zip(rough, weights, strict=True)
        ]
        return accuracy.with_rivals(errors, np.maximum.reduce(rivals) + rest, run.seen, np.maximum)


@dataclass(frozen=True)
class ProgramEngine(ExternalEngine):
    """A code that is a program: it reads one file, and writes its readings to others."""

    FILE: ClassVar[str]  # name of the deck in the folder in which the program runs
    INSTALL: ClassVar[str]  # command that installs the program
    ENVIRONMENT: ClassVar[dict[str, str]] = {}  # environment variables of the program
    # Module whose ``watched`` writes decks that print samples, and ``deck`` one with peaks.
    WRITER: ClassVar[ModuleType]

    dt: float | None = None
    read_every: int | None = None
    rtol: float = RTOL
    extrapolated: bool = False
    program: str = ""
    time_limit: float = TIME_LIMIT
    wanted: str | None = None

    @abstractmethod
    def command(self, program: str) -> list[str]:
        """Return the command that runs ``FILE``."""

    @abstractmethod
    def replay(self, folder: Path, scene: Scene, strides: Sequence[int], seen: Observation) -> str:
        """Pass the readings that the program left to the observation; return its version."""

    def refuse(self, scene: Scene) -> None:
        """Raise RunFailed for a scene that the code cannot simulate."""
        refuse_terms(scene, self.LABEL, self.TERMS)
        contact, wall = scene.contact, scene.wall
        if contact is not None and contact.restitution is None:
            raise RunFailed(
                f"a {self.LABEL} deck has no {contact.damping} damping: take damping ="
                ' "restitution", or another backend'
            )
        if wall is not None and wall.own_damping:
            raise RunFailed(
                f"{self.LABEL} gets one damping for all contacts: take a wall without"
                f" {', '.join(wall.own_damping)}, LAMMPS or native"
            )

    def code_of(
        self, scene: Scene, deadline: Deadline, edit: Callable[[str], str] = lambda text: text
    ) -> Code:
        """Return the code of the program, which runs decks as ``edit`` returns them."""
        program = find_program(self.program, f"install it with: {self.INSTALL}")
        self.refuse(scene)

        def run(
            scene: Scene, legs: Sequence[Leg], strides: Sequence[int], seen: Observation
        ) -> str:
            refuse_large(legs, strides, scene.bodies)
            text = edit(self.WRITER.watched(scene, legs, strides))
            with work_folder(self.LABEL) as folder:
                (folder / self.FILE).write_text(text, encoding="ascii")
                command = self.command(program)
                run_program(command, folder, deadline, self.LABEL, **self.ENVIRONMENT)
                return self.replay(folder, scene, strides, seen)

        return run
