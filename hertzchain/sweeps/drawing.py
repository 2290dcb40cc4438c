"""Pictures of a sweep: lines or points of a result, a map, or peaks along the chain.

``Sweep`` draws itself by these functions, which therefore do not import it.
"""

from __future__ import annotations

import math
import textwrap
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.errors import HertzchainError, SceneError, require
from hertzchain.report.style import COLOURS, distinct
from hertzchain.scene.file import key_named
from hertzchain.scene.keys import to_si
from hertzchain.sweeps.columns import TEXT, column_named, full_name, is_whole

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

    from hertzchain.report.picture import Picture

SIZE = (8.0, 5.0)  # width and height by default [inches]
_LETTERS = 15  # letters of a remark in an inch of width
_MOST_MARKS = 1000
"""Most lines, and most points that are no bitmap in PDF and SVG (chosen): more cannot be told
apart, and each line costs a millisecond."""
_ALONG = ("peak_force_N", "peak_time_s")  # columns that can be drawn along the chain


class Drawn(NamedTuple):
    """A picture of a sweep, with sentences on what it omits, which also stand below it."""

    figure: Picture
    remarks: list[str]


@dataclass(frozen=True)
class _Chart:
    """The columns to draw, the rows, and the parameters that vary in them."""

    x: str
    y: str
    colour: str | None
    frame: pandas.DataFrame
    varying: list[str]
    crossed: set[str]
    logs: list[str]

    @property
    def is_map(self) -> bool:
        """Whether a number is drawn over two parameters."""
        return self.y in self.varying

    @property
    def others(self) -> list[str]:
        """Names that vary and are on no axis: those that make a line each."""
        return [name for name in self.varying if name not in (self.x, self.y)]

    def is_log(self, name: str) -> bool:
        """Return whether a column was swept with :log, or its values span two decades."""
        low, high = self.frame[name].min(), self.frame[name].max()
        return name in self.logs or bool(low > 0 and high / low > 100 and high < math.inf)


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

    columns = sweep.manifest["columns"]
    varied = [axis["name"] for axis in sweep.manifest["vary"]]
    fixed = {full_name(name, columns, varied): value for name, value in (where or {}).items()}
    require(len(fixed) == len(where or {}), next(iter(fixed), ""), None, "is fixed twice")
    if is_along := x == "contact":
        require(y in _ALONG, y, None, f"must be one of {', '.join(_ALONG)} where --x is contact")
        colour = colour or varied[0]
    else:
        x, y = (full_name(name, columns, varied) for name in (x, y))
    colour = None if colour is None else full_name(colour, columns, varied)
    for name in (x, y):
        allowed = "is text: --x and --y must be columns of numbers, text is for --colour"
        require(name not in TEXT, name, None, allowed)
    require(colour != "failure", "failure", None, "is a sentence and cannot be a colour")
    require(len({x, y, colour}) == 3, x if x in (y, colour) else y, None, "given twice")
    peaks = sweep.peaks_to_frame() if is_along else None
    chart, remarks = _selected(sweep, (x, y, colour), fixed, peaks)
    if hidden := [name for name in chart.others if name != chart.colour]:
        said = f"{' and '.join(hidden)} {'vary' if hidden[1:] else 'varies'}, too"
        if chart.is_map and chart.frame.duplicated([x, y]).any():
            advice = "fix values (--where NAME=VALUE), or take them as --x and --y"
            raise HertzchainError(f"{said}, and would share places of the map: {advice}")
        remarks.append(f"{said}, and no colour tells the values apart")
    figure = Picture(size)
    axes = figure.subplots()
    axes.grid(alpha=0.3)
    _fill(axes, chart, is_along)
    for name, which, axis in ((x, "x", axes.xaxis), (y, "y", axes.yaxis)):
        if not is_along and chart.is_log(name):
            axes.set(**{f"{which}scale": "log"})
        elif is_whole(name):
            axis.set_major_locator(at_whole_numbers())
        in_units(axis, column_named(name).label)
    text = textwrap.fill("; ".join(remarks), int(_LETTERS * size[0]))
    figure.supxlabel(text, fontsize=7, color="0.35")
    if fixed and size[0] >= SMALL:  # a paper has a caption
        title = ", ".join(f"{name} = {value}" for name, value in fixed.items())
        axes.set_title(title, fontsize=10, wrap=True)
    return Drawn(figure, remarks)


def _selected(
    sweep: Any, names: tuple[str, str, str | None], where: Mapping[str, Any], peaks: Any
) -> tuple[_Chart, list[str]]:
    """Return the rows of a sweep that have the wanted values, and sentences on missing ones."""
    varied = sweep.manifest["vary"]
    counts = {axis["name"]: len(axis.get("values", ())) or axis.get("count") for axis in varied}
    crossed = {name for name, count in counts.items() if count is not None}
    wanted = [name for name in names if name and (peaks is None or name not in peaks)]
    frame = sweep.to_frame([*dict.fromkeys(("scene", "backend", "failure", *wanted, *crossed))])
    remarks = []
    if len(frame) < sweep.rows:
        there = f"{len(frame):,} of {sweep.rows:,} rows are there"
        remarks.append(f"the sweep is not complete, {there}")
    for name, value in where.items():
        there = ", ".join(name for name in counts if name in crossed)
        allowed = f"has no list or grid of values in this sweep, as have: {there}"
        require(name in {"backend", *crossed}, name, None, allowed)
        frame = frame[frame[name] == _meant(name, value, frame[name].unique())]
    if peaks is not None:
        frame = frame.merge(peaks, how="left", on=["scene", "backend"])
    numbers = [name for name in names if name and name not in TEXT]
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
    several = [name for name, count in counts.items() if count != 1]
    several += ["backend"] if len(sweep.manifest["backends"]) > 1 else []
    left = [name for name in several if name not in where]
    frame = frame[~lost].astype(dict.fromkeys(numbers, "float64"))
    x, y, colour = names
    colour = colour or ("backend" if "backend" in left and y not in left else None)
    logs = [axis["name"] for axis in varied if axis.get("log")]
    return _Chart(x, y, colour, frame, left, crossed | {"backend"}, logs), remarks


