"""Sweeps of any scene file: each scene equals a file with the keys typed in."""

from __future__ import annotations

import copy
import itertools
import re
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest
import tomli_w
from hypothesis import given, settings
from hypothesis import strategies as st

import hertzchain as hc
from hertzchain.errors import SceneError
from hertzchain.sweeps.design import design
from hertzchain.sweeps.keys import names_of


def files() -> st.SearchStrategy[dict[str, Any]]:
    """Scene files with terms, as mappings."""
    number = {
        "radius": st.sampled_from([4e-3, "5 mm"]),
        "young_modulus": st.sampled_from([1e11, "70 GPa"]),
        "poisson_ratio": st.sampled_from([0.2, 0.3]),
        "density": st.sampled_from([2000, "7.9 g/cm^3"]),
    }
    gap = {"gap": st.sampled_from([0, "1 um"])}
    different = st.fixed_dictionaries({}, optional=number | gap)
    count = st.integers(1, 4)
    segment = st.one_of(
        st.fixed_dictionaries(
            {"granules": count},
            optional={**number, **gap, "radius_ratio": st.sampled_from([0.9, 1.1])},
        ),
        st.fixed_dictionaries(
            {"granules": count, "cell": st.lists(different, min_size=1, max_size=3)},
            optional=number,
        ),
    )
    wall = st.one_of(
        st.fixed_dictionaries({"kind": st.sampled_from(["rigid", "same"])}, optional=gap),
        st.just({"kind": "elastic", "young_modulus": "200 GPa", "poisson_ratio": 0.3}),
    )
    pulse = st.fixed_dictionaries(
        {"profile": st.just("cosine"), "peak_force": st.just(100), "duration_ratio": st.just(2)}
    )
    measure = st.sampled_from([{"momentum_ratio": 1.5}, {"rise_time": "30 us"}])
    return st.fixed_dictionaries(
        {
            "chain": st.fixed_dictionaries(
                number, optional={**gap, "segments": st.lists(segment, min_size=2, max_size=3)}
            ),
            "push": st.one_of(
                st.tuples(st.just("shock"), pulse, measure),
                st.tuples(
                    st.just("striker"),
                    st.fixed_dictionaries({"velocity": st.just("1 m/s")}, optional=number),
                ),
            ),
        },
        optional={"wall": wall, "precompression": st.just({"force": "5 N"})},
    )


def text_of(document: dict[str, Any]) -> str:
    document = copy.deepcopy(document)
    name, *parts = document.pop("push")
    document[name] = {key: value for part in parts for key, value in part.items()}
    segments = document["chain"].get("segments", [])
    counts = [segment["granules"] for segment in segments]
    document["chain"].setdefault("granules", sum(counts) or 7)
    return tomli_w.dumps(document)


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
    "momentum_ratio": [0.5, 2.0],
    "rise_time": [2e-5, 4e-5],
    "end_time": [1e-3, 2e-3],
    "duration_ratio": [3.0, 4.0],
    "profile": ["triangular", "cosine-triangular"],
}


@given(st.data())
@settings(max_examples=20)
def test_a_parameter_is_a_key_of_the_file(data: st.DataObject) -> None:
    """Each scene of a sweep equals a file with the keys changed by hand."""
    document = data.draw(files())
    with TemporaryDirectory() as folder:
        path = Path(folder) / "scene.toml"

        def read(changed: dict[str, Any]) -> hc.Scene:
            path.write_text(text_of(changed))
            return hc.Scene.from_toml(path)

        try:
            base = read(document)
        except SceneError:
            return
        names = data.draw(
            st.lists(st.sampled_from(names_of(base)), min_size=1, max_size=3, unique=True)
        )
        vary = {name: VALUES[name.rpartition(".")[2]] for name in names}
        try:
            found = design(base, vary)
        except SceneError:  # other tests are about these
            return
        parameters = found.parameters(np.arange(found.scenes))
        for k, values in enumerate(itertools.product(*vary.values())):
            wanted = copy.deepcopy(document)
            for name, value in zip(names, values, strict=True):
                type_in(wanted, name, value)
            try:
                expected = read(wanted)
            except SceneError as problem:
                with pytest.raises(SceneError, match=re.escape(problem.allowed)):
                    found.scene(parameters, k)
                continue
            assert found.scene(parameters, k) == expected
            assert parameters["chain.granules"][k] == expected.chain.granules


def type_in(document: dict[str, Any], name: str, value: Any) -> None:
    """Change a key of a scene file as a person would."""
    section, *path, key = name.split(".")
    if section in ("shock", "striker"):
        for part in document["push"][1:]:
            if key in part or {key, *part} <= {"momentum_ratio", "rise_time"}:
                if len(part) == 1:  # the other measure of the pulse
                    part.clear()
                part[key] = value
                return
        document["push"][1][key] = value
        return
    at: Any = document.setdefault(section, {})
    if (section, key) == ("wall", "kind"):
        at.pop("young_modulus", None)
        at.pop("poisson_ratio", None)
    for step in path:
        at = at[int(step) - 1] if step.isdigit() else at[step]
    at[key] = value
