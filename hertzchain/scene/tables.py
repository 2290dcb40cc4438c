"""Tables of a scene: CSV files of numbers, with a row for each time or granule."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, TypeVar

from hertzchain.errors import SceneError, is_finite, require
from hertzchain.files import read_rows
from hertzchain.scene.shock import Shock

_Kind = TypeVar("_Kind", bound=Shock)

_MOST_BYTES = 5_000_000
"""Largest size of a table of a shock [bytes], chosen: about 200,000 rows, read in a second and run
in a minute.
"""


def check_table(shock: Any, least: float | None = None) -> None:
    """Check the table of a shock, and make its numbers Python's own.

    A SceneError names the row of a time that is not above the one before it, or of a value that is
    not finite or below ``least``.
    """
    field, column = shock.column
    columns = shock.time, getattr(shock, field)
    times, values = (
        one if isinstance(one, Sequence) or getattr(one, "shape", None) else () for one in columns
    )
    rows = len(times)
    require(rows >= 2, "rows", rows, f"must be at least 2 rows of time_s and {column}")
    allowed = f"must be {rows}, as those of time_s"
    require(rows == len(values), f"rows of {column}", len(values), allowed)
    earliest = None
    for row, time in enumerate(times, start=1):
        key = f"time_s in row {row}"
        require(is_finite(time), key, time, "must be a finite number [s]")
        allowed = "must be at least 0" if earliest is None else f"must be above {earliest}"
        require(time >= 0 if earliest is None else time > earliest, key, time, allowed)
        earliest = time
    of_least = "" if least is None else f" of at least {least:g}"
    allowed = f"must be a finite number{of_least} [{column.rpartition('_')[2]}]"
    for row, value in enumerate(values, start=1):
        is_possible = is_finite(value) and (least is None or value >= least)
        require(is_possible, f"{column} in row {row}", value, allowed)
    for name, given in (("time", times), (field, values)):
        object.__setattr__(shock, name, tuple(float(one) for one in given))


Rows = Annotated[tuple[float, ...], check_table]
"""A column of the table of a shock, which ``check_table`` checks row by row."""


def columns_of(shock: Shock) -> dict[str, Sequence[float]]:
    """Return the columns of the table of a shock by their names; none for one without a table."""
    if shock.column is None or not shock.rows:
        return {}
    time, values = zip(*shock.rows, strict=True)
    return {"time_s": time, shock.column[1]: values}


def text_of(columns: Mapping[str, Sequence[float]]) -> str:
    """Return the text of a CSV file with these columns; truth values are written as 0 or 1."""
    rows = (",".join(repr(+value) for value in row) for row in zip(*columns.values(), strict=True))
    return "\n".join([",".join(columns), *rows]) + "\n"


def read_columns(
    path: Path,
    key: str,
    name: str | None,
    most: int,
    names: Sequence[str],
    optional: Sequence[str] = (),
) -> dict[str, tuple[float, ...]]:
    """Return the columns of a CSV file of numbers, of at most ``most`` bytes, by their names.

    A SceneError says what is wrong; ``key`` and ``name`` are those of the file in a scene file.
    """
    try:
        header, rows = read_rows(path, most)
    except ValueError as problem:
        allowed = f"cannot be read ({problem}); must be a CSV file"
        raise SceneError(key, name, allowed, None if name else path) from None
    allowed = f"must be {','.join(one for one in names if one not in optional)}"
    allowed += f", and perhaps {', '.join(optional)}" if optional else ""
    unknown = next((one for one in header if one not in names), None)
    if unknown is not None:
        raise SceneError("column", unknown, f"is unknown: the first line {allowed}", path)
    if sorted(header) != sorted(one for one in names if one in header or one not in optional):
        raise SceneError("first line", ",".join(header), allowed, path)
    values = []
    for number, row in enumerate(rows, start=1):
        try:
            values.append([float(cell) for cell in row])
        except ValueError:
            values.append([])
        if len(values[-1]) != len(header):
            allowed = f"must be {len(header)} numbers, {','.join(header)}"
            raise SceneError(f"row {number}", ",".join(row), allowed, path)
    return {one: tuple(row[k] for row in values) for k, one in enumerate(header)}


def read_table(kind: type[_Kind], path: Path, name: str | None = None) -> _Kind:
    """Read a shock from a CSV file with the header ``time_s`` and the column of its values."""
    assert kind.column is not None
    field, column = kind.column
    columns = read_columns(path, "shock.file", name, _MOST_BYTES, ("time_s", column))
    given: dict[str, Any] = {"time": columns["time_s"], field: columns[column]}
    given["file"] = name or str(path)
    try:
        return kind(**given)
    except SceneError as problem:
        raise SceneError(problem.key, problem.value, problem.allowed, file=path) from None
