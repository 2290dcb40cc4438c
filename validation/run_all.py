"""Every figure, table and claim of the paper, limits, mistakes, and terms, with one summary.

``validation/tradeoff.py``, ``validation/long_run.py``, ``validation/extremes.py``,
``validation/error_bounds.py`` and ``validation/engines.py``, which take minutes or need more
programs, are run by themselves.
"""

from __future__ import annotations

import argparse
import base64
import json
import math
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import pandas
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table as RichTable

import hertzchain as hc
from hertzchain.files import check_writable, make_folder, write_text
from hertzchain.report.document import Failure, Table, Verdict
from hertzchain.report.page import CHECKED, mark, pictures, render
from hertzchain.report.picture import Picture, legend_above
from hertzchain.verdict.tradeoff import provenance
from validation.script import (
    Row,
    Script,
    as_json,
    did_not_run,
    output,
    print_rows,
    say,
    why_no_lammps,
    write_figure,
    write_table,
)

HERE = Path(__file__).parent

_LEAST, _MOST = 1e-6, 1e3
"""Least and largest drawn difference [tolerances]; values beyond, or missing, are drawn there."""

_FEW = 12
"""Rows that are shown unfolded."""

_NAMED = 10
"""Rows that failed, named at the top of the page."""


@dataclass(frozen=True)
class Section:
    """One script in the page."""

    outcome: Outcome
    drawing: str  # its figure as a data URI; empty where there is none
    missing: str  # why there is no figure

    @property
    def passed(self) -> int:
        """Number of rows that pass."""
        return len(self.outcome.rows) - self.outcome.failed

    @property
    def mark(self) -> str:
        """Its verdict."""
        return mark(not self.outcome.failed)

    def rows(self, passed: bool) -> Table:
        """Rows that pass, or those that fail."""
        rows = [_cells(entry) for entry in self.outcome.rows if entry.passed == passed]
        caption = "Rows that pass" if passed else "Rows that fail"
        return Table("", caption, (*CHECKED, "times"), rows, 2)


def write_outcome(folder: Path, outcome: Outcome) -> Section:
    """Write the table (CSV) and the figure (SVG) of a script, and return its section."""
    if outcome.table is None:
        return Section(outcome, "", "it could not be measured")
    write_table(folder / f"{outcome.name}.csv", outcome.table)
    path = folder / f"{outcome.name}.svg"
    try:
        figure = outcome.script.draw(outcome.table)
    except hc.HertzchainError as problem:
        return Section(outcome, "", str(problem))
    write_figure(path, figure)
    # As an image: ids of several figures within one page would clash.
    encoded = base64.b64encode(path.read_bytes()).decode()
    return Section(outcome, f"data:image/svg+xml;base64,{encoded}", "")


def write_report(folder: Path, sections: Sequence[Section], document: dict[str, Any]) -> None:
    """Write index.html, with the document as JSON to be saved from the page."""
    outcomes = [section.outcome for section in sections]
    rows = [entry for outcome in outcomes for entry in outcome.rows]
    failed = [(o.name, entry) for o in outcomes for entry in o.rows if not entry.passed]
    named = [
        Failure(f"{name}: {_name(entry)}", _found(entry), entry.reason)
        for name, entry in failed[:_NAMED]
    ]
    more = [f"{len(failed) - _NAMED} more rows failed, see below"] if len(failed) > _NAMED else []
    passing = sum(not outcome.failed for outcome in outcomes)
    sentence = (
        f"{len(rows) - len(failed)} of {len(rows)} rows pass; {passing} of {len(outcomes)} scripts"
        " have no row that fails."
    )
    content = {
        "kind": "Validation",
        "title": "Every validation script",
        "file": "",
        "verdict": Verdict(not failed, sentence, named, more),
        "sections": sections,
        "overview": pictures(partial(_overview, outcomes)),
        "caption": OVERVIEW,
        "few": _FEW,
        "versions": list(provenance().items()),
        "numbers": document,
        "numbers_name": "validation.json",
    }
    write_text(folder / "index.html", render("run_all.html.jinja", content, [HERE]))


