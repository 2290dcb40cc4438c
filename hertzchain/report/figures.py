"""Plots of a comparison and of a trade-off, as files."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.errors import OutputError
from hertzchain.files import write_with
from hertzchain.report.style import COLOURS, LABELS, MARKERS
from hertzchain.scene.pulse import PulseTable
from hertzchain.scene.scene import Scene

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from hertzchain.verdict.comparison import Comparison
    from hertzchain.verdict.tradeoff import Row, Tradeoff


def plot_comparison(comparison: Comparison, path: Path | str) -> None:
    """Draw peak forces along the chain and their differences from the reference.

    Parameters
    ----------
    comparison
        What to draw.
    path
        Where to; the suffix says in which format (png, pdf, svg).

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    from matplotlib.figure import Figure
    from matplotlib.ticker import MaxNLocator

    figure = Figure(figsize=(8, 7), layout="constrained", dpi=150)
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    native, formulas = comparison.native, comparison.formulas
    codes = {name: result for name, result in comparison.results.items() if name != native.backend}
    contact = native.contact
    above.plot(contact, native.peak_force, "-", color=COLOURS["native"], label="native, reference")
    others: list[tuple[str, str, FloatArray]] = [
        (name, LABELS[name], result.peak_force) for name, result in codes.items()
    ]
    if formulas.applicable is None:
        others += [(name, LABELS[name], getattr(formulas, name)) for name in ("eq6", "eq9")]
    for name, label, values in others:
        style: dict[str, Any] = {"color": COLOURS[name], "marker": MARKERS[name]}
        style |= {"markersize": 4.5, "linestyle": "none"}
        above.plot(contact, values, fillstyle="none", label=label, **style)
        pressed = np.where(native.peak_force > 0, native.peak_force, np.nan)
        difference = np.abs(values / pressed - 1)
        below.semilogy(contact, np.where(difference > 0, difference, np.nan), label=label, **style)
    for name, result in codes.items():
        below.axhline(
            result.error_estimate,
            color=COLOURS[name],
            linewidth=0.8,
            linestyle="--",
            label=f"{LABELS[name]}, error estimate",
        )
    below.axhline(
        native.error_estimate,
        color=COLOURS["native"],
        linewidth=0.8,
        linestyle=":",
        label="reference, error estimate",
    )
    p = native.transition_granules
    if p is not None:
        for axes in (above, below):
            axes.axvline(p, color="0.6", linewidth=0.8)
        above.annotate(
            f"p = {p}",
            (p, 0.02),
            xycoords=("data", "axes fraction"),
            xytext=(4, 0),
            textcoords="offset points",
            color="0.35",
        )
    above.set_ylabel("peak force [N]")
    above.set_ylim(bottom=0)
    below.xaxis.set_major_locator(MaxNLocator(integer=True))
    above.set_title(describe(comparison.scene), fontsize=10)
    below.set_ylabel("relative difference from native")
    below.set_xlabel("contact (i lies between granules i - 1 and i)")
    for axes in (above, below):
        axes.legend(fontsize=8)
        axes.grid(alpha=0.25)
    write_with(path, figure.savefig)


def tradeoff_title(tradeoffs: Sequence[Tradeoff]) -> str:
    """The title of a trade-off: its scene, or the number of scenes."""
    if len(tradeoffs) == 1:
        return describe(tradeoffs[0].scene)
    return f"{len(tradeoffs)} scenes: median times, and the errors of the worst"


# Markers and lines say who computes, colours the method.
_ENGINE_STYLES = {
    "formulas": ("*", "none"),
    "map": ("P", "none"),
    "compiled": ("o", "-"),
    "NumPy": ("s", "--"),
    "SciPy": ("D", ":"),
    "LAMMPS": ("^", "-."),
}


_METHOD_COLOURS = {
    "velocity-verlet": "#E69F00",
    "rk4": "#56B4E9",
    "dprkn-6": "#009E73",
    "srkn-6b": "#0072B2",
    "srkn-11b": "#D55E00",
    "reference": "#CC79A7",
    "LAMMPS": "#E69F00",  # its scheme is velocity Verlet
    "DOP853": "#666666",
}