def _meant(name: str, wanted: Any, values: NDArray[Any]) -> Any:
    """Return the value of a sweep that matches a given one."""
    if name in TEXT:
        require(wanted in values, name, wanted, f"is not in the sweep: {', '.join(values)}")
        return wanted
    key = key_named(name)
    off = np.abs(values - float(to_si(name, wanted, "" if key is None else key.unit)))
    nearest = values[np.argsort(off, kind="stable")[:2]]
    if not np.min(off) <= 1e-3 * abs(nearest[0]):  # three digits
        said = " and ".join(f"{value:.5g}" for value in np.sort(nearest))
        raise SceneError(name, wanted, f"is not in the sweep; the nearest there: {said}")
    return nearest[0]


def _fill(axes: Axes, chart: _Chart, is_along: bool) -> None:
    """Draw lines over a grid if each has one colour, cells of a map, otherwise points."""
    x, y, colour, frame = chart.x, chart.y, chart.colour, chart.frame
    if chart.is_map and (colour is None or colour in TEXT):
        allowed = "varies, which makes a map: name the column of numbers to draw with --colour"
        raise SceneError(y, None, allowed)
    is_grid = chart.crossed.issuperset({x, *chart.varying}) and x in chart.varying
    if chart.is_map and is_grid:
        cells, bar = frame.pivot_table(colour, y, x), _colour_bar(axes, chart, str(colour))
        edges = (cell_edges(cells.columns.to_numpy(), chart.is_log(x)),
                 cell_edges(cells.index.to_numpy(), chart.is_log(y)))  # fmt: skip
        axes.pcolormesh(*edges, cells, norm=bar.norm, cmap=bar.cmap, rasterized=True)
        return
    shades = _shades(axes, chart)
    if is_along or (is_grid and colour in (None, *chart.others)):
        across = ["scene", "backend"] if is_along else [*chart.others, "backend"]
        lines = [line.index for _, line in frame.groupby(across, sort=False)]
        allowed = f"must be {_MOST_MARKS:,} at most to be told apart: fix values (--where)"
        require(len(lines) <= _MOST_MARKS, "lines", len(lines), allowed)
        style = "steps-mid" if is_whole(y) else "default"  # there is no p between 9 and 10
        for index in lines:
            line = frame.loc[index].sort_values(x)
            axes.plot(line[x], line[y], color=shades[index[0]], marker=".", lw=1.2, drawstyle=style)
        return
    many = len(frame) > _MOST_MARKS
    axes.scatter(frame[x], frame[y], s=1 if many else 9, c=[*shades], rasterized=many)


def _shades(axes: Axes, chart: _Chart) -> pandas.Series[Any]:
    """Return the colour of each row; draw a legend of a column of text, or a colour bar."""
    import pandas
    from matplotlib.lines import Line2D

    from hertzchain.report.picture import SMALL, legend_look

    frame, name = chart.frame, chart.colour
    if name is None:
        return pandas.Series(distinct(0), frame.index)
    if name not in TEXT:
        return pandas.Series([*_colour_bar(axes, chart, name).to_rgba(frame[name])], frame.index)
    figure: Any = axes.figure
    texts, width = list(frame[name].unique()), figure.get_figwidth()
    colours = {text: COLOURS.get(text, distinct(k)) for k, text in enumerate(texts)}
    handles = [Line2D([], [], color=colour, marker="o") for colour in colours.values()]
    look = legend_look(texts, width, width < SMALL)
    title = column_named(name).label
    figure.legend(handles, texts, loc="outside upper center", title=title, **look)
    return frame[name].map(colours)


def _colour_bar(axes: Axes, chart: _Chart, name: str) -> Any:
    """Draw a colour bar for a column of numbers; return the colours of its values."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import LogNorm, Normalize

    from hertzchain.report.picture import at_whole_numbers, in_units

    low, high, is_log = chart.frame[name].min(), chart.frame[name].max(), chart.is_log(name)
    colours = ScalarMappable((LogNorm if is_log else Normalize)(low, high), "viridis")
    ticks = at_whole_numbers() if is_whole(name) and not is_log else None
    bar: Any = axes.figure.colorbar(colours, ax=axes, ticks=ticks)
    in_units(bar.ax.yaxis, column_named(name).label)
    return colours


def cell_edges(values: NDArray[Any], log: bool) -> FloatArray:
    """Return edges, shape (values + 1,), halfway between increasing values or their logarithms."""
    at = np.log(values) if log else values
    between = (at[1:] + at[:-1]) / 2
    edges = np.array([2 * at[0] - between[0], *between, 2 * at[-1] - between[-1]])
    if not log and at[0] > 0:  # positive values have no cell edge below 0
        edges[0] = max(edges[0], 0.0)
    return np.exp(edges) if log else edges
