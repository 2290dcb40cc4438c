"""Scenes written and read again are equal."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import hertzchain as hc
from hertzchain.errors import OutputError, SceneError
from tests.scene.test_scene import CHAIN
from validation.random_scenes import (
    KINDS,
    Draw,
    pushed_within,
    random_damped_scene,
    thrown,
    with_wall_of_its_own,
)


def with_terms(rng: np.random.Generator, longest: int) -> hc.Scene:
    """A damped scene with terms of all kinds; granules move at the start, or any is pushed."""
    scene = with_wall_of_its_own(rng, random_damped_scene(rng, longest))
    chain = scene.chain
    if isinstance(chain.gap, float) and chain.gap > 0:  # files of granules have 0 before the first
        scene = replace(scene, chain=replace(chain, gap=(0, *[chain.gap] * (chain.granules - 1))))
    if rng.random() < 0.5:
        with suppress(SceneError):  # they meet nothing
            return thrown(rng, scene)
    return pushed_within(rng, scene)


def there_and_back(scene: hc.Scene, folder: Path) -> hc.Scene:
    path = folder / "written.toml"
    scene.to_toml(path)
    return hc.Scene.from_toml(path)


@pytest.mark.parametrize("draw", [*KINDS.values(), with_terms], ids=lambda draw: draw.__name__)
@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=20)
def test_any_scene_written_and_read_is_equal(
    tmp_path_factory: pytest.TempPathFactory, draw: Draw, seed: int
) -> None:
    scene = draw(np.random.default_rng(seed), 12)
    read = there_and_back(scene, tmp_path_factory.getbasetemp())
    assert (read, read.terms) == (scene, scene.terms)


def test_a_written_table_lies_beside_the_scene(tmp_path: Path) -> None:
    hc.Scene(CHAIN, hc.PulseTable((0.0, 1e-5), (1.0, 2.0))).to_toml(tmp_path / "mine.toml")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["mine.csv", "mine.toml"]
    assert (tmp_path / "mine.csv").read_text() == "time_s,force_N\n0.0,1.0\n1e-05,2.0\n"


def test_a_scene_that_cannot_be_written_is_an_error(tmp_path: Path, demo: hc.Scene) -> None:
    for path in (tmp_path, tmp_path / "no" / "scene.toml"):
        with pytest.raises(OutputError):
            demo.to_toml(path)
    assert list(tmp_path.iterdir()) == []
