"""Scenes side by side in vectors: the peaks of single runs, and no lane depends on the others."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.engines.native import elastic, lanes_kernel, lanes_loops, many
from hertzchain.engines.native import plan as plans
from hertzchain.engines.native.kernel_input import leg_rows
from hertzchain.engines.native.lanes_loops import Lanes, Motion
from hertzchain.engines.native.methods import SRKN_6B, SRKN_11B
from hertzchain.engines.native.refinement import Refined
from hertzchain.limits import Deadline
from hertzchain.observables.peaks import largest_difference
from hertzchain.scene.pulse import PROFILES, profile_named
from tests.conftest import STEEL, paper_scene

ACCURACIES = [1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10]

FIXED, HALVED = Refined(SRKN_11B, 0.0, 1, 0.0), Refined(SRKN_11B, 1e-6, 1, 4.0)


def spread(rng: np.random.Generator, low: float, high: float, number: int) -> FloatArray:
    """Random numbers, even over decades."""
    return np.exp(rng.uniform(np.log(low), np.log(high), number))


def rows_of(scenes: list[hc.Scene], step: float) -> FloatArray:
    """Legs of scenes with the same number of corners, as the kernels take them."""
    return np.stack(
        [leg_rows(scene.schedule(step * scene.units.time), scene.units) for scene in scenes]
    )


def random_rows(number: int, granules: int, step: float = 0.4) -> FloatArray:
    """Legs of random plain scenes, LM_ratio 0.05 to 10."""
    rng = np.random.default_rng(5)
    ratio, n = spread(rng, 0.05, 10.0, number), spread(rng, 1.1, 60.0, number)
    names = itertools.cycle(PROFILES)
    scenes = (paper_scene(*one, granules) for one in zip(names, ratio, n, strict=False))
    return rows_of(list(scenes), step)


def march(
    rows: FloatArray,
    walker: Refined,
    granules: int,
    leaves: bool = True,
    cores: int = 1,
) -> many.Found:
    """Peak forces and times, times reached and evaluations of scenes side by side."""
    may_leave = np.full(len(rows), leaves)
    return many.march_all(rows, walker, granules, may_leave, Deadline(600.0), cores)


def equal(one: many.Found, other: many.Found, of_other: Any = slice(None)) -> bool:
    """Return whether all results are equal bit by bit."""
    return all(
        np.array_equal(a, b[of_other], equal_nan=True) for a, b in zip(one, other, strict=True)
    )


@pytest.mark.parametrize("stepper", [SRKN_6B, SRKN_11B], ids=["srkn-6b", "srkn-11b"])
@pytest.mark.parametrize("walker", [FIXED, HALVED], ids=["fixed", "halved"])
@pytest.mark.parametrize("granules", [2, 3, 30])
def test_side_by_side_vs_one_by_one(
    stepper: Any, walker: Refined, granules: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    rows, walker = random_rows(21, granules), replace(walker, stepper=stepper)
    found, full = march(rows, walker, granules), march(rows, walker, granules, leaves=False)
    monkeypatch.setattr(many, "_LONGEST", 1)
    expected = march(rows, walker, granules, leaves=False)
    for force, time, *_ in (found, full):
        # The same steps: rounding errors of a few thousand evaluations.
        assert force == pytest.approx(expected[0], rel=1e-12, abs=1e-14)
        # A maximum is flat, but where a contact is still pressed harder at the end.
        assert np.nanmax(np.abs(time - expected[1])) < 1e-6
    assert full[2] == pytest.approx(expected[2], rel=1e-14, abs=0)
    assert np.array_equal(full[3], expected[3])


def test_a_run_that_ends_while_contacts_are_pressed(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is then still pressed harder counts, as one by one."""
    rows = random_rows(21, 30)
    for legs in rows:  # a tenth of the time after the pulse
        last = int(np.flatnonzero(legs[:, 2])[-1])
        legs[last, 1] = legs[last, 0] + (legs[last, 1] - legs[last, 0]) / 10
        legs[last, 2] = np.ceil(legs[last, 2] / 10)
    found = march(rows, FIXED, 30, leaves=False)
    monkeypatch.setattr(many, "_LONGEST", 1)
    expected = march(rows, FIXED, 30, leaves=False)
    at_end = [
        np.isclose(time, end[:, np.newaxis], rtol=1e-12, atol=0)
        for _, time, end, _ in (found, expected)
    ]
    assert np.count_nonzero(at_end[1]) > 20
    assert found[0] == pytest.approx(expected[0], rel=1e-12, abs=1e-14)
    felt = expected[0] > 1e-100  # a front below the least overlap counts in some runs alone
    assert np.array_equal(at_end[0][felt], at_end[1][felt])


@pytest.fixture
def in_python(monkeypatch: pytest.MonkeyPatch) -> None:
    """Functions of the lanes as they are written: they cannot be called one by one otherwise."""
    for module in (lanes_kernel, lanes_loops):
        for name, function in vars(module).items():
            if hasattr(function, "py_func"):
                monkeypatch.setattr(module, name, function.py_func)


