"""Peaks of contacts from net forces of granules at samples of a run, and their errors.

A polynomial goes through the samples around the highest one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.errors import SceneError
from hertzchain.observables.peaks import judged_contacts
from hertzchain.scene.scene import Scene

_LOOKED_AT = 2000  # numbers of a file whose digits are counted (chosen)
_FEWEST = 7  # samples: a curve of sixth degree goes through so many
_SIXTH = 4.0
"""Factor on the difference of curves of sixth and fourth degree: the error of the former is at most
3.2 times this difference for samples up to 0.8 natural time units apart, 0.1 times at 0.2
(measured, see there). In random scenes with samples 0.02 to 1 unit apart, 45 of 9,932 peaks were
off by more than this bound, nearly all with more than 0.6 between samples."""
_COARSE, _TELLS_LITTLE = 0.02, 10.0
"""Difference of curves of fourth and second degree from which on samples are too far apart for
this; and the largest error then, in such differences (measured, up to 1.2 units apart)."""
_AGAIN = 0.05
"""Largest difference of two samples of the same time, over the largest force: dampers act
with velocities half a step apart in them. On granule 1 a force may begin between them."""
_MOST_CRESTS = 8  # humps that are examined for each contact (chosen)
_DIGITS = 2.0  # last digits that rounded forces cost a peak at most: sums of a few (chosen)


@dataclass(frozen=True, eq=False)
class Motion:
    """Net forces on the granules of a run, from the pushed end on."""

    time: FloatArray  # increasing, shape (samples,): [s], or steps
    is_clock: bool  # whether times are seconds
    net_force: FloatArray  # along the chain [N], shape (samples, granules)
    grain: float = 0.0  # the last digit of forces [N]


def last_digit(values: FloatArray) -> float:
    """Return the unit of the last digit that the largest of some numbers have; 0 for 15 digits.

    The numbers have equally many significant digits, or decimals.
    """
    some = np.abs(values[values != 0])
    if not some.size:
        return 0.0
    words = [f"{value:.14e}" for value in some[:: max(1, some.size // _LOOKED_AT)]]
    digits = max(len(word.partition("e")[0].rstrip("0").replace(".", "")) for word in words)
    exponent = math.floor(math.log10(float(np.max(some))))
    return 0.0 if digits >= 15 else float(10.0 ** (exponent - digits + 1))


@dataclass(frozen=True, eq=False)
class Sampled:
    """Given peaks, with errors by sampling.

    ``error`` is the relative error of each by the interval of the samples and the digits of forces;
    0 for peaks that are given as such.
    """

    peak_force: FloatArray  # of all contacts [N], shape (contacts,), NaN where there is none
    error: FloatArray  # shape (contacts,)
    how: str = ""  # how they were found; empty for peaks that are given as such


def peaks_of(scene: Scene, motion: Motion, file: object) -> Sampled:
    """Return the peaks of a run; a SceneError says why there are none."""
    if scene.near_wall is not None:
        allowed = "has no force of a near wall: give peaks with the numbers of contacts instead"
        raise SceneError("", None, allowed, file=str(file))
    # A code writes a sample twice, at the end of a run and at the start of the next.
    once = np.append(True, np.diff(motion.time) != 0)
    time = motion.time[once]
    again = np.abs(np.diff(motion.net_force[:, 1:], axis=0))[~once[1:]]
    if np.max(again, initial=0.0) > _AGAIN * np.max(np.abs(motion.net_force)):
        allowed = "has two different samples of one time: give the samples of one run"
        raise SceneError("", None, allowed, file=str(file))
    if time.size < _FEWEST:
        allowed = (
            f"has {time.size} samples of the run, must have at least {_FEWEST}: name all files of a"
            " dump that has one for each frame"
        )
        raise SceneError("", None, allowed, file=str(file))
    if not np.all(np.diff(time) > 0):
        allowed = "has times that do not increase: give the samples of one run"
        raise SceneError("", None, allowed, file=str(file))
    forces = _contact_forces(scene, time, motion, motion.net_force[once], file)
    peaks, error = _through_samples(time, forces)
    error = error + _DIGITS * motion.grain / np.where(peaks > 0, peaks, np.inf)
    largest = float(np.max(error[judged_contacts(peaks)], initial=0.0))
    apart = f"{np.median(np.diff(time)):.3g} {'s' if motion.is_clock else 'steps'}"
    how = (
        f"peaks are from net forces in a dump, {time.size} samples {apart} apart; they may be off"
        f" by up to {largest:.1e} for that"
    )
    # The force on a wall is in no dump of granules.
    unknown = np.full(len(scene.contacts) - peaks.size, np.nan)
    return Sampled(np.append(peaks, unknown), np.append(error, np.zeros_like(unknown)), how)


def _contact_forces(
    scene: Scene, time: FloatArray, motion: Motion, net_force: FloatArray, file: object
) -> FloatArray:
    """Return the force in each contact between granules [N], (samples, contacts)."""
    own = net_force - scene.granules.constant_force
    if scene.wall is None:
        return np.ascontiguousarray(np.cumsum(own[:, :0:-1], axis=1)[:, ::-1])
    if scene.piston is not None:
        allowed = "has net forces, which do not tell contact forces between a piston and a wall"
        raise SceneError("", None, allowed, file=str(file))
    applied = np.zeros(time.size)
    if scene.ramps:
        if not motion.is_clock:
            raise SceneError("", None, "has steps and no times: give --dt", file=str(file))
        applied = scene.applied_force(time)
    return applied[:, np.newaxis] - np.cumsum(own[:, :-1], axis=1)


def _through_samples(time: FloatArray, force: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return peaks and their errors, by a curve of sixth degree around the highest sample.

    It goes through seven forces to the power 2/3, as overlaps are smooth where contacts open. Its
    error follows from its difference from curves through five and three of them. Samples of other
    humps are examined, too, if their maximum may be as high.
    """
    smooth = np.cbrt(np.maximum(force, 0.0)) ** 2
    contacts = force.shape[1]
    peaks, error = np.zeros(contacts), np.zeros(contacts)
    for contact in range(contacts):
        values = smooth[:, contact]
        if not np.any(values > 0):
            continue
        found = [_maximum(time, values, at) for at in _crests(values)]
        highest = max(value for value, _ in found)
        off = max(value + error for value, error in found) - highest
        peaks[contact], error[contact] = highest**1.5, 1.5 * off / highest
    return peaks, _robust(peaks, error)


