"""Curves through samples: interpolation, first touches, and forces of damped contacts."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.polynomial import Polynomial
from scipy.integrate import quad

from hertzchain.arrays import FloatArray
from hertzchain.observables.observer import curvature_at, curve_of, slope_at, value_at
from hertzchain.observables.samples import DampedLaw, Samples, true_forces
from hertzchain.observables.watch import PeakWatch
from hertzchain.scene.schedule import Leg

numbers = st.floats(-1.0, 1.0)


@pytest.mark.parametrize("m", [2, 3])
@given(data=st.data(), start=numbers, h=st.floats(0.1, 2.0))
@settings(max_examples=50)
def test_polynomials_up_to_degree_2m_plus_1_are_met(
    m: int, data: st.DataObject, start: float, h: float
) -> None:
    terms = data.draw(st.lists(numbers, min_size=2 * m + 2, max_size=2 * m + 2))
    polynomial = Polynomial(terms)
    ends = [np.full(4, np.nan) for _ in range(2)]
    for values, time in zip(ends, (start, start + h), strict=True):
        values[: m + 1] = [polynomial(time), *(polynomial.deriv(k)(time) for k in range(1, m + 1))]
    curve = curve_of(*(tuple(values.tolist()) for values in ends), h)
    # Values and scaled derivatives go up to 1e5 (degree 7 at t = 3, third derivative times 2^3),
    # and the basis has coefficients up to 84.
    largest = np.abs(Polynomial(np.abs(terms))(abs(start) + h)) + 1
    tolerance = 1e-13 * (1 + h) ** m * math.factorial(2 * m + 1) * largest
    for s in np.linspace(0.0, 1.0, 21).tolist():
        slope, curvature = (polynomial.deriv(k)(start + s * h) * h**k for k in (1, 2))
        expected = polynomial(start + s * h), slope, curvature
        ours = value_at(curve, s), slope_at(curve, s), curvature_at(curve, s)
        assert ours == pytest.approx(expected, rel=0, abs=42 * tolerance)


LEG = Leg(1.0, 1.3, 3, None)
TIME = np.array([1.0, 1.1, 1.2, 1.3])
OVERLAP = np.array([[0.2], [0.5], [0.4], [0.1]])
RATE = np.array([3.0, 0.5, -1.0, -4.0])
GROWTH = np.array([-9.0, -20.0, -25.0, -30.0])
"""A contact that closes and opens, by the motion of the first of two granules."""


def law(exponent: float, attraction: bool) -> DampedLaw:
    return DampedLaw(np.array([7.0]), np.array([0.6]), exponent, attraction)


def samples(force: np.ndarray) -> Samples:
    def moves(values: np.ndarray) -> np.ndarray:
        return np.stack([values, np.zeros_like(values)], axis=1)

    return Samples(TIME, moves(OVERLAP[:, 0]), moves(RATE), moves(GROWTH), OVERLAP, force)


@pytest.mark.parametrize("attraction", [True, False])
@pytest.mark.parametrize("exponent", [0.0, 0.25, 0.5])
def test_forces_become_those_of_the_velocities_of_their_time(
    exponent: float, attraction: bool
) -> None:
    """At the start of a leg they are, as forces are computed again there."""
    damped = law(exponent, attraction)
    half = np.where(LEG.start < TIME, LEG.dt / 2, 0.0)
    given = damped.force(OVERLAP, (RATE - half * GROWTH)[:, np.newaxis])
    force = true_forces(samples(given), damped, LEG).contact_force
    right = damped.force(OVERLAP, RATE[:, np.newaxis])
    np.testing.assert_allclose(force, right, rtol=1e-14, atol=1e-14)
    assert force[0] == given[0]
    assert np.all(force[1:3] != given[1:3])


@pytest.mark.parametrize(("attraction", "pulls"), [(True, True), (False, False)])
def test_contacts_that_may_not_pull_do_not_in_a_softer_code(attraction: bool, pulls: bool) -> None:
    """The change from one velocity to the other is the law's own, of the full stiffness."""
    damped = law(0.25, attraction)
    softer = 0.1 * damped.force(OVERLAP, 0 * OVERLAP)
    force = damped.with_rate(softer, OVERLAP, 0 * OVERLAP, -4.0 + 0 * OVERLAP)
    assert bool(np.any(force < 0)) is pulls


