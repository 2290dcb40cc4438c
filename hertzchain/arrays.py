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


def or_none(values: FloatArray) -> list[float | None]:
    """Values for JSON, which has no word for what is not a finite number."""
    return [value if np.isfinite(value) else None for value in values.tolist()]
