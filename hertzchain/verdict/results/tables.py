"""Text files of numbers: CSV, LAMMPS logs, fix ave/time and print; dumps of granules."""

from __future__ import annotations

import csv
import errno
import gzip
import io
import math
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.errors import SceneError
from hertzchain.files import read_bytes
from hertzchain.pulses.layout import signs_of, text_in

MOST_BYTES = 300_000_000  # of a file: a minute to read (chosen)

_PEAKS = {"contact", "peak_force_N"}  # columns of the project's own CSV


@dataclass(frozen=True, eq=False)
class Table:
    """Columns of words, which become numbers where they are used: others may hold any text."""

    names: tuple[str, ...]
    rows: Sequence[Sequence[str]]  # words; those missing at the end of a row are empty
    places: Sequence[str]  # where each row stands, for messages
    file: str  # for messages
    decimal: str = "."

    def numbers(self, columns: Sequence[int]) -> FloatArray:
        """Return numbers of some columns, (rows, columns); a SceneError names a word that is none.

        With decimal commas 1.500 is none.
        """
        swapped = str.maketrans(",.", ".,")
        values = np.full((len(self.rows), len(columns)), np.nan)
        for k, row in enumerate(self.rows):
            words = [row[column] if column < len(row) else "" for column in columns]
            if self.decimal == ",":
                words = [word.translate(swapped) for word in words]
            values[k] = [_number(word) for word in words]
        wrong = np.argwhere(~np.isfinite(values))
        if wrong.size:
            k, column = int(wrong[0, 0]), columns[wrong[0, 1]]
            word = self.rows[k][column] if column < len(self.rows[k]) else ""
            allowed = "must be a finite number"
            allowed += ", with a comma as in other lines" if self.decimal == "," else ""
            name = f"{self.names[column]} in {self.places[k]}"
            raise SceneError(name, word[:40], allowed, file=self.file)
        return values


def _number(word: str) -> float:
    """Return the number that a word is, NaN where it is none."""
    try:
        return math.nan if "_" in word else float(word)
    except ValueError:
        return math.nan


@dataclass(frozen=True, eq=False)
class Frame:
    """A frame of a dump."""

    step: float
    time: float | None
    table: Table


def content_of(path: Path, most: int) -> bytes:
    """Return the bytes of a file, unpacked; a SceneError says why there are none."""
    try:
        content = read_bytes(path, most)
        if content.startswith(b"\x1f\x8b"):
            with gzip.open(io.BytesIO(content)) as unpacked:
                content = unpacked.read(most + 1)
            if len(content) > most:
                raise OSError(errno.EFBIG, f"larger than {most / 1e6:g} MB when unpacked")  # noqa: TRY301
    except (gzip.BadGzipFile, EOFError, zlib.error):
        reason = "its compression is damaged"
    except (OSError, ValueError) as problem:
        reason = getattr(problem, "strerror", None) or "no name of a file"
    else:
        return content
    allowed = f"cannot be read ({reason}), must be a table, log or dump"
    raise SceneError("", None, allowed, file=path) from None


_OF_DECKS = ("units", "atom_style", "boundary", "newton", "dimension", "variable", "clear")
"""Commands with which LAMMPS inputs begin."""


def text_of(content: bytes, path: Path) -> str:
    """Return the text in the bytes of a file; a SceneError says why there is none."""
    text = None if content.startswith(b"PK\x03\x04") else text_in(content)
    if text is None:
        allowed = (
            "is not a text file: write text (CSV, a LAMMPS log, dump custom); a"
            " spreadsheet is saved as CSV first"
        )
        raise SceneError("", None, allowed, file=path)
    lines = (line.split() for line in text.splitlines() if line.strip()[:1] not in ("", "#"))
    if next(lines, [""])[0] in _OF_DECKS:
        allowed = "is a LAMMPS input: run it and judge its peaks, or try hertzchain examine"
        raise SceneError("", None, allowed, file=path)
    return text


def is_dump(content: bytes) -> bool:
    """Return whether the bytes of a file are those of a dump of LAMMPS."""
    return content[:1000].lstrip()[:5] == b"ITEM:"


