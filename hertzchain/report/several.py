"""Several results in one picture, for papers: peaks along the chain, forces over time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.errors import require
from hertzchain.observables.result import Result
from hertzchain.report import style
from hertzchain.report.waterfall import drawn_contacts, while_moving, with_peak

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from hertzchain.report.picture import Picture

_KINDS = {"peaks": "peak force", "forces": "contact force", "gauges": "force on a gauge"}
_BAND_PERCENTILES = (5, 50, 95)  # of the results of a band, as a spread has them
_DASHES = ("-", "--", ":", "-.")
_DRAWN_CONTACTS = 3  # contacts whose force over time is drawn by default

_Line = tuple[FloatArray, FloatArray, FloatArray, FloatArray]  # x, middle, low, high


def plot(
    results: Annotated[Mapping[str, Result | list[Result]], require],
    draw: str = "peaks",
    contacts: Sequence[int] | None = None,
    size: tuple[float, float] = (7.0, 4.5),
) -> Picture:
    """Draw several results, by their names in the legend, each with a band of its error.

    Parameters
    ----------
    results
        Results by name. Several of one name, in a list, such as realisations of an uncertain scene,
        are drawn as a band from 5 to 95 % about their median; the band of a single result is its
        error estimate.
    draw
        ``peaks`` along the chain, ``forces`` of contacts over time, or forces of ``gauges``. Panels
        of contacts or gauges stand one above the other; one result has all its contacts in one.
    contacts
        Contacts whose forces are drawn; three by default.
    size
        Width and height [inches]: a column of a paper is 3.4 wide, a page 7.
    """
    from hertzchain.report.picture import Picture, in_units, legend_above

    require(draw in _KINDS, "draw", draw, f"must be one of {', '.join(_KINDS)}")
    is_named = isinstance(results, Mapping) and len(results) > 0
    require(is_named, "results", None, "must be results by name: {'steel': result}")
    groups = {
        name: list(group) if isinstance(group, list | tuple) else [group]
        for name, group in results.items()
    }
    each = [result for group in groups.values() for result in group]
    are_results = all(groups.values()) and all(isinstance(result, Result) for result in each)
    require(are_results, "results", None, "must have a result, or a list of them, for each name")
    if draw == "forces":
        most = min(result.scene.last_contact for result in each)
        shortest = min(each, key=lambda result: result.scene.last_contact)
        first = max(result.scene.contacts[0] for result in each)
        drawn_by_default = [k for k in drawn_contacts(shortest, _DRAWN_CONTACTS) if k >= first]
        contacts = contacts or drawn_by_default
        allowed = f"must be numbers from {first} to {most}, which all results have"
        is_there = all(first <= contact <= most for contact in contacts)
        require(is_there, "contacts", contacts, allowed)
    for name, group in groups.items():
        alike = len({result.scene.contacts for result in group}) == 1
        require(alike, "results", name, "must have chains of one length")
    panels = _panels(groups, draw, contacts)
    if len(groups) == 1:
        (name,) = groups
        panels = {"": {what or name: lines[name] for what, lines in panels.items()}}
    figure = Picture(size)
    drawn: list[Axes] = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0].tolist()
    for axes, (what, lines) in zip(drawn, panels.items(), strict=True):
        for k, (name, (x, middle, low, high)) in enumerate(lines.items()):
            look: dict[str, Any] = {"color": style.distinct(k), "label": name}
            if draw == "peaks":
                look |= {"marker": "os^Dv<>P"[k % 8], "markersize": 3, "fillstyle": "none"}
            axes.plot(x, middle, linestyle=_DASHES[k % 4], linewidth=1.0, **look)
            axes.fill_between(x, low, high, color=style.distinct(k), alpha=0.25, linewidth=0)
        least = min(float(np.nanmin(line[2])) for line in lines.values())
        largest = max(float(np.nanmax(line[3])) for line in lines.values())
        axes.set_ylim(*style.force_limits(least, largest))
        in_units(axes.yaxis, f"{what or _KINDS[draw]} [N]")
        axes.grid(alpha=0.25)
    if draw != "peaks":
        ends = [_changes(line) for lines in panels.values() for line in lines.values()]
        drawn[-1].set_xlim(min(begin for begin, _ in ends), max(end for _, end in ends))
    in_units(drawn[-1].xaxis, "contact" if draw == "peaks" else "time [s]")
    legend_above(drawn[0])
    return figure


def _changes(line: _Line) -> tuple[float, float]:
    """Return start and end of the time in which a force changes [s]."""
    time, _, low, high = line
    off = np.maximum(np.abs(low - low[0]), np.abs(high - high[0]))
    return while_moving(time, np.nan_to_num(off))


def _panels(
    groups: Mapping[str, Sequence[Result]], draw: str, contacts: Sequence[int] | None
) -> dict[str, dict[str, _Line]]:
    """Return the lines of each panel, by the names of their results."""
    series = {
        name: [_series(result, draw, contacts) for result in group]
        for name, group in groups.items()
    }
    names = dict.fromkeys(what for group in series.values() for curves in group for what in curves)
    return {
        what: {
            name: _band([curves[what] for curves in group])
            for name, group in series.items()
            if all(what in curves for curves in group)
        }
        for what in names
    }


def _series(
    result: Result, draw: str, contacts: Sequence[int] | None
) -> dict[str, tuple[FloatArray, FloatArray, FloatArray]]:
    """Return x, forces and their relative errors: of all contacts, or over time, by place."""
    if draw == "peaks":
        return {"": (result.contact.astype(np.float64), result.peak_force, result.peak_errors)}
    if draw == "gauges":
        frame = result.to_traces()
        time = frame["time_s"].to_numpy()
        return {
            str(name).removesuffix("_N").replace("_", " "): (time, frame[name].to_numpy(),
                np.full(time.size, np.nan_to_num(read.force_error)))  # none without a pulse
            for name, read in zip(frame.columns[1:], result.gauges, strict=True)
        }  # fmt: skip
    curves = {}
    for contact in contacts or ():
        time, force = with_peak(result, contact)
        error = np.full(time.size, result.peak_errors[result.scene.contacts.index(contact)])
        curves[result.scene.contact_name(contact)] = time, force, error
    return curves


def _band(each: Sequence[tuple[FloatArray, FloatArray, FloatArray]]) -> _Line:
    """Return a line with its band: the error of one result, percentiles of several."""
    x, force, error = each[0]
    if len(each) == 1:
        return x, force, force * (1 - error), force * (1 + error)
    # Only as long as all of them last.
    x = x[(x >= max(at[0] for at, _, _ in each)) & (x <= min(at[-1] for at, _, _ in each))]
    values = [np.interp(x, at, other) for at, other, _ in each]
    low, middle, high = np.percentile(values, _BAND_PERCENTILES, axis=0)
    return x, middle, low, high
