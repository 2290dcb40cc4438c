"""``hertzchain run``: output, files, accuracy, other engines."""

from __future__ import annotations

from dataclasses import replace
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from numpy.typing import ArrayLike

from hertzchain.cli.run import MethodName
from hertzchain.engines.native.backend import Native
from hertzchain.observables.result import Result
from hertzchain.report.facts import describe
from hertzchain.scene.scene import Scene
from tests.cli.short_chain import (
    CONTACTS,
    GET_IT,
    TABLE,
    Changes,
    embedded,
    scene_file,
    table_file,
)
from tests.command_line import MAIN, Command, Outcome, is_refused, process
from tests.oracles.json_schema import problems
from tests.places import ROOT
from tests.processes import names

NO_LAMMPS = f"import sys; sys.path.insert(0, {str(ROOT / 'tests' / 'no_lammps')!r}); {MAIN}"
"""Hide LAMMPS: `import lammps` then raises an ImportError, also in its own process."""


def test_run_prints_nothing_but_one_json_object(native: Outcome) -> None:
    assert native.status == 0
    assert native.err.startswith("Peaks written to ")
    assert native.err.count("\n") == 1
    document = native.json()
    assert problems(document, "run.json") == []
    assert (document["backend"], document["method"]) == ("native", "srkn-11b")
    assert document["momentum_ratio"] == 1.0
    assert document["transition_granules"] == 5
    # p + 1 = 6 is the contact after the transition, the fifth of the list.
    assert document["solitary_wave"]["peak_force_N"] == document["peak_force_N"][4]
    assert 0 < document["error_estimate"] <= 1e-6
    assert document["provenance"]["hertzchain"] == version("hertzchain")


@pytest.mark.lammps
def test_a_run_with_lammps_vs_one_with_native(hertzchain: Command, native: Outcome) -> None:
    scene_file()
    outcome = hertzchain("run", "scene.toml", "--backend", "lammps", "--json")
    assert (outcome.status, outcome.err) == (0, "")
    document, expected = outcome.json(), native.json()
    assert problems(document, "run.json") == []
    assert document["backend"] == "lammps"
    assert document["method"].startswith("velocity-verlet")
    assert "lammps" in document["provenance"]
    for key in ("end_time_s", "rise_time_s", "momentum_ratio", "transition_granules"):
        assert document[key] == expected[key]
    error = document["error_estimate"] + expected["error_estimate"]
    assert document["peak_force_N"] == pytest.approx(expected["peak_force_N"], rel=error)


@pytest.mark.parametrize(("wanted", "status"), [("0.0001", 0), ("9.9e-05", 1)])
def test_a_run_misses_an_accuracy_that_it_misses_by_little(
    hertzchain: Command, monkeypatch: pytest.MonkeyPatch, wanted: str, status: int
) -> None:
    run = Native.run

    def rough(native: Native, scene: Scene, record: ArrayLike | None = None) -> Result:
        return replace(run(native, scene, record), error_estimate=1e-4)

    monkeypatch.setattr(Native, "run", rough)
    scene_file()
    outcome = hertzchain("run", "scene.toml", "--rtol", wanted)
    assert outcome.status == status
    assert outcome.err.startswith(f"hertzchain: wanted {wanted}, reached 0.0001: ") is (status == 1)
    damped = {"contact.damping": '"restitution"', "contact.restitution": "0.8"}
    scene_file({"chain.granules": "3"} | damped)
    outcome = hertzchain("run", "scene.toml", "--rtol", wanted)
    assert outcome.status == status
    assert ("cannot reach this accuracy with damped contacts" in outcome.err) == (status == 1)


def test_dt_with_a_unit_vs_seconds(hertzchain: Command) -> None:
    scene_file({"run.end_time": '"60 us"'})
    documents = []
    for dt in ("20 ns", "2e-8", "0.02us"):
        outcome = hertzchain(
            "run", "scene.toml", "--method", "velocity-verlet", "--dt", dt, "--json"
        )
        document = outcome.json()
        assert document.pop("wall_time_s") > 0
        assert document.pop("compile_time_s") >= 0
        documents.append(document)
    assert documents[0] == documents[1] == documents[2]
    assert documents[0]["dt_s"] <= 2e-8


