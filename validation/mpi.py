"""One chain on several MPI ranks: cost of a step compared with one rank, and equal peaks.

It needs a LAMMPS binary with the ``mpiexec`` of its MPI beside it or on the search path, and a
machine that does nothing else: ranks wait for one another at each step. All of it, in some ten
minutes::

    .venv/bin/python validation/mpi.py -o mpi.csv

and on a machine with more cores, or on a node of a cluster, with ``--ranks 2 4 8 16``.
"""

from __future__ import annotations

import argparse
import itertools
import os
import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
import pandas

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.decks.known_answer import known_answer, lay_out
from hertzchain.decks.standalone import standalone
from hertzchain.engines.lammps.binary import Program
from hertzchain.errors import RunFailed, require
from hertzchain.files import check_writable, write_text
from hertzchain.limits import Deadline
from hertzchain.observables.peaks import largest_difference
from validation.rows import Row, print_rows, progress, row
from validation.script import dated, leave_with
from validation.shipped import STEEL

TITLE = "One chain on several MPI ranks"

STEP = 0.01
"""Natural time units: what 1e-4 of the peaks takes, which is what a long chain is run with."""

WATCH = 2
"""Steps between two samples of the overlaps, as in the long chain of the gallery."""

STEPS: dict[int, int] = {60: 9_000, 1_000: 6_000, 10_000: 900, 100_000: 120, 1_000_000: 30}
"""Steps after the pulse that are timed, by the number of granules; a full run takes about 150 for
each granule."""

REPEATS = 6
"""Of which the shortest counts; of a million granules, which take minutes, a third of them."""

LONGEST = 3600.0
"""Seconds for one run, which takes half a minute at most."""

SAME = 1e-12
"""Of a peak."""

REASON = "the same forces are added in the same order, whoever computes them"

NOT_WATCHING = "deck, not watching"


@dataclass(frozen=True, eq=False)
class Timing:
    """One run."""

    seconds: float  # wall time
    processor_seconds: float  # of all its processes; ranks that wait use their processor
    peaks: FloatArray | None  # peak forces [N], shape (contacts,); None where a deck does not watch


Way = Callable[[hc.Scene, Program], Timing]


def scene_of(granules: int, steps: int) -> hc.Scene:
    """A short pulse, and so many steps after it."""
    pulse = hc.Pulse("triangular", 100.0, 2.0, momentum_ratio=0.1)
    scene = hc.Scene(hc.Chain(granules, **STEEL), pulse)
    end = scene.ramps[-1].end + (steps - 0.5) * STEP * scene.units.time
    return replace(scene, run=hc.Run(end))


def timed(go: Callable[[], FloatArray | None]) -> Timing:
    """Time what hands back peaks."""
    begin, before = time.perf_counter(), os.times()[:4]
    peaks = go()
    spent, after = time.perf_counter() - begin, os.times()[:4]
    return Timing(spent, sum(after) - sum(before), peaks)


def by_run(scene: hc.Scene, program: Program) -> Timing:
    """Run a scene once, as ``hertzchain run --backend lammps --lmp --ranks`` does."""
    lmp = program.command[-1]
    lammps = hc.Lammps(STEP * scene.units.time, lmp=lmp, ranks=program.ranks, time_limit=LONGEST)
    return timed(lambda: lammps.peaks_alone(scene)[0])


@cache
def _deck(scene: hc.Scene, watch: int) -> str:
    layout = lay_out(scene, dt=STEP * scene.units.time, watch_every=watch)
    return standalone(scene, layout, known_answer(scene, layout))


def by_deck(watch: int) -> Way:
    """Run a deck of ``hertzchain deck`` by itself; one that watches must pass."""

    def run(scene: hc.Scene, program: Program) -> Timing:
        text = _deck(scene, watch)
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "in.chain").write_text(text, encoding="ascii")
            found = timed(lambda: _run_deck(program, Path(folder)))
            if watch == 0:
                return found
            peaks = np.loadtxt(Path(folder) / "peaks.csv", delimiter=",", skiprows=1)[:, 1]
            return replace(found, peaks=peaks)

    return run


def _run_deck(program: Program, folder: Path) -> None:
    command = [*program.command, "-in", "in.chain", "-log", "none"]
    done = subprocess.run(  # noqa: S603
        command, cwd=folder, capture_output=True, text=True, check=False
    )
    if done.returncode != 0:
        said = (done.stdout + done.stderr).strip().splitlines()
        raise RunFailed(f"{' '.join(command)}: {said[-1] if said else 'says nothing'}")


WAYS: Mapping[str, Way] = {"run": by_run, "deck": by_deck(WATCH), NOT_WATCHING: by_deck(0)}


