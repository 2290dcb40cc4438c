"""Shipped scenes and tables, results of both backends for scenes, and Eqs. 3 and 6."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from pathlib import Path

import numpy as np

import hertzchain as hc
from hertzchain import theory
from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.backend import run_in
from hertzchain.engines.lammps.engine import Child
from hertzchain.errors import RunFailed
from hertzchain.observables.samples import History
from validation.script import progress

HERE = Path(__file__).parent

STEEL = {"radius": 4.75e-3, "young_modulus": 193e9, "poisson_ratio": 0.3, "density": 7958.0}
"""The paper's granules (section 5.2), where a script makes its own scenes."""


def paper_table(number: int) -> list[dict[str, str]]:
    """The rows of one of the paper's tables as they are printed."""
    with (HERE / "paper" / f"table{number}.csv").open(newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


def scene_name(entry: dict[str, str]) -> str:
    """The scene file of a row of a table, without its suffix."""
    return f"{entry['profile']}_LM{entry['momentum_ratio']}_n{entry['duration_ratio']}"


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
    """Return the base of the power in Eq. 6: LM_ratio, with Delta L added below 1."""
    return theory.effective_momentum_ratio(scene.chain, *pulse_of(scene))


def by_formulas(scene: hc.Scene, p: int, wave_force: float) -> tuple[FloatArray, FloatArray]:
    """Peak forces of contacts 2 to p by Eqs. 6 and 9, in the unit of F_SW."""
    contact, n = np.arange(2, p + 1), pulse_of(scene)[0].duration_ratio
    eq6 = theory.peak_force(contact, p, wave_force, n, effective_ratio(scene))
    return eq6, theory.peak_force_cubic(contact, p, float(eq6[0]), wave_force)


def history_of(result: hc.Result) -> History:
    """The history of a run that has recorded one."""
    assert result.history is not None
    return result.history


def table_scenes() -> list[str]:
    """Names of the 24 scenes of Tables 2, 3 and 4, in this order."""
    entries = (entry for number in (2, 3, 4) for entry in paper_table(number))
    return list(dict.fromkeys(map(scene_name, entries)))


Found = dict[tuple[str, str], hc.Result]
"""A result for each (name of the scene, backend)."""


def of_scene(results: Found, name: str) -> dict[str, hc.Result]:
    """The results of one scene, by backend."""
    return {backend: result for (scene, backend), result in results.items() if scene == name}


def load(name: str) -> hc.Scene:
    """A scene that is shipped."""
    return hc.Scene.from_toml(HERE / "scenes" / f"{name}.toml")


def simulate(
    scenes: Mapping[str, hc.Scene], label: str, with_lammps: bool, lammps: hc.Lammps | None = None
) -> Found:
    """Run scenes, by their names, with both backends, LAMMPS in a process of its own.

    LAMMPS takes steps small enough for 1e-6 by default. The progress bar has a label. RunFailed
    names the scene that did not run.
    """
    results: Found = {}
    with Child() as child:
        for name, scene in progress(scenes.items(), label):
            try:
                results[name, "native"] = hc.Native("reference").run(scene)
                if with_lammps:
                    results[name, "lammps"] = run_in(child, lammps or hc.Lammps(), scene)
            except hc.HertzchainError as problem:
                raise RunFailed(f"{name}: {problem}") from None
    return results
