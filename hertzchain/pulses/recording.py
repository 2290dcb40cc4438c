"""A recording: time and force of a measured pulse from its file, in SI units, and its noise."""

from __future__ import annotations

import itertools
import math
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.errors import HertzchainError, SceneError, did_you_mean, is_finite, require
from hertzchain.files import read_bytes, text_in
from hertzchain.scene.keys import to_si

if TYPE_CHECKING:
    import pandas


LEAST_SAMPLES = 8  # least number of samples of a recording; chosen
_LARGEST_FILE_BYTES = 100_000_000  # of a file (chosen): about three million samples
_LAYOUT_LINES = 2000  # lines at the beginning and at the end that show the layout (chosen)
MOST_EXTENT = 1e60  # largest s or N: its square, and sums of squares, can be represented
_SETTING_LINES = 30  # first lines with samples next to which settings may stand; chosen

_LAYOUTS = ((";", "."), (";", ","), ("\t", "."), ("\t", ","), (",", "."), (" ", "."), (" ", ","))
"""Layouts that are tried: separator of columns (a blank stands for any number) and decimal sign."""

_SEPARATORS = {";": "semicolons", "\t": "tabs", ",": "commas", " ": "blanks"}

_NUMBER = re.compile(r"[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:e[-+]?\d+)?|[-+]?(?:nan|inf)", re.IGNORECASE)
_UNIT = re.compile(r"[\[(]\s*([^\])]+?)\s*[\])]\s*$|(?:[_/]\s*|\bin )([A-Za-zµμ]+)$")
"""Unit at the end of the name of a column: "force [kN]", "Time (us)", "time_s", "F/N", "in s"."""

_TIME_UNITS = ("s", "ms", "us", "µs", "μs", "ns")
_FORCE_UNITS = ("N", "kN", "mN", "MN")
_UNIT_SPELLINGS = {
    **{name: name for name in (*_TIME_UNITS, *_FORCE_UNITS)},
    **{name: name for name in ("V", "mV", "kV", "uV", "µV", "volt", "volts", "pC", "mA", "ampere")},
    **dict.fromkeys(("sec", "second", "seconds"), "s"),
    **dict.fromkeys(("newton", "newtons"), "N"),
}
"""Units in headers, by how they are written."""

_TIME_NAME = re.compile(r"t\b|.*(?:time|second)|in \w?s$", re.IGNORECASE)
"""Name or unit of a column of times."""

_OF_CLOCK = ("start", "step")
"""Source of the times if no column has them."""

_COUNTS = "sequence"
"""Words that stand in place of a unit below the name of a column that counts samples."""

_LABELS = {
    "tracename": "names",
    "source": "name",
    **dict.fromkeys(("vertical units", "vunit"), "units"),
    **dict.fromkeys(("horizontal units", "hunit"), "unit of times"),
    **dict.fromkeys(("hoffset", "start"), "start"),
    **dict.fromkeys(("hresolution", "increment"), "step"),
}
"""Words of oscilloscopes for what is to the right of them, or below them.

They are those of Tektronix, Siglent, Rigol and Yokogawa (IM DLM3054-01EN, appendix 3: the time of
sample k is HResolution (k - 1) + HOffset).
"""


@dataclass(frozen=True, eq=False)
class Recording:
    """A measured signal."""

    time: FloatArray  # increasing times as in the file [s], shape (samples,)
    force: FloatArray  # with the baseline [N], shape (samples,)
    newtons: float  # N for each unit of the column of forces
    facts: tuple[tuple[str, str], ...]  # layout and units of the file, as labels and texts


