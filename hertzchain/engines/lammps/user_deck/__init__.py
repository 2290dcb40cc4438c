"""Somebody's own deck: LAMMPS reads it, is asked for every number, runs it and is watched."""

from hertzchain.engines.lammps.user_deck.found import (
    Executed,
    FoundDeck,
    FoundFix,
    FoundRun,
    FoundWall,
)
from hertzchain.engines.lammps.user_deck.reading import read_deck

__all__ = ["Executed", "FoundDeck", "FoundFix", "FoundRun", "FoundWall", "read_deck"]
