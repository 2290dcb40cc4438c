"""The judgement of measured traces: first peaks, widths, travel times, and the whole trace."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.native.backend import Native
from hertzchain.errors import is_positive, require
from hertzchain.limits import TIME_LIMIT, TOLERANCE
from hertzchain.observables.definitions import context_of
from hertzchain.observables.result import Result
from hertzchain.scene.gauge import Gauge
from hertzchain.scene.given import SceneLike, to_scene
from hertzchain.showing import ShownVerdict, ShowProgress, telling
from hertzchain.verdict.check import Check, Kind, within
from hertzchain.verdict.traces.matching import FEWEST, Expected, aligned, expected, matched
from hertzchain.verdict.traces.traces import Traces, read_traces

if TYPE_CHECKING:
    import pandas

_ADVICE = "the scene is not what was measured, or the calibration is not what was given"
PEAK = Kind("first peak [N]", _ADVICE)
WIDTH = Kind("width of the first pulse [s]", _ADVICE)
TRAVEL = Kind("time of travel [s]", "the scene has another speed: try E, density, damping, loads")
ARRIVAL = Kind("arrival [s]", "the clock of the recording is not that of the scene")
TRACE = Kind("whole trace, rms of differences over the first peak", _ADVICE)

_DEVIATIONS = 3.0
"""Standard deviations of noise that are added to a tolerance: one of 400 is beyond."""

_PULSE = 0.1
"""Part of the largest force above which the reference is within a pulse."""

_NOISE = 1.2
"""Largest differences of a whole trace over the noise, which 200 quiet samples determine to 5 %:
four deviations."""


@dataclass(frozen=True)
class Number:
    """A number of measured first pulses, and that of the reference.

    Parameters
    ----------
    kind, of
        The quantity, and the names of its gauges.
    gauges
        The gauges; for two of them the number is the time from the second to the first.
    simulated, measured
        The numbers.
    error, deviation
        The bound on the error of the reference, and the standard deviation by the noise.
    """

    kind: Kind
    of: str
    gauges: tuple[Gauge, ...]
    simulated: float
    measured: float
    error: float
    deviation: float

    @property
    def name(self) -> str:
        """Gauges and quantity, as tables show them."""
        return f"{self.of}: {self.kind.name}"


@dataclass(frozen=True, eq=False, repr=False)
class TraceJudgement(ShownVerdict):
    """Measured traces against the reference; true if the verdict is ``pass``.

    Parameters
    ----------
    reference
        Result of the native reference method, with the gauges that were measured.
    traces
        The measured traces, less their offsets before the first arrival.
    known
        Readings of the gauges in the reference.
    shift
        Time on the measured clock at which the run begins [s].
    tolerance
        Largest relative difference that passes, besides the noise.
    numbers
        Each number of the first pulses that are complete.
    checks
        Each number that could be judged, and the whole traces.
    remarks
        Sentences on what could not be judged; usually empty.
    """

    reference: Result
    traces: Traces
    known: Expected
    shift: float
    tolerance: float
    numbers: tuple[Number, ...]
    checks: tuple[Check, ...]
    remarks: tuple[str, ...]

    @property
    def verdict(self) -> str:
        """``pass`` if something was judged and all of it passed, otherwise ``fail``."""
        passed = bool(self.checks) and all(check.passed for check in self.checks)
        return "pass" if passed else "fail"

    def to_dict(self) -> dict[str, Any]:
        """Return the judgement as a JSON object."""
        return {
            "verdict": self.verdict,
            "tolerance": self.tolerance,
            "shift_s": self.shift,
            "known_until_s": self.known.until,
            "checks": [check.to_dict() for check in self.checks],
            "remarks": list(self.remarks),
            "reference": self.reference.numbers(),
            **context_of(self.reference.scene),
        }


def judge_traces(
    scene: SceneLike,
    traces: Path | str | pandas.DataFrame,
    *,
    columns: Mapping[str, str] | None = None,
    tolerance: float = TOLERANCE,
    shift: bool = True,
    time_limit: float = TIME_LIMIT,
    progress: ShowProgress = None,
) -> TraceJudgement:
    """Judge measured forces over time: each first pulse, times between them, and all samples.

    Parameters
    ----------
    scene
        The scene that was measured, or the path of its file; its own gauges do not matter.
    traces
        Forces over time of one or several gauges, without static forces: a text file in any layout,
        as oscilloscopes write it, or a pandas table, with the columns time_s and gauge_16_N (in
        granule 16), contact_10_N, wall_N, near_wall_N, or any that ``columns`` names.
    columns
        Columns by ``time``, ``gauge_16``, ``contact_10``, ``wall``, and the size of their unit:
        ``{"gauge_16": "CH1 [25 N]"}``.
    tolerance
        Largest relative difference that passes, besides noise; between 0 and 1.
    shift
        Whether the measured clock may begin at another time than the run; this time is then found.
    time_limit
        Time limit of each run of the reference [s].
    progress
        True for a line in the terminal on what is being done, or a function that is
        called with each such line.

    Raises
    ------
    SceneError
        For anything but a scene, gauges that it cannot have, or samples without information.
    HertzchainError
        For a file that cannot be read, or columns that it does not have.
    RunFailed
        If the reference cannot be computed.
    """
    allowed = "must be a number above 0 and below 1"
    require(is_positive(tolerance) and tolerance < 1, "tolerance", tolerance, allowed)
    scene = to_scene(scene)
    measured = read_traces(scene, traces, columns or {})
    with telling(progress) as report_progress:
        report_progress("native: the reference method")
        known = expected(scene, measured.gauges, Native("reference", time_limit=time_limit))
        report_progress("laying the traces over those of the reference")
        measured, begin = aligned(measured, known, None if shift else 0.0)
        pulses = [matched(measured, known, begin, k) for k in range(len(measured.gauges))]
    numbers = _numbers_of(known, pulses, has_clock=not shift)
    remarks, checks = list(measured.remarks), []
    for gauge, pulse in zip(measured.gauges, pulses, strict=True):
        if pulse is None:
            said = "the first pulse is not whole, only the trace is judged"
            remarks.append(f"{gauge.place}: {said}")
    for one in numbers:
        noise, most = _DEVIATIONS * one.deviation, tolerance * one.simulated
        largest = most + noise + one.error
        if noise > most and abs(one.measured - one.simulated) <= largest:
            remarks.append(
                f"{one.name} is not judged, three deviations of its noise,"
                f" {noise / one.simulated:.1e}, hide the tolerance of {tolerance:.1e}"
            )
            continue
        reason = "what was asked for, three deviations of the noise, and the error of the reference"
        checks.append(within(one.kind, one.of, one.measured, one.simulated, largest, reason))
    for k in range(len(pulses)):
        whole = _whole(measured, known, begin, k, tolerance)
        if whole is None:
            said = "nothing was measured within a pulse of the reference"
            remarks.append(f"{measured.gauges[k].place}: {said}")
        else:
            checks.append(whole)
    return TraceJudgement(
        known.result, measured, known, begin, float(tolerance), tuple(numbers), tuple(checks),
        tuple(remarks),
    )  # fmt: skip


def _numbers_of(
    known: Expected, pulses: Sequence[tuple[FloatArray, FloatArray] | None], *, has_clock: bool
) -> list[Number]:
    """Return the numbers of the first pulses that are complete."""
    found, there = [], []
    for read, pulse in zip(known.readings, pulses, strict=True):
        if pulse is None:
            continue
        (height, stretch, delay), (high, wide, late) = (one.tolist() for one in pulse)
        of, gauges, force, width = read.gauge.place, (read.gauge,), read.force, read.width
        # The pulse is stretched about its crest.
        arrival = read.arrival + delay - (stretch - 1) * (read.time - read.arrival)
        own = [
            Number(PEAK, of, gauges, force, height * force, read.force_error * force, high * force),
            Number(WIDTH, of, gauges, width, stretch * width, read.width_error, wide * width),
            Number(ARRIVAL, of, gauges, read.arrival, arrival, read.arrival_error, late),
        ]
        found += own[: 2 + has_clock]
        there.append((read, delay, late))
    there.sort(key=lambda one: one[0].time)
    for (before, early, sooner), (after, late, later) in itertools.pairwise(there):
        true = after.time - before.time
        if true > 0 and not has_clock:
            found.append(Number(
                TRAVEL, f"{before.gauge.place} to {after.gauge.place}",
                (after.gauge, before.gauge), true, true + late - early,
                before.arrival_error + after.arrival_error, float(np.hypot(sooner, later)),
            ))  # fmt: skip
    return found


def _whole(traces: Traces, known: Expected, shift: float, k: int, tolerance: float) -> Check | None:
    """Judge all samples of a gauge at which the reference is known; None if it has no pulse."""
    time = traces.time - shift
    during = (time >= 0) & (time <= known.until)
    peak = float(np.max(np.abs(known.force[known.time <= known.until, k])))
    true = known.at(k, time[during])
    is_pulse = np.abs(true) > _PULSE * peak
    if np.count_nonzero(is_pulse) < FEWEST:
        return None
    off = (traces.force[during, k] - true) / peak
    # Quiet samples must not hide a difference within a pulse.
    rms = max(float(np.sqrt(np.mean(some**2))) for some in (off, off[is_pulse]))
    reason = f"what was asked for, and {_NOISE:g} times the noise of the samples"
    allowed = float(np.hypot(tolerance, _NOISE * float(traces.noise[k]) / peak))
    return within(TRACE, traces.gauges[k].place, rms, 0.0, allowed, reason)
