"""Similarity: a scene in natural units, where E, R, rho, nu and F0 drop out.

With F0 as unit of force, (F0 / A)^(2/3) as unit of length and sqrt(m length / F0) as unit of time,
Eq. 1 of a uniform chain becomes u'' = f(t) - (u_1 - u_2)_+^(3/2) and so on, with a pulse of height
1. This scaling is exact for Hertz's law. A scene then depends on its profile, n, LM_ratio and N
alone.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from hertzchain.scene.chain import Chain

IMPACT = 0.754272
"""Peak force between two granules of mass 1, one at rest, the other with velocity 1: the energy 1/4
equals 2/5 r^(5/2), so the force is (5/8)^(3/5).
"""

PAPER_MOMENTUM = 139 / 32
"""The paper's coefficient of L_SW (section 4.1); the exact one is in hertzchain.theory."""

MOMENTUM_IN_NATURAL_UNITS = PAPER_MOMENTUM / (
    math.sqrt(4 * math.pi / 3) * math.cbrt(3 / math.sqrt(2))
)
"""L_SW of a wave of height 1, in natural units, with the paper's 139/32: 1.651778333."""


@dataclass(frozen=True)
class NaturalUnits:
    """Units in which scenes of uniform chains no longer depend on E, R, rho, nu and F0.

    Parameters
    ----------
    force
        F0, the largest applied force [N].
    length
        (F0 / A)^(2/3), the overlap of two granules pressed by F0 [m].
    time
        sqrt(m length / F0) [s].
    """

    force: float
    length: float
    time: float

    @property
    def velocity(self) -> float:
        """Unit of velocity [m/s]."""
        return self.length / self.time

    @property
    def momentum(self) -> float:
        """Unit of momentum [N s]."""
        return self.force * self.time

    @property
    def energy(self) -> float:
        """Unit of energy [J]."""
        return self.force * self.length


def natural_units(chain: Chain, peak_force: float) -> NaturalUnits:
    """The natural units of a chain under a shock whose largest force is ``peak_force`` [N]."""
    return NaturalUnits(
        peak_force, *length_and_time(chain.contact_stiffness, chain.granule_mass, peak_force)
    )


def length_and_time(contact_stiffness: Any, granule_mass: Any, peak_force: Any) -> tuple[Any, Any]:
    """The natural units of length [m] and time [s], from A [N m^(-3/2)], m [kg] and F0 [N].

    All are numbers, or arrays of one shape.
    """
    is_one = isinstance(peak_force, float)
    power, root = (math.pow, math.sqrt) if is_one else (np.power, np.sqrt)
    length = power(peak_force / contact_stiffness, 2 / 3)
    return length, root(granule_mass * length / peak_force)


def force_scale(momentum_ratio: float) -> float:
    """Approximate force of contacts under a shock, over F0.

    Long pulses press contacts with about F0. A short pulse only gives its impulse I to the first
    granule, which presses the second with 0.754 I^1.2.
    """
    short = min(1.0, momentum_ratio)  # above 1 the result is 1; this avoids an overflow
    return min(1.0, IMPACT * math.pow(MOMENTUM_IN_NATURAL_UNITS * short, 1.2))
