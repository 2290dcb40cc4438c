"""The comparison on scenes with terms, and what LAMMPS makes of their decks."""

from __future__ import annotations

import re
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.verdict.deck.own import number_checks
from tests.conftest import STEEL
from tests.engines.native.test_terms import PTFE, PULSE, SCENES, row

LMP = Path(sys.executable).with_name("lmp")
"""The binary that comes with the Python module."""

HELD = {"lammps: radius [m]", "lammps: constant force [N]", "lammps: velocity at the start [m/s]"}
"""Checks that only scenes with terms have."""


def failed(comparison: hc.Comparison) -> dict[str, str]:
    """Names and reasons of the checks that failed."""
    return {check.name: check.reason for check in comparison.checks if not check.passed}


QUICK = ("all at once", "gaps, wall")
"""Together they have each term of these scenes."""


@pytest.mark.lammps
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[] if name in QUICK else pytest.mark.slow) for name in SCENES]
)
def test_every_scene_passes(name: str) -> None:
    scene = SCENES[name]
    comparison = hc.compare(scene)
    assert failed(comparison) == {}
    assert comparison.verdict == "pass"
    names = {check.name for check in comparison.checks}
    assert names > HELD
    assert ("lammps: place of the wall [m]" in names) == (scene.wall is not None)


@pytest.mark.lammps
@pytest.mark.parametrize(
    "scene",
    [
        # A shock too weak for LAMMPS to follow; large granules.
        hc.Scene(hc.Chain(60, **STEEL), hc.Pulse("cosine", 1e-9, 2.0, momentum_ratio=1.0)),
        hc.Scene(
            hc.Chain(30, **{**STEEL, "radius": 100.0, "young_modulus": 1e5}),
            hc.Pulse("cosine-triangular", 1.0, 1.01, momentum_ratio=50.0),
        ),
        hc.Scene(row(PTFE, STEEL), PULSE, wall=hc.Wall("rigid")),
        hc.Scene(
            row(*[{**STEEL, "radius": 1e-3}, {**STEEL, "radius": 0.1}] * 3),
            PULSE,
            wall=hc.Wall("elastic", 1e6, 0.5),
        ),
        hc.Scene(
            hc.Chain(40, **STEEL),
            hc.Striker(1.0),
            wall=hc.Wall("same"),
            precompression=hc.Precompression(1e-3, 1e4),
        ),
        hc.Scene(hc.Chain(6, **STEEL, gap=0.05), PULSE, wall=hc.Wall("same", gap=1.0)),
        hc.Scene(
            hc.Chain(6, **STEEL),
            hc.PulseTable((0.0, 3e-5, 7e-5), (20.0, 100.0, 60.0)),
            hc.Run(5e-5),
            precompression=hc.Precompression(0.1),
        ),
    ],
    ids=["weak", "large", "two", "unlike sizes", "heavy", "far apart", "ends in the pulse"],
)
def test_any_scene_passes_its_examination(scene: hc.Scene) -> None:
    checks = number_checks(scene, hc.Lammps().examine(scene))
    assert [check.name for check in checks if not check.passed] == []


@pytest.mark.lammps
@pytest.mark.parametrize(
    ("array", "granule", "name"),
    [
        ("radius", 1, "lammps: radius [m]"),
        ("velocity", 0, "lammps: velocity at the start [m/s]"),
        ("constant_force", 11, "lammps: constant force [N]"),
    ],
)
def test_the_granule_that_is_off_is_named(array: str, granule: int, name: str) -> None:
    scene = SCENES["all at once"]
    found = hc.Lammps().examine(scene)
    values = getattr(found, array).copy()
    one = (granule,) if values.ndim == 1 else (granule, 0)
    # Three decimal digits of all that it is compared with.
    values[one] += 1e-3 * (scene.units.force if "force" in array else values[one])
    checks = number_checks(scene, replace(found, **{array: values}))
    wrong = [check for check in checks if not check.passed]
    assert [check.name for check in wrong] == [name]
    assert re.search(rf"granule {granule + 1}\b", wrong[0].reason)


@pytest.mark.lammps
def test_forces_that_are_no_numbers_fail() -> None:
    scene = SCENES["all at once"]
    found = hc.Lammps().examine(scene)
    nothing = np.full_like(found.contact_force, np.nan)
    walls = (replace(found.walls[0], position=np.nan),)
    moving = np.full_like(found.damped_force, np.nan)
    wrong = replace(found, contact_force=nothing, damped_force=moving, walls=walls)
    bad = [check for check in number_checks(scene, wrong) if not check.passed]
    assert [check.name for check in bad] == ["lammps: place of the wall [m]", "lammps: contacts"]
    assert all(check.measured is None for check in bad)
