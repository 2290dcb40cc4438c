"""Samples as a mistake: the run is right, but its peaks are its highest samples."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.native import Native
from hertzchain.verdict.case import Case, Found, Mistake

# number of trial intervals, about 0.2 s; shorter ones change 1e-7 of the peaks
_MOST_TRIALS = 1_000_000
_AT_ONCE = 1000  # trial intervals that are computed at once, in the cache of the processor (chosen)
# least number of contacts; random numbers pass a million trial steps once in 1e5 cases
FEWEST_SAMPLED = 12


def samples(case: Case) -> Iterator[Mistake]:
    """Yield peaks from the highest samples at equal intervals, whose length is fitted.

    Near its peak at t a contact force falls as the square of the time from t; the nearest sample is
    at the distance t - k h. So every h lowers the contacts in its own pattern.
    """
    lower = case.differences
    if np.mean(lower) >= 0 or lower.size < FEWEST_SAMPLED:
        return
    unit = case.scene.units.time
    time = case.reference.peak_time[case.judged] / unit
    bend = _shape(case, np.array([-0.02, 0.0, 0.02]), 2)[0]
    h = mean_interval(lower, bend)
    if not 1e-4 < h < 1.0:
        return
    shape = _shape(case, h * np.linspace(-0.7, 0.7, 5), 4)
    trials = np.arange(math.log(0.6 * h), math.log(1.7 * h), 0.1 * h / float(np.max(time)))
    if trials.size > _MOST_TRIALS:
        return

    powers = np.vstack([shape, np.zeros_like(lower)])  # the forces are relative to their peaks

    def left(logs: FloatArray) -> FloatArray:
        """Return the mean square that samples leave at intervals with these logarithms."""
        found = []
        for h in np.array_split(np.exp(logs)[:, np.newaxis], logs.size // _AT_ONCE + 1):
            away = h * np.round(time / h) - time
            found.append(np.mean((np.polyval(powers, away) - lower) ** 2, axis=1))
        return np.concatenate(found)

    def search(_: Case) -> Found:
        apart = trials[1] - trials[0]
        near = trials[np.argsort(left(trials))[:20], np.newaxis] + apart * np.linspace(-1, 1, 401)
        fine = left(near.ravel())
        best = int(np.argmin(fine))
        return Found(math.exp(near.ravel()[best]) * unit, math.sqrt(fine[best]))

    yield Mistake(
        lambda step: f"samples in place of maxima, {step:.6g} s apart, of an accurate run",
        search=search,
    )


def mean_interval(lower: FloatArray, bend: FloatArray) -> float:
    """Return the interval of samples that lower peaks by ``bend`` times the square of a distance.

    Distances are as often long as short, up to half of it: their mean square is h^2 / 12.
    """
    return math.sqrt(12 * max(float(np.mean(lower / bend)), 0.0))


def _shape(case: Case, offsets: FloatArray, degree: int) -> FloatArray:
    """Return relative contact forces around their peaks as polynomials of the time from the peak.

    They have the coefficients of the powers ``degree`` to 1, natural time units: shape (degree,
    judged contacts).
    """
    scene, unit = case.scene, case.scene.units.time
    peak_time = case.reference.peak_time[case.judged]
    wanted = peak_time + unit * offsets[:, np.newaxis]
    times, where = np.unique(np.clip(wanted, 0.0, scene.end_time), return_inverse=True)
    run = Native(rtol=1e-8, time_limit=max(case.deadline.left, 1e-3)).run(scene, record=times)
    assert run.history is not None
    contact = np.flatnonzero(case.judged)
    force = run.history.contact_force[where.reshape(wanted.shape), contact]
    relative = force / case.reference.peak_force[case.judged] - 1.0
    return np.asarray(np.polyfit(offsets, relative, degree)[:-1])
