"""What people see: tables on the terminal and plots."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.table import Table
from rich.text import Text

from hertzchain.arrays import FloatArray
from hertzchain.errors import OutputError
from hertzchain.files import write_with
from hertzchain.observables.result import Result
from hertzchain.report.style import COLOURS, LABELS, MARKERS
from hertzchain.scene.pulse import Pulse, PulseTable
from hertzchain.scene.scene import Scene
from hertzchain.theory import Prediction, peak_map
from hertzchain.theory.prediction import constants

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from rich.console import Console

    from hertzchain.verdict.check import Check
    from hertzchain.verdict.comparison import Comparison
    from hertzchain.verdict.judgement import Judgement
    from hertzchain.verdict.tradeoff import Row, Tradeoff


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
        ("solitary wave, F_SW", _with_unit(wave.peak_force, "N")),
        ("far-field force", _with_unit(wave.far_field_force, "N")),
        ("speed", _with_unit(wave.speed, "m/s")),
        ("error of the peaks, at most", f"{result.error_estimate:.1e}"),
        ("largest overlap", f"{result.overlap_ratio:.2g} radii"),
        ("cost", _cost(result)),
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
        ("far-field force", _with_unit(prediction.far_field_force, "N")),
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


def judgement_facts(judgement: Judgement) -> list[tuple[str, str]]:
    """Label and value of what a judgement says of all contacts together."""
    reference = judgement.reference
    failed = int(np.count_nonzero(judgement.judged & ~judgement.passed))
    judged = int(np.count_nonzero(judgement.judged))
    weak = reference.contact.size - judgement.missing - judged
    counts = [f"{judged} judged", f"{failed} failed", f"{judgement.missing} not given"]
    if weak:
        counts.append(f"{weak} below a thousandth of the largest, not judged")
    largest = judgement.largest_difference
    facts = [
        ("contacts", ", ".join(counts)),
        ("largest difference", "" if largest is None else f"{largest:.1e}"),
        ("tolerance", f"{judgement.tolerance:.1e}"),
        ("error of native, at most", f"{reference.error_estimate:.1e}"),
    ]
    if judgement.expected is not None:
        expected = judgement.expected
        off = (
            f"{expected.interpolated:.1e} off; {expected.sampled:.1e} if only samples are looked at"
        )
        facts.append((f"velocity Verlet, steps of {expected.dt:.3g} s", off))
    if judgement.like_steps is not None:
        interpolated, sampled = judgement.like_steps
        steps = f"with steps of {interpolated:.2g} s; {sampled:.2g} s if only samples are looked at"
        facts.append(("as far off: velocity Verlet", steps))
    return facts


def _mark(passed: object) -> Text:
    if passed is None:
        return Text("not judged", "dim")
    return Text("pass", "green") if passed else Text("FAIL", "red")


_MOST_FAILED = 10
"""Contacts outside the transition that are shown because they failed."""


def answers(comparison: Comparison) -> list[tuple[str, list[str]]]:
    """What each oracle says of the transition and the wave that leaves it.

    Returns
    -------
    Label and values, by the names in ``comparison.wanted`` and then of the formulas; empty where
    there is none.
    """
    formulas = comparison.formulas
    simulated = [comparison.results.get(name) for name in comparison.wanted]

    def row(
        label: str, shown: Callable[[Result], str], of_formulas: str = ""
    ) -> tuple[str, list[str]]:
        cells = ["" if result is None else shown(result) for result in simulated]
        return label, [*cells, of_formulas]

    def granules(result: Result) -> str:
        p = result.transition_granules
        return "none" if p is None else str(p)

    eq3 = formulas.transition_granules
    speed = f"{formulas.speed:.2f}, exact {formulas.exact_speed:.2f}" if formulas.speed else ""
    return [
        row("p, granules", granules, "" if eq3 is None else f"{eq3:.2f}"),
        row("F_SW [N]", lambda result: number(result.solitary_wave.peak_force, 8)),
        row("far-field force [N]", lambda result: number(result.solitary_wave.far_field_force, 8)),
        row(
            "speed [m/s]",
            lambda result: number(result.solitary_wave.speed, 7),
            speed and f"{speed} at F_SW",
        ),
    ]


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
    colour = "green" if comparison.verdict == "pass" else "red"
    console.print("\nVerdict:", Text(comparison.verdict, f"bold {colour}"))


_NUMERIC = ("difference", "tolerance")


def plot_comparison(comparison: Comparison, path: Path | str) -> None:
    """Draw peak forces along the chain and their differences from the reference.

    Parameters
    ----------
    comparison
        What to draw.
    path
        Where to; the suffix says in which format (png, pdf, svg).

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    from matplotlib.figure import Figure
    from matplotlib.ticker import MaxNLocator

    figure = Figure(figsize=(8, 7), layout="constrained", dpi=150)
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    native, formulas = comparison.native, comparison.formulas
    codes = {name: result for name, result in comparison.results.items() if name != native.backend}
    contact = native.contact
    above.plot(contact, native.peak_force, "-", color=COLOURS["native"], label="native, reference")
    others: list[tuple[str, str, FloatArray]] = [
        (name, LABELS[name], result.peak_force) for name, result in codes.items()
    ]
    if formulas.applicable is None:
        others += [(name, LABELS[name], getattr(formulas, name)) for name in ("eq6", "eq9")]
    for name, label, values in others:
        style: dict[str, Any] = {"color": COLOURS[name], "marker": MARKERS[name]}
        style |= {"markersize": 4.5, "linestyle": "none"}
        above.plot(contact, values, fillstyle="none", label=label, **style)
        pressed = np.where(native.peak_force > 0, native.peak_force, np.nan)
        difference = np.abs(values / pressed - 1)
        below.semilogy(contact, np.where(difference > 0, difference, np.nan), label=label, **style)
    for name, result in codes.items():
        below.axhline(
            result.error_estimate,
            color=COLOURS[name],
            linewidth=0.8,
            linestyle="--",
            label=f"{LABELS[name]}, error estimate",
        )
    below.axhline(
        native.error_estimate,
        color=COLOURS["native"],
        linewidth=0.8,
        linestyle=":",
        label="reference, error estimate",
    )
    p = native.transition_granules
    if p is not None:
        for axes in (above, below):
            axes.axvline(p, color="0.6", linewidth=0.8)
        above.annotate(
            f"p = {p}",
            (p, 0.02),
            xycoords=("data", "axes fraction"),
            xytext=(4, 0),
            textcoords="offset points",
            color="0.35",
        )
    above.set_ylabel("peak force [N]")
    above.set_ylim(bottom=0)
    below.xaxis.set_major_locator(MaxNLocator(integer=True))
    above.set_title(describe(comparison.scene), fontsize=10)
    below.set_ylabel("relative difference from native")
    below.set_xlabel("contact (i lies between granules i - 1 and i)")
    for axes in (above, below):
        axes.legend(fontsize=8)
        axes.grid(alpha=0.25)
    write_with(path, figure.savefig)


