"""Trajectories and tables read back: extended XYZ through ASE, JSON and Parquet through pandas."""

from __future__ import annotations

import importlib.util
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import hertzchain as hc
from hertzchain import tables
from hertzchain.arrays import FloatArray
from hertzchain.errors import OutputError, SceneError
from hertzchain.tables import write_result
from hertzchain.trajectory import frame_times, power_of_1000
from tests.conftest import paper_scene

BACKENDS = ["native", pytest.param("lammps", marks=pytest.mark.lammps)]
HALF_A_DIGIT = 5.001e-9
"""Of a unit: ASE writes eight digits after the point."""


def recorded(backend: str, scene: hc.Scene, frames: int) -> hc.Result:
    run = hc.Native() if backend == "native" else hc.Lammps(dt=0.02 * scene.units.time)
    return run.run(scene, record=frame_times(scene, frames))


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_trajectory_read_back_vs_the_history(tmp_path: Path, backend: str) -> None:
    from ase.io import read

    scene = paper_scene("cosine", 1.0, 2.0, granules=12)
    result = recorded(backend, scene, 400)
    hc.write_trajectory(result, tmp_path / "motion.xyz")
    frames = read(tmp_path / "motion.xyz", index=":", format="extxyz")
    history = result.history
    assert history is not None
    assert len(frames) == 400
    info = frames[0].info
    length, velocity, force = (
        info[key] for key in ("length_unit_m", "velocity_unit_m_s", "force_unit_N")
    )
    assert (length, velocity, force) == (1e-6, 1e-3, 1.0)
    assert [frame.info["time_s"] for frame in frames] == history.time.tolist()

    def column(name: str) -> FloatArray:
        return np.array([frame.arrays[name] for frame in frames])

    sites = 2 * scene.chain.radius * np.arange(12)
    exact = HALF_A_DIGIT * length
    moved = column("positions")[:, :, 0] * length - sites
    # Positions of 0.1 m in units of 1e-6 m are rounded to 1e-11 of a unit besides.
    assert moved == pytest.approx(history.displacement, rel=0, abs=1.01 * exact)
    assert column("displacement")[:, :, 0] * length == pytest.approx(
        history.displacement, rel=0, abs=exact
    )
    assert column("velocity")[:, :, 0] * velocity == pytest.approx(
        history.velocity, rel=0, abs=HALF_A_DIGIT * velocity
    )
    for name in ("positions", "displacement", "velocity"):
        assert not column(name)[:, :, 1:].any()
    assert np.unique(column("radius") * length) == pytest.approx([4.75e-3], rel=1e-12, abs=0)
    contact = column("contact_force") * force
    assert contact[:, 1:] == pytest.approx(history.contact_force, rel=0, abs=HALF_A_DIGIT)
    assert contact[:, 0] == pytest.approx(
        scene.applied_force(history.time), rel=0, abs=HALF_A_DIGIT
    )
    # 400 frames are 0.1 natural units apart: the highest is (0.05)^2 of a peak too low at most.
    assert contact[:, 1:].max(axis=0) == pytest.approx(result.peak_force, rel=5e-3, abs=0)
    assert np.all(contact[:, 1:].max(axis=0) <= result.peak_force * (1 + 1e-6))


def test_small_scenes_keep_their_digits(tmp_path: Path) -> None:
    from ase.io import read

    chain = hc.Chain(4, 1e-8, 193e9, 0.3, 7958.0)
    scene = hc.Scene(chain, hc.Pulse("cosine", 1e-15, 2.0, momentum_ratio=1.0))
    result = recorded("native", scene, 20)
    hc.write_trajectory(result, tmp_path / "motion.extxyz")
    last = read(tmp_path / "motion.extxyz", index=-1, format="extxyz")
    assert result.history is not None
    found = last.arrays["displacement"][:, 0] * last.info["length_unit_m"]
    exact = HALF_A_DIGIT * scene.units.length
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


def test_parquet_without_pyarrow_is_refused_before_any_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def nothing(name: str, _: str | None = None) -> None:
        assert name == "pyarrow"

    monkeypatch.setattr(importlib.util, "find_spec", nothing)
    with pytest.raises(OutputError, match=r"pip install 'hertzchain\[parquet\]'"):
        tables.check_result_format(tmp_path / "peaks.parquet")


def test_a_failure_leaves_no_trajectory(tmp_path: Path) -> None:
    result = recorded("native", paper_scene("cosine", 1.0, 2.0, granules=4), 3)
    assert result.history is not None
    broken = replace(result.history, velocity=result.history.velocity[:2])
    with pytest.raises(IndexError):
        hc.write_trajectory(replace(result, history=broken), tmp_path / "motion.xyz")
    assert list(tmp_path.iterdir()) == []
