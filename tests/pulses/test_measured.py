"""Measured pulses: how well their numbers are known, and what few rows do to them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.errors import SceneError
from hertzchain.pulses.pulse import (
    MeasuredPulse,
    Value,
    corners_of,
    heights,
    measured_pulse,
    pulse_of,
)
from hertzchain.pulses.recording import Noise, Recording
from hertzchain.report.console import plain_text, print_pulse, with_deviation
from hertzchain.report.figures import plot_pulse
from hertzchain.scene.shocks import PulseTable, profile_named
from hertzchain.scene.starters import write_starter
from tests.conftest import STEEL
from tests.recordings import DURATION, FORCE, GAIN, times, volts

CHAIN = hc.Chain(20, **STEEL)


def found_in(samples: int, noise: float, seed: int, rows: int = 80) -> MeasuredPulse:
    read = Recording(times(samples), GAIN * volts(samples, noise, seed), GAIN, ())
    return measured_pulse(read, pulse_of(read), rows)


def peaks(table: PulseTable) -> FloatArray:
    return hc.Native(rtol=1e-6).run(hc.Scene(CHAIN, table)).peak_force


def test_the_truth_is_within_what_is_said() -> None:
    pulse = found_in(2000, 0.01, 11)
    for value, true in ((pulse.peak_force, FORCE), (pulse.impulse, FORCE * DURATION / 2)):
        assert 0 < value.deviation < 0.02 * true
        assert abs(value.value - true) < 3 * value.deviation
    rise = DURATION / np.pi * (np.arcsin(np.sqrt(0.9)) - np.arcsin(np.sqrt(0.1)))
    assert pulse.rise_time == pytest.approx(rise, rel=0.05)
    assert max(pulse.table.force) == pulse.peak_force.value
    assert len(pulse.table.time) < 40
    true_peaks = hc.Native(rtol=1e-5).run(
        hc.Scene(CHAIN, hc.Pulse("cosine", FORCE, 2.0, rise_time=DURATION / 2))
    )
    # The peaks follow the impulse, which is known to 0.2 %.
    np.testing.assert_allclose(peaks(pulse.table), true_peaks.peak_force, rtol=0.005)


def shape(name: str, part: FloatArray) -> FloatArray:
    """Force over F0, over the part of the length that is past."""
    part = np.clip(part, 0, 1)
    triangle: FloatArray = np.minimum(part / 0.4, (1 - part) / 0.6)
    return triangle if name == "triangle" else np.sin(np.pi * part) ** 2


@pytest.mark.parametrize("name", ["sine squared", "triangle"])
def test_recordings_scatter_as_is_said(name: str) -> None:
    """Of 40 recordings; F0 is a little high, so that ± is not that of a mean."""
    clock = np.arange(-40e-6, 260e-6, 0.2e-6)
    force = FORCE * shape(name, clock / 90e-6)
    off = []
    for seed in range(40):
        noise = np.random.default_rng(seed).normal(0, 0.0125 * FORCE, clock.size)
        read = Recording(clock, force + noise, 1.0, ())
        pulse = measured_pulse(read, pulse_of(read))
        true = FORCE, np.trapezoid(force, clock)
        both = pulse.peak_force, pulse.impulse
        off.append([(size.value - t) / size.deviation for size, t in zip(both, true, strict=True)])
    within = np.mean(np.abs(off) < 2, axis=0)
    # Three standard deviations of a count of 40 whose share is 0.95.
    assert np.all(within > 0.95 - 3 * np.sqrt(0.95 * 0.05 / 40))
    assert np.all(np.sqrt(np.mean(np.square(off), axis=0)) > 0.5)  # nor is ± much too large


def test_rows_are_at_most_so_many_and_change_peaks_little() -> None:
    everything = found_in(2000, 0.0, 1, 10_000)
    signal = everything.signal
    true = peaks(PulseTable(tuple(signal.time.tolist()), tuple(signal.force.tolist())))
    for rows, change in ((80, 1e-3), (15, 2e-2)):
        pulse = found_in(2000, 0.0, 1, rows)
        assert len(pulse.table.time) <= rows
        np.testing.assert_allclose(peaks(pulse.table), true, rtol=change)
        off = np.interp(signal.time, pulse.table.time, pulse.table.force) - signal.force
        assert np.abs(off).max() < 2 * pulse.bend
        assert pulse.impulse.value == pytest.approx(everything.impulse.value, rel=1e-12)
    with pytest.raises(SceneError, match="--rows = 2: must be at least 3"):
        found_in(2000, 0.0, 1, 2)


def test_the_table_reads_back(tmp_path: Path) -> None:
    pulse = found_in(500, 0.01, 1)
    (tmp_path / "pulse.csv").write_text(pulse.to_text(), encoding="utf-8")
    write_starter("pulse-table", tmp_path / "scene.toml")
    text = (tmp_path / "scene.toml").read_text(encoding="utf-8")
    path = tmp_path / "other.toml"
    path.write_text(text.replace("scene.csv", "pulse.csv"), encoding="utf-8")
    assert hc.Scene.from_toml(path).shock == pulse.table


# Corners


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


@pytest.mark.parametrize("momentum_ratio", [0.1, 10.0])
@pytest.mark.parametrize("profile", ["cosine", "triangular", "cosine-triangular"])
def test_peaks_stay_within_the_wanted_accuracy(profile: str, momentum_ratio: float) -> None:
    scene, time, force = sampled(profile, momentum_ratio)
    expected = hc.Native(rtol=1e-6).run(scene).peak_force
    rows = []
    for wanted in (1e-2, 1e-3):
        clock, few = reduced(time, force, wanted / 3 * 100.0)
        table = hc.PulseTable(tuple(clock), tuple(few))
        peak_force = hc.Native(rtol=1e-6).run(replace(scene, shock=table)).peak_force
        np.testing.assert_allclose(peak_force, expected, rtol=wanted)
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


def test_what_is_printed_and_drawn_of_a_pulse() -> None:
    pulse = found_in(2000, 0.01, 11)
    table = PulseTable((0.0, 1e-5, 5e-5, 6e-5), (0.0, 50.0, 100.0, 0.0))
    left = 0.01 * 3.75e-3, 0.001 * 3.75e-3
    signal = replace(pulse.signal, start=-0.0, left_out=left, remarks=(("baseline", "0.3 N"),))
    shown = replace(pulse, table=table, signal=signal, bend=0.5)
    assert plain_text(lambda console: print_pulse(console, shown)).splitlines() == [
        " baseline                 0.3 N",
        " pulse                    from 0 s to 6e-05 s of the file; its start is now 0",
        " impulse left out         1.00% before the pulse, 0.10% after it",
        (
            " rows                     728 before, 4 now; "
            "but for noise the force is off by 0.5 N at most"
        ),
        " F0                       100.00 ± 0.21 N",
        " impulse                  0.0037500 ± 5.8e-06 N s",
        " rise time, 10 % to 90 %  4e-05 s",
        "± is one standard deviation, of noise, baseline and the lines between rows.",
    ]
    assert shown.to_dict()["duration_s"] == 6e-5
    assert shown.to_dict()["rise_time_s"] == shown.rise_time == pytest.approx(4e-5)
    falling = replace(shown, table=PulseTable((0.0, 6e-5), (100.0, 0.0)))
    assert falling.to_dict()["rise_time_s"] is None
    late = replace(shown, signal=replace(signal, start=1e-5))
    above, below = plot_pulse(late).axes
    np.testing.assert_array_equal(above.lines[0].get_ydata(), pulse.recording.force)
    np.testing.assert_array_equal(above.lines[0].get_xdata(), pulse.recording.time - 1e-5)
    rows = above.lines[-1].get_ydata()
    assert rows == pytest.approx(signal.baseline + np.array(table.force))
    assert below.lines[0].get_ydata()[0] == signal.force[0]


@pytest.mark.parametrize(
    ("value", "deviation", "shown"),
    [
        (100.0, 0.0, "100 N"),
        (1.0, 1.0, "1 ± 1 N"),
        (123.4, 5.6, "123.4 ± 5.6 N"),
        (99.96, 1e-9, "99.9600000 ± 1.0e-09 N"),
        (-12.34, 0.0123, "-12.340 ± 0.012 N"),
        (250.0, 120.0, "2.5e+02 ± 1.2e+02 N"),
    ],
)
def test_digits_up_to_the_second_of_the_deviation(
    value: float, deviation: float, shown: str
) -> None:
    assert with_deviation(Value(value, deviation), "N") == shown
