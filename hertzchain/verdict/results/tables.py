"""Text files of numbers: CSV, LAMMPS logs, fix ave/time and print; dumps of granules and pairs."""

from __future__ import annotations

import csv
import errno
import gzip
import io
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.errors import SceneError
from hertzchain.files import read_bytes
from hertzchain.pulses.layout import signs_of, text_in

MOST_BYTES = 300_000_000  # of a file: a minute to read (chosen)


@dataclass(frozen=True, eq=False)
class Table:
    """Columns of numbers: names, and rows of shape (rows, columns)."""

    names: tuple[str, ...]
    rows: FloatArray


@dataclass(frozen=True, eq=False)
class Frame:
    """A frame of a dump.

    Parameters
    ----------
    step, time
        Its step, and its time where it is given.
    names, rows
        Names of the columns, and rows of shape (rows, columns).
    box
        Lower and upper bounds of the box along x, y and z, shape (3, 2); None for a tilted one.
    """

    step: float
    time: float | None
    names: tuple[str, ...]
    rows: FloatArray
    box: FloatArray | None


def content_of(path: Path, most: int) -> bytes:
    """The bytes of a file, unpacked; a SceneError says in a few words why there are none."""
    try:
        content = read_bytes(path, most)
        if content.startswith(b"\x1f\x8b"):
            with gzip.open(io.BytesIO(content)) as unpacked:
                content = unpacked.read(most + 1)
            if len(content) > most:
                raise OSError(errno.EFBIG, f"larger than {most / 1e6:g} MB when unpacked")  # noqa: TRY301
    except (OSError, ValueError, EOFError, zlib.error) as problem:
        reason = getattr(problem, "strerror", None) or "no name of a file"
        if isinstance(problem, gzip.BadGzipFile | EOFError | zlib.error):
            reason = "its compression is damaged"
        allowed = f"cannot be read ({reason}), must be a table, log, dump or trajectory"
        raise SceneError("", None, allowed, file=path) from None
    return content


def text_of(content: bytes, path: Path) -> str:
    """The text in the bytes of a file; a SceneError says in a few words why there is none."""
    if content.startswith(b"PK\x03\x04"):
        allowed = "is a spreadsheet or an archive: save it as CSV first"
        raise SceneError("", None, allowed, file=path)
    text = text_in(content)
    if text is None:
        allowed = (
            "is not a text file: write text (CSV, a LAMMPS log, dump custom, atom or local), or"
            " name a trajectory .extxyz, .xyz or .traj"
        )
        raise SceneError("", None, allowed, file=path)
    return text


def is_dump(content: bytes) -> bool:
    """Whether the bytes of a file are those of a dump of LAMMPS."""
    return content[:1000].lstrip()[:5] == b"ITEM:"


def table_of(text: str, path: object, usual: Sequence[str] = ()) -> Table:
    """The columns of a CSV file, of a log, or of the output of a fix.

    CSV that has each of the ``usual`` columns once is read for them alone: others may hold text.
    """
    lines = text.splitlines()
    thermo = list(_thermo(lines))
    if thermo or any(line.startswith("LAMMPS (") for line in lines[:20]):
        return _joined(thermo, path)
    signs = signs_of(lines) or ("," if "," in text else " ", ".")
    first = [cell.strip(' "') for cell in lines[0].split(",")] if lines else []
    separator, decimal = (",", ".") if usual and set(usual) <= set(first) else signs
    rows: list[list[str]] = []
    where: list[int] = []
    heads: list[list[str]] = []
    for number, row in _split(lines, separator, path):
        if row[0].startswith("#"):
            heads.append([cell for cell in (row[0][1:].strip(), *row[1:]) if cell])
        else:
            rows.append(row)
            where.append(number)
    if rows and not _is_number(rows[0][0], decimal):
        heads.append(rows.pop(0))
        where.pop(0)
    if not rows:
        raise SceneError("", None, "has no row of numbers", file=str(path))
    if usual and heads and all(heads[-1].count(name) == 1 for name in usual):
        at = [heads[-1].index(name) for name in usual]
        rows = [[row[k] if k < len(row) else "" for k in at] for row in rows]
        heads = [list(usual)]
    width = len(rows[0])
    head = next((head for head in reversed(heads) if len(head) == width), None)
    names = tuple(head or (str(k + 1) for k in range(width)))
    return Table(names, _numbers(rows, where, names, path, decimal))


def _split(lines: Sequence[str], separator: str, path: object) -> Iterator[tuple[int, list[str]]]:
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
        raise SceneError("", None, f"is no CSV file ({problem})", file=str(path)) from None


def _number(word: str, decimal: str = ".") -> float:
    """The number that a word is; a ValueError where it is none, as 1.500 with decimal commas."""
    if decimal == ".":
        return float(word)
    if "." in word:
        raise ValueError(word)
    return float(word.replace(",", "."))


def _is_number(word: str, decimal: str = ".") -> bool:
    try:
        _number(word, decimal)
    except ValueError:
        return False
    return True


