"""LAMMPS, LIGGGHTS and Yade against native velocity Verlet at the same steps, on every table scene.

One more scene has damped contacts, unlike granules, a striker and a wall.

Three codes with three pair laws, three integrators and three authors find the same peaks. What they
found is kept in ``validation/results/engines.csv``, to be read without installing them; a test
computes the native column again and holds the others against it.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.files import check_writable, write_text
from hertzchain.observables.peaks import largest_difference
from validation.rows import Row, print_rows, progress, row
from validation.script import dated, facts_of, leave_with
from validation.shipped import HERE, STEEL, load, table_scenes

TITLE = "Every engine at the same steps, largest difference of a peak"

STEP = 0.02
"""Steps of the runs [natural time units]."""

DAMPED = "damped-dimer-striker-wall"
"""The scene with damped contacts."""

AGREED = 1e-7
"""Of every peak. 1.5e-8 measured, the same for all three codes, which agree to 1e-12 with one
another: they are read every 0.3 natural time units, and native at every step, so what is left is
the interpolation between readings. Those of the damped scene are read as native is: 1e-11."""

REASON = "same scheme, same steps, as a fraction of the peak: seven digits"

RECORDED = HERE / "results" / "engines.csv"

ENGINES: Mapping[str, Callable[[float], hc.Lammps | hc.Liggghts | hc.Yade]] = {
    "lammps": hc.Lammps,
    "liggghts": hc.Liggghts,
    "yade": hc.Yade,
}


def names() -> list[str]:
    """The 24 scenes of Tables 2, 3 and 4, and the one with damped contacts."""
    return [*sorted(table_scenes()), DAMPED]


def scene_of(name: str) -> hc.Scene:
    """The scene of a name."""
    if name != DAMPED:
        return load(name)
    light = {"young_modulus": 70e9, "poisson_ratio": 0.33, "density": 2700.0}
    material: Any = {key: [STEEL[key], value] * 10 for key, value in light.items()}
    scene = hc.Scene(
        hc.Chain(20, STEEL["radius"], **material),
        hc.Striker(1.0, radius=6e-3),
        wall=hc.Wall("rigid"),
        contact=hc.Contact("restitution", restitution=0.8),
    )
    return replace(scene, run=hc.Run(scene.end_time))


def step_of(scene: hc.Scene) -> float:
    """The largest step of the runs [s]."""
    return STEP * scene.contact_time


def native_peaks(scene: hc.Scene, dt: float) -> FloatArray:
    """Peaks between granules by native velocity Verlet [N], shape (N - 1,)."""
    return hc.Native("velocity-verlet", dt).run(scene).peak_force[: scene.chain.granules - 1]


def measure(quick: bool) -> tuple[str, list[Row]]:
    """The peaks by every engine on every scene (quick: four) as CSV, and a row for each of both.

    The first line of the table says what ran.
    """
    lines, rows, versions = [], [], {"hertzchain": hc.__version__}
    for name in progress(names()[::8] if quick else names(), TITLE):
        scene = scene_of(name)
        dt = step_of(scene)
        peaks = {"native": native_peaks(scene, dt)}
        for engine, make in ENGINES.items():
            result = make(dt).run(scene)
            peaks[engine] = result.peak_force[: scene.chain.granules - 1]
            versions.update(result.versions)
            difference = largest_difference(peaks[engine], peaks["native"])
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
    """Print the largest differences; return whether none is too large."""
    parser = argparse.ArgumentParser(description=TITLE)
    parser.add_argument("--quick", action="store_true", help="four scenes")
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