_ACCURACIES = tuple(float(f"1e-{k}") for k in range(2, 11))
"""What a person may want of the peaks: from whether a contact breaks to whether a code is right."""


def print_tradeoff(console: Console, tradeoffs: Sequence[Tradeoff]) -> None:
    """Print who is the cheapest for each wanted accuracy, and how much dearer the others are.

    Parameters
    ----------
    console
        Where to.
    tradeoffs
        Of one scene; or of several, whose median times and largest errors are printed.
    """
    from hertzchain.verdict.tradeoff import cheapest, typical

    console.print(_title(tradeoffs), style="bold", end="\n\n")
    known = max(one.truth_error for one in tradeoffs)
    rows = [replace(point.row, error=point.highest) for point in typical(tradeoffs)]
    alone = [row for row in rows if row.self_contained]
    found = {wanted: cheapest(alone, wanted, known) for wanted in _ACCURACIES}
    found = {wanted: reached for wanted, reached in found.items() if reached}
    best = {
        wanted: min(reached.values(), key=lambda row: row.wall_time)
        for wanted, reached in found.items()
    }
    console.print("The cheapest way to peaks of a wanted accuracy")
    table = Table(box=None, header_style="bold")
    table.add_column("right to", justify="right")
    table.add_column("contender")
    for column in ("with", "error", "force evaluations", "time [ms]"):
        table.add_column(column, justify="right")
    for wanted, row in best.items():
        table.add_row(
            _power(wanted),
            row.contender,
            _setting(row),
            f"{row.error:.1e}",
            f"{row.force_evaluations:,}",
            f"{1e3 * row.wall_time:.3g}",
        )
    console.print(table)
    console.print("\nTime as a multiple of that of the cheapest; blank: not reached")
    table = Table(box=None, header_style="bold")
    table.add_column("right to", no_wrap=True)
    for wanted in best:
        table.add_column(_power(wanted), justify="right", no_wrap=True)
    for name in dict.fromkeys(row.contender for row in alone):
        multiples = [
            reached[name].wall_time / best[wanted].wall_time if name in reached else np.nan
            for wanted, reached in found.items()
        ]
        table.add_row(name, *map(_multiple, multiples))
    console.print(table)
    console.print()
    for row in rows:
        if not row.self_contained:
            console.print(
                f"{row.contender} of a simulation, contacts of the transition only: error"
                f" {row.error:.1%}, {1e3 * row.wall_time:.2g} ms."
            )
    console.print(
        "Time: the least of some runs, on code that is loaded and compiled. LAMMPS: with the"
        " creation of its instance,\nwithout estimating its error. rtol: the native solver chooses"
        " method and steps; its estimate is a second run.\nThe truth is known to"
        f" {known:.1g}."
    )


