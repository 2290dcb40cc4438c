"""Few corners keep impulse, tips and peaks of a pulse."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.pulses.corners import corners_of, heights
from hertzchain.pulses.noise import Noise
from hertzchain.scene.pulse import profile_named
from tests.conftest import STEEL

NONE = Noise(0.0, 0.0)


def reduced(
    time: FloatArray, force: FloatArray, bend: float, noise: Noise = NONE
) -> tuple[FloatArray, FloatArray]:
    """Times and forces of the corners."""
    places = corners_of(time, force, bend, noise)
    return time[places], heights(time, force, places)


def sampled(profile: str, momentum_ratio: float) -> tuple[hc.Scene, FloatArray, FloatArray]:
    """A scene with a pulse, and 2000 samples of its force."""
    pulse = hc.Pulse(profile_named(profile), 100.0, 3.0, momentum_ratio=momentum_ratio)
    scene = hc.Scene(hc.Chain(20, **STEEL), pulse)
    time = np.linspace(0, scene.pulse_end, 2000)
    force = scene.applied_force(time)
    return scene, time, np.append(force[:-1], 0.0)


@pytest.mark.parametrize("momentum_ratio", [0.1, 1.0, 10.0])
@pytest.mark.parametrize("profile", ["cosine", "triangular", "cosine-triangular"])
def test_peaks_stay_within_the_wanted_accuracy(profile: str, momentum_ratio: float) -> None:
    scene, time, force = sampled(profile, momentum_ratio)
    expected = hc.Native(rtol=1e-6).run(scene).peak_force
    rows = []
    for wanted in (1e-2, 1e-3):
        clock, few = reduced(time, force, wanted / 3 * 100.0)
        table = hc.PulseTable(tuple(clock), tuple(few))
        found = hc.Native(rtol=1e-6).run(replace(scene, shock=table)).peak_force
        np.testing.assert_allclose(found, expected, rtol=wanted)
        rows.append(clock.size)
    assert 3 <= rows[0] <= rows[1] <= 80


def test_lines_keep_the_impulse_and_the_first_moment() -> None:
    _, time, force = sampled("cosine", 1.0)
    force = force + 50.0  # that no corner would be below 0, which is set to it
    for bend in (10.0, 1.0, 0.1):
        line = np.interp(time, *reduced(time, force, bend))
        for weight in (np.ones_like(time), time / time[-1]):
            moment = np.trapezoid((line - force) * weight, time)
            assert abs(moment) < 1e-12 * np.trapezoid(force, time)


def test_corners_that_would_be_negative_keep_the_impulse() -> None:
    _, time, force = sampled("cosine", 1.0)
    clock, few = reduced(time, force, 10.0)
    assert few.min() == 0
    impulse = np.trapezoid(force, time)
    assert np.trapezoid(few, clock) == pytest.approx(impulse, rel=1e-12)


def test_straight_lines_are_found_again() -> None:
    """Noise of 0.01 N moves a corner by about its size over the change of slope."""
    corners = np.array([0.0, 0.2, 0.5, 0.6, 1.0])
    high = np.array([0.0, 100.0, 60.0, 80.0, 0.0])
    time = np.linspace(0, 1, 1001)
    force = np.interp(time, corners, high)
    clock, few = reduced(time, force, 0.1)
    assert clock.tolist() == corners.tolist()
    np.testing.assert_allclose(few, high, atol=1e-10)
    deviation = 0.01
    other = np.maximum(force + np.random.default_rng(1).normal(0, deviation, 1001), 0)
    clock, few = reduced(time, other, 0.1, Noise(deviation, deviation * np.sqrt(1e-3)))
    np.testing.assert_allclose(clock, corners, atol=2e-3)
    np.testing.assert_allclose(few, high, atol=0.2)


def test_a_tip_of_little_impulse_is_not_cut_off() -> None:
    time = np.linspace(0, 1, 1001)
    tip = np.maximum(0, 1 - np.abs(time - 0.5) / 0.003)
    clock, few = reduced(time, 100 * (1 - np.abs(2 * time - 1)) + tip, 0.1)
    assert few.max() == pytest.approx(101.0, abs=0.3)
    bare, _ = reduced(time, 100 * (1 - np.abs(2 * time - 1)), 0.1)
    assert clock.size > bare.size == 3


def test_noise_is_not_followed() -> None:
    generator = np.random.default_rng(5)
    time = np.linspace(0, 1, 2000)
    force = 100 * np.sin(np.pi * time) ** 2
    step = time[1]
    followed = []
    for deviation in (0.0, 1.0):
        noise = Noise(deviation, deviation * np.sqrt(step))
        noisy = np.maximum(force + generator.normal(0, 1, 2000), 0)
        followed.append(corners_of(time, noisy, 0.1, noise).size)
    assert followed[0] > 250
    assert followed[1] < 40
