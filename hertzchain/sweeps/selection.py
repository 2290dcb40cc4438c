"""Selects the rows of a sweep that are drawn."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hertzchain.errors import HertzchainError, SceneError, did_you_mean, require
from hertzchain.scene.parts import key_named
from hertzchain.scene.quantities import to_si
from hertzchain.sweeps.axes import Axis, Listed, Span, key_of
from hertzchain.sweeps.columns import (
    COLUMNS,
    IN_TITLES,
    OTHER_MEASURE,
    TEXT,
    TITLES,
    columns_of,
)

if TYPE_CHECKING:
    import pandas


_AS_GIVEN = 1e-3  # largest relative difference of a given value from the sweep's: three digits


PAPER_NAMES = {
    "p": "transition_granules",
    "F_SW": "solitary_wave_force_N",
    "LM_ratio": "momentum_ratio",
    "F0": "peak_force",
    "n": "duration_ratio",
    "N": "granules",
}
"""Columns by their names in the paper."""


def full_name(name: str, columns: Sequence[str] = COLUMNS, varied: Collection[str] = ()) -> str:
    """Return the full name of a column, given with or without its section, or as in the paper.

    Of several sections that have it, the one that varies is meant.
    """
    meant = PAPER_NAMES.get(name, name)
    found = [one for one in columns if meant in (one, one.partition(".")[2] or one)]
    if len(found) > 1:
        found = [one for one in found if one in varied] or found
    if len(found) > 1:
        raise SceneError(name, None, f"is in several sections: name one of {', '.join(found)}")
    allowed = f"is no column of a sweep, which has {', '.join(columns)}"
    require(len(found) == 1, name, None, allowed + did_you_mean(name, columns))
    return found[0]


def varied_names(manifest: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the names of the parameters that vary in a sweep."""
    return tuple(axis["name"] for axis in manifest["vary"])


