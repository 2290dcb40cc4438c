"""``hertzchain tradeoff``: table, plot, JSON."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from tests.cli.short_chain import GET_IT, scene_file
from tests.command_line import Command
from tests.processes import names

pytestmark = pytest.mark.usefixtures("folder")

TRADEOFF_KEYS = ["truth_error", "missing", "remarks", "provenance", "rows"]

TRADEOFF_ROW_KEYS: dict[str, tuple[type, ...]] = {
    "contender": (str,),
    "engine": (str,),
    "step_s": (float, type(None)),
    "natural_step": (float, type(None)),
    "rtol": (float, type(None)),
    "error": (float,),
    "force_evaluations": (int,),
    "wall_time_s": (float,),
    "self_contained": (bool,),
    "frontier": (bool,),
}


def has_the_keys_of_a_tradeoff(document: dict[str, Any]) -> None:
    assert list(document) == TRADEOFF_KEYS
    for row in document["rows"]:
        assert list(row) == list(TRADEOFF_ROW_KEYS)
        for key, types in TRADEOFF_ROW_KEYS.items():
            assert type(row[key]) in types, (key, row)


@pytest.mark.lammps
@pytest.mark.usefixtures("hasty")
def test_tradeoff_measures_plots_and_writes(hertzchain: Command) -> None:
    scene_file()
    outcome = hertzchain("tradeoff", "scene.toml", "--json", "--plot", "plot.png", "-o", "rows.csv")
    assert (outcome.status, outcome.err) == (
        0,
        "Plot written to plot.png\nTable written to rows.csv\n",
    )
    document = outcome.json()
    has_the_keys_of_a_tradeoff(document)
    assert {row["engine"] for row in document["rows"]} == {"formulas", "compiled", "LAMMPS"}
    assert (document["missing"], document["remarks"]) == (False, [])
    assert any(row["frontier"] for row in document["rows"])
    table = pd.read_csv("rows.csv")
    assert table.columns.tolist() == list(TRADEOFF_ROW_KEYS)
    assert table["error"].tolist() == [row["error"] for row in document["rows"]]
    assert Path("plot.png").read_bytes().startswith(b"\x89PNG")
    assert names() == ["plot.png", "rows.csv", "scene.toml"]


@pytest.mark.usefixtures("hasty")
def test_tradeoff_without_lammps_prints_the_rest_and_status_2(
    hertzchain: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "lammps", None)
    scene_file()
    outcome = hertzchain("tradeoff", "scene.toml")
    assert outcome.status == 2
    assert "srkn-11b, compiled" in outcome.out
    assert "LAMMPS, extrapolated" not in outcome.out
    assert outcome.err.count("\n") == 1
    assert outcome.err.startswith("hertzchain: LAMMPS is not available")
    assert GET_IT in outcome.err
    document = hertzchain("tradeoff", "scene.toml", "--json").json()
    has_the_keys_of_a_tradeoff(document)
    assert document["missing"]
    assert GET_IT in document["remarks"][0]
