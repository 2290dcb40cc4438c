"""Figure 1: the three shocks of Table 1, by the formulas and as each backend applies them.

The force has three sources: Eq. 2 with Table 1 as written (``theory.applied_force``), the ramps
that every simulation uses (``Scene.applied_force``), and LAMMPS itself, queried for the force on a
chain that it holds at rest. The momentum of the granules after the pulse shows the force that acted
on them. The paper does not state the n of its figure; here it is 4, as in Figure 3.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas
from matplotlib.figure import Figure

import hertzchain as hc
from hertzchain import theory
from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.backend import run_in
from hertzchain.engines.lammps.engine import Child
from hertzchain.examiner.measured import readings_of_runs
from hertzchain.scene.shocks import PROFILES, profile_named
from validation.script import BACKENDS, Row, Script, largest, new_figure, row
from validation.script import PROFILES as PROFILE_STYLES
from validation.shipped import STEEL, pulse_of

TITLE = "Figure 1: the three shocks of Table 1"

_READINGS = 8
"""Intervals between evaluations of the formulas on each ramp; LAMMPS is read at 4."""

ROUND_OFF = "in F0: round-off of the argument of the cosine, which pi multiplies"
AREA = (
    "in F0 t0: round-off; the trapezoidal rule is exact for a line and, as its upper half is its"
    " lower half turned around, for half a period of 1 - cos"
)
CORNER = "in F0: Table 1 has exactly this at the corner; round-off"
MOMENTUM = (
    "as a fraction: round-off of some thousand kicks; contacts only hand momentum on, and the steps"
    " end at the corners, so that both sum each ramp without error"
)


def scene_of(profile: str) -> hc.Scene:
    """A chain of 5 of the paper's granules under a shock of n = 4 and LM_ratio 1."""
    pulse = hc.Pulse(profile_named(profile), 100.0, 4.0, momentum_ratio=1.0)
    return hc.Scene(hc.Chain(granules=5, **STEEL), pulse)


def measure(quick: bool, with_lammps: bool) -> pandas.DataFrame:  # noqa: ARG001 - all of it is quick
    """The force over the rise, the decay and a time after, from each source; quick or not.

    Columns profile, source (paper, native, lammps), ramp (0 rise, 1 decay, 2 after), time (t / t0),
    force (F / F0), paper (Eq. 2 then), momentum (of the chain at the end of a run over F0 t0; NaN
    for the paper). At its corners each ramp has the force of its own side.
    """
    tables = []
    with Child() as child:
        for profile in PROFILES:
            scene = scene_of(profile)
            at = _ramp_times(scene)
            momentum = hc.Native("reference").run(scene).balance.momentum
            tables.append(_table(scene, "paper", *at, None, np.nan))
            tables.append(_table(scene, "native", *at, scene.applied_force(at[1]), momentum))
            if with_lammps:
                tables.append(_by_lammps(scene, child))
    return pandas.concat(tables, ignore_index=True)


def _table(
    scene: hc.Scene, source: str, ramp: Any, time: FloatArray, force: Any, momentum: float
) -> pandas.DataFrame:
    """The table of one source [s, N, N s]; by default with the force of Eq. 2."""
    pulse, t0 = pulse_of(scene)
    scale, paper = pulse.peak_force, theory.applied_force(time, pulse, t0)
    columns = {
        "profile": pulse.profile, "source": source, "ramp": ramp, "time": time / t0,
        "force": (paper if force is None else force) / scale, "paper": paper / scale,
        "momentum": momentum / (scale * t0),
    }  # fmt: skip
    return pandas.DataFrame(columns)


def _ramp_times(scene: hc.Scene) -> tuple[FloatArray, FloatArray]:
    """Ramp and time [s] of each reading of a formula, each ramp from corner to corner."""
    rise, decay = scene.ramps
    times = [np.linspace(ramp.start, ramp.end, _READINGS + 1) for ramp in (rise, decay)]
    after = decay.end * np.array([1 + 1e-12, 1.25, 1.5])
    return np.repeat([0, 1, 2], [*map(len, times), after.size]), np.concatenate([*times, after])


