"""Axes of a sweep: lists and ranges, each of one parameter."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from numbers import Integral
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.errors import SceneError, require
from hertzchain.scene.file import key_named
from hertzchain.scene.keys import to_si

if TYPE_CHECKING:
    import pandas

MOST_GRANULES = 1_000_000  # of a chain, chosen: a part may hold its peaks several times
_MOST_LISTED = 100_000  # most values of one list (chosen); kept in memory and with the sweep

_FORMS = "A,B,C or LOW:HIGH:COUNT, LOW:HIGH:COUNT:log, or to be sampled LOW:HIGH, LOW:HIGH:log"

Value = float | int | str


def key_of(name: str) -> str:
    """Return the key of a parameter in its section or segment."""
    return name.rpartition(".")[2]


def _kind(name: str) -> str:
    """Return the type of the values of a parameter; float for an unknown one."""
    key = key_named(name)
    return "float" if key is None else key.kind


@dataclass(frozen=True)
class Listed:
    """A list axis: a parameter, by its name in the scene file, and its values in SI or as text."""

    name: str
    values: tuple[Value, ...]

    @property
    def count(self) -> int:
        """Number of values."""
        return len(self.values)

    @property
    def ends(self) -> tuple[Value, ...]:
        """Values to check: if these are possible, all are."""
        return self.values

    def at(self, index: NDArray[np.int64]) -> NDArray[Any]:
        """Return the values with these numbers."""
        return np.asarray(self.values)[index]


@dataclass(frozen=True)
class Span:
    """A range axis: a parameter, by its name in the scene file, between two values in SI.

    It has a grid of ``count`` values including both ends, or sampled values if None, spaced equally
    or in logarithms.
    """

    name: str
    low: float
    high: float
    count: int | None
    log: bool

    @property
    def ends(self) -> tuple[Value, ...]:
        """Values to check: if these are possible, all are."""
        ends = self.low, self.high
        return tuple(map(int, ends)) if _kind(self.name) == "int" else ends

    def at(self, index: NDArray[np.int64]) -> NDArray[Any]:
        """Return the values with these numbers on the grid."""
        assert self.count is not None
        return self.between(index / max(self.count - 1, 1))

    def between(self, fraction: FloatArray) -> NDArray[Any]:
        """Return the values at fractions, 0 to 1, of the way from one end to the other."""
        if _kind(self.name) == "int":  # each whole number has the same share
            if self.log:
                edges = self.low - 0.5, self.high + 0.5
                drawn = edges[0] * (edges[1] / edges[0]) ** fraction
                return np.clip(np.rint(drawn), self.low, self.high).astype(np.int64)
            share = np.floor(self.low + fraction * (self.high - self.low + 1))
            return np.clip(share, self.low, self.high).astype(np.int64)
        if self.log:
            inside = self.low ** (1 - fraction) * self.high**fraction
        else:
            inside = self.low + fraction * (self.high - self.low)
        # Both ends exact to the last digit.
        return np.where(fraction == 0, self.low, np.where(fraction == 1, self.high, inside))


@dataclass(frozen=True, eq=False)
class Tabled:
    """A column of a table: a parameter, and its value in each row, in SI or as text.

    An empty cell is NaN or "": the row has the value of the base.
    """

    name: str
    cells: NDArray[Any]
    count: None = None

    @property
    def ends(self) -> tuple[Value, ...]:
        """Values to check: if these are possible, all are."""
        return tuple(np.unique(self.cells[is_given(self.cells)]).tolist())

    def at(self, index: NDArray[np.int64]) -> NDArray[Any]:
        """Return the cells of these rows."""
        return np.asarray(self.cells[index])


Axis = Listed | Span | Tabled
"""A parameter that varies; those of a table vary together."""

_WITH_UNIT = re.compile(r"(.+?)\s*\[(.+)\]\s*")
"""The head of a column with a unit, such as ``chain.radius [mm]``."""


def is_given(cells: NDArray[Any]) -> NDArray[np.bool_]:
    """Return which cells of a table are not empty."""
    return np.asarray(cells != "" if cells.dtype.kind == "U" else ~np.isnan(cells))


def axes_of_table(table: pandas.DataFrame, full: Callable[[str], str]) -> tuple[Tabled, ...]:
    """Return the columns of a table; ``full`` gives the full name of a parameter."""
    axes = []
    for place, head in enumerate(table.columns):
        match = _WITH_UNIT.fullmatch(str(head))
        name = full(match[1] if match else str(head).strip())
        cells = table.iloc[:, place]
        try:
            distinct = cells.dropna().unique().tolist()
        except TypeError:  # lists and other things
            raise SceneError(name, None, "must have numbers or texts in its cells") from None
        values = {}
        for cell in distinct:
            try:
                values[cell] = _cell(name, cell, match[2] if match else "")
            except SceneError as problem:
                row = 1 + int(np.argmax((cells == cell).to_numpy()))
                allowed = f"{problem.allowed} (row {row} of the table)"
                raise SceneError(problem.key, problem.value, allowed) from None
        empty, kind = ("", str) if _kind(name) == "str" else (np.nan, float)
        column = cells.map(values).astype(object).where(cells.notna(), empty)
        axes.append(Tabled(name, column.to_numpy().astype(kind)))
    return tuple(axes)


def _cell(name: str, cell: Any, unit: str) -> Value:
    """Return the value of a cell in a column with a unit, if that is not ""."""
    if not unit:
        return _value(name, cell)
    try:
        number = float(cell)
    except (TypeError, ValueError):
        allowed = f"must be a number without a unit: the unit of its column is {unit}"
        raise SceneError(name, cell, allowed) from None
    return _value(name, f"{number!r} {unit}")


def axis_of(name: str, given: str | Iterable[Value]) -> Axis:
    """Return the axis of a parameter, from a list or from text in the form of the command line."""
    if isinstance(given, str) and ":" in given:
        return _range(name, given)
    several = isinstance(given, Iterable) and not isinstance(given, bytes | Mapping)
    several = several and getattr(given, "ndim", 1) == 1  # NumPy's numbers look iterable
    require(several, name, given, f"must be a list of values, or text: {_FORMS}")
    pieces: list[Any] = given.split(",") if isinstance(given, str) else list(given)
    require(0 < len(pieces) <= _MOST_LISTED, name, None, f"must take 1 to {_MOST_LISTED:,} values")
    values = tuple(_value(name, piece) for piece in pieces)
    require(len(set(values)) == len(values), name, None, "must not have a value twice")
    return Listed(name, values)


def _range(name: str, given: str) -> Axis:
    key = key_named(name)
    if key is not None and key.kind == "str":
        raise SceneError(name, given, f"has no range: name its values, {','.join(key.choices)}")
    low_text, high_text, *rest = (piece.strip() for piece in given.split(":"))
    log = bool(rest) and rest[-1] == "log"
    rest = rest[: len(rest) - log]
    require(len(rest) <= 1, name, given, f"must be {_FORMS}")
    low, high = float(_value(name, low_text)), float(_value(name, high_text))
    require(low < high, name, given, "is empty: the first end must be below the second")
    require(not log or low > 0, name, given, "must be above 0 at both ends to be logarithmic")
    if not rest:
        return Span(name, low, high, None, log)
    allowed = "must have at least 2 values, a whole number: LOW:HIGH:COUNT"
    count = _count(rest[0])
    require(count >= 2, name, given, allowed)
    span = Span(name, low, high, count, log)
    if _kind(name) != "int":
        return span
    # The whole numbers nearest to the grid, each of them once.
    require(count <= _MOST_LISTED, name, given, f"must take at most {_MOST_LISTED:,} values")
    spaced = np.geomspace if log else np.linspace
    whole = np.rint(spaced(low, high, count)).astype(np.int64)
    return Listed(name, tuple(dict.fromkeys(whole.tolist())))


def _count(text: str) -> int:
    """Return a whole number from text (also 1e3); 0 for other text."""
    try:
        number = float(text)
    except ValueError:
        return 0
    return int(number) if number.is_integer() else 0


def is_whole(value: object, least: int) -> bool:
    """Return whether a value is an integer of at least ``least`` (booleans are not)."""
    return isinstance(value, Integral) and not isinstance(value, bool) and int(value) >= least


def _value(name: str, given: Any) -> Value:
    """Return one value, in SI; a SceneError for one that its key does not allow."""
    key = key_named(name)
    if key is not None and key.kind == "str":
        require(isinstance(given, str), name, given, f"must be the name of a {key.label}")
        key.check(name, str(given).strip())
        return str(given).strip()
    plain = given.item() if isinstance(given, np.generic) else given
    unit = "" if key is None else key.unit
    number = to_si(name, plain.strip() if isinstance(plain, str) else plain, unit)
    is_whole_key = key is not None and key.kind == "int"
    require(not is_whole_key or number.is_integer(), name, given, "must be a whole number")
    value = int(number) if is_whole_key else number
    if key is not None:
        key.check(name, value)
    if key_of(name) == "granules":
        check_granules(name, value)
    return value


def check_granules(name: str, granules: float) -> None:
    """Refuse a chain whose peaks, of which a part may hold several times as many, take too much."""
    allowed = f"must be at most {MOST_GRANULES:,} in a sweep: run a longer chain by itself"
    require(granules <= MOST_GRANULES, name, granules, allowed)