@dataclass(frozen=True, eq=False)
class Columns:
    """The columns of a file or table, as texts with decimal points, and their header."""

    path: Path
    cells: pandas.DataFrame  # a row for each line with samples, by its number from 1
    numeric: Sequence[int]  # columns with numbers
    names: Sequence[str]  # of all columns; empty if the header does not have them
    units: Sequence[str]
    layout: str  # in words

    def without_gaps(self, which: Sequence[int]) -> Columns:
        """Return the lines without those that have numbers in some of these columns, not in all.

        An empty cell is a gap; other texts are refused when the columns are read.
        """
        empty, number = self.cells[[*which]] == "", self._are_numbers(which)
        is_gap = (empty | number).all(axis=1) & empty.any(axis=1) & number.any(axis=1)
        return replace(self, cells=self.cells[~is_gap])

    def _are_numbers(self, which: Sequence[int]) -> pandas.DataFrame:
        return self.cells[[*which]].map(lambda cell: _numbers([cell or ""]) == 1)

    def numbers(self, which: tuple[int, int]) -> FloatArray:
        """Return times and forces, shape (samples, 2), from the first line that has both."""
        is_number = self._are_numbers(which)
        has_both = is_number.all(axis=1).to_numpy()
        begin = int(np.argmax(has_both)) if has_both.any() else has_both.size
        values = self.cells[[*which]].where(is_number)[begin:].astype(np.float64)
        lines = values.index
        if lines.size < LEAST_SAMPLES:
            named = " and ".join(map(self.name, which))
            raise HertzchainError(
                f"{self.path}: {lines.size} lines have numbers in the columns {named}, must be at"
                f" least {LEAST_SAMPLES}; name the columns with --time and --force"
            )
        wrong = lines[~np.isfinite(values.to_numpy()).all(axis=1)]
        if wrong.size:
            more = f" (and {wrong.size - 1:,} more)" if wrong.size > 1 else ""
            allowed = "has no finite time and force: correct it or delete it"
            raise SceneError("", None, f"line {wrong[0]}{more}: {allowed}", self.path)
        back = np.flatnonzero(np.diff(values[which[0]]) <= 0)
        if back.size:
            said = f"line {lines[back[0] + 1]}: the time is not above that of line {lines[back[0]]}"
            advice = "export times with more digits, or name another column"
            raise SceneError("", None, f"{said}; {advice}", self.path)
        return values.to_numpy()

    def name(self, column: int) -> str:
        """Return number and name of a column, for messages."""
        return f"{column + 1} ({self.names[column]})" if self.names[column] else f"{column + 1}"

    def find(self, option: str, wanted: str) -> int:
        """Column with the name or number of an option; HertzchainError lists the columns."""
        bare = [_UNIT.sub("", name).strip().lower() for name in self.names]
        for names, meant in ((list(self.names), wanted), (bare, wanted.lower())):
            if names.count(meant) == 1:
                return names.index(meant)
        if wanted.isdecimal() and 1 <= int(wanted) <= len(self.names):
            return int(wanted) - 1
        listed = ", ".join(map(self.name, range(len(self.names))))
        hint = did_you_mean(wanted, [name for name in self.names if name])
        raise HertzchainError(f"{option} {wanted}: no such column, there are {listed}{hint}")


def read_columns(path: Path) -> Columns:
    """Return the columns of a text file in any usual layout and encoding.

    HertzchainError if it is unreadable, or has no line of two numbers.
    """
    import pandas

    lines = _lines(path)
    some = [*lines[:_LAYOUT_LINES], *lines[_LAYOUT_LINES:][-_LAYOUT_LINES:]]
    # The most lines with only numbers, or else with two numbers; the first of equal layouts.
    separator, decimal = max(_LAYOUTS, key=lambda signs: _fitting(some, *signs))
    rows = [row for line in some if _numbers(row := _cells(line, separator, decimal)) >= 2]
    if not rows:
        raise HertzchainError(
            f"{path}: no line has numbers in two columns; must be a text file with columns of time"
            " and force"
        )
    count = Counter(map(len, rows)).most_common(1)[0][0]
    numeric = [
        column
        for column in range(count)
        if sum(_numbers(row[column : column + 1]) for row in rows) > len(rows) / 2
    ]
    every = [_cells(line, separator, decimal) for line in lines]
    begin = _first_sample(every, numeric)
    # A comment may name the columns, and settings may stand next to the first samples.
    header = [_cells(line.lstrip().lstrip("#%"), separator, ".") for line in lines[:begin]]
    beside = [row[: numeric[0]] for row in every[begin:][:_SETTING_LINES]]
    settings = _settings([*every[:begin], *beside], begin)
    lacking = [None] * count  # of cells in short lines
    samples = {k: [*row, *lacking][:count] for k, row in enumerate(every[begin:], begin + 1) if row}
    cells = pandas.DataFrame.from_dict(samples, "index", dtype=object, columns=range(count))
    first = [row[numeric[0]] for row in header if len(row) > numeric[0]]
    numbers = pandas.to_numeric(cells[numeric[0]], errors="coerce").to_numpy()
    counts = bool(np.array_equal(numbers, np.arange(len(cells))))
    has_step = {*_OF_CLOCK} <= {*settings}
    if not has_step and any(cell.lower() == _COUNTS for cell in first):
        raise HertzchainError(
            f"{path}: column {numeric[0] + 1} counts samples, and the header has no start and"
            " increment of the times: replace the numbers of the samples by their times"
        )
    has_times = not has_step or (not counts and any(map(_TIME_NAME.match, first)))
    names, units = _names_and_units(header, settings, numeric, count, has_times)
    if not has_times:  # they follow from the header
        start, step = (float(settings[kind][1]) for kind in _OF_CLOCK)
        cells[count] = [repr(start + step * k) for k in range(len(cells))]
        numeric = [count, *numeric[counts:]]
        names.append("time")
        units.append(_as_unit(settings.get("unit of times", ["", "s"])[1]) or "s")
    layout = f"{_SEPARATORS[separator]} between columns"
    layout += ", decimal commas" if decimal == "," else ""
    return Columns(path, cells, numeric, names, units, layout)


