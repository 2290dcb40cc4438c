"""Oracle 2: a LAMMPS deck of the same scene, run through LAMMPS's own Python module."""

from hertzchain.lammps.backend import Lammps
from hertzchain.lammps.isolation import run_many

__all__ = ["Lammps", "run_many"]
