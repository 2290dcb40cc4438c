"""What every validation script hands back and prints: rows of measured and expected."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np
import pandas
from numpy.typing import ArrayLike
from rich.console import Console
from rich.progress import track
from rich.table import Table

import hertzchain as hc
from hertzchain import theory
from hertzchain.engines.lammps import run_many
from hertzchain.errors import BackendMissing
from hertzchain.observables.history import History

HERE = Path(__file__).parent

_Any = TypeVar("_Any")

STEEL = {"radius": 4.75e-3, "young_modulus": 193e9, "poisson_ratio": 0.3, "density": 7958.0}
"""The paper's granules (section 5.2), where a script makes its own scenes."""


@dataclass(frozen=True)
class Row:
    """One number beside the one it should be."""

    what: str  # what was measured, on which scene
    backend: str  # who simulated
    measured: float
    expected: float
    tolerance: float
    passed: bool  # whether they agree
    reason: str  # why this tolerance


def row(
    what: str, backend: str, measured: float, expected: float, tolerance: float, reason: str
) -> Row:
    """A row that passes where the difference is within the tolerance."""
    passed = bool(abs(measured - expected) <= tolerance)
    return Row(what, backend, float(measured), float(expected), float(tolerance), passed, reason)


def paper_table(number: int) -> list[dict[str, str]]:
    """The rows of one of the paper's tables as they are printed."""
    with (HERE / "paper" / f"table{number}.csv").open(newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


def scene_name(entry: dict[str, str]) -> str:
    """The scene file of a row of a table, without its suffix."""
    return f"{entry['profile']}_LM{entry['momentum_ratio']}_n{entry['duration_ratio']}"


def largest(values: ArrayLike) -> float:
    """The largest of some values, without their signs; NaN, which no row passes, where one is.

    Pandas' own ``max`` leaves out what could not be measured. NaN of no values, too.
    """
    known = np.abs(np.asarray(values, np.float64))
    return float(np.max(known)) if known.size else float("nan")


def ends(values: ArrayLike) -> tuple[float, float]:
    """The lowest and the highest of some values; both NaN where one is, or where there is none."""
    known = np.asarray(values, np.float64)
    if not known.size:
        return float("nan"), float("nan")
    return float(np.min(known)), float(np.max(known))


RAN = "every scene has to run"


def did_not_run(what: str, backend: str, problem: hc.HertzchainError | str) -> Row:
    """A row that fails in place of those of a scene that could not be simulated."""
    nan = float("nan")
    return Row(f"{what}: {problem}", backend, nan, nan, 0.0, False, RAN)


def problems_as_text(table: pandas.DataFrame) -> pandas.DataFrame:
    """A table whose column ``problem`` is text, also where it was read from a file without any."""
    return table.assign(problem=table["problem"].astype(object).fillna(""))


def pulse_of(scene: hc.Scene) -> tuple[hc.Pulse, float]:
    """The pulse of a scene that has one, and its t0 [s]."""
    pulse, rise_time = scene.shock, scene.rise_time
    assert isinstance(pulse, hc.Pulse)
    assert rise_time is not None
    return pulse, rise_time


def eq3(scene: hc.Scene, wave_force: float) -> float:
    """Number p of granules by Eq. 3, not rounded, with F_SW [N] of a simulation."""
    return theory.transition_granules(scene.chain, *pulse_of(scene), wave_force)


def effective_ratio(scene: hc.Scene) -> float:
    """What Eq. 6 raises to a power: LM_ratio, with Delta L where it is below 1."""
    return theory.effective_momentum_ratio(scene.chain, *pulse_of(scene))


def history_of(result: hc.Result) -> History:
    """The history of a run that has recorded one."""
    assert result.history is not None
    return result.history


Found = dict[tuple[str, str], hc.Result | hc.HertzchainError]
"""A result, or why there is none, for each (name of the scene, backend)."""


def load(name: str) -> hc.Scene:
    """A scene that is shipped."""
    return hc.Scene.from_toml(HERE / "scenes" / f"{name}.toml")


def simulate(
    scenes: Mapping[str, hc.Scene],
    label: str,
    with_lammps: bool,
    lammps: hc.Lammps | None = None,
    native: hc.Native | None = None,
) -> Found:
    """Run scenes, by their names, with both backends, LAMMPS in a process of its own.

    By default with steps small enough for 1e-6, and with the reference method. The progress bar has
    a label.
    """
    found: Found = {}
    by_lammps = run_many(scenes.values(), lammps) if with_lammps else None
    for name, scene in progress(scenes.items(), label):
        try:
            found[name, "native"] = (native or hc.Native("reference")).run(scene)
        except hc.HertzchainError as problem:
            found[name, "native"] = problem
        if by_lammps is not None:
            found[name, "lammps"] = beside = next(by_lammps)
            if isinstance(beside, BackendMissing):
                raise beside
    return found


def progress(work: Iterable[_Any], label: str) -> Iterable[_Any]:
    """The same, with a bar on a terminal that says how much is done."""
    console = Console(stderr=True)
    return track(work, label, console=console, transient=True, disable=not console.is_terminal)


def output(width: int = 120) -> Console:
    """Standard output; a pipe, which has no width to fit a table into, has at least this one."""
    console = Console(highlight=False, markup=False)
    if not console.is_terminal:
        console.width = max(console.width, width)
    return console


def print_rows(title: str, rows: Sequence[Row]) -> None:
    """Print a table that a person can read, and how many rows passed.

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
