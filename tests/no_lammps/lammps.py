"""On the path before the real one: as if there were no LAMMPS, in any process."""

raise ImportError("No module named 'lammps'")
