"""Tables 3 and 4: the error of Eq. 6 for each peak force of the transition."""

from __future__ import annotations

import functools

import numpy as np
import pandas
from matplotlib.figure import Figure

import hertzchain as hc
from hertzchain import theory
from hertzchain.arrays import FloatArray
from validation.script import BACKENDS, Row, Script, new_figure, row
from validation.shipped import effective_ratio, load, paper_table, pulse_of, scene_name, simulate

ENTRY = (
    "percentage points; the paper prints one decimal of a difference of forces that it integrated"
    " with an RK4 of unknown step: 0.18 at most is seen"
)
LENGTH = "the paper prints one column for each contact of the transition"
SCENES = 9
"""Of each table."""

MEAN = "percentage points; rounding to one decimal gives 0.025, the paper's own RK4 as much again"


def table_script(number: int, title: str) -> Script:
    """The script of Table 3 (LM_ratio below 1, Eq. 6b) or 4 (above 1, Eq. 6a)."""
    return Script(
        title,
        "Does Eq. 6 miss each peak force of the transition by as much as the paper says?",
        f"native, LAMMPS; the paper's Table {number}",
        functools.partial(measure, number),
        promises,
        functools.partial(draw, title),
    )


def measure(number: int, quick: bool, with_lammps: bool) -> pandas.DataFrame:
    """Error of Eq. 6 at each contact of each scene, with each backend as the exact one.

    In the quick form one scene of each profile instead of three. Columns scene, backend, contact,
    error_percent and paper_percent, NaN where there is no such entry.
    """
    printed: dict[str, list[float]] = {}
    for entry in paper_table(number):
        printed.setdefault(scene_name(entry), []).append(float(entry["error_percent"]))
    names = list(printed)[::3] if quick else list(printed)
    results = simulate({name: load(name) for name in names}, f"Table {number}", with_lammps)
    tables = []
    for (name, backend), result in results.items():
        error = _errors_percent(result)
        contact = np.arange(2, max(error.size, len(printed[name])) + 2)
        entries = {
            "scene": name, "backend": backend, "contact": contact,
            "error_percent": pandas.Series(error, dtype=np.float64),
            "paper_percent": pandas.Series(printed[name], dtype=np.float64),
        }  # fmt: skip
        tables.append(pandas.DataFrame(entries))
    return pandas.concat(tables, ignore_index=True)


def _errors_percent(result: hc.Result) -> FloatArray:
    """Error of Eq. 6 at contacts 2 ... p, with p and F_SW of the simulation [%]."""
    p, wave_force = result.transition_granules, result.solitary_wave.peak_force
    if p is None or wave_force is None:
        return np.zeros(0)
    n, ratio = pulse_of(result.scene)[0].duration_ratio, effective_ratio(result.scene)
    formula = theory.peak_force(np.arange(2, p + 1), p, wave_force, n, ratio)
    return 100 * np.abs(formula / result.peak_force[: p - 1] - 1)


def promises(table: pandas.DataFrame) -> list[Row]:
    """Each error against what is printed, and the mean of what is between them."""
    rows = []
    for (backend, name), frame in table.groupby(["backend", "scene"], sort=False):
        measured, expected = frame["error_percent"].count(), frame["paper_percent"].count()
        rows.append(row(f"{name}, entries", str(backend), measured, expected, 0.0, LENGTH))
        if not rows[-1].passed:
            continue
        entries = zip(frame["contact"], frame["error_percent"], frame["paper_percent"], strict=True)
        rows += [
            row(f"{name}, F_{contact}", str(backend), error, paper, 0.2, ENTRY)
            for contact, error, paper in entries
        ]
    for backend, frame in table.groupby("backend", sort=False):
        if frame["scene"].nunique() < SCENES:  # a few entries may be off by more
            continue
        off = (frame["error_percent"] - frame["paper_percent"]).abs().mean()
        rows.append(row("all entries, mean difference", str(backend), off, 0.0, 0.05, MEAN))
    return rows


def draw(title: str, table: pandas.DataFrame) -> Figure:
    """Printed and simulated errors, a panel for each scene."""
    names = list(dict.fromkeys(table["scene"]))
    rows = -(-len(names) // 3)
    figure = new_figure(9, 0.8 + 2.1 * rows, title)
    panels = figure.subplots(rows, 3, sharey=True, squeeze=False)
    for axes, name in zip(panels.flat, names, strict=False):
        frame = table[table["scene"] == name]
        printed = frame[frame["backend"] == "native"]
        axes.bar(printed["contact"], printed["paper_percent"], color="0.8", label="paper")
        for backend, style in BACKENDS.items():
            some = frame[frame["backend"] == backend]
            axes.plot(some["contact"], some["error_percent"], **style)
        axes.set_title(name.replace("_", ", "), fontsize="small")
        axes.set_xticks(frame["contact"].unique())
        axes.grid(axis="y", alpha=0.3)
    for axes in panels[:, 0]:
        axes.set_ylabel("error of Eq. 6 [%]")
    for axes in panels[-1]:
        axes.set_xlabel("contact")
    panels[0, 0].legend(fontsize="x-small")
    return figure
