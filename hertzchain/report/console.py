"""Documents as text, on a terminal or a pipe, and tables of trade-offs."""

from __future__ import annotations

import io
import re
import textwrap
from collections.abc import Callable, Iterable, Sequence
from datetime import datetime
from typing import TYPE_CHECKING

from rich.table import Table
from rich.text import Text

from hertzchain.known.certificate import WRONG, Certificate, Row
from hertzchain.report.document import (
    ERROR,
    FAILURE,
    SKIPPED,
    Case,
    Document,
    Suite,
    describe,
    difference,
    number,
    with_unit,
)
from hertzchain.theory import Prediction, peak_map

if TYPE_CHECKING:
    from rich.console import Console

    from hertzchain.verdict.tradeoff import Row as TradeoffRow
    from hertzchain.verdict.tradeoff import Tradeoff


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


# Commands within sentences, which users copy.
_COMMAND = re.compile(
    r"`[^`]+`|pip install ('[^']+'|\"[^\"]+\"|\S+)"
    r"|hertzchain [a-z]+( (SCENE|DECK|FILE|--[\w-]+|[\w./-]+\.\w+))*"
)
_NO_BREAK_SPACE = "\N{NO-BREAK SPACE}"  # stands for the spaces of a command while lines are broken


def print_prose(console: Console, text: str, label: str = "", style: str = "") -> None:
    """Print a sentence, after a label in a style, in lines that end between words.

    No line ends within a command, even where that makes it longer than the terminal.
    """
    kept = _COMMAND.sub(lambda match: match[0].replace(" ", _NO_BREAK_SPACE), label + text)
    lines = textwrap.fill(kept, console.width, break_long_words=False, break_on_hyphens=False)
    shown = Text(lines.replace(_NO_BREAK_SPACE, " "))
    shown.stylize(style, 0, len(label))
    console.print(shown, soft_wrap=True)


def plain_text(show: Callable[[Console], object], width: int = 120) -> str:
    """Return the text that a function prints on a console, without colours."""
    from rich.console import Console

    text = io.StringIO()
    show(Console(file=text, width=width, color_system=None, highlight=False, markup=False))
    return "\n".join(line.rstrip() for line in text.getvalue().splitlines())


def printed(document: Document) -> str:
    """Return what ``run`` or ``compare`` prints for a result or a verdict, without colours."""
    # The table of an examination has its checks.
    others = "in peak_force" if document.command == "examine" else "in to_frame()"
    return plain_text(lambda console: print_document(console, document, others))


def print_prediction(console: Console, prediction: Prediction) -> None:
    """Print a prediction without a simulation, with its errors."""
    console.print(describe(prediction.scene), style="bold")
    mapped_rows = [row for row in prediction.rows if row["map_N"] is not None]
    if mapped_rows:
        console.print("\nPeak force of each contact [N]; then the difference from the map")
        p = prediction.transition_granules
        shown = mapped_rows[:10] if p is None else mapped_rows[:p]
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
        print_left_out(console, len(mapped_rows) - len(shown), mapped_rows[-1]["contact"])
        print_facts(console, _predicted_facts(prediction))
    if prediction.scene.pulse is not None and prediction.constants:
        console.print()
        rows = [
            (const.name, f"{const.paper:.6f}", f"{const.exact:.6f}", f"{const.difference:+.2%}")
            for const in prediction.constants
        ]
        header = ("constant", "paper", "exact", "difference")
        console.print(table(header, rows, left=("constant",)))
    _print_remarks(console, prediction.missing, prediction.note, *prediction.warnings)


def _predicted_facts(prediction: Prediction) -> list[tuple[str, str]]:
    """Return label and value of each predicted quantity except the peaks."""
    error = peak_map.PEAK_ERROR, peak_map.FAR_FIELD_ERROR
    p = prediction.transition_granules
    candidates = [str(candidate) for candidate in prediction.candidates if candidate is not None]
    possible = [f"{' or '.join(candidates)} granules"] if candidates else []
    if None in prediction.candidates:
        possible.append("none ends here")
    chosen = f"; F_SW and the equations are with {p}" if len(candidates) > 1 else ""
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
    """Print the peaks of the transition, facts, checks, the verdict, and the place of all others.

    ``others`` says where the peaks of all other contacts are; ``every``: all are printed.
    """
    native, peaks, is_verdict = document.native, document.peaks, document.command != "run"
    console.print(describe(native.scene), style="bold")
    if is_verdict:
        console.print(f"\n{peaks.heading}")
    shown = range(native.contact.size) if every and peaks.of_contacts else peaks.shown
    rows = [
        [Text(cell, _STYLES[cell]) if cell in _STYLES else cell for cell in peaks.row(k)]
        for k in shown
    ]
    header = [label if is_verdict else f"{label} {unit}".strip() for label, unit in peaks.columns]
    console.print(table(header, rows))
    has_all = "shown by --all" if document.command in ("run", "compare") else "shown by --json"
    left = native.contact.size - len(rows) if peaks.of_contacts else 0
    print_left_out(console, left, native.contact[-1], others or has_all)
    if is_verdict and not document.tables:
        console.print()
    for extra in document.tables:
        console.print(f"\n{extra.caption}" if extra.header[0] else "")
        console.print(table(extra.header, extra.rows, left=("", "number")))
    if document.facts:
        print_facts(console, document.facts)
    if document.findings:
        _print_findings(console, document)
    _print_remarks(console, *dict.fromkeys([*document.remarks, *native.warnings]))
    if document.checks:
        _print_checks(console, document)
    if is_verdict:
        word = document.verdict.word.lower()
        console.print("\nVerdict:", Text(word, "bold green" if word == "pass" else "bold red"))


