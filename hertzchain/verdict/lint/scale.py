"""What the numbers of a deck are worth in SI."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Scale:
    """A deck's units of length [m], mass [kg] and time [s], whose force is mass x acceleration."""

    length: float
    mass: float
    time: float

    @property
    def velocity(self) -> float:
        """Unit of velocity [m/s]."""
        return self.length / self.time

    @property
    def acceleration(self) -> float:
        """Unit of acceleration [m/s^2]."""
        return self.velocity / self.time

    @property
    def force(self) -> float:
        """Unit of force [N]."""
        return self.mass * self.acceleration

    @property
    def pressure(self) -> float:
        """Unit of Young's modulus [Pa]."""
        return self.force / self.length**2

    @property
    def density(self) -> float:
        """Unit of density [kg/m^3]."""
        return self.mass / self.length**3

    @property
    def stiffness(self) -> float:
        """Unit of A in F = A overlap^(3/2) [N m^(-3/2)]."""
        return self.force / (self.length * math.sqrt(self.length))


SCALES = {
    "si": Scale(1.0, 1.0, 1.0),
    "cgs": Scale(1e-2, 1e-3, 1.0),
    "micro": Scale(1e-6, 1e-15, 1e-6),
    "nano": Scale(1e-9, 1e-21, 1e-9),
}
"""LAMMPS's styles of units that belong to a scale: ``lj`` takes any, others have factors."""
