"""Two-point Hermite interpolation: the polynomial that meets value and derivatives at both ends."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from math import comb, factorial, perm
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


def increments(start: Sequence[Array], end: Sequence[Array], h: Array) -> Array:
    """Differences of successive Bernstein coefficients of the interpolant, shape (2m + 1, ...).

    The slope has at most as many zeros within the interval as these differences have changes of
    sign (Descartes). The interpolant exceeds its start by at most the largest of their partial
    sums.
    """
    highest = len(start) - 1
    degree = 2 * highest + 1
    found = [np.zeros_like(start[0])] * degree
    for j in range(highest):
        for k in range(1, j + 2):
            weight = h**k * (comb(j, k - 1) / perm(degree, k))
            found[j] = found[j] + weight * start[k]
            found[-1 - j] = found[-1 - j] + (-1) ** (k - 1) * weight * end[k]
    found[highest] = end[0] - start[0] - sum(found)
    return np.stack(found)


def evaluate(coefficients: Array, s: Array) -> Array:
    """Evaluate the interpolant at s, shape (...); s broadcasts against the columns."""
    return np.asarray(polynomial.polyval(s, coefficients, tensor=False))


def derivative(coefficients: Array) -> Array:
    """Coefficients of the derivative with respect to s."""
    return polynomial.polyder(coefficients)


def maxima(coefficients: Array) -> Array:
    """Every s between 0 and 1 where one polynomial, shape (degree + 1,), has a maximum."""
    slope = derivative(np.asarray(coefficients, np.float64))
    zeros = polynomial.polyroots(polynomial.polytrim(slope))
    real = zeros.real[np.abs(zeros.imag) <= 1e-6]
    inside = real[(real > 0) & (real < 1)]
    return np.asarray(inside[polynomial.polyval(inside, polynomial.polyder(slope)) < 0])


def maximum(coefficients: Array) -> Array:
    """Return s in [0, 1] where polynomials that rise at 0 and fall at 1 are largest, (columns,).

    Newton's method on the derivative of ``coefficients``, shape (degree + 1, columns), kept inside
    a bracket that shrinks.
    """
    slope = derivative(coefficients)
    curvature = derivative(slope)
    low = np.zeros_like(slope[0])
    high = np.ones_like(low)
    s = (low + high) / 2
    for _ in range(50):
        value = evaluate(slope, s)
        rising = value > 0
        low, high = np.where(rising, s, low), np.where(rising, high, s)
        with np.errstate(divide="ignore", invalid="ignore"):
            newton = s - value / evaluate(curvature, s)
        inside = (newton >= low) & (newton <= high)
        following = np.where(inside, newton, (low + high) / 2)
        if np.all(np.abs(following - s) <= 1e-15):
            break
        s = following
    return np.asarray(following)


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
