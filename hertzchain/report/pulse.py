"""A measured pulse as text for a terminal, and as a plot."""

from __future__ import annotations

from math import floor, log10
from typing import TYPE_CHECKING

import numpy as np

from hertzchain.pulses.pulse import MeasuredPulse, Value
from hertzchain.report import style
from hertzchain.report.console import print_facts

if TYPE_CHECKING:
    from rich.console import Console

    from hertzchain.report.picture import Picture


def print_pulse(console: Console, pulse: MeasuredPulse) -> None:
    """Print the layout of a recording, the changes made to it, and the numbers of the pulse."""
    signal = pulse.signal
    before, after = (impulse / pulse.impulse.value for impulse in signal.left_out)
    start = signal.start + 0.0  # no negative zero
    end = start + pulse.table.time[-1]
    rows = f"{signal.time.size:,} before, {len(pulse.table.time):,} now"
    facts = [
        *pulse.recording.facts,
        *signal.remarks,
        ("pulse", f"from {start:.6g} s to {end:.6g} s of the file; its start is now 0"),
        ("impulse left out", f"{before:.2%} before the pulse, {after:.2%} after it"),
        ("rows", f"{rows}; but for noise the force is off by {pulse.bend:.2g} N at most"),
        ("F0", _with_deviation(pulse.peak_force, "N")),
        ("impulse", _with_deviation(pulse.impulse, "N s")),
        ("rise time, 10 % to 90 %", f"{pulse.rise_time:.3g} s"),
    ]
    print_facts(console, facts)
    console.print("± is one standard deviation, of noise, baseline and the lines between rows.")


def _with_deviation(value: Value, unit: str) -> str:
    """Return a value with its standard deviation, both to the second digit of the deviation."""
    if value.deviation == 0:
        return f"{value.value:.6g} {unit}"
    if value.deviation >= abs(value.value):
        return f"{value.value:.6g} ± {value.deviation:.2g} {unit}"
    digits = floor(log10(abs(value.value))) - floor(log10(value.deviation)) + 2
    shown = f"{value.value:#.{min(digits, 9)}g}".rstrip(".")
    deviation = f"{value.deviation:#.2g}".rstrip(".")
    return f"{shown} ± {deviation} {unit}"


def plot_pulse(pulse: MeasuredPulse, size: tuple[float, float] | None = None) -> Picture:
    """Draw the recording, its baseline and the rows.

    Below is the difference of the samples from the rows.
    """
    from hertzchain.report.picture import Picture, in_units, legend_above

    signal, table = pulse.signal, pulse.table
    force, impulse = _with_deviation(pulse.peak_force, "N"), _with_deviation(pulse.impulse, "N s")
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
