"""Commands on scenes with damped contacts, and the command line as a module."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import hertzchain as hc
from tests.command_line import Command, process
from tests.conftest import STEEL

PULSE = hc.Pulse("cosine", 100.0, 2.0, momentum_ratio=1.0)
DAMPED = hc.Scene(hc.Chain(3, **STEEL), PULSE, contact=hc.Contact("restitution", restitution=0.8))


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    path = tmp_path / "scene.toml"
    DAMPED.to_toml(path)
    return path


def test_the_package_is_a_program() -> None:
    outcome = process(
        "--version", code="import runpy; runpy.run_module('hertzchain', None, '__main__')"
    )
    assert (outcome.status, outcome.err) == (0, "")
    assert outcome.out.startswith("hertzchain ")
    assert "hertzchain.__main__" not in sys.modules


def test_nothing_of_the_paper_is_predicted_of_a_damped_chain(
    hertzchain: Command, scene: Path
) -> None:
    outcome = hertzchain("predict", scene)
    assert outcome.status == 0
    said = " ".join(outcome.out.split())
    assert "Eqs. 3 to 9 and the map are about uniform free chains" in said
    assert "this one has damping" in said
    assert "139/32" not in said
    assert hertzchain("predict", scene, "--json").json()["constants"] == []
    replace(DAMPED, contact=None).to_toml(scene)
    assert "139/32" in hertzchain("predict", scene).out
    assert len(hertzchain("predict", scene, "--json").json()["constants"]) == 5


@pytest.mark.lammps
def test_codes_are_compared_at_a_wanted_accuracy(hertzchain: Command, scene: Path) -> None:
    steps = []
    for rtol in ("1e-3", "1e-4"):
        document = hertzchain("compare", scene, "--rtol", rtol, "--json").json()
        assert document["verdict"] == "pass"
        found = document["results"]["lammps"]
        assert found["error_estimate"] <= float(rtol)
        assert document["results"]["native"]["error_estimate"] < 1e-8
        steps.append(found["steps"])
    assert np.diff(steps) > 0
