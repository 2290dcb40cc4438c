"""Measured forces over time: read, compared with a run, and judged."""

from __future__ import annotations

import itertools
import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hertzchain.arrays import FloatArray, Source
from hertzchain.engines.native.backend import Native
from hertzchain.errors import HertzchainError, require
from hertzchain.limits import TIME_LIMIT, TOLERANCE, check_tolerance
from hertzchain.observables.gauges import Reading, force_over_time
from hertzchain.observables.result import Result
from hertzchain.observables.samples import History
from hertzchain.progress import ShowProgress, telling
from hertzchain.pulses.recording import (
    Columns,
    columns_of,
    noise_before,
    noise_within,
    read_columns,
    read_recording,
    resolution_of,
)
from hertzchain.scene.keys import to_si
from hertzchain.scene.scene import Scene, SceneLike, to_scene
from hertzchain.scene.terms import Gauge
from hertzchain.verdict.check import Check, CheckedVerdict, Kind, within

if TYPE_CHECKING:
    import pandas
    from scipy.interpolate import CubicSpline


_SENSOR = re.compile(r"(gauge|contact)_(\d+)|(?:near_)?wall")
_COLUMN = re.compile(rf"({_SENSOR.pattern})(?:[ _/([]*[a-zA-Z]+[)\]]*)?")
_TIME = re.compile(r"(?:time|t)(?:[ _(/\[]+(?:s|ms|us|µs|ns)[)\]]*)?", re.IGNORECASE)
_SPEC = re.compile(r"\s*(?P<name>.*?)\s*(?:\[(?P<unit>[^\[\]]+)\])?\s*")


ENOUGH_QUIET_SAMPLES = 200
"""Quiet samples that give the noise to 5 %; with fewer, second differences of all are better."""


@dataclass(frozen=True, eq=False)
class Traces:
    """Forces over time of several gauges on one clock.

    Parameters
    ----------
    time
        Increasing times [s], shape (samples,); their zero is not known.
    gauges
        The gauges that were measured.
    force
        Without static forces [N], shape (samples, gauges).
    noise
        Standard deviation of the noise of each gauge [N], shape (gauges,).
    clock
        A sentence on the clock of several files; empty for one.
    """

    time: FloatArray
    gauges: tuple[Gauge, ...]
    force: FloatArray
    noise: FloatArray
    clock: str = ""

    @property
    def remarks(self) -> tuple[str, ...]:
        """Sentences on the clock of several files, and on gauges that were clipped."""
        counts = [_clipped(force) for force in self.force.T]
        return (*filter(None, [self.clock]), *(
            f"{gauge.place}: {count} samples have the largest value, as those of a clipped"
            " recording: measure it again in a wider range of the instrument"
            for gauge, count in zip(self.gauges, counts, strict=True)
            if count
        ))  # fmt: skip


def _clipped(force: FloatArray) -> int:
    """Return how many samples have the largest value of a clipped trace; 0 for others.

    A crest is flat, too, by the digits of a recording, but falls by a few of these next to it.
    """
    largest = force.max()
    at = np.flatnonzero(force == largest)
    digit = np.min(np.diff(np.unique(force[force > largest / 2])), initial=largest)
    fall = largest - force[max(at[0] - at.size, 0)]
    # Least samples with the largest value of a clipped trace (chosen)
    # Largest fall of a crest next to as many flat samples, in digits: a parabola falls by 9
    return at.size if at.size >= 4 and fall > 16.0 * digit else 0


def is_traces(names: Sequence[str], columns: Mapping[str, str]) -> bool:
    """Return whether columns of these names, or with these roles, are traces of some gauges."""
    return any(map(_SENSOR.fullmatch, columns)) or any(map(_COLUMN.fullmatch, names))


def names_in(results: Source) -> Sequence[str]:
    """Return the names of the columns of a file or table; empty for anything else."""
    try:
        return _columns_of(results).names
    except (HertzchainError, TypeError):
        return ()


def _columns_of(results: Source) -> Columns:
    return columns_of(results) if hasattr(results, "columns") else read_columns(Path(results))


