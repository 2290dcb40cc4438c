"""Layout of a file with columns of numbers: separator, decimal sign, text lines, header."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from hertzchain.errors import HertzchainError, did_you_mean
from hertzchain.files import read_bytes, text_in

_MOST_BYTES = 100_000_000
"""Largest size of a file [bytes] (chosen): about three million samples."""

_LOOKED_AT = 2000
"""Number of lines at the beginning and at the end of a file from which the layout is found."""

_LAYOUTS = ((";", "."), (";", ","), ("\t", "."), ("\t", ","), (",", "."), (" ", "."), (" ", ","))
"""Layouts that are tried: separator of columns (a blank stands for any number) and decimal sign."""

_NUMBERS = {
    sign: re.compile(
        rf"[-+]?(?:\d+(?:{re.escape(sign)}\d*)?|{re.escape(sign)}\d+)(?:[eE][-+]?\d+)?|[-+]?(?:nan|inf)",
        re.IGNORECASE,
    )
    for sign in ".,"
}

_SEPARATORS = {";": "semicolons", "\t": "tabs", ",": "commas", " ": "blanks"}

_UNIT = re.compile(r"[\[(]\s*([^\])]+?)\s*[\])]\s*$|[_/]\s*([A-Za-zµμ]+)$")
"""Unit at the end of the name of a column: "force [kN]", "Time (us)", "time_s", "F/N"."""

UNITS_OF_TIME = {
    **dict.fromkeys(("s", "sec", "second", "seconds"), "s"),
    **{name: name for name in ("ms", "us", "µs", "μs", "ns")},
}
UNITS_OF_FORCE = {
    **dict.fromkeys(("N", "newton", "newtons"), "N"),
    **{name: name for name in ("kN", "mN", "MN")},
}
VOLTAGES = ("V", "mV", "volt", "volts", "kV", "uV", "µV", "pC", "mA", "ampere")
"""Units of signals other than forces, in headers."""


@dataclass(frozen=True)
class Layout:
    """Layout of the numbers of a file.

    Parameters
    ----------
    separator, decimal
        Separator of columns (a blank stands for any number of blanks), and decimal sign.
    columns
        Number of columns.
    names, units
        Names and units of the columns, from the header; empty texts for missing ones.
    numeric
        Indices of the columns with numbers.
    """

    separator: str
    decimal: str
    columns: int
    names: tuple[str, ...]
    units: tuple[str, ...]
    numeric: tuple[int, ...]

    def split(self, line: str) -> list[str]:
        """Return the cells of a line."""
        return _split(line, self.separator)

    def is_number(self, cell: str) -> bool:
        """Return whether a cell holds a number."""
        return _NUMBERS[self.decimal].fullmatch(cell) is not None

    def to_float(self, cell: str) -> float:
        """Return the number in a cell; ValueError without a number."""
        return float(cell.replace(",", ".") if self.decimal == "," else cell)

    def name(self, column: int) -> str:
        """Return number and name of a column, for messages."""
        return f"{column + 1} ({self.names[column]})" if self.names[column] else f"{column + 1}"

    def find(self, option: str, wanted: str) -> int:
        """Column with the name or number of an option; HertzchainError lists the columns."""
        if wanted.isdecimal() and 1 <= int(wanted) <= self.columns:
            return int(wanted) - 1
        for known in (list(self.names), [_bare(name).lower() for name in self.names]):
            meant = wanted if known == list(self.names) else wanted.lower()
            if known.count(meant) == 1:
                return known.index(meant)
        listed = ", ".join(self.name(column) for column in range(self.columns))
        hint = did_you_mean(wanted, [name for name in self.names if name])
        raise HertzchainError(f"{option} {wanted}: no such column, there are {listed}{hint}")

    def describe(self) -> str:
        """Return separator and decimal sign in words."""
        sign = ", decimal commas" if self.decimal == "," else ""
        return f"{_SEPARATORS[self.separator]} between columns{sign}"


def read_lines(path: Path) -> list[str]:
    """Lines of a text file in any usual encoding; HertzchainError if it is unreadable."""
    try:
        content = read_bytes(path, _MOST_BYTES)
    except (OSError, ValueError) as problem:  # ValueError: no name of a file
        reason = getattr(problem, "strerror", None) or problem
        raise HertzchainError(f"{path}: cannot be read ({reason}); must be a text file") from None
    if content.startswith(b"PK\x03\x04"):
        raise HertzchainError(f"{path}: is a spreadsheet or an archive; save it as CSV first")
    text = text_in(content)
    if text is None:
        raise HertzchainError(f"{path}: is not a text file; export the recording as CSV")
    return text.splitlines()


def is_comment(line: str) -> bool:
    """Return whether a line is empty or a comment in any layout."""
    return line.lstrip()[:1] in ("", "#", "%")


def signs_of(lines: Sequence[str]) -> tuple[str, str] | None:
    """The separator of columns and the decimal sign by which most lines are numbers.

    None where no line has numbers in two columns.
    """
    looked_at = _looked_at(lines)
    best = max(_LAYOUTS, key=lambda layout: _fitting(looked_at, *layout))  # of equals the first
    return best if any(_fitting(looked_at, *best)) else None


def _looked_at(lines: Sequence[str]) -> list[str]:
    """Lines from which the layout is found."""
    both_ends = [*lines[:_LOOKED_AT], *lines[_LOOKED_AT:][-_LOOKED_AT:]]
    return [line for line in both_ends if not is_comment(line)]


def layout_of(path: Path, lines: Sequence[str]) -> Layout:
    """Return the layout in which most lines have numbers in at least two columns.

    HertzchainError if there is none.
    """
    signs = signs_of(lines)
    if signs is None:
        raise HertzchainError(
            f"{path}: no line has numbers in two columns; must be a text file with columns of time"
            " and force"
        )
    separator, decimal = signs
    cells = [_split(line, separator) for line in _looked_at(lines)]
    number = _NUMBERS[decimal]
    rows = [row for row in cells if sum(map(bool, map(number.fullmatch, row))) >= 2]
    columns = Counter(map(len, rows)).most_common(1)[0][0]
    numeric = tuple(
        column
        for column in range(columns)
        if sum(column < len(row) and number.fullmatch(row[column]) is not None for row in rows)
        > len(rows) / 2
    )
    names, units = _header(lines, separator, number, columns)
    return Layout(separator, decimal, columns, names, units, numeric)


def _split(line: str, separator: str) -> list[str]:
    line = line.partition("#")[0].strip("\r\n ")
    if separator == " ":
        return line.split()
    return [cell.strip().strip('"').strip() for cell in line.split(separator)]


def _fitting(lines: Sequence[str], separator: str, decimal: str) -> tuple[int, int]:
    """Return how many lines have only numbers, and how many have at least two numbers."""
    alone = two = 0
    number = _NUMBERS[decimal]
    for line in lines:
        cells = [cell for cell in _split(line, separator) if cell]
        numbers = sum(number.fullmatch(cell) is not None for cell in cells)
        if numbers >= 2:
            two += 1
            alone += numbers == len(cells)
    return alone, two


def _header(
    lines: Sequence[str], separator: str, number: re.Pattern[str], columns: int
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return names and units of the columns, from the last text lines before the numbers."""
    texts: list[list[str]] = []
    for line in lines:
        cells = _split(line.lstrip().lstrip("#%"), separator)  # a comment may name the columns
        if len(cells) == columns:
            if sum(number.fullmatch(cell) is not None for cell in cells) >= 2:
                break
            if all(cells) and not any(map(number.fullmatch, cells)):
                texts.append(cells)
    if not texts:
        return ("",) * columns, ("",) * columns
    names = texts[-1]
    if len(texts) > 1 and all(map(_as_unit, names)):  # a line of units below the names
        return tuple(texts[-2]), tuple(map(_as_unit, names))
    return tuple(names), tuple(_unit_of(name) for name in names)


def _as_unit(cell: str) -> str:
    """Return the known unit in a cell, with or without brackets; empty if there is none."""
    bare = cell.strip("[]() ")
    known = {**UNITS_OF_TIME, **UNITS_OF_FORCE, **{name: name for name in VOLTAGES}}
    return known.get(bare, known.get(bare.lower(), "") if len(bare) > 3 else "")


def _unit_of(name: str) -> str:
    """Return the known unit at the end of a column's name; empty if there is none."""
    found = _UNIT.search(name)
    return _as_unit(found[1] or found[2]) if found else ""


def _bare(name: str) -> str:
    """Return the name of a column without its unit."""
    return _UNIT.sub("", name).strip() if _unit_of(name) else name