def _numbers(
    rows: Sequence[Sequence[str]],
    where: Sequence[int],
    names: Sequence[str],
    path: object,
    decimal: str = ".",
) -> FloatArray:
    """Rows of words as numbers; a SceneError names the line that is none."""
    try:
        plain = rows if decimal == "." else [[_number(word, decimal) for word in r] for r in rows]
        values = np.array(plain, np.float64)
        if values.ndim == 2 and np.all(np.isfinite(values)):
            return values
    except ValueError:
        pass
    last = len(rows) - 1
    for k, (row, line) in enumerate(zip(rows, where, strict=True)):
        if len(row) != len(names):
            allowed = f"has {len(row)} columns, the others {len(names)}" + (
                ": is the file cut off?" if k == last else ""
            )
            raise SceneError(f"line {line}", None, allowed, file=str(path))
        for name, word in zip(names, row, strict=True):
            if not _is_number(word, decimal) or not np.isfinite(_number(word, decimal)):
                allowed = "must be a finite number"
                allowed += ", with a comma as in other lines" if decimal == "," else ""
                raise SceneError(f"{name} in line {line}", word, allowed, file=str(path))
    raise SceneError("", None, "has rows of no columns", file=str(path))


def _thermo(lines: Sequence[str]) -> Iterator[tuple[list[str], list[list[str]], list[int]]]:
    """The tables of a log, each with its header and the numbers of its lines."""
    at = 0
    while at < len(lines):
        words = lines[at].split()
        at += 1
        if words[:1] != ["Step"]:
            continue
        rows, where = [], []
        while at < len(lines):
            row = lines[at].split()
            if row[:1] == ["Loop"] or (row and not _is_number(row[0]) and row[0] != "WARNING:"):
                break
            if row and row[0] != "WARNING:":
                rows.append(row)
                where.append(at + 1)
            at += 1
        if rows:
            yield words, rows, where


def _joined(thermo: Sequence[tuple[list[str], list[list[str]], list[int]]], path: object) -> Table:
    """The tables of the runs of a log that have the columns of the longest, as one."""
    if not thermo:
        allowed = "is a log without thermo output: no line begins with Step and has numbers below"
        raise SceneError("", None, allowed, file=str(path))
    names = max(thermo, key=lambda one: len(one[1]))[0]
    values = [_numbers(rows, where, own, path) for own, rows, where in thermo if own == names]
    kept = [values[0]]
    for before, after in pairwise(values):
        again = after[0, 0] == before[-1, 0]  # a run begins with the step that the last ended with
        kept.append(after[1:] if again else after)
    return Table(tuple(names), np.concatenate(kept))


def frames_of(text: str, path: object) -> list[Frame]:
    """The frames of a text dump, ``custom``, ``atom`` or ``local``."""
    lines = text.splitlines()
    found: list[Frame] = []
    try:
        at = 0
        while at < len(lines):
            frame, at = _frame(lines, at, path)
            if frame is not None:
                found.append(frame)
    except IndexError:
        allowed = f"ends in the middle of frame {len(found) + 1}: is the file cut off?"
        raise SceneError("", None, allowed, file=str(path)) from None
    if not found:
        raise SceneError("", None, "is a dump without frames", file=str(path))
    return found


def same_columns(frames: Sequence[Frame], path: object) -> list[Frame]:
    """The frames by their steps; a SceneError where their columns differ."""
    if any(frame.names != frames[0].names for frame in frames):
        raise SceneError("", None, "has frames of different columns", file=str(path))
    return sorted(frames, key=lambda frame: frame.step)


def _frame(lines: Sequence[str], at: int, path: object) -> tuple[Frame | None, int]:
    """The frame that begins at a line, and the line after it; an IndexError where it is cut off."""
    known: dict[str, float] = {}
    box: FloatArray | None = None
    while at < len(lines):
        line = lines[at]
        item = line.removeprefix("ITEM:").split()
        if not line.strip():
            at += 1
        elif not line.startswith("ITEM:") or not item:
            allowed = "is no part of a dump: must begin with ITEM:"
            raise SceneError(f"line {at + 1}", line[:40], allowed, file=str(path))
        elif item[0] in ("ATOMS", "ENTRIES"):
            if not {"NUMBER", "TIMESTEP"} <= known.keys():
                raise IndexError
            count, names = int(known["NUMBER"]), tuple(item[1:])
            words = [row.split() for row in lines[at + 1 : at + 1 + count]]
            if len(words) < count:
                raise IndexError
            where = range(at + 2, at + 2 + count)
            rows = _numbers(words, where, names, path) if words else np.zeros((0, len(names)))
            frame = Frame(known["TIMESTEP"], known.get("TIME"), names, rows, box)
            return frame, at + 1 + count
        elif item[0] == "BOX":
            box = _box(lines[at + 1 : at + 4], at + 2, item, path)
            at += 4
        else:
            word = lines[at + 1]
            if item[0] in ("TIMESTEP", "TIME", "NUMBER"):
                if not _is_number(word) or not 0 <= float(word) < 1e15:
                    key = f"line {at + 2}"
                    raise SceneError(key, word[:40], "must be a number", file=str(path))
                known[item[0]] = float(word)
            at += 2
    if known:
        raise IndexError
    return None, at


def _box(lines: Sequence[str], first: int, item: Sequence[str], path: object) -> FloatArray | None:
    """Bounds of a box, (3, 2); None for a tilted one, which has further numbers."""
    if len(lines) < 3:
        raise IndexError
    if {"xy", "abc"} & set(item):
        return None
    where = range(first, first + 3)
    return _numbers([line.split() for line in lines], where, ("lower", "upper"), path)
