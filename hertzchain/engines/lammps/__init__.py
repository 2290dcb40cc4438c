"""Oracle 2: a LAMMPS deck of the same scene, run through LAMMPS's own Python module."""

from hertzchain.engines.lammps.backend import Lammps, run_many
from hertzchain.engines.lammps.examination import Examination, examine

__all__ = ["Examination", "Lammps", "examine", "run_many"]
