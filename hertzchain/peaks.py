"""Peaks: the true maximum of each contact force, between the samples too.

The largest sample is only second order in the interval. Where the overlap rate changes sign
between two samples the overlap is interpolated (quintic from overlap, rate and acceleration; of
degree seven where the jerk is known) and its maximum taken. The force there is the backend's own
force at the nearer sample times the overlap ratio to the power 3/2: only the exponent of Hertz's
law is used, so a wrong stiffness in a backend still shows.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from hertzchain import hermite
from hertzchain.arrays import Array, FloatArray
from hertzchain.samples import Samples

SIGNIFICANT = 1e-3
"""Peaks below this fraction of the largest are not judged: error estimates do not cover them."""


class PeakWatch:
    """Keeps the largest force of each contact and its time as samples are shown to it.

    Parameters
    ----------
    contacts
        Number of contacts.
    dtype
        Precision to keep.
    """

    def __init__(self, contacts: int, dtype: type[np.floating[Any]] = np.float64) -> None:
        self.force = np.zeros(contacts, dtype)
        self.time = np.full(contacts, np.nan, dtype)
        self._until = dtype(0)

    @property
    def passed(self) -> NDArray[np.bool_]:
        """Whether each contact was pressed and has let up since, shape (contacts,)."""
        return self.time < self._until  # False for NaN

    def show(self, samples: Samples) -> None:
        """Take note of the samples and of the intervals between them."""
        self._until = samples.time[-1]
        largest = np.argmax(samples.contact_force, axis=0)
        columns = np.arange(self.force.size)
        self._keep(columns, samples.contact_force[largest, columns], samples.time[largest])
        overlap, rate = samples.overlap_derivatives[:2]
        turns = (rate[:-1] > 0) & (rate[1:] <= 0) & (np.maximum(overlap[:-1], overlap[1:]) > 0)
        intervals, contacts = np.nonzero(turns)
        if intervals.size:
            self._interpolate(samples, intervals, contacts)

    def _interpolate(
        self, samples: Samples, intervals: NDArray[np.intp], contacts: NDArray[np.intp]
    ) -> None:
        derivatives = samples.overlap_derivatives
        start = [values[intervals, contacts] for values in derivatives]
        end = [values[intervals + 1, contacts] for values in derivatives]
        h = samples.time[intervals + 1] - samples.time[intervals]
        curve = hermite.coefficients(start, end, h)
        s = hermite.maximum(curve)
        highest = hermite.evaluate(curve, s)
        nearer = intervals + (end[0] > start[0])
        ratio = highest / samples.overlap[nearer, contacts]
        force = samples.contact_force[nearer, contacts] * ratio * np.sqrt(ratio)
        self._keep(contacts, force, samples.time[intervals] + s * h)

    def _keep(self, contacts: NDArray[np.intp], force: Array, time: Array) -> None:
        """Let a later force replace an earlier one that is not larger, contact by contact."""
        order = np.argsort(force, kind="stable")  # of several for one contact the largest is last
        contacts, force, time = contacts[order], force[order], time[order]
        larger = force > self.force[contacts]
        self.force[contacts[larger]] = force[larger]
        self.time[contacts[larger]] = time[larger]


def largest_differences(peak_force: Array, expected: Array) -> FloatArray:
    """``largest_difference`` of many runs at once: shape (runs, contacts) to shape (runs,)."""
    largest = expected.max(axis=1, keepdims=True)
    judged = (expected >= SIGNIFICANT * largest) & (largest > 0)
    difference = np.abs(peak_force / np.where(judged, expected, 1.0) - 1.0)
    wrong = (largest == 0) & (peak_force > 0)
    return np.asarray(np.max(np.where(judged, difference, wrong), axis=1, initial=0.0))


def largest_difference(peak_force: Array, expected: Array) -> float:
    """Largest relative difference of the peaks that are at least 1e-3 of the largest expected.

    Parameters
    ----------
    peak_force, expected
        Shape (contacts,), the same for both. Where nothing is expected to be pressed: 0, or 1 if
        anything is.
    """
    if peak_force.shape != expected.shape:
        raise ValueError(f"must have equal shapes, got {peak_force.shape} and {expected.shape}")
    if not np.any(expected):
        return float(np.any(peak_force))
    judged = expected >= SIGNIFICANT * expected.max()
    return float(np.max(np.abs(peak_force[judged] / expected[judged] - 1.0)))
