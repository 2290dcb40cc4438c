"""Error against cost of every method for peaks, on all 24 scenes of the paper's tables.

``make tradeoff`` measures again what is kept in ``validation/results``, on an idle machine.
"""

from __future__ import annotations

import argparse
import functools
import sys
from collections.abc import Sequence
from pathlib import Path

import pandas

import hertzchain as hc
from hertzchain.engines.lammps.isolation import Child
from hertzchain.errors import BackendMissing
from hertzchain.files import check_writable, write_text
from hertzchain.report.figures import plot_tradeoff
from hertzchain.report.tradeoff import print_tradeoff
from hertzchain.verdict.tradeoff import Tradeoff, provenance, tradeoff
from validation.rows import Row, did_not_run, output, print_rows, progress, row
from validation.script import dated, facts_of
from validation.shipped import load, table_scenes

TITLE = "Error against cost"

ENOUGH = 0.02
"""Seconds for which each run is repeated, twice over; there are 24 scenes."""

ASKED = "the accuracy that was asked for"
OTHER = "asked for 1e-12, but nothing tells it where contacts open: 4e-10 is seen"
KNOWN = "ten times what is claimed of the paper's scenes"


LONGEST = 3600.0
"""Seconds for one scene, which takes half a minute."""


def measure(quick: bool = False) -> dict[str, Tradeoff | hc.HertzchainError]:
    """Measure every contender on every scene, in a process that LAMMPS may crash, or its failure.

    The quick form has one scene, and no run repeated for the sake of its time. BackendMissing if
    LAMMPS is not there.
    """
    names = sorted(table_scenes())
    found: dict[str, Tradeoff | hc.HertzchainError] = {}
    with Child() as child:
        for name in progress(names[:1] if quick else names, TITLE):
            scene = load(name)
            how = functools.partial(tradeoff, scene, enough=0.0 if quick else ENOUGH)
            try:
                one: Tradeoff = child.call(how, time_limit=LONGEST)
            except hc.HertzchainError as problem:
                found[name] = problem
                continue
            if one.missing:
                raise BackendMissing("; ".join(one.remarks))
            found[name] = one
    return found


def table_of(tradeoffs: dict[str, Tradeoff]) -> pandas.DataFrame:
    """Return all rows of all scenes, with the scene first and the error of its truth last."""
    frames = {
        name: one.to_frame().assign(truth_error=one.truth_error) for name, one in tradeoffs.items()
    }
    return pandas.concat(frames, names=["scene"]).reset_index("scene").reset_index(drop=True)


def promises(table: pandas.DataFrame) -> list[Row]:
    """Return checks that hold on every machine: errors, not times."""
    rows = []
    asked = table[table["contender"] == "rtol, with estimate"]
    for rtol in sorted(asked["rtol"].unique(), reverse=True):
        worst = asked.loc[asked["rtol"] == rtol, "error"].max()
        rows.append(row(f"rtol {rtol:g}, worst scene", "native", worst, 0.0, rtol, ASKED))
    tightest = table[(table["engine"] == "SciPy") & (table["rtol"] == table["rtol"].min())]
    worst = tightest["error"].max()
    rows.append(row("the truth by DOP853, worst scene", "SciPy", worst, 0.0, 1e-9, OTHER))
    known = table["truth_error"].max()
    rows.append(row("what is known of the truth", "native", known, 0.0, 1e-11, KNOWN))
    return rows


def write(folder: Path, tradeoffs: dict[str, Tradeoff]) -> None:
    """Write ``tradeoff.csv``, whose first line has date, versions and machine, and the plot.

    Read it with ``pandas.read_csv(path, comment="#")``.
    """
    csv = table_of(tradeoffs).to_csv(index=False, float_format="%.4g")
    write_text(folder / "tradeoff.csv", dated(facts_of(provenance()), csv))
    plot_tradeoff(list(tradeoffs.values())).write(folder / "tradeoff.png")


def run(arguments: Sequence[str]) -> int:
    """Measure, print, write if asked; return the exit status, 1 if a check fails."""
    parser = argparse.ArgumentParser(description=TITLE)
    parser.add_argument("--quick", action="store_true", help="one scene, each run once or twice")
    parser.add_argument(
        "-o", "--output", type=Path, metavar="FOLDER", help="write tradeoff.csv and tradeoff.png"
    )
    chosen = parser.parse_args(arguments)
    try:
        if chosen.output is not None:
            for name in ("tradeoff.csv", "tradeoff.png"):
                check_writable(chosen.output / name)
        measured = measure(chosen.quick)
        tradeoffs = {name: one for name, one in measured.items() if isinstance(one, Tradeoff)}
        rows = [
            did_not_run(name, "all", one)
            for name, one in measured.items()
            if not isinstance(one, Tradeoff)
        ]
        whole = not rows
        if tradeoffs:
            rows += promises(table_of(tradeoffs))
            print_tradeoff(output(), list(tradeoffs.values()))
        print()
        print_rows(f"{TITLE}: what has to hold", rows)
        if chosen.output is not None and whole:
            write(chosen.output, tradeoffs)
    except hc.HertzchainError as problem:
        print(f"tradeoff.py: {problem}", file=sys.stderr)
        return 2
    return 0 if all(entry.passed for entry in rows) else 1


if __name__ == "__main__":
    sys.exit(run(sys.argv[1:]))
