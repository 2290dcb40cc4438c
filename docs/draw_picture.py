"""The picture of the README: contact force over time along the chain, and the verdict.

Native draws the lines and LAMMPS the dots; the table has the checks of ``hertzchain compare`` on
the same scene. ``make picture`` writes it to docs/picture.svg.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import hertzchain as hc
from hertzchain.observables.result import Result
from hertzchain.verdict.check import Check
from hertzchain.verdict.comparison import Comparison

SCENE = Path(__file__).parents[1] / "validation" / "scenes" / "demo.toml"

CONTACTS = range(2, 60, 4)
"""Contacts that are drawn, by the paper's numbers: 2, 6, ..., 58."""

HEIGHT = 8.0
"""Height of a pulse of F0 in the picture [contacts], chosen: ridges overlap, peaks stay apart."""

TIMES = 801
"""Recorded times, chosen: 40 while the wave passes a contact."""

DOTS = 4
"""Every so many recorded times there is a dot of LAMMPS."""

NOTHING = 0.02
"""Force over F0 below which a ridge is not drawn, chosen: as thin as its line."""

CHECKS = {
    "native": ("momentum", "energy", "error of the reference"),
    "lammps": (
        "mass",
        "stiffness of the contacts",
        "applied force",
        "peaks, same steps",
        "peaks against the reference",
    ),
}
"""Names of the checks in the table, without their units, by engine."""

_NAMES = {"native": "native", "lammps": "LAMMPS"}
_GREEN, _RED, _GREY = "#00735c", "#b3261e", "#5f6368"


def draw(scene: hc.Scene) -> Figure:
    """Run a scene by native and LAMMPS, compare them, and draw both."""
    times = np.linspace(0.0, scene.end_time, TIMES)
    native, lammps = hc.Native().run(scene, record=times), hc.Lammps().run(scene, record=times)
    figure = Figure(figsize=(10, 4.9), layout="constrained", dpi=100)
    waves, table = figure.subplots(1, 2, width_ratios=[1.45, 1])
    _draw_waves(waves, native, lammps)
    _draw_table(table, hc.compare(scene))
    return figure


def _draw_waves(axes: Axes, native: Result, lammps: Result) -> None:
    """A ridge for each drawn contact, its base line at the number of the contact."""
    assert native.history is not None
    assert lammps.history is not None
    peak_force, last = native.scene.peak_force, CONTACTS[-1]
    colours = mpl.colormaps["viridis"](np.linspace(0.05, 0.8, len(CONTACTS)))
    time = 1e3 * native.history.time
    lines = []
    for contact, colour in zip(CONTACTS, colours, strict=True):
        force = native.history.contact_force[:, contact - 2] / peak_force
        other = lammps.history.contact_force[:, contact - 2] / peak_force
        shown = np.convolve(force > NOTHING, [1, 1, 1], "same") > 0
        height = np.where(shown, contact + HEIGHT * force, np.nan)
        order = 2.0 * (last - contact + 1)
        look: dict[str, Any] = {"facecolor": colour, "alpha": 0.3, "linewidth": 0}
        axes.axhline(contact, color="#d0d0d0", linewidth=0.5, zorder=1)
        axes.fill_between(time, contact, height, zorder=order, **look)
        lines += axes.plot(time, height, color=colour, linewidth=1.3, zorder=order + 1)
        dots = shown & (np.arange(time.size) % DOTS == 0)
        dotted = axes.plot(
            time[dots], contact + HEIGHT * other[dots], ".", color="black", markersize=3,
            zorder=2.0 * last + 4,
        )  # fmt: skip
    axes.set(xlim=(0, 0.97), ylim=(0, last + 1.8 * HEIGHT), xlabel="time [ms]", ylabel="contact")
    axes.set_yticks(CONTACTS[::2])
    axes.set_title("Contact force over time along the chain", loc="left", fontsize=11)
    axes.legend(
        [lines[len(lines) // 2], dotted[0]], ["native", "LAMMPS"], loc="lower right", frameon=False
    )
    axes.spines[["top", "right"]].set_visible(False)
    _scale_bar(axes, 0.045, last + 2.0, peak_force)


def _scale_bar(axes: Axes, time: float, base: float, peak_force: float) -> None:
    """A bar as high as a pulse of F0."""
    axes.plot([time, time], [base, base + HEIGHT], color="black", linewidth=1.5)
    axes.text(time + 0.015, base + HEIGHT / 2, f"{peak_force:g} N", va="center")


def _draw_table(axes: Axes, comparison: Comparison) -> None:
    """The scene, the checks with what each allows, and the verdict."""
    axes.set_axis_off()
    axes.set(xlim=(0, 1), ylim=(0, 1))
    scene, p = comparison.scene, comparison.native.transition_granules
    wave = comparison.native.solitary_wave
    axes.set_title(
        f"{scene.chain.granules} steel spheres, {scene.peak_force:g} N", loc="left", fontsize=11
    )
    axes.text(0, 0.955, f"a solitary wave of {wave.peak_force:.2f} N after {p} granules", va="top")
    axes.text(0.78, 0.87, "off by", ha="right", va="top", color=_GREY)
    axes.text(1.0, 0.87, "allowed", ha="right", va="top", color=_GREY)
    height = 0.87
    for engine, names in CHECKS.items():
        axes.text(0, height, _NAMES[engine], va="top", weight="bold")
        for name in names:
            height -= 0.067
            _draw_check(axes, height, name, _the_check(comparison, engine, name))
        height -= 0.083
    colour = _GREEN if comparison.verdict == "pass" else _RED
    axes.text(
        0.5, 0.065, f"Verdict: {comparison.verdict}", ha="center", va="center", fontsize=17,
        weight="bold", color="white",
        bbox={"boxstyle": "round,pad=0.45", "facecolor": colour, "linewidth": 0},
    )  # fmt: skip


def _the_check(comparison: Comparison, engine: str, name: str) -> Check:
    """The one check of an engine with a name, its unit aside."""
    (matching,) = (
        check
        for check in comparison.checks
        if check.engine == engine and check.kind.name.partition(" [")[0] == name
    )
    return matching


def _draw_check(axes: Axes, height: float, name: str, check: Check) -> None:
    """One line of the table; differences are fractions of what is expected."""
    axes.text(
        0.03, height, "✓" if check.passed else "✗", va="top", weight="bold",
        color=_GREEN if check.passed else _RED,
    )  # fmt: skip
    axes.text(0.09, height, name, va="top", fontsize=9.5)
    assert check.measured is not None
    assert check.expected is not None
    assert check.tolerance is not None
    scale = abs(check.expected) or 1.0
    off, allowed = abs(check.measured - check.expected) / scale, check.tolerance / scale
    for right, value in ((0.78, off), (1.0, allowed)):
        text = f"{value:.0e}" if value else "0"
        axes.text(right, height, text, ha="right", va="top", fontsize=9.5, family="monospace")


def main() -> None:
    """Draw the demo scene."""
    parser = argparse.ArgumentParser(description="Draw the picture of the README.")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/picture.svg"))
    output = parser.parse_args().output
    # The same numbers give the same file.
    with mpl.rc_context({"svg.hashsalt": "hertzchain"}):
        metadata = {"Date": None} if output.suffix == ".svg" else None
        draw(hc.Scene.from_toml(SCENE)).savefig(output, metadata=metadata, dpi=200)


if __name__ == "__main__":
    main()
