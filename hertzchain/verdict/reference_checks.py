"""Checks of a run against the reference, contact by contact: peaks, first pulses, arrivals."""

from __future__ import annotations

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.errors import RunFailed
from hertzchain.limits import TIME_LIMIT, Deadline
from hertzchain.observables.peaks import judged_contacts
from hertzchain.observables.result import Result
from hertzchain.verdict.check import Check, Kind, unmeasured, within

# largest error estimate of the reference; measured 1e-11 to 6e-10, LM_ratio 1e-4 to 100
YARDSTICK = 1e-6

_ADVICE = "do not trust its error estimate; take shorter steps"
PEAKS = Kind("peaks against the reference", _ADVICE)
FIRST_PULSES = Kind("first pulses against the reference", _ADVICE)
GAUGES = Kind("gauges against the reference", _ADVICE)
ARRIVALS = Kind("arrivals against the reference [s]", _ADVICE)

REFERENCE_ERROR = Kind(
    "error of the reference",
    "the reference cannot judge this scene: a shorter end_time or chain leaves it more digits",
)
AS_WRITTEN = Kind(
    "compiled against Eq. 1 as written",
    "do not use this result; the compiled loops and hertzchain/engines/native/equations.py do not"
    " say the same: please report the scene",
)
_QUICKLY_WRITTEN, _DAMPED, _LONG_CHAIN = 250_000.0, 7.0, 1000.0
"""Force evaluations of the reference up to which Eq. 1 as written is integrated by default: some
two seconds in SciPy; the cost of one of damped contacts over that; and the number of granules that
doubles the time of an evaluation (all measured)."""

_KNOWN = 0.1
"""Sum of two errors from which on a contact is not compared: one has hardly a right digit."""

_SURELY_A_PULSE = 2e-3
"""Fraction of the largest first pulse from which on both runs must have one: twice the least."""


def reference_checks(result: Result, reference: Result) -> list[Check]:
    """Check a run against the reference, within the sum of both error estimates of each contact.

    First pulses and their arrivals are checked where both runs have them, and peaks of those
    contacts for which both have a right digit.
    """
    reason = "its own error estimate plus that of the reference"
    off = _differences(result.peak_force, reference.peak_force)
    of_peaks = result.peak_errors + reference.peak_errors
    peaks = _at_worst(PEAKS, result, off, of_peaks, reason)
    mine, true, errors, its = (
        result.first_pulses, reference.first_pulses, result.errors, reference.errors
    )  # fmt: skip
    if mine is None or true is None or errors is None or its is None:
        return [peaks]
    if errors.first is None or its.first is None or errors.arrival is None or its.arrival is None:
        return [peaks]
    both = true.is_clear & np.isfinite(true.force)
    if not both.any():
        return [peaks, *_gauge_checks(result, reference, reason)]
    off = np.where(both, np.abs(mine.force / true.force - 1.0), np.nan)
    allowed = errors.first + its.first
    # A run without a pulse has no error; a run whose pulse has no right digit has one.
    none = np.isnan(mine.force) & np.isnan(errors.first)
    lacks = both & none & (true.force > _SURELY_A_PULSE * np.max(true.force[both], initial=0.0))
    off, allowed = np.where(lacks, 1.0, off), np.where(lacks, its.first, allowed)
    late = np.where(both & (allowed < _KNOWN), np.abs(mine.arrival - true.arrival), np.nan)
    delay = errors.arrival + its.arrival
    return [
        *([] if peaks.measured is None else [peaks]),
        _at_worst(FIRST_PULSES, result, off, allowed, reason),
        _at_worst(ARRIVALS, result, late, delay, reason, np.inf),
        *_gauge_checks(result, reference, reason),
    ]


def _gauge_checks(result: Result, reference: Result, reason: str) -> list[Check]:
    """Check the force of the gauge that is nearest to its tolerance; nothing without gauges."""
    pairs = [
        (abs(here.force / true.force - 1.0), here.force_error + true.force_error, here.gauge)
        for here, true in zip(result.gauges, reference.gauges, strict=True)
        if np.isfinite(here.force_error + true.force_error)
    ]
    if not pairs:
        return []
    off, allowed, gauge = max(pairs, key=lambda pair: pair[0] / pair[1])
    words = f"{reason}; nearest to it at {gauge.key} {gauge.number}"
    return [within(GAUGES, result.backend, off, 0.0, allowed, words)]


def _differences(peak_force: FloatArray, expected: FloatArray) -> FloatArray:
    """Relative differences of judged peaks, shape (contacts,); NaN where one is not judged."""
    judged = judged_contacts(expected)
    if not judged.any():  # then any force is entirely wrong
        return np.where(peak_force > 0, 1.0, 0.0)
    relative = np.abs(peak_force / np.where(judged, expected, np.nan) - 1.0)
    return np.asarray(np.where(judged, relative, np.nan), np.float64)


def _at_worst(
    kind: Kind, result: Result, off: FloatArray, allowed: FloatArray, reason: str,
    known: float = _KNOWN,
) -> Check:  # fmt: skip
    """Return the check of the contact nearest to its tolerance, or farthest beyond it."""
    with np.errstate(invalid="ignore", divide="ignore"):
        share = np.where(allowed < known, np.where(off == 0, 0.0, off / allowed), np.nan)
    if np.isnan(share).all():
        return unmeasured(
            kind, result.backend, "no contact has a number with a right digit in both runs"
        )
    k = int(np.nanargmax(share))
    words = f"{reason}; nearest to it at {result.scene.contact_name(result.scene.contacts[k])}"
    return within(kind, result.backend, float(off[k]), 0.0, float(allowed[k]), words)


def yardstick_check(reference: Result) -> Check:
    """Check that the reference is accurate enough: with a large error anything would pass."""
    return within(
        REFERENCE_ERROR,
        reference.backend,
        reference.wanted_error,
        0.0,
        YARDSTICK,
        "what is asked of the others, 1e-6; a reference that says more of its own error judges"
        " nothing",
    )


def is_quickly_written(reference: Result) -> bool:
    """Return whether Eq. 1 as it is written takes about a second, by the reference's forces."""
    harder = 1.0 if reference.scene.contact is None else _DAMPED
    size = 1 + reference.scene.chain.granules / _LONG_CHAIN
    return reference.force_evaluations * size * harder <= _QUICKLY_WRITTEN


def as_written_check(reference: Result, time_limit: float = TIME_LIMIT) -> Check:
    """Check the compiled reference against Eq. 1 as ``equations`` writes it, by SciPy."""
    from hertzchain.engines.native.as_written import judging_peaks

    scene = reference.scene
    try:
        peaks, error = judging_peaks(scene, Deadline(time_limit))
    except RunFailed as problem:
        return unmeasured(AS_WRITTEN, reference.backend, str(problem))
    off = _differences(np.asarray(reference.peak_force / scene.units.force), peaks)
    reason = "its own error estimate plus that of SciPy"
    return _at_worst(AS_WRITTEN, reference, off, reference.peak_errors + error, reason)
