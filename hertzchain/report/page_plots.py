"""Plots along the chain, as Plotly takes them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.engines.registry import MARKERS as SYMBOLS
from hertzchain.observables.result import Result
from hertzchain.report.plotly import Plot, Trace, axis, layout
from hertzchain.report.style import COLOURS, MARKERS

_POINTS = 150
"""Contacts of long chains in plots along the chain: more cannot be told apart."""

LONG = 200
"""Contacts from which on plots have a logarithmic axis and the table is folded."""


def _contact_axis(contacts: int) -> dict[str, Any]:
    if contacts > LONG:
        return axis("contact", type="log", dtick="D2")
    return axis("contact", rangemode="tozero")


def plotted_contacts(result: Result, off: Sequence[FloatArray]) -> NDArray[np.intp]:
    """Indices of the contacts that are plotted: all, or the first, then fewer, and the worst."""
    size = result.contact.size
    if size <= LONG:
        return np.arange(size)
    first = np.arange(_POINTS // 3)
    later = np.geomspace(first[-1], size - 1, _POINTS - first.size).astype(np.intp)
    worst = [np.nanargmax(values) for values in off if np.any(np.isfinite(values))]
    last = np.arange(size - 3, size)
    return np.unique(np.concatenate([first, later, last, np.asarray(worst, np.intp)]))


def _known(values: FloatArray) -> list[float | None]:
    """For JSON, which has no word for what is not a number."""
    return [value if np.isfinite(value) else None for value in values.tolist()]


def _marker(name: str) -> dict[str, Any]:
    return {
        "symbol": SYMBOLS[MARKERS[name]],
        "size": 8,
        "color": COLOURS[name],
        "line": {"width": 1.5, "color": COLOURS[name]},
    }


def relative_difference(values: FloatArray, result: Result) -> FloatArray:
    """Relative difference from the peaks of a result, without sign; NaN where there is none."""
    pressed = np.where(result.peak_force > 0, result.peak_force, np.nan)
    return np.asarray(np.abs(values / pressed - 1))


def _mark_transition(drawn: dict[str, Any], p: int | None, long: bool) -> dict[str, Any]:
    if p is None:
        return drawn
    line = {"color": "#777", "width": 1, "dash": "dash"}
    place = float(np.log10(p)) if long else p  # Plotly places notes, not lines, by the logarithm
    drawn["shapes"] = [
        {"type": "line", "x0": p, "x1": p, "y0": 0, "y1": 1, "yref": "paper", "line": line}
    ]
    note = {"text": f"p = {p}", "x": place, "y": 0, "yref": "paper", "showarrow": False}
    note |= {"xanchor": "left", "yanchor": "bottom", "xshift": 4, "bgcolor": "#fff"}
    drawn["annotations"] = [note | {"font": {"color": "#555"}}]
    return drawn


Series = list[tuple[str, str, FloatArray]]
"""Name, label and peak forces [N] of each who is compared with native."""


def peak_plot(native: Result, series: Series, plotted: NDArray[np.intp], missing: str) -> Plot:
    """Peak force along the chain: native as a line, the others as markers.

    Parameters
    ----------
    native
        The reference.
    series
        Who else is drawn.
    plotted
        Indices of the contacts that are drawn, see ``plotted_contacts``.
    missing
        A sentence on who is not there, with a space before it.
    """
    contact = native.contact[plotted].tolist()
    hover = "contact %{x}<br>%{y:.9g} N"
    traces: list[Trace] = [
        {
            "type": "scatter",
            "mode": "lines",
            "name": "native, reference",
            "x": contact,
            "y": _known(native.peak_force[plotted]),
            "line": {"color": COLOURS["native"], "width": 1.5},
            "hovertemplate": f"native, reference<br>{hover}<extra></extra>",
        }
    ]
    traces += [
        {
            "type": "scatter",
            "mode": "markers",
            "name": label,
            "x": contact,
            "y": _known(values[plotted]),
            "marker": _marker(name),
            "hovertemplate": f"{label}<br>{hover}<extra></extra>",
        }
        for name, label, values in series
    ]
    size = native.contact.size
    drawn = layout(_contact_axis(size), axis("peak force [N]", rangemode="tozero"), 400)
    names = ", ".join(["native", *(label for _, label, _ in series)])
    p = native.transition_granules
    marked = "" if p is None else f" p = {p} is the number of granules in the transition."
    return Plot(
        "peaks",
        f"Peak force of each contact along the chain by {names}; the numbers are in the table of"
        " peak forces.",
        "Peak force of each contact along the chain; contact i lies between granules i \u2212 1 and"
        f" i.{marked}{missing}{_thin_note(size, plotted)}",
        traces,
        _mark_transition(drawn, p, size > LONG),
    )


def _thin_note(size: int, plotted: NDArray[np.intp]) -> str:
    if plotted.size == size:
        return ""
    return f" {plotted.size} of {size:,} contacts are plotted, among them the largest differences."


def difference_plot(
    native: Result,
    series: Series,
    plotted: NDArray[np.intp],
    limits: Sequence[tuple[str, str, str, float]],
) -> Plot:
    """Differences on a logarithmic axis, and (label, colour, dash, value) of horizontal lines."""
    contact = native.contact[plotted].tolist()
    traces: list[Trace] = []
    for name, label, values in series:
        off = relative_difference(values, native)[plotted]
        traces.append(
            {
                "type": "scatter",
                "mode": "markers",
                "name": label,
                "x": contact,
                "y": _known(np.where(off > 0, off, np.nan)),
                "marker": _marker(name),
                "hovertemplate": f"{label}<br>contact %{{x}}<br>%{{y:.2e}}<extra></extra>",
            }
        )
    ends = [int(native.contact[0]), int(native.contact[-1])]
    traces += [
        {
            "type": "scatter",
            "mode": "lines",
            "name": label,
            "x": ends,
            "y": [value, value],
            "line": {"color": colour, "width": 1.5, "dash": dash},
            "hovertemplate": f"{label}<br>%{{y:.2e}}<extra></extra>",
        }
        for label, colour, dash, value in limits
        if value > 0
    ]
    y = axis("relative difference from native", type="log", exponentformat="power", dtick=1)
    if _decades(traces) > 8:
        y["dtick"] = 2
    return Plot(
        "differences",
        "Relative difference of each peak force from the reference on a logarithmic scale, with"
        " error estimates; the numbers are in the table of peak forces.",
        "Relative difference of each peak force from the reference, without its sign. Lines: what"
        " each simulation says of its own error, at most. Exact agreement has no place on a"
        " logarithmic scale." + _thin_note(native.contact.size, plotted),
        traces,
        _mark_transition(
            layout(_contact_axis(native.contact.size), y, 400),
            native.transition_granules,
            native.contact.size > LONG,
        ),
    )


def _decades(traces: Sequence[Trace]) -> float:
    values = [value for trace in traces for value in trace["y"] if value]
    return float(np.log10(max(values) / min(values))) if values else 0.0