def measure(
    lmp: str, ranks: Sequence[int], granules: Sequence[int], repeats: int
) -> tuple[pandas.DataFrame, str]:
    """Times of every way on every number of granules and ranks, one rank first; which LAMMPS.

    A step is what a longer run takes more than one that ends after the pulse, so that starting
    LAMMPS and making the chain are left out. Runs to be compared take turns. A processor share,
    over wall time and ranks, of less than about 0.9 in a deck tells that others were on the
    machine; in a run, that Python read by itself what the ranks had written.
    """
    programs = [Program.find(lmp, count, Deadline(LONGEST)) for count in sorted({1, *ranks})]
    build = programs[0].build
    lines: list[dict[str, float | str]] = []
    for size, way in progress([(size, way) for size in granules for way in WAYS], TITLE):
        lines += compared(size, way, programs, max(1, repeats // 3) if size > 100_000 else repeats)
    return pandas.DataFrame(lines), f"LAMMPS {build.version} with {build.mpi}"


def compared(
    granules: int, way: str, programs: Sequence[Program], repeats: int
) -> list[dict[str, float | str]]:
    """One way on one chain, by each program, the first of which has one rank."""
    few, steps = 10, STEPS[granules]
    scenes = scene_of(granules, few), scene_of(granules, few + steps)
    best: dict[tuple[int, int], Timing] = {}
    for _, k, at in itertools.product(range(repeats), range(len(programs)), (0, 1)):
        found = WAYS[way](scenes[at], programs[k])
        if (k, at) not in best or found.seconds < best[k, at].seconds:
            best[k, at] = found
    each = [(best[k, 1].seconds - best[k, 0].seconds) / steps for k in range(len(programs))]
    lines: list[dict[str, float | str]] = []
    for k, program in enumerate(programs):
        last, alone = best[k, 1], best[0, 1].peaks
        lines.append({
            "granules": granules, "way": way, "ranks": program.ranks, "steps": steps,
            "seconds_per_step": each[k], "gain": each[0] / each[k],
            "processor_share": last.processor_seconds / last.seconds / program.ranks,
            "peak_difference": float("nan") if last.peaks is None or alone is None
            else largest_difference(last.peaks, alone),
        })  # fmt: skip
    return lines


def promises(table: pandas.DataFrame) -> list[Row]:
    """Return checks that hold on every machine: equal peaks, not times."""
    on_ranks = table[(table["ranks"] > 1) & (table["way"] != NOT_WATCHING)]
    rows = []
    for entry in on_ranks.to_dict("records"):
        what = f"{entry['way']}, {entry['granules']:,} granules on {entry['ranks']} ranks, peaks"
        rows.append(row(what, "lammps", entry["peak_difference"], 0.0, SAME, REASON))
    return rows


def machine() -> str:
    """The processor and how many of its cores are here; not whose they are."""
    name = platform.machine()
    facts = Path("/proc/cpuinfo")
    if facts.exists():
        lines = facts.read_text(encoding="utf-8").splitlines()
        models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
        name = models[0] if models else name
    return f"{name}, {os.cpu_count()} cores"


def default_lmp() -> str:
    """Return the binary that HERTZCHAIN_LMP names, or the one in the folder of this Python."""
    return os.environ.get("HERTZCHAIN_LMP") or str(Path(sys.executable).parent / "lmp")


def run() -> bool:
    """Print the table; return whether peaks are equal."""
    parser = argparse.ArgumentParser(description=TITLE)
    parser.add_argument("--lmp", default=default_lmp(), help="the binary")
    parser.add_argument("--ranks", type=int, nargs="+", default=[2], help="beside one rank")
    parser.add_argument(
        "--granules", type=int, nargs="+", choices=list(STEPS), default=list(STEPS), metavar="N",
        help=f"some of {', '.join(map(str, STEPS))}; all by default",
    )  # fmt: skip
    parser.add_argument("--repeats", type=int, default=REPEATS, help=f"of each run; {REPEATS}")
    parser.add_argument("-o", "--output", type=Path, help="write the table as CSV")
    chosen = parser.parse_args()
    require(min(chosen.ranks) >= 1, "ranks", min(chosen.ranks), "must be at least 1")
    require(chosen.repeats >= 1, "repeats", chosen.repeats, "must be at least 1")
    if chosen.output is not None:
        check_writable(chosen.output)
    table, lammps = measure(chosen.lmp, chosen.ranks, chosen.granules, chosen.repeats)
    print(table.to_string(index=False, float_format="{:.3g}".format))
    rows = promises(table)
    print_rows(TITLE, rows)
    if chosen.output is not None:
        facts = f"{machine()}; {lammps}; hertzchain {hc.__version__}"
        write_text(chosen.output, dated(facts, table.to_csv(index=False, float_format="%.6g")))
    return all(entry.passed for entry in rows)


if __name__ == "__main__":
    leave_with(run)
