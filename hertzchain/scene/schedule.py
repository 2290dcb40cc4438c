"""The schedule: the steps of a simulation, the same for every backend.

Steps end exactly at the corners of the pulse; otherwise every method falls to second order or
below. Between two corners all steps are equal.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from hertzchain.errors import TooExpensive
from hertzchain.scene.ramp import Ramp
from hertzchain.scene.shock import Stroke

MOST_STEPS = 1e10
"""Largest number of steps on one leg (chosen): days of work for LAMMPS, weeks for NumPy."""


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
    stroke
        The stroke of the piston, or None where there is no piston.
    """

    start: float
    end: float
    steps: int
    ramp: Ramp | None
    stroke: Stroke | None = None

    @property
    def dt(self) -> float:
        """The length of a step [s]."""
        return (self.end - self.start) / self.steps

    def in_steps(self, steps: int) -> Leg:
        """The same leg in another number of steps."""
        return Leg(self.start, self.end, steps, self.ramp, self.stroke)

    def in_units(self, time: float, force: float, length: float = 1.0) -> Leg:
        """The same leg with time, force and length measured in other units [s, N, m]."""
        ramp = self.ramp and Ramp(
            self.ramp.start / time,
            self.ramp.end / time,
            self.ramp.start_force / force,
            self.ramp.end_force / force,
            self.ramp.shape,
        )
        stroke = self.stroke and Stroke(
            self.stroke.start / time,
            self.stroke.displacement / length,
            self.stroke.velocity / (length / time),
        )
        return Leg(self.start / time, self.end / time, self.steps, ramp, stroke)


def lay_steps(ramps: Sequence[Ramp], end_time: float, dt: float) -> tuple[Leg, ...]:
    """Cut the time from 0 to ``end_time`` [s] at the corners, each piece into equal steps.

    A piece has ceil(length / dt) steps. The ramps follow one another and may continue beyond the
    end. Raises TooExpensive if there would be more steps than any run can take.
    """
    pieces: list[tuple[float, float, Ramp | None]] = [
        (0.0, ramps[0].start if ramps else end_time, None)
    ]
    pieces += [(ramp.start, ramp.end, ramp) for ramp in ramps]
    if ramps:
        pieces.append((ramps[-1].end, end_time, None))
    legs = []
    for start, piece_end, ramp in pieces:
        end = min(piece_end, end_time)
        if end > start:
            legs.append(Leg(start, end, _steps(start, end, dt), ramp))
    return tuple(legs)


def lay_strokes(strokes: Sequence[Stroke], end_time: float, dt: float) -> tuple[Leg, ...]:
    """Cut the time from 0 to ``end_time`` [s] at a piston's strokes, as ``lay_steps`` does."""
    ends = [*(stroke.start for stroke in strokes[1:]), end_time]
    return tuple(
        Leg(stroke.start, min(end, end_time), _steps(stroke.start, min(end, end_time), dt), None,
            stroke)
        for stroke, end in zip(strokes, ends, strict=True)
        if min(end, end_time) > stroke.start
    )  # fmt: skip


def _steps(start: float, end: float, dt: float) -> int:
    """Return the number of equal steps of at most ``dt`` [s] from start to end."""
    steps = (end - start) / dt
    if steps > MOST_STEPS:
        raise TooExpensive(
            f"steps of {dt:.3g} s are {steps:.1e} in {end - start:.3g} s, more than the"
            f" {MOST_STEPS:.0e} that a run may take: shorten pulse, chain or end_time, or"
            " take a longer dt"
        )
    # A step that came from this division must give the same number of steps again.
    return max(1, math.ceil(steps * (1 - 2**-52)))
