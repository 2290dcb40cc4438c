"""Maxima of forces within an interval against polynomials with known ones and SciPy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.polynomial import Polynomial

from hertzchain.arrays import Array
from hertzchain.observables.curves import Curves
from hertzchain.observables.damped_law import DampedLaw
from tests.observables.test_hermite import PRECISIONS, numbers


def maxima(overlap: Array) -> Array:
    """Places of the maxima of curves, (degree + 1, n), of elastic contacts, from 0 to 1."""
    ones = np.ones_like(overlap[0])
    law = DampedLaw.of_elastic(np.ones(1, overlap.dtype))
    return Curves(0 * ones, ones, np.zeros(ones.size, np.intp), overlap, ones, law).maxima()[1]


positions = st.floats(0.01, 0.99)


def curve_with_slope(slope: Polynomial, dtype: type[np.floating[Any]]) -> Array:
    """Coefficients, as one column, of a curve that starts at 1."""
    return np.array(slope.integ().coef + np.eye(1, slope.degree() + 2)[0], dtype)[:, None]


@pytest.mark.parametrize("dtype", PRECISIONS)
@given(peak=positions, a=numbers, b=numbers, c=numbers, d=numbers)
def test_maximum_of_a_sextic(
    dtype: type[np.floating[Any]], peak: float, a: float, b: float, c: float, d: float
) -> None:
    """Slope -(s - peak) times two positive parabolas: one maximum, at the peak."""
    slope = (
        Polynomial([peak, -1.0]) * (Polynomial([b, a]) ** 2 + 0.1) * (Polynomial([d, c]) ** 2 + 0.1)
    )
    found = maxima(curve_with_slope(slope, dtype))
    # Coefficients up to 9 in double precision, over a steepness of at least 0.01.
    assert float(found[0]) == pytest.approx(peak, rel=0, abs=1e-12)


def test_maxima_at_the_very_ends_are_found() -> None:
    curve = np.array([[1.0, 1.0, 1.0], [1e-12, 2.0, 2 - 1e-12], [-1.0, -1.0, -1.0]])
    # Roundings of 1 only: a parabola has its maximum at half its slope.
    assert maxima(curve) == pytest.approx([5e-13, 1.0, 1 - 5e-13], rel=0, abs=1e-15)


def test_maxima_of_a_polynomial() -> None:
    slope = Polynomial.fromroots([0.25, 0.5, 0.875, -1.0, 2.0]) * Polynomial([-1.0, 0.0, -1.0])
    curve = np.asarray(slope.integ().coef, np.float64)
    assert maxima(curve[:, None]) == pytest.approx([0.5], rel=0, abs=1e-10)
    assert np.sort(maxima(-curve[:, None])) == pytest.approx([0.25, 0.875], rel=0, abs=1e-10)
    assert maxima(np.array([[1.0], [1.0], [0.0], [0.0]])).size == 0
