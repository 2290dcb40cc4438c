"""A measured pulse and a spectrum, as text for a terminal and as plots."""

from __future__ import annotations

from math import floor, log10
from typing import TYPE_CHECKING

import numpy as np

from hertzchain.pulses.pulse import MeasuredPulse, Value
from hertzchain.pulses.spectrum import WINDOW, Spectrum
from hertzchain.report import style
from hertzchain.report.console import print_facts
from hertzchain.report.document import describe, in_prefixed

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


_LEAST_AMPLITUDE_RATIO = 1e-5  # least amplitude that is drawn, over the largest; chosen
_DRAWN_OVER_EDGE = 1.5  # end of the drawn frequencies over the highest band edge; chosen


def print_spectrum(console: Console, spectrum: Spectrum) -> None:
    """Print the bins, the highest of them, and the band edges."""
    frequency, amplitude = spectrum.largest
    bins = f"{spectrum.frequency.size:,} of {in_prefixed(float(spectrum.frequency[1]), 'Hz')}"
    facts = [
        ("force", f"{_place(spectrum)}, without its mean"),
        ("window", f"{WINDOW.title()}, over the whole run"),
        ("bins", bins),
        ("largest amplitude", f"{amplitude:.4g} N at {in_prefixed(frequency, 'Hz')}"),
        *((edge.name, f"{edge.frequency:.6g} Hz, {edge.formula}") for edge in spectrum.edges),
    ]
    if not spectrum.edges:
        facts.append(
            ("band edges", "none: formulas are for pressed chains of one kind, or two in turn")
        )
    console.print(describe(spectrum.scene), style="bold", end="\n\n")
    print_facts(console, facts)


def _place(spectrum: Spectrum) -> str:
    """Return what a sentence calls the place of the gauge."""
    gauge = spectrum.gauge
    return gauge.place if gauge.contact is None else spectrum.scene.contact_name(gauge.contact)


def plot_spectrum(spectrum: Spectrum, size: tuple[float, float] | None = None) -> Picture:
    """Draw the amplitude of each bin on a logarithmic axis, with the band edges."""
    from hertzchain.report.picture import Picture, in_units, legend_above

    figure = Picture(size or (7.0, 4.5))
    axes = figure.subplots()
    frequency, amplitude = spectrum.frequency[1:], spectrum.amplitude[1:]
    label = f"{_place(spectrum)}, {WINDOW.title()} window"
    axes.semilogy(frequency, amplitude, color=style.COLOURS["native"], linewidth=0.8, label=label)
    for k, edge in enumerate(spectrum.edges):
        axes.axvline(
            edge.frequency, color=style.distinct(k + 1), linewidth=1.0,
            linestyle=("--", ":", "-.")[k], label=edge.name,
        )  # fmt: skip
    largest = float(amplitude.max())
    shown = frequency[amplitude > _LEAST_AMPLITUDE_RATIO * largest]
    ends = [_DRAWN_OVER_EDGE * edge.frequency for edge in spectrum.edges]
    axes.set_xlim(0, max(ends, default=float(shown[-1])))
    axes.set_ylim(_LEAST_AMPLITUDE_RATIO * largest, 2 * largest)
    in_units(axes.xaxis, "frequency [Hz]")
    axes.set_ylabel("amplitude [N]")
    axes.grid(alpha=0.25)
    legend_above(axes)
    return figure
