"""The tolerance for a wanted accuracy of damped contacts, and bounds of their errors.

Errors were measured on 25,000 random chains of 2 to 20 granules, each with four tolerances: like
and unlike, all exponents, weak and strong damping, with and without attraction, walls, gaps, static
loads, pulses, tables, sines, pistons and strikers.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.native.plan import round_off
from hertzchain.engines.native.simulation import Simulation
from hertzchain.observables.contact_errors import ContactErrors, bounds

LONGEST = 0.8
"""Longest step, natural time units of the fastest contact."""

LOOSEST, TIGHTEST = 2e-5, 1e-12
"""Tolerances: a thousandth of the wanted accuracy is enough above; below is round-off."""

_FIRST = 0.02
"""The first tolerance over the wanted accuracy: in 19 of 20 random chains no second is needed."""

_MUCH_COARSER, _COARSER = (30.0, 1.5), (4.0, 1.2)
"""Tolerance and longest step of the two runs that give the error, over those of the run itself: one
difference may be small by chance, but seldom both."""

_KNOWN, _SAFETY, _SAFETY_MUCH = 2.5, 7.5, 1.0
"""Parts of the error bound: times the tolerance; times the difference to the coarser run, or a
tenth of that to the much coarser one if it is larger; and times the latter difference. Errors were
at most 0.64 of the sum in 100,000 runs, and once 0.84."""

_FLOOR = 2e-11
"""Error that no difference shows: one was 1.5e-11 with the tightest tolerance."""

_TRIES = 5
"""Most tolerances that are tried."""


Integrate = Callable[[float, float, bool], Simulation]


def first_tolerance(rtol: float) -> float:
    """Tolerance that is tried first for a wanted accuracy of the peaks."""
    return max(min(_FIRST * rtol, LOOSEST), TIGHTEST)


def accurate(integrate: Integrate, rtol: float) -> tuple[Simulation, ContactErrors]:
    """Return a run whose bounds of errors are at most ``rtol``, in a few tries, and these bounds.

    ``integrate`` makes a run from a tolerance, a factor for the longest step, and whether this run
    may be the result or only gives the error of another. The bound of the returned run may be
    larger: collisions can multiply rounding errors.
    """
    tolerance = first_tolerance(rtol)
    for left in reversed(range(_TRIES)):
        rough, coarse = (
            integrate(looser * tolerance, longer, False)
            for looser, longer in (_MUCH_COARSER, _COARSER)
        )
        run = integrate(tolerance, 1.0, True)
        errors = _errors(run, rough, coarse, tolerance)
        bound = errors.wanted
        if bound <= rtol or tolerance <= TIGHTEST or not left:
            break
        tolerance = max(tolerance * max(0.5 * rtol / bound, 1e-3), TIGHTEST)
    return run, errors


def _errors(
    run: Simulation, rough: Simulation, coarse: Simulation, tolerance: float
) -> ContactErrors:
    known = _KNOWN * tolerance + _FLOOR + round_off(run.evaluations)

    def bound(much: FloatArray, little: FloatArray) -> FloatArray:
        told = _SAFETY * np.maximum(0.1 * much, little) + _SAFETY_MUCH * much
        return np.asarray(known + told)

    return bounds(bound, *(run.peaks.differences(other.peaks) for other in (rough, coarse)))
