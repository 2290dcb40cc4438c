"""What every validation script hands back, prints and writes: rows of measured and expected."""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path

import pandas
from rich.console import Console
from rich.progress import track
from rich.table import Table

import hertzchain as hc
from hertzchain.errors import BackendMissing
from hertzchain.files import check_writable, write_text
from hertzchain.lammps import run_many
from hertzchain.lammps.engine import engine
from hertzchain.tradeoff import provenance

HERE = Path(__file__).parent

STEEL = {"radius": 4.75e-3, "young_modulus": 193e9, "poisson_ratio": 0.3, "density": 7958.0}
"""The paper's granules (section 5.2), where a script makes its own scenes."""


@dataclass(frozen=True)
class Row:
    """One number beside the one it should be.

    Parameters
    ----------
    what
        What was measured, on which scene.
    backend
        Who simulated.
    measured, expected, tolerance
        The numbers.
    passed
        Whether they agree.
    reason
        Why this tolerance.
    """

    what: str
    backend: str
    measured: float
    expected: float
    tolerance: float
    passed: bool
    reason: str


def row(
    what: str, backend: str, measured: float, expected: float, tolerance: float, reason: str
) -> Row:
    """A row that passes where the difference is within the tolerance."""
    passed = abs(measured - expected) <= tolerance
    return Row(what, backend, measured, expected, tolerance, passed, reason)


