"""Hertz's law of two elastic spheres, or of a sphere and a plane: F = A d^(3/2).

K. L. Johnson, Contact Mechanics (1985), 4.2. Arguments are numbers or arrays of one shape, in any
consistent units; A is ``stiffness``, d ``overlap``. Compiled loops have the law in their own files,
where Numba's cache notices changes, and ``engines/native/equations.py`` has it as Eq. 1 is written.
"""

from __future__ import annotations

import math

import numpy as np

from hertzchain.arrays import Quantity


def plane_modulus(young_modulus: Quantity, poisson_ratio: Quantity) -> Quantity:
    """E / (1 - nu^2) [Pa]."""
    return young_modulus / (1 - poisson_ratio**2)


def stiffness_of(radius: Quantity, modulus: Quantity) -> Quantity:
    """A = 4/3 E* sqrt(R*) [N m^(-3/2)], from R* and E*.

    1/R* is the sum of 1/R of both bodies, 1/E* that of 1 over both plane moduli.
    """
    return 4 / 3 * modulus * np.sqrt(radius)


def stiffness_of_equals(
    radius: Quantity, young_modulus: Quantity, poisson_ratio: Quantity
) -> Quantity:
    """A = sqrt(2R) E / (3 (1 - nu^2)) [N m^(-3/2)] (Eq. 1, corrected), of two equal spheres.

    The scan of the paper has E under the root; in Hertz's law it is outside.
    """
    root = math.sqrt if isinstance(radius, float) else np.sqrt
    return root(2.0 * radius) * (young_modulus / (3.0 * (1.0 - poisson_ratio**2)))


def force_of(stiffness: Quantity, overlap: Quantity) -> Quantity:
    """Force of contacts; 0 where granules are apart."""
    pressed = np.maximum(overlap, 0.0)
    return stiffness * pressed * np.sqrt(pressed)


def overlap_of(stiffness: Quantity, force: Quantity) -> Quantity:
    """Overlap of contacts that carry a force."""
    return (force / stiffness) ** (2 / 3)


def pressure_of(stiffness: Quantity, radius: Quantity, force: Quantity) -> Quantity:
    """Largest pressure p0 = 3 F / (2 pi a^2) [Pa], in the middle of contacts, with a^2 = R* d.

    ``radius`` is R*, see ``stiffness_of``; without a force the pressure is 0.
    """
    return 1.5 / math.pi * np.cbrt(stiffness**2 * force) / radius


def slope_of(stiffness: Quantity, force: Quantity) -> Quantity:
    """dF/dd of contacts that carry a force: 3/2 A^(2/3) F^(1/3)."""
    return 1.5 * np.cbrt(stiffness**2 * force)


def energy_of(force: Quantity, overlap: Quantity) -> Quantity:
    """Energy of contacts, 2/5 F d."""
    return 0.4 * force * overlap


def impact_force(stiffness: Quantity, contact_mass: Quantity, velocity: Quantity) -> Quantity:
    """Peak force of two free granules that meet [N], from A, m* and their velocity [m/s].

    At the peak the energy m* v^2 / 2 equals 2/5 A d^(5/2), so F = (5/4)^(3/5) m*^(3/5) v^(6/5)
    A^(2/5).
    """
    return (1.25 * contact_mass * velocity**2) ** (3 / 5) * stiffness ** (2 / 5)


def slowness(stiffness: Quantity, contact_mass: Quantity) -> Quantity:
    """sqrt(2 m*) / A^(1/3) of contacts; divided by F^(1/6) the natural unit of time [s]."""
    return np.sqrt(2 * contact_mass) / np.cbrt(stiffness)