def names_of_columns(manifest: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the names of the columns of a sweep."""
    columns = columns_of(manifest["scene"], varied_names(manifest))
    return tuple(column.name for column in columns)


@dataclass(frozen=True, eq=False)
class Rows:
    """Rows to draw, and the place of each among all values of the varying parameters."""

    column: Mapping[str, NDArray[Any]]  # columns to draw, by name, shape (rows,)
    # index of the value on each crossed axis, and of the backend: (rows,)
    place: Mapping[str, NDArray[np.int64]]
    axes: Mapping[str, Axis]  # all that varies, by name
    left: tuple[str, ...]  # names with several values: those that are not fixed
    fixed: Mapping[str, Any]  # values that are the same in all rows
    backends: tuple[str, ...]
    remarks: tuple[str, ...]  # sentences on missing rows

    def behind(self, name: str | None) -> str | None:
        """Return the parameter on which a column depends; None if that is not exactly one."""
        for one in (name, OTHER_MEASURE.get(name or "")):
            if one in self.left:
                return one
        return None

    def count(self, name: str) -> int:
        """Return the number of values of a crossed axis."""
        return len(self.backends) if name == "backend" else self.axes[name].count or 0

    def hidden(self, *shown: str | None) -> tuple[str, ...]:
        """Return the names that vary and are not shown."""
        seen = {self.behind(name) for name in shown}
        return tuple(name for name in self.left if name not in seen)


def selected_rows(
    sweep: Any, numbers: Sequence[str], colour: str | None, where: Mapping[str, Any]
) -> Rows:
    """Select the rows of a sweep that have the numbers and the wanted values."""
    manifest = sweep.manifest
    axes = {axis.name: axis for axis in map(_axis, manifest["vary"])}
    backends = tuple(one["name"] for one in manifest["backends"])
    columns = names_of_columns(manifest)
    fixed = {full_name(name, columns, axes): value for name, value in where.items()}
    allowed = f"is fixed twice: by {' and '.join(where)}"
    require(len(fixed) == len(where), next(iter(fixed), ""), None, allowed)
    fixed_to = {name: _number(name, value, axes, backends) for name, value in fixed.items()}

    named = ("scene", "backend", "failure", *numbers, *([colour] if colour else []))
    frame = sweep.to_frame(list(dict.fromkeys(named)))
    remarks = []
    if len(frame) < sweep.rows:
        there = f"{len(frame):,} of {sweep.rows:,} rows are there"
        remarks.append(f"the sweep is not complete, {there}")
    place = _places(frame, axes, backends, manifest["samples"])
    keep = np.ones(len(frame), np.bool_)
    for name, number in fixed_to.items():
        keep &= place[name] == number
    frame, place = frame[keep], {name: found[keep] for name, found in place.items()}
    values = {name: _column(frame, name) for name in dict.fromkeys((*named[3:], "backend"))}
    lacking = {name: np.isnan(found) for name, found in values.items() if name not in TEXT}
    lost = np.any(list(lacking.values()), axis=0)
    without = " or ".join(name for name, holes in lacking.items() if holes.any())
    if lost.all():
        what = f"no row has {without}" if lost.size else "its rows are not there yet"
        raise HertzchainError(f"there is nothing to draw: {what}")
    if lost.any():
        failed = int((frame["failure"].notna().to_numpy() & lost).sum())
        more = f"; {failed:,} of them failed" if failed else ""
        remarks.append(
            f"{int(lost.sum()):,} of {lost.size:,} rows have no {without} and are left out{more}"
        )
    several = [name for name, axis in axes.items() if axis.count is None or axis.count > 1]
    several += ["backend"] if len(backends) > 1 else []
    return Rows(
        {name: found[~lost] for name, found in values.items()},
        {name: found[~lost] for name, found in place.items()},
        axes,
        tuple(name for name in several if name not in fixed),
        _same_in_all(manifest, axes, backends, fixed_to),
        backends,
        tuple(remarks),
    )


def _axis(entry: Mapping[str, Any]) -> Axis:
    """Return an axis from its entry in the manifest."""
    return Span(**entry) if "low" in entry else Listed(entry["name"], tuple(entry["values"]))


def _number(name: str, wanted: Any, axes: Mapping[str, Axis], backends: Sequence[str]) -> int:
    """Return the index of the value of a parameter that is meant."""
    if name == "backend":
        require(wanted in backends, name, wanted, f"is not in the sweep: {', '.join(backends)}")
        return backends.index(wanted)
    allowed = f"does not vary in this sweep; what does: {', '.join(axes)}"
    require(name in axes, name, None, allowed)
    axis = axes[name]
    allowed = "was sampled, so that hardly two rows share a value: it cannot be fixed"
    require(axis.count is not None, name, None, allowed)
    assert axis.count is not None
    values = axis.at(np.arange(axis.count))
    if name in TEXT:
        require(wanted in values, name, wanted, f"is not in the sweep: {', '.join(values)}")
        return int(np.nonzero(values == wanted)[0][0])
    given = wanted.strip() if isinstance(wanted, str) else wanted
    key = key_named(name)
    number = float(to_si(name, given, "" if key is None else key.unit))
    off = np.abs(values - number)
    nearest = np.argsort(off, kind="stable")[:2]
    if not off[nearest[0]] <= _AS_GIVEN * abs(values[nearest[0]]):
        said = " and ".join(f"{value:.5g}" for value in values[np.sort(nearest)])
        raise SceneError(name, wanted, f"is not in the sweep; the nearest there: {said}")
    return int(nearest[0])


def _places(
    frame: pandas.DataFrame,
    axes: Mapping[str, Axis],
    backends: Sequence[str],
    samples: Mapping[str, Any] | None,
) -> dict[str, NDArray[np.int64]]:
    """Return the indices of rows on each crossed axis, from their exact scene numbers."""
    crossed = {name: axis.count for name, axis in axes.items() if axis.count is not None}
    shape = (*crossed.values(), *([samples["count"]] if samples else []))
    found = np.unravel_index(frame["scene"].to_numpy(np.int64), shape)
    place = {name: at.astype(np.int64) for name, at in zip(crossed, found, strict=False)}
    place["backend"] = np.zeros(len(frame), np.int64)
    for number, name in enumerate(backends):
        place["backend"][(frame["backend"] == name).to_numpy(np.bool_)] = number
    return place


def _column(frame: pandas.DataFrame, name: str) -> NDArray[Any]:
    if name in TEXT:  # each name is stored once for all its rows
        codes, names = frame[name].factorize()
        found: NDArray[Any] = np.asarray(names, object)[codes]
        return found
    return frame[name].to_numpy(np.float64, na_value=np.nan)


def _same_in_all(
    manifest: Mapping[str, Any],
    axes: Mapping[str, Axis],
    backends: Sequence[str],
    fixed_to: Mapping[str, int],
) -> dict[str, Any]:
    """Return values for the title: parameters that do not vary, and fixed ones."""
    base = {
        f"{section}.{key}": value
        for section, part in manifest["scene"].items()
        for key, value in part.items()
        if value not in (None, 0)  # a gap, a load or a gravity of 0 is absent
    }
    varies = {*axes, *(OTHER_MEASURE[name] for name in axes if name in OTHER_MEASURE)}
    if any(key_of(name) == "granules" for name in axes):  # keys of a segment: the chain's own vary
        varies.add("chain.granules")
    same = {name: base[name] for name in IN_TITLES if name in base and name not in varies}
    for name, axis in axes.items():
        if name in fixed_to or axis.count == 1:
            same[name] = axis.at(np.array([fixed_to.get(name, 0)]))[0]
    if "backend" in fixed_to or len(backends) == 1:
        same["backend"] = backends[fixed_to.get("backend", 0)]
    return {name: same[name] for name in dict.fromkeys((*TITLES, *same)) if name in same}