def columns_of(table: pandas.DataFrame) -> Columns:
    """Return the columns of a pandas table, as those of a file; units are in their names."""
    import pandas

    names = [str(name) for name in table.columns]
    rows = [list(map(str, row)) for row in table.to_numpy().tolist()]
    cells = pandas.DataFrame(rows, columns=range(len(names)), dtype=object)
    cells.index += 1
    path, numeric = Path("the table"), range(len(names))
    return Columns(path, cells, numeric, names, _units_in(names), "a table")


def _lines(path: Path) -> list[str]:
    try:
        content = read_bytes(path, _LARGEST_FILE_BYTES)
    except (OSError, ValueError) as problem:  # ValueError: no name of a file
        reason = getattr(problem, "strerror", None) or problem
        raise HertzchainError(f"{path}: cannot be read ({reason}); must be a text file") from None
    text = text_in(content)
    if text is None:
        raise HertzchainError(
            f"{path}: is not a text file (a spreadsheet, an archive); export the recording as CSV"
        )
    return text.splitlines()


def _cells(line: str, separator: str, decimal: str) -> list[str]:
    """Return the cells of a line, numbers with decimal points; empty for a comment."""
    if line.lstrip()[:1] in ("", "#", "%", ";"):
        return []
    line = line.partition("#")[0].strip("\r\n ")
    cells = line.split() if separator == " " else line.split(separator)
    cells = [cell.strip().strip('"').strip() for cell in cells]
    # With decimal commas 1.500 is not a number.
    return [cell.translate({44: 46, 46: 44}) for cell in cells] if decimal == "," else cells


def _numbers(cells: Sequence[str]) -> int:
    return sum(_NUMBER.fullmatch(cell) is not None for cell in cells)


def _fitting(lines: Sequence[str], separator: str, decimal: str) -> tuple[int, int]:
    """Return how many lines have only numbers, and how many have at least two numbers."""
    rows = [[cell for cell in _cells(line, separator, decimal) if cell] for line in lines]
    counts = [(_numbers(row), len(row)) for row in rows]
    two = [(numbers, size) for numbers, size in counts if numbers >= 2]
    return sum(numbers == size for numbers, size in two), len(two)


def _first_sample(cells: Sequence[Sequence[str]], numeric: Sequence[int]) -> int:
    """Return the first line with samples: settings may have numbers, too, between texts."""
    some = [(k, row) for k, row in enumerate(cells) if any(row)]
    is_sample = [
        len(row) > max(numeric) and _numbers([row[k] for k in numeric]) == len(numeric)
        for _, row in some
    ]
    run = next((k for k in range(len(some)) if all(is_sample[k : k + LEAST_SAMPLES])), 0)
    texts = [k for k, (_, row) in enumerate(some[:run]) if not _numbers(row)]
    begin = texts[-1] if texts else 0
    return next((some[k][0] for k in range(begin, len(some)) if is_sample[k]), 0)


