"""Oracle 1: Eq. 1 integrated in natural units, by compiled kernels or in plain NumPy."""
