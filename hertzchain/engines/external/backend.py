"""Scene in, result out, by a function that runs another code once with given steps."""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from hertzchain.arrays import FloatArray
from hertzchain.engines.external import step_error
from hertzchain.engines.external.observation import Simulation
from hertzchain.engines.external.rescaling import predicted_loss
from hertzchain.errors import POSITIVE, Unpredictable, is_positive, require
from hertzchain.observables import error_bound
from hertzchain.observables.history import History
from hertzchain.observables.peaks import ESTIMATED, PeakWatch, largest_difference
from hertzchain.observables.result import LostDigits, Result, peaks_of_result
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg
from hertzchain.scene.validity import (
    largest_overlap_ratio,
    refuse_deep_overlap,
    refuse_hopeless_overlap,
)

_READING_INTERVAL = 0.3  # natural time units at steps of 0.01: 7e-9 of a peak; goes as 1 / dt
_DAMPED_INTERVAL = 0.1  # natural time units between readings of damped contacts: see ``step_error``
_RECORDING_INTERVAL = 0.1  # natural time units; at 0.3 opening contacts leave 5e-5 in velocities
_KINK_PER_STEP = 0.02  # of a peak, over the square of a step that is asked for [natural units]
_READINGS_PER_RAMP = 8  # at least, if there are so many steps: the work of a short pulse needs them
_TRIES = 3  # runs to get below the wanted error: the first estimate may be a little too long
_HALVINGS = 6  # of the steps, at most, until an extrapolation is as good as wanted
STABLE = 2.0  # largest product of step and frequency of velocity Verlet: see ``stable_step``
_ERRATIC_STEP = 0.05  # natural time units; above, opening contacts may hide the error of two runs
_PILOT_STEP = 0.04  # natural time units; first of the runs that find the step for a wanted error
_COARSEST_STEP = 0.065  # natural time units; first of three runs to be extrapolated, for 1e-6
_COARSEST_DAMPED_STEP = 0.008  # the same for damped contacts, first of four runs
_PLAIN_IF_DAMPED = 1e-4  # of the peaks; smaller errors would take first-order steps without end
_UNSTABLE = 0.5  # of the longest stable step, at most where a step is chosen for damped contacts

Simulate = Callable[[Sequence[Leg], Sequence[int], FloatArray | None], Simulation]
"""Runs a scene once: legs, steps between two readings on each, wanted times of a history."""


@dataclass(frozen=True)
class Steps:
    """Which steps are taken, and how often they are looked at."""

    dt: float | None  # the largest [s]; None for one whose estimated error is at most ``rtol``
    read_every: int | None  # steps between readings, in the coarsest run; None for 0.3 time units
    rtol: float  # wanted relative error of the peaks, where no step is asked for
    extrapolated: bool  # peaks from two runs, one with half the steps of the other (Richardson)

    def __post_init__(self) -> None:
        if self.dt is not None:
            require(is_positive(self.dt), "dt", self.dt, f"{POSITIVE} [s]")
        if self.read_every is not None:
            require(self.read_every >= 1, "read_every", self.read_every, "must be at least 1")
        allowed = "must be a number above 0 and below 1"
        require(is_positive(self.rtol) and self.rtol < 1, "rtol", self.rtol, allowed)


def run(
    scene: Scene,
    simulate: Simulate,
    steps: Steps,
    times: FloatArray | None,
    code: str,
    method: str,
) -> Result:
    """Simulate a scene by another code, with the error of its peaks.

    ``code`` is what it is called, in small letters the name of its backend; ``method`` is what the
    result says of how it was computed; ``times`` are those of a history [s], if any is wanted.
    """
    begin = time.perf_counter()
    refuse_hopeless_overlap(scene)
    error_bound.refuse_strong_dampers(scene)
    runner = _Runner(scene, simulate, steps)
    answer = runner.answer()
    found = answer.run
    if not answer.round_off < 1:
        raise Unpredictable(
            f"{code} cannot resolve the overlaps of this scene beside its coordinates: take"
            " a shorter chain or a shorter pulse"
        )
    longest = max(leg.dt for leg in found.legs)
    asked = steps.dt is not None
    error_bound.refuse_meaningless(
        code, answer.error, asked and longest > error_bound.SHORT * scene.contact_time
    )
    refuse_deep_overlap(largest_overlap_ratio(scene, answer.peak_force))
    history = None if times is None else runner.history(found.legs, times)
    return Result(
        scene=scene,
        backend=code.lower(),
        scheme="velocity-verlet",
        method=", ".join([method, *["extrapolated"] * runner.extrapolated]),
        dt=longest,
        steps=answer.steps,
        force_evaluations=answer.steps,
        **peaks_of_result(scene, answer.peak_force, answer.peak_time, found.peaks.passed),
        error_estimate=answer.error,
        displacement=found.displacement,
        velocity=found.velocity,
        balance=found.balance,
        history=history,
        wall_time=time.perf_counter() - begin,
        versions={code.lower(): found.version},
        watching_share=found.watching_share,
        lost_digits=LostDigits(
            found.made.scene(scene).chain.first_modulus,
            predicted_loss(scene, found.steps),
            answer.round_off,
        ),
    )


