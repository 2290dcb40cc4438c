"""Limits of the model: overlaps over R are reported, warned of and refused."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.errors import OverlapTooLarge
from hertzchain.scene.validity import (
    DOUBTFUL_OVERLAP,
    overlap_ratio,
    overlap_warning,
    refuse_deep_overlap,
    refuse_hopeless_overlap,
)
from tests.conftest import paper_scene


def scene_of_depth(depth: float, momentum_ratio: float = 2.0) -> hc.Scene:
    """A scene whose overlap under F0 is a fraction of the radius."""
    scene = paper_scene("cosine-triangular", momentum_ratio, 2.0, granules=8)
    force = scene.chain.contact_stiffness * (depth * scene.chain.radius) ** 1.5
    assert scene.pulse is not None
    return replace(scene, shock=replace(scene.pulse, peak_force=force))


def test_the_overlap_is_that_of_the_history() -> None:
    scene = scene_of_depth(1e-3)
    times = np.linspace(0, scene.end_time, 4001)[1:]
    history = hc.Native("reference").run(scene, record=times).history
    deepest = -np.diff(history.displacement, axis=1).min()
    found = hc.Native(peaks_only=True).run(scene).overlap_ratio
    # Recorded times miss the maximum by half of their distance squared.
    assert deepest / scene.chain.radius == pytest.approx(found, rel=1e-4, abs=0)


@pytest.mark.parametrize(("depth", "warned"), [(1e-12, False), (7e-3, False), (0.02, True)])
def test_deep_overlaps_are_warned_of(depth: float, warned: bool) -> None:
    result = hc.Native(peaks_only=True).run(scene_of_depth(depth))
    assert (result.overlap_ratio > DOUBTFUL_OVERLAP) == warned
    assert len(result.warnings) == warned
    assert all("Johnson" in warning for warning in result.warnings)
    prediction = hc.theory.predict(scene_of_depth(depth))
    assert prediction.overlap_ratio == pytest.approx(result.overlap_ratio, rel=0.01, abs=0)
    assert prediction.warnings == result.warnings or not warned


def test_the_limits_of_the_warning() -> None:
    assert overlap_warning(DOUBTFUL_OVERLAP) is None
    assert overlap_warning(math.nextafter(DOUBTFUL_OVERLAP, 1)) is not None


def test_the_limit_of_refusal_is_the_radius() -> None:
    chain = paper_scene("cosine", 1.0, 2.0).chain
    below, above = (chain.contact_stiffness * (r * chain.radius) ** 1.5 for r in (0.9999, 1.0001))
    refuse_deep_overlap(overlap_ratio(chain, below))
    with pytest.raises(OverlapTooLarge, match="would be 1 radii, above 1:"):
        refuse_deep_overlap(overlap_ratio(chain, above))


@pytest.mark.parametrize("depth", [1.1, 1e3])
def test_overlaps_above_the_radius_are_refused(depth: float) -> None:
    scene = scene_of_depth(depth)
    for run in (
        hc.Native(peaks_only=True).run,
        hc.Native("velocity-verlet").run,
        hc.theory.predict,
        lambda scene: hc.peak_forces([scene]),
    ):
        with pytest.raises(OverlapTooLarge, match=r"radii, above 1: Hertz's law"):
            run(scene)


def test_a_batch_says_which_scene() -> None:
    with pytest.raises(OverlapTooLarge, match="scene 1: the largest overlap"):
        hc.peak_forces([scene_of_depth(0.1), scene_of_depth(2.0)])


@pytest.mark.parametrize("momentum_ratio", [1e-4, 1e-2, 0.3, 1.0, 1.971, 3.0, 100.0])
@pytest.mark.parametrize("granules", [2, 3, 40])
def test_nothing_is_refused_before_a_run_that_the_run_would_answer(
    momentum_ratio: float, granules: int
) -> None:
    """The force that is taken for sure is below the largest peak of every scene."""
    for profile in ("cosine", "triangular", "cosine-triangular"):
        for n in (1.001, 2.0, 100.0):
            scene = paper_scene(profile, momentum_ratio, n, granules=granules)
            peak = float(np.max(hc.Native(peaks_only=True).run(scene).peak_force))
            softer = overlap_ratio(scene.chain, peak) ** 1.5 / 0.99  # its overlap is 0.993 R
            chain = replace(scene.chain, young_modulus=scene.chain.young_modulus * softer)
            assert overlap_ratio(chain, peak) == pytest.approx(0.99 ** (2 / 3), rel=1e-9, abs=0)
            refuse_hopeless_overlap(replace(scene, chain=chain))


def test_a_rough_run_warns() -> None:
    scene = scene_of_depth(1e-3)
    rough = hc.Native("rk4", 0.5 * scene.units.time, peaks_only=True).run(scene)
    assert rough.error_estimate > 0.01
    assert "take a smaller dt" in rough.warnings[0]
    assert hc.Native("rk4", 0.05 * scene.units.time, peaks_only=True).run(scene).warnings == ()


@pytest.mark.parametrize(("error", "warned"), [(0.01, 0), (0.011, 1), (0.05, 1)])
def test_peaks_known_less_well_than_p_needs_warn(error: float, warned: int) -> None:
    """The value of p depends on changes of one per cent."""
    result = hc.Native("reference").run(scene_of_depth(1e-3))
    warnings = replace(result, error_estimate=error).warnings
    assert len(warnings) == warned
    assert all("may be off by" in warning for warning in warnings)
