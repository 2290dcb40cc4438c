"""The wave: its transition of p granules, what leaves it, and its speed between two contacts."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.errors import SceneError, require
from hertzchain.scene.scene import Scene

WAVE_SPEED = 0.9055157764
"""Speed of a solitary wave of height 1, in granules per natural time unit; computed by
``theory.solitary_wave``."""

UNSETTLED = 0.1  # relative error above which no far field is reported (chosen)


def unsettled(
    peak_force: FloatArray, peak_time: FloatArray, last: NDArray[np.intp], speed_at_1_newton:
    FloatArray,
) -> FloatArray:  # fmt: skip
    """Upper bound of the relative change of the peak force beyond a contact, shape (scenes,).

    It is the sum of two parts. One is the growth per contact, measured over the last four, times
    the number of contacts from the shock: a peak that approaches its limit as 1/k still changes by
    that much. The other is six times the relative difference between the speed there and that of a
    settled wave of this height. Each part alone is sometimes too small: under long pulses peaks
    stay near F0 over many contacts, and a wave that still changes may have the speed of a settled
    one.

    In 734 random pulses on up to 3,000 granules (LM_ratio 0.05 to 30, n 1.1 to 20), each cut to 8
    to 1,280 granules, the change was at most 0.38 of the bound wherever this is below 10 %.

    Parameters
    ----------
    peak_force, peak_time
        Peaks of contacts 2 ... N [N] and their times [s], shape (scenes, N - 1).
    last
        Index of the contact at which the wave is examined, at least 4, shape (scenes,).
    speed_at_1_newton
        Exact speed of a solitary wave whose peak force is 1 N [m/s], over the distance between
        contacts [m], shape (scenes,).
    """
    row = np.arange(last.size)
    height = peak_force[row, last]
    # Contacts over which the growth is measured; a wave spans 5 granules
    near = np.minimum(4, last // 2)
    # Contacts over which the speed is measured, as in ``SolitaryWave.speed``
    span = np.minimum(10, last // 2)
    with np.errstate(divide="ignore", invalid="ignore"):
        growth = np.abs(height / peak_force[row, last - near] - 1) * last / near
        rate = span / (peak_time[row, last] - peak_time[row, last - span])
        mean = (height + peak_force[row, last - span]) / 2
        off = np.abs(rate / (speed_at_1_newton * mean ** (1 / 6)) - 1)
    # The speed goes as the sixth root of the force
    return np.asarray(growth + 6.0 * off)


STEADY = 0.01  # relative change between neighbouring peaks below which the transition is over
SMALLEST = 5  # a solitary wave spans 5 granules, so p is at least that (paper, section 6)
_OF_TABLES = (
    "how far the wave may still be from settled is known of the three pulses only: later waves of a"
    " pulse table may catch up with it"
)
FREE_END = 2  # last contacts that the free end changes: N by 2.4 %, N - 1 by 1.3e-6; N - 2 by 4e-14


@dataclass(frozen=True)
class SolitaryWave:
    """Solitary wave after the transition; fields are None if the chain is too short for them.

    A pulse table may send several waves, of which later ones catch up with the first: it has the
    force and the speed, but no errors.

    Parameters
    ----------
    peak_force
        F_SW, the peak of the first contact after the transition, p + 1 [N].
    far_field_force
        The peak of the last contact that the free end does not touch [N]; None where it may be more
        than 10 % from that of the settled wave.
    speed
        Speed from the peak times of contacts p + 1 and p + 11 [m/s], or of fewer contacts if the
        chain or the run ends; contact N is never used.
    far_field_error
        Upper bound of the relative difference between that last peak and the peak of the settled
        wave; see ``unsettled``.
    speed_error
        Upper bound of the relative difference between the speed and that of the settled wave.
    """

    peak_force: float | None
    far_field_force: float | None
    speed: float | None
    far_field_error: float | None = None
    speed_error: float | None = None

    def without_errors(self) -> SolitaryWave:
        """The wave of a shock whose later waves are not known.

        In 598 random pulse tables the far-field force of 53 changed by more than
        ``unsettled`` says, by up to 54 %.
        """
        if self.far_field_force is None:
            return replace(self, speed_error=None)
        return replace(self, far_field_error=None, speed_error=None)

    @property
    def reason(self) -> str | None:
        """Reason why the far-field force or its error is missing; None where both are known."""
        if self.far_field_force is not None:
            return None if self.far_field_error is not None else _OF_TABLES
        if self.far_field_error is None:
            return "no transition ends in this chain or run, or the scene has terms"
        return (
            f"the wave may change by {self.far_field_error:.0%} beyond the end of this chain: take"
            " more granules"
        )


def transition_granules(
    peak_force: FloatArray, has_peaked: NDArray[np.bool_], threshold: float | FloatArray = STEADY
) -> int | None:
    """Return the number of granules p in the transition; None if it does not end in this chain.

    The smallest i >= 5 from which every change abs(F_{k+1} - F_k) / F_{k+1}, k = i ... N - 2, is
    below 1 %, or below another threshold, one for all or shape (N - 3,). Contact N at the free end
    never counts. The paper does not state its criterion; this one gives all its numerical p (Tables
    2 to 4). F_2 ... F_N [N] have the shape (N - 1,), as has whether each peak was passed before the
    run ended.
    """
    return int(transitions(peak_force[None], has_peaked[None], threshold)[0]) or None


def transitions(
    peak_force: FloatArray, has_peaked: NDArray[np.bool_], threshold: float | FloatArray = STEADY
) -> NDArray[np.intp]:
    """Return p of chains of one length, 0 if unknown; ``peak_force`` has shape (scenes, N - 1)."""
    scenes, contacts = peak_force.shape
    last = contacts - 1  # N - 2
    if last < SMALLEST:
        return np.zeros(scenes, np.intp)
    before, after = peak_force[:, :-2], peak_force[:, 1:-1]  # changes k = 2 ... N - 2
    with np.errstate(divide="ignore", invalid="ignore"):
        unsteady = ~(np.abs(after - before) / after < threshold)
    changes = unsteady.shape[1]
    last_unsteady = changes - 1 - np.argmax(unsteady[:, ::-1], axis=1)
    p = np.maximum(np.where(unsteady.any(axis=1), last_unsteady + 3, 2), SMALLEST)
    within = np.minimum(p, last)  # index p is contact p + 2
    is_over = (p <= last) & has_peaked[np.arange(scenes), within]
    return np.where(is_over, p, 0)


def solitary_wave(
    peak_force: FloatArray, peak_time: FloatArray, has_peaked: NDArray[np.bool_], p: int | None,
    diameter: float, slowness: float,
) -> SolitaryWave:  # fmt: skip
    """Return the wave after a transition of p granules, from the peaks of contacts 2 ... N.

    Forces [N], times [s] and whether each peak was passed: shape (N - 1,). The diameter 2R [m] is
    the distance between contacts; the slowness [s N^(1/6)] is their natural time unit under 1 N.
    """
    if p is None:
        return SolitaryWave(None, None, None)
    waves = solitary_waves(
        peak_force[None], peak_time[None], has_peaked[None], np.array([p]), np.array([diameter]),
        np.array([slowness]),
    )  # fmt: skip
    numbers = (float(values[0]) for values in waves)
    return SolitaryWave(*(None if math.isnan(value) else value for value in numbers))


def solitary_waves(
    peak_force: FloatArray, peak_time: FloatArray, has_peaked: NDArray[np.bool_],
    p: NDArray[np.intp], diameter: FloatArray, slowness: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:  # fmt: skip
    """Return the fields of ``SolitaryWave``, in their order, for many chains of one length.

    The fields, p (from ``transitions``), the diameter [m] and the slowness [s N^(1/6)] have the
    shape (scenes,), the peaks (scenes, N - 1). NaN stands for a missing value. See
    ``solitary_wave``.
    """
    scenes, contacts = peak_force.shape
    row, column = np.arange(scenes), np.arange(contacts)
    first = np.maximum(p - 1, 0)  # index of contact p + 1
    stops = ~has_peaked & (column >= first[:, None])
    end = np.where(stops.any(axis=1), np.argmax(stops, axis=1), contacts)
    # Contact N, at the free end, peaks early: with it the speed of short chains is off by 1 %.
    between = np.minimum(10, np.minimum(contacts - 2 - first, end - first - 1))
    later = first + np.maximum(between, 0)
    with np.errstate(divide="ignore", invalid="ignore"):
        speed = between * diameter / (peak_time[row, later] - peak_time[row, first])
    undisturbed = np.maximum(np.minimum(contacts - 1 - FREE_END, end - 1), first)
    near, far = peak_force[row, first], peak_force[row, undisturbed]
    # Before p there is no wave; any index will do.
    looked_at = np.where(p > 0, undisturbed, contacts - 1)
    off = np.where(
        p > 0, unsettled(peak_force, peak_time, looked_at, WAVE_SPEED / slowness), np.nan
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        settled = WAVE_SPEED * diameter / slowness * far ** (1 / 6)
        speed_off = np.abs(speed / settled - 1) + off / 6
    has_speed = (p > 0) & (between >= 2)
    return (
        np.where(p > 0, near, np.nan),
        np.where(off < UNSETTLED, far, np.nan),
        np.where(has_speed, speed, np.nan),
        off,
        np.where(has_speed, speed_off, np.nan),
    )


_APART, NEAR_END, _NEAR_END_IF_SLOW = 10, 2, 7
"""Contacts from the first to the last of the usual pair, and between that and the end: there the
incident and the reflected wave are one hump, the longer where contacts are damped or loaded. Speeds
in the last two are off by up to 7 %, before by 3e-4 (measured on 20 steel spheres)."""


@dataclass(frozen=True)
class Wave:
    """The wave from one contact to another; all errors are bounds, those of others relative.

    Parameters
    ----------
    first, last
        Numbers of the contacts.
    speed, speed_error
        Distance of the contacts at rest over the difference of the arrivals [m/s].
    height, height_error
        Dynamic force of the first pulse of the last contact [N].
    width, width_error
        How long that force is above its half [s]; NaN where that is not known.
    width_granules
        The width in granules: width times speed over the mean diameter at the last contact.
    """

    first: int
    last: int
    speed: float
    speed_error: float
    height: float
    height_error: float
    width: float
    width_error: float
    width_granules: float

    def to_dict(self) -> dict[str, float | None]:
        """Return the wave as a JSON object; null stands for what is not known."""
        units = {
            "first": "first_contact", "last": "last_contact", "speed": "speed_m_s",
            "height": "height_N", "width": "width_s",
        }  # fmt: skip
        return {
            units.get(name, name): value if math.isfinite(value) else None
            for name, value in vars(self).items()
        }


def places(scene: Scene) -> FloatArray:
    """Places of contacts at rest, from the centre of the first body [m], shape (contacts,).

    It is the middle of a gap; two spheres that are pressed touch in the middle of their overlap.
    """
    granules = scene.granules
    ahead = granules.place + granules.reach
    size = granules.stiffness.size
    half = (granules.gap[:size] - granules.static_overlap[:size]) / 2
    return np.asarray(ahead[:size] + half)


def is_near_end(scene: Scene, if_slow: int = _NEAR_END_IF_SLOW) -> NDArray[np.bool_]:
    """Return whether contacts are so near the end that incident and reflected wave overlap there.

    The shape is (contacts,).

    If a fixed granule stands ahead of the shock, its contact counts as the last: no wave passes it.
    ``if_slow`` contacts are near where contacts are damped or loaded.
    """
    is_slow = scene.contact is not None or scene.precompression is not None
    count = len(scene.contacts)
    fixed = scene.granules.fixed if scene.holds else np.zeros(0)
    last = np.min(fixed[fixed > scene.pushed], initial=count)
    near = np.arange(count) >= last - (if_slow if is_slow else NEAR_END)
    return np.asarray(near)


def runs_forwards(arrival: FloatArray, contacts: Sequence[int]) -> bool:
    """Whether one wave runs from the first to the last of some contacts, counted from 0.

    For contacts between these, two waves arrive before the first of them or after the last.
    """
    between = arrival[min(contacts) : max(contacts) + 1]
    begin, end = between[0], between[-1]
    return bool(begin < end and not ((between < begin) | (between > end)).any())


def wave_between(scene: Scene, table: Mapping[str, FloatArray], first: int, last: int) -> Wave:
    """Return the wave from one contact to another, from the columns of ``Result.first_columns``."""
    if not table:
        allowed = 'needs first pulses, which this run has not: ask for wanted="first"'
        raise SceneError("wave", None, allowed)
    most = scene.chain.granules
    allowed = f"must be two contacts from 2 to {most}, between granules, the later one last"
    require(2 <= first < last <= most, "contacts", (first, last), allowed)
    i, j = (scene.contacts.index(contact) for contact in (first, last))
    arrival, error = table["arrival_time_s"], table["arrival_error_s"]
    apart, time = np.diff(places(scene)[[i, j]])[0], arrival[j] - arrival[i]
    is_clear = table["clear"][[i, j]].all() and not is_near_end(scene, NEAR_END)[j]
    if not (is_clear and runs_forwards(arrival, (i, j))):
        allowed = "must have clear first pulses of one wave, before the last two ahead of an end"
        raise SceneError("contacts", (first, last), allowed)
    speed, off = apart / time, (error[i] + error[j]) / time
    # A front lasts until another wave comes, so it has no width.
    width = np.nan if table["kind"][j] == "front" else table["first_width_s"][j]
    reach = scene.granules.reach
    diameter = reach[j] + reach[min(j + 1, reach.size - 1)]
    return Wave(
        first, last, float(speed), float(off / max(1.0 - off, 1e-300)),
        float(table["first_peak_force_N"][j]), float(table["first_peak_error"][j]),
        float(width), float(table["first_width_error_s"][j] / width),
        float(width * speed / diameter),
    )  # fmt: skip


def usual_wave(scene: Scene, table: Mapping[str, FloatArray]) -> Wave | None:
    """The wave over the last contacts that no end disturbs, at most ten; None without one."""
    if not table:
        return None
    last = int(np.count_nonzero(~is_near_end(scene))) + scene.contacts[0] - 1
    first = max(last - _APART, 2)
    if first >= last:
        return None
    pair = [scene.contacts.index(contact) for contact in (first, last)]
    if not (runs_forwards(table["arrival_time_s"], pair) and table["clear"][pair].all()):
        return None
    return wave_between(scene, table, first, last)