def _by_lammps(scene: hc.Scene, child: Child) -> pandas.DataFrame:
    lammps = hc.Lammps(extrapolated=True)
    seen = child.call(lammps.examine, scene, time_limit=lammps.time_limit)
    momentum = run_in(child, lammps, scene).balance.momentum
    runs = readings_of_runs(seen)
    ramp = np.concatenate([np.full(time.size, k) for k, (time, _) in enumerate(runs)])
    time = np.concatenate([time for time, _ in runs])
    force = np.concatenate([force[:, 0] for _, force in runs])
    # After the pulse readings are kept where the force changes; between them it is that of a line.
    after = scene.ramps[-1].end * np.array([1 + 1e-12, 1.25, 1.5])
    pulse = ramp < len(scene.ramps)
    force = np.append(force[pulse], np.interp(after, time, force))
    ramp, time = np.append(ramp[pulse], [2, 2, 2]), np.append(time[pulse], after)
    return _table(scene, "lammps", ramp, time, force, momentum)


def promises(table: pandas.DataFrame) -> list[Row]:
    """Agreement, area, height at t0 and no jump for each profile and source."""
    rows = []
    for (profile, source), frame in table.groupby(["profile", "source"], sort=False):
        what, backend = str(profile), str(source)
        n = scene_of(what).ramps[-1].end / scene_of(what).ramps[0].end
        rise, decay, after = (
            frame[frame["ramp"] == k].sort_values("time", kind="stable") for k in (0, 1, 2)
        )
        if backend != "paper":
            off = largest(frame["force"] - frame["paper"])
            rows.append(row(f"{what}: F(t) less Eq. 2, largest", backend, off, 0, 1e-15, ROUND_OFF))
        for name, ramp, expected in (("rise, 1", rise, 1), ("decay, n - 1", decay, n - 1)):
            area = 2 * np.trapezoid(ramp["force"], ramp["time"])
            twice = f"{what}: twice the area of the {name}"
            rows.append(row(twice, backend, area, expected, 2e-15, AREA))
        top = rise["force"].iloc[-1]
        rows.append(row(f"{what}: F(t0)", backend, top, 1, 1e-15, CORNER))
        start, decays, ends = (ramp["force"].iloc[0] for ramp in (rise, decay, after))
        jump = max(abs(start), abs(decays - top), abs(ends - decay["force"].iloc[-1]))
        rows.append(row(f"{what}: largest jump at a corner", backend, jump, 0, 1e-15, CORNER))
        if backend != "paper":
            off = largest(frame["momentum"] / (n / 2) - 1)
            name = f"{what}: momentum that the chain has gained, over F0 n t0 / 2, less 1"
            rows.append(row(name, backend, off, 0, 1e-13, MOMENTUM))
    return rows


def draw(table: pandas.DataFrame) -> Figure:
    """The paper's three panels."""
    figure = new_figure(10, 3.6, "Figure 1: shocks, n = 4 (chosen)")
    panels = figure.subplots(1, 3, sharey=True)
    time = np.linspace(0, 6, 601)
    for axes, letter, profile in zip(panels, "abc", PROFILES, strict=True):
        shock = hc.Pulse(profile, 1.0, 4.0, rise_time=1.0)
        axes.plot(time, theory.applied_force(time, shock, 1.0), "0.6", label="Eq. 2, Table 1")
        for backend, style in BACKENDS.items():
            frame = table[(table["profile"] == profile) & (table["source"] == backend)]
            axes.plot(frame["time"], frame["force"], **style)
        axes.set(xlabel="t / t0", title=f"({letter}) {PROFILE_STYLES[profile]['label']}")
        axes.grid(alpha=0.3)
    panels[0].set_ylabel("F / F0")
    panels[0].legend(fontsize="small")
    return figure


SCRIPTS = {
    "figure1": Script(
        TITLE,
        "Do the simulations apply the force that Eq. 2 and Table 1 say?",
        measure, promises, draw,
    )
}  # fmt: skip
