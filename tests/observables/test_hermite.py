"""Two-point Hermite interpolation against polynomials, the sine and known maxima."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.polynomial import Polynomial
from scipy.optimize import minimize_scalar

from hertzchain.arrays import Array, FloatArray
from hertzchain.observables import hermite

PRECISIONS = (np.float64, np.longdouble)


def interpolant(function: list[Any], start: float, h: float) -> FloatArray:
    """Coefficients for a function given with its derivatives."""
    first, last = ([np.array(f(t)) for f in function] for t in (start, start + h))
    return np.asarray(hermite.coefficients(first, last, np.array(h)), np.float64)


def sine(derivatives: int) -> list[Any]:
    return [lambda t, k=k: np.sin(t + k * np.pi / 2) for k in range(derivatives + 1)]


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


@pytest.mark.parametrize("m", [1, 2, 3])
def test_ends_have_value_and_derivatives(m: int) -> None:
    function, start, h = sine(m), 0.3, 0.7
    curve: Array = interpolant(function, start, h)
    for k in range(m + 1):
        for s in (0.0, 1.0):
            # Roundings of the basis, up to 84, times the factor of the third derivative, 7!/4!.
            expected = pytest.approx(h**k * function[k](start + s * h), rel=0, abs=2e-12)
            assert float(hermite.evaluate(curve, np.array(s))) == expected
        curve = hermite.derivative(curve)


# Maxima

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
    found = hermite.maximum(curve_with_slope(slope, dtype))
    # Coefficients up to 9 in double precision, over a steepness of at least 0.01.
    assert float(found[0]) == pytest.approx(peak, rel=0, abs=1e-12)


@given(data=st.data())
@settings(max_examples=50)
def test_maximum_of_a_bump_vs_scipy(data: st.DataObject) -> None:
    """The septic that meets a cosine bump, as PeakWatch uses it."""
    width, peak = data.draw(st.floats(0.05, 1.4)), data.draw(positions)
    start = -peak * width
    cosine = [lambda t, k=k: np.cos(t + k * np.pi / 2) for k in range(4)]
    curve = interpolant(cosine, start, width)[:, None]
    found = hermite.maximum(curve)

    def below(s: float) -> float:
        return -float(hermite.evaluate(curve, np.array([s]))[0])

    scipy = minimize_scalar(below, bounds=(0.0, 1.0), method="bounded", options={"xatol": 1e-9})
    # A maximum is flat: values agree to round-off, positions to its root over the width.
    assert -below(float(found[0])) >= -float(scipy.fun) - 1e-15
    assert -below(float(found[0])) == pytest.approx(-float(scipy.fun), rel=0, abs=1e-14)
    assert float(found[0]) == pytest.approx(float(scipy.x), rel=0, abs=1e-8 + 3e-8 / width)


def test_maxima_at_the_very_ends_are_found() -> None:
    curve = np.array([[0.0, 0.0, 0.0], [1e-12, 2.0, 2 - 1e-12], [-1.0, -1.0, -1.0]])
    # Roundings of 1 only: a parabola has its maximum at half its slope.
    assert hermite.maximum(curve) == pytest.approx([5e-13, 1.0, 1 - 5e-13], rel=0, abs=1e-15)


# What tells whether there is a maximum at all


@given(data=st.data())
@settings(max_examples=50)
def test_increments_are_those_of_bernstein_coefficients(data: st.DataObject) -> None:
    coefficients = [data.draw(numbers) for _ in range(8)]
    curve, h = Polynomial(coefficients), data.draw(st.floats(0.1, 2.0))
    ends = [[np.array(curve.deriv(k)(t)) for k in range(4)] for t in (0.0, h)]
    ends = [[np.array(curve(t)), *rest[1:]] for t, rest in zip((0.0, h), ends, strict=True)]
    found = hermite.increments(ends[0], ends[1], np.array(h))
    values = curve(np.linspace(0, h, 200))
    scale = 1e-12 * (1 + np.sum(np.abs(coefficients)) * max(1, h) ** 7)
    assert float(found.sum()) == pytest.approx(curve(h) - curve(0), rel=0, abs=scale)
    reach = np.concatenate([[0.0], np.cumsum(found)])
    assert values.max() - curve(0) <= reach.max() + scale
    assert values.min() - curve(0) >= reach.min() - scale
    # No more turns than changes of sign, where rounding does not make them.
    rising = np.diff(values)
    rising = rising[np.abs(rising) > scale]
    clear = found[np.abs(found) > scale]
    assert np.count_nonzero(np.diff(np.sign(rising))) <= np.count_nonzero(np.diff(np.sign(clear)))


def test_maxima_of_a_polynomial() -> None:
    slope = Polynomial.fromroots([0.25, 0.5, 0.875, -1.0, 2.0]) * Polynomial([-1.0, 0.0, -1.0])
    curve = np.asarray(slope.integ().coef, np.float64)
    assert hermite.maxima(curve) == pytest.approx([0.5], rel=0, abs=1e-10)
    assert np.sort(hermite.maxima(-curve)) == pytest.approx([0.25, 0.875], rel=0, abs=1e-10)
    assert hermite.maxima(np.array([1.0, 1.0, 0.0, 0.0])).size == 0
