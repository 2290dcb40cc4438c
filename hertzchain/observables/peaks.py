"""Peaks: which are judged, how far they differ, and when they were."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray

SIGNIFICANT = 1e-3  # of the largest peak; lower ones are not judged: no error estimate covers them
ESTIMATED = 0.5 * SIGNIFICANT  # lowest peaks by which two runs are compared: one may be low in both


def judged_contacts(peak_force: FloatArray, significant: float = SIGNIFICANT) -> NDArray[np.bool_]:
    """True for contacts whose peak is at least a fraction of the largest, shape (..., contacts)."""
    largest = peak_force.max(axis=-1, keepdims=True, initial=0.0)
    return np.asarray((peak_force >= significant * largest) & (peak_force > 0))


def times_of_peaks(peak_force: FloatArray, peak_time: FloatArray) -> FloatArray:
    """Times of peaks; NaN where a force far ahead of the wave underflows to 0."""
    time = peak_time.copy()
    time[peak_force <= 0] = np.nan
    return time


def largest_difference(
    peak_force: FloatArray, expected: FloatArray, significant: float = SIGNIFICANT
) -> float:
    """Largest relative difference of the peaks that are judged: see ``judged_contacts``.

    Both arrays have the shape (contacts,). Where no force is expected the result is 0, or 1 if
    there is any.
    """
    if peak_force.shape != expected.shape:
        raise ValueError(f"must have equal shapes, got {peak_force.shape} and {expected.shape}")
    largest = expected.max()
    if largest == 0:
        return float(peak_force.any())
    # As judged_contacts, but quicker: every short run asks for this.
    judged = expected >= significant * largest
    ratio = peak_force[judged] / expected[judged]
    return float(abs(ratio - 1.0).max())
