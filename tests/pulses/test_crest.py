"""F0 of noisy recordings: no bias, scatter as is said, and rows that have it."""

from __future__ import annotations

import numpy as np
import pytest

from hertzchain.arrays import FloatArray
from hertzchain.pulses.corners import crest_of, impulse_of, reduce, with_crest
from hertzchain.pulses.measured import Value, measured_pulse
from hertzchain.pulses.noise import Noise
from hertzchain.pulses.recording import Recording
from hertzchain.pulses.signal import pulse_of

FORCE, DURATION = 60.0, 90e-6  # F0 [N], length [s]
DIGIT = 0.390625  # of the oscilloscope: 1.5625 mV of 0.25 N each [N]


def shape(name: str, part: FloatArray) -> FloatArray:
    """Force over F0, over the part of the length that is past."""
    part = np.clip(part, 0, 1)
    sine: FloatArray = np.sin(np.pi * part)
    if name == "sine":
        return sine
    if name == "triangle":
        found: FloatArray = np.minimum(part / 0.4, (1 - part) / 0.6)
        return found
    return sine**2


def said(name: str, seed: int) -> Value:
    """F0 that is said of a recording with noise of 1.25 % and digits."""
    random = np.random.default_rng(seed)
    clock = np.arange(-40e-6, 260e-6, 0.2e-6)
    force = FORCE * shape(name, clock / DURATION) + random.normal(0, 0.75, clock.size)
    recording = Recording(clock, np.round(force / DIGIT) * DIGIT, 1.0, ())
    found = measured_pulse(recording, pulse_of(recording))
    assert max(found.table.force) == found.peak_force.value
    return found.peak_force


def test_noise_does_not_raise_f0() -> None:
    """The largest of the corners of least squares was 0.35 N above it."""
    errors = np.array([said("sine squared", seed).value for seed in range(8)]) - FORCE
    # Three standard deviations of a mean of eight that scatter by 0.13 N.
    assert abs(errors.mean()) < 3 * 0.13 / np.sqrt(8)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["sine squared", "sine"])
def test_f0_scatters_as_is_said(name: str) -> None:
    found = [said(name, seed) for seed in range(100, 200)]
    off = np.array([(one.value - FORCE) / one.deviation for one in found])
    for within, part in ((1.0, 0.683), (2.0, 0.954)):
        # Four standard deviations of a count in 100 recordings; ± itself is known to 13 %.
        assert np.mean(np.abs(off) < within) > part - 4 * np.sqrt(part * (1 - part) / 100)
    assert np.sqrt(np.mean(off**2)) > 0.6  # nor is ± much too large


@pytest.mark.parametrize("bend", [0.02, 0.2, 2.0])
def test_rows_have_the_crest_and_the_impulse(bend: float) -> None:
    clock = np.arange(0.0, DURATION, 0.2e-6)
    force = FORCE * shape("sine squared", clock / DURATION)
    noise = Noise(0.0, 0.0, np.zeros(0))
    corners = reduce(clock, force, bend, noise)
    crest = crest_of(clock, force, corners, 0.02, noise)
    assert crest is not None
    assert crest.force == pytest.approx(FORCE, abs=0.02)
    assert crest.time == pytest.approx(DURATION / 2, abs=0.2e-6)
    found = with_crest(corners, crest)
    assert found.force.max() == crest.force
    assert np.all(np.diff(found.time) > 0)
    # Sums of 450 products.
    assert impulse_of(found.time, found.force) == pytest.approx(impulse_of(clock, force), rel=1e-12)


@pytest.mark.parametrize("deviation", [0.0, 0.2])
def test_the_tip_of_a_triangle_is_left_to_lines(deviation: float) -> None:
    clock = np.arange(0.0, DURATION, 0.2e-6)
    force = FORCE * shape("triangle", clock / DURATION)
    force += np.random.default_rng(1).normal(0, deviation, clock.size)
    noise = Noise(deviation, deviation * np.sqrt(0.2e-6), np.zeros(0))
    corners = reduce(clock, force, 0.02, noise)
    assert crest_of(clock, force, corners, 0.02, noise) is None
    assert with_crest(corners, None) is corners
    # A corner between lines of 30 samples or more each.
    assert corners.force.max() == pytest.approx(FORCE, abs=0.02 + deviation)
