"""Reports for people: one page of HTML that needs neither server nor network.

Plots are Plotly's, whose script is inlined; tables are there without scripts, too.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.errors import OutputError
from hertzchain.files import write_text
from hertzchain.report import (
    COLOURS,
    MARKERS,
    answers,
    describe,
    difference,
    judgement_facts,
    number,
    shown_contacts,
    similar_scene,
)
from hertzchain.result import Result
from hertzchain.scene import Scene
from hertzchain.similarity import force_scale

if TYPE_CHECKING:
    from hertzchain.comparison import Check, Comparison
    from hertzchain.judgement import Judgement

Trace = dict[str, Any]
"""A curve as Plotly takes it."""

TEMPLATES = Path(__file__).parent / "templates"

_TIMES = 500
"""Of a history."""

_READINGS = 4_000_000
"""Times and granules recorded at once: 100 MB for each simulation, displacements and all."""

_EVEN, _DENSE, _BURST = 0.4, 0.25, 0.5
"""Between recorded times [durations of a contact's unit of time]: at most, where they are even;
where the wave forms in a long chain, and in the bursts after that."""

_OF_A_BURST = 20
"""Recorded times: the wave passes a contact in some six units of time, of these ten."""

_OWN, _AROUND = 2.5, 8.0
"""Contacts' units of time before and after a peak: recorded closely at least; drawn."""

_CURVES = 20
"""Contacts in the plot of contact force over time."""

_POINTS = 150
"""Contacts of long chains in the other plots: more cannot be told apart."""

_LONG = 200
"""Contacts from which on plots have a logarithmic axis and the table is folded."""

_ROWS = 10_000
"""Of a table, a megabyte; all further numbers are in the page's JSON."""

_SYMBOLS = {"o": "circle-open", "x": "x-thin-open", "+": "cross-thin-open", "s": "square-open"}
_SYMBOLS["^"] = "triangle-up-open"
"""Plotly's names of Matplotlib's markers."""

_DASHES = {"lammps": "dash", "liggghts": "dot", "yade": "dashdot"}

_WHAT_TO_DO = {
    "native: error of the reference": "the reference cannot judge this scene: a shorter end_time"
    " or chain leaves it more digits",
    ": momentum [N s]": "do not use this result; what it was pushed with is not the pulse, or it"
    " was lost on the way",
    ": energy [J]": "do not use this result; something does work, or takes it, that is not in"
    " Eq. 1: damping, another law, or steps too long",
    "same steps": "do not use this result; at the same steps it is another chain: look at what"
    " differs first in the checks above it, then at the force law and the integrator of the deck",
    "peaks against the reference": "do not trust its error estimate; take shorter steps",
    "lammps: ": "what LAMMPS made of the deck is not the scene: `hertzchain deck` writes the deck,"
    " `hertzchain lint` points at what is wrong in it",
}
"""What to do about a failed check, by a part of its name; the first that is found."""


# When to look


def record_times(scene: Scene) -> FloatArray:
    """Times at which to record a scene so that its wave can be drawn [s], increasing.

    As many as memory allows, some 500: even where that is close enough to follow the wave all the
    way; else close while it forms, and then in bursts, geometrically apart, in each of which it
    passes a few contacts.

    Parameters
    ----------
    scene
        What will be simulated.
    """
    count = int(np.clip(_READINGS // scene.chain.granules, 2, _TIMES))
    unit = _contact_time(scene)
    end = scene.end_time
    if end <= _EVEN * unit * (count - 1):
        return np.linspace(0.0, end, count)
    dense = _DENSE * unit * np.arange(count * 5 // 8)
    burst = _BURST * unit * np.arange(_OF_A_BURST)
    starts = np.geomspace(
        dense[-1] + burst[-1], end - burst[-1], max(1, (count - dense.size) // _OF_A_BURST)
    )
    times = np.concatenate([dense, (starts[:, None] + burst).ravel()])
    return np.unique(times[times <= end])


def _contact_time(scene: Scene) -> float:
    """The unit of time of the contacts of a scene [s]: it goes as their force to the power -1/6."""
    return float(scene.units.time * force_scale(scene.momentum_ratio) ** (-1 / 6))


def _followed(result: Result) -> NDArray[np.int_]:
    """Contacts whose peak lies well within what was recorded at close times."""
    assert result.history is not None
    time = result.history.time
    of_segment = np.concatenate([[0], np.cumsum(_gaps(time))])
    contact = result.contact[np.isfinite(result.peak_time)]
    peak_time = result.peak_time[contact - 2]
    before = np.clip(np.searchsorted(time, peak_time, "right") - 1, 0, time.size - 2)
    same = of_segment[before] == of_segment[before + 1]
    first = np.searchsorted(of_segment, of_segment[before], "left")
    last = np.searchsorted(of_segment, of_segment[before], "right") - 1
    from_start = np.where(time[first] > 0, peak_time - time[first], np.inf)
    to_end = np.where(last < time.size - 1, time[last] - peak_time, np.inf)
    close = np.minimum(from_start, to_end) > _OWN * _contact_time(result.scene)
    return np.asarray(contact[same & close])


def _gaps(time: FloatArray) -> NDArray[np.bool_]:
    """Where recorded times are so far apart that nothing is known between them."""
    steps = np.diff(time)
    return np.asarray(steps > 3 * np.min(steps))


def drawn_contacts(result: Result) -> list[int]:
    """The contacts, by the paper's numbers, whose force over time is drawn; close at the shock."""
    if result.history is None or result.history.time.size < 2:
        return []
    followed = _followed(result)
    if followed.size <= _CURVES:
        return [int(contact) for contact in followed]
    wanted = np.geomspace(followed[0], followed[-1], _CURVES)
    nearest = np.argmin(np.abs(np.log(followed[:, None] / wanted)), axis=0)
    return [int(contact) for contact in np.unique(followed[nearest])]


# Plots, as Plotly takes them


@dataclass(frozen=True)
class Plot:
    """A plot of a page.

    Parameters
    ----------
    name
        Its id in the page.
    label
        What is to be seen, for who cannot see it.
    caption
        What stands below it.
    traces, layout
        As Plotly takes them.
    """

    name: str
    label: str
    caption: str
    traces: list[Trace]
    layout: dict[str, Any]

    @property
    def figure(self) -> dict[str, Any]:
        """What the script draws."""
        return {"data": self.traces, "layout": self.layout}


def axis(title: str, **more: Any) -> dict[str, Any]:
    """An axis as all plots of a page have it."""
    style = {"showline": True, "linecolor": "#888", "ticks": "outside", "tickcolor": "#888"}
    grid = {"gridcolor": "#e4e4e4", "zeroline": False, "automargin": True}
    return {"title": {"text": title, "standoff": 8}, **style, **grid, **more}


def layout(x: dict[str, Any], y: dict[str, Any], height: int, **more: Any) -> dict[str, Any]:
    """The layout of a plot, with its legend below."""
    return {
        "xaxis": x,
        "yaxis": y,
        "height": height,
        "autosize": True,
        "margin": {"l": 60, "r": 14, "t": 14, "b": 50},
        "font": {"family": "system-ui, sans-serif", "size": 13, "color": "#1a1a1a"},
        "paper_bgcolor": "#fff",
        "plot_bgcolor": "#fff",
        "legend": {"orientation": "h", "x": 0, "xanchor": "left", "y": 1.02, "yanchor": "bottom"},
        "hovermode": "closest",
        "hoverlabel": {"font": {"family": "system-ui, sans-serif"}},
        **more,
    }


def _contact_axis(contacts: int) -> dict[str, Any]:
    if contacts > _LONG:
        return axis("contact", type="log", dtick="D2")
    return axis("contact", rangemode="tozero")


def _thinned(result: Result, off: Sequence[FloatArray]) -> NDArray[np.intp]:
    """Indices of the contacts that are plotted: all, or the first, then fewer, and the worst."""
    size = result.contact.size
    if size <= _LONG:
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
        "symbol": _SYMBOLS[MARKERS[name]],
        "size": 8,
        "color": COLOURS[name],
        "line": {"width": 1.5, "color": COLOURS[name]},
    }


def _off(values: FloatArray, result: Result) -> FloatArray:
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


def _peak_plot(native: Result, series: Series, plotted: NDArray[np.intp], missing: str) -> Plot:
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
        _mark_transition(drawn, p, size > _LONG),
    )


def _thin_note(size: int, plotted: NDArray[np.intp]) -> str:
    if plotted.size == size:
        return ""
    return f" {plotted.size} of {size:,} contacts are plotted, among them the largest differences."


def _difference_plot(
    native: Result,
    series: Series,
    plotted: NDArray[np.intp],
    limits: Sequence[tuple[str, str, str, float]],
) -> Plot:
    """Differences on a logarithmic axis, and (label, colour, dash, value) of horizontal lines."""
    contact = native.contact[plotted].tolist()
    traces: list[Trace] = []
    for name, label, values in series:
        off = _off(values, native)[plotted]
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
            native.contact.size > _LONG,
        ),
    )


def _decades(traces: Sequence[Trace]) -> float:
    values = [value for trace in traces for value in trace["y"] if value]
    return float(np.log10(max(values) / min(values))) if values else 0.0


def _time_unit(end: float) -> tuple[str, float]:
    """The unit in which times up to an end [s] are read with ease, and what it is in seconds."""
    for name, unit in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6), ("ns", 1e-9)):
        if end >= 2 * unit:
            return name, unit
    return "s", 1.0


