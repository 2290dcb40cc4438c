"""The form of a validation script: measures, judges and draws a table; has a command line."""

from __future__ import annotations

import argparse
import json
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
from hertzchain.engines.lammps.engine import engine
from hertzchain.errors import BackendMissing
from hertzchain.files import check_outputs, write_text, write_with
from hertzchain.report.files import check_format
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

RATIO_COLOURS: dict[float, str] = {
    0.3: "#440154",
    0.5: "#443983",
    0.7: "#31688e",
    1.0: "#21918c",
    1.4: "#2a9d54",
    2.0: "#6ba81f",
    2.5: "#b08a00",
}
"""Colours of the LM_ratio in Figures 3 to 5: viridis, from dark to light, with a darkened end."""


def new_figure(width: float, height: float, title: str | None = None) -> Figure:
    """Return an empty figure of a size [inches]."""
    figure = Figure(figsize=(width, height), layout="constrained", dpi=100)
    if title is not None:
        figure.suptitle(title, fontsize="medium")
    return figure


def why_no_lammps() -> str | None:
    """Return a sentence on why LAMMPS does not run here; None where it runs."""
    try:
        with engine():
            return None
    except BackendMissing as problem:
        return str(problem)


@dataclass(frozen=True)
class Script:
    """A script that measures a table, judges it and draws it."""

    title: str
    question: str  # its question, a sentence
    oracles: str  # source of the answers, and of the expected ones
    # Function from two flags (quick form, LAMMPS available) to the table.
    measure: Callable[[bool, bool], pandas.DataFrame]
    # Checks of such a table, measured now or read from its file.
    promises: Callable[[pandas.DataFrame], list[Row]]
    # Function from the table to a figure; by default one of the checks.
    drawing: Callable[[pandas.DataFrame], Figure] | None = None

    def draw(self, table: pandas.DataFrame) -> Figure:
        """Return the figure of a table."""
        return draw_rows(self.promises(table)) if self.drawing is None else self.drawing(table)

    def main(self) -> None:
        """The command line: exit status as from ``run``."""
        sys.exit(self.run(sys.argv[1:]))

    def run(self, arguments: Sequence[str]) -> int:
        """Measure, print, write if asked.

        The exit status is 1 when a row fails, 2 where LAMMPS is missing (the rest is measured), a
        scene does not run, or something cannot be written.
        """
        parser = argparse.ArgumentParser(description=f"{self.title}. {self.question}")
        parser.add_argument("--quick", action="store_true", help="less of it, in some seconds")
        parser.add_argument("-o", "--output", type=Path, help="write the table as CSV")
        parser.add_argument("--plot", type=Path, help="write a figure; the suffix says the format")
        parser.add_argument("--json", action="store_true", help="print the rows as JSON")
        chosen = parser.parse_args(arguments)
        missing = why_no_lammps()
        try:
            check_outputs([], [chosen.output, chosen.plot])
            if chosen.plot is not None:
                check_format(chosen.plot, "plot")
            if missing:
                print(f"{missing}; everything else is measured", file=sys.stderr)
            table = self.measure(chosen.quick, missing is None)
            rows = self.promises(table)
            if chosen.json:
                print(json.dumps({"rows": as_json(rows)}, indent=2, allow_nan=False))
            else:
                print_rows(f"{self.title}: what has to hold", rows)
            if chosen.output is not None:
                write_table(chosen.output, table)
            if chosen.plot is not None:
                write_figure(chosen.plot, self.draw(table))
        except hc.HertzchainError as problem:
            return say(problem)
        if not all(entry.passed for entry in rows):
            return 1
        return 2 if missing else 0


def say(problem: hc.HertzchainError) -> int:
    """Print in one line why nothing can be done; return the exit status 2."""
    print(f"{Path(sys.argv[0]).name}: {problem}", file=sys.stderr)
    return 2


def leave_with(measure: Callable[[], bool]) -> NoReturn:
    """End Python with status 0 or 1 by the result, or with 2 if nothing could be measured."""
    try:
        status = 0 if measure() else 1
    except hc.HertzchainError as problem:
        status = say(problem)
    sys.exit(status)


def as_json(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """Return rows as a JSON object; null stands for a missing number."""

    def known(value: Any) -> Any:
        return None if isinstance(value, float) and not np.isfinite(value) else value

    return [{key: known(value) for key, value in asdict(entry).items()} for entry in rows]


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


# Scripts with rows alone


def rows_only(compare: Callable[[bool, bool], list[Row]]) -> dict[str, Any]:
    """``measure`` and ``promises`` of a script whose table is the rows of ``compare``."""

    def measure(quick: bool, with_lammps: bool) -> pandas.DataFrame:
        columns = [field.name for field in fields(Row)]
        rows = [asdict(entry) for entry in compare(quick, with_lammps)]
        return pandas.DataFrame(rows, columns=columns)

    return {"measure": measure, "promises": rows_of}


def rows_of(table: pandas.DataFrame) -> list[Row]:
    """The rows that a table of rows was made of."""
    records = table.to_dict("records")
    return [Row(**{str(key): value for key, value in entry.items()}) for entry in records]


def draw_rows(rows: Sequence[Row]) -> Figure:
    """Each row's difference in units of its tolerance: 1 is the limit.

    Rows without a tolerance have to be met exactly and are left out.
    """
    entries = [entry for entry in rows if entry.tolerance > 0]
    times = [abs(entry.measured - entry.expected) / entry.tolerance for entry in entries]
    figure = new_figure(8, 1.2 + 0.16 * len(entries))
    axes = figure.subplots()
    colours = ["#0072B2" if entry.passed else "#D55E00" for entry in entries]
    axes.scatter(np.clip(times, 1e-6, None), range(len(entries)), 16, colours)
    axes.axvline(1.0, color="0.4", linewidth=0.8)
    labels = [f"{entry.what} ({entry.backend})" for entry in entries]
    axes.set_yticks(range(len(entries)), labels=labels, fontsize=6)
    axes.set(xscale="log", ylim=(len(entries) - 0.4, -0.6))
    axes.set_xlabel("difference, in units of the tolerance")
    axes.grid(axis="x", alpha=0.3)
    return figure
