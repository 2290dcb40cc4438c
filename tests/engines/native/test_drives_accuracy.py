"""Random scenes with pistons and sines: errors are within their bounds."""

from __future__ import annotations

import numpy as np
import pytest

import hertzchain as hc
from tests.conftest import STEEL
from tests.oracles.bounds import check_answers
from validation.random_drives import random_scene_with_piston, random_scene_with_sine
from validation.random_scenes import damped

DRAWN = {"piston": random_scene_with_piston, "sine": random_scene_with_sine}

TOLERANCES = (1e-3, 1e-6, 1e-9)

LONGEST, LONGEST_TIME = 12, 250.0
"""Granules and natural time units of a scene."""

BLOCK, SCENES = 10, 200
"""Scenes of one slow test, and of all of a kind."""


def judge(kind: str, number: int, is_damped: bool) -> None:
    """Assert that each answer of a random scene is within its own bound, or refused."""
    rng = np.random.default_rng([19, number])
    scene = DRAWN[kind](rng, LONGEST, LONGEST_TIME)
    scene = damped(rng, scene) if is_damped else scene
    check_answers(scene, [(hc.Native(rtol=rtol), rtol) for rtol in TOLERANCES])


def test_short_strokes_have_other_steps_in_every_run_that_tells_an_error() -> None:
    """Three strokes of one step: the second run and the third had the same, 3.5 bounds off."""
    scene = random_scene_with_piston(np.random.default_rng([7001, 2653]), LONGEST, LONGEST_TIME)
    check_answers(scene, [(hc.Native(rtol=1e-3), 1e-3)])


def test_a_piston_that_stops_before_a_strong_damper() -> None:
    """Its contact would pull at once, and presses again before a step is over."""
    stops = hc.Piston(None, (1e-5, 1.5e-5), (0.0, 1e-6))
    law = hc.Contact("restitution", restitution=0.01)
    chain, pressed = hc.Chain(4, **STEEL), hc.Precompression(10.0)
    scene = hc.Scene(chain, stops, hc.Run(1e-4), precompression=pressed, contact=law)
    asked = [(hc.Native(rtol=rtol), rtol) for rtol in TOLERANCES]
    assert len(check_answers(scene, asked)) == len(asked)


def test_a_stroke_shorter_than_a_step() -> None:
    """It is not a single step, both of a run and of that which tells its error."""
    short = hc.Piston(None, (1e-5, 1.2e-5, 3e-5), (0.0, 1e-7, -3e-7))
    law, pressed = hc.Contact("dashpot", coefficient=10.0), hc.Precompression(0.01)
    chain, end = hc.Chain(4, **STEEL), hc.Run(1.5e-4)
    scene = hc.Scene(chain, short, end, precompression=pressed, contact=law)
    asked = [(hc.Native(rtol=rtol), rtol) for rtol in TOLERANCES]
    assert len(check_answers(scene, asked)) == len(asked)


@pytest.mark.parametrize("is_damped", [False, True], ids=["elastic", "damped"])
@pytest.mark.parametrize("kind", DRAWN)
@pytest.mark.parametrize("number", [1, 2])
def test_random_scenes(kind: str, number: int, is_damped: bool) -> None:
    judge(kind, number, is_damped)


@pytest.mark.slow
@pytest.mark.parametrize("is_damped", [False, True], ids=["elastic", "damped"])
@pytest.mark.parametrize("kind", DRAWN)
@pytest.mark.parametrize("first", range(0, SCENES, BLOCK))
def test_many_random_scenes(kind: str, first: int, is_damped: bool) -> None:
    for number in range(first, first + BLOCK):
        judge(kind, number, is_damped)
