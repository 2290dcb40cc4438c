"""The pulse in a recording: baseline, noise, start, end, and negative samples."""

from __future__ import annotations

import numpy as np
import pytest

from hertzchain.arrays import FloatArray
from hertzchain.errors import HertzchainError
from hertzchain.pulses.pulse import _foot, averaged, left_out, pulse_of, without_negative
from hertzchain.pulses.recording import Noise, Recording, noise_before, noise_within, resolution_of
from tests.recordings import DURATION, FORCE, GAIN, OFFSET, START, sine_squared, times, volts

IMPULSE = FORCE * DURATION / 2  # [N s]
TIME = times(2000)
CLEAN = sine_squared(TIME)


def recording(force: FloatArray, newtons: float = 1.0) -> Recording:
    return Recording(times(force.size), force, newtons, ())


def noisy(samples: int = 2000, noise: float = 0.01, seed: int = 3) -> Recording:
    return recording(GAIN * volts(samples, noise, seed), GAIN)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_baseline_noise_start_and_end(seed: int) -> None:
    signal = pulse_of(noisy(seed=seed))
    assert 50 < signal.baseline_samples < 200  # those before the pulse
    # Four standard deviations of a mean and of a standard deviation of 50 samples of 1 N.
    assert abs(signal.baseline - GAIN * OFFSET) < 4 / np.sqrt(50)
    assert abs(signal.noise.deviation - 1.0) < 4 / np.sqrt(100)
    # Averages of 19 samples leave the noise at 5 / sqrt(19) = 1.1 N; noise may make that 2 N.
    late = DURATION / np.pi * np.arcsin(np.sqrt(0.02))
    assert START - 1e-6 < signal.start < START + late
    assert DURATION - 2 * late < signal.time[-1] < DURATION + 2e-6
    assert signal.time[0] == 0
    assert signal.force.min() >= 0
    # The baseline is off by 0.14 N, of a mean force of 50 N, and noise about 0 by less.
    assert np.trapezoid(signal.force, signal.time) == pytest.approx(IMPULSE, rel=4 * 0.14 / 50)


def test_a_clean_recording_keeps_every_sample() -> None:
    signal = pulse_of(recording(CLEAN))
    assert signal.noise.deviation == signal.baseline == 0
    inside = (signal.start <= TIME) & (signal.start + signal.time[-1] + 1e-12 >= TIME)
    # The first and the last samples, of less than 1e-7 N, are averages.
    np.testing.assert_allclose(signal.force, CLEAN[inside], atol=1e-6)
    assert signal.time.size < 1.04 * np.count_nonzero(CLEAN > 1e-6)
    assert signal.left_out == pytest.approx((0, 0), abs=1e-12)


def test_what_is_given_is_taken() -> None:
    read = noisy()
    signal = pulse_of(read, baseline=0.02, start=10e-6, end=40e-6)
    assert (signal.baseline, signal.baseline_samples) == (0.02 * GAIN, 0)
    inside = (read.time >= 10e-6) & (read.time <= 40e-6)
    assert signal.force[:-1].tolist() == (read.force[inside] - 0.02 * GAIN).tolist()
    before = read.time <= signal.start
    impulse = np.trapezoid(read.force[before] - 0.02 * GAIN, read.time[before])
    assert signal.left_out[0] == pytest.approx(impulse, rel=1e-12)


def test_a_recording_that_begins_with_its_pulse() -> None:
    read = noisy()
    inside = read.time > START
    signal = pulse_of(Recording(read.time[inside], read.force[inside], GAIN, ()))
    assert (signal.baseline, signal.baseline_samples) == (0, 0)
    assert "none taken off" in dict(signal.remarks)["baseline"]
    assert signal.noise.deviation == pytest.approx(1.0, rel=0.15)  # as samples scatter


def test_what_is_below_zero() -> None:
    """It adds no impulse where it is noise; a swing is set to zero, and remarked."""
    noise = np.random.default_rng(1).normal(0, 1, 100_000)
    clean = without_negative(noise, 101, 4.0)
    assert clean.min() == 0
    # 0.4 without averages, which have a tenth of the noise
    assert 0.03 < clean.mean() < 0.05
    assert without_negative(np.array([5.0, -1.0, 7.0]), 1, 0.0).tolist() == [5, 0, 7]
    swing = (TIME > 50e-6) & (TIME < 55e-6)
    signal = pulse_of(recording(np.where(swing, -30.0, noisy().force)))
    inside = np.abs(signal.time + signal.start - 52.5e-6) < 1.5e-6
    assert np.all(signal.force[inside] == 0)
    lowest = f"the lowest {-30.0 - signal.baseline:.3g} N: set to 0"
    assert lowest in dict(signal.remarks)["samples below 0"]


