"""Every figure, table and claim of the paper, limits, mistakes, and terms, with one summary.

``validation/tradeoff.py``, ``validation/long_run.py``, ``validation/extremes.py``,
``validation/error_bounds.py`` and ``validation/engines.py``, which take minutes or need more
programs, are run by themselves.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from types import ModuleType

import pandas
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

import hertzchain as hc
from validation.page import make_folder, write_outcome, write_report
from validation.rows import Row, did_not_run, output, print_rows
from validation.script import Script, as_json, say, why_no_lammps

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
    table = Table(title=TITLE, title_justify="left", box=None)
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
