"""Type names of arrays; numbers in words."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

Quantity = Any
"""A number, or an array of numbers."""

FloatArray = NDArray[np.float64]
"""An array of numbers."""


Source = Any
"""Measured numbers: a path, or a table of pandas or with columns as it has them."""


def or_none(values: NDArray[np.generic]) -> list[Any]:
    """Return values for JSON: None in place of each number that is not finite."""
    if values.dtype == object:
        return list(values.tolist())
    return [value if np.isfinite(value) else None for value in values.tolist()]


def apart(measured: float, expected: float, least: int = 4) -> tuple[str, str]:
    """Return two numbers with ``least`` digits or more, until they differ."""
    off, largest = abs(measured - expected), max(abs(measured), abs(expected))
    digits = least
    if 0 < off < largest:
        digits = min(17, max(least, 2 - math.floor(math.log10(off / largest))))
    return f"{measured:.{digits}g}", f"{expected:.{digits}g}"
