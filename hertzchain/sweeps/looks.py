"""Colours, scales and names in pictures of a sweep."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.report.facts import prefixed
from hertzchain.report.style import COLOURS, distinct
from hertzchain.sweeps.axes import Span
from hertzchain.sweeps.columns import TEXT, column_named, is_whole
from hertzchain.sweeps.selection import Rows

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Normalize


_MARKERS, _DASHES = "os^Dv<>P", ("-", "--", "-.", ":")

_FEW = len(_MARKERS)  # most values in a legend; more get a colour bar
_DECADES = 100.0  # ratio of the largest value to the smallest from which an axis is logarithmic
_DIGITS = 3  # least digits of a value in a legend


def looks_of(values: NDArray[Any], name: str) -> dict[Any, dict[str, Any]]:
    """Return colour and marker of each value or name; empty where there are too many."""
    from matplotlib import colormaps

    found = list(dict.fromkeys(values)) if name in TEXT else np.unique(values)
    if len(found) > _FEW:
        return {}
    shades = colormaps["viridis"](np.linspace(0, 0.88, len(found)))
    labels = found if name in TEXT else _labels(found, name)
    looks = {}
    for k, value in enumerate(found):
        looks[value] = {
            "color": COLOURS.get(value, distinct(k)) if name in TEXT else shades[k],
            "marker": _MARKERS[k],
            "label": labels[k],
            "linestyle": _DASHES[k % len(_DASHES)],
            "fillstyle": "full" if k == 0 else "none",
            "markersize": 4 + k * min(2.5, 8 / len(found)),
        }
    return looks


def legend(axes: Axes, values: NDArray[Any], colour: str) -> None:
    """Draw a legend of the colours beside the axes, or above them in a small picture."""
    from hertzchain.report.picture import SMALL, legend_look, parts_of

    figure: Any = axes.figure
    width, labels = figure.get_figwidth(), axes.get_legend_handles_labels()[1]
    before, unit, after = parts_of(column_named(colour).label)
    name = "" if colour in TEXT else prefixed(float(np.max(values)), unit)[0]
    title = f"{before}{f' [{name}]' if name else ''}{after}"
    if width >= SMALL:
        figure.legend(loc="outside right upper", title=title, fontsize="small")
    else:
        figure.legend(loc="outside upper center", title=title, **legend_look(labels, width))


def _labels(values: Any, name: str) -> list[str]:
    """Return values of a column in its unit, with the digits that tell them from one another."""
    from hertzchain.report.picture import parts_of

    scale = prefixed(float(values[-1]), parts_of(column_named(name).label)[1])[1]
    digits = range(_DIGITS, 18)
    each = ([f"{value / scale:.{count}g}" for value in values] for count in digits)
    return next(labels for labels in each if len(set(labels)) == len(labels))


def colour_bar(axes: Axes, rows: Rows, name: str) -> Any:
    """Draw a colour bar for a column of numbers; return the colours of its values."""
    from matplotlib.cm import ScalarMappable

    from hertzchain.report.picture import at_whole_numbers, in_units

    values = rows.column[name]
    scale = ScalarMappable(_norm(values, is_whole(name), is_log(rows, name)), "viridis")
    bar = axes.figure.colorbar(scale, ax=axes)
    if is_whole(name) and not is_log(rows, name):
        bar.locator = at_whole_numbers()
        bar.minorticks_off()
        bar.update_ticks()
    in_units(bar.ax.yaxis, column_named(name).label)
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
    """Make an axis of the picture logarithmic, or put its ticks at whole numbers; label it."""
    from hertzchain.report.picture import at_whole_numbers, in_units

    if is_log(rows, name):
        to("log")
    elif is_whole(name):
        axis.set_major_locator(at_whole_numbers())
    in_units(axis, column_named(name).label)