def _crests(values: FloatArray) -> NDArray[np.intp]:
    """Return samples near which the maximum may be: the highest, and those of other humps."""
    from scipy.signal import find_peaks

    humps = find_peaks(values)[0]
    return np.union1d(humps[np.argsort(values[humps])[-_MOST_CRESTS:]], np.argmax(values))


def _maximum(time: FloatArray, values: FloatArray, at: int) -> tuple[float, float]:
    """Return the maximum of a curve near a sample, and its error."""
    sixth, fourth, second = (_highest(time, values, at, beside) for beside in (3, 2, 1))
    off = _SIXTH * abs(sixth - fourth)
    if abs(fourth - second) > _COARSE * fourth:
        off = max(off, _TELLS_LITTLE * abs(fourth - second))
    if at in (0, time.size - 1):  # cut off: how much higher the force went is not known
        off = max(off, abs(values[at] - values[min(max(at, 1), time.size - 2)]))
    return sixth, off


def _highest(time: FloatArray, values: FloatArray, at: int, beside: int) -> float:
    """The maximum of a polynomial through samples around one, near it, and at least its value."""
    first = min(max(at - beside, 0), time.size - 2 * beside - 1)
    here = slice(first, first + 2 * beside + 1)
    scale = float(time[here.stop - 1] - time[here.start]) / (2 * beside)
    s = (time[here] - time[at]) / scale
    curve = np.polynomial.polynomial.Polynomial.fit(s, values[here], 2 * beside, domain=[-1, 1])
    near = np.clip(curve.deriv().roots().real, max(s[0], -1.0), min(s[-1], 1.0))
    return float(max([values[at], *curve(near)]))


def _robust(peaks: FloatArray, error: FloatArray) -> FloatArray:
    """Return errors of at least the median of the judged contacts: one may be small by chance."""
    counts = judged_contacts(peaks)
    usual = float(np.median(error[counts])) if counts.any() else 0.0
    return np.maximum(error, usual)