def _found(entry: Row) -> str:
    if not math.isfinite(entry.measured):
        return "no number"
    return f"{entry.measured:.6g}, expected {entry.expected:.6g} to {entry.tolerance:.2g}"


def _cells(entry: Row) -> list[str]:
    off, times = abs(entry.measured - entry.expected), _times(entry)
    numbers = (entry.measured, ".6g"), (entry.expected, ".6g"), (off, ".2g")
    cells = [f"{value:{form}}" if math.isfinite(value) else "" for value, form in numbers]
    cells += [f"{entry.tolerance:.2g}", "" if times is None else f"{times:.2g}"]
    return [mark(entry.passed), f"{_name(entry)}\n{entry.reason}", *cells]


def _name(entry: Row) -> str:
    return f"{entry.what} ({entry.backend})"


def _times(entry: Row) -> float | None:
    """The difference in units of the tolerance; None where that is not a number."""
    off = abs(entry.measured - entry.expected)
    return off / entry.tolerance if math.isfinite(off) and entry.tolerance > 0 else None


def _overview(outcomes: Sequence[Outcome], size: tuple[float, float] | None = None) -> Picture:
    """Draw every row: how far off it is, in tolerances, script by script."""
    figure = Picture(size or (8.0, 1.2 + 0.28 * len(outcomes)))
    axes = figure.subplots()
    for passed, label, marker, colour in (
        (True, "passes", "o", "#0072B2"),
        (False, "fails", "x", "#D55E00"),
    ):
        points = [
            # Neighbours lie on seven heights, so that they do not cover one another.
            (_drawn_at(entry), line + 0.1 * (place % 7 - 3))
            for line, outcome in enumerate(outcomes)
            for place, entry in enumerate(outcome.rows)
            if entry.passed == passed
        ]
        look: dict[str, Any] = {
            "marker": marker,
            "color": colour,
            "markersize": 4,
            "fillstyle": "none",
        }
        x, y = zip(*points, strict=True) if points else ((), ())
        axes.plot(x, y, linestyle="none", label=label, **look)
    axes.axvline(1, color="0.35", linewidth=1)
    axes.set_xscale("log")
    axes.set(xlabel="difference / tolerance", ylim=(len(outcomes) - 0.4, -0.6))
    axes.set_yticks(range(len(outcomes)), [outcome.name for outcome in outcomes])
    legend_above(axes)
    return figure


OVERVIEW = (
    "Every row of every script: its difference in units of its tolerance, of which 1 (the line) is"
    " the limit, except for planted mistakes, which have to be off. Differences below"
    f" {_LEAST:g}, among them those of numbers that have to be met exactly, are drawn at"
    f" {_LEAST:g}; rows without a number, and what is off by more, at {_MOST:g}."
)


def _drawn_at(entry: Row) -> float:
    times = _times(entry)
    if times is None:
        return _LEAST if entry.passed else _MOST
    return min(max(times, _LEAST), _MOST)


_NAMES = (
    "figure1 figure2 figure3 figure4 figure5 table2 table3 table4 constants claims eqs_4b_and_5"
    " corrections formula_maps limits mistakes physics.known_numbers physics.published"
    " physics.precompression physics.linear_chain"
    " physics.restitution physics.damped_waves physics.damped_pulses"
)
MODULES: tuple[ModuleType, ...] = tuple(
    import_module(f"validation.{name}") for name in _NAMES.split()
)
TITLE = "Every script: rows that pass"


@dataclass(frozen=True)
class Outcome:
    """The outcome of one script."""

    name: str  # name of its module
    script: Script
    table: pandas.DataFrame | None  # its table; None if it could not measure
    rows: tuple[Row, ...]  # its checks
    seconds: float  # how long it took

    @property
    def failed(self) -> int:
        """Number of rows that fail."""
        return sum(not entry.passed for entry in self.rows)


