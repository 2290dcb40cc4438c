"""Peaks from samples are off by no more than is said, by whichever way they are found."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.errors import SceneError
from hertzchain.verdict.results.motion import Motion, last_digit, peaks_of
from tests import scenes
from tests.conftest import STEEL
from tests.verdict.results.runs import (
    SCENE,
    TERMS,
    WAYS,
    Samples,
    off,
    sampled,
)


@pytest.mark.parametrize("apart", [0.05, 0.2, 0.5, pytest.param(0.8, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", ["cosine_LM0.3_n2", pytest.param("demo", marks=pytest.mark.slow)])
def test_peaks_are_off_by_no_more_than_is_said(name: str, apart: float) -> None:
    scene = scenes.load(name)
    result = hc.Native("reference").run(scene)
    samples = sampled(scene, apart, 0.3)
    counts = result.peak_force > 1e-3 * result.peak_force.max()
    for way, make in WAYS.items():
        found = peaks_of(scene, make(samples), "file")
        # The reference itself is right to 1e-9.
        allowed = found.error[counts] + 1e-9
        assert np.all(off(found.peak_force, result.peak_force) <= allowed), way


@pytest.mark.parametrize("way", WAYS)
def test_what_is_said_is_not_far_from_what_it_is(way: str, run: Samples) -> None:
    """Compare error and bound at 0.1 natural time units; engines' interpolation has 1e-8 there."""
    least = 1e-8 if way == "all" else 1e-6
    found = peaks_of(SCENE, WAYS[way](run), "file")
    assert np.max(found.error) < 100 * least
    assert np.median(found.error) > 0


@settings(max_examples=20, deadline=None)
@given(st.floats(0.03, 0.8), st.floats(0.0, 1.0), st.floats(-0.3, 0.3))
def test_maxima_of_a_curve_are_off_by_no_more_than_is_said(
    apart: float, phase: float, skew: float
) -> None:
    """A hump with a known maximum of 1, which lasts about as long as a wave."""
    time = np.arange(-6, 6, apart) + phase * apart
    shape = 1 / np.cosh(0.7 * time) ** 2 / np.cosh(0.7 * skew * time)
    motion = Motion(time + 10, False, contact_force=np.column_stack([shape, 0.5 * shape]))
    scene = hc.Scene(hc.Chain(3, **STEEL), hc.Pulse("cosine", 100.0, 2.0, rise_time=5e-5))
    found = peaks_of(scene, motion, "file")
    assert np.all(np.abs(found.peak_force / (1.0, 0.5) - 1) <= found.error + 1e-12)


@pytest.mark.parametrize("higher", [0.99, 1.0, 1.001, 1.01, 1.03])
@pytest.mark.parametrize("rate", [0.7, 1.2, 1.5])
def test_the_maximum_may_be_that_of_another_hump(rate: float, higher: float) -> None:
    """The first hump has a sample at its maximum; the second, which may be shorter, has none."""
    time = 0.4 * np.arange(-30.0, 90.0)
    shape = 1 / np.cosh(0.7 * time) ** 2 + higher / np.cosh(rate * (time - 8.2)) ** 2
    motion = Motion(time, False, contact_force=np.column_stack([shape, shape[::-1]]))
    scene = hc.Scene(hc.Chain(3, **STEEL), hc.Pulse("cosine", 100.0, 2.0, rise_time=5e-5))
    found = peaks_of(scene, motion, "file")
    # At 8 time units the other hump adds 4 exp(-1.4 * 8) = 5e-5.
    assert np.all(np.abs(found.peak_force / max(1.0, higher) - 1) <= found.error + 6e-5)
    assert rate > 0.7 or np.all(found.error < 2e-3)


@pytest.mark.parametrize("digits", [4, 6, 9, 12])
def test_digits_of_numbers_are_counted(digits: int, run: Samples, truth: FloatArray) -> None:
    """Positions of six digits tell overlaps to 1e-7 m of 1e-5 m."""

    def rounded(values: FloatArray) -> FloatArray:
        words = [f"{value:.{digits}g}" for value in values.ravel()]
        return np.array(words, float).reshape(values.shape)

    position = rounded(run.position)
    grain = last_digit(position)
    assert grain == pytest.approx(10.0 ** (-digits), rel=1e-9, abs=0)  # places of 0.1 m
    found = peaks_of(SCENE, Motion(run.time, True, position, grain=grain), "file")
    assert np.all(off(found.peak_force, truth) <= found.error)
    force = rounded(run.contact_force)
    found = peaks_of(
        SCENE, Motion(run.time, True, contact_force=force, force_grain=last_digit(force)), "file"
    )
    assert np.all(off(found.peak_force, truth) <= found.error)


def test_positions_of_few_digits_are_left_for_forces(run: Samples) -> None:
    few = np.round(run.position, 6)
    motion = Motion(run.time, True, few, run.velocity, run.net_force, grain=1e-6)
    assert peaks_of(SCENE, motion, "file").how.startswith("samples of net forces")
    motion = replace(motion, position=run.position, grain=0.0)
    assert peaks_of(SCENE, motion, "file").how.startswith("positions, velocities")


@pytest.mark.parametrize("name", TERMS)
def test_scenes_with_terms(name: str) -> None:
    scene = TERMS[name]
    true = hc.Native(rtol=1e-8).run(scene).peak_force[: scene.chain.granules - 1]
    samples = sampled(scene, 0.1)
    for way, make in WAYS.items():
        if scene.contact is not None and way.startswith("positions"):
            with pytest.raises(SceneError, match="says nothing of contact forces in such a scene"):
                peaks_of(scene, make(samples), "file")
            continue
        found = peaks_of(scene, make(samples), "file")
        assert np.all(off(found.peak_force, true) <= found.error + 1e-8), way
        assert np.max(found.error) < 1e-3, way


def test_net_forces_before_a_wall_need_times() -> None:
    scene = TERMS["column"]
    samples = sampled(scene, 0.1)
    motion = replace(WAYS["net forces"](samples), is_clock=False)
    with pytest.raises(SceneError, match="has steps and no times: give --dt"):
        peaks_of(scene, motion, "file")


def test_contacts_that_pull_a_little_are_no_negative_forces(run: Samples) -> None:
    """As cohesion does: the largest force still presses."""
    force = np.where(run.contact_force > 0, run.contact_force, -0.01 * run.contact_force.max())
    peaks = peaks_of(SCENE, Motion(run.time, True, contact_force=force), "file").peak_force
    assert np.all(peaks > 0)
