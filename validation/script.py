"""The form of a validation script: it measures, judges and draws a table."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NoReturn, TypeVar

import numpy as np
import pandas
from matplotlib import rc_context
from matplotlib.figure import Figure
from numpy.typing import ArrayLike
from rich.console import Console
from rich.progress import track
from rich.table import Table

import hertzchain as hc
from hertzchain.files import write_text, write_with
from hertzchain.verdict.tradeoff import provenance

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


def did_not_run(what: str, problem: hc.HertzchainError | str) -> Row:
    """A row that fails in place of those of a scene that could not be simulated."""
    nan = float("nan")
    return Row(f"{what}: {problem}", "", nan, nan, 0.0, False, "every scene has to run")


def table_of(
    compare: Callable[[bool, bool], Iterable[Row]],
) -> Callable[[bool, bool], pandas.DataFrame]:
    """``measure`` of a script whose table is the rows of ``compare``."""

    def measure(quick: bool, with_lammps: bool) -> pandas.DataFrame:
        rows = [asdict(entry) for entry in compare(quick, with_lammps)]
        return pandas.DataFrame(rows, columns=[field.name for field in fields(Row)])

    return measure


def rows_of(table: pandas.DataFrame) -> list[Row]:
    """The rows of a table of rows."""
    return [Row(**{str(k): v for k, v in entry.items()}) for entry in table.to_dict("records")]


@dataclass(frozen=True)
class Script:
    """A script that measures a table, judges it and draws it."""

    title: str
    question: str  # a sentence
    # Function from two flags (quick form, LAMMPS available) to the table.
    measure: Callable[[bool, bool], pandas.DataFrame]
    # Checks of such a table, measured now or read from its file.
    promises: Callable[[pandas.DataFrame], list[Row]] = rows_of
    draw: Callable[[pandas.DataFrame], Figure] | None = None  # the table's figure
    suffix: str = ".svg"  # format of the kept figure

    def write(self, folder: Path, name: str, table: pandas.DataFrame) -> None:
        """Write the table (CSV) and its figure."""
        write_table(folder / f"{name}.csv", table)
        if self.draw is not None:
            write_figure(folder / f"{name}{self.suffix}", self.draw(table))


# What scripts share


def largest(values: ArrayLike) -> float:
    """The largest of some values, without their signs; NaN where one is NaN, or there is none.

    Pandas' own ``max`` leaves out what could not be measured.
    """
    sizes = np.abs(np.asarray(values, np.float64))
    return float(np.max(sizes)) if sizes.size else float("nan")


def by_ends(
    what: str, backend: str, values: ArrayLike, expected: Sequence[float], *why: Any
) -> list[Row]:
    """A row for the lowest of some values, and one for the highest; tolerance and its reason.

    Both are NaN where one value is NaN, or where there is none.
    """
    array = np.asarray(values, np.float64)
    ends = (np.min(array), np.max(array)) if array.size else (float("nan"),) * 2
    return [
        row(f"{what}, {end}", backend, measured, stated, *why)
        for end, measured, stated in zip(("lowest", "highest"), ends, expected, strict=True)
    ]


def progress(work: Iterable[_Any], label: str) -> Iterable[_Any]:
    """The same, with a bar on a terminal that says how much is done."""
    console = Console(stderr=True)
    return track(work, label, console=console, transient=True, disable=not console.is_terminal)


def print_table(table: Table) -> None:
    """Print a table, at least 150 columns wide on a pipe."""
    console = Console(highlight=False, markup=False)
    if not console.is_terminal:
        console.width = max(console.width, 150)
    console.print(table)


def print_rows(title: str, rows: Sequence[Row]) -> None:
    """Print a readable table, and how many rows passed.

    Its column "times" has the differences in units of the tolerance.
    """
    table = Table(title=title, title_justify="left", box=None)
    table.add_column("", no_wrap=True)
    table.add_column("backend")
    for column in ("measured", "expected", "difference", "tolerance", "times"):
        table.add_column(column, justify="right")
    table.add_column("")
    for entry in rows:
        off = entry.measured - entry.expected
        table.add_row(
            entry.what,
            entry.backend,
            *(f"{number:.4g}" for number in (entry.measured, entry.expected, off)),
            f"{entry.tolerance:.2g}",
            f"{abs(off) / entry.tolerance:.2g}" if entry.tolerance else "",
            "pass" if entry.passed else "FAIL",
        )
    print_table(table)
    for reason in dict.fromkeys(entry.reason for entry in rows):
        print(f"Tolerance: {reason}.")
    print(f"{sum(entry.passed for entry in rows)} of {len(rows)} rows pass\n")


def leave_with(measure: Callable[[], bool]) -> NoReturn:
    """End Python with status 0 or 1 by the result, or with 2 if nothing could be measured."""
    try:
        status = 0 if measure() else 1
    except hc.HertzchainError as problem:
        print(f"{Path(sys.argv[0]).name}: {problem}", file=sys.stderr)
        status = 2
    sys.exit(status)


# Files


def write_table(path: Path, table: pandas.DataFrame) -> None:
    """Write a table as CSV whose first line says when, with what and on what it was measured.

    The versions of other codes are its attributes. Read it with ``pandas.read_csv(path,
    comment="#")``.
    """
    others = {str(code): str(version) for code, version in table.attrs.items()}
    write_text(path, dated(facts_of(provenance() | others), table.to_csv(index=False)))


def facts_of(versions: Mapping[str, str]) -> str:
    """Names and versions on one line."""
    return "; ".join(f"{name} {version}" for name, version in versions.items())


def dated(facts: str, csv: str) -> str:
    """Return a CSV below a line with its date and facts."""
    return f"# {datetime.now(UTC):%Y-%m-%d}; {facts}\n{csv}"


def write_figure(path: Path, figure: Figure) -> None:
    """Write a figure; the suffix says the format. Drawn twice, a file is the same."""
    undated: dict[str, Any] = {"metadata": {"Date": None}} if path.suffix == ".svg" else {}
    with rc_context({"svg.hashsalt": "hertzchain", "svg.fonttype": "none"}):
        write_with(path, lambda name: figure.savefig(name, **undated))


# Figures

_OPEN = {"linestyle": "none", "fillstyle": "none"}

BACKENDS: dict[str, dict[str, Any]] = {
    "native": {"label": "native", "color": "#000000", "marker": "o", "markersize": 5} | _OPEN,
    "lammps": {"label": "LAMMPS", "color": "#0072B2", "marker": "s", "markersize": 9} | _OPEN,
}
"""Open markers of two sizes: where both agree, one lies inside the other."""

PROFILES: dict[str, dict[str, Any]] = {
    "cosine": {"label": "1-cosine", "color": "#0072B2", "marker": "o"},
    "triangular": {"label": "triangular", "color": "#D55E00", "marker": "s"},
    "cosine-triangular": {
        "label": "1-cosine rise, triangular decay",
        "color": "#009E73",
        "marker": "^",
    },
}
"""Colours of the three profiles of Table 1."""


def new_figure(width: float, height: float, title: str | None = None) -> Figure:
    """Return an empty figure of a size [inches]."""
    figure = Figure(figsize=(width, height), layout="constrained", dpi=100)
    if title is not None:
        figure.suptitle(title, fontsize="medium")
    return figure
