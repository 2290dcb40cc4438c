"""Scene files to start from: each is a scene of the kind that its name says."""

from __future__ import annotations

from pathlib import Path

import pytest

import hertzchain as hc
from hertzchain.scene.starters import STARTERS, write_starter
from hertzchain.scene.usual import unusual_values

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
