"""Random scenes with terms: native's errors, judged by SciPy, are within their bounds."""

from __future__ import annotations

import numpy as np
import pytest

import hertzchain as hc
from tests.oracles import terms_in_si
from tests.oracles.bounds import check_answers
from validation.random_scenes import random_scene_with_terms

TOLERANCES = (1e-3, 1e-6, 1e-9)
METHODS = ("velocity-verlet", "rk4", "reference")

LONGEST, LONGEST_TIME = 15, 600.0
"""Granules and natural time units of a scene: SciPy takes about two seconds for one."""

MOST_STEPS = 8000
"""Most steps of SciPy (chosen); granules that collide repeatedly take more."""

BLOCK = 10
"""Scenes of one slow test."""

SCENES = 300


def judge(number: int, methods: tuple[str, ...]) -> bool:
    """Assert that each answer is within its bound; return False if SciPy cannot judge the scene."""
    rng = np.random.default_rng([8, number])
    scene = random_scene_with_terms(rng, LONGEST, LONGEST_TIME)
    try:
        coarse, true = (
            terms_in_si.peaks(scene, rtol, MOST_STEPS).peak_force for rtol in (1e-12, 1e-13)
        )
    except ArithmeticError:
        return False
    asked = [(hc.Native(rtol=rtol), rtol) for rtol in TOLERANCES]
    asked += [(hc.Native(method), 1.0) for method in methods]
    check_answers(scene, asked, coarse, true)
    return True


@pytest.mark.parametrize("number", [0, 5, 7, 9, 10])
def test_random_scenes(number: int) -> None:
    assert judge(number, METHODS)


@pytest.mark.slow
@pytest.mark.parametrize("first", range(0, SCENES, BLOCK))
def test_many_random_scenes(first: int) -> None:
    judged = [
        judge(number, METHODS if number % 5 == 0 else ()) for number in range(first, first + BLOCK)
    ]
    # A scene in a hundred is beyond SciPy.
    assert sum(judged) >= BLOCK - 2
