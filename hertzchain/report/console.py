"""Results, comparisons and judgements as text for a terminal."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from rich.table import Table
from rich.text import Text

from hertzchain.observables.result import Result
from hertzchain.report.facts import (
    answers,
    cost,
    difference,
    judgement_facts,
    number,
    shown_contacts,
    similar_scene,
    with_unit,
)
from hertzchain.report.figures import describe
from hertzchain.report.style import LABELS
from hertzchain.scene.pulse import Pulse
from hertzchain.theory import Prediction, peak_map
from hertzchain.theory.prediction import constants

if TYPE_CHECKING:
    from rich.console import Console

    from hertzchain.verdict.comparison import Comparison
    from hertzchain.verdict.judgement import Judgement


def print_run(console: Console, result: Result) -> None:
    """Print what a person wants of one run: peaks of the transition, p, F_SW, speed, error, cost.

    Parameters
    ----------
    console
        Where to.
    result
        The run.
    """
    console.print(describe(result.scene), style="bold")
    table = Table(box=None, header_style="bold")
    for column in ("contact", "peak force [N]", "peak time [s]", ""):
        table.add_column(column, justify="right")
    shown = shown_contacts(result)
    for contact in shown:
        k = contact - 2
        force, time = number(result.peak_force[k], 9), number(result.peak_time[k], 6)
        table.add_row(str(contact), force, time, "" if result.peak_passed[k] else "not peaked yet")
    console.print(table)
    _print_left_out(console, result, shown)
    wave = result.solitary_wave
    facts = [
        (
            "transition, p",
            "none ends here"
            if result.transition_granules is None
            else f"{result.transition_granules} granules",
        ),
        ("solitary wave, F_SW", with_unit(wave.peak_force, "N")),
        ("far-field force", with_unit(wave.far_field_force, "N")),
        ("speed", with_unit(wave.speed, "m/s")),
        ("error of the peaks, at most", f"{result.error_estimate:.1e}"),
        ("largest overlap", f"{result.overlap_ratio:.2g} radii"),
        ("cost", cost(result)),
    ]
    if (similar := similar_scene(result)) is not None:
        facts.append(("computed as", similar))
    _print_facts(console, facts)
    _print_remarks(console, *result.warnings)


def print_prediction(console: Console, prediction: Prediction) -> None:
    """Print what can be said of a scene without a simulation, and how sure it is.

    Parameters
    ----------
    console
        Where to.
    prediction
        What to print.
    """
    console.print(describe(prediction.scene), style="bold")
    rows = [row for row in prediction.rows if row["map_N"] is not None]
    if rows:
        console.print("\nPeak force of each contact [N]; then the difference from the map")
        table = Table(box=None, header_style="bold")
        for column in ("contact", "map", "Eq. 6", "Eq. 9", "Eq. 6", "Eq. 9"):
            table.add_column(column, justify="right")
        p = prediction.transition_granules
        shown = rows[:10] if p is None else rows[:p]
        for row in shown:
            peak, others = row["map_N"], (row["eq6_N"], row["eq9_N"])
            assert peak is not None
            table.add_row(
                str(row["contact"]),
                number(peak, 5),
                *(number(value, 5) for value in others),
                *("" if value is None else f"{value / peak - 1:+.1%}" for value in others),
            )
        console.print(table)
        left = len(rows) - len(shown)
        if left:
            console.print(
                f"({left} more contacts, to {rows[-1]['contact']}, in --json)", style="dim"
            )
        _print_facts(console, _predicted_facts(prediction))
    _print_constants(console, prediction)
    _print_remarks(console, prediction.missing, prediction.note, *prediction.warnings)


def _print_remarks(console: Console, *remarks: str | None) -> None:
    for remark in remarks:
        if remark:
            console.print(f"\n{remark[0].upper()}{remark[1:]}.")


def _predicted_facts(prediction: Prediction) -> list[tuple[str, str]]:
    """Label and value of each thing predicted but the peaks."""
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


def _print_constants(console: Console, prediction: Prediction) -> None:
    if not isinstance(prediction.scene.shock, Pulse):
        return
    console.print()
    table = Table(box=None, header_style="bold")
    for column in ("constant", "paper", "exact", "difference"):
        table.add_column(column, justify="right" if column != "constant" else "left")
    for constant in constants():
        values = f"{constant.paper:.6f}", f"{constant.exact:.6f}"
        table.add_row(constant.name, *values, f"{constant.difference:+.2%}")
    console.print(table)


def print_comparison(console: Console, comparison: Comparison) -> None:
    """Print every oracle side by side, then the checks and the verdict.

    Parameters
    ----------
    console
        Where to.
    comparison
        What to print.
    """
    native, formulas = comparison.native, comparison.formulas
    console.print(describe(comparison.scene), style="bold", end="\n\n")
    console.print("Peak force of each contact [N]; then its difference from native")
    table = Table(box=None, header_style="bold")
    codes = [name for name in comparison.wanted if name != native.backend]
    labels = [LABELS[name] for name in codes]
    for column in ("contact", "native", *labels, "Eq. 6", "Eq. 9", *labels, "Eq. 6", "Eq. 9"):
        table.add_column(column, justify="right")
    shown = shown_contacts(native)
    found = [comparison.results.get(name) for name in codes]
    for contact in shown:
        k = contact - 2
        peak = native.peak_force[k]
        others = [np.nan if result is None else result.peak_force[k] for result in found]
        equations = [formulas.eq6[k], formulas.eq9[k]]
        differences = [value / peak - 1 if peak > 0 else np.nan for value in (*others, *equations)]
        table.add_row(
            str(contact),
            number(peak, 9),
            *(number(value, 9) for value in others),
            *(number(value, 6) for value in equations),
            *("" if np.isnan(value) else f"{value:+.1e}" for value in differences[: len(codes)]),
            *("" if np.isnan(value) else f"{value:+.2%}" for value in differences[len(codes) :]),
        )
    console.print(table)
    _print_left_out(console, native, shown)
    console.print()
    console.print(_summary(comparison))
    for remark in (formulas.applicable, formulas.note):
        if remark:
            console.print(f"Formulas: {remark}.")
    for label, result in zip(labels, found, strict=True):
        if result is not None and (similar := similar_scene(result)) is not None:
            console.print(f"{label} computed {similar}.")
    _print_remarks(console, *native.warnings)
    console.print()
    _print_checks(console, comparison)


def print_judgement(console: Console, judgement: Judgement, others: str = "in --json") -> None:
    """Print the contacts of the transition and those that failed, the cause and the verdict.

    Parameters
    ----------
    console
        Where to.
    judgement
        What to print.
    others
        Where the other contacts are.
    """
    reference = judgement.reference
    console.print(describe(reference.scene), style="bold", end="\n\n")
    console.print("Peak force of each contact [N]: as given, and the truth")
    table = Table(box=None, header_style="bold")
    for column in ("contact", "given", "native", "difference", ""):
        table.add_column(column, justify="right")
    transition = shown_contacts(reference)
    failed = [row["contact"] for row in judgement.rows if row["passed"] is False]
    shown = {*transition, *failed[:_MOST_FAILED]}
    for row in judgement.rows:
        if row["contact"] not in shown:
            continue
        given, difference = row["given_N"], row["difference"]
        known = given is not None
        table.add_row(
            str(row["contact"]),
            number(given, 9),
            number(row["reference_N"], 9),
            f"{difference:+.1e}" if known and difference is not None else "",
            _mark(row["passed"]) if known else Text("not given", "dim"),
        )
    console.print(table)
    left = reference.contact.size - len(shown)
    if left:
        last = reference.contact[-1]
        console.print(f"({left} more contacts, to {last}, {others})", style="dim")
    console.print()
    _print_facts(console, judgement_facts(judgement))
    if judgement.cause is not None:
        console.print(f"\nLikely cause: {judgement.cause}.")
    elif failed:
        console.print("\nLikely cause: no known pattern.")
    _print_remarks(console, *judgement.remarks, *reference.warnings)
    colour = "green" if judgement.verdict == "pass" else "red"
    console.print("\nVerdict:", Text(judgement.verdict, f"bold {colour}"))


def _mark(passed: object) -> Text:
    if passed is None:
        return Text("not judged", "dim")
    return Text("pass", "green") if passed else Text("FAIL", "red")


_MOST_FAILED = 10
"""Contacts outside the transition that are shown because they failed."""


def _summary(comparison: Comparison) -> Table:
    simulated = [comparison.results.get(name) for name in comparison.wanted]
    table = Table(box=None, header_style="bold")
    names = [LABELS[name] for name in comparison.wanted]
    for column in ("", *names, "formulas"):
        table.add_column(column, justify="left" if not column else "right")
    for label, cells in answers(comparison):
        table.add_row(label, *cells)

    def row(label: str, shown: Callable[[Result], str]) -> None:
        table.add_row(label, *("" if result is None else shown(result) for result in simulated))

    row("error, at most", lambda result: f"{result.error_estimate:.1e}")
    row("method", lambda result: result.method)
    row("steps", lambda result: f"{result.steps:,}")
    row("time [s]", lambda result: f"{result.wall_time:.2f}")
    return table


def _print_checks(console: Console, comparison: Comparison) -> None:
    table = Table(box=None, header_style="bold")
    for column in ("check", "difference", "tolerance", ""):
        table.add_column(column, justify="right" if column in _NUMERIC else "left")
    for check in comparison.checks:
        mark = Text("pass", "green") if check.passed else Text("FAIL", "red")
        table.add_row(check.name, *difference(check), mark)
    console.print(table)
    for check in comparison.checks:
        if not check.passed:
            console.print(Text(check.name, "red") + Text(f": {check.reason}", ""))
    for check in comparison.checks:
        if check.remark:
            console.print(f"{check.name}: {check.remark}.")
    colour = "green" if comparison.verdict == "pass" else "red"
    console.print("\nVerdict:", Text(comparison.verdict, f"bold {colour}"))


_NUMERIC = ("difference", "tolerance")


def _print_left_out(console: Console, result: Result, shown: list[int]) -> None:
    left = result.contact.size - len(shown)
    if left:
        console.print(f"({left} more contacts, to {result.contact[-1]}, in --json)", style="dim")


def _print_facts(console: Console, facts: list[tuple[str, str]]) -> None:
    table = Table(box=None, show_header=False)
    for label, value in facts:
        table.add_row(label, value)
    console.print(table)
