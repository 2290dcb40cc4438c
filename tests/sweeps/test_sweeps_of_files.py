"""Sweeps of any scene file: each scene equals a file with the keys typed in."""

from __future__ import annotations

import copy
import itertools
import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w

import hertzchain as hc
from hertzchain.errors import SceneError
from hertzchain.scene.starters import STARTERS, write_starter
from hertzchain.sweeps.design import design
from hertzchain.sweeps.keys import names_of

VALUES: dict[str, list[Any]] = {
    "granules": [3, 5],
    "radius": [4.5e-3, 6e-3],
    "young_modulus": [8e10, 2e11],
    "poisson_ratio": [0.1, 0.4],
    "density": [3000.0, 9000.0],
    "gap": [0.0, 2e-6],
    "radius_ratio": [0.8, 1.0],
    "velocity": [0.5, 2.0],
    "kind": ["rigid", "same"],
    "force": [1.0, 10.0],
    "gravity": [0.0, 9.81],
    "peak_force": [10.0, 50.0],
    "amplitude": [0.5, 1.0],
    "frequency": [4e3, 9e3],
    "cycles": [1, 3],
    "granule": [2, 3],
    "momentum_ratio": [0.5, 2.0],
    "rise_time": [2e-5, 4e-5],
    "end_time": [1e-3, 2e-3],
    "duration_ratio": [3.0, 4.0],
    "profile": ["triangular", "cosine-triangular"],
    "restitution": [0.5, 0.9],
    "relaxation_time": [1e-7, 1e-6],
    "coefficient": [1.0, 5.0],
}
MEASURES = ("momentum_ratio", "rise_time")
"""Each replaces the other."""


@pytest.mark.parametrize("kind", STARTERS)
def test_a_parameter_is_a_key_of_the_file(kind: str, tmp_path: Path) -> None:
    """Each scene of a sweep over a key and the next one equals a file changed by hand."""
    path = write_starter(kind, tmp_path / "scene.toml")[0]
    document = tomllib.loads(path.read_text(encoding="utf-8"))
    base = hc.Scene.from_toml(path)
    for varied in itertools.pairwise(names_of(base)):
        vary = {name: VALUES[name.rpartition(".")[2]] for name in varied}
        try:
            found = design(base, vary)
        except SceneError:  # other tests are about these
            continue
        parameters = found.parameters(np.arange(found.scenes))
        for k, values in list(enumerate(itertools.product(*vary.values())))[1:3]:
            path.write_text(typed_in(document, dict(zip(varied, values, strict=True))))
            try:
                expected = hc.Scene.from_toml(path)
            except SceneError as problem:
                with pytest.raises(SceneError, match=re.escape(problem.allowed)):
                    found.scene(parameters, k)
                continue
            assert found.scene(parameters, k) == expected
            assert parameters["chain.granules"][k] == expected.chain.granules


def typed_in(document: dict[str, Any], values: dict[str, Any]) -> str:
    """Change keys of a scene file as a person would."""
    document = copy.deepcopy(document)
    for name, value in values.items():
        section, *path, key = name.split(".")
        at: Any = document.setdefault(section, {})
        gone = MEASURES if key in MEASURES else ()
        if key == "kind":
            gone = ("young_modulus", "poisson_ratio")
        for other in gone:
            at.pop(other, None)
        for step in path:
            at = at[int(step) - 1] if step.isdigit() else at[step]
        at[key] = value
    chain = document["chain"]
    if segments := chain.get("segments"):
        chain["granules"] = sum(segment["granules"] for segment in segments)
    return tomli_w.dumps(document)