def _waterfall(results: Mapping[str, Result], labels: Mapping[str, str]) -> Plot | None:
    """Contact force over time, contacts above one another; None where nothing was recorded."""
    native = results["native"]
    drawn, history = drawn_contacts(native), native.history
    if not drawn or history is None:
        return None
    scene = native.scene
    long = bool(np.any(_gaps(history.time)))
    # The waves of a long chain are as narrow as lines: each is drawn around its own peak.
    around = _AROUND * _contact_time(scene) if long else np.inf
    unit_name, unit = _time_unit(around if long else scene.end_time)
    largest = max(float(np.max(native.peak_force)), scene.shock.peak_force)
    height = 1.6 / largest
    shock_time = _shock_times(scene)
    shock = scene.applied_force(shock_time)
    highest = float(shock_time[np.argmax(shock)])
    of_shock = _Curve(0, "shock", shock_time, shock, highest)
    grey = {"color": "#777", "width": 1.5}
    traces = [
        of_shock.trace(around, unit, height, "applied force", unit_name)
        | {"line": grey, "legendgroup": "shock"}
    ]
    for key, result in results.items():
        if result.history is None:
            continue
        style: dict[str, Any] = {"color": COLOURS[key], "width": 1.5}
        if key != "native":
            style |= {"dash": _DASHES[key], "width": 2.5}
        for place, contact in enumerate(drawn, start=1):
            time, force = _with_peak(result, contact)
            peak_time = float(native.peak_time[contact - 2])
            curve = _Curve(place, f"contact {contact}", time, force, peak_time)
            more = {"line": style, "legendgroup": key, "showlegend": place == 1}
            traces.append(curve.trace(around, unit, height, labels[key], unit_name) | more)
    y = axis("contact", tickvals=list(range(len(drawn) + 1)))
    y |= {"ticktext": ["shock", *map(str, drawn)], "range": [-0.4, len(drawn) + 1.9]}
    if long:
        x = axis(f"time before and after its peak [{unit_name}]")
        x["range"] = [-around / unit, around / unit]
    else:
        x = axis(f"time [{unit_name}]", range=[0, scene.end_time / unit])
    own = " The chain is long: each line has its own zero of time, its peak." if long else ""
    return Plot(
        "waterfall",
        f"Contact force over time of {len(drawn)} contacts, one above the other: the wave runs from"
        " the shocked end to the free end.",
        f"Contact force over time: a line for each of {len(drawn)} contacts, by their numbers, and"
        f" the applied force below them; {largest:.4g} N are {height * largest:.1f} lines high."
        f" Each line has its exact peak.{own}",
        traces,
        layout(x, y, 260 + 22 * len(drawn)),
    )


