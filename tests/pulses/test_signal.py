"""The pulse in a recording: baseline, noise, start, end, and negative samples."""

from __future__ import annotations

import numpy as np
import pytest

from hertzchain.arrays import FloatArray
from hertzchain.errors import HertzchainError
from hertzchain.pulses.pulse import (
    _foot,
    averaged,
    left_out,
    no_return,
    pulse_of,
    without_negative,
)
from hertzchain.pulses.recording import Noise, Recording, noise_before, noise_within, resolution_of
from tests.recordings import DURATION, FORCE, GAIN, OFFSET, START, sine_squared, times, volts

IMPULSE = FORCE * DURATION / 2  # [N s]


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
    read = recording(sine_squared(times(2000)))
    signal = pulse_of(read)
    assert signal.noise.deviation == signal.baseline == 0
    inside = (read.time >= signal.start) & (read.time <= signal.start + signal.time[-1] + 1e-12)
    # The first and the last samples, of less than 1e-7 N, are averages.
    np.testing.assert_allclose(signal.force, read.force[inside], atol=1e-6)
    assert signal.time.size < 1.04 * np.count_nonzero(read.force > 1e-6)
    assert signal.left_out == pytest.approx((0, 0), abs=1e-12)


def test_what_is_given_is_taken() -> None:
    read = noisy()
    signal = pulse_of(read, baseline=0.02, start=10e-6, end=40e-6)
    assert signal.baseline == 0.02 * GAIN
    assert signal.baseline_samples == 0
    inside = (read.time >= 10e-6) & (read.time <= 40e-6)
    assert signal.force[:-1].tolist() == (read.force[inside] - 0.02 * GAIN).tolist()
    before = read.time <= signal.start
    left_out = np.trapezoid(read.force[before] - 0.02 * GAIN, read.time[before])
    assert signal.left_out[0] == pytest.approx(left_out, rel=1e-12)


def test_a_recording_that_begins_with_its_pulse() -> None:
    read = noisy()
    inside = read.time > START
    signal = pulse_of(Recording(read.time[inside], read.force[inside], GAIN, ()))
    assert (signal.baseline, signal.baseline_samples) == (0, 0)
    assert "none taken off" in dict(signal.remarks)["baseline"]
    assert signal.noise.deviation == pytest.approx(1.0, rel=0.15)  # as samples scatter


def test_what_is_below_zero_adds_no_impulse_where_it_is_noise() -> None:
    generator = np.random.default_rng(1)
    noise = generator.normal(0, 1, 100_000)
    assert np.maximum(noise, 0).mean() == pytest.approx(0.4, rel=0.02)  # 1 / sqrt(2 pi)
    clean = without_negative(noise, 101, 4.0)
    assert clean.min() == 0
    assert 0.03 < clean.mean() < 0.05  # a tenth of it: the averages have a tenth of the noise
    assert without_negative(np.array([5.0, -1.0, 7.0]), 1, 0.0).tolist() == [5, 0, 7]


def test_a_swing_below_zero_is_set_to_zero_and_said() -> None:
    read = noisy()
    swing = (read.time > 50e-6) & (read.time < 55e-6)
    signal = pulse_of(recording(np.where(swing, -30.0, read.force)))
    clock = signal.time + signal.start
    inside = (clock > 51e-6) & (clock < 54e-6)
    assert np.all(signal.force[inside] == 0)
    lowest = -30.0 - signal.baseline
    assert f"the lowest {lowest:.3g} N: set to 0" in dict(signal.remarks)["samples below 0"]


def test_the_height_of_a_rectangle_is_no_noise() -> None:
    clock = times(500)
    signal = pulse_of(recording(np.where((clock > 0) & (clock < 70e-6), FORCE, 0.0)))
    assert signal.noise.deviation == 0
    assert signal.force.max() == FORCE


@pytest.mark.parametrize(
    ("force", "words"),
    [
        (-sine_squared(times(500)), "pulls; a pulse pushes: turn it with --scale"),
        (np.ones(500), "all forces are equal"),
        (np.random.default_rng(1).normal(0, 0.5, 500), "no pulse stands out of the noise, 0.4"),
    ],
)
def test_what_is_no_pulse(force: FloatArray, words: str) -> None:
    with pytest.raises(HertzchainError, match=words):
        pulse_of(recording(force))