def read_records(
    scene: Scene, files: Sequence[Source], columns: Mapping[str, str], own_clocks: bool = False
) -> list[Traces]:
    """Return the traces of files or pandas tables, one for each clock.

    Files of different gauges are channels of one record and share its clock, unless ``own_clocks``;
    files with a gauge in common are several records. Columns and errors are those of
    ``read_traces``; in a shared record, each gauge's column is in one of the files.
    """
    import pandas

    read = [_columns_of(file) for file in files]
    parts = [_columns_in(each, columns) for each in read]
    for role in columns.keys() - {role for part in parts for role in part}:
        read[0].find("--column", _spec(role, columns[role])[0])  # raises: no file has it
    roles = [role for each in zip(read, parts, strict=True) for role, _ in _named(*each)]
    gauges = [gauge_of(role, scene) for role in roles]
    is_one = len(read) > 1 and not own_clocks and len({*gauges}) == len(gauges)
    if not is_one:
        records = [read_traces(scene, each, columns) for each in read]
        said = "each file has a clock of its own" if len(read) > 1 else ""
        return [replace(records[0], clock=said), *records[1:]]
    channels = [read_traces(scene, *each) for each in zip(read, parts, strict=True)]
    first, sizes = channels[0].time, [channel.time.size for channel in channels]
    # Largest difference of times of files of one record, over a sample: digits of files (chosen)
    off = 0.01 * float(np.median(np.diff(first)))
    whole = pandas.DataFrame({"time": first})
    for each, channel in zip(read, channels, strict=True):
        names = [gauge.place for gauge in channel.gauges]
        table = pandas.DataFrame(channel.force, columns=names).assign(time=channel.time)
        whole = pandas.merge_asof(
            whole,
            table,
            on="time",
            direction="nearest",
            tolerance=off,  # type: ignore[arg-type]
        ).dropna()
        # Least share of a file's samples whose times all files of its record have (chosen): gaps
        # are few, and a file of half the rate has half of the times
        if len(whole) < 0.9 * max(channel.time.size, first.size):
            raise HertzchainError(
                f"{each.path}: has other times than {read[0].path}, and files of one record have"
                " the same: judge each record by itself, or fit them with --own-clocks"
            )
    said = "the files are of one record, on one clock"
    if left := max(sizes) - len(whole):
        said += f"; {left:,} samples that not all of them have are left out"
    noise = np.concatenate([channel.noise for channel in channels])
    force = whole.drop(columns="time").to_numpy()
    return [Traces(whole["time"].to_numpy(), tuple(gauges), force, noise, said)]


def _columns_in(read: Columns, columns: Mapping[str, str]) -> dict[str, str]:
    """Return those of some columns, by their roles, that a file has."""
    some = {}
    for role, text in columns.items():
        with suppress(HertzchainError):
            read.find("--column", _spec(role, text)[0])
            some[role] = text
    return some


def _named(read: Columns, columns: Mapping[str, str]) -> list[tuple[str, tuple[str, str]]]:
    """Return the columns of gauges: role, name and unit of each."""
    sensors = [(role, _spec(role, text)) for role, text in columns.items() if role != "time"]
    matches = filter(None, map(_COLUMN.fullmatch, read.names))
    return sensors or [(match[1], (match[0], "")) for match in matches]


