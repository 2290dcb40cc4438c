"""Somebody's LAMMPS deck as text: what can be known of it, and the traps in it."""
