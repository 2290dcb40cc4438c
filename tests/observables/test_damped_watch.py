"""Dashpots that close at a speed: what samples before and after it tell of their force."""

from __future__ import annotations

import numpy as np
import pytest

from hertzchain.observables.curves import first_touch
from hertzchain.observables.damped_law import DampedLaw
from hertzchain.observables.peaks import PeakWatch
from hertzchain.observables.samples import Samples

ROUND_OFF = 1e-14


def test_first_touch_of_a_cubic_motion_is_exact() -> None:
    """-2 - t^2 / 2 + t^3 from 1 to 3."""
    exact = next(t.real for t in np.roots([1, -0.5, 0, -2]) if abs(t.imag) < ROUND_OFF)
    at_one = (np.array([-1.5]), np.array([2.0]), np.array([5.0]))
    later, speed, growth, doubt = first_touch(at_one, np.array([17.0]), np.array([2.0]))
    assert 1 + later[0] == pytest.approx(exact, rel=ROUND_OFF, abs=0)
    assert speed[0] == pytest.approx(3 * exact**2 - exact, rel=ROUND_OFF, abs=0)
    assert growth[0] == pytest.approx(6 * exact - 1, rel=ROUND_OFF, abs=0)
    assert doubt[0] == pytest.approx(12 * (exact - 1), rel=ROUND_OFF, abs=0)


def pushed_by_a_damper(t: float) -> tuple[float, float, float]:
    """Overlap, rate and acceleration of a sphere that a damper of rate 1 sets in motion."""
    return t - 1 + np.exp(-t) - 0.5, 1 - np.exp(-t), np.exp(-t)


TOUCH = 1.198290437315664
"""Where the overlap above is 0 (by Newton's method)."""


@pytest.mark.parametrize("offset", [0.2, 0.5, 0.8])
def test_the_speed_of_first_touch_is_of_third_order_and_within_its_bound(offset: float) -> None:
    assert abs(pushed_by_a_damper(TOUCH)[0]) < 1e-12
    errors = []
    for h in (0.2, 0.1, 0.05):
        begin = TOUCH - offset * h
        before = tuple(np.array([value]) for value in pushed_by_a_damper(begin))
        after = np.array([pushed_by_a_damper(begin + h)[2]])
        _, speed, _, doubt = first_touch(before, after, np.array([h]))
        errors.append(abs(speed[0] - pushed_by_a_damper(TOUCH)[1]))
        assert errors[-1] < doubt[0]
    order = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(np.abs(order - 3) < 0.3), order


@pytest.mark.parametrize("interval", [0.3, 1.0])
@pytest.mark.parametrize("offset", [0.0, 0.1, 0.5, 0.9])
def test_a_force_that_decays_faster_than_samples_come(interval: float, offset: float) -> None:
    """A sphere of mass 1 and speed 2 flies at a heavy one: the dashpot presses hardest at once."""
    damping, speed = 5.0, 2.0
    time = interval * (np.arange(4) - 1 - offset)
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
