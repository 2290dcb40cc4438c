"""The LAMMPS backend: scene in, result out."""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from hertzchain.accuracy import (
    another_companion,
    companion,
    diverged,
    refuse_meaningless,
    refuse_unstable,
    second_order_safety,
    second_order_step,
    stable_step,
)
from hertzchain.arrays import FloatArray
from hertzchain.chain import POSITIVE, is_positive
from hertzchain.cost import TIME_LIMIT, Deadline, check_time_limit
from hertzchain.errors import OverlapTooLarge, RunFailed, SceneError, require
from hertzchain.history import Recorder, wanted_times
from hertzchain.lammps import deck, reading
from hertzchain.lammps.engine import command, engine, run, version_of
from hertzchain.lammps.examination import Examination, examine
from hertzchain.lammps.isolation import Child, run_in
from hertzchain.lammps.softening import Softening, predicted_loss, round_off, softening
from hertzchain.peaks import PeakWatch, largest_difference
from hertzchain.result import Balance, LostDigits, Result
from hertzchain.samples import Samples
from hertzchain.scene import Scene, require_scene
from hertzchain.schedule import Leg
from hertzchain.shock import Pulse
from hertzchain.validity import refuse_deep_overlap, refuse_hopeless_overlap
from hertzchain.work import work_done

_READING_INTERVAL = 0.3
"""Natural time units between two readings at steps of 0.01: peaks are off by 7e-9 for it.

At other steps the error goes as 1 / dt, as that of round-off does."""

_RECORDING_INTERVAL = 0.1
"""Natural time units between two readings where a history is wanted: an opening contact between
them leaves r'^(3/2) h^(5/2) in the velocities, 5e-5 of the largest at 0.3."""

_INTERPOLATION = 3e-4
"""Of a peak, times the eighth power of the interval [natural units]; 1e-4 measured."""

_READINGS_PER_RAMP = 8
"""At least, if there are so many steps: the work of a short pulse needs them."""

_TRIES = 3
"""Runs to get below the wanted error: the first estimate of the step may be a little too long."""

_HALVINGS = 6
"""Of the steps, at most, until an extrapolation is as good as wanted."""

_STABLE = 2.0
"""Product of step and frequency up to which velocity Verlet is stable: see
``accuracy.stable_step``."""

_FASTEST_STEP, _FASTEST_GRANULE = 0.3e-6, 8e-9
"""Time of a step, and of each granule in it, on a fast machine [s]; 0.5e-6 and 2e-8 measured."""

_ERRATIC_STEP = 0.05
"""Natural time units; above, opening contacts may make the difference of two runs too small. Under
pulse tables, which open and close contacts again and again, they do so at any step."""

_BLOCK = 256
"""Readings handed on at a time."""

_PILOT_STEP = 0.04
"""Natural time units; the first of the runs that find the step for a wanted error."""

_COARSEST_STEP = 0.065
"""Natural time units, of the first of three runs to be extrapolated; for an error of 1e-6."""


