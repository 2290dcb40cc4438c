"""Random scenes with pistons and sines: errors, judged by SciPy, are within their bounds."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.engines.native.equations import Chain
from hertzchain.observables.peaks import largest_difference
from tests.conftest import STEEL
from tests.oracles import damped, terms_in_si
from tests.oracles.bounds import check_answers
from tests.oracles.terms_in_si import Floats
from validation.random_drives import random_scene_with_piston, random_scene_with_sine

DRAWN = {"piston": random_scene_with_piston, "sine": random_scene_with_sine}

TOLERANCES = (1e-3, 1e-6, 1e-9)

LONGEST, LONGEST_TIME = 12, 250.0
"""Granules and natural time units of a scene: SciPy takes about a second for one."""

MOST_STEPS = 6000
"""Most steps of SciPy (chosen); granules that collide repeatedly take more."""

BLOCK, SCENES = 10, 200
"""Scenes of one slow test, and of all of a kind."""

LAWS = (
    hc.Contact("restitution", restitution=0.8),
    hc.Contact("restitution", restitution=0.3, attraction=True),
    hc.Contact("dashpot", coefficient=1.0),
)


def judge(kind: str, number: int) -> bool:
    """Assert that answers are within their bounds; return False if SciPy cannot judge the scene."""
    scene = DRAWN[kind](np.random.default_rng([19, number]), LONGEST, LONGEST_TIME)
    try:
        coarse, true = (
            terms_in_si.peaks(scene, rtol, MOST_STEPS).peak_force for rtol in (1e-12, 1e-13)
        )
    except ArithmeticError:
        return False
    check_answers(scene, [(hc.Native(rtol=rtol), rtol) for rtol in TOLERANCES], coarse, true)
    return True


def true_peaks(scene: hc.Scene, rtol: float) -> Floats:
    """Compute peaks of damped contacts by SciPy [N], in natural units; the drive is in SI."""
    units, shock = scene.units, scene.shock
    chain, end = Chain.of(scene), scene.end_time / scene.units.time
    start = np.zeros((2, scene.chain.granules))
    more: dict[str, Any] = {}
    corners = [0.0]
    if isinstance(shock, hc.Piston):
        if shock.time is not None:
            corners = sorted({0.0, *(t / units.time for t in shock.time)})

        def piston(begin: float, stop: float) -> tuple[float, float]:
            assert isinstance(shock, hc.Piston)
            place, velocity = terms_in_si._piston(shock, begin * units.time, stop * units.time)
            return place / units.length, velocity / units.velocity

        more["piston"] = piston
    else:
        assert isinstance(shock, hc.Sine)
        corners.append(shock.cycles / shock.frequency / units.time)
    over = corners[-1]

    def push(time: float) -> float:
        if isinstance(shock, hc.Piston) or time > over:
            return 0.0
        phase = 2 * math.pi * shock.frequency * units.time * time
        return shock.amplitude / units.force * math.sin(phase)

    corners = [corner for corner in corners if corner < end] + [end]
    found = damped.peaks(chain, push, corners, start, rtol, **more)
    return np.asarray(found.peak_force * units.force)


def judge_damped(kind: str, number: int) -> None:
    """Answers on a random damped scene are within their bounds."""
    scene = DRAWN[kind](np.random.default_rng([20, number]), 5, 60.0)
    law = LAWS[number % 3]
    if law.damping == "dashpot":
        each = scene.granules
        natural = float(each.stiffness[0]) * scene.units.length**1.5 / scene.units.velocity
        law = replace(law, coefficient=0.2 * natural)
    scene = replace(scene, contact=law)
    coarse, true = (true_peaks(scene, rtol) for rtol in (1e-11, 1e-12))
    unsure = largest_difference(coarse, true)
    for rtol in TOLERANCES:
        try:
            result = hc.Native(rtol=rtol).run(scene)
        except hc.HertzchainError:
            continue  # a refusal is honest
        error = largest_difference(result.all_peaks, true)
        # SciPy's tolerance is that of a step; it knows nothing of contacts that begin and end.
        assert error <= result.error_estimate + 10 * unsure + 2e-7, (number, rtol)


def test_short_strokes_have_other_steps_in_every_run_that_tells_an_error() -> None:
    """Three strokes of one step: the second run and the third had the same, 3.5 bounds off."""
    scene = random_scene_with_piston(np.random.default_rng([7001, 2653]), LONGEST, LONGEST_TIME)
    coarse, true = (terms_in_si.peaks(scene, rtol).peak_force for rtol in (1e-7, 1e-8))
    check_answers(scene, [(hc.Native(rtol=1e-3), 1e-3)], coarse, true)


@pytest.mark.parametrize("rtol", [1e-3, 1e-6])
def test_a_piston_that_stops_before_a_strong_damper(rtol: float) -> None:
    """Its contact would pull at once, and presses again before a step is over."""
    stops = hc.Piston(None, (1e-5, 1.5e-5), (0.0, 1e-6))
    law = hc.Contact("restitution", restitution=0.01)
    chain, pressed = hc.Chain(4, **STEEL), hc.Precompression(10.0)
    scene = hc.Scene(chain, stops, hc.Run(1e-4), precompression=pressed, contact=law)
    true = true_peaks(scene, 1e-12)
    result = hc.Native(rtol=rtol).run(scene)
    assert largest_difference(result.all_peaks, true) <= result.error_estimate


@pytest.mark.parametrize("rtol", [1e-3, 1e-6])
def test_a_stroke_shorter_than_a_step(rtol: float) -> None:
    """It is not a single step, both of a run and of that which tells its error."""
    short = hc.Piston(None, (1e-5, 1.2e-5, 3e-5), (0.0, 1e-7, -3e-7))
    law, pressed = hc.Contact("dashpot", coefficient=10.0), hc.Precompression(0.01)
    chain, end = hc.Chain(4, **STEEL), hc.Run(1.5e-4)
    scene = hc.Scene(chain, short, end, precompression=pressed, contact=law)
    true = true_peaks(scene, 1e-12)
    result = hc.Native(rtol=rtol).run(scene)
    assert largest_difference(result.all_peaks, true) <= result.error_estimate


@pytest.mark.parametrize("kind", DRAWN)
@pytest.mark.parametrize("number", [1, 2])
def test_random_scenes(kind: str, number: int) -> None:
    assert judge(kind, number)


@pytest.mark.slow
@pytest.mark.parametrize("kind", DRAWN)
@pytest.mark.parametrize("first", range(0, SCENES, BLOCK))
def test_many_random_scenes(kind: str, first: int) -> None:
    judged = [judge(kind, number) for number in range(first, first + BLOCK)]
    assert sum(judged) >= BLOCK // 2


@pytest.mark.slow
@pytest.mark.parametrize("kind", DRAWN)
@pytest.mark.parametrize("number", range(40))
def test_random_damped_scenes(kind: str, number: int) -> None:
    judge_damped(kind, number)
