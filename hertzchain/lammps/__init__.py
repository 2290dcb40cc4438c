"""Oracle 2: a LAMMPS deck of the same scene, run through LAMMPS's own Python module."""

from hertzchain.lammps.backend import Lammps
from hertzchain.lammps.examination import Examination, examine
from hertzchain.lammps.isolation import run_many

__all__ = ["Examination", "Lammps", "examine", "run_many"]
