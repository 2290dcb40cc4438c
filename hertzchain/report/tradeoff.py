"""The trade-off of a scene as a table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from hertzchain.report.console import table
from hertzchain.report.document import describe

if TYPE_CHECKING:
    from rich.console import Console

    from hertzchain.verdict.tradeoff import Row, Tradeoff


_ACCURACIES = tuple(float(f"1e-{k}") for k in range(2, 11))  # accuracies of the table


def print_tradeoff(console: Console, tradeoffs: Sequence[Tradeoff]) -> None:
    """Print the cheapest contender for each accuracy; several scenes: medians, worst errors."""
    from hertzchain.verdict.tradeoff import cheapest, typical

    title = f"{len(tradeoffs)} scenes: median times, and the errors of the worst"
    if len(tradeoffs) == 1:
        title = describe(tradeoffs[0].scene)
    console.print(title, style="bold", end="\n\n")
    floor = max(tradeoff.truth_error for tradeoff in tradeoffs)
    rows = [replace(point.row, error=point.highest) for point in typical(tradeoffs)]
    best = {
        wanted: min(reached.values(), key=lambda row: row.wall_time)
        for wanted in _ACCURACIES
        if (reached := cheapest(rows, wanted, floor))
    }
    console.print("The cheapest way to peaks of a wanted accuracy")
    header = ("right to", "contender", "with", "error", "force evaluations", "time [ms]")
    lines = [
        (
            _power(wanted),
            row.contender,
            _setting(row),
            f"{row.error:.1e}",
            f"{row.force_evaluations:,}",
            f"{1e3 * row.wall_time:.3g}",
        )
        for wanted, row in best.items()
    ]
    console.print(table(header, lines, left=("contender",)))
    console.print()
    console.print(
        "Time: the least of some runs, on code that is loaded and compiled. LAMMPS: with the"
        " creation of its instance,\nwithout estimating its error. rtol: the native solver chooses"
        " method and steps; its estimate takes more runs.\nThe truth is known to"
        f" {floor:.1g}."
    )


def _power(wanted: float) -> str:
    return f"{wanted:.0e}".replace("e-0", "e-")


def _setting(row: Row) -> str:
    if row.rtol is not None:
        return f"rtol {_power(row.rtol)}"
    if row.step is not None:
        return f"step {row.step:.3g} s"
    return f"step {row.natural_step:.3g} natural units"
