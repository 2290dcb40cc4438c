"""``hertzchain tradeoff``: table, plot, JSON."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

import hertzchain as hc
from hertzchain.observables.peaks import largest_difference
from tests.cli.short_chain import GET_IT, scene_file
from tests.command_line import Command
from tests.oracles.json_schema import problems
from tests.processes import names

pytestmark = pytest.mark.usefixtures("folder")


@pytest.mark.lammps
@pytest.mark.usefixtures("hasty")
def test_tradeoff_measures_plots_and_writes(hertzchain: Command) -> None:
    scene_file()
    outcome = hertzchain("tradeoff", "scene.toml", "--json", "--plot", "plot.png")
    assert (outcome.status, outcome.err) == (0, "Plot written to plot.png\n")
    document = outcome.json()
    assert problems(document, "tradeoff.json") == []
    assert {row["engine"] for row in document["rows"]} == {"compiled", "LAMMPS"}
    assert (document["missing"], document["remarks"]) == (False, [])
    assert any(row["frontier"] for row in document["rows"])
    assert Path("plot.png").read_bytes().startswith(b"\x89PNG")
    assert names() == ["plot.png", "scene.toml"]


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
    assert problems(document, "tradeoff.json") == []
    assert document["missing"]
    assert GET_IT in document["remarks"][0]


@pytest.mark.parametrize("rtol", [1e-2, 1e-4])
def test_the_step_of_a_wanted_accuracy(hertzchain: Command, rtol: float) -> None:
    scene_file()
    said = hertzchain("timestep", "scene.toml", "--rtol", rtol)
    assert (said.status, said.out.count("\n")) == (0, 1)
    dt = float(said.out.split()[1])
    right = hc.Native(rtol=1e-9, wanted="all").run("scene.toml").peak_force
    found = hc.Native("velocity-verlet", dt, wanted="all").run("scene.toml").peak_force
    assert rtol / 50 < largest_difference(found, right) < rtol