def _shock_times(scene: Scene) -> FloatArray:
    """Times at which the applied force is drawn [s]: its corners, between them, and the end."""
    corners = [ramp.start for ramp in scene.ramps] + [scene.ramps[-1].end]
    even = np.linspace(corners[0], corners[-1], 200)
    if len(corners) > even.size:  # a table may have thousands of rows
        corners = [corners[0], corners[-1]]
    time = np.unique(np.concatenate([[0.0, scene.end_time], even, corners]))
    return time[time <= scene.end_time]


def _with_peak(result: Result, contact: int) -> tuple[FloatArray, FloatArray]:
    """Times [s] and contact forces [N] of a contact, with its peak between them."""
    assert result.history is not None
    time, force = result.history.time, result.history.contact_force[:, contact - 2]
    peak_time = result.peak_time[contact - 2]
    if np.isnan(peak_time) or peak_time in time:
        return time, force
    at = int(np.searchsorted(time, peak_time))
    return np.insert(time, at, peak_time), np.insert(force, at, result.peak_force[contact - 2])


@dataclass(frozen=True, eq=False)
class _Curve:
    """A line of a waterfall.

    Parameters
    ----------
    place
        Which line, from below.
    what
        Whose force it is.
    time, force
        [s], [N], shape (times,).
    peak_time
        When it is highest [s].
    """

    place: int
    what: str
    time: FloatArray
    force: FloatArray
    peak_time: float

    def trace(self, around: float, unit: float, height: float, name: str, unit_name: str) -> Trace:
        """As Plotly takes it.

        Parameters
        ----------
        around
            How long before and after its peak it is drawn [s]; infinite: always, and from time 0.
        unit
            Of the time [s].
        height
            Of a Newton, in lines.
        name, unit_name
            In the legend; of the unit.
        """
        inside = np.abs(self.time - self.peak_time) <= around
        time, force = self.time[inside], self.force[inside]
        still = np.zeros(force.size, bool)  # points that only say that a line is straight
        still[1:-1] = (force[:-2] == 0) & (force[1:-1] == 0) & (force[2:] == 0)
        time, force = time[~still], force[~still]
        zero = self.peak_time if np.isfinite(around) else 0.0
        return {
            "type": "scatter",
            "mode": "lines",
            "name": name,
            "x": [_rounded((t - zero) / unit) for t in time],
            "y": [_rounded(self.place + height * f) for f in force],
            "customdata": [
                [_rounded(f, 9), _rounded(t / unit, 9)] for t, f in zip(time, force, strict=True)
            ],
            "hovertemplate": f"{self.what}, {name}<br>%{{customdata[1]:.6g}} {unit_name}"
            "<br>%{customdata[0]:.6g} N<extra></extra>",
        }


