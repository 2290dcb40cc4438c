"""Causes of wrong numbers of a measured pulse: a drifting baseline, a cut-off top."""

from __future__ import annotations

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.pulses.noise import LEAST, Noise

_SURE = 5.0  # standard deviations, as for the start of a pulse; chosen
_RETURN = 0.01  # of F0: the slope of a pulse that ends with its recording is off by less, measured
_TAIL = 50  # samples of a recording over those in its tail; chosen
_FLAT = 5  # samples of the largest force from which on a top may be cut off; chosen
_PILED = 8  # times as many as are within a digit below it; chosen, above what a crest has


def no_return(
    force: FloatArray,
    level: float,
    height: float,
    step: float,
    noise: Noise,
    given: float | None,
    samples: int,
) -> str | None:
    """A sentence where a recording ends elsewhere than at its baseline [N], else None.

    The end is that of a straight line through the last samples: a pulse may end with its recording.
    The baseline is given, or the mean of samples before the pulse, or 0 where they are none.
    """
    tail = max(LEAST, force.size // _TAIL)
    if force.size < 2 * tail:
        return None
    at = np.arange(tail) - (tail - 1)
    slope, end = np.polyfit(at, force[-tail:], 1)
    del slope
    deviation = 2 * max(noise.deviation / np.sqrt(tail), noise.density / np.sqrt(tail * step))
    off = float(end) - level
    if abs(off) <= max(_SURE * deviation, _RETURN * height):
        return None
    if given is None and not samples:
        return (
            f"no baseline is taken off, as the recording begins with its pulse, and it ends"
            f" {off:+.2g} N from 0: say with --baseline what the column has without a force or, if"
            " the recording stops before the pulse does, with --end where the pulse ends"
        )
    begins = "begins at its baseline and ends" if given is None else "has a baseline given and ends"
    return (
        f"the recording {begins} {off:+.2g} N from it: either the baseline"
        " drifts, or the recording stops before the pulse does; say with --end where the pulse ends"
    )


def cut_off(force: FloatArray, resolution: float) -> str | None:
    """Return a sentence if the top of a pulse [N] may be cut off, else None.

    Several samples have the largest force, many more than are within a digit below it: a crest
    that is a parabola has at most 2.4 times as many, one of fourth order 5.3 times. Where values
    repeat, but too few for a known digit, it is the step from the largest force to the next.
    """
    top = float(force.max())
    lower = force[force < top]
    if resolution == 0 and 0 < np.unique(lower).size < lower.size:
        resolution = top - float(lower.max())
    equal = int(np.count_nonzero(force == top))
    below = int(np.count_nonzero((force < top) & (force > top - 1.5 * resolution)))
    if equal < _FLAT or equal <= _PILED * below:
        return None
    return (
        f"{equal} samples have the largest force, {top:.4g} N: if the range of the instrument cut"
        " the top off, F0 and impulse are too small"
    )
