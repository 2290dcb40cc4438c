"""Batches of plain scenes: the peaks of single runs, and no scene depends on the others."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.engines.native import many, simulate
from hertzchain.engines.native import plan as plans
from hertzchain.engines.native.kernel_input import leg_rows
from hertzchain.engines.native.methods import SRKN_11B, Walker
from hertzchain.limits import Deadline
from hertzchain.observables.peaks import largest_difference
from hertzchain.scene.pulse import PROFILES, profile_named
from tests.conftest import STEEL, paper_scene

ACCURACIES = [1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10]

HALVED = Walker(SRKN_11B, 1e-6, 1, 4.0)


def spread(rng: np.random.Generator, low: float, high: float, number: int) -> FloatArray:
    """Random numbers, even over decades."""
    return np.exp(rng.uniform(np.log(low), np.log(high), number))


def test_a_batch_vs_runs_of_its_scenes_bit_for_bit() -> None:
    """With the same steps; one diverges, and leaves the others alone."""
    names = itertools.cycle(PROFILES)
    ratio, n = (
        spread(np.random.default_rng(5), low, high, 20) for low, high in ((0.05, 10.0), (1.1, 60.0))
    )
    scenes = [paper_scene(*one, 30) for one in zip(names, ratio, n, strict=False)]
    legs = [scene.schedule(0.4 * scene.units.time) for scene in scenes]
    rows = np.zeros((21, 3, 8))
    rows[7] = leg_rows(paper_scene("cosine", 1.0, 2.0, 30).schedule(1.0), scenes[0].units)
    for k, (scene, its) in enumerate(zip(scenes, legs, strict=True)):
        rows[k + (k >= 7)][: len(its)] = leg_rows(its, scene.units)
    leaves = np.arange(21) % 2 == 0
    force, time, _, evaluations = many.march_all(rows, HALVED, 30, leaves, Deadline(600.0), 2)
    assert np.flatnonzero(np.isnan(evaluations)).tolist() == [7]
    for k, (scene, its) in enumerate(zip(scenes, legs, strict=True)):
        at = k + (k >= 7)
        alone = simulate(scene, its, HALVED, leave_behind=bool(leaves[at]))
        assert np.array_equal(force[at], alone.peaks.force)
        assert np.array_equal(time[at], alone.peaks.time, equal_nan=True)
        assert evaluations[at] == alone.evaluations


def test_a_batch_does_not_depend_on_order_company_or_cores() -> None:
    rng = np.random.default_rng(8)
    ratio, n = spread(rng, 0.05, 10.0, 30), spread(rng, 1.1, 60.0, 30)

    def peaks(some: Any, rtol: float, cores: int) -> Any:
        found = hc.similar_peak_forces("triangular", ratio[some], n[some], 60, rtol, cores=cores)
        return found.peak_force, found.peak_time, found.error_estimate, found.force_evaluations

    for rtol in (1e-4, 1e-6):
        together = peaks(slice(None), rtol, 2)
        some = rng.permutation(30)[:11]
        for cores in (1, 2):
            for one, other in zip(peaks(some, rtol, cores), together, strict=True):
                assert np.array_equal(one, other[some], equal_nan=True)


@pytest.mark.parametrize("profile", list(PROFILES))
def test_batches_vs_scipy(profile: str) -> None:
    """Eq. 1 in natural units by SciPy's DOP853, the largest force of 500 times a time unit."""
    scene = paper_scene(profile, 0.7, 3.0, 6)
    units = scene.units

    def applied(time: float) -> float:
        before = (ramp for ramp in scene.ramps if ramp.start <= time * units.time <= ramp.end)
        ramp = next(before, None)
        if ramp is None:
            return 0.0
        s = (time * units.time - ramp.start) / (ramp.end - ramp.start)
        if ramp.shape != "linear":
            s = (1 - np.cos(np.pi * s)) / 2
        return float(ramp.start_force + (ramp.end_force - ramp.start_force) * s) / units.force

    def slope(time: float, state: FloatArray) -> FloatArray:
        u, v = np.split(state, 2)
        force = np.maximum(u[:-1] - u[1:], 0.0) ** 1.5
        ends = np.concatenate([[applied(time)], force, [0.0]])
        return np.concatenate([v, ends[:-1] - ends[1:]])

    state, largest = np.zeros(12), np.zeros(5)
    corners = [0.0, *(ramp.end / units.time for ramp in scene.ramps), 20.0]
    for start, end in itertools.pairwise(corners):
        times = np.linspace(start, end, int(500 * (end - start)) + 2)
        # Inside the corners: at one of them the force is that of the other side.
        inside = np.nextafter(start, end), np.nextafter(end, start)
        found = solve_ivp(
            slope, inside, state, "DOP853", np.clip(times, *inside), rtol=1e-9, atol=1e-11,
            max_step=0.5,
        )  # fmt: skip
        force = np.maximum(found.y[:5] - found.y[1:6], 0.0) ** 1.5
        largest, state = np.maximum(largest, force.max(axis=1)), found.y[:, -1]
    for rtol in (1e-4, 1e-5):
        batch = hc.similar_peak_forces(profile_named(profile), 0.7, 3.0, 6, rtol)
        # Between two times a force may be 1e-6 higher: (0.002)^2 / 8 times a curvature of 2.
        within = batch.error_estimate[0] + 1e-6
        assert largest_difference(batch.peak_force[0], largest) <= within
        assert batch.error_estimate[0] <= rtol


@pytest.mark.parametrize("rtol", ACCURACIES)
def test_random_batches_vs_single_runs(rtol: float) -> None:
    batches_agree_with_single_runs(6, rtol, seed=11)


@pytest.mark.slow
@pytest.mark.parametrize("rtol", ACCURACIES)
def test_a_thousand_scenes_in_batches_vs_single_runs(rtol: float) -> None:
    batches_agree_with_single_runs(1000, rtol, seed=12)


def batches_agree_with_single_runs(number: int, rtol: float, seed: int) -> None:
    """Assert that peaks agree with ten times more accurate single runs within both estimates."""
    rng = np.random.default_rng(seed)
    for granules in (4, 25, 120):
        ratio, n = spread(rng, 0.05, 10.0, number // 3 + 1), spread(rng, 1.1, 60.0, number // 3 + 1)
        profile = list(PROFILES)[rng.integers(3)]
        scenes = [
            hc.Scene(hc.Chain(granules, **STEEL), hc.Pulse(profile, 100.0, b, momentum_ratio=a))
            for a, b in zip(ratio.tolist(), n.tolist(), strict=True)
        ]
        batch = hc.similar_peak_forces(profile, ratio, n, granules, rtol)
        in_newtons = hc.peak_forces(scenes, rtol)
        assert np.all(batch.error_estimate <= rtol)
        assert np.all(in_newtons.error_estimate <= rtol)
        closer = max(rtol / 10, plans.TIGHTEST)
        for k, scene in enumerate(scenes):
            single = hc.Native(rtol=closer, peaks_only=True).run(scene)
            for force, error in (
                (100 * batch.peak_force[k], batch.error_estimate[k]),
                (in_newtons.peak_force[k], in_newtons.error_estimate[k]),
            ):
                difference = largest_difference(force, single.peak_force)
                assert difference <= error + single.error_estimate, scene
