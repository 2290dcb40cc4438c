"""Batches: the peaks of single runs, for scenes and for numbers; no scene depends on the others."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.engines.native import many
from hertzchain.engines.native import plan as plans
from hertzchain.engines.native.batch import peak_forces, similar_peak_forces
from hertzchain.engines.native.kernel_input import leg_rows
from hertzchain.engines.native.methods import SRKN_11B, Walker
from hertzchain.engines.native.simulation import simulate
from hertzchain.limits import Deadline
from hertzchain.observables.peaks import largest_difference
from hertzchain.scene.pulse import PROFILES
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
    force, time, _, evaluations = many.march_all(rows, HALVED, 30, Deadline(600.0), 2)
    assert np.flatnonzero(np.isnan(evaluations)).tolist() == [7]
    for k, (scene, its) in enumerate(zip(scenes, legs, strict=True)):
        at = k + (k >= 7)
        alone = simulate(scene, its, HALVED, leave_behind=True)
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


@pytest.mark.parametrize(
    ("number", "seed"), [(6, 11), pytest.param(1000, 12, marks=pytest.mark.slow)]
)
@pytest.mark.parametrize("rtol", ACCURACIES)
def test_random_batches_vs_single_runs(rtol: float, number: int, seed: int) -> None:
    """Peaks agree with ten times more accurate single runs within both estimates."""
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


def test_scenes_whose_motion_diverges_run_again_as_single_runs(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    ratio = [1.0, 20.0]
    plain = similar_peak_forces("cosine", ratio, 2.0, 10)
    plan = plans.cheapest

    def too_long(rtol: float, checked: bool = True, hard: bool = False) -> plans.Plan:
        chosen = plan(rtol, checked, hard)
        if checked:
            return chosen
        # Ten natural units are no step for any method, and no halving makes it shorter.
        return replace(chosen, step=10.0, walker=replace(chosen.walker, tolerance=0.0))

    monkeypatch.setattr(plans, "cheapest", too_long)
    batch = similar_peak_forces("cosine", ratio, 2.0, 10)
    assert np.all(batch.error_estimate <= 1e-6)  # what is wanted where nothing is said
    pairs = zip(batch.peak_force, plain.peak_force, strict=True)
    errors = np.array([largest_difference(*pair) for pair in pairs])
    assert np.all(errors <= batch.error_estimate + plain.error_estimate)


def test_a_force_below_all_numbers_in_newtons_has_no_time() -> None:
    # The front presses contact 22 by 5e-320 of F0 as the run ends.
    chain = hc.Chain(25, radius=1.0, young_modulus=1e6, poisson_ratio=0.0, density=100.0)
    scene = hc.Scene(chain, hc.Pulse("cosine", 1.49071198499986e-05, 2.0, momentum_ratio=1.0))
    scene = replace(scene, run=hc.Run(0.3018539168529027 * scene.end_time))
    alone, batch = hc.Native().run(scene), peak_forces([scene])
    for force, time in (
        (alone.peak_force, alone.peak_time),
        (batch.peak_force[0], batch.peak_time[0]),
    ):
        assert np.any(force == 0)
        assert np.array_equal(np.isnan(time), force == 0)


def test_a_table_of_peaks() -> None:
    frame = peak_forces([paper_scene("cosine", 1.0, 2.0, 4)] * 2, 1e-4).to_frame()
    assert list(frame.columns) == ["scene", "contact", "peak_force_N", "peak_time_s"]
    assert frame["scene"].tolist() == [0, 0, 0, 1, 1, 1]
    assert frame["contact"].tolist() == [2, 3, 4] * 2
    one = hc.Native("reference").run(paper_scene("cosine", 1.0, 2.0, 4)).peak_force
    assert frame["peak_force_N"].to_numpy()[:3] == pytest.approx(one, rel=1e-4, abs=0)


def test_first_pulses_of_a_batch() -> None:
    """Those of single runs to the last digit, in arrays and in the table; plain scenes, too."""
    chain = hc.Chain(6, **STEEL)
    walled = [hc.Scene(chain, hc.Striker(v), wall=hc.Wall("rigid")) for v in (0.5, 1.0)]
    plain = [paper_scene("cosine", 1.0, 2.0, 6), paper_scene("triangular", 0.5, 2.0, 6)]
    for given, wanted in ((walled, None), (plain, "first")):
        batch = peak_forces(given, 1e-6, wanted=wanted)
        frame = batch.to_frame()
        for k, scene in enumerate(given):
            alone = hc.Native(rtol=1e-6, wanted=wanted).run(scene).first_columns
            for name, values in alone.items():
                np.testing.assert_array_equal(batch.first_columns[name][k], values)
                np.testing.assert_array_equal(frame[name][frame["scene"] == k], values)
    assert peak_forces(plain, 1e-4).first_columns == {}
    with pytest.raises(hc.HertzchainError, match="must be one of first, all"):
        peak_forces(plain, wanted="second")


FOUR, FIVE = (paper_scene("cosine", 1.0, 2.0, granules) for granules in (4, 5))

REFUSED: list[tuple[str, Callable[[], object]]] = [
    ("scenes", lambda: peak_forces([])),
    ("granules", lambda: peak_forces([FOUR, FIVE])),
    ("rtol", lambda: peak_forces([FOUR], 1e-12)),
    ("rtol", lambda: similar_peak_forces("cosine", 1.0, 2.0, 5, 1.0)),
    ("profile", lambda: similar_peak_forces("square", 1.0, 2.0, 5)),  # type: ignore[arg-type]
    ("momentum_ratio", lambda: similar_peak_forces("cosine", [1.0, -1.0], 2.0, 5)),
    ("momentum_ratio", lambda: similar_peak_forces("cosine", [], 2.0, 5)),
    ("momentum_ratio", lambda: similar_peak_forces("cosine", "x", 2.0, 5)),
    ("duration_ratio", lambda: similar_peak_forces("cosine", 1.0, 1.0, 5)),
    ("duration_ratio", lambda: similar_peak_forces("cosine", [1.0, 2.0], [2.0, 3.0, 4.0], 5)),
    ("granules", lambda: similar_peak_forces("cosine", 1.0, 2.0, 1)),
    ("granules", lambda: similar_peak_forces("cosine", 1.0, 2.0, 10.5)),  # type: ignore[arg-type]
]


@pytest.mark.parametrize(("named", "call"), REFUSED)
def test_impossible_batches_are_refused(named: str, call: Callable[[], object]) -> None:
    with pytest.raises(hc.HertzchainError, match=named):
        call()
