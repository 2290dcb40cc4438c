"""Hertz's law against its own derivatives and integrals, taken numerically."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from hertzchain.scene import hertz

STIFFNESS, OVERLAP = 1.41e10, 3e-6
FORCE = hertz.force_of(STIFFNESS, OVERLAP)

ROUNDED = 1e-14
"""A few operations and powers, each right to 2.2e-16."""


def test_the_overlap_of_a_force_has_that_force() -> None:
    forces = np.geomspace(1e-9, 1e9, 19)
    returned = hertz.force_of(STIFFNESS, hertz.overlap_of(STIFFNESS, forces))
    np.testing.assert_allclose(returned, forces, rtol=ROUNDED)


def test_granules_apart_exert_no_force() -> None:
    assert hertz.force_of(STIFFNESS, np.array([-1e-3, 0.0])).tolist() == [0.0, 0.0]


def test_the_slope_is_the_derivative_of_the_force() -> None:
    step = 1e-5 * OVERLAP
    rise = np.diff(hertz.force_of(STIFFNESS, OVERLAP + np.array([-step, step])))
    # Central differences: 1e-10 / 24 by the third derivative, 1e-11 by round-off.
    assert rise[0] / (2 * step) == pytest.approx(hertz.slope_of(STIFFNESS, FORCE), rel=1e-10)


def test_the_energy_is_the_integral_of_the_force() -> None:
    work, error = quad(lambda overlap: hertz.force_of(STIFFNESS, overlap), 0, OVERLAP, epsrel=1e-12)
    assert abs(work - hertz.energy_of(FORCE, OVERLAP)) <= 3 * error + ROUNDED * work


def test_two_granules_that_meet_press_one_another_by_the_impact_force() -> None:
    mass, velocity = 3.6e-3, 0.7

    def motion(_: float, state: np.ndarray) -> list[float]:
        return [state[1], -float(hertz.force_of(STIFFNESS, state[0])) / mass]

    def stands(_: float, state: np.ndarray) -> float:
        return float(state[1])

    stands.terminal = True  # type: ignore[attr-defined]
    run = solve_ivp(motion, (0, 1), [0, velocity], "DOP853", events=stands, rtol=1e-12, atol=1e-20)
    highest = hertz.force_of(STIFFNESS, run.y[0, -1])
    # 1e-12 a step, some hundred steps.
    assert highest == pytest.approx(hertz.impact_force(STIFFNESS, mass, velocity), rel=1e-9)


def test_equal_spheres_are_two_spheres() -> None:
    radius, modulus, nu = 4.75e-3, 193e9, 0.3
    equals = hertz.stiffness_of_equals(radius, modulus, nu)
    plane = hertz.plane_modulus(modulus, nu)
    assert equals == pytest.approx(hertz.stiffness_of(radius / 2, plane / 2), rel=ROUNDED)
