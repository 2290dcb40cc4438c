"""One solitary wave down 90,000 granules, a million steps: what drifts, by how much, and why.

Every native method at the same step, 0.1 natural time units. To measure anew what is kept in
``validation/results``::

    make long-run

The moving window keeps some 50 granules of 90,000, so that a million steps take seconds. It does
not under RK4 and DPRKN6: what the wave loses stays behind as motion of all granules that it passed,
none of them is ever quiet, and the cost grows as the square of the length. They go 5,000 granules,
which is enough to see a loss that is the same at each. LAMMPS goes 2,000: it moves all granules at
all steps, and would take some ten hours for 90,000.
"""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas
from rich.console import Console
from rich.progress import track
from rich.table import Table

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.files import write_with
from hertzchain.native import METHODS, simulate
from hertzchain.native.simulation import Simulation
from hertzchain.scene import Run
from hertzchain.theory.solitary_wave import solitary_wave
from validation.rows import STEEL, Measurement, Row, row

TITLE = "A wave down 90,000 granules"

STEP = 0.1
"""Natural time units."""

_DEPTH = 0.1
"""(F0 / A)^(2/3) in radii: so deep that LAMMPS loses few digits to its absolute coordinates."""

_WINDOW = 500
"""Contacts whose highest peak is the amplitude: steps and contacts beat, and peaks with them."""

_START = 500
"""Contacts before that are not looked at: the wave has yet to run away from all others."""

FLOOR = 1e-16
"""What is drawn of a drift that is 0."""


@dataclass(frozen=True)
class Contender:
    """Who carries a wave, and how far.

    Parameters
    ----------
    name
        How it is called.
    method
        One of METHODS; LAMMPS otherwise.
    step
        Natural time units.
    marks
        Numbers of contacts, increasing; the chain is a little longer than the last.
    """

    name: str
    method: str
    step: float
    marks: tuple[int, ...]


_FAR = (1_000, 2_000, 5_000, 10_000, 20_000, 50_000, 89_900)
_LOSSY = (1_000, 2_000, 3_000, 4_900)
_BESIDE = (1_000, 1_900)
BESIDE_LAMMPS = "velocity-verlet, as long as LAMMPS"


def contenders(quick: bool) -> list[Contender]:
    """Everyone at the same step, the reference at half of it too, the lossy at twice."""
    far = (1_000, 1_500, 2_000, 2_900) if quick else _FAR
    lossy = (1_000, 1_250, 1_500) if quick else _LOSSY
    beside = (1_000,) if quick else _BESIDE
    return [
        Contender("velocity-verlet", "velocity-verlet", STEP, far),
        Contender("srkn-6b", "srkn-6b", STEP, far),
        Contender("srkn-11b", "srkn-11b", STEP, far),
        Contender("reference", "reference", STEP, far),
        Contender("reference, half the step", "reference", STEP / 2, far),
        Contender("rk4", "rk4", STEP, lossy),
        Contender("rk4, twice the step", "rk4", 2 * STEP, (1_000, 1_500)),
        Contender("dprkn-6", "dprkn-6", STEP, lossy),
        Contender("dprkn-6, twice the step", "dprkn-6", 2 * STEP, (1_000, 1_500)),
        Contender(BESIDE_LAMMPS, "velocity-verlet", STEP, beside),
        Contender("LAMMPS", "LAMMPS", STEP, beside),
    ]


def scene_of(contender: Contender, end_time: float | None = None) -> hc.Scene:
    """Nearly one wave, 1.02 F0 high: a cosine pulse of its momentum. The end in natural units."""
    granules = contender.marks[-1] + 100
    chain = hc.Chain(granules, **STEEL)
    force = chain.contact_stiffness * (_DEPTH * chain.radius) ** 1.5
    scene = hc.Scene(chain, hc.Pulse("cosine", force, 2.0, momentum_ratio=1.0))
    if end_time is None:  # when the wave is at the last granule but for some
        end_time = (granules - 20) / (solitary_wave().speed * 1.0035)
    return replace(scene, run=Run(end_time * scene.units.time))


