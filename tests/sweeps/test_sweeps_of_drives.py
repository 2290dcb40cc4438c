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


def test_sines(tmp_path: Path) -> None:
    vary = {"frequency": "4 kHz,9 kHz", "cycles": "1,3", "amplitude": "1,10"}
    table = swept(SINE, vary, tmp_path / "sweep")
    assert len(table) == 8
    assert table["shock.cycles"].dtype.kind in "iu"
    for row in table.to_dict("records")[::3]:
        sine = hc.Sine(row["shock.amplitude"], row["shock.frequency"], row["shock.cycles"])
        scene = replace(SINE, shock=sine)
        alone = hc.Native().run(scene).peak_force[-1]
        assert row["last_peak_force_N"] == pytest.approx(alone, rel=2e-6)
        assert row["shock.momentum_ratio"] == pytest.approx(scene.momentum_ratio, rel=1e-14)


def test_titles_name_the_drive_and_no_gravity_of_zero() -> None:
    damped = replace(PISTON, contact=hc.Contact("restitution", restitution=0.8))
    moved = hc.sweep(damped, {"chain.density": "1000,2000"})
    (axes,) = moved.plot("density", "last_peak_force_N").axes
    assert axes.get_title().replace("\n", " ") == (
        "granules N = 6, profile piston, velocity of the piston = 100 mm/s, coefficient of"
        " restitution e = 0.8, backend native"
    )
    shaken = hc.sweep(SINE, {"frequency": "4 kHz,9 kHz"})
    (axes,) = shaken.plot("frequency", "last_peak_force_N").axes
    said = axes.get_title().replace("\n", " ")
    assert {"profile sine", "amplitude of the force = 5 N", "cycles = 2"} < {*said.split(", ")}
    assert "precompression = 10 N" in said
    assert "gravity" not in said


def test_peaks_of_moving_granules_go_as_their_velocity_to_the_power_of_6_over_5(
    tmp_path: Path,
) -> None:
    scene = hc.Scene.from_toml(write_starter("cradle", tmp_path / "cradle.toml")[0])
    table = hc.sweep(scene, {"chain.segments.1.velocity": [0.5, 2.0]}).to_frame()
    peaks = table[table["backend"] == "native"]["largest_peak_force_N"].tolist()
    assert peaks[1] / peaks[0] == pytest.approx(4**1.2, rel=2e-6)  # both right to 1e-6
