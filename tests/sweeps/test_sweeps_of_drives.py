"""Sweeps of pistons and sines: each row is a run of the scene that its file would describe."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import hertzchain as hc
from hertzchain.scene.starters import write_starter
from tests.conftest import STEEL

CHAIN = hc.Chain(6, **STEEL)
PISTON = hc.Scene(CHAIN, hc.Piston(0.1))
TABLE = replace(PISTON, shock=hc.Piston(None, (0.0, 1e-5), (0.0, 1e-6)))
SINE = hc.Scene(CHAIN, hc.Sine(5.0, 8000.0, 2), precompression=hc.Precompression(10.0))


def swept(scene: hc.Scene, vary: dict[str, str], folder: Path) -> pd.DataFrame:
    hc.sweep(scene, vary, output=folder)
    return pd.read_parquet(folder / "scenes")


def test_peaks_of_pistons_go_as_the_velocity_to_the_power_of_6_over_5(tmp_path: Path) -> None:
    table = swept(PISTON, {"velocity": "0.01:1:3:log"}, tmp_path / "sweep")
    velocity = table["shock.velocity"].to_numpy()
    ratio = table["last_peak_force_N"].to_numpy() / velocity**1.2
    # Similarity is exact; peaks are right to 1e-6.
    assert ratio == pytest.approx(np.full(3, ratio[0]), rel=2e-6)
    assert set(table["shock.profile"]) == {"piston"}
    alone = hc.Native().run(replace(PISTON, shock=hc.Piston(1.0))).peak_force[-1]
    assert table["last_peak_force_N"].iloc[-1] == pytest.approx(alone, rel=2e-6)


def test_a_table_of_a_piston_stays_as_it_is(tmp_path: Path) -> None:
    table = swept(TABLE, {"chain.density": "1000,2000"}, tmp_path / "sweep")
    for density, found in zip((1000.0, 2000.0), table["last_peak_force_N"], strict=True):
        scene = replace(TABLE, chain=replace(CHAIN, density=density))
        assert found == pytest.approx(hc.Native().run(scene).peak_force[-1], rel=2e-6)


def test_both_walls_have_columns_and_accuracy_is_asked_of_first_pulses(tmp_path: Path) -> None:
    """Later peaks of granules between two walls are less accurate, as in a run of one scene."""
    scene = hc.Scene.from_toml(write_starter("two-walls", tmp_path / "walls.toml")[0])
    sweep = hc.sweep(scene, {"chain.density": [7000.0, 8000.0]})
    counts, row = sweep.count(), sweep.to_frame().iloc[0]
    assert (counts.done, counts.failed, counts.missed) == (2, 0, 0)
    assert row["wanted_error"] <= 1e-6 < row["error_estimate"]
    run = hc.Native(peaks_only=True).run(hc.Scene.from_toml(_with_density(tmp_path / "walls.toml")))
    for wall, k in (("near_wall", 0), ("wall", -1)):
        assert row[f"{wall}_first_peak_force_N"] == run.first_columns["first_peak_force_N"][k]
        assert row[f"{wall}_arrival_time_s"] == run.first_columns["arrival_time_s"][k]
        assert row[f"{wall}_peak_force_N"] == run.peak_force[k]
        assert row[f"{wall}_peak_time_s"] == run.peak_time[k]


def _with_density(path: Path) -> Path:
    text = path.read_text(encoding="utf-8").replace("7958 kg/m^3", "7000 kg/m^3")
    path.write_text(text, encoding="utf-8")
    return path


def test_peaks_of_moving_granules_go_as_their_velocity_to_the_power_of_6_over_5(
    tmp_path: Path,
) -> None:
    scene = hc.Scene.from_toml(write_starter("cradle", tmp_path / "cradle.toml")[0])
    table = hc.sweep(scene, {"chain.segments.1.velocity": [0.5, 2.0]}).to_frame()
    peaks = table[table["backend"] == "native"]["largest_peak_force_N"].tolist()
    assert peaks[1] / peaks[0] == pytest.approx(4**1.2, rel=2e-6)  # both right to 1e-6
