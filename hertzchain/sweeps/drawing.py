"""Pictures of a sweep: lines or points of a result, a map, or peaks along the chain.

``Sweep`` draws itself by these functions, which therefore do not import it.
"""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.errors import HertzchainError, SceneError, require
from hertzchain.report.document import in_prefixed
from hertzchain.report.style import COLOURS, distinct
from hertzchain.scene.file import key_named
from hertzchain.scene.keys import to_si
from hertzchain.sweeps.columns import (
    OTHER_MEASURE,
    TEXT,
    column_named,
    columns_in,
    full_name,
    is_whole,
)
from hertzchain.sweeps.design import Axis, Listed, Span, Tabled

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

    from hertzchain.report.picture import Picture

SIZE = (8.0, 5.0)  # width and height by default [inches]
_LETTERS, _LETTERS_OF_TITLE = 15, 9  # letters in an inch of width: remarks, title
_MOST_LINES = 1000  # most lines, chosen: more cannot be distinguished, and each costs a millisecond
_MOST_VECTORS = 5000  # number of points from which PDF and SVG contain a bitmap of them
_TOLERANCE = 1e-3  # largest relative difference of a given value from the sweep's: three digits
_DECADES = 100.0  # ratio of the largest value to the smallest from which an axis is logarithmic
_BLUE = "#0072B2"  # where colours show nothing

_ALONG = ("peak_force_N", "peak_time_s")  # columns that can be drawn along the chain


@dataclass(frozen=True, eq=False)
class Drawn:
    """A picture of a sweep, with sentences on what it omits, which also stand below it."""

    figure: Picture
    remarks: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class _Rows:
    """Rows to draw, whose values of crossed axes are exactly those of the axes."""

    frame: pandas.DataFrame
    axes: Mapping[str, Axis]  # all that varies in the sweep, by name
    left: Sequence[str]  # names with several values in these rows

    def behind(self, name: str | None) -> str | None:
        """Return the parameter on which a column depends; None if that is not exactly one."""
        names = (name, OTHER_MEASURE.get(name or ""))
        return next((parameter for parameter in names if parameter in self.left), None)

    def hidden(self, *shown: str | None) -> list[str]:
        """Return the names that vary and are not shown."""
        seen = {self.behind(name) for name in shown}
        return [name for name in self.left if name not in seen]

    def is_crossed(self, name: str | None) -> bool:
        """Return whether many rows share the values of a name that varies."""
        return name == "backend" or getattr(self.axes.get(name or ""), "count", None) is not None

    def values(self, name: str) -> NDArray[Any]:
        """Return the values of a crossed axis, increasing."""
        axis = self.axes[name]
        return np.sort(axis.at(np.arange(axis.count or 0)))

    def is_log(self, name: str) -> bool:
        """Return whether logarithms of a column are equally spaced, or its values span decades."""
        axis = self.axes.get(name)
        low, high = self.frame[name].min(), self.frame[name].max()
        spans = low > 0 and high / low > _DECADES and math.isfinite(high)
        return (isinstance(axis, Span) and axis.log) or bool(spans)


