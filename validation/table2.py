"""Table 2: the number p of granules in the transition, simulated and by Eqs. 3a and 3b."""

from __future__ import annotations

from operator import itemgetter
from typing import Any

import numpy as np
import pandas
from matplotlib.figure import Figure

from validation.script import BACKENDS, Row, Script, new_figure, row
from validation.shipped import eq3, load, paper_table, scene_name, simulate

TITLE = "Table 2: granules in the transition, p"

EXACT = "p is a whole number"
PRINTED = "the paper prints one decimal: equal after rounding, or off by at most 0.05"


def measure(quick: bool, with_lammps: bool) -> pandas.DataFrame:
    """Simulated p, and p of Eq. 3 with the simulated F_SW.

    In the quick form LAMMPS runs three scenes only, one of each profile, two of them with p above
    5. Columns scene, backend, p, eq3, paper_p, paper_eq3.
    """
    entries = paper_table(2)
    names = [scene_name(entry) for entry in entries]
    scenes = {name: load(name) for name in names}
    results = simulate(scenes, TITLE, with_lammps and not quick)
    if quick:
        some = {names[k]: scenes[names[k]] for k in (1, 2, 5)}
        results |= simulate(some, TITLE, with_lammps)
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


def promises(table: pandas.DataFrame) -> list[Row]:
    """Compare both p with the printed ones."""
    rows = []
    for entry in table.to_dict("records"):
        name, backend, measured, printed = _READ(entry)
        rows.append(row(f"{name}, p simulated", backend, entry["p"], entry["paper_p"], 0.0, EXACT))
        passed = round(measured, 1) == printed or abs(measured - printed) <= 0.05
        rows.append(Row(f"{name}, p by Eq. 3", backend, measured, printed, 0.05, passed, PRINTED))
    return rows


def draw(table: pandas.DataFrame) -> Figure:
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
    axes.set(ylabel="p, granules", title=TITLE)
    axes.grid(axis="y", alpha=0.3)
    axes.legend(fontsize="small")
    return figure


SCRIPT = Script(
    TITLE,
    "Is the number of granules in the transition what the paper found, simulated and by Eq. 3?",
    "native, LAMMPS, Eq. 3; the paper's Table 2",
    measure, promises, draw,
)  # fmt: skip

if __name__ == "__main__":
    SCRIPT.main()
