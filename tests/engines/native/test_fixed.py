"""Granules that never move."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import hertzchain as hc
from hertzchain.errors import SceneError
from hertzchain.observables.wave import usual_wave
from hertzchain.report.run import of_result
from tests.conftest import STEEL

PULSE = hc.Pulse("cosine", 100.0, 2.0, rise_time=2e-5)
LOADS: dict[str, Any] = {
    "free": {},
    "pressed": {"precompression": hc.Precompression(20.0)},
    "piston": {"shock": hc.Piston(0.5)},
    "striker": {"shock": hc.Striker(0.5), "precompression": hc.Precompression(20.0)},
    "damped": {"contact": hc.Contact("restitution", restitution=0.9)},
}


def held(*numbers: int, granules: int = 8, shock: Any = PULSE, **more: Any) -> hc.Scene:
    """A chain of steel whose granules of these numbers are fixed."""
    fixed = [number in numbers for number in range(1, granules + 1)]
    return hc.Scene(hc.Chain(granules, **STEEL, fixed=fixed), shock, hc.Run(4e-4), **more)


SCENES = {
    f"{kind}, {numbers}": held(*numbers, **more)
    for kind, more in LOADS.items()
    for numbers in ((4,), (4, 8))
}


def test_weight_is_carried_by_fixed_granules() -> None:
    scene = held(3, 6, granules=6, precompression=hc.Precompression(2.0, gravity=10.0))
    weight = 10.0 * scene.granules.mass[0]
    expected = [2 + weight, 2 + 2 * weight, 0, weight, 2 * weight]
    assert scene.granules.static_force.tolist() == pytest.approx(expected, rel=1e-14)


REFUSED: dict[str, tuple[Any, str]] = {
    "side by side": (lambda: held(3, 4), "is next to granule 4, which does not move either"),
    "wall": (lambda: held(8, wall=hc.Wall("rigid")), "is next to the wall"),
    "all": (lambda: held(*range(1, 9)), "is next to granule 2"),
    "pushed": (lambda: held(1), "must not be fixed: the pulse moves it"),
    "piston": (lambda: held(1, shock=hc.Piston(1.0)), "must not be fixed: the piston moves it"),
    "loaded": (lambda: held(2, **LOADS["striker"]), "the static load presses it"),
    "gravity": (
        lambda: held(4, precompression=hc.Precompression(gravity=9.8)),
        "or a fixed last granule",
    ),
    "sine": (
        lambda: held(4, shock=hc.Sine(1.0, 5e3, 2, granule=6), **LOADS["pressed"]),
        "must be at most the static load",
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", REFUSED)
def test_refused(kind: str) -> None:
    make, words = REFUSED[kind]
    with pytest.raises(SceneError, match=words):
        make()
    velocity = [0.0, 1.0]
    with pytest.raises(SceneError, match="has a velocity at the start"):
        hc.Scene(hc.Chain(2, **STEEL, velocity=velocity, fixed=[False, True]))


def test_files_and_tables(tmp_path: Path) -> None:
    scene = held(3, 8)
    unlike = {**STEEL, "radius": [1e-3, 2e-3] * 4}
    gapped = hc.Chain(8, **unlike, gap=1e-6, fixed=scene.chain.fixed)
    for one in (scene, replace(scene, chain=gapped)):
        path = tmp_path / "scene.toml"
        one.to_toml(path)
        assert hc.Scene.from_toml(path) == one


def test_no_wave_beyond_a_fixed_granule() -> None:
    """It is that of a chain that ends there, and of contacts behind nothing is awaited."""
    scene = held(9, granules=16)
    long, short = (
        hc.Native(rtol=1e-8, wanted="first").run(one)
        for one in (scene, replace(scene, chain=held(9, granules=9).chain))
    )
    waves = [usual_wave(one.scene, one.first_columns) for one in (long, short)]
    assert (waves[0].first, waves[0].last) == (waves[1].first, waves[1].last)
    assert waves[0].speed == pytest.approx(waves[1].speed, rel=1e-6)
    assert long.is_reached.tolist() == [True] * 8 + [False] * 7
    document = of_result(long)
    assert document.peaks.row(12)[-1] == ""
