"""Peaks and pulses computed elsewhere: read from tables and dumps, and judged."""

from __future__ import annotations

import io
import itertools
import math
import os
import re
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hertzchain.arrays import FloatArray, Source
from hertzchain.engines.lammps.reading.deck import UNITS, Units
from hertzchain.engines.native.backend import Native
from hertzchain.errors import POSITIVE, SceneError, is_positive, require
from hertzchain.files import read_bytes, text_in
from hertzchain.limits import TIME_LIMIT, TOLERANCE, check_tolerance
from hertzchain.observables.gauges import COLUMNS as TRAIN_COLUMNS
from hertzchain.observables.gauges import Train
from hertzchain.observables.peaks import judged_contacts
from hertzchain.progress import ShowProgress, telling
from hertzchain.scene.scene import Scene, SceneLike, to_scene
from hertzchain.scene.terms import Gauge
from hertzchain.verdict.check import Check, CheckedVerdict, Kind, unmeasured, within
from hertzchain.verdict.judgement import Judgement, judged

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True, eq=False)
class Motion:
    """Net forces on the granules of a run, from the pushed end on."""

    time: FloatArray  # increasing, shape (samples,): [s], or steps
    is_clock: bool  # whether times are seconds
    net_force: FloatArray  # along the chain [N], shape (samples, granules)
    grain: float = 0.0  # the last digit of forces [N]