def two_pulses(height: float, distance: float = 90e-6, noise: float = 0.5) -> Recording:
    """A pulse of a height and, later, one of F0, under noise of a standard deviation [N]."""
    clock = np.linspace(-20e-6, 200e-6, 2000)
    force = height / FORCE * sine_squared(clock) + sine_squared(clock - distance)
    force += np.random.default_rng(5).normal(0, noise, clock.size)
    return Recording(clock, force, 1.0, ())


@pytest.mark.parametrize("height", [7.0, 60.0])
def test_a_pulse_before_the_largest_is_no_baseline(height: float) -> None:
    with pytest.raises(HertzchainError, match=r"a pulse of .* N, at 3.*e-05 s, comes before"):
        pulse_of(two_pulses(height))
    both = pulse_of(two_pulses(height), start=-3e-6, end=165e-6)
    assert abs(both.baseline) < 4 * 0.5 / np.sqrt(100)
    assert np.trapezoid(both.force, both.time) == pytest.approx(
        (1 + height / FORCE) * IMPULSE,
        rel=0.01,  # the baseline is off by 0.05 N, of a mean force of 25 N or more
    )


def test_what_is_hardly_higher_than_the_noise_is_no_other_pulse() -> None:
    assert pulse_of(two_pulses(3.0)).baseline_samples > 500
    # Averages of 15 samples have a standard deviation of 5 / sqrt(15) = 1.3 N.
    assert pulse_of(two_pulses(5.5, noise=5.0)).baseline_samples > 500


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"start": 1.0}, "--start = 1.0: must be a time of the file, -2e-05 to 0.00016 s"),
        ({"baseline": float("nan")}, "--baseline = nan: must be a finite number"),
        ({"end": -1.0}, "--end = -1.0: must be a time of the file"),
        ({"start": 31.9e-6, "end": 32.2e-6}, r"there are \d samples from .*, a pulse needs 8"),
        ({"start": 50e-6, "end": 10e-6}, "there are 0 samples from 5"),
    ],
)
def test_times_that_leave_the_pulse_out(given: dict[str, float], words: str) -> None:
    with pytest.raises(HertzchainError, match=words):
        pulse_of(noisy(), **given)


def test_averages_at_the_ends_are_of_fewer() -> None:
    assert averaged(np.array([1.0, 2.0, 6.0, 3.0]), 3).tolist() == [1.5, 3.0, 11 / 3, 4.5]


def test_the_digits_of_a_recording_are_noise() -> None:
    force = np.round(sine_squared(times(2000)) / 0.5) * 0.5
    assert resolution_of(force) == pytest.approx(0.5, rel=1e-12)
    assert resolution_of(sine_squared(times(2000))[300:800]) == 0
    assert pulse_of(recording(force)).noise.deviation == pytest.approx(0.5 / np.sqrt(12))


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


def without_line(samples: int) -> FloatArray:
    noise, at = np.random.default_rng(4).normal(0, 1, samples), np.arange(samples)
    left = noise - np.polyval(np.polyfit(at, noise, 1), at)
    return np.asarray(left / left.std(ddof=1))


@pytest.mark.parametrize(("deviations", "is_said"), [(4, False), (6, True)])
def test_a_return_is_within_five_deviations_of_the_end_of_a_line(
    deviations: int, is_said: bool
) -> None:
    """The end of a line through n samples of deviation 1 has a deviation of 2 / sqrt(n)."""
    force = np.concatenate([np.zeros(980), without_line(20) + deviations * 2 / np.sqrt(20)])
    assert (no_return(force, 100.0, 1.0, Noise(1.0, 1.0), True) is not None) == is_said


@pytest.mark.parametrize(("off", "is_said"), [(0.9, False), (1.1, True), (-1.1, True)])
def test_a_recording_that_does_not_return_is_said(off: float, is_said: bool) -> None:
    time = times(2000)
    away = np.interp(time, [100e-6, 160e-6], [0, off])  # 1 N is a hundredth of F0
    warnings = pulse_of(recording(sine_squared(time) + away)).warnings
    assert len(warnings) == is_said
    assert all(f"ends {off:+.2g} N from its baseline" in warning for warning in warnings)
    given = {"end": START + DURATION}
    assert pulse_of(recording(sine_squared(time) + away), **given).warnings == ()


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