def test_noise_of_digits_and_of_what_is_no_digit() -> None:
    force = np.round(CLEAN / 0.5) * 0.5
    assert resolution_of(force) == pytest.approx(0.5, rel=1e-12)
    assert resolution_of(CLEAN[300:800]) == 0
    assert pulse_of(recording(force)).noise.deviation == pytest.approx(0.5 / np.sqrt(12))
    rectangle = pulse_of(recording(np.where((TIME > 0) & (TIME < 70e-6), FORCE, 0.0)))
    assert (rectangle.noise.deviation, rectangle.force.max()) == (0, FORCE)


def test_noise_that_hangs_together_counts_for_more() -> None:
    white = np.random.default_rng(1).normal(0, 1, 100_010)
    slow = averaged(white, 11)[:100_000] * np.sqrt(11)
    alone, together = (noise_before(samples, 1e-6, 0.0) for samples in (white, slow))
    assert together.deviation == pytest.approx(alone.deviation, rel=0.02)
    # Its integral has sqrt(11) times the spread; blocks of 316 samples see 98 % of it.
    assert together.density / alone.density == pytest.approx(np.sqrt(11), rel=0.1)
    means = slow.reshape(-1, 1000).mean(axis=1)
    # A deviation of 100 means is known to 7 %.
    assert together.of_mean(1000, 1e-6) == pytest.approx(means.std(), rel=0.25)
    assert noise_within(white, 1e-6, 0.0).deviation == pytest.approx(1, rel=0.02)


def two_pulses(height: float, distance: float = 90e-6, noise: float = 0.5) -> Recording:
    """A pulse of a height and, later, one of F0, under noise of a standard deviation [N]."""
    clock = np.linspace(-20e-6, 200e-6, 2000)
    force = height / FORCE * sine_squared(clock) + sine_squared(clock - distance)
    force += np.random.default_rng(5).normal(0, noise, clock.size)
    return Recording(clock, force, 1.0, ())


def begun_late(after: float, offset: float = 4.5) -> Recording:
    """A recording, with an offset [N], that begins at a part of its pulse."""
    read = noisy()
    inside = read.time > START + after * DURATION
    force = read.force[inside] - GAIN * OFFSET + offset
    return Recording(read.time[inside], force, 1.0, ())


def away(off: float) -> Recording:
    """A recording that drifts after its pulse; 1 N is a hundredth of F0."""
    return recording(CLEAN + np.interp(TIME, [100e-6, 160e-6], [0, off]))


def cut(equal: int) -> Recording:
    """A recording with as many equal largest samples."""
    force = noisy().force
    return recording(np.minimum(force, np.sort(force)[-equal]))


def spiked() -> Recording:
    """A recording with two spikes after the pulse."""
    force = noisy().force.copy()
    force[[1200, 1500]] = 3 * FORCE, -3 * FORCE
    return recording(force)


AROUND = {"start": START - 1e-6, "end": START + DURATION}
OUTCOMES: list[tuple[Recording, dict[str, float], str]] = [
    (recording(-sine_squared(times(500))), {}, "pulls; a pulse pushes: turn it with --scale"),
    (recording(np.ones(500)), {}, "all forces are equal"),
    (recording(np.random.default_rng(1).normal(0, 0.5, 500)), {}, "out of the noise, 0.4"),
    (noisy(), {"start": 1.0}, "--start = 1.0: must be a time of the file, -2e-05 to 0.00016 s"),
    (noisy(), {"baseline": float("nan")}, "--baseline = nan: must be a finite number"),
    (noisy(), {"end": -1.0}, "--end = -1.0: must be a time of the file"),
    (noisy(), {"start": 31.9e-6, "end": 32.2e-6}, "s, a pulse needs 8"),
    (noisy(), {"start": 50e-6, "end": 10e-6}, "there are 0 samples from 5"),
    # Another pulse before the largest is no baseline, but what is hardly above the noise is.
    *((two_pulses(height), {}, "e-05 s, comes before the largest") for height in (7.0, 60.0)),
    (two_pulses(3.0), {}, ""),
    (two_pulses(5.5, noise=5.0), {}, ""),
    (spiked(), {"start": START - 1e-6}, "pulls"),
    (spiked(), AROUND, ""),
    (away(0.9), {}, ""),
    (away(1.1), {}, "the recording ends +1.1 N from its baseline"),
    (away(-1.1), {}, "the recording ends -1.1 N from its baseline"),
    (away(1.1), {"end": START + DURATION}, ""),
    (cut(4), {}, ""),
    (cut(5), {}, "5 samples have the largest force"),
    (cut(200), {}, "200 samples have the largest force"),
    (begun_late(0.05), {}, "N from 0, as no baseline is taken off: say with --baseline"),
    (begun_late(0.15), {}, "N from 0, as no baseline is taken off: say with --baseline"),
    (begun_late(0.15), {"baseline": 4.5}, ""),
    (begun_late(0.15), {"baseline": 0.0}, "the recording ends +4."),
    *((begun_late(after), {}, "begins in its pulse, say with --baseline") for after in (0.26, 0.6)),
]


