"""What every validation script hands back, prints and writes: rows of measured and expected."""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import pandas
from rich.console import Console
from rich.progress import track
from rich.table import Table

import hertzchain as hc
from hertzchain.files import check_writable, write_text

HERE = Path(__file__).parent


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


def simulate(names: Iterable[str], label: str) -> dict[tuple[str, str], hc.Result]:
    """Run scenes with both backends at their default accuracy.

    Returns
    -------
    A result for each (name of the scene, backend).
    """
    backends: tuple[hc.Native | hc.Lammps, ...] = (hc.Native("reference"), hc.Lammps())
    scenes = {name: hc.Scene.from_toml(HERE / "scenes" / f"{name}.toml") for name in names}
    console = Console(stderr=True)
    work = [(name, backend) for name in scenes for backend in backends]
    results = {}
    for name, backend in track(
        work, label, console=console, transient=True, disable=not console.is_terminal
    ):
        result = backend.run(scenes[name])
        results[name, result.backend] = result
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
