"""The numbers of a result by their names in the table of a sweep, in SI.

They are the same for a single run, for a batch of similar runs and for the formulas.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.observables.peaks import times_of_peaks
from hertzchain.observables.result import Result
from hertzchain.observables.transition import solitary_waves, transitions
from hertzchain.theory.peak_map import FAR_FIELD_ERROR, PEAK_ERROR

if TYPE_CHECKING:
    from hertzchain.engines.native import Batch
    from hertzchain.theory import Prediction

FIRST = ("first_peak_force_N", "arrival_time_s")
"""Columns of first pulses."""


def of_result(found: Result) -> Mapping[str, float | None]:
    """Return the numbers of a simulation; None or no entry where there is none."""
    scene, wave, static = found.scene, found.solitary_wave, found.static_force
    numbers: dict[str, float | None] = {
        "transition_granules": found.transition_granules,
        "solitary_wave_force_N": wave.peak_force,
        "far_field_force_N": wave.far_field_force,
        "far_field_error": wave.far_field_error,
        "speed_m_s": wave.speed,
        "speed_error": wave.speed_error,
        **_largest(found.peak_force),
        "last_peak_force_N": found.peak_at(scene.chain.granules),
        "contacts_cut_off": len(found.cut_off),
        "overlap_ratio": found.overlap_ratio,
        "error_estimate": found.error_estimate,
        "force_evaluations": found.force_evaluations,
    }
    if static is not None:
        numbers["largest_dynamic_force_N"] = float(np.max(found.peak_force - static))
    if scene.wall is not None:
        first = found.first_columns
        numbers |= {f"wall_{name}": float(first[name][-1]) for name in FIRST if first}
        is_cut_off = scene.contact_name(scene.last_contact) in found.cut_off
        if not is_cut_off and found.peak_errors[-1] < 1:
            numbers["wall_peak_force_N"] = float(found.peak_force[-1])
            numbers["wall_peak_time_s"] = float(found.peak_time[-1])
    for number, read in enumerate(found.gauges or (), start=1):
        numbers[f"gauge_{number}_first_peak_force_N"] = read.force
        numbers[f"gauge_{number}_arrival_time_s"] = read.arrival
    return numbers


def of_prediction(found: Prediction) -> Mapping[str, float | None]:
    """Return the numbers of the formulas; None or no entry where there is none."""
    return {
        "transition_granules": found.transition_granules,
        "solitary_wave_force_N": found.wave_force,
        "far_field_force_N": found.far_field_force,
        "far_field_error": None if found.far_field_force is None else FAR_FIELD_ERROR,
        "speed_m_s": None if found.speed is None else found.speed.exact,
        **_largest(found.peak_force),
        "overlap_ratio": found.overlap_ratio,
        "eq3_transition_granules": found.eq3,
        "error_estimate": PEAK_ERROR,
    }


def _largest(peak_force: FloatArray) -> dict[str, float]:
    at = int(np.argmax(peak_force))
    return {"largest_peak_force_N": float(peak_force[at]), "largest_peak_contact": at + 2}


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
