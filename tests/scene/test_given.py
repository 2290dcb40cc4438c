"""Files of scenes: those to start from, with terms, written and read again; paths for scenes."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import hertzchain as hc
from hertzchain.errors import SceneError
from hertzchain.scene.scene import unusual_values
from hertzchain.scene.starters import STARTERS, write_starter
from tests.conftest import STEEL, paper_scene
from tests.scene.test_refused import text_of
from tests.scene.test_scene import CHAIN, scene_of
from validation.random_scenes import (
    KINDS,
    Draw,
    pushed_within,
    random_damped_scene,
    thrown,
    with_wall_of_its_own,
)

SHORT = paper_scene("cosine", 1.0, 2.0, granules=8)

FUNCTIONS: dict[str, Callable[[Any], Any]] = {
    "run": lambda scene: hc.Native().run(scene).peak_force,
    "compare": lambda scene: hc.compare(scene, ["native"]).native.peak_force,
    "judge": lambda scene: hc.judge(scene, {2: 100.0}).reference.peak_force,
    "peak_forces": lambda scene: hc.peak_forces([scene, scene]).peak_force,
    "predict": lambda scene: hc.theory.predict(scene).peak_force,
    "sweep": lambda scene: hc.sweep(scene, {"shock.duration_ratio": [2.0]}).to_frame(
        ["largest_peak_force_N"]
    ),
}
"""By name; ``examine`` is called below, as it needs a deck."""


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("scenes") / "short.toml"
    SHORT.to_toml(path)
    return path


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_path_stands_for_its_scene(name: str, path: Path) -> None:
    function = FUNCTIONS[name]
    assert np.array_equal(function(str(path)), function(SHORT), equal_nan=True)
    for call in (function, hc.Lammps().run, lambda scene: hc.examine(scene, "in.mine")):
        with pytest.raises(SceneError, match=r"^nowhere\.toml: cannot be read"):
            call("nowhere.toml")


# To start from


TERMS = {
    "pulse": (),
    "half-sine": (),
    "pulse-table": (),
    "striker": ("striker",),
    "wall": ("striker", "wall"),
    "dimer": ("unlike granules",),
    "cradle": ("moving granules",),
    "precompressed": ("precompression",),
    "free-striker": ("striker", "precompression"),
    "damped": ("striker", "wall", "damping"),
    "piston": ("piston",),
    "sine": ("precompression",),
    "local": ("local shock", "precompression"),
    "clamped": ("striker", "fixed granules"),
    "two-walls": ("moving granules", "wall", "near wall"),
}


def test_every_kind_is_here() -> None:
    assert STARTERS.keys() == TERMS.keys()
    assert set(STARTERS.values()) == set(STARTERS["pulse"].parent.glob("*.toml"))


@pytest.mark.parametrize("kind", TERMS)
def test_a_starter_runs_and_is_what_its_name_says(kind: str, tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    files = write_starter(kind, path)
    assert sorted(tmp_path.iterdir()) == sorted(files)
    scene = hc.Scene.from_toml(path)
    assert scene.terms == TERMS[kind]
    assert unusual_values(scene) == []
    result = hc.Native(rtol=1e-4, wanted="all").run(scene)
    assert result.error_estimate <= 1e-4
    assert result.peak_force.min() > 0
    assert result.warnings == ()


# Segments, sequences and loads


def test_segments_cells_and_tapers(tmp_path: Path) -> None:
    text = (
        "pulse chain.granules=9; chain.segments=[{granules=1, radius=1e-2},"
        " {granules=5, cell=[{}, {density=1000, gap=1e-6}]},"
        " {granules=3, radius=4e-3, radius_ratio=0.5}]"
    )
    chain = scene_of(tmp_path, text_of(text)).chain
    steel = STEEL["radius"]
    assert chain.radius == pytest.approx((1e-2, *[steel] * 5, 4e-3, 2e-3, 1e-3), rel=1e-15)
    iron = pytest.approx(STEEL["density"], rel=1e-15)
    assert chain.density == (iron, iron, 1000.0, iron, 1000.0, iron, iron, iron, iron)
    assert chain.gap == (0, 0, 1e-6, 0, 1e-6, 0, 0, 0, 0)
    assert isinstance(chain.young_modulus, float)
    cells = 'chain.segments=[{granules=60, cell=[{}, {yield_strength="20 MPa"}]}]'
    text = text_of(f'pulse chain.yield_strength="300 MPa"; {cells}')
    assert scene_of(tmp_path, text).chain.yield_strength == (3e8, 2e7) * 30


def test_sequences_and_numbers_of_numpy_in_python() -> None:
    radius = np.array([1e-3, 2e-3, 3e-3])
    chain = hc.Chain(3, radius, [1e9, 1e9, 1e9], 0.3, (1.0, 2.0, 3.0))
    assert chain.radius == (1e-3, 2e-3, 3e-3)
    assert chain.young_modulus == 1e9
    assert hash(chain) == hash(hc.Chain(3, radius.tolist(), 1e9, 0.3, [1, 2, 3]))
    chain = hc.Chain(3, np.array(1e-3), np.float64(1e9), 0.3, 1000.0)
    assert chain == hc.Chain(3, 1e-3, 1e9, 0.3, 1000.0)
    unlike = hc.Chain(3, [1e-3, 2e-3, 1e-3], 1e9, 0.3, 1000.0)
    for what in ("granule_mass", "contact_stiffness"):
        with pytest.raises(SceneError, match=f"{what}: is a single number only in a chain"):
            getattr(unlike, what)


@pytest.mark.parametrize("wall", [None, hc.Wall("rigid")], ids=str)
def test_a_free_striker_touches_a_chain_that_is_pressed_without_it(wall: hc.Wall | None) -> None:
    gravity = 0.0 if wall is None else 9.81
    load, chain = hc.Precompression(2.0, gravity), hc.Chain(4, **STEEL)
    scene = hc.Scene(chain, hc.Striker(0.1), wall=wall, precompression=load)
    shorter = hc.Scene(
        hc.Chain(3, **STEEL), hc.Striker(0.1, loaded=True), wall=wall, precompression=load
    )
    granules, others = scene.granules, shorter.granules
    assert granules.static_force.tolist() == [0.0, *others.static_force]
    assert granules.constant_force.tolist() == [granules.mass[0] * gravity, *others.constant_force]
    assert granules.position[1] == 2 * chain.radius
    assert granules.position[1:] - granules.position[1] == pytest.approx(others.position)


# Written and read


def with_terms(rng: np.random.Generator, longest: int) -> hc.Scene:
    """A damped scene with terms of all kinds; granules move at the start, or any is pushed."""
    scene = with_wall_of_its_own(rng, random_damped_scene(rng, longest))
    spread = hc.Uncertain("chain.radius", 0.05, relative=True)
    scatter = hc.Uncertain("chain.radius", 1e-5, uniform=True, each=True)
    scene = replace(scene, uncertain=(spread, scatter))
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