_ODD_COLOURS = {
    "srkn-6b, float32": "#8FB9DB",
    "rtol, without estimate": "#999999",
    "LAMMPS, extrapolated": "#7A4B00",
}
"""Of those that share engine and method with another."""


def plot_tradeoff(tradeoffs: Sequence[Tradeoff], path: Path | str) -> None:
    """Draw error against wall time, a line for each contender, and the frontier.

    Parameters
    ----------
    tradeoffs
        Of one scene; or of several, of which medians are drawn and the range of the errors.
    path
        Where to; the suffix says in which format (png, pdf, svg).

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    from matplotlib.figure import Figure

    from hertzchain.verdict.tradeoff import frontier, typical

    points = typical(tradeoffs)
    known = max(one.truth_error for one in tradeoffs)
    figure = Figure(figsize=(10.5, 6.5), layout="constrained", dpi=100)
    axes = figure.subplots()
    axes.set_xscale("log")
    axes.set_yscale("log")
    _draw_frontier(axes, frontier([p.row for p in points if p.row.self_contained], known), known)
    formula_sides = itertools.cycle((True, False))
    for name in dict.fromkeys(point.row.contender for point in points):
        own = [point for point in points if point.row.contender == name]
        marker, line = _ENGINE_STYLES[own[0].row.engine]
        method = name.partition(",")[0]
        colour = _ODD_COLOURS.get(name, _METHOD_COLOURS.get(method, "#000000"))
        time = [point.row.wall_time for point in own]
        error = [max(point.row.error, known) for point in own]
        if own[0].row.engine in ("formulas", "map"):
            there = (time[0], error[0])
            # Above and below by turns: they may lie close to one another.
            above = next(formula_sides)
            axes.annotate(
                method,
                there,
                (0, 7 if above else -7),
                textcoords="offset points",
                ha="center",
                va="bottom" if above else "top",
            )
        axes.plot(
            time,
            error,
            color=colour,
            marker=marker,
            linestyle=line,
            fillstyle="full" if own[0].row.engine in ("compiled", "formulas") else "none",
            markersize=9 if marker == "*" else 4.5,
            linewidth=1.2,
            label=name,
        )
        # Methods in NumPy have the range that they have compiled.
        if len(tradeoffs) > 1 and own[0].row.engine != "NumPy":
            lowest = [max(point.lowest, known) for point in own]
            highest = [max(point.highest, known) for point in own]
            axes.fill_between(time, lowest, highest, color=colour, alpha=0.12, linewidth=0)
    axes.axhspan(known / 10, known, color="0.93", zorder=0)
    axes.text(
        0.99, known / 3, "below what is known of the truth", fontsize=8, color="0.35",
        ha="right", va="center", transform=axes.get_yaxis_transform(),
    )  # fmt: skip
    axes.set_ylim(known / 10, None)
    axes.set_xlabel("wall time [s]")
    axes.set_ylabel("largest relative error of the peaks")
    title = (
        describe(tradeoffs[0].scene)
        if len(tradeoffs) == 1
        else f"{len(tradeoffs)} scenes, medians and the range of the errors"
    )
    axes.set_title(f"What accuracy costs: {title}", fontsize=10)
    axes.grid(alpha=0.25)
    figure.legend(loc="outside right center", fontsize=8, frameon=False)
    write_with(path, figure.savefig)


def _draw_frontier(axes: Axes, rows: Sequence[Row], known: float) -> None:
    """The least error that a time buys: a staircase."""
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
    """Raise an OutputError, before any work is done, for a suffix that cannot be drawn.

    Raises
    ------
    OutputError
        If the file name does not end in a known image format.
    """
    known = (".pdf", ".png", ".svg")
    if Path(path).suffix.lower() not in known:
        raise OutputError(f"{path}: cannot be drawn, the name must end in {', '.join(known)}")


def describe(scene: Scene) -> str:
    """One line that says what a scene is."""
    shock = scene.shock
    kind = (
        f"pulse table of {len(shock.time)} rows"
        if isinstance(shock, PulseTable)
        else f"{shock.profile} pulse, n = {shock.duration_ratio:g}"
    )
    return (
        f"{kind}, LM_ratio = {scene.momentum_ratio:.6g}, {shock.peak_force:.6g} N on"
        f" {scene.chain.granules} granules"
    )
