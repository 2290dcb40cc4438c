"""Every figure, table and claim of the paper, limits, and scenes beyond: `python -m validation`.

Scripts that take minutes, or need more programs, run only where they are named.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

import pandas
from rich.table import Table

import hertzchain as hc
from hertzchain.engines.lammps.engine import engine
from hertzchain.errors import BackendMissing
from hertzchain.files import make_folder
from validation.script import Row, Script, did_not_run, print_rows, print_table, progress


def _scripts(modules: str) -> dict[str, Script]:
    """The scripts of some modules, by their names."""
    each = (import_module(f"validation.{module}").SCRIPTS for module in modules.split())
    return {name: script for scripts in each for name, script in scripts.items()}


SCRIPTS = _scripts(
    "figure1 figure2 transition tables constants claims corrections formula_maps"
    " limits physics.known_numbers physics.published physics.precompression physics.linear_chain"
    " physics.restitution physics.damped_waves physics.damped_pulses"
)
"""All that run where none is named: two minutes."""

LONG = _scripts("engines error_bounds experiments extremes tradeoff")
"""Those that take minutes or hours, or need more programs."""


@dataclass(frozen=True)
class Outcome:
    """The outcome of one script."""

    name: str
    script: Script
    table: pandas.DataFrame | None  # None if it could not measure
    rows: tuple[Row, ...]  # its checks
    seconds: float  # how long it took

    @property
    def failed(self) -> int:
        """Number of rows that fail."""
        return sum(not entry.passed for entry in self.rows)


def run_script(name: str, script: Script, quick: bool, with_lammps: bool) -> Outcome:
    """Run one script; an error becomes a row that fails."""
    begin, table = time.perf_counter(), None
    try:
        table = script.measure(quick, with_lammps)
        rows = script.promises(table)
    except hc.HertzchainError as problem:
        rows = [did_not_run(name, problem)]
    return Outcome(name, script, table, tuple(rows), time.perf_counter() - begin)


def print_summary(outcomes: Sequence[Outcome]) -> None:
    """Print how many rows of each script pass."""
    table = Table(title="Every script: rows that pass", title_justify="left", box=None)
    for column in ("script", "question"):
        table.add_column(column)
    for column in ("pass", "of", "time [s]", ""):
        table.add_column(column, justify="right")
    for outcome in outcomes:
        rows, failed = len(outcome.rows), outcome.failed
        cells = (str(rows - failed), str(rows), f"{outcome.seconds:.1f}")
        table.add_row(outcome.name, outcome.script.question, *cells, "FAIL" if failed else "pass")
    print_table(table)


def why_no_lammps() -> str | None:
    """Return a sentence on why LAMMPS does not run here; None where it runs."""
    try:
        with engine():
            return None
    except BackendMissing as problem:
        return str(problem)


def run(arguments: Sequence[str]) -> int:
    """Run the command line; return the exit status.

    It is 1 when a row fails, 2 where LAMMPS is missing (the rest is measured) or something cannot
    be written.
    """
    parser = argparse.ArgumentParser("python -m validation", description=__doc__.splitlines()[0])
    every = SCRIPTS | LONG
    parser.add_argument(
        "scripts", nargs="*", metavar="SCRIPT", help=f"one of {', '.join(every)}; by default all"
        f" but {', '.join(LONG)}",
    )  # fmt: skip
    parser.add_argument("--quick", action="store_true", help="less of each, in some seconds")
    parser.add_argument("-o", "--output", type=Path, metavar="FOLDER", help="write tables, figures")
    chosen = parser.parse_args(arguments)
    unknown = [name for name in chosen.scripts if name not in every]
    if unknown:
        parser.error(f"unknown script {unknown[0]}; there are {', '.join(every)}")
    missing = why_no_lammps()
    if missing:
        print(f"{missing}; everything else is measured", file=sys.stderr)
    outcomes = []
    try:
        if chosen.output is not None:
            make_folder(chosen.output)
        for name in progress(chosen.scripts or list(SCRIPTS), "scripts"):
            outcome = run_script(name, every[name], chosen.quick, missing is None)
            print_rows(f"{outcome.script.title}: what has to hold", outcome.rows)
            if chosen.output is not None and outcome.table is not None:
                outcome.script.write(chosen.output, name, outcome.table)
            outcomes.append(outcome)
    except hc.HertzchainError as problem:
        print(f"validation: {problem}", file=sys.stderr)
        return 2
    if len(outcomes) > 1:
        print_summary(outcomes)
    if any(outcome.failed for outcome in outcomes):
        return 1
    return 2 if missing else 0
