"""Reports of scenes with terms: terminal, page, plot, trajectory, table."""

from __future__ import annotations

from pathlib import Path

import ase.io
import numpy as np
import pytest

import hertzchain as hc
from tests.command_line import Command

FOLDER = Path(__file__).parents[2] / "validation" / "scenes" / "terms"

NAMES = sorted(path.stem for path in FOLDER.glob("*.toml"))


def load(name: str) -> hc.Scene:
    """One of the shipped scenes with terms."""
    return hc.Scene.from_toml(FOLDER / f"{name}.toml")


@pytest.mark.parametrize("name", NAMES)
def test_a_run_prints_what_the_scene_has(hertzchain: Command, name: str) -> None:
    scene = load(name)
    done = hertzchain("run", FOLDER / f"{name}.toml")
    assert done.status == 0
    for term in scene.terms:
        assert term in done.out
    assert ("largest force on the wall" in done.out) == (scene.wall is not None)
    assert ("static force [N]" in done.out) == (scene.precompression is not None)
    assert "F_SW" not in done.out


def test_a_page_and_a_plot(hertzchain: Command, tmp_path: Path) -> None:
    page, plot = tmp_path / "page.html", tmp_path / "plot.svg"
    scene = FOLDER / "precompressed.toml"
    done = hertzchain("compare", scene, "--backend", "native", "--report", page, "--plot", plot)
    assert done.status == 0
    assert "Eq. 6" not in done.out
    text = page.read_text()
    assert "What each of them says" in text
    assert "Transition and solitary wave" not in text
    drawn = plot.read_text()
    assert "relative difference" not in drawn


def test_json_and_table_of_a_static_load_and_a_wall() -> None:
    scene = load("upright_column")
    result = hc.Native().run(scene)
    numbers = result.to_dict()
    assert numbers["contacts"] == list(range(2, scene.chain.granules + 2))
    assert numbers["peak_force_N"] == result.peak_force.tolist()
    assert len(numbers["peak_time_s"]) == scene.chain.granules
    assert numbers["transition_granules"] is None
    # The striker only touches the column.
    weight = 9.81 * scene.chain.granule_mass * np.arange(scene.chain.granules)
    assert numbers["static_force_N"] == pytest.approx(weight, rel=1e-13)
    table = result.to_frame()
    assert table["contact"].to_list() == numbers["contacts"]
    total = table["static_force_N"] + table["dynamic_force_N"]
    assert total.to_numpy() == pytest.approx(result.peak_force, rel=1e-15)
    assert "static_force_N" not in hc.Native().run(load("dimer")).to_dict()


def test_a_trajectory_shows_granules_as_they_are(tmp_path: Path) -> None:
    scene = load("all_at_once")
    times = np.linspace(0.0, scene.end_time, 4)
    result = hc.Native().run(scene, record=times)
    hc.write_trajectory(result, tmp_path / "motion.xyz")
    frames = ase.io.read(tmp_path / "motion.xyz", ":")
    first, last = frames[0], frames[-1]
    length = first.info["length_unit_m"]
    granules = scene.granules
    assert first.arrays["radius"] * length == pytest.approx(granules.radius, rel=1e-7)
    assert first.positions[:, 0] * length == pytest.approx(granules.position, rel=1e-7, abs=1e-12)
    moved = (last.positions - first.positions)[:, 0] * length
    assert moved == pytest.approx(result.displacement, rel=0, abs=1e-7 * length)


def test_given_peaks_are_judged_without_a_cause() -> None:
    scene = load("dimer")
    peaks = hc.Native().run(scene).peak_force
    assert hc.judge(scene, peaks, tolerance=1e-4).verdict == "pass"
    wrong = hc.judge(scene, peaks * 1.01, tolerance=1e-4)
    assert wrong.verdict == "fail"
    assert "unlike granules" in wrong.remarks[0]
