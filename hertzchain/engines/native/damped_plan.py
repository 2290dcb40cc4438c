"""Which tolerance gives peaks of damped contacts to a wanted accuracy, and how far off they may be.

Errors were measured on 380 random chains of 2 to 60 granules: like and unlike, all exponents, weak
and strong damping, with and without attraction, walls, gaps, static loads, pulses and strikers.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.native.plan import round_off
from hertzchain.observables.peaks import ESTIMATED, any_rising, largest_difference

LONGEST = 0.8
"""Longest step, natural time units of the fastest contact."""

LOOSEST, TIGHTEST = 1e-6, 1e-12
"""Tolerances: above, bounds were too small in one run of a thousand; below is round-off."""

_FIRST, _FIRST_IF_HARD = 0.003, 0.0007
"""The first tolerance over the wanted accuracy, the latter where granules collide: in 19
of 20 random chains no second is needed, which would cost far more than short steps do."""

_COARSER, _LONGER = 30.0, 1.5
"""Tolerance and longest step of the run that tells the error, over those of the run itself."""

_KNOWN, _SAFETY = 10.0, 2.0
"""Error bound over the tolerance and over the difference to the coarser run: twice of what the
error was at most."""

_KNOWN_IF_HARD, _SAFETY_IF_HARD = 60.0, 18.0
"""The same where granules collide, which multiplies errors, for pistons, whose velocity jumps, and
for runs that end while a contact is pressed hardest: the error was at most five sixths
of the sum, but twice the sum in one of 9,000 random chains with pistons."""

_TRIES = 5
"""Tolerances until one is small enough."""


class Run(Protocol):
    """What is asked of a run."""

    @property
    def peak_force(self) -> FloatArray:
        """Shape (contacts,)."""

    @property
    def peak_time(self) -> FloatArray:
        """Shape (contacts,)."""

    @property
    def end(self) -> float:
        """Time reached."""

    @property
    def evaluations(self) -> int:
        """Force evaluations."""


_Run = TypeVar("_Run", bound=Run)


@dataclass(frozen=True, eq=False)
class Bounded(Generic[_Run]):
    """A run, and an upper bound of the relative error of its peaks."""

    run: _Run
    bound: float


def first_tolerance(rtol: float, collides: bool) -> float:
    """Tolerance that a wanted accuracy of the peaks is tried with."""
    return max(min((_FIRST_IF_HARD if collides else _FIRST) * rtol, LOOSEST), TIGHTEST)


def accurate(
    integrate: Callable[[float, float, bool], _Run], rtol: float, longest: float, collides: bool
) -> Bounded[_Run]:
    """Integrate until the bound of the error of the peaks is at most ``rtol``, in a few tries.

    ``integrate`` makes a run with a tolerance and a longest step, and is told whether it may be the
    last, or only tells the error of another. The bound of what is returned may be larger:
    collisions can multiply rounding errors.
    """
    tolerance = first_tolerance(rtol, collides)
    for left in reversed(range(_TRIES)):
        coarse = integrate(_COARSER * tolerance, _LONGER * longest, False)
        run = integrate(tolerance, longest, True)
        bound = _bound(run, coarse, tolerance, collides)
        if bound <= rtol or tolerance <= TIGHTEST or not left:
            break
        tolerance = max(tolerance * max(0.5 * rtol / bound, 1e-3), TIGHTEST)
    return Bounded(run, bound)


def _bound(run: Run, coarse: Run, tolerance: float, collides: bool) -> float:
    difference = float(largest_difference(coarse.peak_force, run.peak_force, ESTIMATED))
    hard = collides or any_rising(run.peak_force, run.peak_time < run.end)
    known, safety = (_KNOWN_IF_HARD, _SAFETY_IF_HARD) if hard else (_KNOWN, _SAFETY)
    return float(known * tolerance + safety * difference + np.asarray(round_off(run.evaluations)))