@dataclass(frozen=True)
class Lammps:
    """A generated deck, run through the ``lammps`` Python module.

    Parameters
    ----------
    dt
        The largest step [s]; by default one whose estimated error is at most ``rtol``.
    pair_style
        ``granular`` (with hertz/material) or ``gran/hertz/history``.
    read_every
        Steps between two readings of the state, of the coarsest run where ``extrapolated``; by
        default so many that 0.3 natural time units pass at most.
    rtol
        Wanted relative error of the peaks, where no step is asked for: whether p is 9 or 10 can
        hang on 2e-5. Where round-off costs more than that, the run goes on and its
        ``error_estimate`` says so.
    extrapolated
        Whether peaks and their times are extrapolated from two runs, one with half the steps of the
        other (Richardson): right to 1e-6 in an eighth of the steps. Everything else in the result,
        from displacement to balance and history, is that of the finer run, whose step is ``dt``;
        its error is that of velocity Verlet at this step, some 0.1 dt^2 in natural units.
    isolated
        Whether LAMMPS runs in a process of its own: where it crashes, hangs or runs out of memory
        that is an error like any other. It costs a second for each run; many runs share one
        process in ``run_many``.
    time_limit
        How long a run may take [s], all that finds its step and its error included. Looked at
        whenever the state is read; an isolated run is ended at once.

    Raises
    ------
    SceneError
        For a pair style that does not exist, a step or a time limit that is not a finite number
        above 0, readings less than one step apart, or an error that is not between 0 and 1.
    """

    dt: float | None = None
    pair_style: str = "granular"
    read_every: int | None = None
    rtol: float = 1e-6
    extrapolated: bool = False
    isolated: bool = False
    time_limit: float = TIME_LIMIT
    _deadline: Deadline | None = field(default=None, repr=False, compare=False)
    """When a run has to end; set where one begins."""

    def __post_init__(self) -> None:
        names = ", ".join(deck.PAIR_STYLES)
        known = self.pair_style in deck.PAIR_STYLES
        require(known, "pair_style", self.pair_style, f"must be one of {names}")
        if self.dt is not None:
            require(is_positive(self.dt), "dt", self.dt, f"{POSITIVE} [s]")
        if self.read_every is not None:
            require(self.read_every >= 1, "read_every", self.read_every, "must be at least 1")
        allowed = "must be a number above 0 and below 1"
        require(is_positive(self.rtol) and self.rtol < 1, "rtol", self.rtol, allowed)
        check_time_limit(self.time_limit)

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
        SceneError
            For what is no scene, or times that cannot be.
        BackendMissing
            If LAMMPS is not there.
        StepUnstable
            If the step asked for is so long that the motion diverges.
        OverlapTooLarge
            If granules would be pressed into one another by more than a radius.
        RunFailed
            If LAMMPS stops with an error or, isolated, crashes.
        TooExpensive
            If it takes longer than the time limit.
        """
        require_scene(scene)
        if self.isolated:
            with Child() as child:
                return run_in(child, self, scene, record)
        begin = time.perf_counter()
        refuse_hopeless_overlap(scene)
        times = None if record is None else wanted_times(record, scene.end_time)
        limited = replace(self, _deadline=Deadline(self.time_limit))
        simulate = limited._extrapolated if self.extrapolated else limited._plain
        answer = simulate(scene, times)
        run = answer.run
        if not answer.round_off < 1:
            raise RunFailed(
                "LAMMPS cannot resolve the overlaps of this scene beside its coordinates: take"
                " a shorter chain or a shorter pulse"
            )
        refuse_meaningless("LAMMPS", answer.error, too_long=self.dt is not None)
        refuse_deep_overlap(scene.chain, float(np.max(answer.peak_force)))
        history = None
        if run.recorder is not None and times is not None:
            history = run.recorder.history(times)
        return Result(
            scene=scene,
            backend="lammps",
            method=", ".join(
                ["velocity-verlet", self.pair_style, *["extrapolated"] * self.extrapolated]
            ),
            dt=max(leg.dt for leg in run.legs),
            steps=answer.steps,
            force_evaluations=answer.steps,
            peak_force=answer.peak_force,
            peak_time=answer.peak_time,
            peak_passed=run.peaks.passed,
            error_estimate=answer.error,
            displacement=run.displacement,
            velocity=run.velocity,
            balance=run.balance,
            history=history,
            wall_time=time.perf_counter() - begin,
            versions={"lammps": run.version},
            watching_share=run.watching_share,
            lost_digits=LostDigits(
                run.made.scene(scene).chain.young_modulus,
                predicted_loss(scene, run.steps),
                answer.round_off,
            ),
        )

    def examine(self, scene: Scene) -> Examination:
        """Ask LAMMPS what it makes of the deck of a scene, number by number; see ``examination``.

        Raises
        ------
        BackendMissing
            If LAMMPS is not there.
        RunFailed
            If LAMMPS stops with an error or, isolated, crashes.
        """
        if not self.isolated:
            return examine(scene, self.pair_style)
        with Child() as child:
            found: Examination = child.call(
                examine, scene, self.pair_style, time_limit=self.time_limit
            )
            return found

    def peaks_alone(self, scene: Scene) -> tuple[FloatArray, int]:
        """Simulate with the step asked for, and nothing besides: what the peaks themselves cost.

        Neither runs that find a step nor runs that tell the error: one run of the deck, or the two
        that are extrapolated.

        Parameters
        ----------
        scene
            What to simulate.

        Returns
        -------
        Peak forces [N], shape (contacts,), and the number of steps taken.

        Raises
        ------
        SceneError
            If no step was asked for.
        BackendMissing
            If LAMMPS is not there.
        RunFailed
            If LAMMPS stops with an error or, isolated, crashes, or the motion diverges.
        TooExpensive
            If it takes longer than the time limit.
        """
        if self.dt is None:
            raise SceneError("dt", None, "missing, a run without estimates needs it")
        if self.isolated:
            within = replace(self, isolated=False).peaks_alone
            with Child() as child:
                found: tuple[FloatArray, int] = child.call(
                    within, scene, time_limit=self.time_limit
                )
                return found
        limited = replace(self, _deadline=Deadline(self.time_limit))
        legs = scene.schedule(2 * self.dt if self.extrapolated else self.dt)
        strides = [self._stride(scene, leg, recording=False) for leg in legs]
        run = limited._simulate(scene, legs, strides)
        if not self.extrapolated:
            return run.peaks.force, run.steps
        halved = tuple(replace(leg, steps=2 * leg.steps) for leg in legs)
        finer = limited._simulate(scene, halved, [2 * stride for stride in strides])
        return _extrapolate(run, finer)[0], run.steps + finer.steps

    def _plain(self, scene: Scene, times: FloatArray | None) -> _Answer:
        """Run with the step asked for, or with one whose error is as small as wanted."""

        def peaks_at(dt: float) -> FloatArray:
            return self._rough_peaks(scene, scene.schedule(dt))

        unit = scene.units.time
        dt = self.dt or second_order_step(peaks_at, _PILOT_STEP * unit, self.rtol)
        for _ in range(_TRIES):
            legs = scene.schedule(dt)
            strides = [self._stride(scene, leg, times is not None) for leg in legs]
            run = self._simulate(scene, legs, strides, times)
            lost = run.round_off(scene)
            by_steps = self._step_error(scene, legs, run.peaks.force)
            error = by_steps + _interpolation_error(scene, legs, strides) + lost
            if self._is_enough(by_steps, error, lost):
                break
            dt *= max(0.25, 0.9 * math.sqrt(self.rtol / error))
        return _Answer(run, run.peaks.force, run.peaks.time, run.steps, error, lost)

    def _extrapolated(self, scene: Scene, times: FloatArray | None) -> _Answer:
        """Extrapolate from two runs; a third, coarser one says how good that is.

        All of them are read at the same times, so that what the steps do to the interpolation is
        extrapolated too.
        """
        # Of fourth order; longer steps than that are no use to an extrapolation.
        wanted = min(_COARSEST_STEP * math.pow(self.rtol / 1e-6, 1 / 4), 0.4)
        legs = scene.schedule(wanted * scene.units.time if self.dt is None else 4 * self.dt)
        strides = [self._stride(scene, leg, times is not None) for leg in legs]
        runs: list[_Simulation] = []
        for k in range(3 + _HALVINGS):
            finer = tuple(replace(leg, steps=2**k * leg.steps) for leg in legs)
            apart = [2**k * stride for stride in strides]
            runs = [*runs[-2:], self._simulate(scene, finer, apart, times)]
            if len(runs) < 3:
                continue
            before, after = (_extrapolate(*pair) for pair in itertools.pairwise(runs))
            difference = largest_difference(before[0], after[0])
            by_steps = _extrapolation_error(scene, finer, difference)
            lost = (4 * runs[2].round_off(scene) + runs[1].round_off(scene)) / 3
            error = by_steps + _interpolation_error(scene, finer, apart) + lost
            if self._is_enough(by_steps, error, lost):
                break
        return _Answer(runs[2], *after, runs[1].steps + runs[2].steps, error, lost)

    def _is_enough(self, by_steps: float, error: float, lost: float) -> bool:
        """Whether shorter steps are not wanted, or no help beside what round-off costs."""
        return self.dt is not None or error <= self.rtol or by_steps <= lost

    def _rough_peaks(self, scene: Scene, legs: Sequence[Leg]) -> FloatArray:
        """Peaks of a run that only tells the error of another: read as rarely as possible."""
        strides = [self._longest_stride(scene, leg) for leg in legs]
        return self._simulate(scene, legs, strides).peaks.force

    def _simulate(
        self,
        scene: Scene,
        legs: Sequence[Leg],
        strides: Sequence[int],
        times: FloatArray | None = None,
    ) -> _Simulation:
        """Run the deck of a scene once, reading it every so many steps of each leg.

        Where coordinates would cost too many digits, LAMMPS gets a similar scene; what is read is
        at once that of the true one again.
        """
        made = softening(scene, sum(leg.steps for leg in legs))
        peaks = PeakWatch(scene.chain.granules - 1)
        recorder = None if times is None else Recorder(times, scene.chain.granules)
        work = 0.0
        deadline = self._deadline or Deadline(self.time_limit)
        granules, steps = scene.chain.granules, sum(leg.steps for leg in legs)
        deadline.refuse(steps * (_FASTEST_STEP + granules * _FASTEST_GRANULE))
        clock = _Clock(deadline)
        fastest = scene.impulse / scene.chain.granule_mass
        refuse_unstable(scene, legs, _STABLE, "velocity-verlet")
        with engine() as lammps:
            command(lammps, deck.set_up(made.scene(scene), self.pair_style) + reading.COMMANDS)
            at_rest = reading.granules(lammps)
            _refuse_another_chain(scene, at_rest)
            before = None
            for leg, stride in zip(legs, strides, strict=True):
                given = made.leg(leg)
                command(lammps, "\n".join([*deck.leg_commands(given, before), "run 0 post no"]))
                before = given
                begin = time.perf_counter()
                for reached, arrays in _read(lammps, given, stride, scene.chain.granules, clock):
                    seen = reading.samples(reached, arrays, at_rest, given)
                    _refuse_second_neighbours(seen, at_rest)
                    samples = made.true(seen)
                    # All the impulse in one granule: no granule is ever faster.
                    if np.max(np.abs(samples.velocity)) > 2 * fastest:
                        raise diverged("LAMMPS")
                    peaks.show(samples)
                    if leg.ramp is not None:
                        work += float(work_done(samples, leg.ramp))
                    if recorder is not None:
                        recorder.show(samples)
                clock.whole += time.perf_counter() - begin
            velocity = arrays[-1, 1, :, 0] / made.time
            return _Simulation(
                made,
                tuple(legs),
                peaks,
                samples.displacement[-1],
                velocity,
                _balance(scene, samples, velocity, at_rest.mass, work),
                recorder,
                clock.watching_share(_cost_of_a_stop(lammps)),
                version_of(lammps),
            )

    def _stride(self, scene: Scene, leg: Leg, recording: bool) -> int:
        """Steps between two readings on a leg."""
        if self.read_every is not None:
            return self.read_every
        stride = self._longest_stride(scene, leg)
        if recording:
            stride = min(stride, int(_RECORDING_INTERVAL * scene.units.time / leg.dt))
        if leg.ramp is not None:
            stride = min(stride, leg.steps // _READINGS_PER_RAMP)
        return max(1, stride)

    def _longest_stride(self, scene: Scene, leg: Leg) -> int:
        """Steps between two readings that cost the peaks no more than they may.

        That is as much as round-off at the same steps, a tenth of the wanted error at most.
        """
        unit = scene.units.time
        interval = _READING_INTERVAL * math.pow(0.01 * unit / leg.dt, 1 / 8)
        if self.dt is None:
            interval = min(interval, math.pow(0.1 * self.rtol / _INTERPOLATION, 1 / 8))
        return max(1, int(min(leg.steps, interval * unit / leg.dt)))

    def _step_error(self, scene: Scene, legs: Sequence[Leg], peak_force: FloatArray) -> float:
        """Bound of what the steps cost the peaks, as a fraction."""
        others = [companion(legs, stable_step(scene, _STABLE))]
        longest = max(leg.dt for leg in legs) / scene.units.time
        if longest > _ERRATIC_STEP or not isinstance(scene.shock, Pulse):
            others.append(another_companion(legs))
        error = max(
            other.factor * largest_difference(self._rough_peaks(scene, other.legs), peak_force)
            for other in others
        )
        return second_order_safety(longest) * error


def _refuse_second_neighbours(samples: Samples, at_rest: reading.Granules) -> None:
    """Refuse overlaps so deep that granules would touch the next but one, or pass each other.

    The similar scene is made so that they are not; what it rests on are the peaks expected.
    """
    alone = np.max(samples.overlap)
    together = np.max(samples.overlap[:, :-1] + samples.overlap[:, 1:], initial=0.0)
    if max(alone, together) >= np.min(at_rest.diameter):
        raise OverlapTooLarge(
            "LAMMPS would push granules through one another: choose a smaller dt, or else a smaller"
            " force or a stiffer material"
        )


def _refuse_another_chain(scene: Scene, at_rest: reading.Granules) -> None:
    """Readings have a fixed size: another number of granules must not get as far as there."""
    made, wanted = at_rest.mass.size, scene.chain.granules
    if made != wanted:
        raise RunFailed(
            f"LAMMPS made {made} granules of a chain of {wanted}: do not trust this version with it"
        )


def _extrapolate(coarse: _Simulation, fine: _Simulation) -> tuple[FloatArray, FloatArray]:
    """Peak forces [N] and times [s] as for steps of length 0, from runs with n and 2n steps."""
    force = (4 * fine.peaks.force - coarse.peaks.force) / 3
    later = fine.peaks.time - coarse.peaks.time
    # Of two maxima of nearly the same height either run may have found another one.
    same = np.abs(later) < max(leg.dt for leg in coarse.legs)
    return force, np.where(same, fine.peaks.time + later / 3, fine.peaks.time)


def _extrapolation_error(scene: Scene, legs: Sequence[Leg], difference: float) -> float:
    """Bound of what the steps cost extrapolated peaks, as a fraction.

    The error is 1/15 of the difference where errors go as dt^2 and dt^4. Contacts that open leave
    some dt^2.5 in natural units, erratic from one step to the next, so that two extrapolations can
    agree by chance: 0.0055 dt^2.5 was seen where they did, and 0.84 of the difference.

    Parameters
    ----------
    scene, legs
        The scene and the finer steps.
    difference
        Of the peaks from those of steps twice as long, extrapolated too.
    """
    dt = max(leg.dt for leg in legs) / scene.units.time
    return difference + 0.005 * math.pow(dt, 2.5)


def _interpolation_error(scene: Scene, legs: Sequence[Leg], strides: Sequence[int]) -> float:
    """Bound of what reading now and then costs the peaks, as a fraction.

    In natural units 1e-4 h^8, and for what is left of the error of the derivatives 0.005 h^4 dt^2
    and 0.4 h^2 dt^4 (measured).
    """
    unit = scene.units.time
    apart = [min(n, leg.steps) * leg.dt / unit for n, leg in zip(strides, legs, strict=True)]
    dt = max(leg.dt for leg in legs) / unit
    h = max(apart)
    return _INTERPOLATION * h**8 + 0.01 * h**4 * dt**2 + h**2 * dt**4


def _read(
    lammps: Any, leg: Leg, stride: int, granules: int, clock: _Clock
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Run a leg, reading every ``stride`` steps.

    Yields
    ------
    Times and arrays of successive readings; the first reading is the last of those before.
    """
    stops = [*range(0, leg.steps, stride), leg.steps]
    times = leg.start + leg.dt * np.array(stops)
    times[-1] = leg.end  # to the last digit, so that nothing falls between legs
    arrays = np.zeros((min(len(stops), _BLOCK + 1), len(reading.ARRAYS), granules, 3))
    reading.read(lammps, arrays[0])
    for first in range(0, len(stops) - 1, _BLOCK):
        block = stops[first : first + _BLOCK + 1]
        for k, (done, stop) in enumerate(itertools.pairwise(block), start=1):
            begin = time.perf_counter()
            run(lammps, stop - done)
            clock.add_running(begin)
            reading.read(lammps, arrays[k])
        clock.stops += len(block) - 1
        if not np.all(np.isfinite(arrays[: len(block)])):
            raise diverged("LAMMPS")
        yield times[first : first + len(block)], arrays[: len(block)]
        arrays[0] = arrays[len(block) - 1]


