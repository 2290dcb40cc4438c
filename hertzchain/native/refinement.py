"""How a stepper gets from one wanted time to the next: in one step, or in halved ones.

overlap^(3/2) has no second derivative at 0. A step of length h across the instant at which a
contact opens or closes at the rate r' leaves an error of about r'^(3/2) h^(5/2), whatever the
order of the method. Such steps are halved, again and again, until that is below a tolerance.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from hertzchain.arrays import Scalar
from hertzchain.native.equations import overlap
from hertzchain.native.steppers import AppliedForce, State, Stepper


class Walker(Protocol):
    """Goes from one wanted time to the next in one step or more."""

    @property
    def stepper(self) -> Stepper:
        """What takes the steps."""

    def advance(
        self, state: State, time: Scalar, h: Scalar, applied: AppliedForce
    ) -> Iterator[tuple[Scalar, State]]:
        """Go from ``time`` to ``time + h``; yields time and state after each step taken."""


@dataclass(frozen=True)
class Fixed:
    """One step, as asked."""

    stepper: Stepper

    def advance(
        self, state: State, time: Scalar, h: Scalar, applied: AppliedForce
    ) -> Iterator[tuple[Scalar, State]]:
        """Go from ``time`` to ``time + h``; yields time and state there."""
        yield time + h, self.stepper.step(state, time, h, applied)


@dataclass(frozen=True)
class Refined:
    """Steps halved where a contact opens or closes.

    Parameters
    ----------
    stepper
        Takes the steps.
    tolerance
        Largest r'^(3/2) h^(5/2) left, in natural units. At 1e-10 the peaks of the paper's scenes
        are right to about 1e-12: the constant before it is small.
    """

    stepper: Stepper
    tolerance: float

    def advance(
        self, state: State, time: Scalar, h: Scalar, applied: AppliedForce
    ) -> Iterator[tuple[Scalar, State]]:
        """Go from ``time`` to ``time + h``; yields time and state after each step taken."""
        waiting = [(time, h)]
        while waiting:
            time, h = waiting.pop()
            following = self.stepper.step(state, time, h, applied)
            if self._crosses_kink(state, following, h):
                waiting += [(time + h / 2, h / 2), (time, h / 2)]
            else:
                state = following
                yield time + h, state

    def _crosses_kink(self, before: State, after: State, h: Scalar) -> bool:
        r0, r1 = overlap(before.displacement), overlap(after.displacement)
        rate = np.maximum(np.abs(overlap(before.velocity)), np.abs(overlap(after.velocity)))
        opens_or_closes = (r0 > 0) != (r1 > 0)
        within_a_step = np.minimum(np.abs(r0), np.abs(r1)) < rate * h
        felt = rate**3 * h**5 > self.tolerance**2
        return bool(np.any((opens_or_closes | within_a_step) & felt))
