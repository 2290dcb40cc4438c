"""Oracle 1: Eq. 1 integrated in natural units, by compiled kernels or in plain NumPy."""

from hertzchain.engines.native.backend import METHODS, Native
from hertzchain.engines.native.batch import Batch, peak_forces, similar_peak_forces
from hertzchain.engines.native.damped_verlet import simulate_damped_verlet
from hertzchain.engines.native.in_numpy import simulate_in_numpy
from hertzchain.engines.native.simulation import Simulation, simulate

__all__ = [
    "METHODS",
    "Batch",
    "Native",
    "Simulation",
    "peak_forces",
    "similar_peak_forces",
    "simulate",
    "simulate_damped_verlet",
    "simulate_in_numpy",
]