@dataclass
class _Clock:
    """Where the time of a run goes [s]: all of it, that within LAMMPS, and the number of stops."""

    deadline: Deadline
    whole: float = 0.0
    running: float = 0.0
    stops: int = 0

    def add_running(self, begin: float) -> None:
        """Count what LAMMPS has run since then, unless the time is up."""
        now = time.perf_counter()
        if self.deadline.left < 0:
            raise self.deadline.passed()
        self.running += now - begin

    def watching_share(self, stop: float) -> float:
        """Time spent on watching over that spent on steps, if each stop costs LAMMPS so much."""
        stepping = max(self.running - self.stops * stop, 1e-9)
        return self.whole / stepping - 1


def _cost_of_a_stop(lammps: Any) -> float:
    """What it takes LAMMPS to start and end a run, without any steps [s]."""
    costs = []
    for _ in range(5):
        begin = time.perf_counter()
        run(lammps, 0)
        costs.append(time.perf_counter() - begin)
    return min(costs)


@dataclass(frozen=True, eq=False)
class _Simulation:
    """What one run of LAMMPS found, in SI units."""

    made: Softening
    legs: tuple[Leg, ...]
    peaks: PeakWatch
    displacement: FloatArray
    velocity: FloatArray
    balance: Balance
    recorder: Recorder | None
    watching_share: float
    version: str

    @property
    def steps(self) -> int:
        """On all legs."""
        return sum(leg.steps for leg in self.legs)

    def round_off(self, scene: Scene) -> float:
        """Bound of what absolute coordinates have cost the peaks, as a fraction."""
        return round_off(scene, self.made, self.steps, self.peaks.force, self.displacement)


@dataclass(frozen=True, eq=False)
class _Answer:
    """The peaks, in SI units, the run that everything else is taken from, and bounds of errors."""

    run: _Simulation
    peak_force: FloatArray
    peak_time: FloatArray
    steps: int
    error: float
    round_off: float


def _balance(
    scene: Scene, samples: Samples, velocity: FloatArray, mass: FloatArray, work: float
) -> Balance:
    """Momentum and energy from the masses, velocities, forces and overlaps that LAMMPS holds."""
    force = samples.contact_force[-1]
    pressed = np.maximum(samples.overlap[-1], 0.0)
    energy = 0.5 * np.sum(mass * velocity**2) + 0.4 * np.sum(force * pressed)
    momentum = float(np.sum(mass * velocity))
    return Balance(scene.applied_impulse, momentum, work, float(energy))
