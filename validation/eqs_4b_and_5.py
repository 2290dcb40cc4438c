"""Eqs. 4b and 5 at each contact of the transition, in the 24 scenes of Tables 2 to 4.

Eq. 4b gives the time between the peaks of neighbouring contacts: to the next peak, or since the one
before. By Eq. 5, from which Eq. 6 follows, each contact of the transition passes on the momentum of
the wave: its force, integrated over the run, or over its first pulse, which ends when the contact
opens or when the next wave arrives.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pandas
from matplotlib.figure import Figure
from scipy.interpolate import make_interp_spline
from scipy.optimize import brentq

import hertzchain as hc
from hertzchain import theory
from hertzchain.arrays import FloatArray
from hertzchain.theory import paper
from validation.script import Row, Script, by_ends, largest, new_figure, row
from validation.shipped import history_of, load, pulse_of, simulate, table_scenes

TITLE = "Eqs. 4b and 5 in the transition"

QUICK = ("cosine_LM0.3_n2", "cosine_LM0.7_n8", "cosine-triangular_LM0.8_n8", "cosine_LM1.4_n2",
         "cosine-triangular_LM1.4_n6", "cosine-triangular_LM2.0_n2", "cosine_LM2.5_n8")  # fmt: skip
"""Scenes with the smallest and the largest results."""

AFTER = "Eq. 4b against t_{i+1} - t_i [%]"
BEFORE = "Eq. 4b against t_i - t_{i-1} [%]"
WHOLE = "integral of F_i / L_SW - 1 [%]"
FIRST_PULSE = "first pulse of F_i / L_SW - 1 [%]"

_SPACING = 0.05
"""Time between samples of the force of a contact, natural units."""


def measure(quick: bool, with_lammps: bool) -> pandas.DataFrame:
    """Errors of both equations at contacts 2 to p of each scene; in the quick form of 7 scenes.

    Columns scene, momentum_ratio, backend, contact, shift (to the next peak, natural units), and
    those named AFTER, BEFORE (NaN at contact 2: contact 1 is the shock), WHOLE, and FIRST_PULSE
    (native alone).
    """
    scenes = {name: load(name) for name in (QUICK if quick else table_scenes())}
    results = simulate(scenes, TITLE, with_lammps, hc.Lammps(extrapolated=True))
    tables = [_at_contacts(*key, result) for key, result in results.items()]
    return pandas.concat(tables, ignore_index=True)


def _at_contacts(name: str, backend: str, result: hc.Result) -> pandas.DataFrame:
    scene, unit, p = result.scene, result.scene.units, result.transition_granules
    assert p is not None
    contact, inside = np.arange(2, p + 1), slice(p - 1)
    force, time = result.peak_force / unit.force, result.peak_time / unit.time
    n = pulse_of(scene)[0].duration_ratio
    by_eq4b = theory.peak_shift(contact, force[inside], p, n, scene.momentum_ratio)
    shift = np.diff(time)[inside]
    # All granules ahead of a contact have their momentum from it.
    handed_on = np.cumsum(result.velocity[::-1])[::-1][1:][inside] / unit.velocity
    wave = float(paper.wave_momentum(force[p - 1]))
    pulses = _first_pulses(scene, time[p + 4], p) if backend == "native" else np.nan
    columns = {
        "scene": name, "momentum_ratio": scene.momentum_ratio, "backend": backend,
        "contact": contact, "shift": shift,
        AFTER: 100 * (by_eq4b / shift - 1),
        BEFORE: 100 * (by_eq4b / np.append(np.nan, shift[:-1]) - 1),
        WHOLE: 100 * (handed_on / wave - 1),
        FIRST_PULSE: 100 * (pulses / wave - 1),
    }  # fmt: skip
    return pandas.DataFrame(columns)


def _first_pulses(scene: hc.Scene, end: float, p: int) -> FloatArray:
    """Integrals of the first pulses of contacts 2 to p until a time, natural units.

    The second wave is at contact p long before the first is at p + 6.
    """
    time, unit = np.arange(0.0, end, _SPACING), scene.units
    history = history_of(hc.Native("reference").run(scene, record=time * unit.time))
    forces = history.contact_force[:, : p - 1].T / unit.force
    return np.array([until_first_minimum(time, force) for force in forces])


def until_first_minimum(time: FloatArray, force: FloatArray) -> float:
    """Integral of a force over time, from the start to its minimum after its maximum.

    At the minimum the contact opens, or the next wave arrives before.
    """
    curve, k = make_interp_spline(time, force, k=5), int(np.argmax(force)) + 1
    while force[k + 1] < force[k]:
        k += 1
    end = time[k]
    if force[k] > 0:
        slope = curve.derivative()
        end = brentq(lambda t: float(slope(t)), time[k - 1], time[k + 1])
    return float(curve.integrate(time[0], end))


# What has to hold

_DECIMAL = (0.06, "one decimal of the per cents that were found; Eq. 4b needs 0")
_WHOLE_PERCENT = (
    0.6,
    "whole per cents, as found; Eq. 5 needs 0. What has yet to pass when a run ends is about 0.3 %",
)

RANGES = {
    AFTER: ((-40.7, -2.7), (-2.4, 47.5), *_DECIMAL),
    BEFORE: ((-24.8, -2.9), (-2.5, 27.7), *_DECIMAL),
    WHOLE: ((-7.0, -1.0), (12.0, 65.0), *_WHOLE_PERCENT),
    FIRST_PULSE: ((-7.0, -1.0), (1.0, 42.0), *_WHOLE_PERCENT),
}
"""Lowest and highest number with LM_ratio below 1, and above; tolerance, and its reason."""

_TIMES = "extrapolated peak times are right to 1e-6 of a shift that is a tenth of the time"
_MOTION = "velocities are not extrapolated: velocity Verlet is off by about 1e-4"


def promises(table: pandas.DataFrame) -> list[Row]:
    """The range of each number on either side of LM_ratio 1, and LAMMPS against native."""
    rows = [entry for who, frame in table.groupby("backend") for entry in _of(str(who), frame)]
    by_backend = table.set_index(["scene", "contact"]).groupby("backend")
    if {"native", "lammps"} <= set(by_backend.groups):
        native, lammps = (by_backend.get_group(backend) for backend in ("native", "lammps"))
        native = native.loc[lammps.index]
        off = largest(lammps["shift"] / native["shift"] - 1)
        rows.append(row("times between peaks: LAMMPS / native - 1", "lammps", off, 0, 1e-5, _TIMES))
        off = largest(lammps[WHOLE] - native[WHOLE])
        rows.append(row(f"{WHOLE}: LAMMPS - native", "lammps", off, 0, 2e-2, _MOTION))
    return rows


def _of(backend: str, frame: pandas.DataFrame) -> Iterator[Row]:
    is_below = frame["momentum_ratio"] < 1
    for what, (below, above, tolerance, reason) in RANGES.items():
        if what == FIRST_PULSE and backend != "native":
            continue
        later = frame["contact"] > 2 if what == BEFORE else True
        for side, some, expected in (("below", is_below, below), ("above", ~is_below, above)):
            values, name = frame[some & later][what], f"LM_ratio {side} 1: {what} (paper: 0)"
            yield from by_ends(name, backend, values, expected, tolerance, reason)


def draw(table: pandas.DataFrame) -> Figure:
    """Draw native's errors of both equations over the contact, a line for each scene."""
    figure = new_figure(10, 4.5, f"{TITLE}, native")
    native = table[table["backend"] == "native"]
    panels = {AFTER: "error of Eq. 4b [%]", WHOLE: "momentum handed on / that of the wave - 1 [%]"}
    for axes, (what, label) in zip(figure.subplots(1, 2), panels.items(), strict=True):
        for below, colour, marker in ((True, "#0072B2", "o"), (False, "#D55E00", "^")):
            look: dict[str, Any] = {"color": colour, "marker": marker, "markersize": 5}
            look["label"] = f"LM_ratio {'below' if below else 'above'} 1"
            frame = native[(native["momentum_ratio"] < 1) == below]
            for _, scene in frame.groupby("scene", sort=False):
                axes.plot(scene["contact"], scene[what], linewidth=0.8, **look)
                look["label"] = None
        axes.axhline(0, color="0.5", linewidth=0.8)
        axes.set(xlabel="contact i", ylabel=label)
        axes.grid(alpha=0.3)
        axes.legend(fontsize="small")
    return figure


SCRIPTS = {
    "eqs_4b_and_5": Script(
        TITLE,
        "By how much do Eqs. 4b and 5 miss in the transition?",
        measure, promises, draw,
    )
}  # fmt: skip
