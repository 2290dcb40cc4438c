"""LAMMPS, LIGGGHTS and Yade against native velocity Verlet at the same steps, on every table scene.

One more scene has damped contacts, unlike granules, a striker and a wall.

Three codes with three pair laws, three integrators and three authors find the same peaks. Their
peaks are kept in ``validation/results/engines.csv``, which can be read without installing them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pandas

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.observables.peaks import largest_difference
from validation.script import Row, Script, progress, row
from validation.shipped import STEEL, load, table_scenes

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

ENGINES: Mapping[str, Callable[[float], hc.Lammps | hc.Liggghts | hc.Yade]] = {
    "lammps": hc.Lammps,
    "liggghts": hc.Liggghts,
    "yade": hc.Yade,
}


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


def measure(quick: bool, _: bool) -> pandas.DataFrame:
    """The peaks by every engine on the 25 scenes (quick: four), and their versions as attributes.

    Columns scene, contact, dt_s, and the peak [N] by each. BackendMissing where an engine is not
    here.
    """
    tables: list[pandas.DataFrame] = []
    versions: dict[str, str] = {}
    names = [*sorted(table_scenes()), DAMPED]
    for name in progress(names[::8] if quick else names, TITLE):
        scene = scene_of(name)
        dt, contacts = step_of(scene), scene.chain.granules - 1
        columns = {"scene": name, "contact": np.arange(contacts) + 2, "dt_s": dt}
        columns["native_N"] = native_peaks(scene, dt)
        for engine, make in ENGINES.items():
            result = make(dt).run(scene)
            versions.update(result.versions)
            columns[f"{engine}_N"] = result.peak_force[:contacts]
        tables.append(pandas.DataFrame(columns))
    table = pandas.concat(tables, ignore_index=True)
    table.attrs.update(versions)
    return table


def promises(table: pandas.DataFrame) -> list[Row]:
    """A row for the peaks of each scene by each engine."""
    return [
        row(
            str(name),
            engine,
            largest_difference(frame[f"{engine}_N"].to_numpy(), frame["native_N"].to_numpy()),
            0.0,
            AGREED,
            REASON,
        )
        for name, frame in table.groupby("scene", sort=False)
        for engine in ENGINES
    ]


SCRIPTS = {
    "engines": Script(
        TITLE,
        "Do three codes with the same steps find the same peaks?",
        measure, promises,
    )
}  # fmt: skip
