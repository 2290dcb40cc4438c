"""The public names of the LAMMPS engine, for imports by scripts."""

from hertzchain.engines.lammps import FoundDeck, Lammps, examine, run_many

__all__ = ["FoundDeck", "Lammps", "examine", "run_many"]