def draw(
    sweep: Any,
    x: str,
    y: str,
    colour: str | None = None,
    where: Mapping[str, Any] | None = None,
    size: tuple[float, float] = SIZE,
) -> Drawn:
    """Draw a column of a sweep over another, as lines or points; or a map, over two parameters.

    It is a map where ``y`` is a parameter that varies. ``colour`` is a column; the default is the
    backend where there are several. ``where`` selects rows by values of parameters or ``backend``;
    a number selects the nearest value of the sweep, if both agree to three digits. ``size`` is
    width and height [inches]. Where the peaks of all contacts were kept, ``x`` may be ``contact``.
    """
    from hertzchain.report.picture import SMALL, Picture, at_whole_numbers, in_units

    columns = [column.name for column in columns_in(sweep.manifest)]
    varied = [axis["name"] for axis in sweep.manifest["vary"]]
    along = x == "contact"
    colour = varied[0] if along and colour is None else colour
    colour = None if colour is None else full_name(colour, columns, varied)
    if along:
        allowed = f"must be one of {', '.join(_ALONG)} where --x is contact"
        require(y in _ALONG, y, None, allowed)
        allowed = "the sweep did not keep the peaks of all contacts: sweep again with --peaks"
        require(sweep.manifest["peaks"], "contact", None, allowed)
    else:
        x, y = full_name(x, columns, varied), full_name(y, columns, varied)
    for name in (x, y):
        allowed = "is text: --x and --y must be columns of numbers, text is for --colour"
        require(name not in TEXT, name, None, allowed)
    require(colour != "failure", "failure", None, "is a sentence and cannot be a colour")
    require(len({x, y, colour}) == 3, x if x in (y, colour) else y, None, "given twice")
    fixed = {full_name(name, columns, varied): value for name, value in (where or {}).items()}
    allowed = f"is fixed twice: by {' and '.join(where or ())}"
    require(len(fixed) == len(where or {}), next(iter(fixed), ""), None, allowed)
    rows, remarks = _selected(sweep, [*([] if along else [x, y]), colour], fixed)
    figure = Picture(size)
    axes = figure.subplots()
    axes.grid(alpha=0.3)
    if along:
        remarks += _draw_chains(axes, sweep, rows, y, colour)
    elif y in rows.left:
        remarks += _draw_map(axes, rows, x, y, colour)
    else:
        colour = colour or ("backend" if "backend" in rows.left else None)
        remarks += _draw_over(axes, rows, x, y, colour)
    for name, set_scale, axis in (
        (x, axes.set_xscale, axes.xaxis),
        (y, axes.set_yscale, axes.yaxis),
    ):
        if not along and rows.is_log(name):
            set_scale("log")
        elif is_whole(name):
            axis.set_major_locator(at_whole_numbers())
        in_units(axis, column_named(name).label)
    if remarks:
        text = textwrap.fill("; ".join(remarks), int(_LETTERS * size[0]))
        figure.supxlabel(text, fontsize=7, color="0.35")
    if fixed and size[0] >= SMALL:  # a paper has a caption
        title = ", ".join(_said(name, rows.frame[name].iloc[0]) for name in fixed)
        axes.set_title(textwrap.fill(title, int(_LETTERS_OF_TITLE * size[0])), fontsize=10)
    return Drawn(figure, tuple(remarks))


# Rows


def _selected(
    sweep: Any, names: Iterable[str | None], where: Mapping[str, Any]
) -> tuple[_Rows, list[str]]:
    """Return the rows of a sweep that have the wanted values, and sentences on missing ones."""
    manifest = sweep.manifest
    axes = {
        axis["name"]: Span(**axis)
        if "low" in axis
        else Listed(axis["name"], tuple(axis["values"]))
        if "values" in axis
        else Tabled(axis["name"], np.zeros(0))
        for axis in manifest["vary"]
    }
    numbers = [name for name in dict.fromkeys(names) if name is not None]
    crossed = [name for name, axis in axes.items() if axis.count is not None]
    read = dict.fromkeys(("scene", "backend", "failure", *numbers, *crossed))
    frame = sweep.to_frame(list(read))
    remarks = []
    if len(frame) < sweep.rows:
        there = f"{len(frame):,} of {sweep.rows:,} rows are there"
        remarks.append(f"the sweep is not complete, {there}")
    for name, value in where.items():
        if name != "backend":
            allowed = f"does not vary in this sweep; what does: {', '.join(axes)}"
            require(name in axes, name, None, allowed)
            allowed = "was sampled or is of a table, whose rows share no values: it cannot be fixed"
            require(axes[name].count is not None, name, None, allowed)
        frame = frame[frame[name] == _meant(name, value, frame[name].unique())]
    lacking = [name for name in numbers if name not in TEXT and frame[name].isna().any()]
    lost = frame[lacking].isna().any(axis=1)
    if lost.all():
        what = f"no row has {' or '.join(lacking)}" if lost.size else "its rows are not there yet"
        raise HertzchainError(f"there is nothing to draw: {what}")
    if lost.any():
        failed = int(frame["failure"][lost].notna().sum())
        more = f"; {failed:,} of them failed" if failed else ""
        without = f"{int(lost.sum()):,} of {lost.size:,} rows have no {' or '.join(lacking)}"
        remarks.append(f"{without} and are left out{more}")
    several = [name for name, axis in axes.items() if axis.count is None or axis.count > 1]
    several += ["backend"] if len(manifest["backends"]) > 1 else []
    numeric = {name: "float64" for name in numbers if name not in TEXT}
    left = [name for name in several if name not in where]
    return _Rows(frame[~lost].astype(numeric), axes, left), remarks


