"""Pictures of a sweep: lines or points of a result, or a map over two parameters.

``Sweep`` draws itself by these functions, which therefore do not import it.
"""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.errors import HertzchainError, SceneError, require
from hertzchain.report.facts import MULTIPLES, in_prefixed
from hertzchain.sweeps.columns import TEXT, column_named, is_whole
from hertzchain.sweeps.looks import (
    colour_bar,
    is_log,
    legend,
    looks_of,
    set_scale,
)
from hertzchain.sweeps.selection import (
    Rows,
    full_name,
    names_of_columns,
    selected_rows,
    varied_names,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from hertzchain.report.picture import Picture


SIZE = (8.0, 5.0)  # width and height by default [inches]
_LETTERS, _LETTERS_OF_TITLE = 15, 11  # letters in an inch of width: remarks, title
_MOST_LINES = 1000  # most lines, chosen: more cannot be told apart, and each costs a millisecond
_MOST_MARKED = 60  # most points of a line with markers; more would overlap
_MOST_VECTORS = 5000  # number of points from which PDF and SVG contain a bitmap of them


@dataclass(frozen=True, eq=False)
class Drawn:
    """A picture of a sweep, with sentences on what it omits, which also stand below it."""

    figure: Picture
    remarks: tuple[str, ...]


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
    from hertzchain.report.picture import Picture

    if x == "contact":
        return _draw_chains(Picture(size), sweep, y, colour, where or {})
    known = names_of_columns(sweep.manifest), varied_names(sweep.manifest)
    x, y = full_name(x, *known), full_name(y, *known)
    colour = None if colour is None else full_name(colour, *known)
    for name in (x, y):
        allowed = "is text: --x and --y must be columns of numbers, text is for --colour"
        require(name not in TEXT, name, None, allowed)
    require(colour != "failure", "failure", None, "is a sentence and cannot be a colour")
    require(len({x, y, colour}) == 3, x if x in (y, colour) else y, None, "given twice")
    rows = selected_rows(sweep, (x, y), colour, where or {})
    figure = Picture(size)
    axes = figure.subplots()
    if y in rows.left:
        drawn = _draw_map(axes, rows, x, y, colour)
    else:
        drawn = _draw_lines(
            axes, rows, x, y, colour or ("backend" if "backend" in rows.left else None)
        )
    set_scale(rows, x, axes.set_xscale, axes.xaxis)
    set_scale(rows, y, axes.set_yscale, axes.yaxis)
    return _finished(figure, rows, drawn, {x, y, colour})


def _finished(figure: Picture, rows: Rows, said: Sequence[str], shown: set[str | None]) -> Drawn:
    """Add the title of a picture, and what it omits below it."""
    from hertzchain.report.picture import SMALL, fit_letters

    axes, size = figure.axes[0], figure.get_size_inches()
    fit_letters(figure)
    remarks = (*rows.remarks, *said)
    if remarks:
        letters = int(_LETTERS * size[0])
        figure.supxlabel(textwrap.fill("; ".join(remarks), letters), fontsize=7, color="0.35")
    if size[0] >= SMALL:  # a paper has a caption
        axes.set_title(textwrap.fill(_title(rows, shown), int(_LETTERS_OF_TITLE * size[0])))
    return Drawn(figure, remarks)


# Lines and points


def _draw_lines(axes: Axes, rows: Rows, x: str, y: str, colour: str | None) -> list[str]:
    """Draw lines where x belongs to a parameter on a grid, otherwise points."""
    along = rows.behind(x)
    axes.grid(alpha=0.3)
    lines = _lines(rows, along) if along in rows.place and {*rows.left} <= {*rows.place} else None
    if lines and (colour is None or all(len({*rows.column[colour][line]}) == 1 for line in lines)):
        _draw_each(axes, rows, lines, along, (x, y, colour))
        how = "all values are lines of one colour; --colour tells them apart"
    else:
        how = "points of all values are drawn on top of one another"
        if colour is None:
            _draw_points(axes, rows, x, y, {})
        elif looks := looks_of(rows.column[colour], colour):
            for value, look in looks.items():
                _draw_points(axes, rows, x, y, look, rows.column[colour] == value)
            legend(axes, rows.column[colour], colour)
        else:
            _draw_coloured(axes, rows, x, y, colour)
    hidden = _listed(rows.hidden(x, colour))
    return [f"{hidden}, too: {how}"] if hidden else []


def _lines(rows: Rows, along: str | None) -> list[NDArray[np.intp]]:
    """Return the rows of each line: those that differ in one parameter alone."""
    import pandas

    across = [name for name in rows.left if name != along]
    one: list[Any] = [np.arange(rows.place["backend"].size)]
    lines: list[Any] = (
        list(pandas.DataFrame(rows.place).groupby(across).indices.values()) if across else one
    )
    allowed = f"must be {_MOST_LINES:,} at most to be told apart: fix {' or '.join(across)} to one"
    require(len(lines) <= _MOST_LINES, "lines", len(lines), f"{allowed} value (--where NAME=VALUE)")
    return lines


def _draw_each(
    axes: Axes,
    rows: Rows,
    lines: Sequence[NDArray[np.intp]],
    along: str | None,
    names: tuple[str, str, str | None],
) -> None:
    """Draw lines; a missing point is a gap."""
    x, y, colour = names
    assert along is not None
    axis = rows.axes[along]
    count = rows.count(along)
    order = np.argsort(axis.at(np.arange(count)), kind="stable")
    plain = {"color": "#0072B2", "marker": "o", "markersize": 4}
    looks = {} if colour is None else looks_of(rows.column[colour], colour)
    bar: Any = None if looks or colour is None else colour_bar(axes, rows, colour)
    labelled = set()
    for line in lines:
        at, to = np.full((2, count), np.nan)
        at[rows.place[along][line]] = rows.column[x][line]
        to[rows.place[along][line]] = rows.column[y][line]
        look: dict[str, Any] = dict(plain)
        if colour is not None:
            value = rows.column[colour][line[0]]
            look = dict(looks[value]) if looks else plain | {"color": bar.to_rgba(value)}
            if value in labelled:
                look.pop("label", None)
            labelled.add(value)
        if count > _MOST_MARKED or bar is not None:  # a point between two gaps has no line
            look |= {"marker": "." if np.isnan(to).any() else "", "markersize": 2}
        if is_whole(y):  # there is no p between 9 and 10
            look["drawstyle"] = "steps-mid"
        axes.plot(at[order], to[order], **({"linewidth": 1.2} | look))
    if looks and colour is not None:
        legend(axes, rows.column[colour], colour)


def _draw_points(
    axes: Axes, rows: Rows, x: str, y: str, look: Mapping[str, Any], some: Any = slice(None)
) -> None:
    at, to = rows.column[x][some], rows.column[y][some]
    style: dict[str, Any] = {"marker": "o", "color": "#0072B2", "markersize": 4} | dict(look)
    style |= {"linestyle": "none", "rasterized": at.size > _MOST_VECTORS}
    if at.size > _MOST_MARKED:
        style["markersize"] *= 0.6 if at.size < 1000 else 0.3
    axes.plot(at, to, **style)


def _draw_coloured(axes: Axes, rows: Rows, x: str, y: str, colour: str) -> None:
    """Draw points, coloured by a number."""
    bar = colour_bar(axes, rows, colour)
    values = rows.column[colour]
    axes.scatter(
        rows.column[x],
        rows.column[y],
        s=min(20.0, max(2.0, 20_000 / values.size)),
        c=values,
        norm=bar.norm,
        cmap=bar.cmap,
        rasterized=values.size > _MOST_VECTORS,
    )


_ALONG = {"peak_force_N": "peak force [N]", "peak_time_s": "time of the peak [s]"}
"""Columns of the table of all contacts, and their labels."""


def _draw_chains(
    figure: Picture, sweep: Any, y: str, colour: str | None, where: Mapping[str, Any]
) -> Drawn:
    """Draw the peaks of all contacts along the chain, a line for each scene and backend."""
    from hertzchain.report.picture import at_whole_numbers, in_units

    require(y in _ALONG, y, None, f"must be one of {', '.join(_ALONG)} where --x is contact")
    known = names_of_columns(sweep.manifest), varied_names(sweep.manifest)
    several = [axis["name"] for axis in sweep.manifest["vary"]]
    colour = full_name(colour, *known) if colour else several[0]
    rows = selected_rows(sweep, ("scene",), colour, where)
    peaks = sweep.peaks_to_frame().groupby(["scene", "backend"], observed=True)
    values = rows.column[colour]
    require(values.size <= _MOST_LINES, "--where", None, "must leave 1,000 lines at most")
    axes = figure.subplots()
    looks = looks_of(values, colour)
    bar: Any = None if looks else colour_bar(axes, rows, colour)
    for row, value in enumerate(values):
        chain = peaks.get_group((rows.column["scene"][row], rows.column["backend"][row]))
        look = dict(looks[value]) if looks else {"color": bar.to_rgba(value)}
        look |= {"marker": ""} if len(chain) > _MOST_MARKED else {}
        if value in values[:row]:
            look.pop("label", None)
        axes.plot(chain["contact"], chain[y], **({"linewidth": 1.2} | look))
    axes.grid(alpha=0.3)
    axes.xaxis.set_major_locator(at_whole_numbers())
    if looks:
        legend(axes, values, colour)
    in_units(axes.xaxis, "contact")
    in_units(axes.yaxis, _ALONG[y])
    hidden = _listed(rows.hidden(colour))
    said = [f"{hidden}, too: lines of all values are drawn"] if hidden else []
    return _finished(figure, rows, said, {colour})


# Maps


def _draw_map(axes: Axes, rows: Rows, x: str, y: str, colour: str | None) -> list[str]:
    """Draw a number over two parameters: cells of a grid, otherwise points."""
    if colour is None or colour in TEXT:
        raise SceneError(
            y, None, "varies, which makes a map: name the column of numbers to draw with --colour"
        )
    hidden = rows.hidden(x, y)
    on_grid = x in rows.left and {x, y} <= rows.place.keys()
    fixed = [f"--where {name}=VALUE" for name in hidden if name in rows.place]
    if hidden and (on_grid or fixed):
        advice = " and ".join(fixed) or f"take {hidden[0]} as --x or --y"
        raise HertzchainError(
            f"{_listed(hidden)}, too, so that several values fall into one place of the map:"
            f" {advice}"
        )
    if on_grid:
        _draw_cells(axes, rows, x, y, colour)
        return []
    _draw_coloured(axes, rows, x, y, colour)
    axes.grid(alpha=0.3)
    left_out = _listed(rows.hidden(x, y, colour))
    return [f"{left_out}, too: the map has points of all values"] if left_out else []


def _draw_cells(axes: Axes, rows: Rows, x: str, y: str, colour: str) -> None:
    edges, ranks = [], []
    for name in (x, y):
        values = rows.axes[name].at(np.arange(rows.count(name))).astype(np.float64)
        order = np.argsort(values)
        edges.append(cell_edges(values[order], is_log(rows, name)))
        ranks.append(np.argsort(order)[rows.place[name]])
    cells = np.full((edges[1].size - 1, edges[0].size - 1), np.nan)
    cells[ranks[1], ranks[0]] = rows.column[colour]
    bar = colour_bar(axes, rows, colour)
    axes.set_facecolor("0.85")
    axes.pcolormesh(
        *edges, np.ma.masked_invalid(cells), norm=bar.norm, cmap=bar.cmap, rasterized=True
    )
    if np.isnan(cells).any():
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


# Colours, scales and labels

_SHOCKS = {"table": "pulse table", "piston": "piston", "sine": "sine"}  # else "... pulse"


def _title(rows: Rows, shown: set[str | None]) -> str:
    """Return a title with the parameters that are the same in all of the picture."""
    said = [
        _SHOCKS.get(value) or _in_title(column_named(name).title, value)
        for name, value in rows.fixed.items()
        if name not in shown and value == value  # noqa: PLR0124
    ]
    return ", ".join(said)


def _in_title(title: str, value: Any) -> str:
    """Return the words of a title for a value, in a multiple of its unit that reads."""
    before, number, after = title.partition("{:.4g} ")
    unit, _, end = after.partition(" ")
    if not number or unit not in MULTIPLES:
        return title.format(value)
    return f"{before}{in_prefixed(float(value), unit)} {end}".rstrip()


def _listed(names: Sequence[str]) -> str:
    """Return "A and B vary" for these names; empty where there are none."""
    *most, last = names or ("",)
    return f"{', '.join(most)} and {last} vary" if most else f"{last} varies" if last else ""
