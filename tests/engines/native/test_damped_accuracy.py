"""Random damped scenes: native's errors are within their bounds."""

from __future__ import annotations

import numpy as np
import pytest

import hertzchain as hc
from tests.oracles import extrapolation
from tests.oracles.bounds import check_answers
from validation.random_drives import random_hard_scene
from validation.random_scenes import random_damped_scene

TOLERANCES = (1e-3, 1e-6, 1e-8)

LONGEST, LONGEST_TIME = 12, 60.0
"""Granules and natural time units of a scene."""

BLOCK = 10
"""Scenes of one slow test."""

SCENES = 300


def judge(number: int) -> None:
    """Assert that each answer of a random scene is within its own bound, or refused."""
    scene = random_damped_scene(np.random.default_rng([13, number]), LONGEST, LONGEST_TIME)
    check_answers(scene, [(hc.Native(rtol=rtol), rtol) for rtol in TOLERANCES])


def test_a_maximum_in_a_step_as_long_as_its_leg() -> None:
    """Every run that tells the error has this step: 1.7e-7 by interpolation, the whole bound."""
    scene = random_hard_scene(np.random.default_rng([7, 1, 20364]), 30, 200.0, is_damped=True)
    result = hc.Native(rtol=4.183e-6).run(scene)
    error = extrapolation.solve(scene).error_of(result.peak_force)
    assert error <= result.error_estimate
    assert error < 1e-9  # 2.5e-10 by the steps


@pytest.mark.parametrize("number", range(50, 60))
def test_random_damped_scenes(number: int) -> None:
    judge(number)


@pytest.mark.slow
@pytest.mark.parametrize("first", range(0, SCENES, BLOCK))
def test_many_random_damped_scenes(first: int) -> None:
    for number in range(first, first + BLOCK):
        judge(number)