@pytest.mark.parametrize("interval", [0.3, 1.0])
@pytest.mark.parametrize("offset", [0.0, 0.1, 0.5, 0.9])
def test_a_force_that_decays_faster_than_samples_come(interval: float, offset: float) -> None:
    """A sphere of mass 1 and speed 2 flies at a heavy one: the dashpot presses hardest at once."""
    damping, speed = 5.0, 2.0
    time = interval * (np.arange(4.0) - 1 - offset)
    later = np.maximum(time, 0.0)
    decay = np.exp(-damping * later)
    place = np.where(time < 0, speed * time, speed * (1 - decay) / damping)
    velocity = np.where(time < 0, speed, speed * decay)
    pressed = (time > 0) * 1.0
    law = DampedLaw(np.array([1e-99]), np.array([damping]), 0.0, attraction=False)
    displacement, rate, growth = (
        np.stack([values, 0 * values], axis=1)
        for values in (place, velocity, -damping * velocity * pressed)
    )
    force = (damping * velocity * pressed)[:, np.newaxis]
    watch = PeakWatch(law, np.array([1.0, 0.0]))
    watch.update(Samples(time, displacement, rate, growth, place[:, np.newaxis], force))
    assert watch.force[0] == pytest.approx(damping * speed, rel=1e-12, abs=0)
    assert abs(watch.time[0]) < 1e-12
    assert watch.reading_error < 0.3  # the quintic right after the jump overshoots, not the force
    # All kinetic energy is lost; the nodes of the integral do not resolve the decay fully.
    assert watch.dissipated == pytest.approx(speed**2 / 2, rel=0.1)


def samples_of(time: FloatArray, motion: tuple[FloatArray, ...], force: FloatArray) -> Samples:
    """Samples of two granules, of which the second rests; overlap and two derivatives."""
    place, velocity, acceleration = (np.stack([m, 0 * m], axis=1) for m in motion)
    overlap = motion[0][:, np.newaxis]
    return Samples(time, place, velocity, acceleration, overlap, force[:, np.newaxis])


def test_the_impulse_of_a_contact_that_only_pulls() -> None:
    """An overlap that shrinks at a steady rate under a dashpot stronger than the contact."""
    law = DampedLaw(np.array([1.0]), np.array([10.0]), 0.0, attraction=True)
    time = np.linspace(0.0, 2.0, 6)
    overlap, rate = 1.0 - 0.2 * time, np.full_like(time, -0.2)
    force = overlap**1.5 + 10.0 * rate
    assert np.all(force < 0)
    watch = PeakWatch(law, np.ones(2), on_held=[1])
    watch.update(samples_of(time, (overlap, rate, 0 * rate), force))
    # Integral of (1 - t / 5)^(3/2) - 2 from 0 to 2.
    assert watch.wall_impulse == pytest.approx(2 * (1 - 0.6**2.5) - 4, rel=1e-12, abs=0)
    assert watch.dissipated == pytest.approx(10 * 0.2**2 * 2, rel=1e-12, abs=0)
    assert watch.force[0] == 0


@pytest.mark.parametrize("exponent", [0.25, 0.5])
def test_the_energy_lost_from_a_touch_on(exponent: float) -> None:
    """An overlap of exactly 0 at the start, as of a striker that touches: sin(t), to its end."""
    law = DampedLaw(np.array([1.0]), np.array([1.0]), exponent, attraction=True)
    time = np.linspace(0.0, np.pi, 13)
    overlap, rate = np.sin(time), np.cos(time)
    overlap[0] = overlap[-1] = 0.0
    watch = PeakWatch(law, np.ones(2))
    watch.update(samples_of(time, (overlap, rate, -overlap), law.force(overlap, rate)))
    exact = quad(lambda t: np.sin(t) ** exponent * np.cos(t) ** 2, 0.0, np.pi)[0]
    assert watch.dissipated == pytest.approx(exact, rel=1e-5, abs=0)
