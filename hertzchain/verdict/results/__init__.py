"""Results of other codes: tables of peaks, and dumps of LAMMPS."""
