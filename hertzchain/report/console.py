"""Runs, predictions and verdicts as text for a terminal."""

from __future__ import annotations

import io
import re
import textwrap
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from rich.table import Table
from rich.text import Text

from hertzchain.observables.result import Result
from hertzchain.report.document import Document
from hertzchain.report.facts import (
    cost,
    describe,
    difference,
    facts_of_terms,
    known_digits,
    number,
    shown_contacts,
    similar_scene,
    with_unit,
)
from hertzchain.theory import Prediction, peak_map
from hertzchain.theory.prediction import constants

if TYPE_CHECKING:
    from rich.console import Console

# characters between cells
_STYLES = {"pass": "green", "FAIL": "red", "not judged": "dim", "not given": "dim"}


def table(
    header: Iterable[str], rows: Iterable[Sequence[str | Text]], left: Sequence[str] = ()
) -> Table:
    """Return a table of numbers, with text in the columns named in ``left``."""
    drawn = Table(box=None, header_style="bold")
    for column in header:
        drawn.add_column(column, justify="left" if column in left else "right")
    for row in rows:
        drawn.add_row(*row)
    return drawn


# Commands within sentences, which are for copying.
_COMMAND = re.compile(
    r"`[^`]+`|pip install ('[^']+'|\"[^\"]+\"|\S+)"
    r"|hertzchain [a-z]+( (SCENE|DECK|FILE|--[\w-]+|[\w./-]+\.\w+))*"
)
_KEPT = "\N{NO-BREAK SPACE}"  # stands for the spaces of a command while lines are broken


def print_prose(console: Console, text: str, label: str = "", style: str = "") -> None:
    """Print a sentence, after a label in a style, in lines that end between words.

    No line ends within a command, even where that makes it longer than the terminal.
    """
    kept = _COMMAND.sub(lambda found: found[0].replace(" ", _KEPT), label + text)
    lines = textwrap.fill(kept, console.width, break_long_words=False, break_on_hyphens=False)
    shown = Text(lines.replace(_KEPT, " "))
    shown.stylize(style, 0, len(label))
    console.print(shown, soft_wrap=True)


def plain_text(show: Callable[[Console], object], width: int = 120) -> str:
    """Return the text that a function prints on a console, without colours."""
    from rich.console import Console

    text = io.StringIO()
    show(Console(file=text, width=width, color_system=None, highlight=False, markup=False))
    return "\n".join(line.rstrip() for line in text.getvalue().splitlines())


def print_run(
    console: Console, result: Result, others: str = "shown by --all", every: bool = False
) -> None:
    """Print the main results of a run: peaks of the transition, p, F_SW, speed, error, cost.

    ``others`` says where the peaks of all other contacts are; ``every``: all are printed.
    """
    console.print(describe(result.scene), style="bold")
    shown = result.contact.tolist() if every else shown_contacts(result)
    static = result.static_force
    first = result.first_pulses
    rows = [
        (
            result.scene.contact_label(contact),
            known_digits(result.peak_force[k], result.peak_errors[k]),
            *(() if static is None else (number(static[k], 7),)),
            number(result.peak_time[k], 6),
            *(() if first is None else _first_pulse(result, k)),
            "" if result.peak_passed[k] else "not peaked yet",
        )
        for k, contact in enumerate(shown)
    ]
    header = ["contact", "peak force [N]", "peak time [s]", ""]
    if first is not None:
        header[3:3] = ["first pulse [N]", "arrival [s]", "width [s]"]
    if static is not None:
        header.insert(2, "static force [N]")
    console.print(table(header, rows))
    print_left_out(console, result.contact.size - len(shown), result.contact[-1], others)
    facts = [
        *(wave_facts(result) if result.scene.is_plain else facts_of_terms(result)),
        *_facts_of_wave(result),
        *_facts_of_gauges(result),
        ("error of the peaks, at most", f"{result.error_estimate:.1e}"),
        *_first_facts(result),
        ("largest overlap", f"{result.overlap_ratio:.2g} radii"),
        ("largest pressure", largest_pressure(result)),
        ("cost", cost(result)),
    ]
    if (similar := similar_scene(result)) is not None:
        facts.append(("computed as", similar))
    print_facts(console, facts)
    _print_remarks(console, *result.warnings)


def largest_pressure(result: Result) -> str:
    """Return the largest pressure, where it is, and the strength below which a metal yields."""
    found = result.largest_pressure
    if found.time is None:
        return "0 Pa: no contact was pressed"
    return (
        f"{found.pressure:.3g} Pa, {result.scene.contact_name(found.contact)} at"
        f" {found.time:.3g} s; metals of yield strength < {found.needed_strength:.3g} Pa yield"
    )


def _first_pulse(result: Result, k: int) -> tuple[str, str, str]:
    """Return force, arrival and width of the first pulse of a contact; empty where it has none."""
    known = result.first_columns
    if np.isnan(known["first_peak_force_N"][k]):
        return "", "", ""
    width = known["first_width_s"][k]
    return (
        known_digits(known["first_peak_force_N"][k], known["first_peak_error"][k]),
        number(known["arrival_time_s"][k], 6),
        "" if np.isnan(width) else number(width, 6),
    )


