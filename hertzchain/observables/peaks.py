"""Peaks: the true maximum of each contact force, between the samples too.

Between two samples the overlap is interpolated (quintic from overlap, rate and acceleration; of
degree seven where the jerk is known). The force at a maximum is the backend's own force at the
nearer sample times the ratio of the overlaps to the power 3/2: a wrong stiffness in a backend still
shows. A contact that is open at every sample gets no peak.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import Array, FloatArray
from hertzchain.observables import hermite
from hertzchain.observables.samples import Samples
from hertzchain.observables.work import contact_impulse

SIGNIFICANT = 1e-3  # of the largest peak; lower ones are not judged: no error estimate covers them
_COUNTS = 2e-3  # fraction of the largest overlap: below it a force is less than 1e-4 of the largest
ESTIMATED = 0.5 * SIGNIFICANT  # lowest peaks by which two runs are compared: one may be low in both


class PeakWatch:
    """Keeps the largest force of each contact and its time, and impulses at the ends, from samples.

    The impulses are those on a wall and fixed granules, which ``on_held`` counts as
    ``times_on_held`` does, and of a piston on granule 2, where there is one.
    """

    def __init__(
        self,
        contacts: int,
        dtype: type[np.floating[Any]] = np.float64,
        on_held: Any = (),
        has_piston: bool = False,
    ) -> None:
        self._has_piston = has_piston
        self._held = {k: float(on_held[k]) for k in np.flatnonzero(on_held).tolist()}
        self.wall_impulse = self.piston_impulse = self.dissipated = 0.0
        self.force = np.zeros(contacts, dtype)
        self.time = np.full(contacts, np.nan, dtype)
        self._overlap = np.zeros(contacts, dtype)  # overlap under the largest force
        self._maxima = np.zeros((2, contacts), dtype)  # the two highest maxima of the overlap
        self._until = dtype(0)

    @property
    def rival(self) -> Array:
        """Second highest maxima, (contacts,), 0 for none: with other steps they may be highest."""
        highest = self._maxima[0]
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.where(highest > 0, self._maxima[1] / highest, 0.0)
        return np.asarray(self.force * ratio * np.sqrt(ratio))

    @property
    def reading_error(self) -> float:
        """Bound of the relative error of the judged peaks that is known from the samples alone."""
        return 0.0

    @property
    def touch_share(self) -> float:
        """Largest ratio of a speed at which a force jumped to the largest one; from 0 to 1."""
        return 0.0

    @property
    def passed(self) -> NDArray[np.bool_]:
        """True for contacts whose force has fallen again after a peak, shape (contacts,)."""
        return self.time < self._until  # False for NaN

    @property
    def any_rising(self) -> bool:
        """True if a contact that counts has its largest force at the end."""
        return any_rising(self.force, self.passed)

    def update(self, samples: Samples, late: float = 0.0) -> None:  # noqa: ARG002 - see DampedWatch
        """Add the samples and the intervals between them."""
        for held, times in self._held.items():
            self.wall_impulse += times * contact_impulse(samples, held)
        if self._has_piston:
            self.piston_impulse += contact_impulse(samples, 0)
        self._until = samples.time[-1]
        largest = np.argmax(samples.contact_force, axis=0)
        columns = np.arange(self.force.size)
        self._keep(
            columns,
            samples.contact_force[largest, columns],
            samples.time[largest],
            samples.overlap[largest, columns],
        )
        derivatives = samples.overlap_derivatives
        h = np.diff(samples.time)[:, np.newaxis]
        overlap, rate, change = (np.abs(d) if k else d for k, d in enumerate(derivatives[:3]))
        # An upper bound of the overlap, with the largest change of its rate that both ends allow.
        farthest = np.maximum(overlap[:-1], overlap[1:])
        farthest = farthest + h * (rate[:-1] + rate[1:] + h * (change[:-1] + change[1:]))
        intervals, contacts = np.nonzero(farthest > self._maxima[1])
        if intervals.size:
            start = [d[intervals, contacts] for d in derivatives]
            end = [d[intervals + 1, contacts] for d in derivatives]
            self._interpolate(samples, intervals, contacts, start, end)

    def _interpolate(
        self,
        samples: Samples,
        intervals: NDArray[np.intp],
        contacts: NDArray[np.intp],
        start: list[Array],
        end: list[Array],
    ) -> None:
        """Keep the maxima within some intervals, from overlaps and derivatives at their ends."""
        h = np.diff(samples.time)[intervals]
        increments = hermite.increments(start, end, h)
        reached = start[0] + np.cumsum(increments, axis=0).max(axis=0)
        rises = increments > 0
        turns = np.count_nonzero(rises[1:] != rises[:-1], axis=0)
        higher = reached > self._maxima[1, contacts]
        # The front of a wave grows by powers of ten within an interval, which may seem a maximum.
        counts = reached > _COUNTS * np.max(self._overlap)
        for several, some in (
            (False, higher & (turns == 1) & rises[0]),
            (True, higher & (turns > 1) & counts),
        ):
            if not some.any():
                continue
            place = intervals[some], contacts[some]
            curve = hermite.coefficients([d[some] for d in start], [d[some] for d in end], h[some])
            if not several:
                self._take(samples, *place, curve, hermite.maximum(curve))
                continue
            for k, column in enumerate(curve.T):
                for s in hermite.maxima(column):
                    here = place[0][k : k + 1], place[1][k : k + 1]
                    self._take(samples, *here, column[:, np.newaxis], np.array([s]))

    def _take(
        self,
        samples: Samples,
        intervals: NDArray[np.intp],
        contacts: NDArray[np.intp],
        curve: Array,
        s: Array,
    ) -> None:
        """Keep maxima at s in [0, 1] of the curves of intervals."""
        highest = hermite.evaluate(curve, s)
        for contact, overlap in zip(contacts, highest, strict=True):
            pair = self._maxima[:, contact]
            if overlap > pair[0]:
                pair[:] = overlap, pair[0]
            elif overlap > pair[1]:
                pair[1] = overlap
        h = np.diff(samples.time)[intervals]
        overlaps = samples.overlap
        nearer = intervals + (overlaps[intervals + 1, contacts] > overlaps[intervals, contacts])
        beside, force = samples.overlap[nearer, contacts], samples.contact_force[nearer, contacts]
        # Pressed only between two samples: use the overlap that the contact had at its largest
        # force.
        beside, force = (
            np.where((force > 0) & (samples.overlap[nearer, contacts] > 0), now, then)
            for now, then in ((beside, self._overlap[contacts]), (force, self.force[contacts]))
        )
        known = (force > 0) & (beside > 0) & (highest > 0)
        ratio = highest[known] / beside[known]
        force = force[known] * ratio * np.sqrt(ratio)
        time = samples.time[intervals[known]] + (s * h)[known]
        self._keep(contacts[known], force, time, highest[known])

    def _keep(self, contacts: NDArray[np.intp], force: Array, time: Array, overlap: Array) -> None:
        """Replace earlier forces that are not larger by later ones, contact by contact."""
        order = np.argsort(force, kind="stable")  # if a contact has several, the largest is last
        contacts, force = contacts[order], force[order]
        time, overlap = time[order], overlap[order]
        larger = force > self.force[contacts]
        self.force[contacts[larger]] = force[larger]
        self.time[contacts[larger]] = time[larger]
        self._overlap[contacts[larger]] = overlap[larger]


def judged_contacts(peak_force: Array, significant: float = SIGNIFICANT) -> NDArray[np.bool_]:
    """True for contacts whose peak is at least a fraction of the largest, shape (..., contacts)."""
    largest = peak_force.max(axis=-1, keepdims=True)
    return np.asarray((peak_force >= significant * largest) & (peak_force > 0))


def any_rising(force: Array, passed: NDArray[np.bool_]) -> bool:
    """Return whether a contact that counts was pressed hardest at the end; both (contacts,)."""
    return not passed.all() and bool(np.any(judged_contacts(force, ESTIMATED) & ~passed))


def times_of_peaks(peak_force: FloatArray, peak_time: FloatArray) -> FloatArray:
    """Times of peaks, NaN where the force of a front far ahead of the wave is 0 in its unit."""
    time = peak_time.copy()
    time[peak_force <= 0] = np.nan
    return time


def largest_difference(
    peak_force: Array, expected: Array, significant: float = SIGNIFICANT
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