def looked(work: float, over: bool = True) -> Any:
    """What ``_look`` does to scene 3, a leading wave of force 1 with a weak contact behind it."""
    overlaps = np.concatenate([[0.5], np.zeros(12), [0.4, 1.0, 0.3], np.zeros(4)])
    u = np.append(np.cumsum(overlaps[::-1])[::-1], 0.0)
    granules, k, number = u.size, 3, 8
    whole = np.zeros((3, number * (granules + 2)))
    whole[0, k : k + number * granules : number] = u
    whole[2] = 7.0
    scenes = np.zeros(number, lanes_kernel._SCENE).view(np.recarray)
    scenes[k].work, scenes[k].leg = work, 1
    highest = np.ones(number * (granules + 2))
    legs = np.zeros((number, 2, 8))
    legs[:, :, 3] = (1, 0) if over else (1, 1)
    none = np.zeros(0)
    lanes = Lanes(none, highest, none, none, none, none, scenes, legs)
    motion, one = Motion(*whole), np.zeros((3, granules + 1))
    ends = lanes_kernel._look(motion, lanes, k, True, granules - 1, one)
    energy = 0.4 * float(np.sum(overlaps**2.5))
    return ends, scenes[k], motion.force[k::number], energy


@pytest.mark.usefixtures("in_python")
def test_what_a_scene_leaves_behind_presses_nothing() -> None:
    ends, scene, force, _ = looked(work=1.0)
    assert (bool(ends), int(scene.behind)) == (False, 5)
    assert force[:6].tolist() == [0.0] * 6
    assert np.all(force[6:20] == 7.0)


@pytest.mark.usefixtures("in_python")
def test_nothing_is_left_behind_while_the_force_acts() -> None:
    assert looked(work=1.0)[1].behind == 5
    assert looked(work=1.0, over=False)[1].behind == 0


@pytest.mark.usefixtures("in_python")
def test_ten_times_the_work_is_divergence() -> None:
    energy = looked(work=1.0)[-1]
    for share, diverged in ((9.9, False), (10.1, True)):
        ends, scene, *_ = looked(work=energy / share)
        assert (bool(ends), bool(scene.diverged)) == (diverged, diverged)


@pytest.mark.parametrize("walker", [FIXED, HALVED], ids=["fixed", "halved"])
def test_no_lane_depends_on_the_others(walker: Refined) -> None:
    # Chains short for their pulse too, whose granules collide again and again.
    rows = np.concatenate([random_rows(26, 12), rows_of([paper_scene("cosine", 30, 3, 12)], 0.4)])
    together = march(rows, walker, 12)
    order = np.random.default_rng(1).permutation(len(rows))
    assert equal(march(rows[order], walker, 12), together, order)
    assert equal(march(rows, walker, 12, cores=3), together)
    for k in range(len(rows)):
        assert equal(march(rows[k : k + 1], walker, 12), together, slice(k, k + 1))


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


def test_lanes_that_diverge_leave_the_others_alone() -> None:
    # So many that several vectors follow one another on a core.
    rows = random_rows(140, 20)
    expected = march(rows, FIXED, 20)
    diverge = np.arange(140) % 7 == 3
    rows[diverge] = rows_of([paper_scene("cosine", 1.0, 2.0, 20)], 10.0)
    found = march(rows, FIXED, 20)
    assert np.array_equal(np.isnan(found[3]), diverge)
    others = ~diverge
    assert all(np.array_equal(a[others], b[others]) for a, b in zip(found, expected, strict=True))


def test_peaks_are_those_of_the_full_chain() -> None:
    """Dropped granules, and the early end after the last possible peak, change no bit."""
    ratios = [0.05, 0.1, 0.5, 0.5, 0.9, 1.0, 3.0, 10.0]
    rows = rows_of([paper_scene("cosine", ratio, 3.0, 250) for ratio in ratios], 0.4)
    left, full = (march(rows, FIXED, 250, leaves) for leaves in (True, False))
    assert np.array_equal(left[0], full[0])
    assert np.array_equal(left[1], full[1])
    assert np.all(left[3][:4] < full[3][:4])


def test_what_may_be_left_behind_is_left() -> None:
    """The window of a slow scene closes, but not where nothing may be left behind."""
    rows = rows_of([paper_scene("cosine", 0.5, 6.0, 60)] * 2, 0.4)
    may_leave = np.array([True, False])
    _, _, end, evaluations = many.march_all(rows, FIXED, 60, may_leave, Deadline(600.0), 1)
    assert end[0] < end[1]
    assert end[1] == rows[1, -1, 1]
    assert evaluations[0] < evaluations[1]


def test_maxima_where_an_overlap_turns_twice_in_a_step(monkeypatch: pytest.MonkeyPatch) -> None:
    """It rises at both ends of a step of one of these, with a maximum in between."""
    scenes = [
        paper_scene("cosine-triangular", ratio, n, 16)
        for n, ratio in zip(np.linspace(1.3, 1.45, 24), np.linspace(3.2, 3.5, 24), strict=True)
    ]
    rows = rows_of(scenes, 0.5)
    found = march(rows, FIXED, 16)
    monkeypatch.setattr(many, "_LONGEST", 1)
    expected = march(rows, FIXED, 16)
    assert found[0] == pytest.approx(expected[0], rel=1e-12, abs=0)


def test_long_chains_run_one_by_one(monkeypatch: pytest.MonkeyPatch) -> None:
    ran: list[str] = []

    def noted(name: str, function: Callable[..., Any]) -> Callable[..., Any]:
        def run(*arguments: Any) -> Any:
            ran.append(name)
            return function(*arguments)

        return run

    for module, name in ((elastic, "march"), (lanes_kernel, "march_lanes")):
        monkeypatch.setattr(module, name, noted(name, getattr(module, name)))
    monkeypatch.setattr(many, "_LONGEST", 12)
    for granules in (12, 13):
        march(random_rows(1, granules), FIXED, granules)
    assert ran == ["march_lanes", "march"]


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