def _first_facts(result: Result) -> list[tuple[str, str]]:
    """Return the largest errors of first pulses; nothing where they were not asked for."""
    known = result.first_columns
    if not known or not np.isfinite(known["first_peak_error"]).any():
        return []
    force, arrival = (np.nanmax(known[key]) for key in ("first_peak_error", "arrival_error_s"))
    return [
        ("error of first pulses, at most", f"{force:.1e}"),
        ("error of arrivals, at most", with_unit(float(arrival), "s", 0.1)),
    ]


def _facts_of_gauges(result: Result) -> list[tuple[str, str]]:
    """Return the first pulse of each gauge."""
    facts = []
    for read in result.gauges:
        said = "no first pulse that is known to its end"
        if np.isfinite(read.force):
            force = known_digits(read.force, read.force_error)
            arrival = known_digits(read.arrival, read.arrival_error / read.arrival)
            width = "unknown"
            if np.isfinite(read.width):
                width = f"{known_digits(read.width, read.width_error / read.width)} s"
            said = f"{force} N, arrival {arrival} s, width {width}"
        facts.append((f"gauge, {read.gauge.key} {read.gauge.number}", said))
    return facts


def _facts_of_wave(result: Result) -> list[tuple[str, str]]:
    """Return speed, height and width of the wave by first pulses; nothing where there is none."""
    wave = result.usual_wave
    if wave is None:
        return []
    speed = known_digits(wave.speed, wave.speed_error)
    height = known_digits(wave.height, wave.height_error)
    width = "unknown"
    if np.isfinite(wave.width):
        width = f"{known_digits(wave.width, wave.width_error)} s"
    if np.isfinite(wave.width) and "unlike granules" not in result.scene.terms:
        width += f", {wave.width_granules:.3g} granules"
    return [
        (f"speed, contacts {wave.first} to {wave.last}", f"{speed} m/s"),
        (f"height and width, contact {wave.last}", f"{height} N, {width}"),
    ]


def wave_facts(result: Result) -> list[tuple[str, str]]:
    """Return the facts of a plain scene: the transition and the wave after it."""
    wave, p, known = result.solitary_wave, result.transition_granules, result.error_estimate
    return [
        ("transition, p", "none ends here" if p is None else f"{p} granules"),
        ("solitary wave, F_SW", with_unit(wave.peak_force, "N", known)),
        ("far-field force", _settled(wave.far_field_force, "N", wave.far_field_error, known)),
        ("speed", _settled(wave.speed, "m/s", wave.speed_error, known)),
    ]


def _settled(value: float | None, unit: str, error: float | None, known: float) -> str:
    """Return words for a number of the wave, and its largest difference from the settled wave."""
    if error is None:
        return with_unit(value, unit, known)
    if value is None:
        return f"not reached: the wave may change by {error:.0%} in a longer chain"
    return f"{with_unit(value, unit, max(known, error))}, settled to {error:.1e}"


def print_prediction(console: Console, prediction: Prediction) -> None:
    """Print a prediction without a simulation, with its errors."""
    console.print(describe(prediction.scene), style="bold")
    known = [row for row in prediction.rows if row["map_N"] is not None]
    if known:
        console.print("\nPeak force of each contact [N]; then the difference from the map")
        p = prediction.transition_granules
        shown = known[:10] if p is None else known[:p]
        rows = []
        for row in shown:
            peak, others = row["map_N"], (row["eq6_N"], row["eq9_N"])
            assert peak is not None
            rows.append(
                (
                    str(row["contact"]),
                    number(peak, 5),
                    *(number(value, 5) for value in others),
                    *("" if value is None else f"{value / peak - 1:+.1%}" for value in others),
                )
            )
        console.print(table(("contact", "map", *("Eq. 6", "Eq. 9") * 2), rows))
        print_left_out(console, len(known) - len(shown), known[-1]["contact"])
        print_facts(console, _predicted_facts(prediction))
    if prediction.scene.pulse is not None and prediction.scene.is_plain:
        console.print()
        rows = [
            (one.name, f"{one.paper:.6f}", f"{one.exact:.6f}", f"{one.difference:+.2%}")
            for one in constants()
        ]
        header = ("constant", "paper", "exact", "difference")
        console.print(table(header, rows, left=("constant",)))
    _print_remarks(console, prediction.missing, prediction.note, *prediction.warnings)


