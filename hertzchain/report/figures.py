"""Figures: the panels of a document, of several results, and of trade-offs."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from itertools import cycle, repeat
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.errors import require
from hertzchain.observables.result import Result
from hertzchain.pulses.pulse import MeasuredPulse
from hertzchain.pulses.spectrum import WINDOW, Spectrum
from hertzchain.report import style
from hertzchain.report.console import place_of, with_deviation
from hertzchain.report.document import Document, describe
from hertzchain.report.files import recorded
from hertzchain.report.picture import (
    SMALL,
    Picture,
    at_whole_numbers,
    check_size,
    in_units,
    legend_above,
    legend_look,
)
from hertzchain.scene.chain import force_scale
from hertzchain.scene.scene import Scene

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from hertzchain.verdict.tradeoff import Tradeoff


_LONG_CHAIN_CONTACTS = 200  # from which on axes are logarithmic, points a bitmap; chosen


def draw_peaks(axes: Axes, document: Document) -> None:
    """Draw the peak of each contact, or its first pulse if first pulses were wanted."""
    native = document.native
    contact, what = native.contact, "peak force"
    peaks = np.asarray(native.peak_force)
    label = "_" if native.static_force is None else what
    if document.drawn:
        label = "native, reference"
    elif document.command == "run" and native.first_pulses is not None:
        what = "first pulse"
        peaks = np.asarray(native.first_columns["first_peak_force_N"], np.float64)
        label = "first pulse"
        if native.static_force is not None:
            what = "first pulse, less the static force"
    colour = style.COLOURS.get(native.backend, style.COLOURS["native"])
    # More than 80 markers would merge into a band
    marked = contact.size <= 80 or bool(np.isnan(peaks).any())
    axes.plot(
        contact, peaks, marker=style.MARKERS["native"] if marked else "", color=colour,
        markersize=3.5, linewidth=1.0, label=label,
    )  # fmt: skip
    if what == "peak force":
        low, high = (peaks * (1 + sign * native.peak_errors) for sign in (-1, 1))
        axes.fill_between(contact, low, high, color=colour, alpha=0.25, linewidth=0)
    static = native.static_force
    if static is not None:
        axes.plot(contact, static, color="0.5", linewidth=1.0, label="static force")
    _draw_points(axes, document, document.drawn)
    walls = [k for k in (0, -1) if native.scene.contact_label(contact[k]).endswith("wall")]
    if walls:
        axes.plot(
            contact[walls], peaks[walls], "s", color=colour, fillstyle="none", markersize=7,
            label="wall",
        )  # fmt: skip
    all_drawn = np.concatenate(
        [peaks, *document.drawn.values(), *([] if static is None else [static])]
    )
    forces = all_drawn[np.isfinite(all_drawn)]
    least = 0.0 if static is None else float(np.min(forces))
    axes.set_ylim(*style.force_limits(least, float(np.max(forces, initial=0.0))))
    p = native.transition_granules
    if p is not None:
        place = ("data", "axes fraction")
        axes.annotate(
            f"p = {p}", (p, 0.04), (4, 0), place, "offset points", color="0.35", fontsize="small"
        )
    _finish_along(axes, document)
    in_units(axes.yaxis, f"{what} [N]")


def _draw_points(axes: Axes, document: Document, drawn: Mapping[str, FloatArray]) -> None:
    """Draw values of named engines as open markers."""
    contact = document.native.contact
    for name, values in drawn.items():
        axes.plot(
            contact, values, linestyle="none", fillstyle="none", color=style.COLOURS[name],
            marker=style.MARKERS[name], markersize=4.5, label=style.LABELS[name],
            rasterized=contact.size > _LONG_CHAIN_CONTACTS,
        )  # fmt: skip


def draw_differences(axes: Axes, document: Document) -> None:
    """Draw differences from native on a logarithmic axis, with a line for each error."""
    axes.set_yscale("log")
    shown = {name: np.where(off > 0, off, np.nan) for name, off in document.differences.items()}
    values = np.concatenate([*shown.values(), [value for _, _, value in document.lines]])
    if (differences := values[values > 0]).size:
        axes.set_ylim(np.min(differences) / 3, 3 * np.max(differences))
    _draw_points(axes, document, shown)
    for name, label, value in document.lines:
        line = ":" if name == "native" else "--"
        axes.axhline(value, color=style.COLOURS[name], linewidth=0.8, linestyle=line, label=label)
    axes.set_ylabel("relative difference")
    _finish_along(axes, document, {style.LABELS[name] for name in document.drawn})


def _finish_along(axes: Axes, document: Document, named: Collection[str] = ()) -> None:
    """Draw the common parts of panels along the chain, and a legend of what has no name yet."""
    native = document.native
    if native.transition_granules is not None:
        axes.axvline(native.transition_granules, color="0.6", linewidth=0.8, zorder=0)
    axes.set_xlim(native.contact[0] - 1, native.contact[-1] + 1)
    if native.contact.size > _LONG_CHAIN_CONTACTS and native.scene.is_plain:
        axes.set_xscale("log")
        axes.set_xlim(1.8, native.contact[-1] * 1.1)
    else:
        axes.xaxis.set_major_locator(at_whole_numbers())
    in_units(axes.xaxis, "contact")
    axes.grid(alpha=0.25)
    legend_above(axes, named)


def what_happens(result: Result, contacts: Sequence[int]) -> tuple[float, float]:
    """Return start and end of the time in which contact forces change [s], with some room."""
    history, static = recorded(result), result.static_force
    some = np.asarray(contacts) - result.scene.contacts[0]
    moving = np.abs(history.contact_force[:, some] - (0.0 if static is None else static[some]))
    return while_moving(history.time, np.max(moving, axis=1))


def draw_forces(axes: Axes, document: Document) -> None:
    """Draw the forces of the scene's gauges over time, or those of some contacts and the shock.

    A contact's force has its exact peak. Forces by other engines are dashed lines over those of the
    first.
    """
    from matplotlib import colormaps

    result = document.native
    gauges, contacts = result.scene.gauges, drawn_contacts(result, 6)
    history = recorded(result)
    if result.scene.ramps and not gauges:
        applied, label = result.scene.applied_force(history.time), "applied force"
        load = result.scene.precompression
        if load is not None and load.force:
            applied, label = applied + load.force, "applied and static force"
        axes.plot(history.time, applied, "--", color="0.6", label=label)
    draw, of = ("gauges", None) if gauges else ("forces", contacts)
    curves = _series(result, draw, of)
    # The last tenth of the colours is too light on white
    shades = colormaps["viridis"](np.linspace(0, 0.9, len(curves)))
    for (label, (time, force, _)), shade in zip(curves.items(), shades, strict=True):
        axes.plot(time, force, color=shade, linewidth=1.2, label=label)
    others = {name: other for name, other in document.results.items() if other is not result}
    for name, other in others.items():
        of_other = _series(other, draw, of).values() if other.history is not None else ()
        for k, (time, force, _) in enumerate(of_other):
            # Sparse dashes leave the colour of the contact visible.
            axes.plot(
                time, force, color=style.COLOURS[name], linewidth=1.2, linestyle=(0, (2, 6)),
                label="_" if k else style.LABELS[name],
            )  # fmt: skip
    drawn = np.concatenate([np.asarray(line.get_ydata(), np.float64) for line in axes.lines])
    axes.set_ylim(*style.force_limits(float(np.min(drawn)), float(np.max(drawn))))
    if gauges:
        largest = np.max([np.abs(force) for _, force, _ in curves.values()], axis=0)
        axes.set_xlim(*while_moving(history.time, largest))
    else:
        axes.set_xlim(*what_happens(result, contacts))
    in_units(axes.yaxis, "force on a gauge [N]" if gauges else "contact force [N]")
    in_units(axes.xaxis, "time [s]")
    axes.grid(alpha=0.25)
    legend_above(axes)


def draw_map(axes: Axes, document: Document) -> None:
    """Draw the contact force of all contacts over time."""
    result = document.native
    history = recorded(result)
    begin, end = what_happens(result, result.contact.tolist())
    some = (history.time >= begin) & (history.time <= end)
    time, contact = history.time[some], result.contact
    between = np.concatenate([time[:1], (time[1:] + time[:-1]) / 2, time[-1:]])
    edges = np.append(contact, contact[-1] + 1) - 0.5  # "nearest" draws no height for one contact
    shown = axes.pcolormesh(
        between, edges, history.contact_force[some].T,
        cmap=style.force_colours(), shading="flat", rasterized=True,
    )  # fmt: skip
    bar = axes.figure.colorbar(shown, ax=axes, location="bottom", aspect=60, pad=0.02)
    in_units(bar.ax.xaxis, "contact force [N]")
    axes.yaxis.set_major_locator(at_whole_numbers())
    axes.set_ylabel("contact")
    axes.set_xlim(begin, end)
    in_units(axes.xaxis, "time [s]")


def draw_traces(axes: Axes, document: Document) -> None:
    """Draw measured traces one below the other, those of the reference as lines, and its band."""
    overlays = document.overlays
    apart = 1.1 * max(float(np.max(np.abs(overlay.expected))) for overlay in overlays)
    is_small = axes.figure.get_figwidth() < SMALL  # type: ignore[union-attr]
    for k, overlay in enumerate(overlays):
        base = (len(overlays) - 1 - k) * apart
        measured, reference = ("measured", "native, reference") if k == 0 else ("_", "_")
        axes.plot(
            overlay.time, overlay.measured + base, ".", color="0.6", markersize=2, label=measured,
            rasterized=True,
        )  # fmt: skip
        axes.plot(
            overlay.time, overlay.expected + base, color=style.COLOURS["native"], linewidth=1.0,
            label=reference,
        )  # fmt: skip
        if overlay.band is not None:
            low, high = overlay.band
            axes.fill_between(
                overlay.time, low + base, high + base, color=style.distinct(0), alpha=0.3,
                linewidth=0, label=_BAND if k == 0 else "_",
            )  # fmt: skip
        axes.annotate(
            overlay.label, (overlay.time[0], base), (0, 3), textcoords="offset points",
            fontsize="xx-small" if is_small else "small",
            bbox={"facecolor": "white", "alpha": 0.8, "edgecolor": "none", "pad": 0.5},
        )  # fmt: skip
    highest = float(np.max(overlays[0].measured, initial=0.0)) + (len(overlays) - 1) * apart
    axes.set_ylim(-0.15 * apart, max(len(overlays) * apart, 1.05 * highest))
    in_units(axes.yaxis, "force, shifted [N]")
    in_units(axes.xaxis, "time of the run [s]")
    legend_above(axes)


_BAND = "reference, 5 to 95 % by uncertain input"

PANELS: dict[str, tuple[float, Callable[[Axes, Document], None]]] = {
    "peaks": (3, draw_peaks),
    "differences": (2.4, draw_differences),
    "forces": (3, draw_forces),
    "map": (3.2, draw_map),
    "traces": (4.5, draw_traces),
}
"""Panels of a picture, from above: height in one of no given size [inches], what draws it."""


_KINDS = {"peaks": "peak force", "forces": "contact force", "gauges": "force on a gauge"}
_DASHES = ("-", "--", ":", "-.")

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
        drawn_by_default = [k for k in drawn_contacts(shortest, 3) if k >= first]
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
        # Runs without first pulses have no readings; a gauge without a pulse has no error.
        errors = [np.nan_to_num(read.force_error) for read in result.gauges]
        return {
            str(name).removesuffix("_N").replace("_", " "): (time, frame[name].to_numpy(),
                np.full(time.size, error))
            for name, error in zip(frame.columns[1:], errors or repeat(0.0), strict=False)
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
    low, middle, high = np.percentile(values, (5, 50, 95), axis=0)  # as a spread has them
    return x, middle, low, high


_PANEL_PAIRS = (("peaks", "differences"), ("forces", "map"))  # panels with the same axis below them


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
    shown = panels_of(document)
    if size is not None:
        check_size(size)
        shown = shown[: max(1, int(size[1] / 1.7))]  # inches: room for the labels of a panel
    heights = [PANELS[name][0] for name in shown]
    inches = (8.0, sum(heights) + 0.6) if size is None else size
    figure = Picture(inches, describe(document.native.scene))
    drawn = figure.subplots(len(shown), 1, squeeze=False, height_ratios=heights)[:, 0]
    axes = dict(zip(shown, drawn, strict=True))
    shared = [pair for pair in _PANEL_PAIRS if {*pair} <= axes.keys()]
    for above, below in shared:
        axes[above].sharex(axes[below])
    for name, panel in axes.items():
        PANELS[name][1](panel, document)
    for above, _ in shared:
        axes[above].tick_params(labelbottom=False)
        axes[above].set_xlabel("")
    return figure


def plot_tradeoff(
    tradeoff: Tradeoff, size: tuple[float, float] | None = None, title: str = ""
) -> Picture:
    """Draw error against wall time, a line for each contender, and the frontier."""
    from matplotlib import colormaps

    floor, title = tradeoff.truth_error, title or describe(tradeoff.scene)
    figure = Picture(size or (10.5, 6.5), f"What accuracy costs: {title}")
    axes = figure.subplots()
    axes.set(xscale="log", yscale="log")
    best = tradeoff.frontier
    axes.plot(
        [row.wall_time for row in best], [tradeoff.known_error(row) for row in best],
        color="#F0E442", linewidth=9, drawstyle="steps-post", solid_capstyle="round", zorder=1,
        label="cheapest at its accuracy",
    )  # fmt: skip
    markers = {engine: cycle(look[0]) for engine, look in style.WAYS.items()}
    for k, name in enumerate(dict.fromkeys(row.contender for row in tradeoff.rows)):
        curve = [row for row in tradeoff.rows if row.contender == name]
        engine = curve[0].engine
        _, line, filling = style.WAYS[engine]
        colour = colormaps["tab20"](k % 20)
        axes.plot(
            [row.wall_time for row in curve],
            [tradeoff.known_error(row) for row in curve],
            color=colour,
            marker=next(markers[engine]),
            linestyle=line,
            fillstyle=filling,
            markersize=4.5,
            linewidth=1.2,
            label=name.removesuffix(", compiled"),  # a full marker
        )
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


def plot_pulse(pulse: MeasuredPulse, size: tuple[float, float] | None = None) -> Picture:
    """Draw the recording, its baseline and the rows.

    Below is the difference of the samples from the rows.
    """
    signal, table = pulse.signal, pulse.table
    force, impulse = with_deviation(pulse.peak_force, "N"), with_deviation(pulse.impulse, "N s")
    figure = Picture(size or (8, 7), f"F0 = {force}, impulse = {impulse}")
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1.4))
    time = pulse.recording.time - signal.start
    label = f"recording, {time.size:,} samples"
    raw = {"color": "0.6", "linewidth": 0.6, "marker": ".", "markersize": 1.5}
    above.plot(time, pulse.recording.force, **raw, label=label)
    above.axhline(signal.baseline, color="#D55E00", linewidth=0.9, linestyle="--", label="baseline")
    rows = {"color": style.COLOURS["native"], "marker": "o", "markersize": 3.5, "linewidth": 1.3}
    corners = np.array(table.time)
    label = f"pulse, {corners.size} rows"
    above.plot(corners, np.array(table.force) + signal.baseline, **rows, label=label)
    off = signal.force - np.interp(signal.time, table.time, table.force)
    below.plot(signal.time, off, color="0.45", linewidth=0.6, label="samples less rows")
    for factor in (-1, 1):
        level = factor * signal.noise.deviation
        name = "noise, standard deviation" if factor > 0 else "_"  # not in the legend
        below.axhline(level, color="#D55E00", linewidth=0.9, linestyle=":", label=name)
    duration = corners[-1]
    above.set_xlim(max(time[0], -0.3 * duration), min(time[-1], 1.3 * duration))
    in_units(above.yaxis, "force, with the baseline [N]")
    in_units(below.xaxis, "time since the start of the pulse [s]")
    in_units(below.yaxis, "difference [N]")
    for axes in (above, below):
        legend_above(axes)
        axes.grid(alpha=0.25)
    return figure


_LEAST_AMPLITUDE_RATIO = 1e-5  # least amplitude that is drawn, over the largest; chosen


def plot_spectrum(spectrum: Spectrum, size: tuple[float, float] | None = None) -> Picture:
    """Draw the amplitude of each bin on a logarithmic axis, with the band edges."""
    figure = Picture(size or (7.0, 4.5))
    axes = figure.subplots()
    frequency, amplitude = spectrum.frequency[1:], spectrum.amplitude[1:]
    label = f"{place_of(spectrum)}, {WINDOW.title()} window"
    axes.semilogy(frequency, amplitude, color=style.COLOURS["native"], linewidth=0.8, label=label)
    for k, edge in enumerate(spectrum.edges):
        axes.axvline(
            edge.frequency, color=style.distinct(k + 1), linewidth=1.0,
            linestyle=("--", ":", "-.")[k], label=edge.name,
        )  # fmt: skip
    largest = float(amplitude.max())
    shown = frequency[amplitude > _LEAST_AMPLITUDE_RATIO * largest]
    ends = [1.5 * edge.frequency for edge in spectrum.edges]  # of the frequencies that are drawn
    axes.set_xlim(0, max(ends, default=float(shown[-1])))
    axes.set_ylim(_LEAST_AMPLITUDE_RATIO * largest, 2 * largest)
    in_units(axes.xaxis, "frequency [Hz]")
    axes.set_ylabel("amplitude [N]")
    axes.grid(alpha=0.25)
    legend_above(axes)
    return figure


def plot_times(scene: Scene) -> FloatArray:
    """Equally spaced times at which to record a run so that its wave can be drawn [s]."""
    # A wave's time goes as its force to the power -1/6.
    wave_time = float(scene.units.time * force_scale(scene.momentum_ratio) ** (-1 / 6))
    # In the wave's units of time: at 0.4 a map shows 95 % of each peak; with a thousand times a
    # curve across a page has no visible corners (chosen).
    wanted = max(int(np.ceil(scene.end_time / (0.2 * wave_time))) + 1, 1000)
    # Times and granules recorded at once: 100 MB for each simulation
    count = max(2, min(wanted, 4_000_000 // scene.chain.granules))
    return np.linspace(0.0, scene.end_time, count)


def drawn_contacts(result: Result, most: int) -> list[int]:
    """Return numbers of contacts to draw, closer together near the shock."""
    time = recorded(result).time
    pressed = result.contact[(result.peak_time > time[0]) & (result.peak_time < time[-1])]
    if pressed.size <= most:  # the first contacts, if the wave has passed none
        return [int(contact) for contact in pressed] or [2]
    wanted = np.geomspace(pressed[0], pressed[-1], most)
    nearest = np.argmin(np.abs(np.log(pressed[:, None] / wanted)), axis=0)
    return [int(contact) for contact in np.unique(pressed[nearest])]


def with_peak(result: Result, contact: int) -> tuple[FloatArray, FloatArray]:
    """Times [s] and contact forces [N] of a contact, with its peak if it lies between them."""
    time, force = recorded(result).time, result.force_at(contact)
    peak_time = result.peak_time[result.scene.contacts.index(contact)]
    if not time[0] < peak_time < time[-1] or peak_time in time:
        return time, force
    at = int(np.searchsorted(time, peak_time))
    return np.insert(time, at, peak_time), np.insert(force, at, result.peak_at(contact))


def while_moving(time: FloatArray, off: FloatArray) -> tuple[float, float]:
    """Return start and end of changing forces [s], by their change at each time, with room."""
    # Change of a force over the largest that is too small to be visible; room before and after the
    # motion, over its duration (both chosen)
    at = np.flatnonzero(off > 0.01 * np.max(off))
    if not at.size:
        return float(time[0]), float(time[-1])
    begin, end = time[max(at[0] - 1, 0)], time[min(at[-1] + 1, time.size - 1)]
    room = 0.03 * (end - begin)
    return float(max(begin - room, time[0])), float(min(end + room, time[-1]))
