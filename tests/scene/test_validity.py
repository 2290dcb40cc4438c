"""Mass, stiffness and natural units against the laws of Hertz and Newton; limits of the model."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import hertzchain as hc
from hertzchain.errors import OverlapTooLarge
from hertzchain.scene.chain import (
    force_scale,
    natural_units,
)
from hertzchain.scene.scene import (
    DOUBTFUL_OVERLAP,
    overlap_ratio,
    overlap_warning,
    refuse_deep_overlap,
    refuse_hopeless_overlap,
)
from tests.conftest import paper_scene

ROUND_OFF = 1e-14
"""A few dozen roundings of 1e-16."""


factor = st.floats(1e-6, 1e6)


@given(modulus=factor, force=factor, radius=factor, density=factor, nu=st.floats(-0.99, 0.5))
def test_units_vs_the_laws_of_hertz_and_newton(
    modulus: float, force: float, radius: float, density: float, nu: float
) -> None:
    """The unit force presses two granules by the unit length, and moves one as far."""
    modulus, force, radius, density = 193e9 * modulus, 100 * force, 4.75e-3 * radius, 7958 * density
    units = natural_units(hc.Chain(60, radius, modulus, nu, density), force)
    # Effective, of two equal granules.
    hertz = 4 / 3 * modulus / (2 * (1 - nu**2)) * math.sqrt(radius / 2)
    mass = 4 / 3 * math.pi * radius**3 * density
    assert units.force == force
    assert hertz * units.length**1.5 == pytest.approx(force, rel=ROUND_OFF, abs=0)
    assert mass * units.length / units.time**2 == pytest.approx(force, rel=ROUND_OFF, abs=0)
    assert units.velocity * units.time == pytest.approx(units.length, rel=ROUND_OFF, abs=0)
    assert units.momentum == pytest.approx(mass * units.velocity, rel=ROUND_OFF, abs=0)
    assert units.energy == pytest.approx(mass * units.velocity**2, rel=ROUND_OFF, abs=0)


@pytest.mark.parametrize("momentum_ratio", [1e-3, 1e-4])
def test_a_short_pulse_presses_as_hard_as_its_momentum_does(momentum_ratio: float) -> None:
    """Two granules: no other takes momentum away from the one that is pushed."""
    peak = hc.Native("reference").run(paper_scene("cosine", momentum_ratio, 2.0, granules=2))
    # The momentum that the contact takes during the pulse is of the order of LM_ratio squared.
    scale = force_scale(momentum_ratio)
    assert peak.peak_force[0] / 100 == pytest.approx(scale, rel=3 * momentum_ratio, abs=0)


# Limits of the model: overlaps over R are reported, warned of and refused


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
    overlap = hc.Native(peaks_only=True).run(scene).overlap_ratio
    # Recorded times miss the maximum by half of their distance squared.
    assert deepest / scene.chain.radius == pytest.approx(overlap, rel=1e-4, abs=0)


@pytest.mark.parametrize(("depth", "warned"), [(1e-12, False), (7e-3, False), (0.02, True)])
def test_deep_overlaps_are_warned_of(depth: float, warned: bool) -> None:
    result = hc.Native(peaks_only=True).run(scene_of_depth(depth))
    assert (result.overlap_ratio > DOUBTFUL_OVERLAP) == warned
    assert len(result.warnings) == warned
    assert all("Johnson" in warning for warning in result.warnings)
    prediction = hc.theory.predict(scene_of_depth(depth))
    assert prediction.overlap_ratio == pytest.approx(result.overlap_ratio, rel=0.01, abs=0)
    assert prediction.warnings == result.warnings or not warned


def test_the_limits_of_warning_and_refusal() -> None:
    assert overlap_warning(DOUBTFUL_OVERLAP) is None
    assert overlap_warning(math.nextafter(DOUBTFUL_OVERLAP, 1)) is not None
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


@pytest.mark.parametrize("momentum_ratio", [1e-4, 0.3, 1.971, 100.0])
@pytest.mark.parametrize("granules", [2, 40])
def test_nothing_is_refused_before_a_run_that_the_run_would_answer(
    momentum_ratio: float, granules: int
) -> None:
    """The force that is taken for sure is below the largest peak of every scene."""
    for profile in ("cosine", "triangular", "cosine-triangular"):
        for n in (1.001, 2.0):
            scene = paper_scene(profile, momentum_ratio, n, granules=granules)
            peak = float(np.max(hc.Native(peaks_only=True).run(scene).peak_force))
            softer = overlap_ratio(scene.chain, peak) ** 1.5 / 0.99  # its overlap is 0.993 R
            chain = replace(scene.chain, young_modulus=scene.chain.young_modulus * softer)
            assert overlap_ratio(chain, peak) == pytest.approx(0.99 ** (2 / 3), rel=1e-9, abs=0)
            refuse_hopeless_overlap(replace(scene, chain=chain))


@pytest.mark.parametrize(("error", "warned"), [(0.01, 0), (0.011, 1), (0.05, 1)])
def test_peaks_known_less_well_than_p_needs_warn(error: float, warned: int) -> None:
    """The value of p depends on changes of one per cent."""
    result = hc.Native("reference").run(scene_of_depth(1e-3))
    warnings = replace(result, error_estimate=error).warnings
    assert len(warnings) == warned
    assert all("may be off by" in warning for warning in warnings)