@pytest.mark.parametrize(("read", "given", "words"), OUTCOMES)
def test_doubts_are_said_and_nothing_else(
    read: Recording, given: dict[str, float], words: str
) -> None:
    try:
        said = "; ".join(pulse_of(read, **given).warnings)
    except HertzchainError as problem:
        said = str(problem)
    assert words in said
    assert bool(words) == bool(said)


def test_what_is_given_in_doubt_is_used() -> None:
    """Both pulses, a pulse without the spikes after it, and one that begins at its crest."""
    both = pulse_of(two_pulses(60.0), start=-3e-6, end=165e-6)
    assert abs(both.baseline) < 4 * 0.5 / np.sqrt(100)
    # The baseline is off by 0.05 N, of a mean force of 25 N or more.
    assert np.trapezoid(both.force, both.time) == pytest.approx(1.6 * IMPULSE, rel=0.01)
    signal, clean = pulse_of(spiked(), **AROUND), pulse_of(recording(noisy().force), **AROUND)
    assert signal.force.tolist() == clean.force.tolist()
    assert signal.baseline == clean.baseline
    late = pulse_of(begun_late(0.6), baseline=4.5)
    # Five standard deviations of a sample, of 1 N each.
    assert late.force.max() == pytest.approx(FORCE * np.sin(np.pi * 0.6) ** 2, abs=5)


@pytest.mark.parametrize(
    ("left", "deviation", "is_said"),
    [(0.9, 0.0, False), (1.1, 0.0, True), (-1.1, 0.0, True), (1.1, 0.23, False), (1.1, 0.21, True)],
)
def test_a_hundredth_of_the_impulse_after_the_pulse_is_said(
    left: float, deviation: float, is_said: bool
) -> None:
    """Unless five deviations of the mean force [N] explain it."""
    said = left_out(np.array([2.0, 3.0]), left, 100.0, Noise(0.0, 0.0), deviation)
    assert (said is not None) == is_said
    assert not is_said or "1.1% of the impulse is left out, as after the pulse" in str(said)


@pytest.mark.parametrize("noise", [0.0, 0.001, 0.05])
@pytest.mark.parametrize("digit", [1e-6, 1.0])
def test_noise_and_digits_alone_are_no_drift_and_no_cut_off_top(noise: float, digit: float) -> None:
    for seed in range(10):
        force = np.round(noisy(noise=noise, seed=seed).force / digit) * digit
        assert pulse_of(recording(force)).warnings == ()


@pytest.mark.parametrize("samples", [300, 3000])
@pytest.mark.parametrize("bits", [9, 12])
def test_a_crest_of_more_digits_than_samples_is_not_cut_off(samples: int, bits: int) -> None:
    """Too few samples for the digit: 1 in 70 such crests was taken for a top that is cut off."""
    digit = 2 * FORCE / 2**bits
    for seed in range(20):
        noise = np.random.default_rng(seed).normal(0, 2e-4 * FORCE, samples)
        crest = np.round((sine_squared(times(samples)) + noise) / digit) * digit
        assert not any("largest force" in text for text in pulse_of(recording(crest)).warnings)
        top = np.minimum(crest, np.round(0.95 * FORCE / digit) * digit)
        assert any("largest force" in warning for warning in pulse_of(recording(top)).warnings)


@pytest.mark.parametrize("slower", [1, 2])
def test_the_time_before_half_height_that_is_not_certain(slower: int) -> None:
    """Twice that from a quarter to three quarters, here of a straight rise, slower above half."""
    rise = np.arange(100.0)
    rise = np.concatenate([rise[:50], 50 + (np.arange(50.0 * slower) + 1) / slower])
    force = np.concatenate([np.zeros(300), rise])
    assert _foot(3.0 + force, 3.0, force.size - 1) == 300 - 50 * slower
