"""Scenes and sweeps that several modules draw or measure."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

import hertzchain as hc
from tests.sweeps.made import BASE, CHAIN_SECTION, LAMMPS, RATIO, SEGMENTS, SHOCK, N


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
