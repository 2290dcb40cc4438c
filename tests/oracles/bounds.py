"""Checks of stated error bounds, by an independent solver."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

import hertzchain as hc
from hertzchain.observables.peaks import largest_difference
from tests.oracles import extrapolation


def check_answers(scene: hc.Scene, asked: Iterable[tuple[hc.Native, float]]) -> list[hc.Result]:
    """Assert that each answer has the wanted accuracy and is within its own bound, or is refused.

    ``asked`` is how, and to which accuracy; the answers are returned. Raises ArithmeticError where
    granules collide over and over, so that no solver knows the answer.
    """
    truth, found = extrapolation.solve(scene), []
    for native, rtol in asked:
        try:
            result = replace(native, wanted="all").run(scene)
        except hc.HertzchainError:
            continue  # a refusal is honest
        # Where collisions multiply round-off to more than that, other code loses as many digits.
        assert result.error_estimate <= rtol or truth.error > rtol, native
        error = largest_difference(result.all_peaks, truth.force)
        assert error <= result.error_estimate + truth.error, native
        assert result.errors is not None
        off = np.abs(result.all_peaks - truth.force) / truth.force
        over = off > result.errors.peak + truth.error  # False where a peak is not judged
        assert not over.any(), (native, over)
        found.append(result)
    return found