def _rounded(value: float, digits: int = 7) -> float:
    """As many digits as a plot or its hover text shows, so that the page stays small."""
    return float(f"{value:.{digits}g}")


# Tables


@dataclass(frozen=True)
class Table:
    """A table of a page.

    Parameters
    ----------
    caption
        What it is.
    header
        Names of the columns.
    rows
        Cells as they are shown.
    text
        How many of the first columns are text; all further ones are numbers.
    """

    caption: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]
    text: int = 1


def _peak_rows(native: Result, series: Series, codes: int) -> tuple[list[str], list[list[str]]]:
    """Header and rows of the table of peaks: digits of simulations, per cent of formulas."""
    labels = [label for _, label, _ in series]
    header = ["contact", "native [N]", *(f"{label} [N]" for label in labels)]
    header += [f"{label} − native" for label in labels]  # noqa: RUF001 - a minus sign
    rows = []
    columns = [values.tolist() for _, _, values in series]
    for contact, peak, *others in zip(
        native.contact.tolist(), native.peak_force.tolist(), *columns, strict=True
    ):
        cells = [str(contact), number(peak, 9)]
        for at, value in enumerate(others):
            cells.append(number(value, 9 if at < codes else 6))
        for at, value in enumerate(others):
            known = peak > 0 and not np.isnan(value)
            off = value / peak - 1 if known else 0.0
            cells.append((f"{off:+.1e}" if at < codes else f"{off:+.2%}") if known else "")
        rows.append(cells)
    return header, rows


def _split(result: Result, caption: str, header: list[str], rows: list[list[str]]) -> list[Table]:
    """The transition, then the rest; one table where the chain is short."""
    if len(rows) <= 30:
        return [Table(caption, header, rows, 0)]
    first = len(shown_contacts(result))
    if first >= len(rows):
        return [Table(caption, header, rows, 0)]
    left = rows[first : first + _ROWS]
    p = result.transition_granules
    of_transition = "the first contacts" if p is None else "the transition and the contact after it"
    rest = f"{len(rows) - first:,} further contacts, {rows[first][0]} to {rows[-1][0]}"
    if len(left) < len(rows) - first:
        rest += f"; here to {left[-1][0]}, the rest is in the JSON"
    told = [at for at in range(len(header)) if any(row[at] for row in left)]
    return [
        Table(f"{caption}: {of_transition}", header, rows[:first], 0),
        Table(rest, [header[at] for at in told], [[row[at] for at in told] for row in left], 0),
    ]