def peaks_alone(
    scene: Scene, simulate: Simulate, steps: Steps, dt: float
) -> tuple[FloatArray, int]:
    """Peak forces [N], shape (contacts,), and the number of steps, of one run or the two needed."""
    runner = _Runner(scene, simulate, steps)
    legs = scene.schedule(2 * dt if steps.extrapolated else dt)
    strides = [runner.stride(leg, recording=False) for leg in legs]
    found = runner.simulate(legs, strides)
    if not steps.extrapolated:
        return found.peaks.force, found.steps
    halved = tuple(replace(leg, steps=2 * leg.steps) for leg in legs)
    finer = runner.simulate(halved, [2 * stride for stride in strides])
    return step_error.extrapolate(found, finer, runner.order)[0], found.steps + finer.steps


@dataclass(frozen=True, eq=False)
class _Answer:
    """The peaks, in SI units, the run that everything else is taken from, and bounds of errors."""

    run: Simulation
    peak_force: FloatArray
    peak_time: FloatArray
    steps: int
    error: float
    round_off: float


@dataclass(frozen=True)
class _Runner:
    """One scene, one code, and which steps to take."""

    scene: Scene
    once: Simulate
    steps: Steps

    @property
    def order(self) -> int:
        """Of velocity Verlet: damping takes velocities of half a step before."""
        return 2 if self.scene.contact is None else 1

    @property
    def extrapolated(self) -> bool:
        """Whether peaks are extrapolated: as asked, or as damped ones that are to be this right."""
        steps = self.steps
        needed = self.order == 1 and steps.dt is None and steps.rtol < _PLAIN_IF_DAMPED
        return steps.extrapolated or needed

    def answer(self) -> _Answer:
        return self._extrapolated() if self.extrapolated else self._plain()

    def history(self, legs: Sequence[Leg], times: FloatArray) -> History:
        """Record in one more run with closer readings, which must not change the peaks."""
        strides = [self.stride(leg, recording=True) for leg in legs]
        recorder = self.simulate(legs, strides, times).recorder
        assert recorder is not None
        return recorder.history(times)

    def simulate(
        self, legs: Sequence[Leg], strides: Sequence[int], times: FloatArray | None = None
    ) -> Simulation:
        error_bound.refuse_unstable(self.scene, legs, STABLE, "velocity-verlet")
        return self.once(legs, strides, times)

    def _plain(self) -> _Answer:
        """Run with the step asked for, or with one whose error is as small as wanted."""

        def peaks_at(dt: float) -> FloatArray:
            return self._rough_peaks(self.scene.schedule(dt))

        dt = self.steps.dt or self._step_for(peaks_at)
        for _ in range(_TRIES):
            legs = self.scene.schedule(dt)
            strides = [self.stride(leg, recording=False) for leg in legs]
            run = self.simulate(legs, strides)
            lost = run.round_off(self.scene)
            by_steps = self._step_error(legs, run.peaks)
            error = by_steps + step_error.interpolation_error(self.scene, legs, strides) + lost
            if self._is_enough(by_steps, error, lost):
                break
            excess = self.steps.rtol / error
            if self.order == 2:
                dt *= max(0.25, 0.9 * math.sqrt(excess))
            else:
                dt *= max(0.05, 0.9 * excess)
        return _Answer(run, run.peaks.force, run.peaks.time, run.steps, error, lost)

    def _extrapolated(self) -> _Answer:
        """Extrapolate from two runs, read at the same times; a third says how good that is.

        Where contacts are damped a fourth does, too: two extrapolations can agree by chance.
        """
        needed = 3 if self.order == 2 else 4
        legs = self.scene.schedule(
            self._coarsest_step() if self.steps.dt is None else 2 ** (needed - 1) * self.steps.dt
        )
        strides = [self.stride(leg, recording=False) for leg in legs]
        runs: list[Simulation] = []
        for k in range(needed + _HALVINGS):
            finer = tuple(replace(leg, steps=2**k * leg.steps) for leg in legs)
            apart = [2**k * stride for stride in strides]
            runs = [*runs[1 - needed :], self.simulate(finer, apart)]
            if len(runs) < needed:
                continue
            found = [step_error.extrapolate(*pair, self.order) for pair in itertools.pairwise(runs)]
            after, last = found[-1], runs[-1]
            # The error falls by 4 with half the steps, at the least that is expected.
            difference = max(
                largest_difference(one[0], other[0], ESTIMATED) / 4**later
                for later, (other, one) in enumerate(itertools.pairwise(reversed(found)))
            )
            by_steps = step_error.extrapolation_error(self.scene, finer, difference, last.peaks)
            by_steps += step_error.rival_error(last.peaks, after[0])
            grows, lost = 2**self.order, runs[-2].round_off(self.scene)
            lost = (grows * last.round_off(self.scene) + lost) / (grows - 1)
            error = by_steps + step_error.interpolation_error(self.scene, finer, apart) + lost
            if self._is_enough(by_steps, error, lost):
                break
        return _Answer(last, *after, runs[-2].steps + last.steps, error, lost)

    def _step_for(self, peaks_at: Callable[[float], FloatArray]) -> float:
        """The step [s] for the wanted error, by trials."""
        pilot = _PILOT_STEP * self.scene.contact_time
        if self.scene.contact is None:
            return error_bound.second_order_step(peaks_at, pilot, self.steps.rtol)
        longest = _UNSTABLE * error_bound.stable_step(self.scene, STABLE)
        step = error_bound.first_order_step(
            self.scene, peaks_at, min(pilot, longest), self.steps.rtol
        )
        return min(step, longest)

    def _coarsest_step(self) -> float:
        """The first of the steps to be extrapolated [s]; longer ones are no use to that."""
        unit, part = self.scene.contact_time, self.steps.rtol / 1e-6
        if self.scene.contact is None:  # of fourth order
            return min(_COARSEST_STEP * math.pow(part, 1 / 4), 0.4) * unit
        longest = _UNSTABLE * error_bound.stable_step(self.scene, STABLE)
        return min(min(_COARSEST_DAMPED_STEP * math.sqrt(part), 0.2) * unit, longest)

    def _is_enough(self, by_steps: float, error: float, lost: float) -> bool:
        """Whether shorter steps are not wanted, or no help beside what round-off costs."""
        return self.steps.dt is not None or error <= self.steps.rtol or by_steps <= lost

    def _rough_peaks(self, legs: Sequence[Leg]) -> FloatArray:
        """Peaks of a run that only tells the error of another: read as rarely as possible."""
        strides = [self._longest_stride(leg) for leg in legs]
        return self.simulate(legs, strides).peaks.force

    def stride(self, leg: Leg, recording: bool) -> int:
        """Steps between two readings on a leg."""
        if self.steps.read_every is not None:
            return self.steps.read_every
        stride = self._longest_stride(leg)
        if recording:
            stride = min(stride, int(_RECORDING_INTERVAL * self.scene.contact_time / leg.dt))
        if leg.ramp is not None:
            stride = min(stride, leg.steps // _READINGS_PER_RAMP)
        return max(1, stride)

    def _longest_stride(self, leg: Leg) -> int:
        """Steps between readings, which cost what round-off does, or 0.1 of the wanted error."""
        unit = self.scene.contact_time
        if self.scene.contact is not None:
            return max(1, int(min(leg.steps, self._damped_interval * unit / leg.dt)))
        interval = _READING_INTERVAL * math.pow(0.01 * unit / leg.dt, 1 / 8)
        if self.steps.dt is None:
            interval = min(
                interval, math.pow(0.1 * self.steps.rtol / step_error.INTERPOLATION, 1 / 8)
            )
        if error_bound.amplifies_errors(self.scene):
            asked, step = self.steps.dt, leg.dt / unit
            error = 0.1 * self.steps.rtol if asked is None else _KINK_PER_STEP * step**2
            interval = min(interval, math.pow(error / step_error.KINK, 1 / 3.5))
        return max(1, int(min(leg.steps, interval * unit / leg.dt)))

    @property
    def _damped_interval(self) -> float:
        """Natural time units between readings of damped contacts, at most."""
        if self.steps.dt is not None:
            return _DAMPED_INTERVAL
        wanted = math.pow(0.1 * self.steps.rtol / step_error.DAMPED_INTERPOLATION, 1 / 5)
        return min(_DAMPED_INTERVAL, wanted)

    def _step_error(self, legs: Sequence[Leg], peaks: PeakWatch) -> float:
        """Bound of what the steps cost the peaks, as a fraction."""
        stable, rising = error_bound.stable_step(self.scene, STABLE), peaks.any_rising
        if self.scene.contact is not None:
            runs = error_bound.first_order_runs(legs, stable)
            return error_bound.first_order_safety(self.scene, rising) * self._largest(runs, peaks)
        others = [error_bound.coarser_run(legs, stable)]
        longest = max(leg.dt for leg in legs) / self.scene.contact_time
        if longest > _ERRATIC_STEP or rising or error_bound.amplifies_errors(self.scene):
            others.append(error_bound.finer_run(legs))
        return error_bound.second_order_safety(longest, rising) * self._largest(others, peaks)

    def _largest(self, others: Sequence[error_bound.SecondRun], peaks: PeakWatch) -> float:
        """The largest estimate of the error that runs with other steps give."""
        return max(
            other.factor * largest_difference(self._rough_peaks(other.legs), peaks.force, ESTIMATED)
            for other in others
        )
