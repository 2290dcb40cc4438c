"""The choice of method and step: the wanted accuracy is reached, at nearly the least cost."""

from __future__ import annotations

import functools
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.engines.native import plan as plans
from hertzchain.engines.native.methods import METHODS
from hertzchain.engines.native.simulation import simulate
from hertzchain.observables.error_bound import is_short
from hertzchain.observables.peaks import largest_difference
from hertzchain.scene.pulse import PROFILES
from tests.conftest import STEEL, paper_scene

RATIOS, DURATIONS, GRANULES = (0.05, 10.0), (1.1, 60.0), 500
"""LM_ratio, n and the longest chain of random scenes: outside nothing was measured."""

ACCURACIES = [1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10]


@functools.cache
def random_scenes(number: int, seed: int) -> list[tuple[hc.Scene, Any]]:
    """Scenes and their peaks by the reference [N]: LM, n and N spread evenly over decades."""
    rng = np.random.default_rng(seed)

    def spread(low: float, high: float) -> float:
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    scenes = []
    for _ in range(number):
        chain = hc.Chain(int(spread(2, GRANULES + 1)), **STEEL)
        profile = list(PROFILES)[rng.integers(3)]
        ratio, duration = spread(*RATIOS), spread(*DURATIONS)
        scenes.append(hc.Scene(chain, hc.Pulse(profile, 100.0, duration, momentum_ratio=ratio)))
    walker, step = METHODS["reference"].walker, METHODS["reference"].step
    return [
        (
            scene,
            100
            * simulate(
                scene, scene.schedule(step * scene.units.time), walker, leave_behind=True
            ).peaks.force,
        )
        for scene in scenes
    ]


@pytest.mark.parametrize("rtol", ACCURACIES)
@pytest.mark.parametrize(
    ("number", "seed"), [(60, 7), pytest.param(1000, 2026, marks=pytest.mark.slow)]
)
def test_wanted_accuracy_is_had_in_random_scenes(number: int, seed: int, rtol: float) -> None:
    """The true error of every scene is below the wanted one, and below the estimate."""
    for scene, peaks in random_scenes(number, seed):
        result = hc.Native(rtol=rtol, peaks_only=True).run(scene)
        error = largest_difference(result.peak_force, peaks)
        assert result.error_estimate <= rtol
        assert error <= result.error_estimate + 1e-11, scene  # the reference's own, rounded up


def test_less_accuracy_costs_less(demo: hc.Scene) -> None:
    costs = [hc.Native(rtol=rtol).run(demo).force_evaluations for rtol in ACCURACIES[1:]]
    assert hc.Native().run(demo).force_evaluations == costs[ACCURACIES.index(1e-6) - 1]
    assert costs == sorted(costs)
    assert costs[-1] > 5 * costs[0]


def test_peaks_alone_are_the_same_peaks(demo: hc.Scene) -> None:
    whole, peaks = hc.Native(rtol=1e-8).run(demo), hc.Native(rtol=1e-8, peaks_only=True).run(demo)
    assert np.array_equal(whole.peak_force, peaks.peak_force)
    assert np.array_equal(whole.peak_time, peaks.peak_time)
    assert whole.transition_granules == peaks.transition_granules
    assert np.all(np.isnan(peaks.displacement))
    # Of what was left behind too; the end of the run is another, which only rounding shows.
    assert peaks.balance.momentum == pytest.approx(whole.balance.momentum, rel=1e-12, abs=0)
    assert peaks.balance.energy == pytest.approx(whole.balance.energy, rel=1e-8, abs=0)
    assert peaks.steps < whole.steps


@pytest.mark.parametrize("rtol", [0.0, -1e-6, 1e-11, 0.1, float("nan"), float("inf"), True])
def test_impossible_accuracies_are_refused(rtol: float) -> None:
    with pytest.raises(hc.HertzchainError, match=r"rtol .* must be a number from 1e-10 to 0\.01"):
        hc.Native(rtol=rtol)


@pytest.mark.parametrize("too_much", [{"method": "rk4"}, {"dt": 1e-8}])
def test_accuracy_and_step_do_not_go_together(too_much: dict[str, Any]) -> None:
    with pytest.raises(hc.HertzchainError, match="rtol"):
        hc.Native(rtol=1e-6, **too_much)


def test_peaks_alone_have_no_history(demo: hc.Scene) -> None:
    with pytest.raises(hc.HertzchainError, match="peaks_only"):
        hc.Native(peaks_only=True).run(demo, record=[1e-5])


def test_hard_scenes_are_told_apart() -> None:
    assert is_short(9.0, 4)
    assert not is_short(2.0, 60)
    ratios = np.array([0.01, 0.1, 5.0, 20.0])
    assert plans.is_known(ratios, 2.0, 60).tolist() == [False, True, True, False]


def test_known_scenes_are_those_that_random_scenes_are_drawn_from() -> None:
    for limit, beyond in zip(RATIOS, (0.0, np.inf), strict=True):
        ratios = np.array([limit, np.nextafter(limit, beyond)])
        assert plans.is_known(ratios, np.full(2, 2.0), 60).tolist() == [True, False]
    for limit, beyond in zip(DURATIONS, (0.0, np.inf), strict=True):
        durations = np.array([limit, np.nextafter(limit, beyond)])
        assert plans.is_known(np.ones(2), durations, 60).tolist() == [True, False]
    assert plans.is_known(1.0, 2.0, GRANULES)
    assert not plans.is_known(1.0, 2.0, GRANULES + 1)