def _peak_tables(comparison: Comparison, series: Series, codes: int) -> list[Table]:
    header, rows = _peak_rows(comparison.native, series, codes)
    return _split(comparison.native, "Peak force of each contact", header, rows)


def _cost_table(comparison: Comparison, labels: Mapping[str, str]) -> Table:
    header = ["", "method", "largest step [s]", "steps", "force evaluations", "wall time [s]"]
    rows = [
        [
            labels[name],
            result.method,
            f"{result.dt:.3g}",
            f"{result.steps:,}",
            f"{result.force_evaluations:,}",
            f"{result.wall_time:.3g}",
            f"{result.error_estimate:.1e}",
        ]
        for name, result in comparison.results.items()
    ]
    rows += [
        [labels[name], "did not run", *[""] * 5]
        for name in comparison.wanted
        if name not in comparison.results
    ]
    said = "see differences" if comparison.formulas.applicable is None else ""
    rows.append(["formulas", "Eqs. 3 to 9, given p and F_SW", "", "0", "0", "0", said])
    return Table("What each answer cost", [*header, "error of the peaks, at most"], rows, text=2)


@dataclass(frozen=True)
class CheckRow:
    """A check in a table.

    Parameters
    ----------
    passed, name, reason
        As the check has them.
    cells
        Its numbers, as they are shown.
    """

    passed: bool
    name: str
    reason: str
    cells: Sequence[str]

    @classmethod
    def of(cls, check: Check) -> CheckRow:
        """A check, with measured, expected, difference and tolerance."""
        measured = "" if check.measured is None else f"{check.measured:.9g}"
        expected = "" if check.expected is None else f"{check.expected:.9g}"
        off = ["0" if text == "0.0e+00" else text for text in difference(check)]
        return cls(check.passed, check.name, check.reason, [measured, expected, *off])


# The verdict


@dataclass(frozen=True)
class Failure:
    """A check that failed.

    Parameters
    ----------
    name
        Of the check.
    found
        What was measured.
    advice
        What to do.
    """

    name: str
    found: str
    advice: str


def _failure(check: Check) -> Failure:
    off, tolerance = difference(check)
    if not off:
        return Failure(check.name, "", check.reason)
    found = f"off by {off}, allowed is {tolerance} ({check.reason})"
    for part, advice in _WHAT_TO_DO.items():
        if part in check.name:
            return Failure(check.name, found, advice)
    return Failure(check.name, found, "do not use this result")


@dataclass(frozen=True)
class Verdict:
    """The head of a page.

    Parameters
    ----------
    passed
        Whether all is well.
    sentence
        What that means.
    failures
        What failed.
    remarks
        Warnings, and what could not be said.
    """

    passed: bool
    sentence: str
    failures: Sequence[Failure] = ()
    remarks: Sequence[str] = ()

    @property
    def word(self) -> str:
        """``PASS`` or ``FAIL``."""
        return "PASS" if self.passed else "FAIL"


