"""The figure of a run: its peaks along the chain and, where it was recorded, force over time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hertzchain.observables.result import Result
from hertzchain.report.facts import describe
from hertzchain.report.picture import Picture
from hertzchain.report.style import COLOURS, LABELS, MARKERS
from hertzchain.report.waterfall import drawn_contacts, time_unit, with_peak

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_CURVES = 6  # contacts whose force over time is drawn: more curves hide one another (chosen)
_MOST_MARKED = 100  # peaks that are marked one by one (chosen)


def figure_of_run(result: Result) -> Picture:
    """Draw peak force over contact; below it force over time, if it was recorded."""
    from matplotlib.ticker import MaxNLocator

    curves = drawn_contacts(result)
    figure = Picture(figsize=(8, 7 if curves else 4), layout="constrained", dpi=120)
    axes = figure.subplots(2 if curves else 1, 1, squeeze=False)[:, 0]
    look = {"color": COLOURS[result.backend], "marker": "", "linewidth": 1.2}
    if result.contact.size <= _MOST_MARKED:
        look |= {"marker": MARKERS[result.backend], "markersize": 5, "fillstyle": "none"}
    label = f"{LABELS[result.backend]}, error at most {result.error_estimate:.1e}"
    axes[0].plot(result.contact, result.peak_force, label=label, **look)
    if result.static_force is not None:
        axes[0].plot(result.contact, result.static_force, "--", color="0.5", label="static load")
    p = result.transition_granules
    if p is not None:
        axes[0].axvline(p, color="0.6", linewidth=0.8, label=f"p = {p}")
    axes[0].set_title(describe(result.scene), fontsize=10)
    axes[0].set(ylabel="peak force [N]", ylim=(0, None))
    axes[0].set_xlabel("contact (i lies between granules i - 1 and i)")
    axes[0].xaxis.set_major_locator(MaxNLocator(integer=True, steps=[1, 2, 5, 10]))
    if curves:
        _draw_forces(axes[1], result, curves)
    for one in axes:
        one.legend(fontsize=8)
        one.grid(alpha=0.25)
    return figure


def _draw_forces(axes: Axes, result: Result, contacts: list[int]) -> None:
    """Draw force over time of a few contacts from the first to the last, and their exact peaks."""
    from matplotlib import colormaps

    chosen = np.unique(np.linspace(0, len(contacts) - 1, _CURVES).astype(int))
    unit_name, unit = time_unit(result.scene.end_time)
    shades = colormaps["viridis"](np.linspace(0, 0.88, chosen.size))
    for shade, contact in zip(shades, (contacts[k] for k in chosen), strict=True):
        time, force = with_peak(result, contact)
        axes.plot(time / unit, force, color=shade, label=f"contact {contact}")
        peak = result.peak_time[contact - 2] / unit, result.peak_force[contact - 2]
        axes.plot(*peak, "o", color=shade, markersize=4)
    axes.set(xlabel=f"time [{unit_name}]", ylabel="contact force [N]")
