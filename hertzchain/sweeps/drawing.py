"""Pictures of a sweep: lines or points of a result, a map, or peaks along the chain.

``Sweep`` draws itself by these functions, which therefore do not import it.
"""

from __future__ import annotations

import math
import textwrap
from collections.abc import Mapping, Sequence
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
from hertzchain.sweeps.columns import TEXT, column_named, columns_in, full_name, is_whole
from hertzchain.sweeps.design import Axis

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
    """Rows to draw, and the names with several values in them.

    ``grids`` has the values of what is crossed, None for what is sampled or of a table; ``logs``
    are the names that were swept with :log.
    """

    frame: pandas.DataFrame
    grids: Mapping[str, NDArray[Any] | None]
    left: Sequence[str]
    logs: Sequence[str]

    def hidden(self, *shown: str | None) -> list[str]:
        """Return the names that vary and are not shown."""
        return [name for name in self.left if name not in shown]

    def are_crossed(self, *names: str) -> bool:
        """Return whether many rows share the values of these names, which all vary."""
        crossed = {"backend", *(name for name in self.grids if self.grids[name] is not None)}
        return crossed.intersection(self.left).issuperset(names)

    def is_log(self, name: str) -> bool:
        """Return whether a column was swept with :log, or its values span decades."""
        low, high = self.frame[name].min(), self.frame[name].max()
        return name in self.logs or bool(low > 0 and high / low > _DECADES and high < math.inf)


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
    if along:
        require(y in _ALONG, y, None, f"must be one of {', '.join(_ALONG)} where --x is contact")
        allowed = "the sweep did not keep the peaks of all contacts: sweep again with --peaks"
        require(sweep.manifest["peaks"], "contact", None, allowed)
        colour = colour or varied[0]
    else:
        x, y = (full_name(name, columns, varied) for name in (x, y))
    colour = None if colour is None else full_name(colour, columns, varied)
    for name in (x, y):
        allowed = "is text: --x and --y must be columns of numbers, text is for --colour"
        require(name not in TEXT, name, None, allowed)
    require(colour != "failure", "failure", None, "is a sentence and cannot be a colour")
    require(len({x, y, colour}) == 3, x if x in (y, colour) else y, None, "given twice")
    fixed = {full_name(name, columns, varied): value for name, value in (where or {}).items()}
    allowed = f"is fixed twice: by {' and '.join(where or ())}"
    require(len(fixed) == len(where or {}), next(iter(fixed), ""), None, allowed)
    names = [name for name in ("" if along else x, "" if along else y, colour) if name]
    rows, remarks = _selected(sweep, names, fixed)
    figure = Picture(size)
    axes = figure.subplots()
    axes.grid(alpha=0.3)
    if along:
        remarks += _draw_chains(axes, sweep, rows, y, str(colour))
    elif y in rows.left:
        remarks += _draw_map(axes, rows, x, y, colour)
    else:
        colour = colour or ("backend" if "backend" in rows.left else None)
        remarks += _draw_over(axes, rows, x, y, colour)
    for name, which, axis in ((x, "x", axes.xaxis), (y, "y", axes.yaxis)):
        if not along and rows.is_log(name):
            axes.set(**{f"{which}scale": "log"})
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
    sweep: Any, names: Sequence[str], where: Mapping[str, Any]
) -> tuple[_Rows, list[str]]:
    """Return the rows of a sweep that have the wanted values, and sentences on missing ones."""
    varied = [Axis.of(entry) for entry in sweep.manifest["vary"]]
    grids = {axis.name: np.sort(axis.at(np.arange(axis.count))) if axis.count else None
             for axis in varied}  # fmt: skip
    crossed = [name for name, values in grids.items() if values is not None]
    frame = sweep.to_frame([*dict.fromkeys(("scene", "backend", "failure", *names, *crossed))])
    remarks = []
    if len(frame) < sweep.rows:
        there = f"{len(frame):,} of {sweep.rows:,} rows are there"
        remarks.append(f"the sweep is not complete, {there}")
    for name, value in where.items():
        if name != "backend":
            allowed = f"does not vary in this sweep; what does: {', '.join(grids)}"
            require(name in grids, name, None, allowed)
            allowed = "was sampled or is of a table, whose rows share no values: it cannot be fixed"
            require(name in crossed, name, None, allowed)
        frame = frame[frame[name] == _meant(name, value, frame[name].unique())]
    numbers = [name for name in names if name not in TEXT]
    lost = frame[numbers].isna()
    lacking, lost = " or ".join(name for name in numbers if lost[name].any()), lost.any(axis=1)
    if lost.all():
        what = f"no row has {lacking}" if lost.size else "its rows are not there yet"
        raise HertzchainError(f"there is nothing to draw: {what}")
    if lost.any():
        failed = int(frame["failure"][lost].notna().sum())
        more = f"; {failed:,} of them failed" if failed else ""
        without = f"{int(lost.sum()):,} of {lost.size:,} rows have no {lacking}"
        remarks.append(f"{without} and are left out{more}")
    several = [name for name, values in grids.items() if values is None or values.size > 1]
    several += ["backend"] if len(sweep.manifest["backends"]) > 1 else []
    left = [name for name in several if name not in where]
    frame = frame[~lost].astype(dict.fromkeys(numbers, "float64"))
    return _Rows(frame, grids, left, [axis.name for axis in varied if axis.form == "log"]), remarks


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

    if name is None:
        return lambda values: [_BLUE] * len(values)
    if name not in TEXT:
        return _colour_bar(axes, rows, name).to_rgba
    figure: Any = axes.figure
    texts, width = list(rows.frame[name].unique()), figure.get_figwidth()
    colour_of = {text: COLOURS.get(text, distinct(k)) for k, text in enumerate(texts)}
    handles = [Line2D([], [], color=colour, marker="o") for colour in colour_of.values()]
    look = legend_look(texts, width, width < SMALL)
    title = column_named(name).label
    figure.legend(handles, texts, loc="outside upper center", title=title, **look)
    return lambda values: [colour_of[value] for value in values]


