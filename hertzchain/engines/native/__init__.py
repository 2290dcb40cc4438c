"""Oracle 1: Eq. 1 integrated in natural units, by compiled kernels or in plain NumPy."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hertzchain.engines.native.backend import Native
    from hertzchain.engines.native.batch import Batch, peak_forces, similar_peak_forces
    from hertzchain.engines.native.damped_verlet import simulate_damped_verlet
    from hertzchain.engines.native.in_numpy import simulate_in_numpy
    from hertzchain.engines.native.methods import METHODS
    from hertzchain.engines.native.simulation import Simulation, simulate

_HOME = {
    "METHODS": "methods",
    "Batch": "batch",
    "Native": "backend",
    "Simulation": "simulation",
    "peak_forces": "batch",
    "similar_peak_forces": "batch",
    "simulate": "simulation",
    "simulate_damped_verlet": "damped_verlet",
    "simulate_in_numpy": "in_numpy",
}

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


def __getattr__(name: str) -> Any:
    """Load a name, and what it needs, when it is first used: a run needs no batch."""
    if name in _HOME:
        return getattr(importlib.import_module(f"{__name__}.{_HOME[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
