"""Panels of pictures of a run or a verdict: along the chain, over time, and both as a map."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.observables.result import Result
from hertzchain.report import style
from hertzchain.report.document import Document
from hertzchain.report.picture import at_whole_numbers, in_units, legend_above
from hertzchain.report.waterfall import drawn_contacts, recorded, while_moving, with_peak

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_LONG_CHAIN_CONTACTS = 200  # from which on axes are logarithmic, points a bitmap; chosen
_DRAWN_CONTACTS = 6  # contacts whose force over time is drawn
_MOST_MARKERS = 80  # contacts up to which each peak has a marker; more would merge into a band
_LIGHTEST_SHADE = 0.9  # shade of a curve; the last tenth of the colours is too light on white


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
    marked = contact.size <= _MOST_MARKERS or bool(np.isnan(peaks).any())
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
    """Draw contact forces over time, each with its exact peak, and the applied force.

    Forces by other engines are dashed lines over those of the first.
    """
    from matplotlib import colormaps

    result = document.native
    contacts = drawn_contacts(result, _DRAWN_CONTACTS)
    history = recorded(result)
    if result.scene.ramps:
        applied, label = result.scene.applied_force(history.time), "applied force"
        load = result.scene.precompression
        if load is not None and load.force:
            applied, label = applied + load.force, "applied and static force"
        axes.plot(history.time, applied, "--", color="0.6", label=label)
    shades = colormaps["viridis"](np.linspace(0, _LIGHTEST_SHADE, len(contacts)))
    for contact, shade in zip(contacts, shades, strict=True):
        label = result.scene.contact_name(contact)
        axes.plot(*with_peak(result, contact), color=shade, linewidth=1.2, label=label)
    others = {name: other for name, other in document.results.items() if other is not result}
    for name, other in others.items():
        for contact in contacts if other.history is not None else ():
            other_label = style.LABELS[name] if contact == contacts[0] else "_"
            # Sparse dashes leave the colour of the contact visible.
            axes.plot(
                *with_peak(other, contact), color=style.COLOURS[name], linewidth=1.2,
                linestyle=(0, (2, 6)), label=other_label,
            )  # fmt: skip
    drawn = np.concatenate([np.asarray(line.get_ydata(), np.float64) for line in axes.lines])
    axes.set_ylim(*style.force_limits(float(np.min(drawn)), float(np.max(drawn))))
    axes.set_xlim(*what_happens(result, contacts))
    in_units(axes.yaxis, "contact force [N]")
    in_units(axes.xaxis, "time [s]")
    axes.grid(alpha=0.25)
    legend_above(axes)


def draw_map(axes: Axes, document: Document) -> None:
    """Draw the contact force of all contacts over time."""
    result = document.native
    history = recorded(result)
    begin, end = what_happens(result, result.contact.tolist())
    some = (history.time >= begin) & (history.time <= end)
    shown = axes.pcolormesh(
        history.time[some], result.contact, history.contact_force[some].T,
        cmap=style.force_colours(), shading="nearest", rasterized=True,
    )  # fmt: skip
    bar = axes.figure.colorbar(shown, ax=axes, location="bottom", aspect=60, pad=0.02)
    in_units(bar.ax.xaxis, "contact force [N]")
    axes.yaxis.set_major_locator(at_whole_numbers())
    axes.set_ylabel("contact")
    axes.set_xlim(begin, end)
    in_units(axes.xaxis, "time [s]")


def draw_traces(axes: Axes, document: Document) -> None:
    """Draw measured traces one below the other, with those of the reference as lines."""
    overlays = document.overlays
    apart = 1.1 * max(float(np.max(np.abs(overlay.expected))) for overlay in overlays)
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
        axes.annotate(
            overlay.label, (overlay.time[0], base), (0, 3), textcoords="offset points",
            fontsize="small",
            bbox={"facecolor": "white", "alpha": 0.8, "edgecolor": "none", "pad": 0.5},
        )  # fmt: skip
    highest = float(np.max(overlays[0].measured, initial=0.0)) + (len(overlays) - 1) * apart
    axes.set_ylim(-0.15 * apart, max(len(overlays) * apart, 1.05 * highest))
    in_units(axes.yaxis, "force, shifted [N]")
    in_units(axes.xaxis, "time of the run [s]")
    legend_above(axes)


PANELS: dict[str, tuple[float, Callable[[Axes, Document], None]]] = {
    "peaks": (3, draw_peaks),
    "differences": (2.4, draw_differences),
    "forces": (3, draw_forces),
    "map": (3.2, draw_map),
    "traces": (4.5, draw_traces),
}
"""Panels of a picture, from above: height in one of no given size [inches], what draws it."""
