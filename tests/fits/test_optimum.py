"""Values of keys by which a number of a result is least or largest."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.errors import SceneError
from hertzchain.fits.optimum import optimum
from tests.command_line import Command
from tests.conftest import STEEL

SCENE = hc.Scene(
    hc.Chain(6, **STEEL), hc.Striker(0.5), wall=hc.Wall("rigid"), gauges=(hc.Gauge(granule=4),)
)


def test_an_optimum_within_the_range() -> None:
    """A striker of another density: the largest share of its speed goes on where masses are equal.

    The tie keeps the energy of the striker, so that the wave is highest at some density inside of
    the range, as a sweep over it shows, too.
    """
    scene = hc.Scene(SCENE.chain, hc.Striker(0.5, density=2000.0), gauges=(hc.Gauge(granule=6),))
    ties = {"striker.velocity": "20 / sqrt(striker.density)"}
    number, key = "gauge_1_first_peak_force_N", "striker.density"
    found = optimum(scene, number, [f"{key}=1000:40000"], largest=True, ties=ties)
    swept = hc.sweep(scene, {key: "1000:40000:40:log"}, ties=ties).to_frame()
    heights, densities = (swept[name].to_numpy(np.float64) for name in (number, key))
    assert found.value >= heights.max() * (1 - 1e-5)
    assert found.values[key] == pytest.approx(densities[np.argmax(heights)], rel=0.1)
    assert not found.remarks
    shown = replace(found, value=1.5, before=0.5, values={key: 2e3}, runs=1234, remarks=("so",))
    assert [line.split("  ")[-1].strip() for line in repr(shown).splitlines()[-4:]] == [
        *("1.5, before 0.5", "2000 kg/m³, before 2000"),
        *("1,234", "so"),
    ]
    assert ", not in the scene before" in repr(replace(found, start={key: None}))
    assert isinstance(found.scene.shock, hc.Striker)
    assert found.scene.shock.velocity == pytest.approx(20 / np.sqrt(found.values[key]))


@pytest.mark.slow
def test_a_wide_range_is_searched_as_a_whole() -> None:
    """Also by more than a factor of 100; a key says what the scene had, here no gap."""
    found = optimum(SCENE, "gauge_1_arrival_time_s", ["striker.velocity=1 mm/s:1"])
    assert found.values["striker.velocity"] == pytest.approx(1.0, rel=2e-3)
    slow = optimum(SCENE, "gauge_1_arrival_time_s", ["striker.velocity=1 mm/s:1"], largest=True)
    assert slow.values["striker.velocity"] == pytest.approx(1e-3, rel=2e-2)
    gaps = optimum(SCENE, "gauge_1_arrival_time_s", ["chain.gap=1 um:9 um"])
    assert gaps.to_dict()["parameters"][0]["start"] == 0.0


@pytest.mark.parametrize(
    ("number", "free", "words"),
    [
        ("wall_peak_force", ["striker.velocity=0.25:1"], "did you mean wall_peak_force_N?"),
        ("wall_peak_force", ["striker.velocity"], "did you mean wall_peak_force_N?"),
        ("wall_peak_force_N", ["striker.velocity"], "must have a range"),
        ("wall_peak_force_N", ["striker.velocity=1:2"], "must be within 1 and 2 m/s, to"),
        ("wall_peak_force_N", ["striker.velocity=0.25:1:5"], "must be the ends of its range"),
        ("wall_peak_force_N", ["gain"], "is of measured forces"),
        ("error_estimate", ["striker.velocity=0.25:1"], "is no number of this scene"),
    ],
)
def test_what_has_no_optimum(number: str, free: list[str], words: str) -> None:
    with pytest.raises(SceneError) as caught:
        optimum(SCENE, number, free)
    assert words in str(caught.value)


def test_keys_that_have_no_possible_scene() -> None:
    free, ties = ["striker.velocity=0.25:1"], {"chain.poisson_ratio": "striker.velocity + 1"}
    with pytest.raises(SceneError, match="have no possible scene"):
        optimum(SCENE, "wall_peak_force_N", free, ties=ties)


def test_the_command(tmp_path: Path, hertzchain: Command) -> None:
    scene = tmp_path / "scene.toml"
    SCENE.to_toml(scene)
    free = ("--free", "striker.velocity=0.25:1")
    best = tmp_path / "best.toml"
    fast = ("--minimise", "gauge_1_arrival_time_s")
    done = hertzchain("fit", scene, *fast, *free, "--json", "-o", best)
    assert done.status == 0, done.err
    assert done.json()["parameters"][0]["value"] == pytest.approx(1.0, rel=2e-3)
    assert "at an end of its range" in done.json()["remarks"][0]
    assert hc.Scene.from_toml(best).shock == hc.Striker(done.json()["parameters"][0]["value"])