def table_of(text: str, file: object) -> Table:
    """Return the columns of a CSV file, of a log, or of the output of a fix."""
    lines = text.splitlines()
    if any(line.startswith(("LAMMPS (", "Loop time")) for line in lines):
        return _of_log(lines, str(file))
    separator, decimal = signs_of(lines) or ("," if "," in text else " ", ".")
    if lines and {cell.strip(' "') for cell in lines[0].split(",")} >= _PEAKS:
        separator, decimal = ",", "."  # next to other columns with any text
    rows: list[list[str]] = []
    places: list[str] = []
    heads: list[list[str]] = []
    for number, row in _split(lines, separator, file):
        if row[0].startswith("#"):
            heads.append([cell for cell in (row[0][1:].strip(), *row[1:]) if cell])
        elif not rows and all(math.isnan(_number(cell.replace(",", "."))) for cell in row):
            heads.append(row)
        else:
            rows.append(row)
            places.append(f"line {number}")
    if not rows:
        raise SceneError("", None, "has no row of numbers", file=str(file))
    width = max(map(len, rows))
    head = min((head for head in reversed(heads) if len(head) >= width), key=len, default=None)
    if head is None and heads:
        longer = next(k for k, row in enumerate(rows) if len(row) > len(heads[-1]))
        allowed = f"has {len(rows[longer])} columns, the line with their names {len(heads[-1])}"
        raise SceneError(places[longer], None, allowed, file=str(file))
    names = tuple(head or (str(k + 1) for k in range(width)))
    return Table(names, rows, places, str(file), decimal)


def _split(lines: Sequence[str], separator: str, file: object) -> Iterator[tuple[int, list[str]]]:
    """Yield the number and the cells of each line that has any."""
    if separator == " ":
        yield from ((number, row) for number, line in enumerate(lines, 1) if (row := line.split()))
        return
    reader = csv.reader(lines, delimiter=separator)
    try:
        for row in reader:
            cells = [cell.strip() for cell in row]
            while cells and not cells[-1]:  # a line may end with separators
                cells.pop()
            if cells:
                yield reader.line_num, cells
    except csv.Error as problem:
        raise SceneError("", None, f"is no CSV file ({problem})", file=str(file)) from None


def _of_log(lines: Sequence[str], file: str) -> Table:
    """Return the thermo output of all runs that have the columns of the longest."""
    runs: list[tuple[tuple[str, ...], list[list[str]], list[str]]] = []
    is_inside = False
    for number, line in enumerate(lines, 1):
        words = line.split()
        if words[:1] == ["Step"]:
            runs.append((tuple(words), [], []))
            is_inside = True
        elif is_inside and words and words[0] != "WARNING:":
            is_inside = not math.isnan(_number(words[0]))
            if is_inside:
                runs[-1][1].append(words)
                runs[-1][2].append(f"line {number}")
    if not any(rows for _, rows, _ in runs):
        allowed = "is a log without thermo output: no line begins with Step and has numbers below"
        raise SceneError("", None, allowed, file=file)
    names = max(runs, key=lambda run: len(run[1]))[0]
    rows = [row for run in runs if run[0] == names for row in run[1]]
    places = [place for run in runs if run[0] == names for place in run[2]]
    return Table(names, rows, places, file)


def frames_of(text: str, file: object) -> list[Frame]:
    """Return the frames of a text dump."""
    frames: list[Frame] = []
    items: dict[str, tuple[list[str], list[str]]] = {}
    for item in text.split("ITEM:")[1:]:
        head, *lines = item.splitlines() or [""]
        kind, *words = head.split() or [""]
        if kind == "ENTRIES":
            allowed = "is a dump of pairs: write one of granules, with dump custom"
            raise SceneError("", None, allowed, file=str(file))
        items[kind] = words, [line for line in lines if line.strip()]
        if kind == "ATOMS":
            frames.append(_frame(items, len(frames) + 1, str(file)))
            items = {}
    if items:
        raise _cut_off(len(frames) + 1, str(file))
    return frames


def _cut_off(number: int, file: str) -> SceneError:
    allowed = f"ends in the middle of frame {number}, or has other rows there: is the file cut off?"
    return SceneError("", None, allowed, file=file)


def _frame(items: dict[str, tuple[list[str], list[str]]], number: int, file: str) -> Frame:
    """Return a frame of its items, each with the words after its name and the lines below."""
    names, lines = items["ATOMS"]
    numbers = {
        item: _number(values[0]) if values else math.nan for item, (_, values) in items.items()
    }
    rows = [line.split() for line in lines]
    step, time = numbers.get("TIMESTEP", math.nan), numbers.get("TIME")
    is_whole = len(rows) == numbers.get("NUMBER") and all(len(row) == len(names) for row in rows)
    if not is_whole or not math.isfinite(step) or (time is not None and not math.isfinite(time)):
        raise _cut_off(number, file)
    places = [f"row {k} of frame {number}" for k in range(1, len(rows) + 1)]
    return Frame(step, time, Table(tuple(names), rows, places, file))


def same_columns(frames: Sequence[Frame], file: object) -> list[Frame]:
    """Return the frames by their steps; a SceneError where their columns differ."""
    if any(frame.table.names != frames[0].table.names for frame in frames):
        raise SceneError("", None, "has frames of different columns", file=str(file))
    return sorted(frames, key=lambda frame: frame.step)
