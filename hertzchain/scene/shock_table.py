"""Tables of shocks: CSV files with times and values."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypeVar

from hertzchain.errors import SceneError, is_finite, require
from hertzchain.files import read_rows
from hertzchain.scene.shock import Shock

_Kind = TypeVar("_Kind", bound=Shock)

_MOST_BYTES = 5_000_000
"""Largest size of a table [bytes], chosen: about 200,000 rows, read in a second and run in a
minute.
"""


def check_times(times: Sequence[float], values: Sequence[float], column: str) -> None:
    """Raise a SceneError for times of a table that do not increase, or too few of them or values.

    ``column`` is the name of the values; they are not looked at themselves.
    """
    rows = len(times)
    require(rows >= 2, "rows", rows, f"must be at least 2 rows of time_s and {column}")
    allowed = f"must be {rows}, as those of time_s"
    require(rows == len(values), f"rows of {column}", len(values), allowed)
    earliest = None
    for row, time in enumerate(times, start=1):
        key = f"time_s in row {row}"
        require(is_finite(time), key, time, "must be a finite number [s]")
        require(
            time >= 0 if earliest is None else time > earliest,
            key,
            time,
            "must be at least 0" if earliest is None else f"must be above {earliest}",
        )
        earliest = time


def lines_of(shock: Shock) -> list[str] | None:
    """Return the lines of the CSV file of a shock; None for one without a table."""
    if shock.column is None or not shock.rows:
        return None
    rows = (f"{time!r},{value!r}" for time, value in shock.rows)
    return [f"time_s,{shock.column[1]}", *rows]


def read_table(kind: type[_Kind], path: Path, name: str | None = None) -> _Kind:
    """Read a shock from a CSV file with the header ``time_s`` and the column of its values.

    A SceneError says what is wrong; ``name`` is that of the file in a scene file.
    """
    assert kind.column is not None
    try:
        header, rows = read_rows(path, _MOST_BYTES)
    except ValueError as problem:
        allowed = f"cannot be read ({problem}); must be a CSV file"
        raise SceneError("shock.file", name, allowed, None if name else path) from None
    expected = f"time_s,{kind.column[1]}"
    if ",".join(header) != expected:
        raise SceneError("first line", ",".join(header), f"must be {expected}", file=path)
    times, values = [], []
    for number, row in enumerate(rows, start=1):
        try:
            time, value = (float(cell) for cell in row)
        except ValueError:
            allowed = f"must be two numbers, {expected}"
            raise SceneError(f"row {number}", ",".join(row), allowed, file=path) from None
        times.append(time)
        values.append(value)
    columns: dict[str, Any] = {"time": tuple(times), kind.column[0]: tuple(values)}
    columns["file"] = name or str(path)
    try:
        return kind(**columns)
    except SceneError as problem:
        raise SceneError(problem.key, problem.value, problem.allowed, file=path) from None