@pytest.mark.parametrize("noise", [0.0, 0.001, 0.01, 0.05])
@pytest.mark.parametrize("digit", [0.0, 1.0])
def test_noise_and_digits_alone_are_no_drift_and_no_cut_off_top(noise: float, digit: float) -> None:
    for seed in range(10):
        force = noisy(noise=noise, seed=seed).force
        if digit:
            force = np.round(force / digit) * digit
        assert pulse_of(recording(force)).warnings == ()


@pytest.mark.parametrize(("equal", "is_said"), [(4, False), (5, True), (200, True)])
def test_a_cut_off_top_is_said(equal: int, is_said: bool) -> None:
    force = noisy().force
    warnings = pulse_of(recording(np.minimum(force, np.sort(force)[-equal]))).warnings
    assert len(warnings) == is_said
    assert all(f"{equal} samples have the largest force" in warning for warning in warnings)


@pytest.mark.parametrize("samples", [300, 1000, 3000])
@pytest.mark.parametrize("bits", [9, 10, 11, 12])
def test_a_crest_of_more_digits_than_samples_is_not_cut_off(samples: int, bits: int) -> None:
    """Too few samples for the digit: 1 in 70 such crests was taken for a top that is cut off."""
    digit = 2 * FORCE / 2**bits
    for seed in range(20):
        noise = np.random.default_rng(seed).normal(0, 2e-4 * FORCE, samples)
        crest = np.round((sine_squared(times(samples)) + noise) / digit) * digit
        assert not any("largest force" in text for text in pulse_of(recording(crest)).warnings)
        cut = np.minimum(crest, np.round(0.95 * FORCE / digit) * digit)
        assert any("largest force" in warning for warning in pulse_of(recording(cut)).warnings)


def test_a_spike_outside_of_the_times_that_are_given_is_not_used() -> None:
    read, spike = noisy(), 3 * FORCE
    at = np.array([1200, 1500])  # after the pulse
    force = read.force.copy()
    force[at] = spike, -spike
    given = {"start": START - 1e-6, "end": START + DURATION}
    with pytest.raises(HertzchainError, match="pulls"):
        pulse_of(recording(force), start=START - 1e-6)
    signal, clean = pulse_of(recording(force), **given), pulse_of(recording(read.force), **given)
    assert signal.force.tolist() == clean.force.tolist()
    assert signal.baseline == clean.baseline


def begun_late(after: float, offset: float = 4.5) -> Recording:
    """A recording, with an offset [N], that begins at a part of its pulse."""
    read = noisy()
    inside = read.time > START + after * DURATION
    force = read.force[inside] - GAIN * OFFSET + offset
    return Recording(read.time[inside], force, 1.0, ())


@pytest.mark.parametrize("after", [0.05, 0.15])
def test_a_recording_that_begins_in_its_pulse_has_one_story(after: float) -> None:
    signal = pulse_of(begun_late(after))
    assert "none taken off" in dict(signal.remarks)["baseline"]
    (warning,) = signal.warnings
    assert "N from 0, as no baseline is taken off: say with --baseline" in warning
    assert pulse_of(begun_late(after), baseline=4.5).warnings == ()
    (warning,) = pulse_of(begun_late(after), baseline=0.0).warnings
    assert warning.startswith("the recording ends +4.")


@pytest.mark.parametrize("after", [0.26, 0.4, 0.5, 0.6])
def test_a_recording_that_begins_near_its_crest_is_no_pull(after: float) -> None:
    with pytest.raises(HertzchainError, match=r"begins in its pulse.* --baseline"):
        pulse_of(begun_late(after))
    signal = pulse_of(begun_late(after), baseline=4.5)
    # Five standard deviations of a sample, of 1 N each.
    assert signal.force.max() == pytest.approx(FORCE * np.sin(np.pi * max(after, 0.5)) ** 2, abs=5)


@pytest.mark.parametrize("slower", [1, 2])
def test_the_time_before_half_height_that_is_not_certain(slower: int) -> None:
    """Twice that from a quarter to three quarters, here of a straight rise, slower above half."""
    rise = np.arange(100.0)
    rise = np.concatenate([rise[:50], 50 + (np.arange(50.0 * slower) + 1) / slower])
    force = np.concatenate([np.zeros(300), rise])
    assert _foot(3.0 + force, 3.0, force.size - 1) == 300 - 50 * slower
