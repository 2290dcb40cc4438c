"""The public names of the LAMMPS engine, for imports by scripts."""

from hertzchain.engines.lammps import Examination, Lammps, examine, run_many

__all__ = ["Examination", "Lammps", "examine", "run_many"]
