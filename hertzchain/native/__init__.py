"""Oracle 1: Eq. 1 integrated with NumPy, in natural units."""

from hertzchain.native.backend import METHODS, Native, simulate

__all__ = ["METHODS", "Native", "simulate"]
