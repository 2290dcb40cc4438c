"""The longest stable step of velocity Verlet for a chain, in any units."""

from __future__ import annotations

import math
from collections.abc import Sequence

IMPACT = 1.14326263  # F_max of two spheres over m*^(3/5) v^(6/5) A^(2/5), derived from Hertz's law


def spring(stiffness: float, force: float) -> float:
    """The stiffness dF/d(overlap) of a contact F = A overlap^(3/2) under a force, for its A."""
    return float(1.5 * stiffness ** (2 / 3) * force ** (1 / 3))


def impact_force(stiffness: float, mass: float, other_mass: float, velocity: float) -> float:
    """The largest force of two spheres that collide, for A of their contact."""
    reduced = mass * other_mass / (mass + other_mass)
    return float(IMPACT * reduced**0.6 * velocity**1.2 * stiffness**0.4)


def longest_step(masses: Sequence[float], springs: Sequence[float]) -> float:
    """2 over the largest angular frequency of masses in a row, all springs of which are engaged.

    One spring more than there are gaps between masses ties the last mass to a wall. The largest
    frequency is found by Sturm's count of eigenvalues below a bound (Golub and Van Loan, Matrix
    Computations, 8.4), to 10 digits.
    """
    count = len(masses)
    ahead = [*springs, 0.0][:count]
    behind = [0.0, *springs][:count]
    diagonal = [(a + b) / m for a, b, m in zip(ahead, behind, masses, strict=True)]
    squares = [ahead[k] ** 2 / (masses[k] * masses[k + 1]) for k in range(count - 1)]
    high = 2 * max(diagonal)  # Gershgorin: rows of the unsymmetric matrix add up to 0
    low = max(diagonal) / 2
    while high - low > 1e-10 * high:
        middle = (low + high) / 2
        low, high = (low, middle) if _all_below(diagonal, squares, middle) else (middle, high)
    return 2 / math.sqrt(high)


def _all_below(diagonal: Sequence[float], squares: Sequence[float], bound: float) -> bool:
    """Whether all eigenvalues of a symmetric tridiagonal matrix are below a bound."""
    pivot = 1.0
    for k, value in enumerate(diagonal):
        pivot = value - bound - (squares[k - 1] / pivot if k else 0.0)
        if pivot >= 0:
            return False
    return True
