"""Checks of stated error bounds, by peaks of independent code."""

from __future__ import annotations

from collections.abc import Iterable

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.observables.peaks import largest_difference


def check_answers(
    scene: hc.Scene,
    asked: Iterable[tuple[hc.Native, float]],
    coarse: FloatArray,
    true: FloatArray,
) -> None:
    """Assert that each answer has the wanted accuracy and is within its own bound, or is refused.

    ``asked`` is how, and to which accuracy; ``coarse`` and ``true`` are peaks by other code with
    two tolerances [N].
    """
    # The other code's own error: the difference is that of the coarser run, or more.
    unsure = largest_difference(coarse, true)
    for native, rtol in asked:
        try:
            result = native.run(scene)
        except hc.HertzchainError:
            continue  # a refusal is honest
        # Where collisions multiply round-off to more than that, other code loses as many digits.
        assert result.error_estimate <= rtol or unsure > rtol, native
        error = largest_difference(result.all_peaks, true)
        assert error <= result.error_estimate + unsure, native
