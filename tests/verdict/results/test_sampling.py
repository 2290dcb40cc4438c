"""Peaks from samples are off by no more than is said, by whichever way they are found."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.errors import SceneError
from hertzchain.verdict.results import Motion, last_digit, peaks_of
from tests import scenes
from tests.conftest import STEEL
from tests.verdict.results.runs import SCENE, TERMS, Samples, motion, off, sampled


@pytest.mark.parametrize("apart", [0.05, 0.2, 0.5, pytest.param(0.8, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", ["cosine_LM0.3_n2", pytest.param("demo", marks=pytest.mark.slow)])
def test_peaks_are_off_by_no_more_than_is_said(name: str, apart: float) -> None:
    scene = scenes.load(name)
    result = hc.Native("reference").run(scene)
    samples = sampled(scene, apart, 0.3)
    counts = result.peak_force > 1e-3 * result.peak_force.max()
    peaks = peaks_of(scene, motion(samples), "file")
    # The reference itself is right to 1e-9.
    allowed = peaks.error[counts] + 1e-9
    assert np.all(off(peaks.peak_force, result.peak_force) <= allowed)


def of_contacts(time: FloatArray, force: list[FloatArray]) -> Motion:
    """Net forces on three granules that press each other with these forces."""
    first, second = force
    net_force = np.column_stack([0 * first, first - second, second])
    return Motion(np.asarray(time, np.float64), False, net_force)


@pytest.mark.parametrize("higher", [0.99, 1.0, 1.001, 1.01, 1.03])
@pytest.mark.parametrize("rate", [0.7, 1.2, 1.5])
def test_the_maximum_may_be_that_of_another_hump(rate: float, higher: float) -> None:
    """The first hump has a sample at its maximum; the second, which may be shorter, has none."""
    time = 0.4 * np.arange(-30.0, 90.0)
    shape = 1 / np.cosh(0.7 * time) ** 2 + higher / np.cosh(rate * (time - 8.2)) ** 2
    scene = hc.Scene(hc.Chain(3, **STEEL), hc.Pulse("cosine", 100.0, 2.0, rise_time=5e-5))
    peaks = peaks_of(scene, of_contacts(time, [shape, shape[::-1]]), "file")
    # At 8 time units the other hump adds 4 exp(-1.4 * 8) = 5e-5.
    assert np.all(np.abs(peaks.peak_force / max(1.0, higher) - 1) <= peaks.error + 6e-5)
    assert rate > 0.7 or np.all(peaks.error < 2e-3)


@pytest.mark.parametrize("digits", [4, 6, 9, 12])
def test_digits_of_numbers_are_counted(digits: int, run: Samples, truth: FloatArray) -> None:
    words = [f"{value:.{digits}g}" for value in run.net_force.ravel()]
    force = np.array(words, float).reshape(run.net_force.shape)
    grain = last_digit(force)
    size = np.floor(np.log10(np.abs(run.net_force).max()))
    assert grain == pytest.approx(10.0 ** (size - digits + 1), rel=1e-9, abs=0)
    assert last_digit(0 * force) == 0
    peaks = peaks_of(SCENE, Motion(run.time, True, force, grain), "file")
    assert np.all(off(peaks.peak_force, truth) <= peaks.error)
    exact = peaks_of(SCENE, Motion(run.time, True, force), "file")
    assert peaks.error - exact.error == pytest.approx(2 * grain / exact.peak_force, abs=1e-15)


@pytest.mark.parametrize("name", TERMS)
def test_scenes_with_terms(name: str) -> None:
    scene = TERMS[name]
    true = hc.Native(rtol=1e-8).run(scene).peak_force[: scene.chain.granules - 1]
    peaks = peaks_of(scene, motion(sampled(scene, 0.1)), "file")
    assert np.isnan(peaks.peak_force[true.size :]).all()
    error = peaks.error[: true.size]
    assert np.all(off(peaks.peak_force[: true.size], true) <= error + 1e-8)
    assert np.max(error) < 1e-3


def twice(run: Samples, more: float) -> Motion:
    """A run with one sample again, in which one granule feels more by a share of the largest."""
    net_force = np.insert(run.net_force, 50, run.net_force[50], axis=0)
    net_force[51, 4] += more * np.abs(run.net_force).max()
    return Motion(np.insert(run.time, 50, run.time[50]), True, net_force)


def test_a_sample_may_stand_there_twice(run: Samples, truth: FloatArray) -> None:
    peaks = peaks_of(SCENE, twice(run, 0.05 / 3), "file")
    assert np.all(off(peaks.peak_force, truth) <= peaks.error)


def test_samples_that_cannot_be(run: Samples) -> None:
    column, near = TERMS["column"], replace(SCENE, near_wall=hc.Wall("rigid"))
    led = replace(SCENE, shock=hc.Piston(0.1), wall=hc.Wall("rigid"))
    for scene, run_of, words in (
        (near, motion(run), "has no force of a near wall"),
        (led, motion(run), "do not tell contact forces between a piston and a wall"),
        (SCENE, twice(run, 0.15), "has two different samples of one time"),
        (column, replace(motion(sampled(column, 0.1)), is_clock=False), "no times: give --dt"),
        (SCENE, Motion(run.time[:6], True, run.net_force[:6]), "has 6 samples of the run"),
        (SCENE, Motion(run.time[::-1], True, run.net_force), "has times that do not increase"),
    ):
        with pytest.raises(SceneError, match=words):
            peaks_of(scene, run_of, "file")
