"""``hertzchain pulse`` as people and scripts meet it."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

import hertzchain as hc
from hertzchain.scene.starters import write_starter
from tests.command_line import Command
from tests.recordings import DURATION, FORCE, START, write_scope


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
    done = hertzchain("pulse", scope, "-o", table, "--scale", 25, "--scene", scene)
    assert done.status == 0
    assert done.err.endswith('under [shock] as profile = "table" and file = "scene.csv"\n')
    assert max(map(len, done.out.splitlines())) <= 120
    words = ("semicolons between columns, decimal commas", "in us (header)", "LM_ratio", "± [N]")
    assert [one for one in words if one not in done.out] == []
    assert len(table.read_text(encoding="utf-8").splitlines()) < 60
    assert table.read_text(encoding="utf-8").startswith("time_s,force_N\n0.0,")
    run = hertzchain("run", scene, "--json").json()
    assert run["error_estimate"] < 1e-6
    assert 100 < run["peak_force_N"][0] < 120


def test_a_name_with_quotes_is_given_as_a_scene_takes_it(
    hertzchain: Command, scope: Path, tmp_path: Path
) -> None:
    done = hertzchain("pulse", scope, "-o", tmp_path / 'a"b.csv', "--scale", 25)
    assert tomllib.loads(done.err.strip().rpartition(" and ")[2]) == {"file": 'a"b.csv'}


def test_json(hertzchain: Command, scope: Path, scene: Path) -> None:
    plot = scene.with_name("pulse.svg")
    options = ("--scale", 25, "--scene", scene, "--plot", plot, "--json")
    done = hertzchain("pulse", scope, *options)
    assert (done.status, done.err) == (0, f"Plot written to {plot}\n")
    assert plot.read_text(encoding="utf-8").startswith("<?xml")
    found = done.json()
    assert found["samples"] == 1000
    assert found["rows"] < found["samples_of_pulse"] < 500
    assert abs(found["start_s"] - START) < 4e-6
    for key, true in (("peak_force_N", FORCE), ("impulse_N_s", FORCE * DURATION / 2)):
        # Four standard deviations, which themselves are known to 13 %.
        assert abs(found[key]["value"] - true) < 5 * found[key]["standard_deviation"]
    in_scene = found["scene"]
    assert len(in_scene["peak_force_N"]) == len(in_scene["standard_deviation_N"]) == 59
    assert 0 < in_scene["change_by_fewer_rows"] <= found["wanted"]
    alone = hertzchain("pulse", scope, "--scale", 25, "--json").json()
    assert alone["scene"] is None
    assert alone["wanted"] == 1e-3


def test_options_reach_the_pulse(hertzchain: Command, scope: Path) -> None:
    columns = ("--time", "Time", "--force", 2, "--time-unit", "ns")
    pulse = ("--scale", 2e3, "--baseline", 0.1, "--start", "0 ns", "--end", "50 ns")
    found = hertzchain("pulse", scope, *columns, *pulse, "--json").json()
    assert found["start_s"] == pytest.approx(0, abs=0.2e-9)  # a sample every 0.18
    assert found["duration_s"] == pytest.approx(50e-9, abs=0.4e-9)
    assert found["baseline_N"] == pytest.approx(200)
    assert found["peak_force_N"]["value"] == pytest.approx(2000 * (4.012 - 0.1), rel=0.02)


def test_a_scene_with_another_shock_is_read_for_its_chain(
    hertzchain: Command, scope: Path, tmp_path: Path
) -> None:
    path = tmp_path / "striker.toml"
    write_starter("striker", path)
    path.write_text(path.read_text(encoding="utf-8").replace('radius = "6 mm"', ""), "utf-8")
    found = hertzchain("pulse", scope, "--scale", 25, "--scene", path, "--json").json()
    assert len(found["scene"]["peak_force_N"]) == hc.Scene.from_toml(path).chain.granules - 1