def last_digit(values: FloatArray) -> float:
    """Return the unit of the last digit that the largest of some numbers have; 0 for 15 digits.

    The numbers have equally many significant digits, or decimals.
    """
    some = np.abs(values[values != 0])
    if not some.size:
        return 0.0
    # Numbers of a file whose digits are counted (chosen)
    words = [f"{value:.14e}" for value in some[:: max(1, some.size // 2000)]]
    digits = max(len(word.partition("e")[0].rstrip("0").replace(".", "")) for word in words)
    exponent = math.floor(math.log10(float(np.max(some))))
    return 0.0 if digits >= 15 else float(10.0 ** (exponent - digits + 1))


@dataclass(frozen=True, eq=False)
class Sampled:
    """Given peaks, with the errors that the sampling interval causes."""

    peak_force: FloatArray  # of all contacts [N], shape (contacts,), NaN where there is none
    error: FloatArray | None = None  # relative, shape (contacts,); None for peaks given as such
    how: str = ""  # how peaks were determined from samples


def peaks_of(scene: Scene, motion: Motion) -> Sampled:
    """Return the peaks of a run; a SceneError says why there are none."""
    allowed = "has no force of a near wall: give peaks with the numbers of contacts instead"
    require(scene.near_wall is None, "", None, allowed)
    # A code writes a sample twice, at the end of a run and at the start of the next.
    once = np.append(True, np.diff(motion.time) != 0)
    time = motion.time[once]
    repeated = np.abs(np.diff(motion.net_force[:, 1:], axis=0))[~once[1:]]
    # Largest difference of two samples of the same time, over the largest force: dampers act with
    # velocities half a step apart in them. On granule 1 a force may begin between them.
    is_one_run = np.max(repeated, initial=0.0) <= 0.05 * np.max(np.abs(motion.net_force))
    allowed = "has two different samples of one time: give the samples of one run"
    require(bool(is_one_run), "", None, allowed)
    fewest = 7  # samples: a curve of sixth degree goes through so many
    allowed = (
        f"has {time.size} samples of the run, must have at least {fewest}: name all files of a dump"
        " that has one for each frame"
    )
    require(time.size >= fewest, "", None, allowed)
    allowed = "has times that do not increase: give the samples of one run"
    require(bool(np.all(np.diff(time) > 0)), "", None, allowed)
    forces = _contact_forces(scene, time, motion.is_clock, motion.net_force[once])
    peaks, error = _through_samples(time, forces)
    # Last digits that rounded forces cost a peak at most: sums of a few (chosen)
    error = error + 2.0 * motion.grain / np.where(peaks > 0, peaks, np.inf)
    largest = float(np.max(error[judged_contacts(peaks)], initial=0.0))
    apart = f"{np.median(np.diff(time)):.3g} {'s' if motion.is_clock else 'steps'}"
    how = (
        f"peaks are from net forces in a dump, {time.size} samples {apart} apart; they may be off"
        f" by up to {largest:.1e} for that"
    )
    # The force on a wall is in no dump of granules.
    unknown = len(scene.contacts) - peaks.size
    given = np.append(peaks, np.full(unknown, np.nan))
    return Sampled(given, np.append(error, np.zeros(unknown)), how)


def _contact_forces(
    scene: Scene, time: FloatArray, is_clock: bool, net_force: FloatArray
) -> FloatArray:
    """Return the force in each contact between granules [N], (samples, contacts)."""
    from_contacts = net_force - scene.granules.constant_force
    if scene.wall is None:
        return np.ascontiguousarray(np.cumsum(from_contacts[:, :0:-1], axis=1)[:, ::-1])
    allowed = "has net forces, which do not tell contact forces between a piston and a wall"
    require(scene.piston is None, "", None, allowed)
    require(is_clock or not scene.ramps, "", None, "has steps and no times: give --dt")
    applied = scene.applied_force(time) if scene.ramps else np.zeros(time.size)
    return applied[:, np.newaxis] - np.cumsum(from_contacts[:, :-1], axis=1)


def _through_samples(time: FloatArray, force: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return peaks and their errors, by a curve of sixth degree around the highest sample.

    It goes through seven forces to the power 2/3, as overlaps are smooth where contacts open. Its
    error follows from its difference from curves through five and three of them. Samples of other
    humps are examined, too, if their maximum may be as high.
    """
    smooth = np.cbrt(np.maximum(force, 0.0)) ** 2
    contacts = force.shape[1]
    peaks, error = np.zeros(contacts), np.zeros(contacts)
    for contact in range(contacts):
        values = smooth[:, contact]
        if not np.any(values > 0):
            continue
        maxima = [_maximum(time, values, at) for at in _crests(values)]
        highest = max(value for value, _ in maxima)
        off = max(value + error for value, error in maxima) - highest
        peaks[contact], error[contact] = highest**1.5, 1.5 * off / highest
    counts = judged_contacts(peaks)
    usual = float(np.median(error[counts])) if counts.any() else 0.0
    return peaks, np.maximum(error, usual)  # one may be small by chance


def _crests(values: FloatArray) -> NDArray[np.intp]:
    """Return samples near which the maximum may be: the highest, and those of other humps."""
    from scipy.signal import find_peaks

    humps = find_peaks(values)[0]
    # Humps that are examined for each contact (chosen)
    return np.union1d(humps[np.argsort(values[humps])[-8:]], np.argmax(values))


def _maximum(time: FloatArray, values: FloatArray, at: int) -> tuple[float, float]:
    """Return the maximum of a curve near a sample, and its error."""
    sixth, fourth, second = (_highest(time, values, at, beside) for beside in (3, 2, 1))
    # Factor on the difference of curves of sixth and fourth degree: the error of the former is at
    # most 3.2 times this difference for samples up to 0.8 natural time units apart, 0.1 times at
    # 0.2 (measured, see there). In random scenes with samples 0.02 to 1 unit apart, 45 of 9,932
    # peaks were off by more than this bound, nearly all with more than 0.6 between samples.
    off = 4.0 * abs(sixth - fourth)
    # Difference of curves of fourth and second degree from which on samples are too far apart for
    # this; and the largest error then, in such differences (measured, up to 1.2 units apart)
    if abs(fourth - second) > 0.02 * fourth:
        off = max(off, 10.0 * abs(fourth - second))
    if at in (0, time.size - 1):  # cut off: how much higher the force went is not known
        off = max(off, abs(values[at] - values[min(max(at, 1), time.size - 2)]))
    return sixth, off


def _highest(time: FloatArray, values: FloatArray, at: int, beside: int) -> float:
    """The maximum of a polynomial through samples around one, near it, and at least its value."""
    first = min(max(at - beside, 0), time.size - 2 * beside - 1)
    window = slice(first, first + 2 * beside + 1)
    scale = float(time[window.stop - 1] - time[window.start]) / (2 * beside)
    s = (time[window] - time[at]) / scale
    curve = np.polynomial.polynomial.Polynomial.fit(s, values[window], 2 * beside, domain=[-1, 1])
    near = np.clip(curve.deriv().roots().real, max(s[0], -1.0), min(s[-1], 1.0))
    return float(max([values[at], *curve(near)]))


def is_dump(text: str) -> bool:
    """Return whether the text of a file is a LAMMPS dump."""
    return text[:1000].lstrip()[:5] == "ITEM:"


_FRAME = re.compile(
    r"\s*(?:ITEM: UNITS\s+\S+\s+)?(?:ITEM: TIME\s+(?P<time>-?\d+(?:\.\d*)?(?:e[-+]?\d+)?)\s+)?"
    r"ITEM: TIMESTEP\s+(?P<step>\d+)\s+ITEM: NUMBER OF .*\s+(?P<count>\d+)\s+"
    r"(?:ITEM: BOX.*\n(?:(?!ITEM:).*\n)*)?"
    r"ITEM: (?:ATOMS|ENTRIES)(?P<names>.*)\n?(?P<rows>(?:(?!ITEM:).+\n?|\n)*)"
)
"""A frame of a text dump, as the dump styles ``custom`` and ``local`` write it."""

_CUT_OFF = "ends in the middle, or has other rows there: is the file cut off?"


def motion_of(texts: Sequence[str], granules: int, units: Units, dt: float | None) -> Motion:
    """Return the net forces in the frames of one dump, from the pushed end of the chain on.

    It may lie along any axis, be pushed at either end, and have its frames in many texts. A
    SceneError says what cannot be used.
    """
    import pandas

    frames, rows = _frames_of(texts, granules)
    names = frames[0]["names"].split()
    vectors = [*_vectors_in(names)[0], *_vectors_in(names)[1]]
    used = [name for name in ("id", *vectors) if name in names]
    try:
        values = np.loadtxt(rows, usecols=[names.index(name) for name in used], comments=None)
    except ValueError:  # a word
        values = np.full((len(rows), len(used)), np.nan)
    allowed = f"must have finite numbers in the columns {', '.join(used)}"
    require(bool(np.all(np.isfinite(values))), "", None, allowed)
    table = pandas.DataFrame(values, columns=used).reindex(columns=["id", *vectors], fill_value=0.0)
    for name in ("step", "time"):
        table[name] = np.repeat([float(frame[name] or "nan") for frame in frames], granules)
    # A frame may be in the file of another run, too.
    table["frame"] = np.repeat(np.arange(len(frames)), granules)
    table = table.sort_values(["step", "frame", "id"])
    place, force = (
        table[some].to_numpy().reshape(len(frames), granules, 3)
        for some in (vectors[:3], vectors[3:])
    )
    step, time = table[["step", "time"]].to_numpy()[::granules].T
    extent = np.ptp(place[0] * units.length, axis=0)
    across, along = np.sort(extent)[1:]
    allowed = (
        f"has granules that are not in a row along x, y or z: they differ by {across:.3g} m across"
        " it"
    )
    # Most width of a chain over its length (chosen)
    require(bool(across <= 1e-3 * along), "", None, allowed)
    axis = int(np.argmax(extent))
    net = np.ascontiguousarray(force[:, np.argsort(place[0, :, axis], kind="stable"), axis])
    if pushed_at_the_end(net):
        net = -net[:, ::-1]
    is_timed = bool(np.all(np.isfinite(time)))
    clock = time * units.time if is_timed else step if dt is None else step * dt
    is_clock = is_timed or dt is not None
    return Motion(clock, is_clock, net * units.force, last_digit(net) * units.force)


def _vectors_in(names: Sequence[str]) -> list[tuple[str, ...]]:
    """Return the columns of places and of forces in a dump; empty where it has none."""
    vectors = (("x", "y", "z"), ("xu", "yu", "zu")), (("fx", "fy", "fz"),)
    return [next((three for three in each if {*three} & {*names}), ()) for each in vectors]


def _frames_of(texts: Sequence[str], granules: int) -> tuple[list[re.Match[str]], list[str]]:
    """Return the frames of a dump and the rows of all of them."""
    frames, rows = list[re.Match[str]](), list[str]()
    for text in map(str.strip, texts):
        at = 0
        while at < len(text):
            frame, place = _FRAME.match(text, at), f"frame {len(frames) + 1}"
            if frame is None:
                raise SceneError(place, None, _CUT_OFF)
            names, lines = frame["names"].split(), frame["rows"].strip().splitlines()
            allowed = (
                "must have the columns id, x (or xu), fx of granules, or those of y or z, the same"
                " as other frames"
            )
            is_alike = not frames or frame["names"] == frames[0]["names"]
            require(is_alike and "id" in names and all(_vectors_in(names)), place, None, allowed)
            is_whole = str(len(lines)) == frame["count"]
            is_whole = is_whole and all(len(line.split()) == len(names) for line in lines)
            require(is_whole, place, None, _CUT_OFF)
            allowed = (
                f"has {len(lines)} granules, the scene {granules}: dump those of the chain alone,"
                " all of them"
            )
            require(len(lines) == granules, place, None, allowed)
            frames.append(frame)
            rows += lines
            at = frame.end()
    return frames, rows


def pushed_at_the_end(force: FloatArray) -> bool:
    """Return whether the last granule feels a force before the first, (samples, granules)."""
    # Fraction of the largest force from which an end of the chain is pushed (chosen)
    counts = np.abs(force) > 0.05 * np.max(np.abs(force))
    first, last = (np.flatnonzero(counts[:, k]) for k in (0, -1))
    return bool(last.size and (not first.size or last[0] < first[0]))


LARGEST_FILES_BYTES = 300_000_000  # of all files: a minute to read (chosen)

COLUMNS = ("contact", "peak_force_N")
"""Columns of a table of peaks."""


def read(scene: Scene, results: Source, units: str, dt: float | None) -> Sampled:
    """Return the peaks of files, of a table, or as they are; see ``hertzchain.judge``.

    A SceneError says what cannot be used, and why.
    """
    import pandas

    require(units in UNITS, "units", units, f"must be one of {', '.join(UNITS)}")
    if isinstance(results, str | os.PathLike):
        results = [results]
    is_list = isinstance(results, Sequence) and len(results) > 0
    if is_list and all(isinstance(path, str | os.PathLike) for path in results):
        return _of_files(scene, [Path(path) for path in results], units, dt)
    require(units == "si", "units", units, "is for dumps: leave it out, and give forces in N")
    if isinstance(results, Mapping):
        results = pandas.DataFrame([*results.items()], columns=COLUMNS)
    if not hasattr(results, "select_dtypes"):
        return Sampled(results)
    return _of_table(scene, results, "the table")


def _of_files(scene: Scene, paths: Sequence[Path], units: str, dt: float | None) -> Sampled:
    file = " ... ".join(dict.fromkeys((str(paths[0]), str(paths[-1]))))
    texts: list[str] = []
    left = LARGEST_FILES_BYTES
    for path in paths:
        texts.append(_text_of(path, left))
        left -= len(texts[-1])
        if not is_dump(texts[-1]) and len(paths) > 1:
            allowed = "is not a LAMMPS dump: several files must be the frames of one dump"
            raise SceneError("", None, allowed, file=path)
    if not is_dump(texts[0]):
        allowed = f"is for dumps: {COLUMNS[1]} of a table is in N"
        require(units == "si", "units", units, allowed)
        return _of_table(scene, _table_in(texts[0], file), file)
    try:
        return peaks_of(scene, motion_of(texts, scene.chain.granules, UNITS[units], dt))
    except SceneError as problem:
        raise problem.in_file(Path(file)) from None


def _text_of(path: Path, most: int) -> str:
    """Return the text of a file; a SceneError says why there is none."""
    try:
        text = text_in(read_bytes(path, most))
    except (OSError, ValueError) as problem:
        reason = getattr(problem, "strerror", None) or "no name of a file"
        allowed = f"cannot be read ({reason}), must be a CSV file or a dump"
        raise SceneError("", None, allowed, file=path) from None
    if text is None:
        allowed = "is not a text file: unpack an archive, save a spreadsheet as CSV"
        raise SceneError("", None, allowed, file=path)
    return text


def _table_in(text: str, file: str) -> pandas.DataFrame:
    """Return the words of a CSV file, whose header may be a comment; decimal commas as points."""
    import pandas

    above = [*itertools.takewhile(_is_above_the_header, text.splitlines(keepends=True))]
    text = text[sum(map(len, above)) :].removeprefix("#").lstrip(" ")
    head = text.partition("\n")[0]
    separator = next((sign for sign in ";\t," if sign in head), r"\s+")
    needed = f"must be a CSV file with a header that names {' and '.join(COLUMNS)}, or a dump"
    try:
        with warnings.catch_warnings():  # of rows that are longer than the header
            warnings.simplefilter("error", pandas.errors.ParserWarning)
            table = pandas.read_csv(
                io.StringIO(text), sep=separator, dtype=str, keep_default_na=False,
                index_col=False, skipinitialspace=True,
            )  # fmt: skip
    except (ValueError, pandas.errors.ParserWarning) as problem:
        line = re.search(r"line (\d+), saw", str(problem))
        where = f"line {int(line[1]) + len(above)}" if line else "a row"
        what = f"is no table: {where} has more cells than the first" if head else "is empty"
        raise SceneError("", None, f"{what}, {needed}", file=file) from None
    table.columns = [str(name).strip() for name in table.columns]
    if pandas.to_numeric(table.columns.to_series(), errors="coerce").notna().all():
        raise SceneError("", None, f"has no header, {needed}", file=file)
    for name in set(COLUMNS) & set(table.columns) if separator != "," else ():
        words = table[name]
        commas = words.str.contains(",", regex=False)
        decimal, others = words[commas], words[~commas]
        # 1,234 may have a decimal comma if no other number is whole.
        is_grouped = decimal.str.fullmatch(r"\d{1,3}(,\d{3})+").all()
        if decimal.size and is_grouped and others.str.isdecimal().any():
            allowed = "may have a comma of thousands: leave it out, and write decimals with a point"
            raise SceneError(name, decimal.iloc[0], allowed, file=file)
        if not words.str.contains(".", regex=False).any():
            table[name] = words.str.replace(",", ".")
    return table


def _is_above_the_header(line: str) -> bool:
    """Whether a line is a comment, or blank, and not the header itself."""
    return line.strip()[:1] in ("", "#") and COLUMNS[1] not in line


def _of_table(scene: Scene, table: pandas.DataFrame, file: str) -> Sampled:
    """Return the peaks in a table; contacts without one have NaN."""
    import pandas

    most_chars = 40  # of a cell or a name in a message (chosen)
    names = [str(name) for name in table.columns]
    # The second of a name has .1 added.
    if any(names.count(name) != 1 or f"{name}.1" in names for name in COLUMNS):
        shown = ", ".join(repr(name[:most_chars]) for name in names[:8])
        allowed = (
            f"has the columns {shown}, must have {' and '.join(COLUMNS)} (contact 2 is that of"
            " granules 1 and 2), once each, or be a dump of LAMMPS with id, x, fx; pulses"
            " (hc.judge_trains) stand in contact or granule and force_N; forces over time"
            " (hc.judge_traces) in time_s and contact_2_N, contact_3_N, ...: else name them with"
            " --column time=... --column gauge_16=..."
        )
        raise SceneError("", None, allowed, file=file)

    def check(
        passed: NDArray[np.bool_], column: str, cells: Sequence[object], allowed: str
    ) -> None:
        for row in np.flatnonzero(~passed)[:1].tolist():
            raise SceneError(f"{column} in row {row + 1}", cells[row], allowed, file=file)

    numbers = []
    for name in COLUMNS:
        words = table[table.columns[names.index(name)]]
        if words.dtype.kind not in "biuf":  # complex numbers, and integers beyond any float
            words = words.astype(str)
        values = pandas.to_numeric(words, errors="coerce").to_numpy(np.float64)
        cells = [str(word)[:most_chars] for word in words]
        check(np.isfinite(values), name, cells, "must be a finite number")
        numbers.append(values)
    contacts, forces = numbers
    if table.empty:
        raise SceneError("", None, "has no peak, must have one of a contact at least", file=file)
    first, last = scene.contacts[0], scene.last_contact
    allowed = (
        f"must be a whole number from {first} to {last}: contact 2 lies between granules 1 and 2"
    )
    whole = [int(contact) if contact.is_integer() else contact for contact in contacts.tolist()]
    check(np.isin(contacts, scene.contacts), COLUMNS[0], whole, allowed)
    allowed = (
        "is given twice: several pulses of a contact stand in the columns contact and force_N"
        " (hc.judge_trains)"
    )
    check(~pandas.Series(contacts).duplicated().to_numpy(), COLUMNS[0], whole, allowed)
    allowed = (
        "must be finite and at least 0 [N]: turn the sign where forces that press are negative,"
        " leave out contacts without a peak"
    )
    check(forces >= 0, COLUMNS[1], forces.tolist(), allowed)
    peaks = np.full(len(scene.contacts), np.nan)
    peaks[contacts.astype(np.intp) - first] = forces
    return Sampled(peaks)


Results = Annotated[Path | str | Sequence[Path | str] | Mapping[int, float] | ArrayLike, read]
"""Values that can be judged; pandas tables are array-like, too."""


def judge(
    scene: SceneLike,
    results: Results,
    *,
    units: str = "si",
    tolerance: float = TOLERANCE,
    dt: float | None = None,
    time_limit: float = TIME_LIMIT,
    progress: ShowProgress = None,
) -> Judgement:
    """Judge results of any code by the reference, and search for the cause of differences.

    Parameters
    ----------
    scene
        What was computed, or the path of its file.
    results
        Peak forces [N] of contacts by the paper's numbers, 2 ... N, and N + 1 at a wall: a mapping
        from contacts to forces, or an array of shape (contacts,) with NaN for missing peaks.

        Or a pandas table, or a CSV file, with the columns contact and peak_force_N.

        Or a text dump of all granules by LAMMPS with id, x and fx, or a list of files that together
        are one: peaks are found between its frames.
    units
        ``si``, ``cgs``, ``micro``, ``nano`` (LAMMPS's styles), of a dump.
    tolerance
        Largest relative difference that passes; between 0 and 1.
    dt
        Step of the code [s], if known; it turns numbers of steps into times. The error of velocity
        Verlet at this step is stated, except for damped contacts.
    time_limit
        Time limit of the reference [s].
    progress
        True for a line in the terminal on what is being done, or a function that is
        called with each such line.

    Raises
    ------
    SceneError
        For anything but a scene, for results that cannot be used, impossible peaks, tolerances or
        steps, and for a tolerance within the error of the reference.
    RunFailed
        If the reference cannot be computed, or velocity Verlet is unstable with such a step.
    """
    scene = to_scene(scene)
    require(dt is None or is_positive(dt), "dt", dt, f"{POSITIVE} [s]")
    with telling(progress) as report_progress:
        report_progress("reading results")
        given = read(scene, results, units, dt)
        judgement = judged(
            scene, given.peak_force, tolerance, dt, given.error, time_limit, report_progress
        )
    if given.error is None:
        return judgement
    remarks = [given.how]
    if judgement.sampled_too_rarely:
        remarks.append(
            f"{judgement.sampled_too_rarely} contacts are not judged, as samples so far apart, or"
            f" numbers of so few digits, may be off by more than the tolerance of {tolerance:.1e}:"
            " write samples more often, with dump_modify format float %.15g"
        )
    return replace(judgement, remarks=(*remarks, *judgement.remarks))


_ADVICE = "the scene is not what was measured, or the calibration is not what was given"
FORCE = Kind("force of pulse {} [N]", _ADVICE)
WIDTH = Kind("width of pulse {} [s]", _ADVICE)
LATER = Kind(
    "pulse {} after the one before [s]",
    "the scene has another speed: try E, density, damping, loads",
)

_TRAIN_PLACES, _FORCE = ("contact", "granule"), "force_N"
_TIMES = {"time_s": LATER, "width_s": WIDTH}


class TrainJudgement(CheckedVerdict):
    """Measured trains against the reference; true if the verdict is ``pass``.

    Its checks are the force of each measured pulse, and widths and times between pulses where they
    were given.
    """


def is_train(names: Sequence[str]) -> bool:
    """Return whether a table with these columns has pulses."""
    return (
        _FORCE in names and "peak_force_N" not in names and not {*_TRAIN_PLACES}.isdisjoint(names)
    )


def judge_trains(
    scene: SceneLike,
    pulses: Path | str | pandas.DataFrame,
    *,
    tolerance: float = TOLERANCE,
    time_limit: float = TIME_LIMIT,
    progress: ShowProgress = None,
) -> TrainJudgement:
    """Judge trains of measured pulses by the reference, pulse by pulse in the order of the rows.

    Parameters
    ----------
    scene
        The scene that was measured, or the path of its file.
    pulses
        A pandas table, or a CSV file, with the columns contact or granule (its number; empty in
        rows of the other) and force_N, the dynamic force of a pulse; perhaps time_s and width_s, as
        ``Result.pulses`` has them. Of times only those between pulses matter. Weak pulses may be
        left out, but not stronger ones before them: the measured forces are matched with those that
        fit best, in order. [uncertainty] of the scene is not used.
    tolerance, time_limit, progress
        As for ``judge``.

    Raises
    ------
    SceneError
        For anything but a scene, contacts and granules that it does not have, or numbers that are
        no pulses.
    RunFailed
        If the reference cannot be computed.
    """
    check_tolerance(tolerance)
    scene, file = to_scene(scene), "the table"
    table: Source = pulses
    if isinstance(pulses, Path | str):
        file, table = (
            str(pulses),
            _table_in(_text_of(Path(pulses), LARGEST_FILES_BYTES), str(pulses)),
        )
    try:
        measured = _measured(scene, table)
    except SceneError as problem:
        raise problem.in_file(Path(file)) from None
    gauges = (gauge for gauge in measured if gauge.granule is not None)
    with telling(progress) as report_progress:
        report_progress("native: the reference method")
        reference = Native("reference", time_limit=time_limit).run(
            replace(scene, gauges=tuple(dict.fromkeys((*scene.gauges, *gauges))))
        )
        report_progress("native: all pulses")
        trains = {train.gauge: train for train in reference.trains}
    checks = [
        check
        for gauge, columns in measured.items()
        for check in _checks(trains[gauge], columns, tolerance)
    ]
    return TrainJudgement(reference, float(tolerance), tuple(checks))


def _measured(scene: Scene, table: Source) -> dict[Gauge, dict[str, FloatArray]]:
    """Return the columns of the pulses of each contact or granule; SceneError if unusable."""
    import pandas

    allowed = "must have the columns contact or granule, and force_N"
    require(is_train(list(table.columns)), "pulses", None, allowed)
    usual = (*_TRAIN_PLACES, _FORCE, *_TIMES)
    for name in table.columns:
        allowed = f"must be {', '.join(usual)}"
        require(name in (*usual, *TRAIN_COLUMNS), "column", name, allowed)
    columns = [name for name in usual if name in table]
    cells = table[columns].reset_index(drop=True).replace(r"^\s*$", np.nan, regex=True)
    table = cells.apply(pandas.to_numeric, errors="coerce").astype(float)
    for name in columns:
        is_needed = np.full(len(table), name in (_FORCE, "time_s")) | cells[name].notna()
        is_possible = np.isfinite(table[name]) & ((table[name] > 0) | (name == "time_s"))
        allowed = "must be a finite number" + (" above 0" if name != "time_s" else "")
        for row in np.flatnonzero(is_needed & ~is_possible).tolist():
            raise SceneError(f"{name} in row {row + 1}", cells[name].iloc[row], allowed)
    places = [name for name in columns if name in _TRAIN_PLACES]
    for row in np.flatnonzero(table[places].notna().sum(axis=1) != 1).tolist():
        allowed = "must have a contact or a granule, and not both"
        raise SceneError(f"row {row + 1}", None, allowed)
    trains: dict[Gauge, dict[str, FloatArray]] = {}
    for key in places:
        for number, rows in table.groupby(key, sort=False):
            try:
                gauge = Gauge(**{key: int(number) if float(number).is_integer() else number})
                gauge.check(
                    scene.chain.granules, scene.wall is not None, scene.near_wall is not None
                )
            except SceneError as problem:
                where = f"{key} in row {rows.index[0] + 1}"
                raise SceneError(where, number, problem.allowed) from None
            train = {name: rows[name].to_numpy() for name in columns if name not in places}
            allowed = f"must increase from pulse to pulse of {gauge.place}"
            require(bool(np.all(np.diff(train.get("time_s", ())) > 0)), "time_s", None, allowed)
            trains[gauge] = train
    require(bool(trains), "pulses", None, "has no row with the number of a contact or granule")
    return trains


def _checks(train: Train, measured: dict[str, FloatArray], tolerance: float) -> list[Check]:
    """Return the checks of the pulses of one contact or granule."""
    true, place, forces = train.columns, train.gauge.place, measured[_FORCE]
    match = _in_order(forces, true[_FORCE])
    reason = "what was asked for, and the error of the reference"
    checks = []
    for k, at in enumerate(match.tolist()):
        error = true["force_error"][at] * true[_FORCE][at]
        expected = [(FORCE, float(forces[k]), float(true[_FORCE][at]), float(error))]
        if "width_s" in measured and measured["width_s"][k] > 0 and true["width_s"][at] > 0:
            off = float(true["width_error_s"][at])
            expected.append((WIDTH, float(measured["width_s"][k]), float(true["width_s"][at]), off))
        if "time_s" in measured and k:
            before = match[k - 1]
            off = float(true["time_error_s"][at] + true["time_error_s"][before])
            later = float(true["time_s"][at] - true["time_s"][before])
            expected.append((LATER, float(np.diff(measured["time_s"])[k - 1]), later, off))
        for kind, value, right, off in expected:
            named = Kind(kind.name.format(k + 1), kind.advice)
            if off < tolerance * abs(right) or (kind is LATER and np.isfinite(off)):
                checks.append(within(named, place, value, right, tolerance * right + off, reason))
            else:
                why = "the reference itself does not know this to the tolerance"
                checks.append(unmeasured(named, place, why))
    least, last = (1 + tolerance) * np.min(forces), match.max(initial=0)
    for at in set(np.flatnonzero(true[_FORCE][:last] > least).tolist()) - {*match.tolist()}:
        kind = Kind(f"pulse of {true[_FORCE][at]:.4g} N at {true['time_s'][at]:.4g} s", _ADVICE)
        why = "it was not measured, though a weaker one was"
        checks.append(unmeasured(kind, place, why))
    count = true[_FORCE].size
    why = f"the reference has {count} pulses there: leave out noise, or lengthen end_time"
    more = range(match.size + 1, forces.size + 1)
    return [*checks, *(unmeasured(Kind(FORCE.name.format(k), _ADVICE), place, why) for k in more)]


def _in_order(measured: FloatArray, true: FloatArray) -> NDArray[np.intp]:
    """Return the places of true forces that fit measured ones best, in the same order.

    If fewer forces are true than measured, the first ones are matched one by one.
    """
    measured = measured[: true.size]
    off = np.abs(np.log(measured[:, np.newaxis] / true))
    for k in range(1, measured.size):  # the least sum up to each place
        least = np.minimum.accumulate(off[k - 1])
        off[k, 1:] += least[:-1]
        off[k, :k] = np.inf
    match, end = np.zeros(measured.size, np.intp), true.size
    for k in reversed(range(measured.size)):
        end = match[k] = int(np.argmin(off[k, :end]))
    return match
