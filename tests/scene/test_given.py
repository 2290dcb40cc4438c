"""Files of scenes: those to start from, and paths in the place of scenes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.errors import SceneError
from hertzchain.scene.given import to_scene
from hertzchain.scene.starters import STARTERS, write_starter
from hertzchain.scene.usual import unusual_values
from tests.conftest import paper_scene

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


@pytest.mark.parametrize(
    "function", [*FUNCTIONS.values(), hc.Lammps().run, lambda scene: hc.examine(scene, "in.mine")]
)
def test_a_scene_file_that_is_not_there_is_named(function: Callable[[Any], Any]) -> None:
    with pytest.raises(SceneError, match=r"^nowhere\.toml: cannot be read"):
        function("nowhere.toml")


@pytest.mark.parametrize("given", ["short.toml", Path("short.toml"), SHORT, None, 3])
def test_a_batch_is_of_a_list(given: Any) -> None:
    with pytest.raises(SceneError, match=r"^scenes: must be a list of scenes, or of paths"):
        hc.peak_forces(given)


def test_a_scene_a_path_or_neither(path: Path) -> None:
    assert to_scene(SHORT) is SHORT
    assert to_scene(path) == SHORT
    said = r"must be a Scene or the path of a scene file \(TOML\)$"
    for given, start in ((None, "^scene: "), (SHORT.chain, "^scene = 'Chain': ")):
        with pytest.raises(SceneError, match=start + said):
            to_scene(given)  # type: ignore[arg-type]


# To start from


TERMS = {
    "pulse": (),
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