def _colour_bar(axes: Axes, rows: _Rows, name: str) -> Any:
    """Draw a colour bar for a column of numbers; return the colours of its values."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import LogNorm, Normalize

    from hertzchain.report.picture import at_whole_numbers, in_units

    low, high, is_log = rows.frame[name].min(), rows.frame[name].max(), rows.is_log(name)
    colours = ScalarMappable((LogNorm if is_log else Normalize)(low, high), "viridis")
    ticks = at_whole_numbers() if is_whole(name) and not is_log else None
    bar: Any = axes.figure.colorbar(colours, ax=axes, ticks=ticks)
    in_units(bar.ax.yaxis, column_named(name).label)
    return colours


def _draw_over(axes: Axes, rows: _Rows, x: str, y: str, colour: str | None) -> list[str]:
    """Draw lines over a parameter on a grid if each has one colour, otherwise points."""
    across, hidden = rows.hidden(x), rows.hidden(x, colour)
    if not rows.are_crossed(x, *across) or colour not in (None, *across):
        _draw_points(axes, rows, x, y, colour)
        return _remark(hidden, "points of all values are drawn on top of one another")
    names = across or ["scene"]
    lines = rows.frame.assign(scene=0).pivot_table(y, x, names)
    values = lines.columns.get_level_values(colour or names[0])
    # A value without a row is a gap.
    _draw_lines(axes, rows, lines.reindex(rows.grids.get(x)), values, y, colour)
    return _remark(hidden, "all values are lines of one colour; --colour tells them apart")


def _draw_lines(
    axes: Axes, rows: _Rows, lines: pandas.DataFrame, values: Any, y: str, colour: str | None
) -> None:
    """Draw the columns of a table over its index; ``values`` decide on their colours."""
    allowed = f"must be {_MOST_LINES:,} at most to be told apart: fix values (--where NAME=VALUE)"
    require(len(values) <= _MOST_LINES, "lines", len(values), allowed)
    style = "steps-mid" if is_whole(y) else "default"  # there is no p between 9 and 10
    drawn = axes.plot(lines.index, lines, marker=".", linewidth=1.2, drawstyle=style)
    for line, shade in zip(drawn, _colours(axes, rows, colour)(values), strict=True):
        line.set_color(shade)


def _draw_points(axes: Axes, rows: _Rows, x: str, y: str, colour: str | None) -> None:
    frame = rows.frame
    shades = _colours(axes, rows, colour)(frame[colour or y])
    area = min(16.0, max(1.0, 140**2 / len(frame)))
    axes.scatter(frame[x], frame[y], s=area, c=shades, rasterized=len(frame) > _MOST_VECTORS)


def _draw_chains(axes: Axes, sweep: Any, rows: _Rows, y: str, colour: str) -> list[str]:
    """Draw the peaks of all contacts along the chain, a line for each scene and backend."""
    scenes = rows.frame.set_index(["scene", "backend"], drop=False)
    peaks = sweep.peaks_to_frame().pivot_table(y, "contact", scenes.index.names)
    lines = peaks[scenes.index.intersection(peaks.columns, sort=False)]
    _draw_lines(axes, rows, lines, scenes.loc[lines.columns, colour], y, colour)
    return _remark(rows.hidden(colour), "lines of all values are drawn")


# Maps


def _draw_map(axes: Axes, rows: _Rows, x: str, y: str, colour: str | None) -> list[str]:
    """Draw a number over two parameters: cells of a grid, otherwise points."""
    from matplotlib.patches import Patch

    if colour is None or colour in TEXT:
        allowed = "varies, which makes a map: name the column of numbers to draw with --colour"
        raise SceneError(y, None, allowed)
    if rows.hidden(x, y) and rows.frame.duplicated([x, y]).any():
        advice = "fix them (--where NAME=VALUE), or take them as --x and --y"
        several = f"several values would share one place of the map: {advice}"
        raise HertzchainError("; ".join(_remark(rows.hidden(x, y), several)))
    if not rows.are_crossed(x, y):
        _draw_points(axes, rows, x, y, colour)
        return _remark(rows.hidden(x, y, colour), "the map has points of all values")
    cells = rows.frame.pivot_table(colour, y, x)
    cells = cells.reindex(rows.grids[y], columns=rows.grids[x])
    edges = (cell_edges(cells.columns.to_numpy(), rows.is_log(x)),
             cell_edges(cells.index.to_numpy(), rows.is_log(y)))  # fmt: skip
    bar = _colour_bar(axes, rows, colour)
    axes.grid(visible=False)
    axes.set_facecolor("0.85")
    axes.pcolormesh(*edges, cells, norm=bar.norm, cmap=bar.cmap, rasterized=True)
    if cells.isna().to_numpy().any():
        axes.legend(handles=[Patch(facecolor="0.85", edgecolor="0.4", label="no number")])
    return []


def cell_edges(values: FloatArray, log: bool) -> FloatArray:
    """Return edges, shape (values + 1,), halfway between increasing values or their logarithms."""
    at = np.log(values) if log else values
    between = (at[1:] + at[:-1]) / 2
    edges = np.array([2 * at[0] - between[0], *between, 2 * at[-1] - between[-1]])
    if not log and at[0] > 0:  # positive values have no cell edge below 0
        edges[0] = max(edges[0], 0.0)
    return np.exp(edges) if log else edges


# Words


def _said(name: str, value: Any) -> str:
    from hertzchain.report.picture import parts_of

    before, unit, after = parts_of(column_named(name).label)
    return f"{before} {value}" if name in TEXT else f"{before}{after} = {in_prefixed(value, unit)}"


def _remark(names: Sequence[str], how: str) -> list[str]:
    """Return a sentence on names that vary and are not shown; none where there are none."""
    *most, last = names or ("",)
    vary = f"{', '.join(most)} and {last} vary" if most else f"{last} varies"
    return [f"{vary}, too: {how}"] if names else []
