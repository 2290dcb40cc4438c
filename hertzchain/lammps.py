"""The public names of the LAMMPS engine, where scripts import them from."""

from hertzchain.engines.lammps import Examination, Lammps, examine, run_many

__all__ = ["Examination", "Lammps", "examine", "run_many"]
