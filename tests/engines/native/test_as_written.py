"""Eq. 1 as it is written: in NumPy and SciPy, and the compiled loops held to it."""

from __future__ import annotations

import os
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.engines.native.duration import with_end
from hertzchain.observables.peaks import largest_difference
from hertzchain.verdict.reference_checks import as_written_check, is_quickly_written
from hertzchain.verdict.run_checks import balance_checks
from tests.command_line import python
from tests.conftest import STEEL
from tests.places import ROOT

SCENES = ROOT / "validation" / "scenes"
NAME = "native: compiled against Eq. 1 as written"

LONG = {
    *("terms/all_at_once", "terms/dimer", "terms/upright_column", "terms/striker_on_a_wall"),
    *("terms/light_defect", "terms/taper", "terms/clamped", "terms/damped_striker_on_a_wall"),
    *("terms/newtons_cradle", "terms/two_walls", "terms/local_shock"),
}
"""They take half a second or more."""
SHIPPED = ["demo", *sorted(f"terms/{path.stem}" for path in (SCENES / "terms").glob("*.toml"))]


def shipped(name: str) -> hc.Scene:
    return hc.Scene.from_toml(SCENES / f"{name}.toml")


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] * (name in LONG)) for name in SHIPPED]
)
def test_the_compiled_reference_agrees_and_the_check_is_there(name: str) -> None:
    reference = hc.Native("reference").run(shipped(name))
    assert is_quickly_written(reference)
    check = as_written_check(reference)
    assert (check.name, check.passed) == (NAME, True)
    assert check.tolerance < 1e-6
    if reference.scene.contact is None:
        assert check.measured < 1e-13  # round-off of equal steps: at most 3.1e-14 was seen


@pytest.mark.parametrize(
    ("name", "method"),
    [
        ("demo", "numpy"),
        ("demo", "scipy"),
        ("terms/piston", "numpy"),
        ("terms/piston", "scipy"),
        ("terms/striker_on_a_wall", "numpy"),
        ("terms/precompressed", "numpy"),
        ("terms/clamped", "numpy"),
        ("terms/local_shock", "scipy"),
        ("terms/upright_column", "scipy"),
        ("terms/damped_striker_on_a_wall", "scipy"),
    ],
)
def test_runs_are_as_accurate_as_they_say(name: str, method: str) -> None:
    scene = with_end(shipped(name))
    scene = replace(scene, run=hc.Run(0.5 * scene.end_time))
    found, true = (
        hc.Native(one, wanted="all").run(scene, record=7) for one in (method, "reference")
    )
    assert found.method == method
    assert found.error_estimate <= 1e-6
    difference = largest_difference(found.peak_force, true.peak_force)
    assert difference <= found.error_estimate + true.error_estimate
    assert [check.name for check in balance_checks(found) if not check.passed] == []
    # Forces at one time change faster than peaks, most at the front: at most 1.5e-6 was seen.
    largest = float(np.max(true.peak_force))
    forces = found.history.contact_force / largest, true.history.contact_force / largest
    assert forces[0] == pytest.approx(forces[1], rel=0, abs=3e-6)
    high = true.peak_force > 0.01 * largest
    # Times of maxima are as the root of their errors.
    times = found.peak_time[high] / scene.units.time, true.peak_time[high] / scene.units.time
    assert times[0] == pytest.approx(times[1], rel=0, abs=1e-3)


SHORT = hc.Scene(hc.Chain(5, **STEEL), hc.Pulse("cosine", 100.0, 2.0, momentum_ratio=1.0))


def test_a_given_step_and_a_wanted_accuracy() -> None:
    true = hc.Native("reference").run(SHORT)
    by_step = hc.Native("numpy", dt=0.1 * SHORT.units.time).run(SHORT)
    assert by_step.dt <= 0.1 * SHORT.units.time
    for found in (by_step, hc.Native("scipy", rtol=1e-4).run(SHORT)):
        assert largest_difference(found.peak_force, true.peak_force) <= found.error_estimate < 1e-4


@pytest.mark.parametrize("contact", [None, hc.Contact("restitution", restitution=0.8)])
def test_the_tolerance_of_the_check_on_both_sides(contact: hc.Contact | None) -> None:
    reference = hc.Native("reference").run(replace(SHORT, contact=contact))
    tolerance = as_written_check(reference).tolerance
    for part, passes in ((3.0, False), (1 / 3, True)):
        wrong = replace(reference, peak_force=reference.peak_force * (1 + part * tolerance))
        assert as_written_check(wrong).passed is passes


