"""The scene: TOML in and out, and the lengths of pulse and run that follow from it."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

import hertzchain as hc
from hertzchain.errors import SceneError
from hertzchain.scene.chain import PAPER_MOMENTUM
from tests.conftest import STEEL, paper_scene

CHAIN = hc.Chain(60, **STEEL)

TEXT = """
[chain]
granules = 60
radius = "4.75 mm"
young_modulus = "193 GPa"
poisson_ratio = 0.3
density = "7958 kg/m^3"

[shock]
profile = "cosine-triangular"
peak_force = "100 N"
duration_ratio = 2
momentum_ratio = 2.0
"""
"""The scene of `make demo`."""

CHAIN_TEXT = TEXT.partition("[shock]")[0]
TABLE_TEXT = CHAIN_TEXT + '[shock]\nprofile = "table"\nfile = "pulse.csv"\n'
"""The same chain under a pulse table."""


def scene_of(folder: Path, text: str) -> hc.Scene:
    path = folder / "scene.toml"
    path.write_text(text, encoding="utf-8")
    return hc.Scene.from_toml(path)


def refusal(folder: Path, text: str) -> str:
    """Return the error for a text that is not a scene."""
    with pytest.raises(SceneError) as caught:
        scene_of(folder, text)
    return str(caught.value)


def test_a_table_is_read_relative_to_the_scene(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "inner"
    folder.mkdir()
    (folder / "pulse.csv").write_text("time_s,force_N\n0,0\n1e-5,100\n3e-5,0\n")
    monkeypatch.chdir(tmp_path)
    read = scene_of(folder, TABLE_TEXT)
    assert read.shock == hc.PulseTable((0.0, 1e-5, 3e-5), (0.0, 100.0, 0.0), "pulse.csv")
    whole = TABLE_TEXT.replace("pulse.csv", (folder / "pulse.csv").as_posix())
    assert scene_of(tmp_path, whole).peak_force == 100.0
    (folder / "scene.toml").rename(tmp_path / "scene.toml")
    with pytest.raises(SceneError, match=r"pulse\.csv"):
        hc.Scene.from_toml("scene.toml")


PULSE = hc.Pulse("cosine", 100.0, 2.0, momentum_ratio=1.0)


@pytest.mark.parametrize("profile", ["cosine", "triangular", "cosine-triangular"])
@pytest.mark.parametrize("n", [1.5, 2.0, 8.0])
def test_impulse_is_momentum_ratio_times_that_of_a_solitary_wave(profile: str, n: float) -> None:
    scene = paper_scene(profile, 0.7, n)
    chain = scene.chain
    # L_SW of section 4.1, from E, R, rho and nu: 139/32 of sqrt(m) F^(5/6) / A^(1/3) over the
    # numbers that turn m and A into R^3 rho and sqrt(R) E / (1 - nu^2).
    unit = math.sqrt(chain.radius**3 * chain.density) * 100.0 ** (5 / 6)
    unit /= math.cbrt(math.sqrt(chain.radius) * chain.young_modulus / (1 - 0.3**2))
    # A dozen roundings.
    assert scene.impulse == pytest.approx(0.7 * PAPER_MOMENTUM * unit, rel=1e-14)


@given(momentum_ratio=st.floats(1e-4, 1e2), n=st.floats(1.01, 60.0))
def test_momentum_ratio_and_rise_time_mean_each_other(momentum_ratio: float, n: float) -> None:
    scene = paper_scene("cosine", momentum_ratio, n)
    assert scene.momentum_ratio == momentum_ratio
    timed = replace(scene, shock=hc.Pulse("cosine", 100.0, n, rise_time=scene.rise_time))
    assert timed.momentum_ratio == pytest.approx(momentum_ratio, rel=1e-15)  # there and back


def test_nothing_pushes_before_and_after_a_table() -> None:
    table = hc.PulseTable((1e-5, 2e-5, 4e-5), (40.0, 100.0, 60.0))
    scene = hc.Scene(hc.Chain(5, **STEEL), table)
    # Its first and its last force are not 0: the force jumps there, and does not stay.
    time = np.array([0.0, 0.9e-5, 1e-5, 3e-5, 4e-5, 4.1e-5, 1.0])
    # Up to the rounding of the interpolation.
    expected = [0.0, 0.0, 40.0, 80.0, 60.0, 0.0, 0.0]
    assert scene.applied_force(time) == pytest.approx(expected, rel=1e-15, abs=0)


@pytest.mark.parametrize("part", [0.3, 1.0, 1.4, 2.0, 5.0])
def test_applied_impulse_stops_where_the_run_does(part: float) -> None:
    scene = paper_scene("cosine-triangular", 1.0, 2.0)
    assert scene.rise_time is not None
    short = replace(scene, run=hc.Run(part * scene.rise_time))
    expected = math.fsum(
        quad(ramp.force, ramp.start, min(ramp.end, short.end_time), epsabs=0, epsrel=1e-13)[0]
        for ramp in scene.ramps
        if ramp.start < short.end_time
    )
    assert short.applied_impulse == pytest.approx(expected, rel=1e-13)  # the quadrature's
    assert short.impulse == scene.impulse


@pytest.mark.parametrize("momentum_ratio", [1e-4, 0.5, 1.0, 2.0, 100.0])
def test_default_end_time_vs_its_formula(momentum_ratio: float) -> None:
    scene = paper_scene("cosine", momentum_ratio, 3.0)
    assert scene.rise_time is not None
    slowed = min(1.0, momentum_ratio) ** 0.2
    natural = 1.2 * (60 + 5) / (0.9055 * slowed)
    expected = 3 * scene.rise_time + natural * scene.units.time
    assert scene.end_time == pytest.approx(expected, rel=1e-15)  # roundings


def test_what_only_python_can_give_wrong(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="number of values of radius = 2: must be a number, or 3"):
        replace(CHAIN, granules=3, radius=[1.0, 2.0])
    table = hc.Scene(CHAIN, hc.PulseTable((0.0, 1e-5), (0.0, 1.0)))
    with pytest.raises(SceneError, match=r"must not end in .csv"):
        table.to_toml(tmp_path / "a.csv")