def read_traces(scene: Scene, results: Source, columns: Mapping[str, str]) -> Traces:
    """Return the traces of a file or a pandas table with a column of times.

    ``columns`` are those by ``time``, ``gauge_16``, ``contact_10``, ``wall``: names or numbers from
    1, with the size of their unit, ``"CH1 [25 N]"``. Without them columns of these names are taken.
    SceneError for gauges that the scene cannot have, and samples without information;
    HertzchainError for a file that cannot be read, or columns that it does not have.
    """
    read = results if isinstance(results, Columns) else _columns_of(results)
    of_times = [(name, "") for name in read.names if _TIME.fullmatch(name)]
    time, unit = next(iter(of_times), (None, ""))
    if "time" in columns:
        time, unit = _spec("time", columns["time"])
    named = _named(read, columns)
    allowed = (
        f"has the columns {', '.join(read.names[:8])}: name those of gauges, as by --column"
        " 'gauge_16=CH1 [25 N]'"
    )
    require(bool(named), "traces", None, allowed)
    gauges = tuple(gauge_of(role, scene) for role, _ in named)
    require(len(set(gauges)) == len(gauges), "traces", None, "have a gauge twice")
    read = read.without_gaps([read.find("--column", name) for _, (name, _) in named])
    forces, noise = [], []
    for role, (name, newtons) in named:
        scale = to_si(f"column {role}", newtons, "N") if newtons else None
        try:
            recording = read_recording(read, time, name, unit.removeprefix("1 ") or None, scale)
        except HertzchainError as problem:  # options of the command pulse
            said = str(problem).replace("--time and --force", "--column")
            said = said.replace("--force", "--column").replace("--time", "--column")
            said = said.replace("--scale", "--column 'gauge_16=NAME [25 N]'")
            raise HertzchainError(said) from None
        require(bool(np.any(recording.force)), role, None, "is 0 throughout: nothing was measured")
        forces.append(recording.force)
        # Second differences have part of a pulse's curvature.
        step = float(np.median(np.diff(recording.time)))
        noise.append(noise_within(recording.force, step, resolution_of(recording.force)).deviation)
    return Traces(recording.time, gauges, np.stack(forces, axis=1), np.array(noise))


def _spec(role: str, text: str) -> tuple[str, str]:
    """Return the name of a column and its unit as a quantity; empty if not given."""
    match = _SPEC.fullmatch(str(text))
    assert match is not None  # of any text
    unit = match["unit"] or ""
    if unit and not unit[:1].isdigit() and unit[:1] not in "+-.":
        unit = f"1 {unit}"
    allowed = "must be the name or number of a column, and its unit: 'CH1 [25 N]'"
    require(bool(match["name"]), f"column {role}", text, allowed)
    return match["name"], unit


def column_of(gauge: Gauge, scene: Scene) -> str:
    """Return the name of a gauge's column without its unit, such as ``gauge_16``."""
    return gauge.name(scene.last_contact if scene.wall else None).removesuffix("_N")


def gauge_of(role: str, scene: Scene, where: str = "column") -> Gauge:
    """Return the gauge of a column, or of ``where`` it is named; SceneError if there is none."""
    allowed = "must be gauge_ and the number of a granule, contact_ and its number, wall, near_wall"
    require(_SENSOR.fullmatch(role) is not None, where, role, allowed)
    walls = {"wall": (scene.wall, scene.last_contact), "near_wall": (scene.near_wall, 1)}
    if role in walls:
        wall, contact = walls[role]
        require(wall is not None, role, None, f"is not a gauge of a scene without [{role}]")
        return Gauge(contact=contact)
    kind, _, number = role.partition("_")
    gauge = Gauge(**{"granule" if kind == "gauge" else "contact": int(number)})
    gauge.check(scene.chain.granules, scene.wall is not None, scene.near_wall is not None)
    return gauge


_TWICE = (
    "have a gauge twice: judge each record by itself, or name columns by names that only one file"
    " has, as a number is that of a column in every file"
)

_TIMES_PER_WIDTH, _MOST_TIMES = 60, 20_000
"""Recorded times for each width of the narrowest pulse: a cubic spline is within 1e-6 of its force
(measured); and the most of them."""

_SHIFTS_PER_WIDTH = 10
"""Steps of the search for the shift for each width; least squares find the rest."""

_DRIFT_DEVIATIONS = 5.0
"""Slope of differences, over its deviation by white noise, above which it is real (chosen)."""


FEWEST_SAMPLES = 8
"""Fewest samples of a first pulse that determine its height, time and width."""


@dataclass(frozen=True, eq=False)
class Expected:
    """Forces of the gauges of a scene over time.

    Parameters
    ----------
    result
        A run with these gauges.
    time
        Times [s], shape (times,).
    force
        Without static forces [N], shape (times, gauges).
    until
        From this time on the forces are not known [s]: collisions amplify errors.
    """

    result: Result
    time: FloatArray
    force: FloatArray
    until: float

    @property
    def readings(self) -> tuple[Reading, ...]:
        """The first pulse of each gauge."""
        return self.result.gauges

    @cached_property
    def _curves(self) -> list[CubicSpline]:
        from scipy.interpolate import CubicSpline

        return [CubicSpline(self.time, force) for force in self.force.T]

    def at(self, gauge: int, time: FloatArray) -> FloatArray:
        """Force of a gauge at times [N]; 0 before the start, that at the end after it."""
        force = self._curves[gauge](np.clip(time, 0.0, self.time[-1]))
        return np.where(time < 0, 0.0, force)