def _predicted_facts(prediction: Prediction) -> list[tuple[str, str]]:
    """Return label and value of each predicted quantity except the peaks."""
    error = peak_map.PEAK_ERROR, peak_map.FAR_FIELD_ERROR
    p = prediction.transition_granules
    known = [str(candidate) for candidate in prediction.candidates if candidate is not None]
    possible = [f"{' or '.join(known)} granules"] if known else []
    if None in prediction.candidates:
        possible.append("none ends here")
    chosen = f"; F_SW and the equations are with {p}" if len(known) > 1 else ""
    facts = [
        ("transition, p", " or ".join(possible) + chosen),
        ("far-field force", with_unit(prediction.far_field_force, "N")),
        ("error, at most", f"peaks {error[0]:.0%}, far field {error[1]:.0e}"),
    ]
    if p is None:
        return facts
    facts[1:1] = [
        ("p of Eq. 3", f"{prediction.eq3:.2f}"),
        ("solitary wave, F_SW", number(prediction.wave_force, 5) + " N"),
    ]
    for label, unit, estimate in (
        ("speed, V_SW", "m/s", prediction.speed),
        ("momentum, L_SW", "N s", prediction.momentum),
    ):
        assert estimate is not None
        at_f_sw = f"paper {estimate.paper:.5g}, exact {estimate.exact:.5g} at F_SW"
        far = f"far field {estimate.far_field:.5g} {unit}: {estimate.closer} is closer"
        facts.append((label, f"{at_f_sw}; {far}"))
    return facts


def print_document(
    console: Console, document: Document, others: str | None = None, every: bool = False
) -> None:
    """Print the peaks of the transition, the checks, the verdict, and where to find the rest.

    ``others`` says where the peaks of all other contacts are; ``every``: all are printed.
    """
    native, peaks = document.native, document.peaks
    console.print(describe(native.scene), style="bold", end="\n\n")
    console.print(peaks.heading)
    rows = [
        [Text(cell, _STYLES[cell]) if cell in _STYLES else cell for cell in peaks.row(k)]
        for k in (range(native.contact.size) if every else peaks.shown)
    ]
    console.print(table((label for label, _ in peaks.columns), rows))
    has_all = "shown by --all" if document.command == "compare" else "shown by --json"
    print_left_out(console, native.contact.size - len(rows), native.contact[-1], others or has_all)
    console.print()
    answers = document.answers
    if answers is not None:
        console.print(table(answers.header, [*answers.rows, *document.efforts], left=("",)))
    if document.facts:
        print_facts(console, document.facts)
    for remark in (*document.formulas, *document.similar):
        print_prose(console, f"{remark}.")
    if document.findings:
        _print_findings(console, document)
    if document.cause is not None:
        console.print()
        print_prose(console, f"Likely cause: {document.cause}.")
    _print_remarks(console, document.hint, *document.remarks, *native.warnings)
    if document.checks:
        _print_checks(console, document)
    passed = bool(document.verdict.passed)
    word = Text("pass" if passed else "fail", "bold green" if passed else "bold red")
    console.print("\nVerdict:", word)


def _print_findings(console: Console, document: Document) -> None:
    """Print the differences in a user's deck, in the order in which to mend them."""
    number = 0
    for one in document.findings:
        number += not one.passed
        head = Text(f"\n{number}. ", "red") if not one.passed else Text("\n   small: ", "dim")
        for sentence in one.sentences:
            console.print(head + Text(sentence, ""))
            head = Text("   ")
        shown = [place for place, _, _ in one.right]
        # Commands are for copying: they are never broken.
        if one.place and one.place not in shown[:1]:
            console.print(Text(f"   {one.place}: {one.written}"), soft_wrap=True)
        for place, written, commands in one.right:
            console.print(Text(f"   {place}: {written}"), soft_wrap=True)
            for command in commands:
                console.print(Text(f"   right: {command}"), soft_wrap=True)
        if one.note:
            console.print(Text(f"   {one.note}"))


def _print_checks(console: Console, document: Document) -> None:
    checks = document.checks
    words = ["pass" if check.passed else "FAIL" for check in checks]
    rows = [
        (check.name, *difference(check), Text(word, _STYLES[word]))
        for check, word in zip(checks, words, strict=True)
    ]
    console.print()
    console.print(table(("check", "difference", "tolerance", ""), rows, left=("check", "")))
    for check in checks:
        if not check.passed:
            why = check.reason if check.measured is None else f"out of tolerance ({check.reason})"
            print_prose(console, f": {why}", check.name, "red")
    for check in checks:
        if check.remark:
            print_prose(console, f"{check.name}: {check.remark}.")


def print_left_out(
    console: Console, left: int, last: float | None, others: str = "shown by --json"
) -> None:
    """Print how many contacts are not shown, if any, and where they are."""
    if left:
        more = "1 more contact is" if left == 1 else f"{left} more contacts, up to {last}, are"
        console.print(f"({more} {others})", style="dim")


def print_facts(console: Console, facts: Iterable[tuple[str, str]]) -> None:
    """Print labels and texts side by side."""
    facts_table = Table(box=None, show_header=False)
    for fact in facts:
        facts_table.add_row(*fact)
    console.print(facts_table)


def _print_remarks(console: Console, *remarks: str | None) -> None:
    for remark in remarks:
        if remark:
            console.print()
            print_prose(console, f"{_capitalised(remark)}.")


def _capitalised(remark: str) -> str:
    """A sentence with a capital; the name of a file in front of it stays as it is."""
    word = remark.split(maxsplit=1)[0].rstrip(",:;").replace("-", "")
    return remark[0].upper() + remark[1:] if word.isalpha() else remark
