"""How long a chain is watched after its pulse, where a scene does not say."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.scene.granules import Granules
from hertzchain.scene.natural_units import NaturalUnits, slowness
from hertzchain.scene.piston import Piston

_WAVE_SPEED = 0.9055
"""Granules per natural time unit of a wave of height 1; it only decides how long to watch."""

_STOP = 3.0
"""Times (M^2 / (K^2 v))^(1/5), in which a spring of Hertz stops a mass: 1.6 until it is at rest."""

_UNLIKE = 2.0
"""Times as long, where granules are unlike, apart or damped: waves decay there, and weak ones are
slow (chosen: as slow as a wave of 1/64 of the force)."""


def watched_time(granules: Any, momentum_ratio: Any) -> Any:
    """How long a chain is watched after its pulse, where nothing is said [natural time units]."""
    speed = _WAVE_SPEED * np.minimum(1.0, momentum_ratio) ** 0.2
    return 1.2 * (granules + 5) / speed


def watched_with_terms(
    granules: Granules, units: NaturalUnits, momentum_ratio: float, momentum: float, wall: bool
) -> float:
    """How long a chain with terms is watched after its pulse, where nothing is said [s].

    The wave crosses each contact in its own time, and each gap with the velocity that is passed on
    from collision to collision. A wall has to stop granule 1, by all contacts in a row.
    """
    weak = min(1.0, momentum_ratio)
    crossed = slowness(granules.stiffness, granules.contact_mass) * math.pow(units.force, -1 / 6)
    if granules.gap.any():
        slowed = _velocity_at_gaps(granules, units.velocity * weak, momentum)
        flight = _UNLIKE * float(np.sum(granules.gap / slowed))
        crossed = crossed * (units.velocity * weak / slowed) ** 0.2
    else:
        flight = 0.0
    wave = watched_time(0, weak) / 5 * (float(np.sum(crossed)) + 5 * float(np.max(crossed)))
    others = granules.mass[1:], granules.young_modulus[1:], granules.gap  # but the striker
    decays = any(np.ptp(values) > 0 for values in others) or granules.damping is not None
    if decays or granules.gap.any():
        wave *= _UNLIKE
    if not wall:
        return float(wave + flight)
    mass = float(granules.mass[0])
    if math.isinf(mass):  # a piston is not stopped
        return float(2 * wave + 2 * flight)
    softness = _softness(granules)
    stop = (mass**3 * softness**3 / momentum) ** 0.2
    return float(max(2 * wave, _STOP * stop) + 2 * flight)


def _velocity_at_gaps(granules: Granules, velocity: float, momentum: float) -> FloatArray:
    """Velocities with which the granules before each gap close it at least, about [m/s].

    A collision passes on 2 m1 / (m1 + m2) of the velocity; all granules before a gap together go on
    with the velocity of their centre of mass. Behind a piston they go on with its own.
    """
    if math.isinf(granules.mass[0]):
        return np.full(granules.gap.size, velocity)
    passed_on = 2 * granules.mass[:-1] / (granules.mass[:-1] + granules.mass[1:])
    alone = velocity * np.minimum.accumulate(np.cumprod(np.append(1.0, passed_on)))
    together = momentum / np.cumsum(granules.mass)
    found: FloatArray = np.minimum(np.maximum(alone, together), velocity)
    return found[: granules.gap.size]


def _softness(granules: Granules) -> float:
    """Overlap of all contacts together under 1 N [m N^(-2/3)]."""
    return float(np.sum(granules.stiffness ** (-2 / 3)))


def squeezing_force(granules: Granules, piston: Piston, end_time: float) -> float:
    """Force with which a piston presses a chain against a wall when it has gone farthest [N].

    All granules are at rest then. The run ends at ``end_time`` [s].
    """
    starts = [stroke for stroke in piston.strokes if stroke.start < end_time]
    places = [stroke.displacement for stroke in starts]
    farthest = max(*places, starts[-1].displacement_at(end_time))
    pressed = granules.static_overlap.sum() + farthest - granules.gap.sum()
    return float((max(pressed, 0.0) / _softness(granules)) ** 1.5)