def _meant(name: str, wanted: Any, values: NDArray[Any]) -> Any:
    """Return the value of a sweep that matches a given one."""
    if name in TEXT:
        require(wanted in values, name, wanted, f"is not in the sweep: {', '.join(values)}")
        return wanted
    key = key_named(name)
    given = wanted.strip() if isinstance(wanted, str) else wanted
    off = np.abs(values - float(to_si(name, given, "" if key is None else key.unit)))
    nearest = values[np.argsort(off, kind="stable")[:2]]
    if not np.min(off) <= _TOLERANCE * abs(nearest[0]):
        said = " and ".join(f"{value:.5g}" for value in np.sort(nearest))
        raise SceneError(name, wanted, f"is not in the sweep; the nearest there: {said}")
    return nearest[0]


# Lines and points


def _colours(axes: Axes, rows: _Rows, name: str | None) -> Any:
    """Draw a legend of a column of text, or a colour bar; return the colours of its values."""
    from matplotlib.lines import Line2D

    from hertzchain.report.picture import SMALL, legend_look

    figure: Any = axes.figure
    if name is None:
        return lambda values: [_BLUE] * len(values)
    if name in TEXT:
        texts = list(rows.frame[name].unique())
        colour_of = {text: COLOURS.get(text, distinct(k)) for k, text in enumerate(texts)}
        handles = [Line2D([], [], color=colour, marker="o") for colour in colour_of.values()]
        width = figure.get_figwidth()
        look = legend_look(texts, width, width < SMALL)
        title = column_named(name).label
        figure.legend(handles, texts, loc="outside upper center", title=title, **look)
        return lambda values: [colour_of[value] for value in values]
    return _colour_bar(axes, rows, name).to_rgba


