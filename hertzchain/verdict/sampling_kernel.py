"""What samples at many intervals leave, compiled: the loop of ``sampling``."""

from __future__ import annotations

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.native.kernels import compiled_and_kept


@compiled_and_kept
def left_by(
    steps: FloatArray,
    time: FloatArray,
    shape: FloatArray,
    lower: FloatArray,
    left: FloatArray,
) -> None:
    """Fill in the mean square that samples at each of the intervals leave: ``left``, (steps,).

    Around the peaks at ``time`` forces are polynomials, ``shape``, (degree, contacts), from the
    highest power to the first. ``lower`` is what samples have to give.
    """
    degree = shape.shape[0]
    for k in range(steps.size):
        h = steps[k]
        square = 0.0
        for i in range(time.size):
            away = h * np.round(time[i] / h) - time[i]
            model = 0.0
            for power in range(degree):
                model = (model + shape[power, i]) * away
            model -= lower[i]
            square += model * model
        left[k] = square / time.size