@pytest.mark.parametrize("method", list(MethodName))
def test_every_method_runs(hertzchain: Command, method: str) -> None:
    scene_file({"chain.granules": "4", "run.end_time": '"60 us"'})
    found = hertzchain("run", "scene.toml", "--method", method, "--json").json()
    assert found["method"] == method
    assert found["error_estimate"] < 1e-5  # of velocity Verlet; all others are far below


SHORT_RUNS = [
    *({"run.end_time": f'"{end_time}"'} for end_time in ("10 us", "0.1 us", "1 ns", "1e-300 s")),
    {**TABLE, "run.end_time": "5e-6"},
]
"""Runs that end before most contacts are pressed, and one that ends before the shock begins."""


@pytest.mark.parametrize(
    "command",
    [
        ["run"],
        ["compare", "--backend", "native"],
        pytest.param(["run", "--backend", "lammps"], marks=pytest.mark.lammps),
        pytest.param(["compare"], marks=pytest.mark.lammps),
    ],
    ids=" ".join,
)
@pytest.mark.parametrize("changes", SHORT_RUNS, ids=lambda changes: changes["run.end_time"])
def test_a_short_run_is_no_crash(hertzchain: Command, command: list[str], changes: Changes) -> None:
    scene_file(changes)
    table_file("1e-5,50", "2e-5,100")
    outcome = hertzchain(*command, "scene.toml", "--json")
    if outcome.status == 2:
        is_refused(outcome)
        return
    outcome.json()
    said = outcome.err.splitlines()
    assert len(said) <= (outcome.status == 1)
    assert all(line.startswith("hertzchain: wanted 1e-06, reached ") for line in said)


def test_run_without_lammps_says_how_to_get_it() -> None:
    scene_file()
    outcome = process("run", "scene.toml", "--backend", "lammps", "-o", "peaks.csv", code=NO_LAMMPS)
    is_refused(outcome, "LAMMPS is not available", GET_IT)
    assert names() == ["scene.toml"]


# Files


SCENE = ROOT / "validation" / "scenes" / "weak_shock.toml"


def test_all_files_of_one_run(hertzchain: Command) -> None:
    files = ("-o", "motion.csv", "--plot", "run.svg", "--report", "run.html")
    done = hertzchain("run", SCENE, "--json", "--record", "20", *files)
    assert done.status == 0, done
    for what, name in (("Motion", "motion.csv"), ("Plot", "run.svg"), ("Report", "run.html")):
        assert f"{what} written to {name}\n" in done.err
    assert names() == ["motion.csv", "run.html", "run.svg"]
    frame = pd.read_csv("motion.csv")
    assert frame["granule"].unique().tolist() == list(range(1, 61))
    times = np.linspace(0, Scene.from_toml(SCENE).end_time, 20)
    assert frame["time_s"].unique().tolist() == times.tolist()
    page = Path("run.html").read_text("utf-8")
    assert f"<title>{describe(Scene.from_toml(SCENE))}</title>" in page  # there is no verdict
    assert page.count("<svg") == 2
    assert embedded(page)["peak_force_N"] == done.json()["peak_force_N"]
    assert len(page) < 500_000
    done = hertzchain("run", SCENE, "-o", "peaks.csv")
    assert ", are in peaks.csv)" in done.out
    assert done.err == "Peaks written to peaks.csv\n"


@pytest.mark.usefixtures("folder")
def test_first_pulses_are_wanted(hertzchain: Command) -> None:
    scene_file()
    asked = ("run", "scene.toml", "--rtol", "1e-3", "--json")
    assert hertzchain(*asked).json().get("first_peak_force_N") is None
    assert len(hertzchain(*asked, "--wanted", "first").json()["first_peak_force_N"]) == CONTACTS
