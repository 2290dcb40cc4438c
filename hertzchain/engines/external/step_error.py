"""Errors of another code's peaks by steps and readings, and extrapolation."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.limits import RTOL
from hertzchain.observables import error_bound
from hertzchain.observables.error_bound import OF_TIMES, ContactErrors, Peaks
from hertzchain.observables.peaks import ESTIMATED, judged_contacts
from hertzchain.observables.watch import PeakWatch
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg

INTERPOLATION = 3e-4  # relative error of a peak over interval^8 [natural units]; measured 1e-4
KINK = 1.5e-3  # relative error over interval^3.5 [natural units]: an opening neighbour leaves 6e-4
DAMPED_INTERPOLATION = 0.1  # relative error over interval^5 [natural units]
DAMPED_ONSET = 0.01  # relative error over (interval times rate of the dampers)^3; measured 0.005
# relative error over dt^2 [natural units, or over the dampers' time], with readings at each step
DAMPED_READINGS = 0.2
# bound of the error by a reading before a dashpot closes, over (interval times rate)^2; measured
TOUCH = 0.1
DASHPOT = 0.6  # relative error over dt times the rate of the dampers: see ``touch_error``


def extrapolate(coarse: Peaks, fine: Peaks, order: int, longest: float) -> Peaks:
    """Extrapolate peaks and first pulses to steps of length 0, from n and 2n steps.

    Errors go as the step to the power ``order``: 2, or 1 where contacts are damped. If two maxima
    have nearly the same height, each run may have found a different one: those are more than the
    ``longest`` step of the coarse run apart, and their times are not extrapolated.
    """
    gain = 2**order - 1

    def later(before: FloatArray, other: FloatArray) -> FloatArray:
        change = other - before
        return np.where(np.abs(change) < longest, other + change / gain, other)

    def stronger(before: FloatArray, other: FloatArray) -> FloatArray:
        return np.asarray((2**order * other - before) / gain)

    first, before = fine.first, coarse.first
    if first is not None and before is not None:
        first = replace(
            first, force=stronger(before.force, first.force), time=later(before.time, first.time),
            arrival=later(before.arrival, first.arrival), width=later(before.width, first.width),
            contact_time=later(before.contact_time, first.contact_time),
        )  # fmt: skip
    force = stronger(coarse.force, fine.force)
    return Peaks(force, later(coarse.time, fine.time), fine.passed, first)


def extrapolation_safety(
    scene: Scene, legs: Sequence[Leg], peaks: PeakWatch, rising: bool
) -> tuple[error_bound.Safety, float]:
    """Return the safety of extrapolated peaks, and an error that differences may hide by chance.

    Legs and peaks are those of the finer steps; ``rising``: a force still grows at the end.

    The error is 1/15 of the difference where errors go as dt^2 and dt^4. Contacts that open leave a
    term dt^2.5 in natural units, erratic from one step to the next, so that two extrapolations can
    agree by chance: 0.0055 dt^2.5 was measured where they did. In hard scenes, and for contacts
    whose force still grows at the end, both are erratic; the more so where the finest run has few
    steps.

    With damped contacts the remaining error goes as dt^2; for contacts whose force still grows at
    the end, 0.04 dt was measured. Where granules fly towards others, it goes as dt^1.5 and less,
    and is erratic.
    """
    dt = max(leg.dt for leg in legs) / scene.contact_time
    if scene.contact is not None:
        flies = "flying" if error_bound.fly_at_others(scene) else "damped"
        by_chance = 0.1 * dt if rising else 0.0
        # Factor for extrapolated peaks: twice the error of the finer run, plus the other's
        by_chance += 4.0 * touch_error(scene, legs, peaks)
        return error_bound.SAFETIES[f"extrapolated, {flies}"], by_chance
    if error_bound.amplifies_errors(scene) or rising:
        # Steps of a leg in the finest of three runs: with fewer, errors follow no power of dt
        few = max(leg.steps for leg in legs) < 16
        kind = "extrapolated, hard" + ", few steps" * few
        return error_bound.SAFETIES[kind], 0.05 * math.pow(dt, 2.5)
    return error_bound.SAFETIES["extrapolated"], 0.005 * math.pow(dt, 2.5)


def least_gain(scene: Scene) -> float:
    """Return by how much halving the steps at least reduces the error of extrapolated peaks."""
    return 2.0 if scene.contact is not None and error_bound.fly_at_others(scene) else 4.0


def touch_error(scene: Scene, legs: Sequence[Leg], peaks: PeakWatch) -> float:
    """Bound of the relative error of the peaks by dashpots that close at a speed.

    Their force jumps when a contact closes, anywhere within a step: this leaves an erratic error of
    the motion that follows, of half the step times the rate of the dampers at most for each contact
    that closes (measured 0.54).
    """
    if not peaks.touch_share:
        return 0.0
    return (
        DASHPOT * error_bound.highest_rate(scene) * max(leg.dt for leg in legs) * peaks.touch_share
    )


def touches_at_a_speed(scene: Scene) -> bool:
    """Return whether dashpots may close at a speed, so that their force jumps."""
    contact = scene.contact
    return contact is not None and contact.exponent == 0 and error_bound.fly_at_others(scene)


def usual_accuracy(scene: Scene) -> float:
    """Return the default accuracy of ``compare``: 1e-6, or 1e-4 where dashpots close at a speed.

    Errors are of first order there: 1e-4 takes 5 s for 5 granules, 1e-6 minutes.
    """
    return 1e-4 if touches_at_a_speed(scene) else RTOL


def rival_errors(
    peaks: PeakWatch, highest: FloatArray, other: PeakWatch | None = None, factor: float = 0.0
) -> FloatArray:
    """Bounds of the relative heights by which another maximum may exceed the highest, (contacts,).

    Parameters
    ----------
    peaks
        The peaks of a run.
    highest
        The same extrapolated, or as they are [N], shape (contacts,). The error by steps differs
        between maxima: one that is lower in every run may be the highest.
    other, factor
        Peaks of a run with other steps: so many times the difference of the second maxima bounds
        the error of the second maximum. In one chain with a wall a later blow was the highest in
        the exact solution, but in neither run, because its error was ten times that of the first.
    """
    judged, rival = judged_contacts(highest, ESTIMATED), peaks.rival
    reached = 2 * np.abs(peaks.force - highest)
    if other is not None:
        in_both = (rival > 0) & (other.rival > 0)
        reached = np.maximum(reached, np.where(in_both, factor * np.abs(other.rival - rival), 0.0))
    above = (rival + reached - highest) / np.where(judged, highest, 1.0)
    return np.where(judged, np.maximum(above, 0.0), 0.0)


def with_rivals(
    errors: ContactErrors, rivals: FloatArray, seen: Peaks, joined: np.ufunc
) -> ContactErrors:
    """Return errors joined with those of ``rival_errors``, of first pulses that are the highest."""
    peak, first = joined(errors.peak, errors.alike(rivals)), seen.first
    if first is None or errors.first is None or errors.dynamic is None:
        return replace(errors, peak=peak)
    of_first = np.zeros(first.force.size)
    # Least force of a first pulse over the highest, if it is that (rounding)
    is_highest = (first.force + first.static)[: rivals.size] > (1 - 1e-9) * seen.force
    of_first[: rivals.size] = np.where(is_highest, rivals, 0.0)
    of_first /= errors.dynamic
    of_times = {name: joined(getattr(errors, name), of_first) for name in OF_TIMES}
    first_error = joined(errors.first, of_first)
    return replace(errors, peak=peak, first=first_error, **of_times)


def interpolation_error(scene: Scene, legs: Sequence[Leg], strides: Sequence[int]) -> float:
    """Upper bound of the relative error of the peaks by the interval between readings.

    In natural units it is 1e-4 h^8, plus 0.005 h^4 dt^2 and 0.4 h^2 dt^4 (measured) for the
    remaining error of the derivatives, and in hard scenes the error by opening contacts: see
    ``KINK``. Overlaps of damped contacts bend as they close and open: in 80 random scenes readings
    0.2, 0.1 and 0.05 units apart cost up to 2.6e-5, 7e-7 and 4e-7 of the peaks, the last as much as
    readings at each step of 0.002. Strong dampers let a force decay within 1 / rate of the closing:
    see ``DAMPED_ONSET``. What readings before a jump cost is known after the run: see
    ``PeakWatch.reading_error``.
    """
    unit = scene.contact_time
    apart = [min(n, leg.steps) * leg.dt / unit for n, leg in zip(strides, legs, strict=True)]
    dt, h = max(leg.dt for leg in legs) / unit, max(apart)
    if scene.contact is not None:
        rate = error_bound.highest_rate(scene) * unit
        by_steps = DAMPED_READINGS * (dt * max(1.0, rate)) ** 2
        return DAMPED_INTERPOLATION * h**5 + DAMPED_ONSET * (h * rate) ** 3 + by_steps
    kinks = KINK * h**3.5 if error_bound.amplifies_errors(scene) else 0.0
    return INTERPOLATION * h**8 + 0.01 * h**4 * dt**2 + h**2 * dt**4 + kinks


def damped_interval(scene: Scene, smooth: float, touch: float) -> float:
    """Return the longest interval between readings of damped contacts [s]; it may be below a step.

    ``smooth`` is the relative error of the peaks that it may cost while forces are smooth,
    ``touch`` that where a dashpot closes at a speed.
    """
    # Longest interval between readings of damped contacts [natural units]
    within = min(0.1, math.pow(smooth / DAMPED_INTERPOLATION, 1 / 5))
    most = math.pow(smooth / DAMPED_ONSET, 1 / 3)
    if scene.contact is not None and scene.contact.exponent == 0:
        most = min(most, math.sqrt(touch / TOUCH))
    return min(within * scene.contact_time, most / error_bound.highest_rate(scene))


def damped_interval_at(scene: Scene, dt: float) -> float:
    """Return the interval between readings [s] that costs little next to the error of steps dt."""
    by_steps = dt * max(1 / scene.contact_time, error_bound.highest_rate(scene))
    return damped_interval(scene, 0.01 * by_steps, 0.1 * by_steps)
