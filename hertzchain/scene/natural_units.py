"""Similarity: a scene in natural units, where E, R, rho, nu and F0 drop out.

With F0 as unit of force, (F0 / A)^(2/3) as unit of length and sqrt(m length / F0) as unit of time,
Eq. 1 of a uniform chain becomes u'' = f(t) - (u_1 - u_2)_+^(3/2) and so on, with a pulse of
height 1. The scaling of Hertz's law is exact: nothing is lost. What remains of a scene is its
profile, n, LM_ratio and N.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from hertzchain.scene.chain import Chain

IMPACT = 0.754272
"""Peak force of two granules of mass 1, one running into the other at rest with velocity 1: the
energy 1/4 is 2/5 r^(5/2), so (5/8)^(3/5)."""

PAPER_MOMENTUM = 139 / 32
"""The paper's coefficient of L_SW (section 4.1); the exact one is in hertzchain.theory."""

MOMENTUM_IN_NATURAL_UNITS = PAPER_MOMENTUM / (
    math.sqrt(4 * math.pi / 3) * math.cbrt(3 / math.sqrt(2))
)
"""L_SW of a wave of height 1, in natural units, with the paper's 139/32: 1.651778333."""


@dataclass(frozen=True)
class NaturalUnits:
    """The units in which every scene of a uniform chain looks alike.

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
    """How hard a shock presses contacts, roughly, over F0.

    Long pulses press with about F0. A short one only leaves its impulse I in the first granule,
    which presses the second with 0.754 I^1.2.
    """
    short = min(1.0, momentum_ratio)  # at 1 the other is larger; no ratio is too large for it
    return min(1.0, IMPACT * math.pow(MOMENTUM_IN_NATURAL_UNITS * short, 1.2))


def impact_force(stiffness: float, contact_mass: float, velocity: float) -> float:
    """Peak force of two free granules that meet [N], from A, m* and their velocity [m/s].

    The energy m* v^2 / 2 is 2/5 A overlap^(5/2) then, so F = (5/4)^(3/5) m*^(3/5) v^(6/5) A^(2/5).
    """
    energy = 1.25 * contact_mass * velocity**2
    return math.pow(energy, 3 / 5) * math.pow(stiffness, 2 / 5)


def slowness(stiffness: Any, contact_mass: Any) -> Any:
    """sqrt(2 m*) / A^(1/3) of contacts, numbers or arrays: over F^(1/6), the unit of time [s]."""
    return np.sqrt(2 * contact_mass) / np.cbrt(stiffness)