def expected_of(scene: Scene, gauges: tuple[Gauge, ...], native: Native) -> Expected:
    """Run a scene with gauges, and record their forces until its end.

    SceneError if no pulse arrives at any of them.
    """
    result = native.run(replace(scene, gauges=gauges))
    widths = np.array([reading.width for reading in result.gauges])
    allowed = "reads no whole first pulse in this scene: name others, or give a later end_time"
    require(bool(np.isfinite(widths).any()), "gauge", None, allowed)
    end = result.scene.end_time
    count = int(min(_TIMES_PER_WIDTH * end / np.nanmin(widths), _MOST_TIMES)) + 2
    time = np.linspace(0.0, end, count)
    rough = Native(rtol=1e-6, time_limit=native.time_limit)
    force, other = (
        read_in(result.scene, gauges, run.history)
        for run in (
            replace(engine, peaks_only=False, wanted="first").run(
                replace(result.scene, gauges=()), time
            )
            for engine in (native, rough)
        )
    )
    # Difference of two accurate runs, over the peak, from which on later forces are not known
    off = np.abs(other - force) > 1e-4 * np.max(np.abs(force), axis=0)
    unsure = np.flatnonzero(off.any(axis=1))
    last = np.nanmax([reading.arrival + reading.width for reading in result.gauges])
    until = end if not unsure.size else max(float(time[unsure[0]]), float(last))
    return Expected(result, time, force, until)


def read_in(scene: Scene, gauges: tuple[Gauge, ...], history: History | None) -> FloatArray:
    """Return the forces of gauges in a history [N], shape (times, gauges)."""
    assert history is not None
    return np.stack([force_over_time(scene, gauge, history) for gauge in gauges], axis=1)


def without_offset(traces: Traces, expected: Expected, shift: float) -> Traces:
    """Return traces less their mean before anything arrived, if there are enough samples.

    Their noise is the deviation of these samples, if there are ``ENOUGH_QUIET_SAMPLES``.
    """
    force, noise = traces.force.copy(), traces.noise.copy()
    for k, read in enumerate(expected.readings):
        width = read.width if np.isfinite(read.width) else 0.0
        arrival = min(read.arrival, expected.until)  # the latter where nothing arrives
        # Where contacts are unloaded before they are pressed, the gauge is quiet until then.
        strength = np.abs(expected.force[:, k])
        # Part of its largest force below which a gauge is quiet (chosen): that of most is far below
        # two widths before a pulse arrives
        moves = strength > 1e-4 * np.max(strength)
        quiet = min(arrival - 2 * width, float(expected.time[np.argmax(moves)]))
        before = force[traces.time - shift < quiet, k]
        if before.size >= FEWEST_SAMPLES:
            force[:, k] -= before.mean()
        if before.size >= ENOUGH_QUIET_SAMPLES:
            step = float(np.median(np.diff(traces.time)))
            # Digits may show in the pulse alone: no sample before it need differ from another.
            digit = max(resolution_of(before), resolution_of(force[:, k]))
            noise[k] = noise_before(before, step, digit).deviation
    return replace(traces, force=force, noise=noise)


def drift_of(time: FloatArray, off: FloatArray, noise: float, gauge: str, place: str) -> list[str]:
    """Return a sentence if differences [N] of a gauge follow a line that noise does not explain.

    ``gauge`` is the name of its column without its unit, ``place`` that in messages.
    """
    clock = time - time.mean()
    spread = float(np.sum(clock**2))
    slope = float(np.dot(clock, off)) / spread
    if abs(slope) < _DRIFT_DEVIATIONS * noise / np.sqrt(spread):
        return []
    drift = f"{place}: differences follow a line of {slope:+.2g} N/s, as of a gauge that drifts"
    return [f"{drift}: fit --free {gauge}.drift fits it as well"]


