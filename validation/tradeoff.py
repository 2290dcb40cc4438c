"""Error against cost of every method for peaks, on all 24 scenes of the paper's tables.

``make tradeoff`` measures again what is kept in ``validation/results``, on an idle machine.
"""

from __future__ import annotations

import functools

import pandas
from matplotlib.figure import Figure

from hertzchain.engines.lammps.engine import Child
from hertzchain.errors import BackendMissing
from hertzchain.report.figures import plot_tradeoff
from hertzchain.verdict.tradeoff import Row as Setting
from hertzchain.verdict.tradeoff import Tradeoff, tradeoff
from validation.script import Row, Script, progress, row
from validation.shipped import load, table_scenes

TITLE = "Error against cost"

ENOUGH = 0.02
"""Seconds for which each run is repeated, twice over; there are 24 scenes."""

ASKED = "the accuracy that was asked for"
OTHER = "asked for 1e-12, but nothing tells it where contacts open: 4e-10 is seen"
KNOWN = "ten times what is claimed of the paper's scenes"


LONGEST = 3600.0
"""Seconds for one scene, which takes half a minute."""


def measure(quick: bool, _: bool) -> pandas.DataFrame:
    """Measure every contender on every scene, in a process that LAMMPS may crash.

    The quick form has one scene, and no run repeated for the sake of its time. One row for each
    contender and setting: the scene, the columns of ``Tradeoff.to_frame``, and truth_error.
    BackendMissing if LAMMPS is not there.
    """
    names, tables = sorted(table_scenes()), []
    with Child() as child:
        for name in progress(names[:1] if quick else names, TITLE):
            how = functools.partial(tradeoff, load(name), enough=0.0 if quick else ENOUGH)
            outcome: Tradeoff = child.call(how, time_limit=LONGEST)
            if outcome.missing:
                raise BackendMissing("; ".join(outcome.remarks))
            table = outcome.to_frame().assign(truth_error=outcome.truth_error)
            table.insert(0, "scene", name)
            tables.append(table)
    return pandas.concat(tables, ignore_index=True)


def promises(table: pandas.DataFrame) -> list[Row]:
    """Return checks that hold on every machine: errors, not times."""
    rows = []
    asked = table[table["contender"] == "rtol, with estimate"]
    for rtol in sorted(asked["rtol"].unique(), reverse=True):
        worst = asked.loc[asked["rtol"] == rtol, "error"].max()
        rows.append(row(f"rtol {rtol:g}, worst scene", "native", worst, 0.0, rtol, ASKED))
    tightest = table[(table["engine"] == "SciPy") & (table["rtol"] == table["rtol"].min())]
    worst = tightest["error"].max()
    rows.append(row("the truth by DOP853, worst scene", "SciPy", worst, 0.0, 1e-9, OTHER))
    error = table["truth_error"].max()
    rows.append(row("what is known of the truth", "native", error, 0.0, 1e-11, KNOWN))
    return rows


def draw(table: pandas.DataFrame) -> Figure:
    """Draw error against time: medians of the settings that all scenes have."""
    setting = table.groupby(["contender", "natural_step", "rtol"], sort=False, dropna=False)
    names = table["scene"].unique()
    whole = table[setting["scene"].transform("size") == len(names)]
    numbers = ["error", "force_evaluations", "wall_time_s"]
    keys = ["contender", "engine", "natural_step", "rtol"]
    medians = whole.groupby(keys, sort=False, dropna=False)[numbers].median().reset_index()
    medians = medians.rename(columns={"wall_time_s": "wall_time"}).assign(step=None)
    records = (
        {str(key): value for key, value in record.items()} for record in medians.to_dict("records")
    )
    rows = tuple(Setting(**record) for record in records)
    measured = Tradeoff(load(names[0]), rows, float(table["truth_error"].max()))
    return plot_tradeoff(measured, title=f"medians of {len(names)} scenes")


SCRIPTS = {
    "tradeoff": Script(
        TITLE,
        "What does each digit of the peaks cost with each method?",
        measure, promises, draw, suffix=".png",
    )
}  # fmt: skip
