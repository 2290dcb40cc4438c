"""A run as a picture: peaks along the chain, forces over time, and both as a map."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.files import write_with
from hertzchain.observables.result import Result
from hertzchain.report import style
from hertzchain.report.facts import describe, time_unit
from hertzchain.report.motion import recorded
from hertzchain.report.trajectory import frame_times
from hertzchain.report.waterfall import READINGS, wave_time, with_peak
from hertzchain.scene.scene import Scene

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from hertzchain.report.picture import Picture

_CURVES = 6  # contacts whose force over time is drawn, by default
_MARKED = 80  # contacts up to which each peak has a marker; more would melt into a band
_NAMED = 12  # curves that a legend names without covering them; more have a colour bar
_LIGHTEST = 0.9  # shade of a curve; the last tenth of the colours is too light on white
_EVEN = 0.2  # wave's units of time between recorded times by default: half of what is close
_CLOSE = 0.4  # and at most, for a map that shows 95 % of each peak: measured on the demo scene


def plotted_contacts(scene: Scene) -> list[int]:
    """The contacts whose force over time is drawn by default, closer at the shock."""
    wanted = np.geomspace(2, scene.chain.granules, _CURVES)
    return [int(contact) for contact in np.unique(np.rint(wanted))]


def plot_times(scene: Scene) -> FloatArray:
    """Equally spaced times at which to record a run so that its wave can be drawn [s]."""
    wanted = int(np.ceil(scene.end_time / (_EVEN * wave_time(scene)))) + 1
    return frame_times(scene, int(np.clip(wanted, 2, max(2, READINGS // scene.chain.granules))))


def coarse_times(result: Result) -> str | None:
    """A sentence where recorded times are too far apart to draw the wave, else None."""
    time = recorded(result).time
    unit = wave_time(result.scene)
    step = float(np.max(np.diff(time)))
    if step <= _CLOSE * unit:
        return None
    enough = int(np.ceil(result.scene.end_time / (_CLOSE * unit))) + 1
    return (
        f"recorded times are {step:.2g} s apart, which cuts the tops of the wave off: --record"
        f" {enough} shows it"
    )


def run_figure(result: Result, contacts: Sequence[int] | None = None) -> Picture:
    """Draw the peaks of a run and, where it was recorded, forces over time and a map of them.

    ``contacts`` are those whose force over time is drawn.
    """
    from hertzchain.report.picture import Picture

    if result.history is None:
        figure = Picture(figsize=(8, 4), layout="constrained", dpi=150)
        figure.suptitle(_title(result), fontsize=10)
        _draw_peaks(figure.subplots(), result)
        return figure
    figure = Picture(figsize=(8, 10), layout="constrained", dpi=150)
    peaks, forces, space_time = figure.subplots(3, 1, height_ratios=(2.4, 2.8, 3))
    forces.sharex(space_time)
    figure.suptitle(_title(result), fontsize=10)
    _draw_peaks(peaks, result)
    name, unit = time_unit(result.scene.end_time)
    _draw_forces(forces, result, contacts or plotted_contacts(result.scene), unit)
    _draw_map(space_time, result, unit)
    space_time.set_xlabel(f"time [{name}]")
    forces.tick_params(labelbottom=False)
    return figure


def _title(result: Result) -> str:
    by = f"{result.backend}, {result.method}, peaks within {result.error_estimate:.1e}"
    return f"{describe(result.scene)}\n{by}"


def plot_run(result: Result, path: Path | str, contacts: Sequence[int] | None = None) -> None:
    """Draw a run in the format of the suffix, whole or not at all."""
    write_with(path, run_figure(result, contacts).savefig)


def _draw_peaks(axes: Axes, result: Result) -> None:
    from matplotlib.ticker import MaxNLocator

    marker = style.MARKERS["native"] if result.contact.size <= _MARKED else ""
    colour = style.COLOURS.get(result.backend, style.COLOURS["native"])
    contact, peaks = result.contact, result.peak_force
    axes.plot(contact, peaks, marker=marker, color=colour, markersize=3.5, linewidth=1.0)
    static = result.static_force
    if static is not None:
        axes.plot(contact, static, color="0.5", linewidth=1.0, label="static force")
    if result.scene.wall is not None:
        axes.plot(contact[-1:], peaks[-1:], "s", color=colour, fillstyle="none", label="wall")
    if len(axes.lines) > 1:
        axes.legend(fontsize=8)
    p = result.transition_granules
    if p is not None:
        axes.axvline(p, color="0.6", linewidth=0.8)
        place = ("data", "axes fraction")
        axes.annotate(f"p = {p}", (p, 0.04), (4, 0), place, "offset points", color="0.35")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set(xlabel="contact (i lies between granules i - 1 and i)", ylabel="peak force [N]")
    axes.set_xlim(1, contact[-1] + 1)
    axes.set_ylim(*style.peak_limits(result))
    axes.grid(alpha=0.25)


def _draw_forces(axes: Axes, result: Result, contacts: Sequence[int], unit: float) -> None:
    """Contact forces over time, each with its exact peak, and the applied force."""
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import ListedColormap, Normalize

    history = recorded(result)
    if result.scene.ramps:
        applied, label = result.scene.applied_force(history.time), "applied force"
        load = result.scene.precompression
        if load is not None and load.force:
            applied, label = applied + load.force, "applied and static force"
        axes.plot(history.time / unit, applied, "--", color="0.6", label=label)
    shades = ListedColormap(colormaps["viridis"](np.linspace(0, _LIGHTEST, 256)))
    few = len(contacts) <= _NAMED
    ends = (0, max(len(contacts) - 1, 1)) if few else (min(contacts), max(contacts))
    spread = Normalize(*ends)
    for k, contact in enumerate(contacts):
        time, force = with_peak(result, contact)
        label = result.scene.contact_name(contact)
        shade = shades(spread(k if few else contact))
        axes.plot(time / unit, force, color=shade, linewidth=1.2, label=label)
    drawn = np.concatenate([np.asarray(line.get_ydata(), np.float64) for line in axes.lines])
    axes.set_ylim(*style.force_limits(float(np.min(drawn)), float(np.max(drawn))))
    axes.set_ylabel("contact force [N]")
    axes.grid(alpha=0.25)
    if few:
        axes.legend(
            fontsize=8,
            ncols=7,
            columnspacing=1.2,
            handlelength=1.5,
            loc="lower center",
            bbox_to_anchor=(0.5, 1.0),
            frameon=False,
        )
    else:
        if result.scene.ramps:
            axes.legend(handles=axes.lines[:1], fontsize=8)
        shown = ScalarMappable(spread, shades)
        axes.figure.colorbar(shown, ax=axes, label="contact", location="top", aspect=60)


def _draw_map(axes: Axes, result: Result, unit: float) -> None:
    """Contact force of all contacts over time."""
    from matplotlib.ticker import MaxNLocator

    history = recorded(result)
    shown = axes.pcolormesh(
        history.time / unit,
        result.contact,
        history.contact_force.T,
        cmap=style.force_colours(),
        shading="nearest",
        rasterized=True,
    )
    axes.figure.colorbar(
        shown, ax=axes, label="contact force [N]", location="bottom", aspect=60, pad=0.02
    )
    axes.set_ylabel("contact")
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_xlim(history.time[0] / unit, history.time[-1] / unit)
