"""Oracle 1: Eq. 1 integrated with NumPy, in natural units."""

from hertzchain.native.backend import METHODS, Native, Simulation, simulate

__all__ = ["METHODS", "Native", "Simulation", "simulate"]
