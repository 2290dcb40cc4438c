"""Oracle 2: a LAMMPS deck of the same scene, run through LAMMPS's own Python module."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hertzchain.engines.lammps.backend import Lammps, run_many
    from hertzchain.engines.lammps.reading.found import FoundDeck

__all__ = ["FoundDeck", "Lammps", "run_many"]


def __getattr__(name: str) -> Any:
    """Load the backend when it is first used; only the dialect is loaded at once."""
    if name in __all__:
        where = "reading.found" if name == "FoundDeck" else "backend"
        module = importlib.import_module(f"{__name__}.{where}")
        return getattr(module, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