def _settings(rows: Sequence[Sequence[str]], header: int) -> dict[str, Sequence[str]]:
    """Return what is to the right of the words of ``_LABELS``, or below them in the header.

    The first ``header`` rows are the header.
    """
    settings: dict[str, Sequence[str]] = {}
    for row in filter(any, rows):
        kind = _LABELS.get(row[0].lower())
        if kind is not None and any(row[1:]) and (_numbers(row[1:2]) or kind not in _OF_CLOCK):
            settings[kind] = row
    for names, values in itertools.pairwise(rows[:header]):
        for name, value in zip(names, values, strict=False):
            if (kind := _LABELS.get(name.lower())) in _OF_CLOCK and _numbers([value]):
                settings[kind] = [name, value]
    return settings


def _names_and_units(
    header: Sequence[Sequence[str]],
    settings: Mapping[str, Sequence[str]],
    numeric: Sequence[int],
    count: int,
    has_times: bool,
) -> tuple[list[str], list[str]]:
    """Return names and units of the columns, from the last lines of the header that have them."""
    rows = [row for row in header if len(row) > max(numeric) and all(row[k] for k in numeric)]
    units = [""] * count
    if rows and all(_as_unit(rows[-1][k]) or rows[-1][k].lower() == _COUNTS for k in numeric):
        units = [_as_unit(cell) for cell in rows.pop()]  # below the names, which may be numbers
    else:
        rows = [row for row in rows if not _numbers([row[k] for k in numeric])]
    row = settings.get("names", rows[-1] if rows else [])
    names = [*row, *[""] * count][:count]
    if "name" in settings and len(numeric) > 1:  # of the one channel
        names[numeric[1]] = settings["name"][1]
    units = [
        of_row or of_name
        for of_row, of_name in zip([*units, *[""] * count], _units_in(names), strict=False)
    ]
    # A file without times has none of their unit; one unit may stand for all channels.
    of_times = numeric[:1] if has_times else []
    for column in numeric:
        row = settings.get("unit of times" if column in of_times else "units", ["", ""])
        unit = row[column] if 0 < column < len(row) else row[1]
        units[column] = units[column] or _as_unit(unit.rpartition(":")[2])
    return names, units


def _units_in(names: Sequence[str]) -> list[str]:
    matches = [_UNIT.search(name) for name in names]
    return [_as_unit(match[1] or match[2]) if match else "" for match in matches]


def _as_unit(cell: str) -> str:
    """Return the known unit in a cell, with or without brackets; empty if there is none."""
    bare = "s" if cell == "S" else cell.strip("[]() ")
    return _UNIT_SPELLINGS.get(bare, _UNIT_SPELLINGS.get(bare.lower(), "") if len(bare) > 3 else "")