def _title(tradeoffs: Sequence[Tradeoff]) -> str:
    if len(tradeoffs) == 1:
        return describe(tradeoffs[0].scene)
    return f"{len(tradeoffs)} scenes: median times, and the errors of the worst"


def _power(wanted: float) -> str:
    return f"{wanted:.0e}".replace("e-0", "e-")


def _setting(row: Row) -> str:
    if row.rtol is not None:
        return f"rtol {_power(row.rtol)}"
    if row.step is not None:
        return f"step {row.step:.3g} s"
    return "" if row.natural_step is None else f"step {row.natural_step:.3g} natural units"


def _multiple(ratio: float) -> Text:
    if np.isnan(ratio):
        return Text("")
    return Text(f"{ratio:.1f}" if ratio < 9.95 else f"{ratio:,.0f}", "bold" if ratio == 1 else "")


# Markers and lines say who computes, colours the method.
_ENGINE_STYLES = {
    "formulas": ("*", "none"),
    "map": ("P", "none"),
    "compiled": ("o", "-"),
    "NumPy": ("s", "--"),
    "SciPy": ("D", ":"),
    "LAMMPS": ("^", "-."),
}
_METHOD_COLOURS = {
    "velocity-verlet": "#E69F00",
    "rk4": "#56B4E9",
    "dprkn-6": "#009E73",
    "srkn-6b": "#0072B2",
    "srkn-11b": "#D55E00",
    "reference": "#CC79A7",
    "LAMMPS": "#E69F00",  # its scheme is velocity Verlet
    "DOP853": "#666666",
}
_ODD_COLOURS = {
    "srkn-6b, float32": "#8FB9DB",
    "rtol, without estimate": "#999999",
    "LAMMPS, extrapolated": "#7A4B00",
}
"""Of those that share engine and method with another."""


