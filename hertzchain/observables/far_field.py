"""Bound of the change that a wave would still undergo beyond the end of its chain."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray

WAVE_SPEED = 0.9055157764
"""Speed of a solitary wave of height 1, in granules per natural time unit; computed by
``theory.solitary_wave``."""

UNSETTLED = 0.1  # relative error above which no far field is reported (chosen)

_NEIGHBOURS = 4  # contacts over which the growth is measured; a wave spans 5 granules
_SPAN = 10  # contacts over which the speed is measured, as in ``SolitaryWave.speed``
_FORCE_PER_SPEED = 6.0  # the speed goes as the sixth root of the force


def unsettled(
    peak_force: FloatArray,
    peak_time: FloatArray,
    last: NDArray[np.intp],
    speed_at_1_newton: FloatArray,
) -> FloatArray:
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
    near = np.minimum(_NEIGHBOURS, last // 2)
    span = np.minimum(_SPAN, last // 2)
    with np.errstate(divide="ignore", invalid="ignore"):
        growth = np.abs(height / peak_force[row, last - near] - 1) * last / near
        rate = span / (peak_time[row, last] - peak_time[row, last - span])
        mean = (height + peak_force[row, last - span]) / 2
        off = np.abs(rate / (speed_at_1_newton * mean ** (1 / 6)) - 1)
    return np.asarray(growth + _FORCE_PER_SPEED * off)
