"""The polynomial of a step with given value and derivatives at both ends, compiled."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from hertzchain.observables.compiling import part

_BINOMIAL = (1.0, 6.0, 15.0, 20.0, 15.0, 6.0, 1.0)


@part
def hertz_force(r: float) -> float:
    """Force of an overlap, at stiffness 1."""
    return r * math.sqrt(r) if r > 0 else 0.0


@part
def hertz_force_rate(r: float, rate: float) -> float:
    """Rate of that force."""
    return 1.5 * math.sqrt(r) * rate if r > 0 else 0.0


@part
def hermite(start: Any, end: Any, h: float) -> Any:
    """Coefficients in s = (t - t_start) / h of the polynomial of degree 7 that meets both ends."""
    x, p, q, c = np.float64(start[0]), start[1] * h, start[2] * h * h / 2, start[3] * h**3 / 6
    # Differences at the end from the cubic of the start, in value and three derivatives.
    d = end[0] - x - p - q - c
    d1 = end[1] * h - p - 2 * q - 3 * c
    d2 = end[2] * h * h - 2 * q - 6 * c
    d3 = end[3] * h**3 - 6 * c
    return (
        x, p, q, c,
        35 * d - 15 * d1 + 2.5 * d2 - d3 / 6,
        -84 * d + 39 * d1 - 7 * d2 + d3 / 2,
        70 * d - 34 * d1 + 6.5 * d2 - d3 / 2,
        -20 * d + 10 * d1 - 2 * d2 + d3 / 6,
    )  # fmt: skip


@part
def quintic(u0: Any, v0: Any, a0: Any, u1: Any, v1: Any, a1: Any, h: float) -> Any:
    """Coefficients of the polynomial of degree 5 that meets value and two derivatives."""
    p, b = v0 * h, a0 * h * h / 2
    d = u1 - u0 - p - b
    d1 = v1 * h - p - 2 * b
    d2 = a1 * h * h - 2 * b
    return (
        u0, p, b,
        10 * d - 4 * d1 + d2 / 2,
        -15 * d + 7 * d1 - d2,
        6 * d - 3 * d1 + d2 / 2,
        0.0, 0.0,
    )  # fmt: skip


@part
def value_at(c: Any, s: float) -> float:
    """Value of a polynomial of degree 7 at s."""
    return c[0] + s * (
        c[1] + s * (c[2] + s * (c[3] + s * (c[4] + s * (c[5] + s * (c[6] + s * c[7])))))
    )


@part
def slope_at(c: Any, s: float) -> float:
    """Its first derivative with respect to s."""
    return c[1] + s * (
        2 * c[2] + s * (3 * c[3] + s * (4 * c[4] + s * (5 * c[5] + s * (6 * c[6] + s * 7 * c[7]))))
    )


@part
def curvature_at(c: Any, s: float) -> float:
    """Its second derivative with respect to s."""
    return 2 * c[2] + s * (
        6 * c[3] + s * (12 * c[4] + s * (20 * c[5] + s * (30 * c[6] + s * 42 * c[7])))
    )


@part
def _bernstein(c: Any, low: float, width: float, b: Any) -> None:
    """Bernstein coefficients of the slope from low to low + width, times width."""
    for k in range(7):
        b[k] = (k + 1) * c[k + 1]
    scale = width
    for k in range(7):
        for j in range(5, k - 1, -1):
            b[j] += low * b[j + 1]
        b[k] *= scale / _BINOMIAL[k]
        scale *= width
    for k in range(1, 7):
        for j in range(6, k - 1, -1):
            b[j] += b[j - 1]


@part
def is_monotone(c: Any, b: Any) -> bool:
    """Whether a polynomial of degree 7 surely rises or falls all the way from 0 to 1.

    ``b`` is room for coefficients, shape (7,).
    """
    _bernstein(c, 0.0, 1.0, b)
    rises = falls = True
    for k in range(7):
        rises, falls = rises and b[k] >= 0.0, falls and b[k] <= 0.0
    return rises or falls
