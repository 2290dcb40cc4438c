"""Which method and which steps give peaks of a wanted accuracy at the least cost.

In natural units all scenes are alike, so what a step costs in accuracy was measured once, on random
scenes (LM_ratio 0.05 to 10, n 1.1 to 60, N 2 to 500, all profiles): SRKN_6^b is the cheapest down
to 3e-5, SRKN_11^b below. What a scene makes of it is estimated afresh in every run.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from hertzchain.native.methods import SRKN_6B, SRKN_11B
from hertzchain.native.refinement import Refined
from hertzchain.schedule import Leg

TIGHTEST, LOOSEST = 1e-10, 0.01
"""What can be asked for; below, round-off and opening contacts decide."""

_LONGEST_STEP = 0.55
"""Natural time units; the run that tells the error has steps half as long again, and at 1.0 both
methods begin to fail."""

_SAFETY = 0.15
"""Error over the difference to a run with other steps: 1/16 where the motion is smooth, 1/7 of what
an opening contact leaves, rounded up."""

_KNOWN = 0.45
"""Error over the wanted accuracy in the worst of the random scenes, rounded up.

A difference can be small by chance, so the error is never said to be less.
"""

_LOOSE = 3e-5
"""From here on SRKN_6^b is cheaper than SRKN_11^b."""


@dataclass(frozen=True)
class Plan:
    """How to run.

    Parameters
    ----------
    method
        Its name.
    walker
        Takes the steps.
    step
        The largest step, natural time units.
    error
        Of the peaks, in the worst of the random scenes.
    """

    method: str
    walker: Refined
    step: float
    error: float

    @property
    def coarser(self) -> Refined:
        """The walker of a second run that tells the error of the first."""
        return replace(self.walker, tolerance=8 * self.walker.tolerance)

    def closer(self, factor: float) -> Plan:
        """The plan whose error is smaller by a factor."""
        step = self.step * factor ** (1 / (self.walker.stepper.order + 1))
        walker = replace(self.walker, tolerance=self.walker.tolerance * factor)
        return replace(self, step=step, walker=walker, error=self.error * factor)

    def estimate(self, difference: float) -> float:
        """Upper bound of the error, from the difference to a run with other steps."""
        return self.error + _SAFETY * difference


def plan(rtol: float) -> Plan:
    """The cheapest way to peaks of relative accuracy ``rtol``, as measured.

    Errors of the worst of the random scenes: 2e-4 (h / 0.6)^4.3 for SRKN_6^b, 3e-9 (h / 0.2)^6.5
    for SRKN_11^b, and 2e-4 times the refinement tolerance.
    """
    tight = max(0.0, -math.log10(rtol) - 6)
    aim = rtol / 3  # the rest is what the estimate cannot know
    cosine_steps = 8 if rtol > 1e-8 else 16
    if rtol >= _LOOSE:
        name, stepper, step = "srkn-6b", SRKN_6B, 0.6 * (aim / 2e-4) ** (1 / 4.3)
    else:
        name, stepper, step = "srkn-11b", SRKN_11B, 0.2 * (aim / 3e-9) ** (1 / 6.5)
    walker = Refined(stepper, 5e3 * aim, cosine_steps, starting=4 + 2 * tight)
    return Plan(name, walker, min(step, _LONGEST_STEP), _KNOWN * rtol)


def other_steps(legs: Sequence[Leg]) -> tuple[Leg, ...]:
    """The legs with other steps, for the run that tells the error: two thirds as many.

    A leg of one or two steps gets one more instead.
    """
    return tuple(
        replace(leg, steps=2 * leg.steps // 3 if leg.steps > 2 else leg.steps + 1) for leg in legs
    )
