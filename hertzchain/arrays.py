"""Type names of arrays."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
"""An array of numbers."""

Array = FloatArray


def or_none(values: NDArray[Any]) -> list[Any]:
    """Return values for JSON: None in place of each number that is not finite."""
    if values.dtype == object:
        return list(values.tolist())
    return [value if np.isfinite(value) else None for value in values.tolist()]
