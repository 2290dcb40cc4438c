"""LAMMPS, LIGGGHTS and Yade beside native velocity Verlet, at the same steps, on every table scene.

Three codes with three pair laws, three integrators and three authors find the same peaks. What they
found is kept in ``validation/results/engines.csv``, to be read without installing them; a test
computes the native column anew and holds the others against it.
"""

from __future__ import annotations

import argparse
import csv
import io
import sys
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import track

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.files import check_writable, write_text
from hertzchain.observables.peaks import largest_difference
from validation.rows import HERE, Row, load, print_rows, row

TITLE = "Every engine at the same steps, largest difference of a peak"

STEP = 0.02
"""Natural time units."""

AGREED = 1e-7
"""Of every peak. 1.5e-8 measured, the same for all three codes, which agree to 1e-12 with one
another: they are read every 0.3 natural time units, and native at every step, so what is left is
the interpolation between readings."""

REASON = "same scheme, same steps, as a fraction of the peak: seven digits"

RECORDED = HERE / "results" / "engines.csv"

ENGINES: Mapping[str, Callable[[float], hc.Lammps | hc.Liggghts | hc.Yade]] = {
    "lammps": hc.Lammps,
    "liggghts": hc.Liggghts,
    "yade": hc.Yade,
}


def names() -> list[str]:
    """The 24 scenes of Tables 2, 3 and 4."""
    return sorted(path.stem for path in (HERE / "scenes").glob("*_LM*.toml"))


def native_peaks(scene: hc.Scene, dt: float) -> FloatArray:
    """Peaks by native velocity Verlet [N], shape (contacts,)."""
    return hc.Native("velocity-verlet", dt).run(scene).peak_force


def measure(quick: bool) -> tuple[str, list[Row]]:
    """Run every engine on every scene.

    Parameters
    ----------
    quick
        Three scenes only.

    Returns
    -------
    The table as CSV, whose first line says what ran, and a row for each scene and engine.

    Raises
    ------
    BackendMissing
        If one of the engines is not there.
    """
    lines, rows, versions = [], [], {"hertzchain": hc.__version__}
    console = Console(stderr=True)
    chosen = names()[::8] if quick else names()
    for name in track(
        chosen, TITLE, console=console, transient=True, disable=not console.is_terminal
    ):
        scene = load(name)
        dt = STEP * scene.units.time
        peaks = {"native": native_peaks(scene, dt)}
        for engine, make in ENGINES.items():
            result = make(dt).run(scene)
            peaks[engine] = result.peak_force
            versions.update(result.versions)
            difference = largest_difference(result.peak_force, peaks["native"])
            rows.append(row(name, engine, difference, 0.0, AGREED, REASON))
        lines += [
            [name, k + 2, repr(dt), *(f"{peaks[who][k]:.15g}" for who in peaks)]
            for k in range(scene.chain.granules - 1)
        ]
    text = io.StringIO()
    facts = "; ".join(f"{name} {version}" for name, version in versions.items())
    text.write(f"# {datetime.now(UTC):%Y-%m-%d}; {facts}\n")
    columns = ["native", *ENGINES]
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["scene", "contact", "dt_s", *(f"{name}_N" for name in columns)])
    writer.writerows(lines)
    return text.getvalue(), rows


def recorded(path: Path = RECORDED) -> dict[str, tuple[float, dict[str, FloatArray]]]:
    """The step [s] and the peaks of each engine [N] that were recorded, by scene."""
    with path.open(newline="", encoding="utf-8") as stream:
        entries = list(csv.DictReader(line for line in stream if not line.startswith("#")))
    found = {}
    for name in dict.fromkeys(entry["scene"] for entry in entries):
        own = [entry for entry in entries if entry["scene"] == name]
        peaks = {
            who: np.array([float(entry[f"{who}_N"]) for entry in own])
            for who in ("native", *ENGINES)
        }
        found[name] = float(own[0]["dt_s"]), peaks
    return found


def main() -> None:
    """Print the largest differences; exit 1 where one is too large, 2 without an engine."""
    parser = argparse.ArgumentParser(description=TITLE)
    parser.add_argument("--quick", action="store_true", help="three scenes")
    parser.add_argument("-o", "--output", type=Path, help="write the peaks as CSV")
    chosen = parser.parse_args()
    try:
        if chosen.output is not None:
            check_writable(chosen.output)
        text, rows = measure(chosen.quick)
        print_rows(TITLE, rows)
        if chosen.output is not None:
            write_text(chosen.output, text)
    except hc.HertzchainError as problem:
        print(f"{Path(sys.argv[0]).name}: {problem}", file=sys.stderr)
        sys.exit(2)
    sys.exit(0 if all(entry.passed for entry in rows) else 1)


if __name__ == "__main__":
    main()