def by_native(contender: Contender) -> pandas.DataFrame:
    """A row for each mark; totals of momentum and energy come from runs that end there."""

    def run(end_time: float | None = None) -> Simulation:
        scene = scene_of(contender, end_time)
        legs = scene.schedule(contender.step * scene.units.time)
        return simulate(scene, legs, METHODS[contender.method].walker, leave_behind=True)

    whole = run()
    impulse = scene_of(contender).impulse / scene_of(contender).units.momentum
    table = wave_at(contender, whole.peaks.force, whole.peaks.time)
    ends = [run(whole.peaks.time[mark - 2]) for mark in contender.marks]
    table["momentum"] = [float(end.momentum) / impulse - 1 for end in ends]
    table["energy"] = [float(end.energy) for end in ends]
    stages = METHODS[contender.method].walker.stepper.stages
    table["kicks"] = [stages * end.steps for end in ends]
    return table


def by_lammps(contender: Contender) -> pandas.DataFrame:
    """A row for each mark; totals at the last only."""
    scene = scene_of(contender)
    units = scene.units
    result = hc.Lammps(contender.step * units.time).run(scene)
    table = wave_at(contender, result.peak_force / units.force, result.peak_time / units.time)
    nowhere = [math.nan] * (len(contender.marks) - 1)
    balance = result.balance
    table["momentum"] = [*nowhere, balance.momentum / balance.impulse - 1]
    table["energy"] = [*nowhere, balance.energy / units.energy]
    table["kicks"] = [*nowhere, result.steps]
    return table


def wave_at(contender: Contender, force: FloatArray, time: FloatArray) -> pandas.DataFrame:
    """Amplitude, speed and what theory says of the two, at each mark.

    Parameters
    ----------
    contender
        Whose marks.
    force, time
        Peaks, natural units, shape (contacts,), from contact 2 on.
    """
    rows = []
    before = _START
    for mark in contender.marks:
        span = slice(before - 2, mark - 2)
        speed = (mark - before) / (time[mark - 2] - time[before - 2])
        exact = solitary_wave().speed * np.mean(force[span] ** (1 / 6))
        amplitude = np.max(force[mark - 2 - _WINDOW : mark - 2])
        slope = np.polyfit(np.arange(mark - before), np.log(force[span]), 1)[0]
        rows.append(
            (contender.name, contender.step, mark, amplitude, speed, speed / exact - 1, -slope)
        )
        before = mark
    columns = ["contender", "step", "granule", "amplitude", "speed", "relation", "loss"]
    return pandas.DataFrame(rows, columns=columns)


def measure(quick: bool = False, with_lammps: bool = True) -> pandas.DataFrame:
    """Everyone's wave at each mark.

    Parameters
    ----------
    quick
        Some 3,000 granules instead of 90,000.
    with_lammps
        Whether to run LAMMPS.

    Returns
    -------
    Columns contender, step, granule, amplitude (the highest peak of the last 500 contacts),
    speed (since the mark before), relation (speed over that of an exact wave of the same peaks,
    less 1), loss (of the peaks, per granule, since the mark before), momentum (over the impulse,
    less 1), energy, and kicks (force evaluations); natural units.
    """
    console = Console(stderr=True)
    tables = []
    for contender in track(
        contenders(quick), TITLE, console=console, transient=True, disable=not console.is_terminal
    ):
        if contender.method in METHODS:
            tables.append(by_native(contender))
        elif with_lammps:
            tables.append(by_lammps(contender))
    return pandas.concat(tables, ignore_index=True)


def drift(table: pandas.DataFrame, contender: str, quantity: str) -> FloatArray:
    """How far a quantity is from what it was at the first mark, as a fraction, at each mark."""
    own = table.loc[table["contender"] == contender, quantity].to_numpy(np.float64)
    return np.asarray(own / own[0] - 1)
