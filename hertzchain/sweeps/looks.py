"""Colours, scales and names in pictures of a sweep."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.report.style import COLOURS
from hertzchain.sweeps.axes import Span
from hertzchain.sweeps.columns import TEXT, column_named, is_whole
from hertzchain.sweeps.selection import Rows

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Normalize
    from matplotlib.figure import Figure


SMALL = 6.0
"""Width below which a picture has small letters, and its legend above the axes [inches]; chosen."""

_OF_AN_ENTRY, _LETTERS = 0.5, 14.0
"""Of an entry of a small legend: line and space [inches]; letters in an inch."""

_NAMED: dict[str, dict[str, str]] = {
    "cosine": {"color": "#0072B2", "marker": "o"},
    "triangular": {"color": "#D55E00", "marker": "s"},
    "cosine-triangular": {"color": "#009E73", "marker": "^"},
    "table": {"color": "#CC79A7", "marker": "D"},
    "native": {"color": COLOURS["native"], "marker": "o"},
    "lammps": {"color": COLOURS["lammps"], "marker": "s"},
    "formulas": {"color": COLOURS["eq6"], "marker": "^"},
    "rigid": {"color": "#0072B2", "marker": "o"},
    "same": {"color": "#D55E00", "marker": "s"},
    "elastic": {"color": "#009E73", "marker": "^"},
}
"""Colours of Okabe and Ito, also distinct for colour-blind readers."""

_MARKERS, _DASHES = "os^Dv<>P", ("-", "--", "-.", ":")

_FEW = len(_MARKERS)  # most values in a legend; more get a colour bar
_DECADES = 100.0  # ratio of the largest value to the smallest from which an axis is logarithmic
_PLAIN = (1e-3, 1e4)  # between these values a logarithmic axis has plain numbers, not powers of ten


def looks_of(values: NDArray[Any], name: str) -> dict[Any, dict[str, Any]]:
    """Return colour and marker of each value or name; empty where there are too many."""
    from matplotlib import colormaps

    found = sorted(set(values), key=list(_NAMED).index) if name in TEXT else np.unique(values)
    if len(found) > _FEW:
        return {}
    shades = colormaps["viridis"](np.linspace(0, 0.88, len(found)))
    looks = {}
    for k, value in enumerate(found):
        look: dict[str, Any] = {"color": shades[k], "marker": _MARKERS[k]}
        label = value if name in TEXT else f"{value:.4g}"
        if name in TEXT:
            look = dict(_NAMED[value])
        looks[value] = look | {
            "label": label,
            "linestyle": _DASHES[k % len(_DASHES)],
            "fillstyle": "full" if k == 0 else "none",
            "markersize": 4 + k * min(2.5, 8 / len(found)),
        }
    return looks


def legend(axes: Axes, colour: str) -> None:
    """Draw a legend of the colours beside the axes, or above them in a small picture."""
    title = column_named(colour).label
    figure: Any = axes.figure
    if figure.get_figwidth() >= SMALL:
        figure.legend(loc="outside right upper", title=title, fontsize="small")
        return
    labels = axes.get_legend_handles_labels()[1]
    entry = _OF_AN_ENTRY + max(map(len, labels)) / _LETTERS  # its width [inches]
    figure.legend(
        loc="outside upper center",
        title=title,
        ncols=max(1, min(len(labels), int(figure.get_figwidth() / entry))),
        fontsize="x-small",
        title_fontsize="x-small",
        handlelength=2.2,
        columnspacing=1.0,
        labelspacing=0.3,
        frameon=False,
    )


def with_small_letters(figure: Figure) -> None:
    """Make the letters at all axes of a picture smaller."""
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            axis.label.set_fontsize("small")
        axes.tick_params(which="both", labelsize="small")


def colour_bar(axes: Axes, rows: Rows, name: str) -> Any:
    """Draw a colour bar for a column of numbers; return the colours of its values."""
    from matplotlib.cm import ScalarMappable

    values = rows.column[name]
    scale = ScalarMappable(_norm(values, is_whole(name), is_log(rows, name)), "viridis")
    bar = axes.figure.colorbar(scale, ax=axes, label=column_named(name).label)
    if is_whole(name) and not is_log(rows, name):
        bar.locator = _at_whole_numbers()
        bar.minorticks_off()
        bar.update_ticks()
    return scale


def _norm(values: FloatArray, whole: bool, log: bool) -> Normalize:
    from matplotlib.colors import BoundaryNorm, LogNorm, Normalize

    low, high = float(np.min(values)), float(np.max(values))
    if log:
        return LogNorm(low, high)
    colours = 256  # of the colour map
    if whole and high - low < colours:
        return BoundaryNorm(np.arange(low, high + 2) - 0.5, colours)
    return Normalize(low, high)


def is_log(rows: Rows, name: str) -> bool:
    """Return whether logarithms of a column are equally spaced, or its values span decades."""
    axis = rows.axes.get(name)
    if isinstance(axis, Span) and axis.log:
        return True
    values = rows.column[name]
    low, high = float(np.min(values)), float(np.max(values))
    return low > 0 and high / low > _DECADES and math.isfinite(high)


def set_scale(rows: Rows, name: str, to: Callable[[str], None], axis: Any) -> None:
    """Make an axis of the picture logarithmic, or put its ticks at whole numbers."""
    if is_log(rows, name):
        to("log")
        low, high = float(np.min(rows.column[name])), float(np.max(rows.column[name]))
        if low >= _PLAIN[0] and high <= _PLAIN[1]:
            digits = "23456789" if high < 5 * low else "235" if high < 50 * low else ""
            axis.set_major_formatter(lambda value, _: f"{value:g}")
            axis.set_minor_formatter(
                lambda value, _: f"{value:g}" if f"{value:.0e}"[0] in digits else ""
            )
    elif is_whole(name):
        axis.set_major_locator(_at_whole_numbers())


def _at_whole_numbers() -> Any:
    from matplotlib.ticker import MaxNLocator

    return MaxNLocator(integer=True, min_n_ticks=1, steps=[1, 2, 5, 10])
