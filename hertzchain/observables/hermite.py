"""Two-point Hermite interpolation: the polynomial with given value and derivatives at both ends."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from math import comb, factorial
from typing import Any

import numpy as np
from numpy.polynomial import polynomial

from hertzchain.arrays import Array, FloatArray


def coefficients(start: Sequence[Array], end: Sequence[Array], h: Array) -> Array:
    """Coefficients of the interpolant in s = (t - t_start) / h, lowest power first, (2m + 2, ...).

    ``start`` and ``end`` are the value and its first m derivatives at the ends, each of shape
    (...). The error is of order h^(2m + 2) for a smooth function.
    """
    highest = len(start) - 1
    # Differences of the value, not the value: large equal values would cost digits.
    grown = [np.zeros_like(start[0]), *start[1:]], [end[0] - start[0], *end[1:]]
    scaled = [derivative * h**k for ends in grown for k, derivative in enumerate(ends)]
    basis = _basis(highest).astype(np.result_type(*scaled))
    curve = np.asarray(np.tensordot(basis, np.stack(scaled), axes=(0, 0)))
    curve[0] += start[0]
    return curve


def evaluate(coefficients: Array, s: Array) -> Array:
    """Evaluate the interpolant at s, shape (...); s broadcasts against the columns."""
    return np.asarray(polynomial.polyval(s, coefficients, tensor=False))


def derivative(coefficients: Array) -> Array:
    """Coefficients of the derivative with respect to s."""
    return polynomial.polyder(coefficients)


@functools.cache
def _basis(highest: int) -> FloatArray:
    """Power-basis rows for each derivative at 0, then at 1 (two-point Taylor formula)."""
    rows = []
    for at_end in (False, True):
        near, far = ([0.0, 1.0], [1.0, -1.0]) if not at_end else ([1.0, -1.0], [0.0, 1.0])
        for k in range(highest + 1):
            row: Any = np.zeros(1)
            for j in range(highest - k + 1):
                term = comb(highest + j, j) * polynomial.polypow(near, j)
                row = polynomial.polyadd(row, term)
            row = polynomial.polymul(row, polynomial.polypow(near, k))
            row = polynomial.polymul(row, polynomial.polypow(far, highest + 1))
            row = row * (-1.0 if at_end and k % 2 else 1.0) / factorial(k)
            rows.append(np.pad(row, (0, 2 * highest + 2 - row.size)))
    return np.array(rows)
