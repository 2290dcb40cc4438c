"""The duration of a run, and its steps, the same for every backend."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from hertzchain.arrays import FloatArray, Quantity
from hertzchain.contact import hertz
from hertzchain.errors import TooExpensive
from hertzchain.scene.chain import (
    MOMENTUM_IN_NATURAL_UNITS,
    Granules,
    NaturalUnits,
    length_and_time,
)
from hertzchain.scene.keys import check, optional
from hertzchain.scene.shocks import Piston, Ramp, Stroke


@dataclass(frozen=True)
class Run:
    """Duration of a run.

    Parameters
    ----------
    end_time
        End of the run [s]; None for the default, long enough for every contact to peak, or, with a
        striker, a wall or unlike granules, twice the time at which the first pulses are over.
    """

    end_time: float | None = optional("s", "end of the run", above=0)

    def __post_init__(self) -> None:
        check(self)


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
        return replace(self, steps=steps)

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


def lay_steps(
    ramps: Sequence[Ramp], end_time: float, dt: float, strokes: Sequence[Stroke] = ()
) -> tuple[Leg, ...]:
    """Cut the time from 0 to ``end_time`` [s] at corners and strokes, each piece into equal steps.

    A piece has ceil(length / dt) steps. The ramps follow one another and may continue beyond the
    end; strokes of a piston take their place. Raises TooExpensive if there would be more steps than
    any run can take.
    """
    first, last = (ramps[0].start, ramps[-1].end) if ramps else (end_time, end_time)
    pieces: list[tuple[float, float, Ramp | None, Stroke | None]] = [
        (0.0, first, None, None),
        *((ramp.start, ramp.end, ramp, None) for ramp in ramps),
        (last, end_time, None, None),
    ]
    if strokes:
        ends = [*(stroke.start for stroke in strokes[1:]), end_time]
        pieces = [
            (stroke.start, end, None, stroke) for stroke, end in zip(strokes, ends, strict=True)
        ]
    return tuple(
        Leg(start, min(end, end_time), _steps(start, min(end, end_time), dt), ramp, stroke)
        for start, end, ramp, stroke in pieces
        if start < min(end, end_time)
    )


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


_WAVE_SPEED = 0.9055
"""Speed of a wave of height 1, in granules per natural time unit; used only for the default end."""

_STOPPING_TIME_FACTOR = 3.0
"""Factor of (M^2 / (K^2 v))^(1/5), the time in which a Hertzian spring stops a mass: 1.6 until it
is at rest.
"""

_DECAY_TIME_FACTOR = 2.0
"""Factor of the time where granules differ, are apart or damped: waves decay there, and weak waves
are slow (chosen: as slow as a wave of 1/64 of the force).
"""


def watched_time(granules: Quantity, momentum_ratio: Quantity) -> Any:
    """Return the default time between the ends of pulse and run [natural time units]."""
    speed = _WAVE_SPEED * np.minimum(1.0, momentum_ratio) ** 0.2
    return 1.2 * (granules + 5) / speed


class Push(NamedTuple):
    """Start of a wave: units of its force, LM_ratio, momentum [N s], and the mass it moves [kg]."""

    units: NaturalUnits
    momentum_ratio: float
    momentum: float
    mass: float


def watched_with_terms(granules: Granules, push: Push, wall: bool) -> float:
    """Return the default time from the end of the shock to that of the run [s].

    It is for scenes beyond a uniform chain.

    The wave crosses each contact in its own time, and each gap with the velocity that collisions
    pass on. A wall has to stop a mass through all contacts in series: that of granule 1, or of all
    granules that move. A piston's mass is infinite.
    """
    units, mass = push.units, push.mass
    weak = min(1.0, push.momentum_ratio)
    slowness = hertz.slowness(granules.stiffness, granules.contact_mass)
    crossed = slowness * math.pow(units.force, -1 / 6)
    if granules.gap.any():
        slowed = _velocity_at_gaps(granules, units.velocity * weak, push.momentum)
        flight = _DECAY_TIME_FACTOR * float(np.sum(granules.gap / slowed))
        crossed = crossed * (units.velocity * weak / slowed) ** 0.2
    else:
        flight = 0.0
    wave = watched_time(0, weak) / 5 * (float(np.sum(crossed)) + 5 * float(np.max(crossed)))
    others = granules.mass[1:], granules.young_modulus[1:], granules.gap  # except the striker
    decays = any(values.size and np.ptp(values) > 0 for values in others)
    decays = decays or granules.damping is not None
    if decays or granules.gap.any():
        wave *= _DECAY_TIME_FACTOR
    if not wall:
        return float(wave + flight)
    if math.isinf(mass):  # a piston is not stopped
        return float(2 * wave + 2 * flight)
    softness = _softness(granules)
    stop = (mass**3 * softness**3 / push.momentum) ** 0.2
    return float(max(2 * wave, _STOPPING_TIME_FACTOR * stop) + 2 * flight)


def weakest_push(granules: Granules, stiffness: float, mass: float, force: float) -> Push:
    """Return the push of all granules that move, with the momentum of the weakest alone.

    ``stiffness``, ``mass`` and ``force`` make the units.
    """
    moved = np.abs(granules.moved)
    units = NaturalUnits(force, *length_and_time(stiffness, mass, force))
    weakest = float(np.min(moved[moved > 0]))
    ratio = weakest / (MOMENTUM_IN_NATURAL_UNITS * units.momentum)
    return Push(units, ratio, weakest, float(np.sum(granules.mass[moved > 0])))


def _velocity_at_gaps(granules: Granules, velocity: float, momentum: float) -> FloatArray:
    """Approximate lower bounds of the velocities with which granules close each gap [m/s].

    A collision passes on 2 m1 / (m1 + m2) of the velocity; all granules before a gap together move
    on with the velocity of their centre of mass; in front of a piston they move with its velocity.
    """
    if math.isinf(granules.mass[0]):
        return np.full(granules.gap.size, velocity)
    passed_on = 2 * granules.mass[:-1] / (granules.mass[:-1] + granules.mass[1:])
    alone = velocity * np.minimum.accumulate(np.cumprod(np.append(1.0, passed_on)))
    together = momentum / np.cumsum(granules.mass)
    velocities: FloatArray = np.minimum(np.maximum(alone, together), velocity)
    return velocities[: granules.gap.size]


def _softness(granules: Granules, some: slice = slice(None)) -> float:
    """Sum of the overlaps of contacts under 1 N [m N^(-2/3)]."""
    return float(np.sum(granules.stiffness[some] ** (-2 / 3)))


def squeezing_force(granules: Granules, piston: Piston, end_time: float) -> float:
    """Largest force of a piston that presses a chain against a wall or a fixed granule [N].

    All granules are assumed at rest there. The run ends at ``end_time`` [s].
    """
    starts = [stroke for stroke in piston.strokes if stroke.start < end_time]
    places = [stroke.displacement for stroke in starts]
    farthest = max(*places, starts[-1].displacement_at(end_time))
    held = np.flatnonzero(np.isinf(granules.mass[1:]))
    until = slice(0, held[0] + 1 if held.size else None)
    pressed = granules.static_overlap[until].sum() + farthest - granules.gap[until].sum()
    return float((max(pressed, 0.0) / _softness(granules, until)) ** 1.5)