def _colour_bar(axes: Axes, rows: _Rows, name: str) -> Any:
    """Draw a colour bar for a column of numbers; return the colours of its values."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import LogNorm, Normalize

    from hertzchain.report.picture import at_whole_numbers, in_units

    low, high, is_log = rows.frame[name].min(), rows.frame[name].max(), rows.is_log(name)
    colours = ScalarMappable((LogNorm if is_log else Normalize)(low, high), "viridis")
    bar: Any = axes.figure.colorbar(colours, ax=axes)
    if is_whole(name) and not is_log:
        bar.locator = at_whole_numbers()
        bar.update_ticks()
    in_units(bar.ax.yaxis, column_named(name).label)
    return colours


def _draw_over(axes: Axes, rows: _Rows, x: str, y: str, colour: str | None) -> list[str]:
    """Draw lines where x belongs to a parameter on a grid, otherwise points."""
    along = rows.behind(x)
    across = [name for name in rows.left if name != along]
    lines = []
    if all(map(rows.is_crossed, (along, *across))):
        groups = rows.frame.groupby(across, sort=False) if across else [((), rows.frame)]
        allowed = f"must be {_MOST_LINES:,} at most to be told apart: fix {' or '.join(across)}"
        few = len(groups) <= _MOST_LINES
        require(few, "lines", len(groups), f"{allowed} to one value (--where NAME=VALUE)")
        values = rows.values(str(along))  # one without a row is a gap
        lines = [line.set_index(along, drop=False).reindex(values) for _, line in groups]
    if lines and (colour is None or all(line[colour].nunique() < 2 for line in lines)):
        _draw_lines(axes, rows, lines, x, y, colour)
        how = "all values are lines of one colour; --colour tells them apart"
    else:
        how = "points of all values are drawn on top of one another"
        _draw_points(axes, rows, x, y, colour)
    hidden = _listed(rows.hidden(x, colour))
    return [f"{hidden}, too: {how}"] if hidden else []


def _draw_lines(
    axes: Axes, rows: _Rows, lines: Sequence[pandas.DataFrame], x: str, y: str, colour: str | None
) -> None:
    """Draw lines, each of one colour; a missing point is a gap."""
    colours = _colours(axes, rows, colour)
    style = "steps-mid" if is_whole(y) else "default"  # there is no p between 9 and 10
    for line in lines:
        (shade,) = colours(line[colour or y].dropna()[:1])
        axes.plot(line[x], line[y], marker=".", linewidth=1.2, drawstyle=style, color=shade)


def _draw_points(axes: Axes, rows: _Rows, x: str, y: str, colour: str | None) -> None:
    frame = rows.frame
    shades = _colours(axes, rows, colour)(frame[colour or y])
    area = min(16.0, max(1.0, 140**2 / len(frame)))
    axes.scatter(frame[x], frame[y], s=area, c=shades, rasterized=len(frame) > _MOST_VECTORS)


def _draw_chains(axes: Axes, sweep: Any, rows: _Rows, y: str, colour: str | None) -> list[str]:
    """Draw the peaks of all contacts along the chain, a line for each scene and backend."""
    require(len(rows.frame) <= _MOST_LINES, "--where", None, "must leave 1,000 lines at most")
    peaks = rows.frame.merge(sweep.peaks_to_frame(), on=["scene", "backend"])
    lines = [line for _, line in peaks.groupby(["scene", "backend"], sort=False)]
    _draw_lines(axes, rows, lines, "contact", y, colour)
    hidden = _listed(rows.hidden(colour))
    return [f"{hidden}, too: lines of all values are drawn"] if hidden else []


# Maps


def _draw_map(axes: Axes, rows: _Rows, x: str, y: str, colour: str | None) -> list[str]:
    """Draw a number over two parameters: cells of a grid, otherwise points."""
    if colour is None or colour in TEXT:
        raise SceneError(
            y, None, "varies, which makes a map: name the column of numbers to draw with --colour"
        )
    hidden = rows.hidden(x, y)
    on_grid = x in rows.left and rows.is_crossed(x) and rows.is_crossed(y)
    fixed = [f"--where {name}=VALUE" for name in hidden if rows.is_crossed(name)]
    if hidden and (on_grid or fixed):
        advice = " and ".join(fixed) or f"take {hidden[0]} as --x or --y"
        raise HertzchainError(
            f"{_listed(hidden)}, too, so that several values fall into one place of the map:"
            f" {advice}"
        )
    if on_grid:
        axes.grid(visible=False)
        _draw_cells(axes, rows, x, y, colour)
        return []
    _draw_points(axes, rows, x, y, colour)
    left_out = _listed(rows.hidden(x, y, colour))
    return [f"{left_out}, too: the map has points of all values"] if left_out else []


def _draw_cells(axes: Axes, rows: _Rows, x: str, y: str, colour: str) -> None:
    values = rows.values(x), rows.values(y)
    cells = rows.frame.pivot_table(colour, y, x).reindex(values[1], columns=values[0])
    edges = [cell_edges(at, rows.is_log(name)) for at, name in zip(values, (x, y), strict=True)]
    axes.set_facecolor("0.85")
    bar, shown = _colour_bar(axes, rows, colour), np.ma.masked_invalid(cells.to_numpy())
    axes.pcolormesh(*edges, shown, norm=bar.norm, cmap=bar.cmap, rasterized=True)
    if cells.isna().to_numpy().any():
        from matplotlib.patches import Patch

        axes.legend(handles=[Patch(facecolor="0.85", edgecolor="0.4", label="no number")])


def cell_edges(values: FloatArray, log: bool) -> FloatArray:
    """Return edges, shape (values + 1,), halfway between increasing values or their logarithms."""
    at = np.log(values) if log else values
    between = (at[1:] + at[:-1]) / 2
    first, last = 2 * at[0] - between[0], 2 * at[-1] - between[-1]
    if not log and at[0] > 0:  # positive values have no cell edge below 0
        first = max(first, 0.0)
    edges = np.concatenate([[first], between, [last]])
    return np.exp(edges) if log else edges


# Words


def _said(name: str, value: Any) -> str:
    from hertzchain.report.picture import parts_of

    before, unit, after = parts_of(column_named(name).label)
    return f"{before} {value}" if name in TEXT else f"{before}{after} = {in_prefixed(value, unit)}"


def _listed(names: Sequence[str]) -> str:
    """Return "A and B vary" for these names; empty where there are none."""
    *most, last = names or ("",)
    return f"{', '.join(most)} and {last} vary" if most else f"{last} varies" if last else ""