def test_steps_are_as_short_as_the_accuracy_needs() -> None:
    """From 1e-4 on a batch need not follow contacts that open; a checked run always does."""
    walkers = [plans.cheapest(rtol, checked=False).walker for rtol in (1e-4, 0.99e-4)]
    assert [walker.tolerance > 0 for walker in walkers] == [False, True]
    assert plans.cheapest(1e-2).walker.tolerance > 0


def test_a_batch_checks_what_was_not_measured() -> None:
    # Beyond the longest pulse measured the error is estimated from a second run, and by chance
    # alone it would be the one that measured scenes are said to have.
    n = np.array([DURATIONS[1], 1.01 * DURATIONS[1]])
    for batch in (
        hc.similar_peak_forces("cosine", 2.0, n, 10, 1e-6),
        hc.peak_forces([paper_scene("cosine", 2.0, float(k), 10) for k in n], 1e-6),
    ):
        known = plans.cheapest(1e-6, checked=False).error
        # Round-off of a few thousand evaluations, 4e-14, is added.
        assert batch.error_estimate[0] == pytest.approx(known, rel=1e-6, abs=0)
        assert abs(batch.error_estimate[1] / known - 1) > 0.01


@pytest.mark.parametrize(
    ("hard", "error", "factor"),
    [
        # Half of what is wanted; a thousand times closer at most.
        *((False, error, 0.5e-6 / error) for error in (1.1e-6, 1e-5, 0.49e-3)),
        *((False, error, 1e-3) for error in (0.51e-3, np.inf)),
        # With terms a hundred thousand times closer at most.
        *(
            (True, error, factor)
            for error, factor in ((0.04, 1.25e-5), (0.06, 1e-5), (np.inf, 1e-3))
        ),
    ],
)
def test_how_much_closer_the_next_plan_is(hard: bool, error: float, factor: float) -> None:
    plan = plans.cheapest(1e-6, hard=hard)
    closer = plan.closer(1e-6, error, has_terms=hard)
    tolerance = closer.walker.tolerance / plan.walker.tolerance
    assert tolerance == pytest.approx(factor, rel=1e-12, abs=0)
    if not hard:
        # Errors go as the step to the power of the order, one more where the motion is smooth.
        assert (closer.step / plan.step) ** 7 == pytest.approx(factor, rel=1e-12, abs=0)


TWICE = hc.PulseTable((0.0, 1e-5, 2e-5, 2e-4, 2.1e-4, 2.2e-4), (0.0, 10.0, 0.0, 0.0, 100.0, 0.0))
TABLE = hc.PulseTable((1e-5, 3e-5, 6e-5, 7e-5), (40.0, 100.0, 20.0, 0.0))
CUT_SHORT = paper_scene("cosine", 3.0, 3.0, granules=20)
CUT_SHORT = replace(CUT_SHORT, run=hc.Run(CUT_SHORT.ramps[0].end * 1.5))


@pytest.mark.parametrize(
    ("scene", "rtol"),
    [
        *((hc.Scene(hc.Chain(30, **STEEL), TABLE), rtol) for rtol in (1e-4, 1e-7, 1e-10)),
        *((hc.Scene(hc.Chain(2, **STEEL), TWICE), rtol) for rtol in (1e-6, 1e-7)),
        *((hc.Scene(hc.Chain(3, **STEEL), TWICE), rtol) for rtol in (1e-3, 1e-9)),
        (CUT_SHORT, 1e-7),
    ],
)
def test_tables_and_runs_cut_short_are_had_as_accurately(scene: hc.Scene, rtol: float) -> None:
    true = hc.Native("reference", dt=scene.units.time / 80).run(scene).peak_force
    result = hc.Native(rtol=rtol).run(scene)
    assert largest_difference(result.peak_force, true) <= result.error_estimate <= rtol


@pytest.mark.parametrize(
    ("profile", "ratio", "duration", "granules", "rtol"),
    [
        ("cosine-triangular", 100.0, 1000.0, 3, 1e-2),
        ("cosine-triangular", 24.235928880280113, 148.11619039041648, 4, 6.65e-5),
        ("cosine", 100.0, 60.0, 10, 1e-2),
        ("triangular", 100.0, 60.0, 40, 1e-2),
    ],
)
def test_chains_that_are_short_for_their_pulse(
    profile: str, ratio: float, duration: float, granules: int, rtol: float
) -> None:
    scene = paper_scene(profile, ratio, duration, granules)
    true = hc.Native("reference").run(scene).peak_force
    single = hc.Native(rtol=rtol, peaks_only=True).run(scene)
    assert largest_difference(single.peak_force, true) <= single.error_estimate <= rtol
    batch = hc.peak_forces([scene], rtol)
    assert largest_difference(batch.peak_force[0], true) <= batch.error_estimate[0] <= rtol
