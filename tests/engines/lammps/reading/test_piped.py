"""A LAMMPS binary finds the same in a deck as the Python module."""

from __future__ import annotations

import os
import re
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.engines.lammps.binary import look
from hertzchain.engines.lammps.reading.found import FoundDeck
from hertzchain.limits import Deadline
from tests.engines.lammps.reading.chains import BESIDE_PYTHON, SCENE, Deck, read_deck

pytestmark = pytest.mark.lammps

slow = pytest.mark.slow

OTHERS = [path for path in os.environ.get("HERTZCHAIN_TEST_LMPS", "").split(os.pathsep) if path]

EXACT = ("ids", "types", "position", "sideways", "radius", "mass", "velocity", "spin", "integrated")

MORE = """group last id 6
fix load last addforce 0 0.5 0
fix weight all gravity 10 vector 0 -1 0
fix air all viscous 1e-3
fix wall last wall/gran granular hertz 1e10 0 tangential linear_nohistory 0 0 yplane NULL 4.5
velocity last set 0 0 0.1
"""


def numbers(found: FoundDeck, name: str) -> np.ndarray:
    """Return the numbers and arrays that were found."""
    return np.asarray(getattr(found, name), np.float64)


@pytest.mark.parametrize(
    "lmp", [BESIDE_PYTHON, *(pytest.param(path, marks=slow) for path in OTHERS)]
)
def test_a_binary_makes_of_a_deck_what_the_module_makes(lmp: str, tmp_path: Path) -> None:
    run = "run 150\nrun 300 pre no\nunfix push\nrun 100 every 30 NULL"
    deck = Deck("cgs", "y", more=MORE, run=run)
    path = deck.write(tmp_path)
    by_module, by_binary = read_deck(path, SCENE), read_deck(path, SCENE, lmp=lmp)
    assert [path.name for path in tmp_path.iterdir()] == ["in.mine"]
    for name in EXACT:
        assert np.array_equal(numbers(by_module, name), numbers(by_binary, name)), name
    for name in ("units", "axis", "reversed", "image_gap", "first_run", "runs", "commands"):
        assert getattr(by_module, name) == getattr(by_binary, name), name
    # Numbers of 17 digits go to and fro; versions from 2022 on differ by round-off.
    close = [
        field.name
        for field in fields(FoundDeck)
        if isinstance(getattr(by_module, field.name), np.ndarray | float)
        and field.name not in (*EXACT, "applied_time", "applied_force", "driven_time",
                               "peak_reading_error", "image_force")
    ]  # fmt: skip
    assert {"contact_force", "damped_force", "peak_force", "constant_force", "drag"} <= set(close)
    for name in close:
        known = numbers(by_module, name)
        largest = np.max(np.abs(known), initial=0.0, where=np.isfinite(known))
        np.testing.assert_allclose(
            numbers(by_binary, name), known, rtol=1e-9, atol=1e-9 * largest, err_msg=name
        )
    there = [
        np.interp(by_module.applied_time, found.applied_time, found.applied_force[:, 0])
        for found in (by_module, by_binary)
    ]
    np.testing.assert_allclose(there[1], there[0], rtol=0, atol=1e-9 * 20)
    (ours,), (theirs,) = by_module.walls, by_binary.walls
    np.testing.assert_allclose(theirs.position, ours.position, rtol=1e-12)
    np.testing.assert_allclose(theirs.force, ours.force, rtol=1e-9)


@pytest.mark.parametrize("lmp", [pytest.param(None, marks=slow), BESIDE_PYTHON])
def test_a_force_may_follow_the_steps_of_its_run(lmp: str | None, tmp_path: Path) -> None:
    """Runs are not cut where they are read."""
    path = tmp_path / "in.mine"
    text = re.sub(r"\btime\b", "(elapsed*dt)", Deck(steps=450).text())
    path.write_text(text)
    found = read_deck(path, SCENE, lmp=lmp)
    expected = SCENE.applied_force(found.applied_time)
    assert found.applied_force[:, 0] == pytest.approx(expected, rel=1e-9, abs=1e-9)
    assert found.runs[0].steps == 450


@pytest.mark.parametrize("lmp", [None, pytest.param(BESIDE_PYTHON, marks=slow)])
def test_numbers_of_a_deck_that_stops(lmp: str | None, tmp_path: Path) -> None:
    """They are known before its run, and its runs and forces without its motion."""
    more = "timestep 1e-3\nvelocity hit set 1e3 0 0"
    found = read_deck(Deck(more=more, steps=20).write(tmp_path), SCENE, lmp=lmp, time_limit=60.0)
    assert found.stopped
    assert "\n" not in found.stopped
    assert found.velocity[0, 0] == 1e3
    assert [run.steps for run in found.runs] == [20]
    assert np.all(np.isnan(found.peak_force))


WALL = (
    "fix wall all wall/gran granular hertz/material 70000000000.0 0 0.25"
    " tangential linear_nohistory 0 0 xplane NULL 0.044"
)


@slow
@pytest.mark.parametrize("lmp", [BESIDE_PYTHON, *OTHERS])
def test_a_wall_of_hertz_material_is_wrong_on_lammps_before_2023(lmp: str, tmp_path: Path) -> None:
    """It takes E/(2(1-nu)) there in place of E/(2(1-nu^2)): 1 + nu times the stiffness."""
    scene = replace(SCENE, wall=hc.Wall("same"), run=hc.Run(end_time=2e-4))
    path = Deck(more=WALL, steps=2000).write(tmp_path)
    version = look(lmp, Deadline(60)).version
    of_2022 = version < "2023"
    examined = hc.examine(scene, path, lmp=lmp)
    assert examined.verdict == ("fail" if of_2022 else "pass")
    failed = {check.name: check for check in examined.checks if not check.passed}
    assert set(failed) == ({"stiffness of the wall", "peaks"} if of_2022 else set())
    if of_2022:
        check = failed["stiffness of the wall"]
        told = f"(1.25 times: LAMMPS of {version[:4]} takes E/(2(1-nu)) for a wall"
        assert told in check.sentence
        path.write_text(path.read_text().replace(WALL, check.command))
        assert hc.examine(scene, path, lmp=lmp).verdict == "pass"
