"""The public names of the LAMMPS engine, for imports by scripts."""

from hertzchain.engines.lammps.backend import Lammps
from hertzchain.engines.lammps.reading.deck import FoundDeck

__all__ = ["FoundDeck", "Lammps"]
