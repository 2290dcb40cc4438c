"""Trajectories read back by ASE, which writes them; tables also by readers that did not write them.

Tables are written by pandas and read by DuckDB and the standard library, too.
"""

from __future__ import annotations

import csv
import importlib.util
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import duckdb
import numpy as np
import pandas as pd
import pytest

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.errors import OutputError, SceneError
from hertzchain.report.formats import check_format
from hertzchain.report.tables import write_result
from hertzchain.report.trajectory import power_of_1000
from hertzchain.report.waterfall import frame_times
from tests.conftest import paper_scene

BACKENDS = ["native", pytest.param("lammps", marks=pytest.mark.lammps)]
HALF_A_DIGIT = 5.001e-9
"""Rounding as a fraction of a unit: ASE writes eight digits after the point."""


def recorded(backend: str, scene: hc.Scene, frames: int) -> hc.Result:
    run = hc.Native() if backend == "native" else hc.Lammps(dt=0.02 * scene.units.time)
    return run.run(scene, record=frame_times(scene, frames))


@dataclass(frozen=True)
class Frames:
    """A trajectory as a reader found it.

    Parameters
    ----------
    info
        The values of each frame, by key.
    arrays
        The columns of all frames, by the names in the file, shape (frames, granules) or
        (frames, granules, 3).
    """

    info: list[dict[str, Any]]
    arrays: dict[str, FloatArray]


def read_by_ase(path: Path) -> Frames:
    from ase.io import read

    found = read(path, index=":", format="extxyz")
    names = [name for name in found[0].arrays if name not in {"numbers", "positions"}]
    arrays = {name: np.array([frame.arrays[name] for frame in found]) for name in names}
    arrays["pos"] = np.array([frame.get_positions() for frame in found])
    assert {symbol for frame in found for symbol in frame.symbols} == {"X"}
    cells = [{"Lattice": frame.cell.array.ravel(), "pbc": frame.pbc} for frame in found]
    return Frames([frame.info | cell for frame, cell in zip(found, cells, strict=True)], arrays)


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_trajectory_read_back_vs_the_history(tmp_path: Path, backend: str) -> None:
    scene = paper_scene("cosine", 1.0, 2.0, granules=12)
    result = recorded(backend, scene, 400)
    hc.write_trajectory(result, tmp_path / "motion.xyz")
    is_the_history(read_by_ase(tmp_path / "motion.xyz"), result)


def is_the_history(frames: Frames, result: hc.Result) -> None:
    """Assert that frames have what a run of 12 granules has recorded, to the last digit."""
    scene, history = result.scene, result.history
    assert len(frames.info) == 400
    names = {"length_unit_m": 1e-6, "velocity_unit_m_s": 1e-3, "force_unit_N": 1.0}
    length, velocity, force = (frames.info[0][name] for name in names)
    assert (length, velocity, force) == tuple(names.values())
    assert [info["time_s"] for info in frames.info] == history.time.tolist()
    arrays = frames.arrays

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
    assert contact[:, 1:] == pytest.approx(history.contact_force, rel=0, abs=HALF_A_DIGIT)
    assert contact[:, 0] == pytest.approx(
        scene.applied_force(history.time), rel=0, abs=HALF_A_DIGIT
    )
    # 400 frames are 0.1 natural units apart: the highest is (0.05)^2 of a peak too low at most.
    assert contact[:, 1:].max(axis=0) == pytest.approx(result.peak_force, rel=5e-3, abs=0)
    assert np.all(contact[:, 1:].max(axis=0) <= result.peak_force * (1 + 1e-6))
    for info in frames.info:
        cell = np.reshape(info["Lattice"], (3, 3)) * length
        assert cell == pytest.approx(np.diag([0.114, 9.5e-3, 9.5e-3]), rel=1e-12, abs=0)
        assert np.multiply(info["Origin"], length) == pytest.approx(3 * [-4.75e-3], rel=1e-12)
        assert not np.any(info["pbc"])


def test_small_scenes_keep_their_digits(tmp_path: Path) -> None:
    chain = hc.Chain(4, 1e-8, 193e9, 0.3, 7958.0)
    scene = hc.Scene(chain, hc.Pulse("cosine", 1e-15, 2.0, momentum_ratio=1.0))
    result = recorded("native", scene, 20)
    hc.write_trajectory(result, tmp_path / "motion.extxyz")
    exact = HALF_A_DIGIT * scene.units.length
    frames = read_by_ase(tmp_path / "motion.extxyz")
    found = frames.arrays["displacement"][-1, :, 0] * frames.info[-1]["length_unit_m"]
    assert found == pytest.approx(result.history.displacement[-1], rel=0, abs=exact)


def test_units_are_powers_of_1000() -> None:
    values = [5.9e-6, 1.0, 999.0, 1000.0, 3e-22]
    assert [power_of_1000(value) for value in values] == [1e-6, 1.0, 1.0, 1e3, 1e-24]


def test_nothing_recorded_is_refused(tmp_path: Path, demo_reference: hc.Result) -> None:
    with pytest.raises(SceneError, match="record"):
        hc.write_trajectory(demo_reference, tmp_path / "motion.xyz")
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
    for name in ("peaks.csv", "peaks.parquet"):
        with duckdb.connect() as database:
            table = database.read_csv if name.endswith("csv") else database.read_parquet
            found = table(str(tmp_path / name))
            assert dict(zip(found.columns, zip(*found.fetchall(), strict=True), strict=True)) == {
                name: tuple(values) for name, values in columns.items()
            }
    with (tmp_path / "peaks.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.reader(file))
    assert rows[0] == list(columns)
    for name, cells in zip(rows[0], zip(*rows[1:], strict=True), strict=True):
        assert [float(cell) for cell in cells] == columns[name]


def test_parquet_without_pyarrow_is_refused_before_any_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def nothing(name: str, _: str | None = None) -> None:
        assert name == "pyarrow"

    monkeypatch.setattr(importlib.util, "find_spec", nothing)
    with pytest.raises(OutputError, match=r"pip install 'hertzchain\[parquet\]'"):
        check_format(tmp_path / "peaks.parquet", "result")
