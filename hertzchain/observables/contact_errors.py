"""Errors of each contact: how far its peak and its first pulse may be off, from runs that differ.

A difference of one contact may be small by chance. An error at one contact acts on all later events
in the chain, so each contact takes the largest difference of all contacts whose peak or pulse came
no later.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.observables.first_pulse import FirstPulses
from hertzchain.observables.peaks import ESTIMATED, judged_contacts, largest_difference

_ERRATIC_DIFFERENCE, _HIGHER_RATIO = 1e-3, 1.5
"""Relative difference of later peaks from which on a later wave may be a contact's peak; and its
most force over that of later peaks (chosen). In two of 1,410 random scenes a contact had another
peak, up to 5 % higher, than in both runs, which differed by 0.04 and 0.4."""

_DIGIT = 0.1
"""Error of a force that has one right digit."""

OF_TIMES = ("arrival", "width", "contact_time")
"""Names of times of first pulses, and of their errors."""

COLUMNS = (
    "first_peak_force_N", "first_peak_time_s", "arrival_time_s", "first_width_s",
    "first_peak_error", "arrival_error_s", "first_width_error_s",
)  # fmt: skip
"""Numbers of a first pulse: those of a gauge, too."""


@dataclass(frozen=True, eq=False)
class ContactErrors:
    """Errors, or differences of two runs, of each contact, shape (contacts,).

    Parameters
    ----------
    peak
        Relative, of peak forces; NaN where a peak is too low to be judged. Without first pulses it
        is one number for all contacts.
    first
        Relative, of the forces of first pulses; NaN where there is none, infinite where another run
        has another pulse. None where first pulses were not wanted.
    arrival, width, contact_time
        Of their arrivals, widths and contact times, in the unit of the times.
    dynamic
        Dynamic over total force of first pulses: a relative error of the total force is divided by
        this.
    """

    peak: FloatArray
    first: FloatArray | None = None
    arrival: FloatArray | None = None
    width: FloatArray | None = None
    contact_time: FloatArray | None = None
    dynamic: FloatArray | None = None

    def in_units(self, time: float) -> ContactErrors:
        """Return the same errors with those of times multiplied by a unit of time."""
        if self.first is None:
            return self
        return replace(self, **{name: getattr(self, name) * time for name in OF_TIMES})

    def of_contacts(self, contacts: int) -> ContactErrors:
        """Return the errors of contacts alone, without those of gauges in granules."""
        if self.first is None:
            return self
        names = ("first", *OF_TIMES, "dynamic")
        return replace(self, **{name: getattr(self, name)[:contacts] for name in names})

    def plus(self, other: ContactErrors) -> ContactErrors:
        """Return differences from a run that has errors itself, ``other``, with those."""
        names = ("peak",) if self.first is None else ("peak", "first", *OF_TIMES)
        pairs = {name: (getattr(self, name), getattr(other, name)) for name in names}
        return replace(self, **{name: a + (1 + a) * b for name, (a, b) in pairs.items()})

    def alike(self, values: FloatArray) -> FloatArray:
        """Values of each contact; the largest of them where the errors of peaks are one number."""
        return values if self.peak.ndim else np.asarray(np.max(values, initial=0.0))

    def known(self, first: FirstPulses | None) -> FirstPulses | None:
        """Return first pulses without those that have no right digit: NaN for them."""
        if first is None or self.first is None:
            return None
        return first.only(self.first < _DIGIT)

    @property
    def largest(self) -> float:
        """The largest error of a peak."""
        return _largest(self.peak)

    @property
    def wanted(self) -> float:
        """The largest error of the wanted forces: first pulses, or peaks where there are none."""
        if self.first is None or not np.isfinite(self.first).any():
            return self.largest
        return _largest(self.first[np.isfinite(self.first)])

    @property
    def share(self) -> float:
        """The smallest ratio of a first pulse to its total force; 1 without first pulses."""
        if self.dynamic is None:
            return 1.0
        return float(np.min(self.dynamic[~np.isnan(self.dynamic)], initial=1.0))

    @property
    def least(self) -> float:
        """The error that decides whether a run is of any use.

        With first pulses it is the smallest error of all first pulses and peaks, as each contact
        has its own error. Without first pulses it is the largest error of all peaks.
        """
        if self.first is None:
            return self.largest
        errors = np.append(self.peak, self.first)
        return float(np.min(errors[~np.isnan(errors)], initial=np.inf))


@dataclass(frozen=True, eq=False)
class Peaks:
    """Observations of the contacts in one run, (contacts,) each.

    Parameters
    ----------
    force, time
        Peak force and its time.
    passed
        Whether the force has fallen since.
    first
        First pulses, where they were wanted.
    """

    force: Any
    time: Any
    passed: NDArray[np.bool_]
    first: FirstPulses | None = None

    @property
    def any_rising(self) -> bool:
        """True if a judged contact had its largest force at the end of the run."""
        rising = ~self.passed
        return bool(rising.any() and np.any(judged_contacts(self.force, ESTIMATED) & rising))

    @property
    def wanted(self) -> FloatArray:
        """Wanted forces: of first pulses (0 for a contact without one), or else peak forces."""
        if self.first is None or not np.isfinite(self.first.force).any():
            return np.asarray(self.force)
        return np.nan_to_num(self.first.force)

    def differences(self, other: Peaks) -> ContactErrors:
        """Differences from another run, each at least those of peaks and pulses that came before.

        Peaks after a contact's first pulse come of waves that met more than once: they differ
        erratically, and each takes the largest difference of all contacts. Where they differ much,
        such a wave may as well be higher than the first pulse of any contact that is not far above.
        """
        pulses, others = self.first, other.first
        if pulses is None or others is None:
            return ContactErrors(np.asarray(largest_difference(other.force, self.force, ESTIMATED)))
        judged = judged_contacts(self.force, ESTIMATED)
        if not judged.any():  # no force in the whole run: then any is all wrong
            never = np.full(pulses.force.size, np.nan)
            wrong = np.where(other.force > 0, 1.0, 0.0)
            return ContactErrors(wrong, never, never, never, never, never)
        peak = _relative(other.force, self.force, judged)
        ended = np.where(pulses.is_ended, pulses.arrival + pulses.width, np.inf)[: peak.size]
        later = judged & (self.time > ended)
        if np.any(peak[later] > _ERRATIC_DIFFERENCE):
            later |= judged & (self.force < _HIGHER_RATIO * np.max(self.force[later]))
        peak = np.where(later, np.max(peak[judged]), peak)
        has = ~np.isnan(pulses.force)
        first = _relative(others.force, pulses.force, has)
        same = (pulses.is_ended == others.is_ended) & (pulses.is_front == others.is_front)
        first[has & ~(same & np.isfinite(others.force))] = np.inf
        arrival, width, contact_time = (
            np.where(np.isinf(first), np.inf, np.where(has, np.abs(difference), np.nan))
            for difference in (getattr(others, name) - getattr(pulses, name) for name in OF_TIMES)
        )
        # Both ends of a pulse may move alike.
        width, contact_time = np.maximum(width, arrival), np.maximum(contact_time, arrival)
        width[has & ~pulses.is_steady] = np.inf
        dynamic = pulses.force / (pulses.force + pulses.static)
        events = np.append(peak, first * dynamic), np.append(self.time, pulses.time)
        peak = causal(*events)[: peak.size]
        first, arrival, width, contact_time = (
            causal(each, pulses.time) for each in (first, arrival, width, contact_time)
        )
        return ContactErrors(peak, first, arrival, width, contact_time, dynamic)


def columns(first: FirstPulses | None, errors: ContactErrors | None) -> dict[str, NDArray[Any]]:
    """Return columns of first pulses and of errors, (contacts,) each; none without first pulses.

    They are first_peak_force_N (dynamic: without the static force), first_peak_time_s,
    arrival_time_s, first_width_s, contact_time_s, kind (pulse, front, unended, or None), clear,
    peak_error, first_peak_error, arrival_error_s, first_width_error_s and contact_time_error_s. NaN
    stands where a contact has no first pulse, where its end did not come or has no right digit, or
    where a peak is too low to be judged. See ``first_pulse``.
    """
    if first is None or errors is None:
        return {}
    of_pulses = errors.first, errors.arrival, errors.width, errors.contact_time
    has = np.isfinite(first.force)
    of_force, of_arrival, of_width, of_contact = (
        np.where(has, np.nan if each is None else each, np.nan) for each in of_pulses
    )
    of_width = np.where(np.isfinite(of_width), of_width, np.nan)
    of_contact = np.where(np.isfinite(of_contact), of_contact, np.nan)
    return {
        "first_peak_force_N": first.force,
        "first_peak_time_s": first.time,
        "arrival_time_s": first.arrival,
        "first_width_s": np.where(np.isnan(of_width), np.nan, first.width),
        "contact_time_s": np.where(np.isnan(of_contact), np.nan, first.contact_time),
        "kind": first.kind,
        "clear": first.is_clear,
        "peak_error": errors.peak,
        "first_peak_error": of_force,
        "arrival_error_s": of_arrival,
        "first_width_error_s": of_width,
        "contact_time_error_s": of_contact,
    }


def _relative(values: FloatArray, expected: FloatArray, some: NDArray[np.bool_]) -> FloatArray:
    """Relative differences of some values; NaN for all others."""
    return np.asarray(np.abs(values / np.where(some, expected, np.nan) - 1.0), np.float64)


def causal(difference: FloatArray, time: FloatArray) -> FloatArray:
    """The largest finite difference so far along the last axis, by time; others as they are."""
    order = np.argsort(time, kind="stable")
    ordered = difference[..., order]
    is_finite = np.isfinite(ordered)
    so_far = np.maximum.accumulate(np.where(is_finite, ordered, 0.0), axis=-1)
    largest = np.empty_like(difference)
    largest[..., order] = np.where(is_finite, so_far, ordered)
    return largest


def _largest(errors: FloatArray) -> float:
    if not errors.ndim:
        return float(errors)
    return float(np.max(errors[~np.isnan(errors)], initial=0.0))
