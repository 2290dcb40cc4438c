"""``hertzchain pulse`` as people and scripts meet it."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest

from hertzchain.scene.starters import write_starter
from tests.command_line import Command
from tests.recordings import DURATION, FORCE, START, sine_squared, times, write_scope


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
    assert done.err.endswith('under [shock] as profile = "table" and file = "scene.csv"\n')
    assert max(map(len, done.out.splitlines())) <= 120
    words = ("semicolons between columns, decimal commas", "in us (header)", "F0 ", " ± ")
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
    options = ("--scale", 25, "--plot", plot, "--json")
    done = hertzchain("pulse", scope, *options)
    assert (done.status, done.err) == (0, f"Plot written to {plot}\n")
    assert plot.read_text(encoding="utf-8").startswith("<?xml")
    found = done.json()
    assert found["samples"] == 1000
    assert found["rows"] < found["samples_of_pulse"] < 500
    assert abs(found["start_s"] - START) < 4e-6
    for key, true in (("peak_force_N", FORCE), ("impulse_N_s", FORCE * DURATION / 2)):
        assert abs(found[key]["value"] - true) < 4 * found[key]["standard_deviation"]
    few = hertzchain("pulse", scope, "--scale", 25, "--rows", 5, "--json").json()
    assert few["rows"] <= 5 < found["rows"]
    assert few["bend_N"] > found["bend_N"]
    assert few["impulse_N_s"]["value"] == pytest.approx(found["impulse_N_s"]["value"], rel=1e-12)
    refused = hertzchain("pulse", scope, "--scale", 25, "--rows", 2)
    assert "--rows = 2: must be at least 3" in refused.err


def test_options_reach_the_pulse(hertzchain: Command, scope: Path) -> None:
    columns = ("--time", "Time", "--force", 2, "--time-unit", "ns")
    pulse = ("--scale", 2e3, "--baseline", 0.1, "--start", "0 ns", "--end", "50 ns")
    found = hertzchain("pulse", scope, *columns, *pulse, "--json").json()
    assert found["start_s"] == pytest.approx(0, abs=0.2e-9)  # a sample every 0.18
    assert found["duration_s"] == pytest.approx(50e-9, abs=0.4e-9)
    assert found["baseline_N"] == pytest.approx(200)
    assert found["peak_force_N"]["value"] == pytest.approx(2000 * (4.012 - 0.1), rel=0.02)


def test_what_makes_the_pulse_wrong_is_said(hertzchain: Command, tmp_path: Path) -> None:
    time = times(1000)
    cut = np.minimum(sine_squared(time), 60.0)
    rows = "".join(f"{t!r},{f!r}\n" for t, f in zip(time.tolist(), cut.tolist(), strict=True))
    (tmp_path / "cut.csv").write_text(f"time_s,force_N\n{rows}", encoding="utf-8")
    done = hertzchain("pulse", tmp_path / "cut.csv")
    assert done.status == 0
    assert "largest force" in " ".join(done.err.split())
