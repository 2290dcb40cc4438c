"""Plots of a comparison and of a trade-off, as files."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hertzchain.errors import OutputError
from hertzchain.files import write_with
from hertzchain.report import style
from hertzchain.report.document import Document
from hertzchain.report.facts import describe

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from hertzchain.report.picture import Picture
    from hertzchain.verdict.tradeoff import Row, Tradeoff


def plot_document(document: Document, path: Path | str) -> None:
    """Draw peak forces along the chain and their differences, in the format of the suffix."""
    write_with(path, figure_of(document).savefig)


def figure_of(document: Document) -> Picture:
    """Draw peak forces along the chain and their differences from native."""
    from matplotlib.ticker import MaxNLocator

    from hertzchain.report.picture import Picture

    figure = Picture(figsize=(8, 7), layout="constrained", dpi=150)
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    native, differences = document.native, document.differences
    contact = native.contact
    above.plot(
        contact, native.peak_force, "-", color=style.COLOURS["native"], label="native, reference"
    )
    if native.static_force is not None:
        above.plot(contact, native.static_force, color="0.5", linewidth=1.0, label="static force")
    for name, values in document.drawn.items():
        look: dict[str, Any] = {"color": style.COLOURS[name], "marker": style.MARKERS[name]}
        look |= {"markersize": 4.5, "linestyle": "none", "label": style.LABELS[name]}
        above.plot(contact, values, fillstyle="none", **look)
        off = differences[name]
        below.semilogy(contact, np.where(off > 0, off, np.nan), **look)
    if native.scene.wall is not None:
        above.plot(
            contact[-1:], native.peak_force[-1:], "s", color=style.COLOURS["native"],
            fillstyle="none", markersize=9, label="wall",
        )  # fmt: skip
    for name, label, value in document.lines:
        line = ":" if name == "native" else "--"
        below.axhline(value, color=style.COLOURS[name], linewidth=0.8, linestyle=line, label=label)
    p = native.transition_granules
    if p is not None:
        for axes in (above, below):
            axes.axvline(p, color="0.6", linewidth=0.8)
        above.annotate(
            f"p = {p}", (p, 0.02), (4, 0), ("data", "axes fraction"), "offset points", color="0.35"
        )
    above.set_title(describe(native.scene), fontsize=10)
    above.set(ylabel="peak force [N]", ylim=_limits(document))
    below.xaxis.set_major_locator(MaxNLocator(integer=True))
    below.set_xlabel("contact (i lies between granules i - 1 and i)")
    below.set_ylabel("relative difference from native")
    for axes in (above, below):
        axes.legend(fontsize=8)
        axes.grid(alpha=0.25)
    return figure


def _limits(document: Document) -> tuple[float, float]:
    """Ends of the axis of peaks [N], with all that are drawn."""
    low, high = style.peak_limits(document.native)
    drawn = [values[np.isfinite(values)] for values in document.drawn.values()]
    for values in drawn:
        if values.size:
            least, most = style.force_limits(float(np.min(values)), float(np.max(values)))
            low, high = min(low, least), max(high, most)
    return low, high


def plot_tradeoff(tradeoffs: Sequence[Tradeoff], path: Path | str) -> None:
    """Draw error against wall time, a line for each contender, and the frontier.

    Of several scenes medians are drawn, and the range of the errors.
    """
    from matplotlib.figure import Figure

    from hertzchain.verdict.contenders import NUMPY
    from hertzchain.verdict.tradeoff import frontier, typical

    points = typical(tradeoffs)
    known = max(one.truth_error for one in tradeoffs)
    figure = Figure(figsize=(10.5, 6.5), layout="constrained", dpi=100)
    axes = figure.subplots()
    axes.set(xscale="log", yscale="log")
    _draw_frontier(axes, frontier([p.row for p in points if p.row.self_contained], known), known)
    sides = itertools.cycle(((7, "bottom"), (-7, "top")))
    for name in dict.fromkeys(point.row.contender for point in points):
        own = [point for point in points if point.row.contender == name]
        engine = own[0].row.engine
        marker, line, filling = style.WAYS[engine]
        method = name.partition(",")[0]
        colour = style.CONTENDER_COLOURS.get(name, style.METHOD_COLOURS.get(method, "#000000"))
        time = [point.row.wall_time for point in own]
        error = [max(point.row.error, known) for point in own]
        if line == "none":  # a single point
            # Labels alternate above and below, because points may lie close together.
            offset, side = next(sides)
            place: dict[str, Any] = {"textcoords": "offset points", "ha": "center", "va": side}
            axes.annotate(method, (time[0], error[0]), (0, offset), **place)
        axes.plot(
            time,
            error,
            color=colour,
            marker=marker,
            linestyle=line,
            fillstyle=filling,
            markersize=9 if marker == "*" else 4.5,
            linewidth=1.2,
            label=name,
        )
        # Methods in NumPy have the same range of errors as compiled ones.
        if len(tradeoffs) > 1 and engine != NUMPY:
            lowest = [max(point.lowest, known) for point in own]
            highest = [max(point.highest, known) for point in own]
            axes.fill_between(time, lowest, highest, color=colour, alpha=0.12, linewidth=0)
    axes.axhspan(known / 10, known, color="0.93", zorder=0)
    axes.text(
        0.99, known / 3, "below the error of the reference", fontsize=8, color="0.35",
        ha="right", va="center", transform=axes.get_yaxis_transform(),
    )  # fmt: skip
    axes.set_ylim(known / 10, None)
    axes.set(xlabel="wall time [s]", ylabel="largest relative error of the peaks")
    title = f"{len(tradeoffs)} scenes, medians and the range of the errors"
    if len(tradeoffs) == 1:
        title = describe(tradeoffs[0].scene)
    axes.set_title(f"What accuracy costs: {title}", fontsize=10)
    axes.grid(alpha=0.25)
    figure.legend(loc="outside right center", fontsize=8, frameon=False)
    write_with(path, figure.savefig)


def _draw_frontier(axes: Axes, rows: Sequence[Row], known: float) -> None:
    """Draw the least error for each time, a staircase."""
    axes.plot(
        [row.wall_time for row in rows],
        [max(row.error, known) for row in rows],
        color="#F0E442",
        linewidth=9,
        drawstyle="steps-post",
        solid_capstyle="round",
        label="frontier: nothing is\ncheaper and as accurate",
        zorder=1,
    )


def check_plot_format(path: Path | str) -> None:
    """Raise an OutputError, before any work is done, for a suffix that cannot be drawn."""
    known = (".pdf", ".png", ".svg")
    if Path(path).suffix.lower() not in known:
        raise OutputError(f"{path}: cannot be drawn, the name must end in {', '.join(known)}")
