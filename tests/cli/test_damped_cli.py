"""Commands on scenes with damped contacts, and the command line as a module."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import ArrayLike

import hertzchain as hc
from hertzchain.engines.native import Native
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


def test_damped_run_that_misses_the_wanted_accuracy_says_so(
    hertzchain: Command, scene: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = Native.run

    def rough(native: Native, scene: hc.Scene, record: ArrayLike | None = None) -> hc.Result:
        return replace(run(native, scene, record), error_estimate=1e-4)

    assert hertzchain("run", scene).status == 0
    monkeypatch.setattr(Native, "run", rough)
    outcome = hertzchain("run", scene, "--rtol", "9.9e-5")
    assert outcome.status == 1
    assert "wanted 9.9e-05, reached 0.0001: native cannot reach this accuracy" in outcome.err
    assert hertzchain("run", scene, "--rtol", "1.1e-4").status == 0


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
