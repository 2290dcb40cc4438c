"""Names for the types of arrays."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating[Any]]
"""Of any floating-point precision."""

FloatArray = NDArray[np.float64]
"""What leaves the package."""

Scalar = float | np.floating[Any]
"""A number of any precision."""
