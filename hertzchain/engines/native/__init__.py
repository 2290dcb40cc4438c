"""Oracle 1: Eq. 1 integrated in natural units, by compiled kernels, by SciPy or in plain NumPy."""
