"""Rows of measured and expected numbers, the result of every validation script."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike
from rich.console import Console
from rich.progress import track
from rich.table import Table

import hertzchain as hc

_Any = TypeVar("_Any")


@dataclass(frozen=True)
class Row:
    """A number and its expected value."""

    what: str  # quantity and scene
    backend: str  # backend
    measured: float
    expected: float
    tolerance: float
    passed: bool  # whether they agree
    reason: str  # reason of the tolerance


def row(
    what: str, backend: str, measured: float, expected: float, tolerance: float, reason: str
) -> Row:
    """Return a row that passes if the difference is within the tolerance."""
    passed = bool(abs(measured - expected) <= tolerance)
    return Row(what, backend, float(measured), float(expected), float(tolerance), passed, reason)


def largest(values: ArrayLike) -> float:
    """The largest of some values, without their signs; NaN, which no row passes, where one is.

    Pandas' own ``max`` leaves out what could not be measured. NaN of no values, too.
    """
    sizes = np.abs(np.asarray(values, np.float64))
    return float(np.max(sizes)) if sizes.size else float("nan")


def ends(values: ArrayLike) -> tuple[float, float]:
    """The lowest and the highest of some values; both NaN where one is, or where there is none."""
    array = np.asarray(values, np.float64)
    if not array.size:
        return float("nan"), float("nan")
    return float(np.min(array)), float(np.max(array))


RAN = "every scene has to run"


def did_not_run(what: str, backend: str, problem: hc.HertzchainError | str) -> Row:
    """A row that fails in place of those of a scene that could not be simulated."""
    nan = float("nan")
    return Row(f"{what}: {problem}", backend, nan, nan, 0.0, False, RAN)


def progress(work: Iterable[_Any], label: str) -> Iterable[_Any]:
    """The same, with a bar on a terminal that says how much is done."""
    console = Console(stderr=True)
    return track(work, label, console=console, transient=True, disable=not console.is_terminal)


def output(width: int = 120) -> Console:
    """Return a console on standard output, with at least this width on a pipe."""
    console = Console(highlight=False, markup=False)
    if not console.is_terminal:
        console.width = max(console.width, width)
    return console


def print_rows(title: str, rows: Sequence[Row]) -> None:
    """Print a readable table, and how many rows passed.

    Its column "times" has the differences in units of the tolerance.
    """
    console = output(150)
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
            f"{abs(numbers[2]) / entry.tolerance:.2g}" if entry.tolerance else "",
            "pass" if entry.passed else "FAIL",
        )
    console.print(table)
    for reason in dict.fromkeys(entry.reason for entry in rows):
        console.print(f"Tolerance: {reason}.")
    passed = sum(entry.passed for entry in rows)
    console.print(f"{passed} of {len(rows)} rows pass\n")
