"""Oracle 2: a LAMMPS deck of the same scene, run through LAMMPS's own Python module."""

from hertzchain.lammps.backend import Lammps, round_off
from hertzchain.lammps.examination import Examination, examine

__all__ = ["Examination", "Lammps", "examine", "round_off"]