def shift_of(traces: Traces, expected: Expected) -> float:
    """Time on the measured clock at which the run begins [s], to a fraction of a pulse's width.

    It is the time with the largest correlation of all gauges with the reference, independent of
    their gain. SceneError if the correlation is larger with the opposite sign.
    """
    from scipy.signal import fftconvolve

    whole = [k for k, reading in enumerate(expected.readings) if np.isfinite(reading.width)]
    step = float(min(expected.readings[k].width for k in whole)) / _SHIFTS_PER_WIDTH
    size = int((traces.time[-1] - traces.time[0]) / step) + 1
    allowed = f"last {np.ptp(traces.time):.3g} s, which is less than a first pulse: check the unit"
    require(size > _SHIFTS_PER_WIDTH, "times", None, allowed)
    require(size < 100 * _MOST_TIMES, "times", None, "last far longer than the run: check the unit")
    grid = traces.time[0] + step * np.arange(size)
    clock = step * np.arange(int(expected.until / step) + 1, dtype=np.float64)
    product = np.zeros(size + clock.size - 1)
    energy, total = np.zeros_like(product), 0.0
    for k in whole:
        force = traces.force[:, k] - np.median(traces.force[:, k])
        measured = np.interp(grid, traces.time, force)
        model = expected.at(k, clock)
        scale = np.max(np.abs(model)) ** 2
        energy += fftconvolve(measured**2, np.ones(clock.size)) / scale
        product += fftconvolve(measured, model[::-1]) / scale
        total += float(np.sum(model**2)) / scale
    # With hardly any signal a correlation is by chance.
    least = 1e-6 * float(np.max(energy))
    correlation = product / np.sqrt(np.maximum(energy, least) * total)
    allowed = "are upside down: give a negative unit, such as 'gauge_16=CH1 [-25 N]'"
    require(bool(np.max(correlation) >= -np.min(correlation)), "forces", None, allowed)
    return float(traces.time[0] + step * (int(np.argmax(correlation)) - clock.size + 1))


def matched(
    traces: Traces, expected: Expected, shift: float, k: int
) -> tuple[FloatArray, FloatArray] | None:
    """Return a measured first pulse relative to the scene's, and deviations by noise, shape (3,).

    They are ratios of height and width, and a delay [s]. None if the pulse is not complete in scene
    or recording, or if its samples do not determine all three.
    """
    from scipy.optimize import least_squares

    read = expected.readings[k]
    if not np.isfinite(read.width):
        return None
    # End of the fit of a first pulse, in widths from its arrival: a little after the end of the
    # pulse, where it has fallen to a half
    begin, end = read.arrival - read.width, read.arrival + 1.2 * read.width
    during = (traces.time - shift >= begin) & (traces.time - shift <= end)
    time, force = traces.time[during] - shift, traces.force[during, k]
    if time.size < FEWEST_SAMPLES or time[-1] < read.arrival + read.width * 0.9:
        return None

    def residuals(p: FloatArray) -> FloatArray:
        height, stretch, delay = p
        there = read.time + (time - read.time - delay * read.width) / stretch
        return np.asarray((height * expected.at(k, there) - force) / read.force)

    solution = least_squares(residuals, [1.0, 1.0, 0.0], bounds=([0, 0.2, -3], [np.inf, 5, 3]))
    slopes, unit = np.asarray(solution.jac), np.array([1.0, 1.0, read.width])
    if np.linalg.matrix_rank(slopes) < unit.size:
        return None
    deviation = np.linalg.norm(np.linalg.pinv(slopes), axis=1)  # for samples with a deviation of 1
    return unit * solution.x, unit * deviation * float(traces.noise[k]) / read.force


