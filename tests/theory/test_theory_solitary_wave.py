"""The exact solitary wave against its own equation, known digits and a simulation."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline

import hertzchain as hc
from hertzchain.theory import solitary_wave as exact
from tests.conftest import STEEL

WAVE = exact.solitary_wave()
MIDDLE = WAVE.x.size // 2
PER_GRANULE = round(1 / (WAVE.x[1] - WAVE.x[0]))


@pytest.mark.parametrize(
    ("value", "digits"),
    [
        (WAVE.speed, "0.905515776419"),
        (WAVE.shift, "1.104342989975"),
        (WAVE.force_integral, "1.495972296330"),
        (WAVE.momentum, "1.652066518648"),
        (exact.speed_coefficient(), "0.6886728470"),
        (exact.momentum_coefficient(), "4.3445078540"),
    ],
)
def test_known_digits(value: float, digits: str) -> None:
    decimals = len(digits.split(".")[1])
    assert f"{value:.{decimals}f}" == digits


@pytest.mark.parametrize("x", [-2.0, 0.0, 0.25, 0.5, 1.0, 1.5, 3.0])
def test_wave_solves_its_equation(x: float) -> None:
    """c^2 r(x) against the integral of Lambda(x - y) r(y)^(3/2), on Gauss points off the grid.

    A spline of degree 11 and Gauss quadrature on either side of the kernel's corner: no Fourier
    transform.
    """
    force = make_interp_spline(WAVE.x, WAVE.overlap**1.5, k=11)
    nodes, weights = np.polynomial.legendre.leggauss(30)
    integral = 0.0
    for start in (x - 1, x):
        y = start + (nodes + 1) / 2
        integral += float(np.sum(weights / 2 * (1 - np.abs(x - y)) * force(y)))
    here = WAVE.overlap[MIDDLE + round(x * PER_GRANULE)]
    # Ten roundings of a number of order 1.
    assert integral == pytest.approx(WAVE.speed**2 * here, rel=0, abs=2e-15)


def test_wave_has_height_1_in_the_middle_and_is_symmetric() -> None:
    assert WAVE.x[MIDDLE] == 0.0
    ahead, behind = WAVE.overlap[MIDDLE:], WAVE.overlap[MIDDLE:0:-1]
    # The iteration stops at changes of 1e-15.
    assert WAVE.overlap[MIDDLE] == pytest.approx(1.0, rel=0, abs=1e-15)
    assert ahead == pytest.approx(behind, rel=0, abs=1e-15)


def test_force_integral_vs_the_quadrature_of_a_spline() -> None:
    area = make_interp_spline(WAVE.x, WAVE.overlap**1.5, k=11).integrate(-8.0, 8.0)
    # Both are spectrally accurate; a few dozen roundings.
    assert float(area) == pytest.approx(WAVE.force_integral, rel=1e-14, abs=0)


def test_speed_of_the_papers_steel_at_100_N() -> None:
    chain = hc.Chain(60, **STEEL)
    printed = 0.6886728470 * (193e9 / (4.75e-3 * 0.91 * 7958.0**1.5)) ** (1 / 3) * 100 ** (1 / 6)
    # Ten digits of the coefficient are given.
    assert exact.speed(chain, 100.0) == pytest.approx(printed, rel=1e-10, abs=0)
