"""Checks of stated error bounds, by an independent solver."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from dataclasses import replace

import numpy as np

import hertzchain as hc
from hertzchain.engines.native.plan import METHODS
from hertzchain.observables.peaks import judged_contacts, largest_difference
from tests.oracles import extrapolation
from tests.oracles.extrapolation import Truth


def lasting(scene: hc.Scene) -> hc.Scene:
    """The scene up to ``Scene.end_time``: by default an engine may end before."""
    return replace(scene, run=hc.Run(scene.end_time))


def at_three_accuracies() -> list[tuple[hc.Native, float]]:
    return [(hc.Native(rtol=rtol), rtol) for rtol in (1e-3, 1e-6, 1e-9)]


def by_methods(scene: hc.Scene, methods: Iterable[str] = METHODS) -> list[tuple[hc.Native, float]]:
    """Each method, to any accuracy; RK4, which NumPy computes, in an eighth of its usual steps."""
    steps = {"rk4": 0.1 * scene.contact_time}
    return [(hc.Native(method, steps.get(method)), 1.0) for method in methods]


def check_answers(scene: hc.Scene, asked: Iterable[tuple[hc.Native, float]]) -> list[hc.Result]:
    """Assert that each answer has the wanted accuracy and is within its own bound, or is refused.

    ``asked`` is how, and to which accuracy; the answers are returned. Raises ArithmeticError where
    granules collide over and over, so that no solver knows the answer.
    """
    scene = lasting(scene)
    truth, results = extrapolation.solve(scene), []
    for native, rtol in asked:
        try:
            result = replace(native, wanted="all").run(scene)
        except hc.HertzchainError:
            continue  # a refusal is honest
        # Where collisions multiply round-off to more than that, other code loses as many digits.
        assert result.error_estimate <= rtol or truth.error > rtol, native
        error = largest_difference(result.peak_force, truth.force)
        assert error <= result.error_estimate + truth.error, native
        results.append(result)
        with suppress(hc.HertzchainError):  # a refusal is honest
            check_contacts(replace(native, wanted="first").run(scene), truth)
    return results


def check_short(scene: hc.Scene) -> None:
    """``check_answers`` at three accuracies, of a scene of seconds; longer ones are left out."""
    if scene.end_time < 600.0 * scene.contact_time:
        check_answers(scene, at_three_accuracies())


def check_contacts(result: hc.Result, truth: Truth) -> None:
    """Assert that each contact's peak is within its own bound."""
    judged = judged_contacts(truth.force)
    off = np.abs(result.peak_force / np.where(judged, truth.force, 1.0) - 1.0)
    over = judged & (off > result.errors.peak + truth.error)
    assert not over.any(), over