def run_scripts(quick: bool, with_lammps: bool) -> Iterator[Outcome]:
    """Run one script after another, with a progress bar."""
    console = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn())
    with Progress(
        *columns, TimeElapsedColumn(),
        console=console, transient=True, disable=not console.is_terminal,
    ) as bar:  # fmt: skip
        task = bar.add_task("", total=len(MODULES))
        for module in MODULES:
            bar.update(task, description=name_of(module))
            yield run_script(module, quick, with_lammps)
            bar.advance(task)


def name_of(module: ModuleType) -> str:
    """The name of a script, as tables and files have it."""
    return module.__name__.rpartition(".")[2]


def run_script(module: ModuleType, quick: bool, with_lammps: bool) -> Outcome:
    """Run one script; an error becomes a row that fails."""
    name, script = name_of(module), module.SCRIPT
    begin, table = time.perf_counter(), None
    try:
        table = script.measure(quick, with_lammps)
        rows = script.promises(table)
    except hc.HertzchainError as problem:
        rows = [did_not_run(name, "", problem)]
    return Outcome(name, script, table, tuple(rows), time.perf_counter() - begin)


def print_summary(outcomes: Sequence[Outcome]) -> None:
    """Print how many rows of each script pass."""
    table = RichTable(title=TITLE, title_justify="left", box=None)
    for column in ("script", "question"):
        table.add_column(column)
    for column in ("pass", "of", "time [s]", ""):
        table.add_column(column, justify="right")
    for outcome in outcomes:
        rows, failed = len(outcome.rows), outcome.failed
        cells = (str(rows - failed), str(rows), f"{outcome.seconds:.1f}")
        table.add_row(outcome.name, outcome.script.question, *cells, "FAIL" if failed else "pass")
    output().print(table)


def to_dict(outcomes: Sequence[Outcome]) -> dict[str, object]:
    """Return all outcomes as a JSON object."""
    scripts = []
    for outcome in outcomes:
        script = outcome.script
        said = {"title": script.title, "question": script.question, "oracles": script.oracles}
        scripts.append(
            {"name": outcome.name} | said
            | {"seconds": outcome.seconds, "rows": as_json(outcome.rows)}
        )  # fmt: skip
    failed = any(outcome.failed for outcome in outcomes)
    return {"verdict": "fail" if failed else "pass", "scripts": scripts}


def run(arguments: Sequence[str]) -> int:
    """Run the command line; return the exit status.

    It is 1 when a row fails, 2 where LAMMPS is missing (the rest is measured) or something cannot
    be written.
    """
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="less of each, in some seconds")
    parser.add_argument("--json", action="store_true", help="print all rows as JSON")
    parser.add_argument(
        "--report", type=Path, metavar="DIR", help="write a page to read, with tables and figures"
    )
    chosen = parser.parse_args(arguments)
    missing = why_no_lammps()
    if missing:
        print(f"{missing}; everything else is measured", file=sys.stderr)
    outcomes, sections = [], []
    try:
        if chosen.report is not None:
            make_folder(chosen.report)
            check_writable(chosen.report / "index.html")
        for outcome in run_scripts(chosen.quick, missing is None):
            outcomes.append(outcome)
            if not chosen.json:
                print_rows(outcome.script.title, outcome.rows)
            if chosen.report is not None:
                sections.append(write_outcome(chosen.report, outcome))
        if chosen.report is not None:
            write_report(chosen.report, sections, to_dict(outcomes))
            print(f"Report written to {chosen.report / 'index.html'}", file=sys.stderr)
    except hc.HertzchainError as problem:
        return say(problem)
    if chosen.json:
        print(json.dumps(to_dict(outcomes), indent=2, allow_nan=False))
    else:
        print_summary(outcomes)
    if any(outcome.failed for outcome in outcomes):
        return 1
    return 2 if missing else 0


if __name__ == "__main__":
    sys.exit(run(sys.argv[1:]))
