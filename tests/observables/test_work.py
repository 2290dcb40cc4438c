"""Work of the applied force against integrals done by hand, by polynomials and by SciPy."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.polynomial import Polynomial
from scipy.integrate import quad

from hertzchain.arrays import Array
from hertzchain.observables.damped_law import DampedLaw
from hertzchain.observables.peaks import PeakWatch
from hertzchain.observables.samples import Samples
from hertzchain.observables.work import work_done
from hertzchain.scene.ramp import Ramp


def samples_of(first: Callable[[Array, int], Array], time: Array, jerk: bool = True) -> Samples:
    """Samples of two granules; ``first`` is the k-th derivative of the displacement of the first.

    The second moves otherwise and must not count.
    """

    def granules(k: int) -> Array:
        return np.stack([np.broadcast_to(first(time, k), time.shape), np.cos(time + k)], axis=1)

    apart = np.full((time.size, 1), -1.0, time.dtype)
    return Samples(
        time=time,
        displacement=granules(0),
        velocity=granules(1),
        acceleration=granules(2),
        overlap=apart,
        contact_force=np.zeros_like(apart),
        jerk=granules(3) if jerk else None,
    )


def polynomial_motion(displacement: Polynomial) -> Callable[[Array, int], Array]:
    return lambda time, k: np.asarray((displacement.deriv(k) if k else displacement)(time))


terms = st.floats(-1.0, 1.0)


@pytest.mark.parametrize(("jerk", "degree"), [(False, 5), (True, 7)])
@given(data=st.data(), first=terms, last=terms)
@settings(deadline=None, max_examples=50)
def test_linear_ramp_times_polynomial_velocity_is_exact(
    jerk: bool, degree: int, data: st.DataObject, first: float, last: float
) -> None:
    """The interpolant meets the displacement, and four Gauss points meet degree seven."""
    displacement = Polynomial(data.draw(st.lists(terms, min_size=degree + 1, max_size=degree + 1)))
    start, end = 0.2, 1.4
    force = Polynomial([first, (last - first)])(Polynomial([-start, 1.0]) / (end - start))
    antiderivative = (force * displacement.deriv()).integ()
    time = start + (end - start) * np.array([0.0, 0.1, 0.45, 0.7, 1.0])
    work = work_done(
        samples_of(polynomial_motion(displacement), time, jerk),
        Ramp(start, end, first, last, "linear"),
    )
    # Velocities up to 7 * 1.4^6 / 0.4 = 130 from a basis of size up to 84.
    expected = antiderivative(end) - antiderivative(start)
    assert work == pytest.approx(expected, rel=0, abs=1e-12)


@pytest.mark.parametrize(("jerk", "order"), [(False, 6), (True, 8)])
def test_cosine_ramp_vs_scipy(jerk: bool, order: int) -> None:
    ramp = Ramp(0.5, 3.5, 0.2, 1.0, "cosine")

    def power(t: float) -> float:
        return (0.2 + 0.4 * (1 - math.cos(math.pi * (t - 0.5) / 3))) * math.cos(t)

    exact, _ = quad(power, 0.5, 3.5, epsabs=1e-14, epsrel=1e-13)

    def error(intervals: int) -> float:
        time = np.linspace(0.5, 3.5, intervals + 1)
        motion = samples_of(lambda t, k: np.sin(t + k * np.pi / 2), time, jerk)
        return abs(float(work_done(motion, ramp)) - exact)

    # Intervals of 0.05: far below the work of order 1.
    assert error(60) < 1e-12
    # The order of the interpolated displacement; the four Gauss points have 8.
    assert math.log2(error(3) / error(6)) == pytest.approx(order, abs=0.5)


@pytest.mark.parametrize("samples", [11, 12, 17, 31])
def test_impulse_of_a_bounce_off_a_wall(samples: int) -> None:
    """The wall is touched from 0.37 to 2.37, which are no times of samples."""
    time = np.linspace(0.0, 3.0, samples)
    passed = time - 1.37
    overlap = 1 - passed**2
    columns = overlap, -2 * passed, np.full_like(time, -2.0), np.zeros_like(time)
    still = np.zeros_like(time)
    displacement, velocity, acceleration, jerk = (np.stack([still, c], axis=1) for c in columns)
    seen = Samples(
        time=time,
        displacement=displacement,
        velocity=velocity,
        acceleration=acceleration,
        overlap=np.stack([np.full_like(time, -1.0), overlap], axis=1),
        contact_force=np.stack([still, np.maximum(overlap, 0.0) ** 1.5], axis=1),
        jerk=jerk,
    )
    # Integral of (1 - s^2)^(3/2) from -1 to 1. An opening just outside an interval leaves most:
    # 9e-7 of the whole.
    watch = PeakWatch(DampedLaw.of_elastic(np.ones(2)), np.ones(2), on_held=[0, 1])
    watch.update(seen)
    assert watch.wall_impulse == pytest.approx(3 * math.pi / 8, rel=1.5e-6, abs=0)