def test_long_runs_are_left_out_unless_they_are_asked_for() -> None:
    scene = replace(SHORT, chain=replace(SHORT.chain, granules=1000))
    said: list[str] = []
    left_out = hc.compare(scene, ["native"], progress=said.append)
    assert NAME not in {check.name for check in left_out.checks}
    assert any("--as-written" in line for line in said)
    short = replace(scene, run=hc.Run(30 * scene.units.time))
    assert NAME in {check.name for check in hc.compare(short, ["native"]).checks}
    reference = hc.Native("reference").run(short)
    many = replace(reference, force_evaluations=10**6)
    assert not is_quickly_written(many)


def test_a_time_limit_is_kept(demo: hc.Scene) -> None:
    check = as_written_check(hc.Native("reference").run(demo), 1e-9)
    assert (check.passed, check.measured) == (False, None)
    assert "time limit" in check.reason


STEP, CONTACTS = "elastic_step.py", "damped_contacts.py"
PLANTED = [
    (STEP, "right *= chain.stiffness[i]", "right *= chain.stiffness[0]", "terms/taper"),
    (STEP, "net *= chain.inverse_mass[i]", "net *= chain.inverse_mass[0]", "terms/taper"),
    (STEP, "right = r * np.sqrt(r)", "right = 1.0000001 * r * np.sqrt(r)", "demo"),
    (STEP, "net += chain.constant[i]", "net -= chain.constant[i]", "terms/upright_column"),
    (STEP, "r -= chain.gap[i]", "r -= 0.999 * chain.gap[i]", "terms/gapped"),
    (CONTACTS, "_mass[i] + constant[i]", "_mass[i] + 0.999 * constant[i]", "loaded"),
    (CONTACTS, "= stiffness[i] * d *", "= stiffness[0] * d *", "terms/damped_striker_on_a_wall"),
    (CONTACTS, "else math.sqrt(root)", "else root", "terms/damped"),
]
"""File, what stands there, the mistake, and a scene that has the term."""

JUDGE = """
import sys
import hertzchain as hc
from hertzchain.verdict.reference_checks import as_written_check
assert hc.__file__.startswith(sys.argv[2]), hc.__file__
reference = hc.Native("reference").run(hc.Scene.from_toml(sys.argv[1]))
print("passed", as_written_check(reference).passed)
"""


def judged(file: str, right: str, wrong: str, name: str, folder: Path) -> str:
    """What a copy of the package with the mistake says of its own reference."""
    shutil.copytree(
        ROOT / "hertzchain", folder / "hertzchain", ignore=shutil.ignore_patterns("__pycache__")
    )
    path = folder / "hertzchain" / "engines" / "native" / file
    text = path.read_text(encoding="utf-8")
    assert right in text
    path.write_text(text.replace(right, wrong), encoding="utf-8")
    scene = shipped("terms/damped" if name == "loaded" else name)
    if name == "loaded":
        scene = replace(
            scene, precompression=hc.Precompression(gravity=9.81), wall=hc.Wall("rigid")
        )
    scene.to_toml(folder / "scene.toml")
    environment = {
        **os.environ,
        "PYTHONPATH": str(folder),
        "NUMBA_CACHE_DIR": str(folder),
        "NUMBA_OPT": "0",  # compiles in half the time
    }
    done = python("-c", JUDGE, folder / "scene.toml", folder, cwd=folder, env=environment)
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


@pytest.mark.slow
@pytest.mark.parametrize(("file", "right", "wrong", "name"), PLANTED)
def test_a_mistake_in_the_compiled_loops_is_found(
    file: str, right: str, wrong: str, name: str, tmp_path: Path
) -> None:
    assert judged(file, right, wrong, name, tmp_path) == "passed False"


@pytest.mark.slow
@pytest.mark.parametrize("name", ["demo", "terms/damped"])
def test_a_copy_without_a_mistake_passes(name: str, tmp_path: Path) -> None:
    same = "elastic ="
    assert judged("damped_contacts.py", same, same, name, tmp_path) == "passed True"
