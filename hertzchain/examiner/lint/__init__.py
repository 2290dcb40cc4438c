"""A user's LAMMPS deck without a scene: what is known of it, and the traps in it."""