def aligned(traces: Traces, expected: Expected, shift: float | None) -> tuple[Traces, float]:
    """Return traces without offsets, and the shift of their clock, found where it is not given."""
    at = shift_of(traces, expected) if shift is None else shift
    for _ in range(2):  # the second time with offsets from quiet times, which are known then
        traces = without_offset(traces, expected, at)
        if shift is not None:
            continue
        matches = [matched(traces, expected, at, k) for k in range(len(traces.gauges))]
        delays = np.array([(match[0][2], match[1][2]) for match in matches if match is not None])
        allowed = "have no whole first pulse of this scene: check clock, unit and gauges"
        require(delays.size > 0, "traces", None, allowed)
        # Samples limit the accuracy of the shift even without noise.
        # Least deviation of a delay, in widths, averaged over gauges: that of the splines
        least = 1e-6 * float(np.nanmin([reading.width for reading in expected.readings]))
        at += float(np.average(delays[:, 0], weights=1 / (delays[:, 1] + least) ** 2))
    return traces, at


_ADVICE = "the scene is not what was measured, or the calibration is not what was given"
PEAK = Kind("first peak [N]", _ADVICE)
WIDTH = Kind("width of the first pulse [s]", _ADVICE)
TRAVEL = Kind("time of travel [s]", "the scene has another speed: try E, density, damping, loads")
ARRIVAL = Kind("arrival [s]", "the clock of the recording is not that of the scene")
TRACE = Kind("whole trace, rms of differences over the first peak", _ADVICE)


_TRACE_OVER_NOISE = 1.2
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
class TraceJudgement(CheckedVerdict):
    """Measured traces against the reference; true if the verdict is ``pass``.

    Its checks are those of the first pulses, within tolerance and noise, and the whole traces.

    Parameters
    ----------
    traces
        The measured traces, less their offsets before the first arrival.
    expected
        Readings of the gauges in the reference.
    shift
        Time on the measured clock at which the run begins [s].
    numbers
        Each number of the first pulses that are complete.
    remarks
        Sentences on what could not be judged; usually empty.
    """

    traces: Traces
    expected: Expected
    shift: float
    numbers: tuple[Number, ...]
    remarks: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """Return the judgement as a JSON object."""
        return {
            **super().to_dict(),
            "shift_s": self.shift,
            "known_until_s": self.expected.until,
            "remarks": list(self.remarks),
        }


