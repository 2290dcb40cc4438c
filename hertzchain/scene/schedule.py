"""The schedule: which steps a simulation takes, the same for every backend.

Steps end exactly at the corners of the pulse; without that every method falls to second order or
below. Between two corners all steps are equal.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from hertzchain.errors import TooExpensive
from hertzchain.scene.pulse import Ramp

MOST_STEPS = 1e10
"""On one leg: days of work for LAMMPS, weeks for NumPy."""


@dataclass(frozen=True)
class Leg:
    """A stretch of equal steps between two corners.

    Parameters
    ----------
    start, end
        Times [s].
    steps
        Number of steps, at least 1.
    ramp
        The ramp that the force follows here, or None where no force acts.
    """

    start: float
    end: float
    steps: int
    ramp: Ramp | None

    @property
    def dt(self) -> float:
        """The length of a step [s]."""
        return (self.end - self.start) / self.steps

    def in_units(self, time: float, force: float) -> Leg:
        """The same leg with time and force measured in other units [s, N]."""
        ramp = self.ramp and Ramp(
            self.ramp.start / time,
            self.ramp.end / time,
            self.ramp.start_force / force,
            self.ramp.end_force / force,
            self.ramp.shape,
        )
        return Leg(self.start / time, self.end / time, self.steps, ramp)


def lay_steps(ramps: Sequence[Ramp], end_time: float, dt: float) -> tuple[Leg, ...]:
    """Cut the time from 0 to ``end_time`` [s] at the corners, each piece into equal steps.

    A piece has ceil(length / dt) of them. The ramps follow one another and may go on beyond the
    end. Raises TooExpensive if there would be more steps than any run can take.
    """
    legs: list[Leg] = []

    def add(start: float, end: float, ramp: Ramp | None) -> None:
        end = min(end, end_time)
        if end > start:
            steps = (end - start) / dt
            if steps > MOST_STEPS:
                raise TooExpensive(
                    f"steps of {dt:.3g} s are {steps:.1e} in {end - start:.3g} s, more than the"
                    f" {MOST_STEPS:.0e} that a run may take: shorten pulse, chain or end_time, or"
                    " take a longer dt"
                )
            # A step that was once the result of this division must give the same number again.
            legs.append(Leg(start, end, max(1, math.ceil(steps * (1 - 2**-52))), ramp))

    add(0.0, ramps[0].start if ramps else end_time, None)
    for ramp in ramps:
        add(ramp.start, ramp.end, ramp)
    if ramps:
        add(ramps[-1].end, end_time, None)
    return tuple(legs)