def read_recording(
    source: Path | Columns,
    time: str | None = None,
    force: str | None = None,
    time_unit: str | None = None,
    scale: float | None = None,
) -> Recording:
    """Read a text file with columns of time and force in any layout, or such columns.

    ``time`` and ``force`` are names or numbers, from 1, of columns; by default the first two that
    hold numbers. ``time_unit`` is by default that of the header, or s; ``scale`` is N for each unit
    of the column of forces, such as N for each volt, by default those of the unit in the header, or
    1. HertzchainError with the first wrong lines, or for an impossible column or unit.
    """
    columns = source if isinstance(source, Columns) else read_columns(source)
    path, others = columns.path, iter(columns.numeric)
    first = columns.find("--time", time) if time is not None else next(others, -1)
    others = (column for column in others if column != first)
    second = columns.find("--force", force) if force is not None else next(others, -1)
    if -1 in (first, second) or first == second:
        raise HertzchainError(
            f"{path}: time and force must be two columns of numbers; name them with --time and"
            " --force"
        )
    of_time, of_force = columns.units[first], columns.units[second]
    seconds, unit_of_time = (1.0, "taken as s") if of_time not in _TIME_UNITS else (
        to_si("--time-unit", f"1 {of_time}", "s"), f"in {of_time} (header)")  # fmt: skip
    if time_unit is not None:
        seconds, unit_of_time = to_si("--time-unit", f"1 {time_unit}", "s"), f"in {time_unit}"
        right = is_finite(seconds) and seconds > 0
        require(right, "--time-unit", time_unit, "must be a unit such as s")
    if scale is not None:
        right = is_finite(scale) and scale != 0
        require(right, "--scale", scale, "must be a finite number other than 0")
        newtons, unit_of_force = scale, f"times {scale:g} N"
    elif of_force in _FORCE_UNITS:
        newtons, unit_of_force = to_si("--scale", f"1 {of_force}", "N"), f"in {of_force} (header)"
    elif of_force:
        raise HertzchainError(
            f"column {columns.name(second)} is in {of_force}: say with --scale how many N one"
            f" {of_force} is"
        )
    else:
        newtons, unit_of_force = 1.0, "taken as N"
    whole = columns.without_gaps((first, second))
    values = whole.numbers((first, second))
    gaps = len(columns.cells) - len(whole.cells)
    left_out = f", {gaps:,} with an empty cell left out" if gaps else ""
    facts = (
        ("file", f"{path}: {len(values):,} samples, {columns.layout}{left_out}"),
        ("time", f"column {columns.name(first)}, {unit_of_time}"),
        ("force", f"column {columns.name(second)}, {unit_of_force}"),
    )
    with np.errstate(over="ignore", invalid="ignore"):  # refused below
        clock, forces = values[:, 0] * seconds, values[:, 1] * newtons
        extents = {"times": np.ptp(clock), "forces": np.ptp(forces)}
    for name, extent in extents.items():
        possible = bool(extent == 0 or 1 / MOST_EXTENT < extent < MOST_EXTENT)
        allowed = f"span {extent:g}, must be from {1 / MOST_EXTENT:g} to {MOST_EXTENT:g}"
        require(possible, name, None, f"{allowed}: check unit and scale")
    return Recording(clock, forces, newtons, facts)


LEAST_NOISE_SAMPLES = 16
"""Least number of samples without a pulse from which noise is measured (chosen)."""

_TO_DEVIATION = 1.4826  # standard deviation over median size of Gaussian noise


@dataclass(frozen=True)
class Noise:
    """Noise of the force."""

    deviation: float  # standard deviation of a sample [N]; at least that of the recording's digits
    density: float  # that of its integral over a time, over the root of that time [N s^(1/2)]

    def of_mean(self, samples: int, step: float) -> float:
        """Return the standard deviation of a mean [N] of samples with a time between them [s]."""
        slow = self.density / math.sqrt(samples * step)
        return max(self.deviation / math.sqrt(samples), slow)


def noise_before(force: FloatArray, step: float, resolution: float) -> Noise:
    """Measure the noise of samples without a pulse [N], at least ``LEAST_NOISE_SAMPLES`` of them.

    ``step`` is the time between samples [s], ``resolution`` the last digit [N].
    """
    samples = force - force.mean()
    # standard deviation of an error anywhere within a digit
    of_digits = resolution / math.sqrt(12.0)
    deviation = max(float(samples.std(ddof=1)), of_digits)
    block = math.isqrt(samples.size)
    blocks = samples[: samples.size // block * block].reshape(-1, block)
    of_blocks = float(blocks.mean(axis=1).std(ddof=1)) * math.sqrt(block * step)
    return Noise(deviation, max(of_blocks, of_digits * math.sqrt(step)))


def noise_within(force: FloatArray, step: float, resolution: float) -> Noise:
    """Return the noise of samples of a pulse [N], from their scatter about their neighbours.

    Second differences of white noise have sqrt(6) times its deviation; those of a smooth pulse are
    smaller.
    """
    second = np.diff(force, 2)
    scatter = float(np.median(np.abs(second))) * _TO_DEVIATION / math.sqrt(6.0)
    deviation = max(scatter, resolution / math.sqrt(12.0))
    return Noise(deviation, deviation * math.sqrt(step))


def resolution_of(force: FloatArray) -> float:
    """Return the last digit of recorded forces [N]; 0 if the samples do not show it.

    If at most a quarter of the samples have distinct values, it is the least difference of two
    values. Only two values mean a rectangle, whose height is not a digit.
    """
    values = np.unique(force)
    if values.size < 3 or values.size > force.size / 4:
        return 0.0
    gaps = np.diff(values)
    gaps = gaps[gaps > 1e-9 * np.abs(values).max()]  # equal products may differ by rounding
    return float(gaps.min()) if gaps.size else 0.0