def paper_table(number: int) -> list[dict[str, str]]:
    """The rows of one of the paper's tables as they are printed."""
    with (HERE / "paper" / f"table{number}.csv").open(newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


def scene_name(entry: dict[str, str]) -> str:
    """The scene file of a row of a table, without its suffix."""
    return f"{entry['profile']}_LM{entry['momentum_ratio']}_n{entry['duration_ratio']}"


RAN = "every scene has to run"


def did_not_run(what: str, backend: str, problem: hc.HertzchainError) -> Row:
    """A row that fails in place of those of a scene that could not be simulated."""
    nan = float("nan")
    return Row(f"{what}: {problem}", backend, nan, nan, 0.0, False, RAN)


def simulate(
    names: Iterable[str], label: str
) -> dict[tuple[str, str], hc.Result | hc.HertzchainError]:
    """Run scenes with both backends at their default accuracy, LAMMPS in a process of its own.

    Returns
    -------
    A result, or why there is none, for each (name of the scene, backend).

    Raises
    ------
    BackendMissing
        If LAMMPS is not there.
    """
    scenes = {name: hc.Scene.from_toml(HERE / "scenes" / f"{name}.toml") for name in names}
    console = Console(stderr=True)
    results: dict[tuple[str, str], hc.Result | hc.HertzchainError] = {}
    by_lammps = zip(scenes, run_many(scenes.values()), strict=True)
    for name, found in track(
        by_lammps,
        label,
        len(scenes),
        console=console,
        transient=True,
        disable=not console.is_terminal,
    ):
        if isinstance(found, BackendMissing):
            raise found
        results[name, "lammps"] = found
        try:
            results[name, "native"] = hc.Native("reference").run(scenes[name])
        except hc.HertzchainError as problem:
            results[name, "native"] = problem
    return results


def print_rows(title: str, rows: Sequence[Row]) -> None:
    """Print a table that a person can read, and how many rows passed.

    Its column "times" has the differences in units of the tolerance.
    """
    console = Console(highlight=False, markup=False)
    if not console.is_terminal:  # a pipe has no width to fit a table into
        console.width = max(console.width, 150)
    table = Table(title=title, title_justify="left", box=None)
    table.add_column("", no_wrap=True)
    table.add_column("backend")
    for column in ("measured", "expected", "difference", "tolerance", "times"):
        table.add_column(column, justify="right")
    table.add_column("")
    for entry in rows:
        numbers = (entry.measured, entry.expected, entry.measured - entry.expected)
        table.add_row(
            entry.what,
            entry.backend,
            *(f"{number:.4g}" for number in numbers),
            f"{entry.tolerance:.2g}",
            _times(entry),
            "pass" if entry.passed else "FAIL",
        )
    console.print(table)
    for reason in dict.fromkeys(entry.reason for entry in rows):
        console.print(f"Tolerance: {reason}.")
    passed = sum(entry.passed for entry in rows)
    console.print(f"{passed} of {len(rows)} rows pass\n")


def _times(entry: Row) -> str:
    if entry.tolerance == 0:
        return ""
    return f"{abs(entry.measured - entry.expected) / entry.tolerance:.2g}"


def write_rows(path: Path, rows: Sequence[Row]) -> None:
    """Write rows as CSV.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    write_text(path, pandas.DataFrame([asdict(entry) for entry in rows]).to_csv(index=False))


def run_script(title: str, compare: Callable[[bool], list[Row]]) -> None:
    """The command line of a validation script: print, write if asked, exit 1 when a row fails."""
    parser = argparse.ArgumentParser(description=title)
    parser.add_argument("--quick", action="store_true", help="one scene of each profile")
    parser.add_argument("-o", "--output", type=Path, help="write the rows as CSV")
    chosen = parser.parse_args()
    try:
        if chosen.output is not None:
            check_writable(chosen.output)
        rows = compare(chosen.quick)
        print_rows(title, rows)
        if chosen.output is not None:
            write_rows(chosen.output, rows)
    except hc.HertzchainError as problem:
        print(f"{Path(sys.argv[0]).name}: {problem}", file=sys.stderr)
        sys.exit(2)
    sys.exit(0 if all(entry.passed for entry in rows) else 1)


def why_no_lammps() -> str | None:
    """What is wrong with LAMMPS here, as a sentence; None where it runs."""
    try:
        with engine():
            return None
    except BackendMissing as problem:
        return str(problem)


@dataclass(frozen=True)
class Measurement:
    """A script that measures a table, judges it and draws it.

    Parameters
    ----------
    title
        What it is.
    measure
        Takes whether to be quick, and whether LAMMPS is there; hands back the table.
    promises
        What has to hold of such a table.
    show
        Prints it.
    plot
        Draws it into a file.
    """

    title: str
    measure: Callable[[bool, bool], pandas.DataFrame]
    promises: Callable[[pandas.DataFrame], list[Row]]
    show: Callable[[Console, pandas.DataFrame], None]
    plot: Callable[[pandas.DataFrame, Path], None]

    def compare(self, quick: bool) -> list[Row]:
        """The rows, with both backends.

        Raises
        ------
        BackendMissing
            If LAMMPS is not there.
        """
        problem = why_no_lammps()
        if problem is not None:
            raise BackendMissing(problem)
        return self.promises(self.measure(quick, True))

    def run(self, arguments: Sequence[str]) -> int:
        """The command line: measure, print, write if asked.

        Returns
        -------
        The exit status: 1 when a row fails, 2 where LAMMPS is missing (the rest is measured) or
        something cannot be written.
        """
        parser = argparse.ArgumentParser(description=self.title)
        parser.add_argument("--quick", action="store_true", help="less of it, in some seconds")
        parser.add_argument("-o", "--output", type=Path, help="write the table as CSV")
        parser.add_argument("--plot", type=Path, help="write a figure; the suffix says the format")
        chosen = parser.parse_args(arguments)
        missing = why_no_lammps()
        try:
            for path in (chosen.output, chosen.plot):
                if path is not None:
                    check_writable(path)
            if missing:
                print(f"{missing}; everything else is measured", file=sys.stderr)
            table = self.measure(chosen.quick, missing is None)
            rows = self.promises(table)
            console = Console(highlight=False, markup=False)
            if not console.is_terminal:  # a pipe has no width to fit a table into
                console.width = max(console.width, 120)
            self.show(console, table)
            print_rows(f"{self.title}: what has to hold", rows)
            if chosen.output is not None:
                write_table(chosen.output, table)
            if chosen.plot is not None:
                self.plot(table, chosen.plot)
        except hc.HertzchainError as problem:
            print(f"{Path(sys.argv[0]).name}: {problem}", file=sys.stderr)
            return 2
        if not all(entry.passed for entry in rows):
            return 1
        return 2 if missing else 0


def write_table(path: Path, table: pandas.DataFrame) -> None:
    """Write a table as CSV whose first line says when, with what and on what it was measured.

    Read it with ``pandas.read_csv(path, comment="#")``.

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    facts = [f"{name} {value}" for name, value in provenance().items()]
    head = f"# {datetime.now(UTC):%Y-%m-%d}; {'; '.join(facts)}\n"
    write_text(path, head + table.to_csv(index=False))
