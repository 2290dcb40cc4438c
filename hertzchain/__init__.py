"""How hard each contact of a shocked chain of spheres is pressed, and how sure that is.

PYTEST_DONT_REWRITE, as pytest else warns where this was imported before it started.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hertzchain import theory
    from hertzchain.chain import Chain
    from hertzchain.comparison import Comparison, compare
    from hertzchain.errors import HertzchainError
    from hertzchain.judgement import Judgement, judge
    from hertzchain.lammps import Lammps
    from hertzchain.liggghts import Liggghts
    from hertzchain.native import Batch, Native, peak_forces, similar_peak_forces
    from hertzchain.result import Result
    from hertzchain.scene import Run, Scene
    from hertzchain.shock import Pulse, PulseTable
    from hertzchain.sweeps import Sweep, sweep
    from hertzchain.trajectory import write_trajectory
    from hertzchain.yade import Yade

_HOME = {
    "Batch": "hertzchain.native",
    "Chain": "hertzchain.chain",
    "Comparison": "hertzchain.comparison",
    "HertzchainError": "hertzchain.errors",
    "Judgement": "hertzchain.judgement",
    "Lammps": "hertzchain.lammps",
    "Liggghts": "hertzchain.liggghts",
    "Native": "hertzchain.native",
    "Pulse": "hertzchain.shock",
    "PulseTable": "hertzchain.shock",
    "Result": "hertzchain.result",
    "Run": "hertzchain.scene",
    "Scene": "hertzchain.scene",
    "Sweep": "hertzchain.sweeps",
    "Yade": "hertzchain.yade",
    "compare": "hertzchain.comparison",
    "judge": "hertzchain.judgement",
    "peak_forces": "hertzchain.native",
    "similar_peak_forces": "hertzchain.native",
    "sweep": "hertzchain.sweeps",
    "write_trajectory": "hertzchain.trajectory",
}

__all__ = [
    "Batch",
    "Chain",
    "Comparison",
    "HertzchainError",
    "Judgement",
    "Lammps",
    "Liggghts",
    "Native",
    "Pulse",
    "PulseTable",
    "Result",
    "Run",
    "Scene",
    "Sweep",
    "Yade",
    "compare",
    "judge",
    "peak_forces",
    "similar_peak_forces",
    "sweep",
    "theory",
    "write_trajectory",
]


def __getattr__(name: str) -> Any:
    """Load a public name, and what it needs, when it is first used."""
    if name == "__version__":
        return importlib.import_module("importlib.metadata").version("hertzchain")
    if name == "theory":
        return importlib.import_module("hertzchain.theory")
    if name in _HOME:
        return getattr(importlib.import_module(_HOME[name]), name)
    raise AttributeError(f"module 'hertzchain' has no attribute {name!r}")
