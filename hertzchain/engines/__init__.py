"""The engines native, LAMMPS, LIGGGHTS and Yade; none of them imports another."""
