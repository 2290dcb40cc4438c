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
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from hertzchain.engines.native.methods import Stepper
from hertzchain.scene.pulse import SHAPES
from hertzchain.scene.schedule import Leg


@dataclass(frozen=True)
class Fixed:
    """Steps as asked, never halved."""

    stepper: Stepper
    tolerance: float = field(default=0.0, init=False)
    starting: float = field(default=0.0, init=False)

    def cut(self, legs: Sequence[Leg]) -> tuple[Leg, ...]:
        """The legs themselves: steps are taken as asked."""
        return tuple(legs)


@dataclass(frozen=True)
class Refined:
    """Steps halved where a contact opens or closes, until r'^(3/2) h^(5/2) is below the tolerance.

    The tolerance is a fraction of the largest velocity; 1e-10 leaves about 1e-12 of the peaks of
    the paper's scenes. ``cosine_steps`` is the fewest on a cosine ramp: its impulse, all that a
    short pulse leaves, is a quadrature by the steps, right to 1e-14 with 32; one, halved somewhere,
    leaves 4e-11. ``starting`` is how long from the start the front counts as a contact that closes
    [natural time units].
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


Walker = Fixed | Refined
"""Goes from one wanted time to the next in one step or more."""
