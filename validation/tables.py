"""Tables 2, 3 and 4: p, and the error of Eq. 6 for each peak force of the transition."""

from __future__ import annotations

import functools
from operator import itemgetter
from typing import Any

import numpy as np
import pandas
from matplotlib.figure import Figure

import hertzchain as hc
from hertzchain.arrays import FloatArray
from validation.script import BACKENDS, Row, Script, new_figure, row
from validation.shipped import by_formulas, eq3, load, paper_table, scene_name, simulate

TITLE_OF_2 = "Table 2: granules in the transition, p"

EXACT = "p is a whole number"
PRINTED = "the paper prints one decimal: equal after rounding, or off by at most 0.05"


def measure_p(quick: bool, with_lammps: bool) -> pandas.DataFrame:
    """Simulated p, and p of Eq. 3 with the simulated F_SW.

    In the quick form LAMMPS runs three scenes only, one of each profile, two of them with p above
    5. Columns scene, backend, p, eq3, paper_p, paper_eq3.
    """
    entries = paper_table(2)
    names = [scene_name(entry) for entry in entries]
    scenes = {name: load(name) for name in names}
    results = simulate(scenes, TITLE_OF_2, with_lammps and not quick)
    if quick:
        some = {names[k]: scenes[names[k]] for k in (1, 2, 5)}
        results |= simulate(some, TITLE_OF_2, with_lammps)
    rows = []
    for (name, backend), result in results.items():
        p, wave_force = result.transition_granules, result.solitary_wave.peak_force
        by_eq3 = None if wave_force is None else eq3(result.scene, wave_force)
        entry = entries[names.index(name)]
        rows.append({
            "scene": name, "backend": backend,
            "p": np.nan if p is None else p, "eq3": np.nan if by_eq3 is None else by_eq3,
            "paper_p": float(entry["p_numerical"]), "paper_eq3": float(entry["p_analytic"]),
        })  # fmt: skip
    return pandas.DataFrame(rows)


_READ = itemgetter("scene", "backend", "eq3", "paper_eq3")


def judge_p(table: pandas.DataFrame) -> list[Row]:
    """Compare both p with the printed ones."""
    rows = []
    for entry in table.to_dict("records"):
        name, backend, measured, printed = _READ(entry)
        rows.append(row(f"{name}, p simulated", backend, entry["p"], entry["paper_p"], 0.0, EXACT))
        passed = round(measured, 1) == printed or abs(measured - printed) <= 0.05
        rows.append(Row(f"{name}, p by Eq. 3", backend, measured, printed, 0.05, passed, PRINTED))
    return rows


def draw_p(table: pandas.DataFrame) -> Figure:
    """Draw each p as printed and as found."""
    figure = new_figure(8, 4.2)
    axes = figure.subplots()
    names = list(dict.fromkeys(table["scene"]))
    place = np.arange(len(names))
    printed = table.drop_duplicates("scene")
    for shift, column, paper, colour in (
        (-0.1, "p", "paper, numerical", "#000000"),
        (0.1, "eq3", "paper, Eq. 3", "#999999"),
    ):
        look: dict[str, Any] = {"color": colour, "markersize": 26, "label": paper}
        axes.plot(place + shift, printed[f"paper_{column}"], "_", **look)
        for backend, style in BACKENDS.items():
            frame = table[table["backend"] == backend]
            where = np.array([names.index(name) for name in frame["scene"]])
            label = style["label"] if column == "p" else f"Eq. 3 with F_SW of {style['label']}"
            marker = style["marker"] if column == "p" else {"o": "^", "s": "D"}[style["marker"]]
            axes.plot(where + shift, frame[column], **(style | {"label": label, "marker": marker}))
    axes.set_xticks(place, labels=[name.replace("_", "\n", 1) for name in names], fontsize="small")
    axes.set(ylabel="p, granules", title=TITLE_OF_2)
    axes.grid(axis="y", alpha=0.3)
    axes.legend(fontsize="small")
    return figure


# Tables 3 and 4

ENTRY = (
    "percentage points; the paper prints one decimal of a difference of forces that it integrated"
    " with an RK4 of unknown step: 0.18 at most is seen"
)
LENGTH = "the paper prints one column for each contact of the transition"
SCENES = 9
"""Of each table."""

MEAN = "percentage points; rounding to one decimal gives 0.025, the paper's own RK4 as much again"


def measure_eq6(number: int, quick: bool, with_lammps: bool) -> pandas.DataFrame:
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
    eq6, _ = by_formulas(result.scene, p, wave_force)
    return 100 * np.abs(eq6 / result.peak_force[: p - 1] - 1)


def judge_eq6(table: pandas.DataFrame) -> list[Row]:
    """Each error against the printed one, and the mean of their differences."""
    rows = []
    for (backend, name), frame in table.groupby(["backend", "scene"], sort=False):
        measured, expected = frame["error_percent"].count(), frame["paper_percent"].count()
        rows.append(row(f"{name}, entries", str(backend), measured, expected, 0.0, LENGTH))
        if rows[-1].passed:
            columns = (frame[key] for key in ("contact", "error_percent", "paper_percent"))
            rows += [
                row(f"{name}, F_{contact}", str(backend), error, paper, 0.2, ENTRY)
                for contact, error, paper in zip(*columns, strict=True)
            ]
    for backend, frame in table.groupby("backend", sort=False):
        if frame["scene"].nunique() < SCENES:  # a few entries may be off by more
            continue
        off = (frame["error_percent"] - frame["paper_percent"]).abs().mean()
        rows.append(row("all entries, mean difference", str(backend), off, 0.0, 0.05, MEAN))
    return rows


def draw_eq6(title: str, table: pandas.DataFrame) -> Figure:
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


def _of_eq6(number: int, which: str) -> Script:
    title = f"Table {number}: error of the peak forces in %, {which}"
    question = "Does Eq. 6 miss each peak force of the transition by as much as the paper says?"
    measure, draw = functools.partial(measure_eq6, number), functools.partial(draw_eq6, title)
    return Script(title, question, measure, judge_eq6, draw)


SCRIPTS = {
    "table2": Script(
        TITLE_OF_2,
        "Is the number of granules in the transition what the paper found, simulated and by Eq. 3?",
        measure_p, judge_p, draw_p,
    ),
    "table3": _of_eq6(3, "LM_ratio below 1, Eq. 6b"),
    "table4": _of_eq6(4, "LM_ratio above 1, Eq. 6a"),
}  # fmt: skip