def _verdict(comparison: Comparison, labels: Mapping[str, str], codes: Sequence[str]) -> Verdict:
    checks = comparison.checks
    failed = [check for check in checks if not check.passed]
    made = [check for check in checks if check.measured is not None or check.passed]
    only_absent = bool(failed) and all(check.measured is None for check in failed)
    ran = [name for name in codes if name in comparison.results]
    if not failed and ran:
        off = max(
            float(
                np.nanmax(_off(comparison.results[name].peak_force, comparison.native), initial=0)
            )
            for name in ran
        )
        who = " and ".join(labels[name] for name in ran)
        sentence = (
            f"All {len(checks)} checks passed. Peaks by {who} differ from those of native by"
            f" {off:.1e} at most, within the errors that both claim."
        )
    elif not failed:
        sentence = (
            f"All {len(checks)} checks of native passed; no other simulation was compared with it,"
            " so that nothing but its own balances and error estimate speaks for it."
        )
    elif only_absent:
        sentence = (
            f"Undecided: not everything that was asked for could be compared. The {len(made)}"
            " checks that could be made passed."
        )
    else:
        sentence = f"{len(failed)} of {len(checks)} checks failed."
    remarks = [
        f"{labels[name]}: {warning}"
        for name, result in comparison.results.items()
        for warning in result.warnings
    ]
    remarks += [
        f"Formulas: {remark}"
        for remark in (comparison.formulas.applicable, comparison.formulas.note)
        if remark
    ]
    asked = {check.name.partition(":")[0] for check in checks}
    remarks += [
        f"{labels[name]} has not been asked"
        for name in comparison.wanted
        if name not in comparison.results and name not in asked
    ]
    return Verdict(not failed, sentence, [_failure(check) for check in failed], remarks)


# Pages


def check_page_format(path: Path | str) -> None:
    """Raise an OutputError, before any work is done, for a name that is no page's.

    Raises
    ------
    OutputError
        If the file name does not end in .html or .htm.
    """
    if Path(path).suffix.lower() not in (".html", ".htm"):
        raise OutputError(f"{path}: a report is a page, the name must end in .html or .htm")


def comparison_page(comparison: Comparison, file: str = "scene.toml") -> str:
    """A comparison as a page of HTML.

    Parameters
    ----------
    comparison
        What to show; contact force over time if its results have a history, see ``record_times``.
    file
        The name of the scene file.
    """
    from hertzchain.comparison import CODES

    native, formulas = comparison.native, comparison.formulas
    labels = {"native": "native", **CODES}
    codes = [name for name in comparison.wanted if name in CODES]
    nothing = np.full(native.contact.size, np.nan)
    series: Series = []
    for name in codes:
        result = comparison.results.get(name)
        series.append((name, labels[name], nothing if result is None else result.peak_force))
    ran = [entry for entry in series if entry[0] in comparison.results]
    equations: Series = [("eq6", "Eq. 6", formulas.eq6), ("eq9", "Eq. 9", formulas.eq9)]
    compared = ran + (equations if formulas.applicable is None else [])
    plotted = _thinned(native, [_off(values, native) for _, _, values in compared])
    limits = [
        (f"{labels[name]}, error estimate", COLOURS[name], _DASHES[name], result.error_estimate)
        for name, result in comparison.results.items()
        if name in CODES
    ]
    limits.append(("reference, error estimate", COLOURS["native"], "solid", native.error_estimate))
    absent = [labels[name] for name in codes if name not in comparison.results]
    missing = f" {' and '.join(absent)}: not run." if absent else ""
    plots = [
        _peak_plot(native, compared, plotted, missing),
        _waterfall(comparison.results, labels),
        _difference_plot(native, compared, plotted, limits),
    ]
    header = ["", *(labels[name] for name in comparison.wanted), "formulas"]
    return render(
        "comparison.html.jinja",
        {
            "kind": "Comparison",
            "title": describe(comparison.scene),
            "file": file,
            "verdict": _verdict(comparison, labels, codes),
            "plots": {plot.name: plot for plot in plots if plot is not None},
            "peaks": _peak_tables(comparison, series + equations, len(codes)),
            "long": _LONG,
            "answers": Table(
                "The transition and the wave that leaves it",
                header,
                [[label, *cells] for label, cells in answers(comparison)],
            ),
            "rows": [CheckRow.of(check) for check in comparison.checks],
            "notes": [
                f"{labels[name]} computed {similar}"
                for name, result in comparison.results.items()
                if (similar := similar_scene(result)) is not None
            ],
            "cost": _cost_table(comparison, labels),
            "texts": _texts(comparison.scene),
            "versions": _versions(comparison.results),
            "numbers": comparison.to_dict(),
            "numbers_name": "comparison.json",
        },
    )


