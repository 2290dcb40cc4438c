"""Plots along the chain, in Plotly's format."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray, or_none
from hertzchain.engines.registry import MARKERS as SYMBOLS
from hertzchain.observables.result import Result
from hertzchain.report.document import Document
from hertzchain.report.plotly import Plot, Trace, axis, layout
from hertzchain.report.style import COLOURS, DASHES, LABELS, MARKERS, peak_limits

_POINTS = 150  # most contacts in plots along the chain: more cannot be told apart
LONG = 200  # contacts from which on plots have a logarithmic axis and the table is folded


def plotted_contacts(document: Document) -> NDArray[np.intp]:
    """Return the indices of plotted contacts: all, or the first, some others, and the worst."""
    size = document.native.contact.size
    if size <= LONG:
        return np.arange(size)
    first = np.arange(_POINTS // 3)
    later = np.geomspace(first[-1], size - 1, _POINTS - first.size).astype(np.intp)
    off = document.differences.values()
    worst = [np.nanargmax(values) for values in off if np.any(np.isfinite(values))]
    last = np.arange(size - 3, size)
    return np.unique(np.concatenate([first, later, last, np.asarray(worst, np.intp)]))


def _layout(native: Result, y: dict[str, Any]) -> dict[str, Any]:
    """Layout with contacts along the first axis, and a line at the end of the transition."""
    p, long = native.transition_granules, native.contact.size > LONG
    along = {"type": "log", "dtick": "D2"} if long else {"rangemode": "tozero"}
    drawn = layout(axis("contact", **along), y, 400)
    if p is None:
        return drawn
    line = {"color": "#777", "width": 1, "dash": "dash"}
    # on a logarithmic axis Plotly places notes by the logarithm, lines by the value
    place = float(np.log10(p)) if long else p
    drawn["shapes"] = [
        {"type": "line", "x0": p, "x1": p, "y0": 0, "y1": 1, "yref": "paper", "line": line}
    ]
    # Above the frame, as points and lines may be anywhere in it; the legend is above that.
    note = {"text": f"p = {p}", "x": place, "y": 1, "yref": "paper", "showarrow": False}
    note |= {"xanchor": "center", "yanchor": "bottom"}
    drawn["annotations"] = [note | {"font": {"color": "#555"}}]
    drawn["legend"] |= {"y": 1.08}
    return drawn


def _points(name: str, contact: list[int], values: FloatArray, hover: str) -> Trace:
    """Return markers in the style of a named engine."""
    marker = {"symbol": SYMBOLS[MARKERS[name]], "size": 8, "color": COLOURS[name]}
    return {
        "type": "scatter",
        "mode": "markers",
        "name": LABELS[name],
        "x": contact,
        "y": or_none(values),
        "marker": marker | {"line": {"width": 1.5, "color": COLOURS[name]}},
        "hovertemplate": f"{LABELS[name]}<br>contact %{{x}}<br>{hover}<extra></extra>",
    }


def peak_plot(document: Document, plotted: NDArray[np.intp]) -> Plot:
    """Return a plot of peak forces along the chain: native as a line, the others as markers."""
    native, absent = document.native, document.absent
    contact = native.contact[plotted].tolist()
    hover = "%{y:.9g} N"
    line: Trace = {
        "type": "scatter",
        "mode": "lines",
        "name": "native, reference",
        "x": contact,
        "y": or_none(native.peak_force[plotted]),
        "line": {"color": COLOURS["native"], "width": 1.5},
        "hovertemplate": f"native, reference<br>contact %{{x}}<br>{hover}<extra></extra>",
    }
    points = [
        _points(name, contact, values[plotted], hover) for name, values in document.drawn.items()
    ]
    names = ", ".join(["native", *(LABELS[name] for name in document.drawn)])
    p = native.transition_granules
    marked = "" if p is None else f" p = {p} is the number of granules in the transition."
    missing = f" {' and '.join(absent)}: not run." if absent else ""
    # all far above 0 under a static load: the plot is around them
    start = "tozero" if peak_limits(native)[0] == 0 else "normal"
    return Plot(
        "peaks",
        f"Peak force of each contact along the chain by {names}; the numbers are in the table of"
        " peak forces.",
        "Peak force of each contact along the chain; contact i lies between granules i \u2212 1 and"
        f" i.{marked}{missing}{_thin_note(native, plotted)}",
        [line, *points],
        _layout(native, axis("peak force [N]", rangemode=start)),
    )


def _thin_note(native: Result, plotted: NDArray[np.intp]) -> str:
    size = native.contact.size
    if plotted.size == size:
        return ""
    return f" {plotted.size} of {size:,} contacts are plotted, among them the largest differences."


def difference_plot(document: Document, plotted: NDArray[np.intp]) -> Plot:
    """Plot of differences from native on a logarithmic axis, with a line for each limit."""
    native = document.native
    contact = native.contact[plotted].tolist()
    ends = [int(native.contact[0]), int(native.contact[-1])]
    traces = [
        _points(name, contact, np.where(off > 0, off, np.nan)[plotted], "%{y:.2e}")
        for name, off in document.differences.items()
    ]
    traces += [
        {
            "type": "scatter",
            "mode": "lines",
            "name": label,
            "x": ends,
            "y": [value, value],
            "line": {"color": COLOURS[name], "width": 1.5, "dash": DASHES[name]},
            "hovertemplate": f"{label}<br>%{{y:.2e}}<extra></extra>",
        }
        for name, label, value in document.lines
        if value > 0
    ]
    values = [value for trace in traces for value in trace["y"] if value]
    decades = float(np.log10(max(values) / min(values))) if values else 0.0
    y = axis("relative difference from native", type="log", exponentformat="power")
    y["dtick"] = 2 if decades > 8 else 1
    return Plot(
        "differences",
        "Relative difference of each peak force from the reference on a logarithmic scale, with"
        " error estimates; the numbers are in the table of peak forces.",
        "Relative difference of each peak force from the reference, without its sign. Lines: what"
        " each simulation says of its own error, at most. Exact agreement is not drawn"
        " on the logarithmic scale." + _thin_note(native, plotted),
        traces,
        _layout(native, y),
    )
