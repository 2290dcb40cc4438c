"""Errors of another code's peaks by steps and readings, and extrapolation."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.external.observation import Simulation
from hertzchain.observables.error_bound import amplifies_errors, highest_rate
from hertzchain.observables.peaks import ESTIMATED, PeakWatch, judged_contacts
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg

INTERPOLATION = 3e-4  # relative error of a peak over interval^8 [natural units]; measured 1e-4
KINK = 1.5e-3  # relative error over interval^3.5 [natural units]: an opening neighbour leaves 6e-4
DAMPED_INTERPOLATION = 0.1  # relative error over interval^5 [natural units]
DAMPED_READINGS = 0.2  # relative error over dt^2 [natural units], with readings at each step
DASHPOT = 0.4  # relative error over dt times the rate of the dampers [natural units]
# steps of a leg in the finest of three runs: with fewer, errors are no power of dt yet
_FEW_STEPS = 16


def extrapolate(coarse: Simulation, fine: Simulation, order: int) -> tuple[FloatArray, FloatArray]:
    """Extrapolate peak forces [N] and times [s] to steps of length 0, from n and 2n steps.

    Errors go as the step to the power ``order``: 2, or 1 where contacts are damped.
    """
    gain = 2**order - 1
    force = (2**order * fine.peaks.force - coarse.peaks.force) / gain
    later = fine.peaks.time - coarse.peaks.time
    # If two maxima have nearly the same height, each run may have found a different one.
    same = np.abs(later) < max(leg.dt for leg in coarse.legs)
    return force, np.where(same, fine.peaks.time + later / gain, fine.peaks.time)


def extrapolation_error(
    scene: Scene, legs: Sequence[Leg], difference: float, peaks: PeakWatch
) -> float:
    """Upper bound of the relative error of extrapolated peaks by the steps.

    ``difference`` is the difference from peaks extrapolated with steps twice as long; legs and
    peaks are those of the finer steps.

    The error is 1/15 of the difference where errors go as dt^2 and dt^4. Contacts that open leave a
    term dt^2.5 in natural units, erratic from one step to the next, so that two extrapolations can
    agree by chance: 0.0055 dt^2.5 was measured where they did, and 0.84 of the difference
    elsewhere. In hard scenes, and for contacts whose force still grows at the end, both are
    erratic: the bound is three times the difference plus 0.05 dt^2.5; six times where the finest
    run has few steps (measured 4.4).

    With damped contacts the remaining error goes as dt^2, and as dt^1.5 and less where granules fly
    towards others: measured were 2.4 of the difference, and 0.04 dt for contacts whose force still
    grows at the end. A dashpot's force jumps when a contact closes, anywhere within a step: this
    leaves an erratic error, of which 0.26 times dt times the rate of the dampers was measured.
    """
    dt = max(leg.dt for leg in legs) / scene.contact_time
    if scene.contact is not None:
        error = 4 * difference + (0.1 * dt if peaks.any_rising else 0.0)
        if scene.contact.exponent == 0 and scene.terms != ("damping",):
            error += DASHPOT * highest_rate(scene) * scene.contact_time * dt
        return error
    if amplifies_errors(scene) or peaks.any_rising:
        few = max(leg.steps for leg in legs) < _FEW_STEPS
        return (6 if few else 3) * difference + 0.05 * math.pow(dt, 2.5)
    return difference + 0.005 * math.pow(dt, 2.5)


def rival_error(peaks: PeakWatch, extrapolated: FloatArray) -> float:
    """Bound of the relative height by which another maximum may exceed the extrapolated one.

    The error by steps differs between maxima: one that is lower in every run may be the highest.
    """
    judged = judged_contacts(extrapolated, ESTIMATED)
    highest, rival = extrapolated[judged], peaks.rival[judged]
    step = np.abs(peaks.force[judged] - highest)
    within = rival + 2 * step > highest
    higher = np.where(within, (rival + 2 * step - highest) / highest, 0.0)
    return float(np.max(higher, initial=0.0))


def interpolation_error(scene: Scene, legs: Sequence[Leg], strides: Sequence[int]) -> float:
    """Upper bound of the relative error of the peaks by the interval between readings.

    In natural units it is 1e-4 h^8, plus 0.005 h^4 dt^2 and 0.4 h^2 dt^4 (measured) for the
    remaining error of the derivatives, and in hard scenes the error by opening contacts: see
    ``KINK``.
    """
    unit = scene.contact_time
    if scene.contact is not None:
        return _interpolation_error_of_damped(scene, legs, strides)
    apart = [min(n, leg.steps) * leg.dt / unit for n, leg in zip(strides, legs, strict=True)]
    dt = max(leg.dt for leg in legs) / unit
    h = max(apart)
    kinks = KINK * h**3.5 if amplifies_errors(scene) else 0.0
    return INTERPOLATION * h**8 + 0.01 * h**4 * dt**2 + h**2 * dt**4 + kinks


def _interpolation_error_of_damped(
    scene: Scene, legs: Sequence[Leg], strides: Sequence[int]
) -> float:
    """``interpolation_error`` for damped contacts, whose overlaps bend as they close and open.

    In 80 random scenes readings 0.2, 0.1 and 0.05 natural time units apart cost up to 2.6e-5, 7e-7
    and 4e-7 of the peaks, the last as much as readings at each step of 0.002: 0.1 dt^2.
    """
    unit = scene.contact_time
    h = max(min(n, leg.steps) * leg.dt for n, leg in zip(strides, legs, strict=True)) / unit
    dt = max(leg.dt for leg in legs) / unit
    return DAMPED_INTERPOLATION * h**5 + DAMPED_READINGS * dt**2