def _print_findings(console: Console, document: Document) -> None:
    """Print the differences in a user's deck, in the order in which to correct them."""
    number = 0
    for finding in document.findings:
        number += not finding.passed
        head = Text(f"\n{number}. ", "red") if not finding.passed else Text("\n   small: ", "dim")
        for sentence in finding.sentences:
            console.print(head + Text(sentence, ""))
            head = Text("   ")
        shown = [place for place, _, _ in finding.right]
        # Commands are never broken, as users copy them.
        if finding.place and finding.place not in shown[:1]:
            console.print(Text(f"   {finding.place}: {finding.written}"), soft_wrap=True)
        for place, written, commands in finding.right:
            console.print(Text(f"   {place}: {written}"), soft_wrap=True)
            for command in commands:
                console.print(Text(f"   right: {command}"), soft_wrap=True)
        if finding.note:
            console.print(Text(f"   {finding.note}"))


def _print_checks(console: Console, document: Document) -> None:
    checks = document.checks
    words = ["pass" if check.passed else "FAIL" for check in checks]
    rows = [
        (check.name, *difference(check), Text(word, _STYLES[word]))
        for check, word in zip(checks, words, strict=True)
    ]
    console.print()
    header = ("check", "difference", "tolerance", "of the tolerance", "")
    console.print(table(header, rows, left=("check", "")))
    failures: dict[str, list[str]] = {}
    for check in checks:
        if not check.passed:
            why = check.reason if check.measured is None else f"out of tolerance ({check.reason})"
            failures.setdefault(why, []).append(check.name)
    for why, names in failures.items():
        print_prose(console, f": {why}", ", ".join(names), "red")
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
    """Return a sentence with a capital; the name of a file before it is not changed."""
    word = remark.split(maxsplit=1)[0].rstrip(",:;").replace("-", "")
    return remark[0].upper() + remark[1:] if word.isalpha() else remark


_LEFT_COLUMNS = ("row", "tests", "grade")


def print_certificates(console: Console, certificates: Sequence[Certificate]) -> None:
    """Print a table for each program, with reasons below it, and one line on each at the end."""
    for certificate in certificates:
        rows = [_cells(row) for row in certificate.rows]
        could_run = not all(row.failed for row in certificate.rows)
        if could_run:
            console.print(table((*_LEFT_COLUMNS, "difference", "by steps"), rows, _LEFT_COLUMNS))
        for reason, names in _reasons(certificate).items():
            print_prose(console, f"{', '.join(names)}: {reason}" if could_run else reason)
        console.print()
    for certificate in certificates:
        console.print(certificate.sentence, soft_wrap=True)  # one line, for programs that read it


def suite(certificate: Certificate, begun: datetime) -> Suite:
    """Return the rows as test cases; those that could not be tested by choice are skipped."""
    cases = []
    for row in certificate.rows:
        if row.passed:
            cases.append(Case(row.case.name))
            continue
        problem = FAILURE if row.grade == WRONG else ERROR if row.failed else SKIPPED
        cases.append(Case(row.case.name, problem, f"{row.words}: {row.reason}", row.case.tests))
    program = certificate.program.replace(".", "_")
    name = f"hertzchain.certify.{program}"
    return Suite(name, tuple(cases), begun, certificate.seconds)


def _cells(row: Row) -> tuple[str, ...]:
    numbers = (row.difference, row.allowed)
    shown = ("" if number is None else f"{number:.1e}" for number in numbers)
    return (row.case.name, row.case.tests, row.words, *shown)


def _reasons(certificate: Certificate) -> dict[str, list[str]]:
    """Return the names of rows by the reason that they share."""
    names: dict[str, list[str]] = {}
    for row in certificate.rows:
        if row.reason:
            names.setdefault(row.reason, []).append(row.case.name)
    return names


_ACCURACIES = tuple(float(f"1e-{k}") for k in range(2, 11))  # accuracies of the table


def print_tradeoff(console: Console, tradeoff: Tradeoff) -> None:
    """Print the cheapest contender for each accuracy."""
    console.print(describe(tradeoff.scene), style="bold", end="\n\n")
    best = {wanted: tradeoff.cheapest(wanted) for wanted in _ACCURACIES}
    console.print("The cheapest way to peaks of a wanted accuracy")
    header = ("right to", "contender", "with", "error", "force evaluations", "time [ms]")
    lines = [
        (
            _power(wanted),
            row.contender,
            _setting(row),
            f"{row.error:.1e}",
            f"{row.force_evaluations:,}",
            f"{1e3 * row.wall_time:.3g}",
        )
        for wanted, row in best.items()
        if row is not None
    ]
    console.print(table(header, lines, left=("contender",)))
    console.print()
    console.print(
        "Time: the least of some runs, on code that is loaded and compiled. LAMMPS: with the"
        " creation of its instance,\nwithout estimating its error. rtol: the native solver chooses"
        " method and steps; its estimate takes more runs.\nThe truth is known to"
        f" {tradeoff.truth_error:.1g}."
    )


def _power(wanted: float) -> str:
    return f"{wanted:.0e}".replace("e-0", "e-")


def _setting(row: TradeoffRow) -> str:
    if row.rtol is not None:
        return f"rtol {_power(row.rtol)}"
    return f"step {row.step:.3g} s"
