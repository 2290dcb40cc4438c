"""Somebody's own deck: LAMMPS reads it, is asked for every number, runs it and is watched."""

from hertzchain.engines.lammps.reading.found import (
    Executed,
    FoundDeck,
    FoundFix,
    FoundRun,
    FoundWall,
)
from hertzchain.engines.lammps.reading.reading import Reader, read_deck
from hertzchain.engines.lammps.reading.text import Edits

__all__ = [
    "Edits", "Executed", "FoundDeck", "FoundFix", "FoundRun", "FoundWall", "Reader", "read_deck",
]  # fmt: skip
