"""Batches: the same peaks as one by one, for scenes and for numbers."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.engines.native import plan as plans
from hertzchain.engines.native.batch import peak_forces, similar_peak_forces
from hertzchain.observables.peaks import largest_difference
from tests.conftest import STEEL, paper_scene

SOFT = {"radius": 1e-3, "young_modulus": 3e9, "poisson_ratio": 0.4, "density": 1180.0}


def scenes() -> list[hc.Scene]:
    """Chains of 20 granules: two materials, three profiles, a table, a hard scene, an early end."""
    table = hc.PulseTable((1e-5, 3e-5, 6e-5), (40.0, 100.0, 20.0))
    early = paper_scene("cosine", 1.0, 2.0, 20)
    return [
        paper_scene("cosine", 0.4, 3.0, 20),
        hc.Scene(hc.Chain(20, **SOFT), hc.Pulse("triangular", 0.1, 4.0, momentum_ratio=2.0)),
        paper_scene("cosine-triangular", 9.0, 2.0, 20),
        hc.Scene(hc.Chain(20, **STEEL), table),
        hc.Scene(early.chain, early.shock, hc.Run(early.end_time / 2)),
    ]


@pytest.mark.parametrize("rtol", [1e-3, 1e-4, 1e-6, 1e-9])
def test_a_batch_vs_one_by_one(rtol: float) -> None:
    batch = peak_forces(scenes(), rtol)
    assert batch.peak_force.shape == batch.peak_time.shape == (5, 19)
    assert np.all(batch.error_estimate <= rtol)
    for scene, force, time, error in zip(
        scenes(), batch.peak_force, batch.peak_time, batch.error_estimate, strict=True
    ):
        true = hc.Native("reference").run(scene)
        assert largest_difference(force, true.peak_force) <= error
        assert np.array_equal(np.isnan(time), np.isnan(true.peak_time))
        # A peak is flat: its time is off by the square root of what its force is off by.
        off = np.nanmax(np.abs(time - true.peak_time)) / scene.units.time
        assert off < 3 * np.sqrt(rtol)


def test_numbers_broadcast() -> None:
    batch = similar_peak_forces("cosine", [0.5, 1.0, 2.0], 2.0, 10)
    assert batch.peak_force.shape == (3, 9)
    assert similar_peak_forces("cosine", 1.0, 2.0, 10).peak_force.shape == (1, 9)


@pytest.mark.parametrize("rtol", [1e-3, 1e-4, 9e-5, 3e-5, 1e-5, 1e-7])
def test_a_batch_of_random_scenes_is_as_accurate_as_it_says(rtol: float) -> None:
    rng = np.random.default_rng(3)
    ratio = np.exp(rng.uniform(np.log(0.05), np.log(10), 200))
    n = np.exp(rng.uniform(np.log(1.1), np.log(60), 200))
    for granules in (5, 60):
        batch = similar_peak_forces("cosine-triangular", ratio, n, granules, rtol)
        true = similar_peak_forces("cosine-triangular", ratio, n, granules, 1e-10)
        pairs = zip(batch.peak_force, true.peak_force, strict=True)
        errors = np.array([largest_difference(*pair) for pair in pairs])
        assert np.all(batch.error_estimate <= rtol)
        assert np.all(errors <= batch.error_estimate + 1e-10)


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


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (([],), "scenes"),
        (([paper_scene("cosine", 1.0, 2.0, 4), paper_scene("cosine", 1.0, 2.0, 5)],), "granules"),
        (([paper_scene("cosine", 1.0, 2.0, 4)], 1e-12), "rtol"),
    ],
    ids=["none", "two lengths", "too accurate"],
)
def test_impossible_batches_are_refused(arguments: tuple[Any, ...], said: str) -> None:
    with pytest.raises(hc.HertzchainError, match=said):
        peak_forces(*arguments)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"profile": "square"}, "profile"),
        ({"momentum_ratio": [1.0, -1.0]}, "momentum_ratio"),
        ({"momentum_ratio": []}, "momentum_ratio"),
        ({"duration_ratio": 1.0}, "duration_ratio"),
        ({"granules": 1}, "granules"),
        ({"granules": 10.5}, "granules"),
        ({"momentum_ratio": "x"}, "momentum_ratio"),
        ({"momentum_ratio": [1.0, 2.0], "duration_ratio": [2.0, 3.0, 4.0]}, "duration_ratio"),
        ({"rtol": 1.0}, "rtol"),
    ],
    ids=str,
)
def test_impossible_numbers_are_refused(change: dict[str, Any], said: str) -> None:
    good: dict[str, Any] = {
        "profile": "cosine",
        "momentum_ratio": [1.0],
        "duration_ratio": 2.0,
        "granules": 5,
    }
    with pytest.raises(hc.HertzchainError, match=said):
        similar_peak_forces(**{**good, **change})
