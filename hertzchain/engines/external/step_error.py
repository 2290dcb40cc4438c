"""The error that steps and readings leave in the peaks of another code, and extrapolation."""

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

INTERPOLATION = 3e-4  # of a peak, times interval^8 [natural units]; 1e-4 measured
KINK = 1.5e-3  # of a peak, times interval^3.5 [natural units]: an opening neighbour leaves 6e-4
DAMPED_INTERPOLATION = 0.1  # of a peak, times interval^5 [natural units]
DAMPED_READINGS = 0.2  # of a peak, times dt^2 [natural units]: what readings at each step cost
DASHPOT = 0.4  # of a peak, times dt and the rate of the dampers [natural units]
_FEW_STEPS = 16  # steps of a leg in the finest of three runs: below, errors are no power of dt yet


def extrapolate(coarse: Simulation, fine: Simulation, order: int) -> tuple[FloatArray, FloatArray]:
    """Peak forces [N] and times [s] as for steps of length 0, from runs with n and 2n steps.

    Errors go as the step to the power ``order``: 2, or 1 where contacts are damped.
    """
    gain = 2**order - 1
    force = (2**order * fine.peaks.force - coarse.peaks.force) / gain
    later = fine.peaks.time - coarse.peaks.time
    # Of two maxima of nearly the same height either run may have found another one.
    same = np.abs(later) < max(leg.dt for leg in coarse.legs)
    return force, np.where(same, fine.peaks.time + later / gain, fine.peaks.time)


def extrapolation_error(
    scene: Scene, legs: Sequence[Leg], difference: float, peaks: PeakWatch
) -> float:
    """Bound of what the steps cost extrapolated peaks, as a fraction.

    ``difference`` is that from the peaks of steps twice as long, extrapolated too; legs and peaks
    are those of the finer steps.

    The error is 1/15 of the difference where errors go as dt^2 and dt^4. Contacts that open leave
    some dt^2.5 in natural units, erratic from one step to the next, so that two extrapolations can
    agree by chance: 0.0055 dt^2.5 was seen where they did, and 0.84 of the difference. In hard
    scenes, and for contacts that are still pressed harder at the end, both are erratic: three times
    the difference and 0.05 dt^2.5; six times where the finest run has few steps (4.4 seen).

    Where contacts are damped, what is left goes as dt^2, and as dt^1.5 and less where granules fly
    at others: 2.4 of the difference was seen, and 0.04 dt for contacts that are still pressed
    harder at the end. A dashpot's force jumps as a contact begins, anywhere within a step: that
    leaves dt times the rate of the dampers, erratic, of which 0.26 was seen.
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
    """By how much another maximum of a contact may be above the extrapolated one, as a fraction.

    Steps add differently to each maximum: one that is lower in every run may be the highest.
    """
    judged = judged_contacts(extrapolated, ESTIMATED)
    highest, rival = extrapolated[judged], peaks.rival[judged]
    step = np.abs(peaks.force[judged] - highest)
    within = rival + 2 * step > highest
    higher = np.where(within, (rival + 2 * step - highest) / highest, 0.0)
    return float(np.max(higher, initial=0.0))


def interpolation_error(scene: Scene, legs: Sequence[Leg], strides: Sequence[int]) -> float:
    """Bound of what reading now and then costs the peaks, as a fraction.

    In natural units 1e-4 h^8, for what is left of the error of the derivatives 0.005 h^4 dt^2 and
    0.4 h^2 dt^4 (measured), and in hard scenes what opening contacts leave: see ``KINK``.
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
    """As ``interpolation_error`` for damped contacts, whose beginnings and ends bend overlaps.

    In 80 random scenes readings 0.2, 0.1 and 0.05 natural time units apart cost up to 2.6e-5, 7e-7
    and 4e-7 of the peaks, the last as much as readings at each step of 0.002 do: 0.1 dt^2.
    """
    unit = scene.contact_time
    h = max(min(n, leg.steps) * leg.dt for n, leg in zip(strides, legs, strict=True)) / unit
    dt = max(leg.dt for leg in legs) / unit
    return DAMPED_INTERPOLATION * h**5 + DAMPED_READINGS * dt**2
