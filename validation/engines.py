"""LAMMPS, LIGGGHTS and Yade beside native velocity Verlet, at the same steps, on every table scene.

Three codes with three pair laws, three integrators and three authors find the same peaks. What they
found is kept in ``validation/results/engines.csv``, to be read without installing them; a test
computes the native column again and holds the others against it.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pandas

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.files import check_writable, write_text
from hertzchain.observables.peaks import largest_difference
from validation.rows import Row, print_rows, progress, row
from validation.script import dated, facts_of, leave_with
from validation.shipped import HERE, load, table_scenes

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
    return sorted(table_scenes())


def native_peaks(scene: hc.Scene, dt: float) -> FloatArray:
    """Peaks by native velocity Verlet [N], shape (contacts,)."""
    return hc.Native("velocity-verlet", dt).run(scene).peak_force


def measure(quick: bool) -> tuple[str, list[Row]]:
    """The peaks by every engine on every scene (quick: three) as CSV, and a row for each of both.

    The first line of the table says what ran.
    """
    lines, rows, versions = [], [], {"hertzchain": hc.__version__}
    for name in progress(names()[::8] if quick else names(), TITLE):
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
    columns = ["scene", "contact", "dt_s", *(f"{who}_N" for who in ("native", *ENGINES))]
    table = pandas.DataFrame(lines, columns=columns).to_csv(index=False)
    return dated(facts_of(versions), table), rows


def recorded(path: Path = RECORDED) -> dict[str, tuple[float, dict[str, FloatArray]]]:
    """The step [s] and the peaks of each engine [N] that were recorded, by scene."""
    table = pandas.read_csv(path, comment="#")
    return {
        str(name): (
            float(own["dt_s"].iloc[0]),
            {who: own[f"{who}_N"].to_numpy(np.float64) for who in ("native", *ENGINES)},
        )
        for name, own in table.groupby("scene", sort=False)
    }


def run() -> bool:
    """Print the largest differences; whether none is too large."""
    parser = argparse.ArgumentParser(description=TITLE)
    parser.add_argument("--quick", action="store_true", help="three scenes")
    parser.add_argument("-o", "--output", type=Path, help="write the peaks as CSV")
    chosen = parser.parse_args()
    if chosen.output is not None:
        check_writable(chosen.output)
    text, rows = measure(chosen.quick)
    print_rows(TITLE, rows)
    if chosen.output is not None:
        write_text(chosen.output, text)
    return all(entry.passed for entry in rows)


if __name__ == "__main__":
    leave_with(run)
