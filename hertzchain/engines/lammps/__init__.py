"""Oracle 2: a LAMMPS deck of the same scene, run through LAMMPS's own Python module."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hertzchain.engines.lammps.backend import Lammps, run_many
    from hertzchain.engines.lammps.reading.found import FoundDeck
    from hertzchain.engines.lammps.reading.own import examine

__all__ = ["FoundDeck", "Lammps", "examine", "run_many"]

_WHERE = {"FoundDeck": "reading.found", "examine": "reading.own"}


def __getattr__(name: str) -> Any:
    """Load the backend when it is first used; only the dialect is loaded at once."""
    if name in __all__:
        module = importlib.import_module(f"{__name__}.{_WHERE.get(name, 'backend')}")
        return getattr(module, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
