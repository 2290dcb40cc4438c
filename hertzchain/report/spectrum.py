"""A spectrum as text for a terminal, and as a plot."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hertzchain.pulses.spectrum import WINDOW, Spectrum
from hertzchain.report import style
from hertzchain.report.console import print_facts
from hertzchain.report.document import describe, in_prefixed

if TYPE_CHECKING:
    from rich.console import Console

    from hertzchain.report.picture import Picture

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
