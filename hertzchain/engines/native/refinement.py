"""Walkers from one wanted time to the next: in one step, or in halved steps.

overlap^(3/2) has no second derivative at 0. A step of length h across the instant at which a
contact opens or closes at the rate r' leaves an error of the velocity of about r'^(3/2) h^(5/2),
whatever the order of the method. Such steps are halved repeatedly, until this error is below a
tolerance.

The front of a wave closes contacts too, but so smoothly that short steps everywhere are cheaper
than halved steps there. Steps near every contact that hardly overlaps are halved only at the start,
when the first granules begin to move as a power of time, or where only accuracy counts.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from hertzchain.engines.native.methods import Stepper
from hertzchain.scene.ramp import SHAPES
from hertzchain.scene.schedule import Leg


@dataclass(frozen=True)
class Fixed:
    """Steps as given, never halved."""

    stepper: Stepper
    tolerance: float = field(default=0.0, init=False)
    starting: float = field(default=0.0, init=False)

    def cut(self, legs: Sequence[Leg]) -> tuple[Leg, ...]:
        """Return the same legs, because steps are taken as given."""
        return tuple(legs)


@dataclass(frozen=True)
class Refined:
    """Steps halved where a contact opens or closes, until r'^(3/2) h^(5/2) is below the tolerance.

    The tolerance is a fraction of the largest velocity; 1e-10 leaves about 1e-12 of the peaks of
    the paper's scenes. ``cosine_steps`` is the least number of steps on a cosine ramp: the steps
    integrate its impulse, on which the motion after a short pulse depends, right to 1e-14 with 32
    steps; one step, halved in places, leaves 4e-11. For the time ``starting`` from the start the
    front counts as a closing contact [natural time units].
    """

    stepper: Stepper
    tolerance: float
    cosine_steps: int = 32
    starting: float = math.inf

    def cut(self, legs: Sequence[Leg]) -> tuple[Leg, ...]:
        """Return legs whose steps are cut into equal parts until each cosine ramp has enough."""
        fewest = self.cosine_steps
        return tuple(
            leg.in_steps(leg.steps * math.ceil(fewest / leg.steps))
            if leg.steps < fewest and leg.ramp is not None and SHAPES[leg.ramp.shape].is_curved
            else leg
            for leg in legs
        )


Walker = Fixed | Refined
"""Any walker from one wanted time to the next."""
