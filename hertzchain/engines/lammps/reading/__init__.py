"""Somebody's own deck: LAMMPS reads it, is asked for every number, runs it and is watched."""
