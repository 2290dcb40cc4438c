"""The transition: how many granules p it takes, and the solitary wave that leaves it.

Contacts are numbered as in the paper: contact i lies between granules i - 1 and i, so the peaks of
a chain of N granules are those of contacts 2 to N.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray

STEADY = 0.01
"""The transition is over when no peak differs from the one before by this fraction or more."""

SMALLEST = 5
"""A solitary wave spans 5 granules, so p is at least that (paper, section 6)."""

FREE_END = 2
"""So many of the last contacts feel the free end: contact N is 2.4 % low, N - 1 by 1.3e-6, N - 2
not at all (4e-14, a chain of 40 against one of 60)."""


@dataclass(frozen=True)
class SolitaryWave:
    """What leaves the transition; None where the chain is too short to tell.

    Parameters
    ----------
    peak_force
        F_SW, the peak of the first contact after the transition, p + 1 [N].
    far_field_force
        The peak of the last contact that the free end does not touch [N].
    speed
        From the peak times of contacts p + 1 and p + 11, or fewer if the chain or the run ends
        [m/s]; never from contact N.
    """

    peak_force: float | None
    far_field_force: float | None
    speed: float | None


def transition_granules(
    peak_force: FloatArray,
    has_peaked: NDArray[np.bool_],
    threshold: float | FloatArray = STEADY,
) -> int | None:
    """The number of granules p in the transition, None if it does not end in this chain.

    The smallest i >= 5 from which every change abs(F_{k+1} - F_k) / F_{k+1}, k = i ... N - 2, is
    below 1 %. Contact N at the free end never counts. The paper leaves its criterion open; this
    one gives all its numerical p (Tables 2 to 4).

    Parameters
    ----------
    peak_force
        F_2 ... F_N [N], shape (N - 1,).
    has_peaked
        Whether the peak of each contact was passed before the run ended, shape (N - 1,).
    threshold
        Where changes are known only roughly: another limit than 1 %, or one for each change, shape
        (N - 3,).
    """
    before, after = peak_force[:-2], peak_force[1:-1]  # changes k = 2 ... N - 2
    with np.errstate(divide="ignore", invalid="ignore"):
        steady = np.abs(after - before) / after < threshold
    unsteady = np.nonzero(~steady)[0]
    first = int(unsteady[-1]) + 3 if unsteady.size else 2
    p = max(first, SMALLEST)
    last = peak_force.size - 1  # N - 2
    if p > last or not has_peaked[p]:  # index p is contact p + 2
        return None
    return p


def solitary_wave(
    peak_force: FloatArray,
    peak_time: FloatArray,
    has_peaked: NDArray[np.bool_],
    p: int | None,
    diameter: float,
) -> SolitaryWave:
    """The wave after the transition.

    Parameters
    ----------
    peak_force, peak_time
        Of contacts 2 ... N [N], [s], shape (N - 1,).
    has_peaked
        Whether the peak of each contact was passed before the run ended, shape (N - 1,).
    p
        Granules in the transition, None if there is no end to it.
    diameter
        2R [m], the distance between contacts.
    """
    if p is None:
        return SolitaryWave(None, None, None)
    first = p - 1  # index of contact p + 1
    # Contact N, at the free end, peaks early: with it the speed of short chains is off by 1 %.
    reached = int(np.sum(np.logical_and.accumulate(has_peaked[first:])))
    contacts = min(10, peak_force.size - 2 - first, reached - 1)
    speed = None
    if contacts >= 2:
        speed = contacts * diameter / float(peak_time[first + contacts] - peak_time[first])
    undisturbed = max(peak_force.size - 1 - FREE_END, first)
    return SolitaryWave(float(peak_force[first]), float(peak_force[undisturbed]), speed)
