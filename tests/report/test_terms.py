"""Trajectories read back by ASE, which writes them; tables; and reports of scenes with terms."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from pathlib import Path

import ase.io
import numpy as np
import pandas as pd
import pytest
from ase import Atoms
from ase.io import read

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.errors import OutputError, SceneError
from hertzchain.report.files import motion_frame, write_result
from tests.command_line import Command
from tests.conftest import paper_scene

HALF_A_DIGIT = 5.001e-9
"""Rounding as a fraction of a unit: ASE writes eight digits after the point."""


def recorded(scene: hc.Scene, frames: int) -> hc.Result:
    return hc.Native().run(scene, record=frames)


def arrays_of(frames: list[Atoms]) -> dict[str, FloatArray]:
    """The columns of all frames by their names, (frames, granules) or (frames, granules, 3)."""
    assert {symbol for frame in frames for symbol in frame.symbols} == {"X"}
    names = [name for name in frames[0].arrays if name not in {"numbers", "positions"}]
    arrays = {name: np.array([frame.arrays[name] for frame in frames]) for name in names}
    return arrays | {"pos": np.array([frame.get_positions() for frame in frames])}


@pytest.mark.parametrize(
    ("peak_force", "units"), [(100.0, (1e-6, 1e-3, 1.0)), (1000.0, (1e-6, 1.0, 1e3))]
)
def test_a_trajectory_read_back_vs_the_history(
    peak_force: float, units: tuple[float, float, float], tmp_path: Path
) -> None:
    """To the last digit that is written."""
    scene = paper_scene("cosine", 1.0, 2.0, granules=12)
    assert scene.pulse is not None
    scene = replace(scene, shock=replace(scene.pulse, peak_force=peak_force))
    result = recorded(scene, 400)
    history = result.history
    hc.write_trajectory(result, tmp_path / "motion.xyz")
    frames = read(tmp_path / "motion.xyz", index=":")
    arrays = arrays_of(frames)
    assert len(frames) == 400
    names = ("length_unit_m", "velocity_unit_m_s", "force_unit_N")
    assert tuple(frames[0].info[name] for name in names) == units
    length, velocity, force = units
    assert [frame.info["time_s"] for frame in frames] == history.time.tolist()
    sites = 2 * scene.chain.radius * np.arange(12)
    exact = HALF_A_DIGIT * length
    moved = arrays["pos"][:, :, 0] * length - sites
    # Positions of 0.1 m in units of 1e-6 m are rounded to 1e-11 of a unit besides.
    assert moved == pytest.approx(history.displacement, rel=0, abs=1.01 * exact)
    assert arrays["displacement"][:, :, 0] * length == pytest.approx(
        history.displacement, rel=0, abs=exact
    )
    for name in ("velocity", "velo"):
        assert arrays[name][:, :, 0] * velocity == pytest.approx(
            history.velocity, rel=0, abs=HALF_A_DIGIT * velocity
        )
    for name in ("pos", "displacement", "velocity", "velo"):
        assert not arrays[name][:, :, 1:].any()
    assert np.unique(arrays["radius"] * length) == pytest.approx([4.75e-3], rel=1e-12, abs=0)
    assert (arrays["id"] == np.arange(1, 13)).all()
    contact = arrays["contact_force"] * force
    assert contact[:, 1:] == pytest.approx(history.contact_force, rel=0, abs=HALF_A_DIGIT * force)
    assert contact[:, 0] == pytest.approx(
        scene.applied_force(history.time), rel=0, abs=HALF_A_DIGIT * force
    )
    # 400 frames are 0.1 natural units apart: the highest is (0.05)^2 of a peak too low at most.
    assert contact[:, 1:].max(axis=0) == pytest.approx(result.peak_force, rel=5e-3, abs=0)
    assert np.all(contact[:, 1:].max(axis=0) <= result.peak_force * (1 + 1e-6))
    for frame in frames:
        cell = frame.cell.array * length
        assert cell == pytest.approx(np.diag([0.114, 9.5e-3, 9.5e-3]), rel=1e-12, abs=0)
        origin = np.multiply(frame.info["Origin"], length)
        assert origin == pytest.approx(3 * [-4.75e-3], rel=1e-12)
        assert not np.any(frame.pbc)


def test_nothing_recorded_is_refused(tmp_path: Path, demo_reference: hc.Result) -> None:
    with pytest.raises(SceneError, match="record"):
        hc.write_trajectory(demo_reference, tmp_path / "motion.xyz")
    with pytest.raises(SceneError, match="record"):
        motion_frame(demo_reference)
    with pytest.raises(OutputError, match=r"must end in \.xyz or \.extxyz"):
        hc.write_trajectory(demo_reference, tmp_path / "motion.csv")
    assert list(tmp_path.iterdir()) == []


def test_results_in_three_formats(tmp_path: Path, demo_reference: hc.Result) -> None:
    for suffix in ("csv", "json", "JSON"):
        write_result(demo_reference, tmp_path / f"peaks.{suffix}")
    expected = demo_reference.to_frame()
    pd.testing.assert_frame_equal(pd.read_csv(tmp_path / "peaks.csv"), expected, rtol=1e-15)
    text = (tmp_path / "peaks.json").read_text()
    assert json.loads(text) == demo_reference.to_dict()
    write_result(demo_reference, tmp_path / "peaks.parquet")
    pd.testing.assert_frame_equal(
        pd.read_parquet(tmp_path / "peaks.parquet"), expected, check_exact=True
    )
    columns = {name: expected[name].tolist() for name in expected}
    with (tmp_path / "peaks.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.reader(file))
    assert rows[0] == list(columns)
    for name, cells in zip(rows[0], zip(*rows[1:], strict=True), strict=True):
        assert [float(cell) for cell in cells] == columns[name]


# Scenes with terms: terminal, page, trajectory, table


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
