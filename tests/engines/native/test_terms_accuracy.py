"""Random scenes with terms: native's errors are within their bounds."""

from __future__ import annotations

import numpy as np
import pytest

import hertzchain as hc
from tests.oracles.bounds import by_methods, check_answers
from validation.random_scenes import random_scene_with_terms

TOLERANCES = (1e-3, 1e-6, 1e-9)
METHODS = ("velocity-verlet", "rk4", "reference")

LONGEST, LONGEST_TIME = 15, 600.0
"""Granules and natural time units of a scene."""

BLOCK = 10
"""Scenes of one slow test."""

SCENES = 300


def judge(number: int, methods: tuple[str, ...]) -> None:
    """Assert that each answer of a random scene is within its own bound, or refused."""
    rng = np.random.default_rng([8, number])
    scene = random_scene_with_terms(rng, LONGEST, LONGEST_TIME)
    asked = [(hc.Native(rtol=rtol), rtol) for rtol in TOLERANCES]
    asked += by_methods(scene, methods)
    check_answers(scene, asked)


@pytest.mark.parametrize("number", [0, 5, 7, 9, 10])
def test_random_scenes(number: int) -> None:
    judge(number, METHODS)


@pytest.mark.slow
@pytest.mark.parametrize("first", range(0, SCENES, BLOCK))
def test_many_random_scenes(first: int) -> None:
    for number in range(first, first + BLOCK):
        judge(number, METHODS if number % 5 == 0 else ())
