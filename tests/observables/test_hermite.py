"""Two-point Hermite interpolation against polynomials, the sine and known maxima."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.polynomial import Polynomial

from hertzchain.arrays import FloatArray
from hertzchain.observables import hermite

PRECISIONS = (np.float64, np.longdouble)


def interpolant(function: list[Any], start: float, h: float) -> FloatArray:
    """Coefficients for a function given with its derivatives."""
    first, last = ([np.array(f(t)) for f in function] for t in (start, start + h))
    return np.asarray(hermite.coefficients(first, last, np.array(h)), np.float64)


numbers = st.floats(-1.0, 1.0)


@pytest.mark.parametrize("m", [1, 2, 3])
@given(data=st.data(), start=numbers, h=st.floats(0.1, 2.0))
@settings(max_examples=50)
def test_polynomials_up_to_degree_2m_plus_1_are_met(
    m: int, data: st.DataObject, start: float, h: float
) -> None:
    terms = data.draw(st.lists(numbers, min_size=2 * m + 2, max_size=2 * m + 2))
    polynomial = Polynomial(terms)
    curve = interpolant([polynomial.deriv(k) if k else polynomial for k in range(m + 1)], start, h)
    s = np.linspace(0.0, 1.0, 21)
    # Values and scaled derivatives go up to 1e5 (degree 7 at t = 3, third derivative times 2^3),
    # and the basis has coefficients up to 84.
    largest = np.abs(Polynomial(np.abs(terms))(abs(start) + h)) + 1
    tolerance = 1e-13 * (1 + h) ** m * math.factorial(2 * m + 1) * largest
    expected = polynomial(start + s * h)
    assert hermite.evaluate(curve[:, None], s) == pytest.approx(expected, rel=0, abs=tolerance)
