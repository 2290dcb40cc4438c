"""Method and step for a wanted accuracy, and batches: the peaks of single runs."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial
from typing import Any

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.engines.native import batch
from hertzchain.engines.native.batch import peak_forces, similar_peak_forces
from hertzchain.engines.native.plan import METHODS
from hertzchain.engines.native.simulation import simulate
from hertzchain.limits import Deadline
from hertzchain.observables.peaks import largest_difference
from hertzchain.scene.shocks import PROFILES
from tests.conftest import STEEL, paper_scene
from tests.scenes import FOLDER

RATIOS, DURATIONS, GRANULES = (0.05, 10.0), (1.1, 60.0), 500
"""LM_ratio, n and the longest chain of random scenes: outside nothing was measured."""

ACCURACIES = [1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10]


def spread(rng: np.random.Generator, low: float, high: float, number: int = 1) -> FloatArray:
    """Random numbers, even over decades."""
    return np.exp(rng.uniform(np.log(low), np.log(high), number))


@cache
def random_scenes(number: int, seed: int) -> list[tuple[hc.Scene, Any]]:
    """Scenes and their peaks by the reference [N]: LM, n and N spread evenly over decades."""
    rng, scenes = np.random.default_rng(seed), []
    walker, step = METHODS["reference"].walker, METHODS["reference"].step
    for _ in range(number):
        granules = int(spread(rng, 2, GRANULES + 1)[0])
        profile = list(PROFILES)[rng.integers(3)]
        ratio, duration = (float(spread(rng, *limits)[0]) for limits in (RATIOS, DURATIONS))
        scene = paper_scene(profile, ratio, duration, granules)
        legs = scene.schedule(step * scene.units.time)
        scenes.append((scene, 100 * simulate(scene, legs, walker, leave_behind=True).peaks.force))
    return scenes


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


SHIPPED = [
    hc.Scene.from_toml(FOLDER / "terms" / f"{name}.toml")
    for name in (
        "clamped", "dimer", "gapped", "light_defect", "local_shock", "newtons_cradle", "sine",
        "taper", "two_walls", "precompressed", "piston", "damped",
    )
] + [paper_scene("triangular", 0.02, 2.0, 12), paper_scene("cosine", 1.0, 2.0, 12)]  # fmt: skip


def test_results_of_many_scenes_are_those_of_single_runs() -> None:
    cut = [replace(scene, run=hc.Run(0.7 * scene.end_time)) for scene in SHIPPED[:4]]
    native = hc.Native(rtol=1e-4, peaks_only=True)
    scenes = SHIPPED + cut
    for scene, result in zip(
        scenes, batch.results_of(scenes, native, Deadline(600.0)), strict=True
    ):
        assert isinstance(result, hc.Result)
        numbers, same = result.numbers(), native.run(scene).numbers()
        for clock in ("wall_time_s", "compile_time_s"):
            del numbers[clock], same[clock]
        assert json.dumps(numbers, default=str) == json.dumps(same, default=str)


def test_a_batch_does_not_depend_on_order_company_or_cores() -> None:
    rng = np.random.default_rng(8)
    ratio, n = spread(rng, *RATIOS, 30), spread(rng, *DURATIONS, 30)

    def peaks(some: Any, rtol: float, cores: int) -> Any:
        batch = hc.similar_peak_forces("triangular", ratio[some], n[some], 60, rtol, cores=cores)
        return batch.peak_force, batch.peak_time, batch.error_estimate, batch.force_evaluations

    for rtol in (1e-4, 1e-6):
        together = peaks(slice(None), rtol, 2)
        some = rng.permutation(30)[:11]
        for cores in (1, 2):
            for column, other in zip(peaks(some, rtol, cores), together, strict=True):
                assert np.array_equal(column, other[some], equal_nan=True)


def test_unlike_scenes_of_a_batch_in_another_order() -> None:
    table = hc.Scene(hc.Chain(12, **STEEL), hc.PulseTable((0.0, 2e-5, 7e-5), (0.0, 60.0, 0.0)))
    scenes = [table, *(paper_scene(name, 0.5, n, 12) for name, n in (("cosine", 2), ("cosine", 9)))]
    first, two = peak_forces(scenes, 1e-4), peak_forces(scenes[::-1], 1e-4)
    for name in ("peak_force", "peak_time", "error_estimate"):
        np.testing.assert_array_equal(getattr(first, name), getattr(two, name)[::-1])


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
    peaks = hc.Native("reference").run(paper_scene("cosine", 1.0, 2.0, 4)).peak_force
    assert frame["peak_force_N"].to_numpy()[:3] == pytest.approx(peaks, rel=1e-4, abs=0)


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


DAMPED = hc.Scene(
    hc.Chain(4, **STEEL), hc.Striker(0.5), contact=hc.Contact("dashpot", coefficient=5.0)
)
FOUR, FIVE = (paper_scene("cosine", 1.0, 2.0, granules) for granules in (4, 5))

REFUSED: list[tuple[str, Callable[[], object]]] = [
    *(
        (
            r"rtol .* must be a (finite number|number from 1e-10 to 0\.01)",
            partial(hc.Native, rtol=rtol),
        )
        for rtol in (0.0, -1e-6, 1e-11, 0.1, float("nan"), float("inf"), True)
    ),
    ("rtol", lambda: hc.Native("rk4", rtol=1e-6)),
    ("rtol", lambda: hc.Native(rtol=1e-6, dt=1e-8)),
    *(("dt", partial(hc.Native, dt=dt)) for dt in (0.0, -1.0, float("nan"), float("inf"))),
    ("rk4", lambda: hc.Native("euler")),
    *(
        (f"{key}.*left out for damped", lambda how=how: hc.Native(**how).run(DAMPED))
        for key, how in (("method", {"method": "rk4"}), ("dt", {"dt": 1e-7}))
    ),
    ("must be left out for method scipy", lambda: hc.Native("scipy", dt=1e-6)),
    ("must be left out for method scipy", lambda: hc.Native("scipy", peaks_only=True)),
    ("peaks_only", lambda: hc.Native(peaks_only=True).run(FOUR, record=[1e-5])),
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
def test_what_is_impossible_is_refused(named: str, call: Callable[[], object]) -> None:
    with pytest.raises(hc.HertzchainError, match=named):
        call()
