"""Colours in pictures of a sweep, with a legend or a colour bar."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from hertzchain.report.facts import prefixed
from hertzchain.report.style import COLOURS, distinct
from hertzchain.sweeps.columns import TEXT, column_named, is_whole

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes
    from matplotlib.colors import Normalize

_DIGITS = 3  # least digits of a value in a legend
_MARKERS, _DASHES = "os^Dv<>P", ("-", "--", "-.", ":")
_FEW = len(_MARKERS)  # most values in a legend; more get a colour bar


def looks_of(values: pandas.Series[Any], name: str) -> dict[Any, dict[str, Any]]:
    """Return colour and marker of each value or name; empty where there are too many."""
    from matplotlib import colormaps

    found = list(values.unique()) if name in TEXT else np.unique(values)
    if len(found) > _FEW:
        return {}
    shades = colormaps["viridis"](np.linspace(0, 0.88, len(found)))
    labels = found if name in TEXT else _labels(found, name)
    return {
        value: {
            "color": COLOURS.get(value, distinct(k)) if name in TEXT else shades[k],
            "marker": _MARKERS[k],
            "label": labels[k],
            "linestyle": _DASHES[k % len(_DASHES)],
            "fillstyle": "full" if k == 0 else "none",
            "markersize": 4 + k * min(2.5, 8 / len(found)),
        }
        for k, value in enumerate(found)
    }


def _labels(values: Any, name: str) -> list[str]:
    """Return values of a column in its unit, with enough digits to distinguish them."""
    from hertzchain.report.picture import parts_of

    scale = prefixed(float(values[-1]), parts_of(column_named(name).label)[1])[1]
    each = ([f"{v / scale:.{count}g}" for v in values] for count in range(_DIGITS, 18))
    return next(labels for labels in each if len(set(labels)) == len(labels))


def legend(axes: Axes, values: pandas.Series[Any], colour: str) -> None:
    """Draw a legend of the colours above the axes."""
    from hertzchain.report.picture import SMALL, legend_look, parts_of

    figure: Any = axes.figure
    width, labels = figure.get_figwidth(), axes.get_legend_handles_labels()[1]
    before, unit, after = parts_of(column_named(colour).label)
    name = "" if colour in TEXT else prefixed(float(values.max()), unit)[0]
    title = f"{before}{f' [{name}]' if name else ''}{after}"
    look = legend_look(labels, width, width < SMALL)
    figure.legend(loc="outside upper center", title=title, **look)


def colour_bar(axes: Axes, values: pandas.Series[Any], name: str, log: bool) -> Any:
    """Draw a colour bar for a column of numbers; return the colours of its values."""
    from matplotlib.cm import ScalarMappable

    from hertzchain.report.picture import at_whole_numbers, in_units

    low, high = values.min(), values.max()
    scale = ScalarMappable(_norm(float(low), float(high), is_whole(name), log), "viridis")
    bar = axes.figure.colorbar(scale, ax=axes)
    if is_whole(name) and not log:
        bar.locator = at_whole_numbers()
        bar.minorticks_off()
        bar.update_ticks()
    in_units(bar.ax.yaxis, column_named(name).label)
    return scale


def _norm(low: float, high: float, whole: bool, log: bool) -> Normalize:
    from matplotlib.colors import BoundaryNorm, LogNorm, Normalize

    colours = 256  # of the colour map
    if log:
        return LogNorm(low, high)
    if whole and high - low < colours:
        return BoundaryNorm(np.arange(low, high + 2) - 0.5, colours)
    return Normalize(low, high)