def judgement_page(judgement: Judgement, file: str = "scene.toml", peaks: str = "") -> str:
    """A judgement of given peaks as a page of HTML.

    Parameters
    ----------
    judgement
        What to show.
    file, peaks
        The names of the scene file and of the file of peaks.
    """
    native, tolerance = judgement.reference, judgement.tolerance
    series: Series = [("lammps", "given", judgement.given)]
    plotted = _thinned(native, [np.abs(judgement.difference)])
    limits = [
        ("tolerance", COLOURS["eq6"], "dash", tolerance),
        ("reference, error estimate", COLOURS["native"], "solid", native.error_estimate),
    ]
    failed = int(np.count_nonzero(judgement.judged & ~judgement.passed))
    judged = int(np.count_nonzero(judgement.judged))
    if judged == 0:
        sentence = "Undecided: no contact could be judged."
    elif failed == 0:
        sentence = f"All {judged} judged contacts are within {tolerance:.1e} of the reference."
    else:
        sentence = f"{failed} of {judged} judged contacts are off by more than {tolerance:.1e}."
    failures = []
    if failed:
        cause = judgement.cause or "no known pattern"
        failures = [Failure("Likely cause", "", cause)]
    header = ["contact", "given [N]", "native [N]", "difference", ""]
    words = {True: "pass", False: "FAIL", None: "not judged"}
    rows = [
        [
            str(row["contact"]),
            number(row["given_N"], 9),
            number(row["reference_N"], 9),
            "" if row["difference"] is None else f"{row['difference']:+.1e}",
            "not given" if row["given_N"] is None else words[row["passed"]],  # type: ignore[index]
        ]
        for row in judgement.rows
    ]
    plots = [
        _peak_plot(native, series, plotted, ""),
        _difference_plot(native, series, plotted, limits),
    ]
    return render(
        "judgement.html.jinja",
        {
            "kind": "Judgement of given peaks",
            "title": describe(native.scene),
            "file": file,
            "given": peaks,
            "verdict": Verdict(
                judgement.verdict == "pass",
                sentence,
                failures,
                [*judgement.remarks, *native.warnings],
            ),
            "plots": {plot.name: plot for plot in plots},
            "facts_of_all": judgement_facts(judgement),
            "peaks": _split(native, "Peak force of each contact", header, rows),
            "long": _LONG,
            "texts": _texts(native.scene),
            "versions": _versions({"native": native}),
            "numbers": judgement.to_dict(),
            "numbers_name": "judgement.json",
        },
    )


def _texts(scene: Scene) -> list[tuple[str, str]]:
    """Names and contents of the files that make a scene, the TOML first."""
    texts = scene.to_texts(Path("scene.toml"))
    return [(path.name, text) for path, text in reversed(texts.items())]


def _versions(results: Mapping[str, Result]) -> list[tuple[str, str]]:
    """What has taken part, and on what it ran."""
    found: dict[str, str] = {}
    for result in results.values():
        found |= result.to_dict()["provenance"]
    return list(found.items())


def render(template: str, content: Mapping[str, Any], templates: Sequence[Path] = ()) -> str:
    """Fill a template; whatever is filled in is escaped.

    Parameters
    ----------
    template
        Its file name.
    content
        What it shows.
    templates
        Folders with templates beside those of this package.
    """
    from importlib.metadata import version

    from jinja2 import Environment, FileSystemLoader, StrictUndefined
    from plotly.offline import get_plotlyjs

    environment = Environment(
        loader=FileSystemLoader([*templates, TEMPLATES]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    compact = {"separators": (",", ":"), "allow_nan": False}
    environment.policies["json.dumps_kwargs"] = compact
    return environment.get_template(template).render(
        content,
        plotly=get_plotlyjs(),
        version=version("hertzchain"),
        date=f"{datetime.now(UTC):%Y-%m-%d %H:%M} UTC",
    )


def write_comparison(comparison: Comparison, path: Path | str, file: str = "scene.toml") -> None:
    """Write ``comparison_page`` to a file, whole or not at all.

    Raises
    ------
    OutputError
        If the suffix is not .html or .htm, or the file cannot be written.
    """
    check_page_format(path)
    write_text(path, comparison_page(comparison, file))


def write_judgement(
    judgement: Judgement, path: Path | str, file: str = "scene.toml", peaks: str = ""
) -> None:
    """Write ``judgement_page`` to a file, whole or not at all.

    Raises
    ------
    OutputError
        If the suffix is not .html or .htm, or the file cannot be written.
    """
    check_page_format(path)
    write_text(path, judgement_page(judgement, file, peaks))
