"""How a stepper gets from one wanted time to the next: in one step, or in halved ones.

overlap^(3/2) has no second derivative at 0. A step of length h across the instant at which a
contact opens or closes at the rate r' leaves an error of the velocity of about r'^(3/2) h^(5/2),
whatever the order of the method. Such steps are halved, again and again, until that is below a
tolerance.

The front of a wave closes contacts too, but so smoothly that short steps everywhere are cheaper
than halved ones there. At the start only, when the first granules begin to move as a power of time,
or where nothing but accuracy counts, steps are halved near every contact that hardly overlaps.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np

from hertzchain.arrays import Scalar
from hertzchain.engines.native.equations import overlap
from hertzchain.engines.native.methods import AppliedForce, State, Stepper
from hertzchain.scene.pulse import SHAPES
from hertzchain.scene.schedule import Leg


class Walker(Protocol):
    """Goes from one wanted time to the next in one step or more."""

    @property
    def stepper(self) -> Stepper:
        """What takes the steps."""

    @property
    def tolerance(self) -> float:
        """Largest r'^(3/2) h^(5/2) left, as a fraction of the largest velocity; 0: any."""

    @property
    def starting(self) -> float:
        """Natural time units from the start in which the front counts as a contact that closes."""

    def cut(self, legs: Sequence[Leg]) -> tuple[Leg, ...]:
        """The legs, with more steps where this walker takes more; a second cut changes nothing."""

    def advance(
        self, state: State, time: Scalar, h: Scalar, applied: AppliedForce
    ) -> Iterator[tuple[Scalar, State]]:
        """Go from ``time`` to ``time + h``; yields time and state after each step taken."""


@dataclass(frozen=True)
class Fixed:
    """One step, as asked."""

    stepper: Stepper
    tolerance: float = field(default=0.0, init=False)
    starting: float = field(default=0.0, init=False)

    def cut(self, legs: Sequence[Leg]) -> tuple[Leg, ...]:
        """The legs themselves: steps are taken as asked."""
        return tuple(legs)

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
        Largest r'^(3/2) h^(5/2) left, as a fraction of the largest velocity. At 1e-10 the peaks of
        the paper's scenes are right to about 1e-12: the constant before it is small.
    cosine_steps
        Fewest steps on a cosine ramp, however short it is: its impulse, all that a short pulse
        leaves, is a quadrature by the steps. Thirty-two are right to 1e-14; one, halved somewhere,
        is not (4e-11).
    starting
        Natural time units from the start in which the front counts as a contact that closes.
    """

    stepper: Stepper
    tolerance: float
    cosine_steps: int = 32
    starting: float = math.inf

    def cut(self, legs: Sequence[Leg]) -> tuple[Leg, ...]:
        """Legs whose steps are cut into equal parts until there are enough on each cosine ramp."""
        fewest = self.cosine_steps
        return tuple(
            replace(leg, steps=leg.steps * math.ceil(fewest / leg.steps))
            if leg.steps < fewest and leg.ramp is not None and SHAPES[leg.ramp.shape].is_curved
            else leg
            for leg in legs
        )

    def advance(
        self, state: State, time: Scalar, h: Scalar, applied: AppliedForce
    ) -> Iterator[tuple[Scalar, State]]:
        """Go from ``time`` to ``time + h``; yields time and state after each step taken."""
        waiting = [(time, h)]
        while waiting:
            time, h = waiting.pop()
            following = self.stepper.step(state, time, h, applied)
            if self._crosses_kink(state, following, time, h):
                waiting += [(time + h / 2, h / 2), (time, h / 2)]
            else:
                state = following
                yield time + h, state

    def _crosses_kink(self, before: State, after: State, time: Scalar, h: Scalar) -> bool:
        r0, r1 = overlap(before.displacement), overlap(after.displacement)
        rate0, rate1 = overlap(before.velocity), overlap(after.velocity)
        rate = np.maximum(np.abs(rate0), np.abs(rate1))
        opens_or_closes = (r0 > 0) != (r1 > 0)
        within_a_step = np.minimum(np.abs(r0), np.abs(r1)) < rate * h
        turns_round = ((rate0 > 0) != (rate1 > 0)) | bool(time < self.starting)
        felt = rate**3 * h**5 > (self.tolerance * np.max(np.abs(after.velocity))) ** 2
        return bool(np.any((opens_or_closes | (within_a_step & turns_round)) & felt))
