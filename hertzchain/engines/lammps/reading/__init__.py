"""Somebody's own deck: LAMMPS reads it, is asked for every number, runs it and is watched."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hertzchain.engines.lammps.reading.found import (
        Executed,
        FoundDeck,
        FoundFix,
        FoundRun,
        FoundWall,
    )
    from hertzchain.engines.lammps.reading.reading import Reader
    from hertzchain.engines.lammps.reading.text import Edits

__all__ = [
    "Edits", "Executed", "FoundDeck", "FoundFix", "FoundRun", "FoundWall", "Reader",
]  # fmt: skip

_WHERE = {"Edits": "text", "Reader": "reading"}


def __getattr__(name: str) -> Any:
    """Load what is asked for: ``text`` alone needs no NumPy."""
    if name in __all__:
        module = importlib.import_module(f"{__name__}.{_WHERE.get(name, 'found')}")
        return getattr(module, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
