"""A user's LAMMPS deck against a scene: differences, their effects on peaks, their lines."""
