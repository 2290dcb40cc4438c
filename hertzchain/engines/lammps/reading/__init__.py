"""A user's deck: LAMMPS reads it, is queried for every number, and runs it under observation."""
