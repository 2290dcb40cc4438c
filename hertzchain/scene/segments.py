"""Chains of different granules, from segments of a scene file or from a table of granules."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from hertzchain.errors import SceneError, require
from hertzchain.scene.chain import MATERIAL, MOST_UNLIKE, Chain
from hertzchain.scene.keys import Key, keys_of
from hertzchain.scene.tables import read_columns, text_of

_SAME = {name: key for name, key in keys_of(Chain).items() if name != "granules"}
"""Keys by which a granule of a segment can differ."""

RADIUS_RATIO = Key("", "radius over that of the granule before", above=0)
"""Key of a taper: a segment without a cell."""

OF_SEGMENT = {"granules": Key("", "granules", least=1, most=MOST_UNLIKE, kind="int"),
               **_SAME, "radius_ratio": RADIUS_RATIO}  # fmt: skip
"""Keys of a segment."""

_COLUMNS = {
    "_".join(filter(None, (name, key.unit.replace("/", "_").replace("^", "")))): name
    for name, key in _SAME.items()
}
"""Columns of a table of granules, with their keys."""

_OPTIONAL = tuple(column for column in _COLUMNS if _COLUMNS[column] not in (*MATERIAL, "gap"))
"""Columns that may be absent."""

_MOST_BYTES = 50_000_000
"""Size of a table of granules [bytes], chosen: 500,000 rows."""

Quantities = Callable[..., dict[str, Any]]
"""Function that reads the values of a section: see ``reading.quantities``."""


def expand(defaults: Chain, segments: Any, quantities: Quantities) -> Chain:
    """Return a chain, granule by granule, from its defaults and what each segment changes."""
    allowed = "must be one or more tables, [[chain.segments]]"
    is_list = isinstance(segments, list) and segments
    require(bool(is_list), "chain.segments", segments, allowed)
    counts = 0
    columns: dict[str, list[float]] = {key: [] for key in _SAME}
    read: list[dict[str, Any]] = []
    for number, segment in enumerate(segments, start=1):
        name = f"chain.segments.{number}"
        require(isinstance(segment, dict), name, segment, allowed)
        values = quantities(name, segment, OF_SEGMENT, ("cell",))
        require("granules" in values, f"{name}.granules", None, "missing")
        most, granules = defaults.granules, values["granules"]
        require(most <= MOST_UNLIKE, "chain.granules", most, f"must be at most {MOST_UNLIKE}")
        OF_SEGMENT["granules"].check(f"{name}.granules", granules)
        counts += granules
        require(counts <= most, f"{name}.granules", granules, _sum_allowed(most, "more"))
        cells = _cells(name, values, quantities)
        read.append({**values, "cell": cells} if "cell" in values else values)
        _fill(columns, defaults, values, cells, granules, name)
    require(counts == defaults.granules, "chain.segments", None, _sum_allowed(defaults.granules))
    try:
        chain = Chain(defaults.granules, *(columns[key] or None for key in _SAME))
    except SceneError as problem:
        raise SceneError(f"chain.{problem.key}", problem.value, problem.allowed) from None
    given = {key: value for key, value in asdict(defaults).items() if value is not None}
    chain.__dict__["_section"] = {**given, "segments": read}
    return chain


def _sum_allowed(granules: int, how: str = "fewer") -> str:
    return f"the granules of all segments must sum to chain.granules = {granules}, they are {how}"


def _cells(name: str, values: Mapping[str, Any], quantities: Quantities) -> list[dict[str, Any]]:
    """Return the differing values of each granule of the cell that a segment repeats."""
    if "cell" not in values:
        return [{}]
    cell = values["cell"]
    allowed = "must be a list of one or more tables, [{...}, {...}]; {} is a granule as in [chain]"
    is_cell = isinstance(cell, list) and cell and all(isinstance(one, dict) for one in cell)
    require(bool(is_cell), f"{name}.cell", cell, allowed)
    if "radius_ratio" in values:
        allowed = "not allowed with a cell, in which each granule has its own radius"
        raise SceneError(f"{name}.radius_ratio", values["radius_ratio"], allowed)
    return [quantities(f"{name}.cell.{k}", one, _SAME) for k, one in enumerate(cell, start=1)]


def _fill(
    columns: dict[str, list[float]],
    defaults: Chain,
    values: Mapping[str, Any],
    cells: list[dict[str, Any]],
    granules: int,
    name: str,
) -> None:
    """Append the granules of a segment."""
    ratio = values.get("radius_ratio", 1.0)
    RADIUS_RATIO.check(f"{name}.radius_ratio", ratio)
    for k in range(granules):
        own = {**values, **cells[k % len(cells)]}
        for key, column in columns.items():
            value = own.get(key, getattr(defaults, key))
            if key == "yield_strength" and defaults.yield_strength is None:
                allowed = "needs chain.yield_strength, too, for the granules that have none here"
                require(key not in own, f"{name}.{key}", value, allowed)
                continue
            column.append(_tapered(value, ratio, k) if key == "radius" else value)


def _tapered(radius: float, ratio: float, k: int) -> float:
    """Radius of the k-th granule of a taper [m]; infinite beyond the range of floating point."""
    try:
        return float(radius * ratio**k)
    except OverflowError:
        return math.inf


def read_granule_table(path: Path, name: str | None = None) -> Chain:
    """Read a chain from a CSV file with a row for each granule. A SceneError says what is wrong."""
    columns = read_columns(path, "chain.file", name, _MOST_BYTES, [*_COLUMNS], _OPTIONAL)
    values: dict[str, Any] = {_COLUMNS[one]: column for one, column in columns.items()}
    for row, value in enumerate(values.get("fixed", ()), start=1):
        if value not in (0, 1):
            raise SceneError(f"fixed in row {row}", value, "must be 0 or 1", file=path)
    if "fixed" in values:
        values["fixed"] = [bool(value) for value in values["fixed"]]
    try:
        return Chain(len(values["radius"]), **values)
    except SceneError as problem:
        raise SceneError(problem.key, problem.value, problem.allowed, file=path) from None


def granule_table(chain: Chain) -> str:
    """Return the text that ``read_granule_table`` reads back as the same chain."""
    columns = {column: getattr(chain, key) for column, key in _COLUMNS.items()}
    return text_of(
        {
            column: value if isinstance(value, tuple) else (value,) * chain.granules
            for column, value in columns.items()
            if value or column not in _OPTIONAL
        }
    )
