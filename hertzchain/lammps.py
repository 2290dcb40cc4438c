"""The public names of the LAMMPS engine, for imports by scripts."""

from hertzchain.engines.lammps import FoundDeck, Lammps, run_many

__all__ = ["FoundDeck", "Lammps", "run_many"]
