"""Scenes, sweeps and helpers that tests of sweeps share."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import hertzchain as hc
from hertzchain.sweeps.columns import FOUND_COLUMNS, is_result
from hertzchain.sweeps.design import Design
from tests.conftest import paper_scene

SHORT = paper_scene("cosine", 1.0, 2.0, granules=12)
GRID: dict[str, Any] = {
    "shock.momentum_ratio": "0.5:2:4:log",
    "shock.profile": ["cosine", "triangular"],
}

BASE = paper_scene("cosine", 1.0, 4.0, granules=12)
RATIO, N, P = "shock.momentum_ratio", "shock.duration_ratio", "transition_granules"
F_SW = "solitary_wave_force_N"
LAMMPS = hc.Lammps(rtol=1e-3)  # sees the p and the order of the lines that native sees

CHAIN_SECTION = """
[chain]
granules = 6
radius = "4.75 mm"
young_modulus = "193 GPa"
poisson_ratio = 0.3
density = "7958 kg/m^3"
"""
SEGMENTS = """
[[chain.segments]]
granules = 4
cell = [{}, { young_modulus = "1.46 GPa", poisson_ratio = 0.46, density = "2.2 g/cm^3" }]
[[chain.segments]]
granules = 2
radius = "4 mm"
radius_ratio = 0.9
gap = "1 um"
"""
SHOCK = """
[shock]
profile = "cosine"
peak_force = "100 N"
duration_ratio = 2
momentum_ratio = 1.0
"""


def all_scenes(layout: Design) -> list[hc.Scene]:
    numbers = np.arange(layout.scenes)
    parameters = layout.parameters(numbers)
    return [layout.scene(parameters, k) for k in numbers.tolist()]


def has_numbers(row: Mapping[Any, Any], numbers: Mapping[str, Any]) -> None:
    """Assert that a row has all these numbers, as far as it has their columns, and no others."""
    counts = {column.name for column in FOUND_COLUMNS if column.kind == "int"}  # 0: missing
    for name in filter(is_result, row):
        cell, wanted = None if pd.isna(row[name]) else row[name], numbers.get(name)
        assert cell == (wanted or None if name in counts else wanted), name


def drawn_lines(figure: Any) -> list[tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]]:
    return [line.get_data() for line in figure.axes[0].lines]


def legend(figure: Any) -> list[str]:
    return [text.get_text() for text in figure.legends[0].get_texts()]


@pytest.fixture
def segmented(tmp_path: Path) -> hc.Scene:
    """A dimer of steel and PTFE, and two smaller granules with gaps."""
    (tmp_path / "dimer.toml").write_text(CHAIN_SECTION + SEGMENTS + SHOCK)
    return hc.Scene.from_toml(tmp_path / "dimer.toml")


@pytest.fixture(scope="module")
def one_core() -> Iterator[None]:
    """One process of LAMMPS: each takes a second of a processor to start."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("hertzchain.sweeps.loop.usable_cores", lambda: 1)
        yield


PROFILES = {"shock.profile": "cosine,triangular,cosine-triangular", RATIO: "0.1:2:4:log"}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, one_core: None) -> Path:  # noqa: ARG001
    """Three profiles over LM_ratio, by native and by LAMMPS."""
    there = tmp_path_factory.mktemp("sweeps") / "profiles"
    hc.sweep(BASE, PROFILES, backends=("native", LAMMPS), output=there)
    return there


@pytest.fixture(scope="module")
def both(folder: Path) -> hc.Sweep:
    return hc.Sweep.load(folder)


@pytest.fixture(scope="module")
def grid() -> hc.Sweep:
    """LM_ratio and n, the latter not in order."""
    return hc.sweep(BASE, {RATIO: "0.1:2:5:log", N: "4,2,9"})


@pytest.fixture(scope="module")
def sampled() -> hc.Sweep:
    vary = {RATIO: "0.1:2:log", N: "2:6", "shock.profile": "cosine,triangular"}
    return hc.sweep(BASE, vary, samples=20)


@pytest.fixture(scope="module")
def failing() -> hc.Sweep:
    """The fourth of five forces presses granules into one another, and so does the fifth."""
    return hc.sweep(BASE, {"shock.peak_force": "1e12,10,100,1000,1e13"})
