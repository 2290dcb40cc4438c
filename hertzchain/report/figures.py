"""Pictures of a run, a verdict and a trade-off."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import cycle
from typing import TYPE_CHECKING

from hertzchain.report import style
from hertzchain.report.document import Document, describe

if TYPE_CHECKING:
    from hertzchain.report.picture import Picture
    from hertzchain.verdict.tradeoff import Tradeoff


_WIDTH_INCH = 8.0  # width of a picture by default [inches]
_PANEL_PAIRS = (("peaks", "differences"), ("forces", "map"))  # panels with the same axis below them
_PANEL_INCH = 1.7  # height of a panel with room for its labels [inches]; chosen


def panels_of(document: Document) -> tuple[str, ...]:
    """Return the panels that a document has numbers for."""
    if document.overlays:
        return ("traces",)
    names = ["peaks", *(["differences"] if document.drawn else [])]
    if document.native.history is not None:
        names += ["forces", "map"] if document.command == "run" else ["forces"]
    return tuple(names)


def figure_of(document: Document, size: tuple[float, float] | None = None) -> Picture:
    """Draw a run or a verdict: along the chain and, where it was recorded, over time.

    A picture of a ``size`` [inches] has as many panels as have room.
    """
    from hertzchain.report import panels
    from hertzchain.report.picture import Picture, check_size

    shown = panels_of(document)
    if size is not None:
        check_size(size)
        shown = shown[: max(1, int(size[1] / _PANEL_INCH))]
    heights = [panels.PANELS[name][0] for name in shown]
    figure = Picture((_WIDTH_INCH, sum(heights) + 0.6) if size is None else size, _title(document))
    drawn = figure.subplots(len(shown), 1, squeeze=False, height_ratios=heights)[:, 0]
    axes = dict(zip(shown, drawn, strict=True))
    shared = [pair for pair in _PANEL_PAIRS if {*pair} <= axes.keys()]
    for above, below in shared:
        axes[above].sharex(axes[below])
    for name, panel in axes.items():
        panels.PANELS[name][1](panel, document)
    for above, _ in shared:
        axes[above].tick_params(labelbottom=False)
        axes[above].set_xlabel("")
    return figure


def _title(document: Document) -> str:
    native = document.native
    if document.command != "run":
        return describe(native.scene)
    by = f"{native.backend}, {native.method}, peaks within {native.error_estimate:.1e}"
    return f"{describe(native.scene)}\n{by}"


def plot_tradeoff(
    tradeoffs: Sequence[Tradeoff], size: tuple[float, float] | None = None
) -> Picture:
    """Draw error against wall time, a line for each contender, and the frontier.

    Of several scenes medians are drawn, and the range of the errors.
    """
    from matplotlib import colormaps

    from hertzchain.report.picture import SMALL, Picture, in_units, legend_look
    from hertzchain.verdict.tradeoff import frontier, typical

    points = typical(tradeoffs)
    floor = max(tradeoff.truth_error for tradeoff in tradeoffs)
    title = f"{len(tradeoffs)} scenes, medians and the range of the errors"
    if len(tradeoffs) == 1:
        title = describe(tradeoffs[0].scene)
    figure = Picture(size or (10.5, 6.5), f"What accuracy costs: {title}")
    axes = figure.subplots()
    axes.set(xscale="log", yscale="log")
    best = frontier([point.row for point in points], floor)
    axes.plot(
        [row.wall_time for row in best], [max(row.error, floor) for row in best],
        color="#F0E442", linewidth=9, drawstyle="steps-post", solid_capstyle="round", zorder=1,
        label="cheapest at its accuracy",
    )  # fmt: skip
    markers = {engine: cycle(look[0]) for engine, look in style.WAYS.items()}
    for k, name in enumerate(dict.fromkeys(point.row.contender for point in points)):
        curve = [point for point in points if point.row.contender == name]
        engine = curve[0].row.engine
        _, line, filling = style.WAYS[engine]
        colour = colormaps["tab20"](k % 20)
        time = [point.row.wall_time for point in curve]
        error = [max(point.row.error, floor) for point in curve]
        axes.plot(
            time,
            error,
            color=colour,
            marker=next(markers[engine]),
            linestyle=line,
            fillstyle=filling,
            markersize=4.5,
            linewidth=1.2,
            label=name.removesuffix(", compiled"),  # a full marker
        )
        if len(tradeoffs) > 1:
            lowest = [max(point.lowest, floor) for point in curve]
            highest = [max(point.highest, floor) for point in curve]
            axes.fill_between(time, lowest, highest, color=colour, alpha=0.12, linewidth=0)
    axes.axhspan(floor / 10, floor, color="0.93", zorder=0, label="error of the reference")
    axes.set_ylim(floor / 10, None)
    axes.set_ylabel("error of the peaks")
    in_units(axes.xaxis, "wall time [s]")
    axes.grid(alpha=0.25)
    if (width := figure.get_figwidth()) < SMALL:
        _, labels = axes.get_legend_handles_labels()
        figure.legend(loc="outside upper left", **legend_look(labels, width, is_small=True))
    else:
        figure.legend(loc="outside right center", fontsize="x-small", frameon=False)
    return figure