def plot_tradeoff(tradeoffs: Sequence[Tradeoff], path: Path | str) -> None:
    """Draw error against wall time, a line for each contender, and the frontier.

    Parameters
    ----------
    tradeoffs
        Of one scene; or of several, of which medians are drawn and the range of the errors.
    path
        Where to; the suffix says in which format (png, pdf, svg).

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    from matplotlib.figure import Figure

    from hertzchain.verdict.tradeoff import frontier, typical

    points = typical(tradeoffs)
    known = max(one.truth_error for one in tradeoffs)
    figure = Figure(figsize=(10.5, 6.5), layout="constrained", dpi=100)
    axes = figure.subplots()
    axes.set_xscale("log")
    axes.set_yscale("log")
    _draw_frontier(axes, frontier([p.row for p in points if p.row.self_contained], known), known)
    formula_sides = itertools.cycle((True, False))
    for name in dict.fromkeys(point.row.contender for point in points):
        own = [point for point in points if point.row.contender == name]
        marker, line = _ENGINE_STYLES[own[0].row.engine]
        method = name.partition(",")[0]
        colour = _ODD_COLOURS.get(name, _METHOD_COLOURS.get(method, "#000000"))
        time = [point.row.wall_time for point in own]
        error = [max(point.row.error, known) for point in own]
        if own[0].row.engine in ("formulas", "map"):
            there = (time[0], error[0])
            # Above and below by turns: they may lie close to one another.
            above = next(formula_sides)
            axes.annotate(
                method,
                there,
                (0, 7 if above else -7),
                textcoords="offset points",
                ha="center",
                va="bottom" if above else "top",
            )
        axes.plot(
            time,
            error,
            color=colour,
            marker=marker,
            linestyle=line,
            fillstyle="full" if own[0].row.engine in ("compiled", "formulas") else "none",
            markersize=9 if marker == "*" else 4.5,
            linewidth=1.2,
            label=name,
        )
        # Methods in NumPy have the range that they have compiled.
        if len(tradeoffs) > 1 and own[0].row.engine != "NumPy":
            lowest = [max(point.lowest, known) for point in own]
            highest = [max(point.highest, known) for point in own]
            axes.fill_between(time, lowest, highest, color=colour, alpha=0.12, linewidth=0)
    axes.axhspan(known / 10, known, color="0.93", zorder=0)
    axes.text(
        0.99, known / 3, "below what is known of the truth", fontsize=8, color="0.35",
        ha="right", va="center", transform=axes.get_yaxis_transform(),
    )  # fmt: skip
    axes.set_ylim(known / 10, None)
    axes.set_xlabel("wall time [s]")
    axes.set_ylabel("largest relative error of the peaks")
    title = (
        describe(tradeoffs[0].scene)
        if len(tradeoffs) == 1
        else f"{len(tradeoffs)} scenes, medians and the range of the errors"
    )
    axes.set_title(f"What accuracy costs: {title}", fontsize=10)
    axes.grid(alpha=0.25)
    figure.legend(loc="outside right center", fontsize=8, frameon=False)
    write_with(path, figure.savefig)


def _draw_frontier(axes: Axes, rows: Sequence[Row], known: float) -> None:
    """The least error that a time buys: a staircase."""
    axes.plot(
        [row.wall_time for row in rows],
        [max(row.error, known) for row in rows],
        color="#F0E442",
        linewidth=9,
        drawstyle="steps-post",
        solid_capstyle="round",
        label="frontier: nothing is\ncheaper and as accurate",
        zorder=1,
    )


def check_plot_format(path: Path | str) -> None:
    """Raise an OutputError, before any work is done, for a suffix that cannot be drawn.

    Raises
    ------
    OutputError
        If the file name does not end in a known image format.
    """
    known = (".pdf", ".png", ".svg")
    if Path(path).suffix.lower() not in known:
        raise OutputError(f"{path}: cannot be drawn, the name must end in {', '.join(known)}")


def describe(scene: Scene) -> str:
    """One line that says what a scene is."""
    shock = scene.shock
    kind = (
        f"pulse table of {len(shock.time)} rows"
        if isinstance(shock, PulseTable)
        else f"{shock.profile} pulse, n = {shock.duration_ratio:g}"
    )
    return (
        f"{kind}, LM_ratio = {scene.momentum_ratio:.6g}, {shock.peak_force:.6g} N on"
        f" {scene.chain.granules} granules"
    )


def shown_contacts(result: Result) -> list[int]:
    """The transition up to contact p + 1; without p the first few contacts."""
    p = result.transition_granules
    last = 11 if p is None else p + 1
    return [int(contact) for contact in result.contact if contact <= last]


def _print_left_out(console: Console, result: Result, shown: list[int]) -> None:
    left = result.contact.size - len(shown)
    if left:
        console.print(f"({left} more contacts, to {result.contact[-1]}, in --json)", style="dim")


def _print_facts(console: Console, facts: list[tuple[str, str]]) -> None:
    table = Table(box=None, show_header=False)
    for label, value in facts:
        table.add_row(label, value)
    console.print(table)


def _cost(result: Result) -> str:
    return (
        f"{result.wall_time:.2f} s, {result.steps:,} steps of at most {result.dt:.3g} s"
        f" ({result.backend}, {result.method})"
    )


def similar_scene(result: Result) -> str | None:
    """What a code was given instead of the scene, so that coordinates cost few digits."""
    lost = result.lost_digits
    if lost is None or lost.young_modulus == result.scene.chain.young_modulus:
        return None
    return (
        f"a similar chain of E = {lost.young_modulus:.3g} Pa, as absolute coordinates would cost"
        f" the peaks some {lost.predicted:.0e}; now {lost.bound:.0e} at most"
    )


def number(value: float | None, digits: int) -> str:
    """A number with so many significant digits; empty where there is none."""
    return "" if value is None or np.isnan(value) else f"{value:#.{digits}g}"


def _with_unit(value: float | None, unit: str) -> str:
    return "unknown: the chain or the run is too short" if value is None else f"{value:.7g} {unit}"


def difference(check: Check) -> tuple[str, str]:
    """How far off a check is, and its tolerance; empty where nothing was measured."""
    if check.measured is None or check.expected is None or check.tolerance is None:
        return "", ""
    return f"{abs(check.measured - check.expected):.1e}", f"{check.tolerance:.1e}"