def judge_traces(
    scene: SceneLike,
    traces: Path | str | pandas.DataFrame | Sequence[Path | str | pandas.DataFrame],
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
        granule 16), contact_10_N, wall_N, near_wall_N, or any that ``columns`` names. Several files
        or tables are the channels of one record.
    columns
        Columns by ``time``, ``gauge_16``, ``contact_10``, ``wall``, and the size of their unit:
        ``{"gauge_16": "CH1 [25 N]"}``.
    shift
        Whether the measured clock may begin at another time than the run; this time is then found.
    tolerance, time_limit, progress
        As for ``judge``; noise adds to the tolerance.

    Raises
    ------
    SceneError
        For anything but a scene, gauges that it cannot have, or samples without information.
    HertzchainError
        For a file that cannot be read, or columns that it does not have.
    RunFailed
        If the reference cannot be computed.
    """
    check_tolerance(tolerance)
    scene = to_scene(scene)
    is_list = isinstance(traces, Sequence) and not isinstance(traces, str)
    files: list[Any] = list(traces) if is_list else [traces]  # type: ignore[arg-type]
    require(bool(files), "traces", None, "must be at least one file or table")
    measured, *others = read_records(scene, files, columns or {})
    require(not others, "traces", None, _TWICE)
    with telling(progress) as report_progress:
        report_progress("native: the reference method")
        expected = expected_of(scene, measured.gauges, Native("reference", time_limit=time_limit))
        report_progress("laying the traces over those of the reference")
        measured, begin = aligned(measured, expected, None if shift else 0.0)
        pulses = [matched(measured, expected, begin, k) for k in range(len(measured.gauges))]
        drifts = [_drift(measured, expected, begin, k) for k in range(len(measured.gauges))]
    numbers = _numbers_of(expected, pulses, has_clock=not shift)
    remarks, checks = [*measured.remarks, *itertools.chain(*drifts)], []
    for gauge, pulse in zip(measured.gauges, pulses, strict=True):
        if pulse is None:
            said = "the first pulse is not whole, only the trace is judged"
            remarks.append(f"{gauge.place}: {said}")
    for number in numbers:
        # Standard deviations of noise that are added to a tolerance: one of 400 is beyond
        noise, most = 3.0 * number.deviation, tolerance * number.simulated
        limit = most + noise + number.error
        if noise > most and abs(number.measured - number.simulated) <= limit:
            remarks.append(
                f"{number.name} is not judged, three deviations of its noise,"
                f" {noise / number.simulated:.1e}, hide the tolerance of {tolerance:.1e}"
            )
            continue
        why = "what was asked for, three deviations of the noise, and the error of the reference"
        checks.append(within(number.kind, number.of, number.measured, number.simulated, limit, why))
    for k in range(len(pulses)):
        whole = _whole(measured, expected, begin, k, tolerance)
        if whole is None:
            said = "nothing was measured within a pulse of the reference"
            remarks.append(f"{measured.gauges[k].place}: {said}")
        else:
            checks.append(whole)
    return TraceJudgement(
        expected.result, float(tolerance), tuple(checks), measured, expected, begin, tuple(numbers),
        tuple(remarks),
    )  # fmt: skip


def _numbers_of(
    expected: Expected, pulses: Sequence[tuple[FloatArray, FloatArray] | None], *, has_clock: bool
) -> list[Number]:
    """Return the numbers of the first pulses that are complete."""
    numbers, there = [], []
    for read, pulse in zip(expected.readings, pulses, strict=True):
        if pulse is None:
            continue
        (height, stretch, delay), (high, wide, late) = (values.tolist() for values in pulse)
        of, gauges, force, width = read.gauge.place, (read.gauge,), read.force, read.width
        # The pulse is stretched about its crest.
        arrival = read.arrival + delay - (stretch - 1) * (read.time - read.arrival)
        of_pulse = [
            Number(PEAK, of, gauges, force, height * force, read.force_error * force, high * force),
            Number(WIDTH, of, gauges, width, stretch * width, read.width_error, wide * width),
            Number(ARRIVAL, of, gauges, read.arrival, arrival, read.arrival_error, late),
        ]
        numbers += of_pulse[: 2 + has_clock]
        there.append((read, delay, late))
    there.sort(key=lambda arrival: arrival[0].time)
    for (before, early, sooner), (after, late, later) in itertools.pairwise(there):
        true = after.time - before.time
        if true > 0 and not has_clock:
            numbers.append(Number(
                TRAVEL, f"{before.gauge.place} to {after.gauge.place}",
                (after.gauge, before.gauge), true, true + late - early,
                before.arrival_error + after.arrival_error, float(np.hypot(sooner, later)),
            ))  # fmt: skip
    return numbers


def _drift(traces: Traces, expected: Expected, shift: float, k: int) -> list[str]:
    """Return a sentence if a gauge drifts before the pulse arrives."""
    read = expected.readings[k]
    quiet = traces.time - shift < read.arrival - 2 * read.width  # False where nothing arrives
    if np.count_nonzero(quiet) < ENOUGH_QUIET_SAMPLES:
        return []
    gauge = column_of(traces.gauges[k], expected.result.scene)
    time, force = traces.time[quiet], traces.force[quiet, k]
    return drift_of(time, force, float(traces.noise[k]), gauge, traces.gauges[k].place)


def _whole(
    traces: Traces, expected: Expected, shift: float, k: int, tolerance: float
) -> Check | None:
    """Judge all samples of a gauge at which the reference is known; None if it has no pulse."""
    time = traces.time - shift
    during = (time >= 0) & (time <= expected.until)
    peak = float(np.max(np.abs(expected.force[expected.time <= expected.until, k])))
    true = expected.at(k, time[during])
    # Part of the largest force above which the reference is within a pulse
    is_pulse = np.abs(true) > 0.1 * peak
    if np.count_nonzero(is_pulse) < FEWEST_SAMPLES:
        return None
    off = (traces.force[during, k] - true) / peak
    # Quiet samples must not hide a difference within a pulse.
    rms = max(float(np.sqrt(np.mean(some**2))) for some in (off, off[is_pulse]))
    reason = f"what was asked for, and {_TRACE_OVER_NOISE:g} times the noise of the samples"
    allowed = float(np.hypot(tolerance, _TRACE_OVER_NOISE * float(traces.noise[k]) / peak))
    return within(TRACE, traces.gauges[k].place, rms, 0.0, allowed, reason)
