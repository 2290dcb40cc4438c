"""Pistons and sines by LAMMPS: comparisons, other sines, and slow ones."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.errors import HertzchainError
from hertzchain.observables.peaks import largest_difference
from hertzchain.verdict.run_checks import same_steps_checks
from tests.conftest import STEEL
from tests.engines.external.test_same_steps import DRIVES
from validation.random_drives import random_scene_with_piston, random_scene_with_sine


@pytest.mark.lammps
@pytest.mark.parametrize(
    "name", [pytest.param("column", marks=pytest.mark.slow), "above the cut-off, wall"]
)
def test_comparisons(name: str) -> None:
    compared = hc.compare(DRIVES[name])
    assert [check for check in compared.checks if not check.passed] == []
    assert compared.verdict == "pass"


@pytest.mark.lammps
@pytest.mark.parametrize(
    "other", [hc.Sine(10.00001, 8000.0, 3), hc.Sine(10.0, 8000.1, 3), hc.Sine(10.0, 8000.0, 4)]
)
def test_another_sine_is_found(other: hc.Sine) -> None:
    scene = DRIVES["as strong as the load"]
    run, load = hc.Run(scene.end_time), hc.Precompression(10.1)
    scene = hc.Scene(scene.chain, scene.shock, run, precompression=load)
    result = hc.Lammps(dt=0.02 * scene.contact_time).run(scene)
    assert all(check.passed for check in same_steps_checks(result))
    mistaken = replace(result, scene=replace(scene, shock=other))
    assert not all(check.passed for check in same_steps_checks(mistaken))


@pytest.mark.lammps
@pytest.mark.parametrize(
    "law", [None, pytest.param(hc.Contact("restitution", restitution=0.8), marks=pytest.mark.slow)]
)
def test_a_slow_sine_has_not_diverged(law: hc.Contact | None) -> None:
    """It throws a free chain at 26 m/s and catches it again, though its impulse is 0."""
    shock, pressed = hc.Sine(100.0, 100.0, 1), hc.Precompression(100.0)
    scene = hc.Scene(hc.Chain(3, **STEEL), shock, precompression=pressed, contact=law)
    result, native = (code(rtol=1e-3).run(scene) for code in (hc.Lammps, hc.Native))
    error = largest_difference(result.peak_force, native.peak_force)
    assert error <= result.error_estimate + native.error_estimate


@pytest.mark.lammps
@pytest.mark.slow
@pytest.mark.parametrize("draw", [random_scene_with_piston, random_scene_with_sine])
@pytest.mark.parametrize("number", range(20))
def test_random_scenes_at_the_same_steps(draw: Any, number: int) -> None:
    scene = draw(np.random.default_rng([21, number]), 30, 300.0)
    lammps = hc.Lammps(dt=0.01 * scene.contact_time, read_every=3)
    try:
        result = lammps.run(scene)
    except HertzchainError:
        return  # a refusal is honest
    for check in same_steps_checks(result):
        assert check.passed, check
