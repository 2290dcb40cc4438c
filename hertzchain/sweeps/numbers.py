"""The numbers of a batch of similar runs, in SI, by the names of their columns.

``columns`` says how they are read from a single run.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.observables.peaks import times_of_peaks
from hertzchain.observables.transition import solitary_waves, transitions

if TYPE_CHECKING:
    from hertzchain.engines.native import Batch


def of_batch(
    batch: Batch, radius: FloatArray, force: FloatArray, length: FloatArray, time: FloatArray
) -> tuple[Mapping[str, Any], FloatArray, FloatArray]:
    """Return the numbers of similar scenes, shape (scenes,), and all peaks and their times.

    ``force``, ``length`` and ``time`` are the natural units of each scene, ``radius`` is that of
    its granules. p is 0 where there is none. Peaks and times have the shape (scenes, contacts).
    """
    peak_force, passed = batch.peak_force * force[:, None], batch.peak_passed
    peak_time = times_of_peaks(peak_force, batch.peak_time * time[:, None])
    p = transitions(batch.peak_force, passed)
    slowness = time * np.power(force, 1 / 6)
    near, far, speed, far_off, speed_off = solitary_waves(
        peak_force, peak_time, passed, p, 2 * radius, slowness
    )
    at = np.argmax(peak_force, axis=1)
    largest = peak_force[np.arange(at.size), at]
    numbers = {
        "transition_granules": p,
        "solitary_wave_force_N": near,
        "far_field_force_N": far,
        "far_field_error": far_off,
        "speed_m_s": speed,
        "speed_error": speed_off,
        "largest_peak_force_N": largest,
        "largest_peak_contact": at + 2,
        "overlap_ratio": np.power(largest / force, 2 / 3) * length / radius,
        "error_estimate": batch.error_estimate,
        "force_evaluations": batch.force_evaluations,
    }
    return numbers, peak_force, peak_time
