"""Error bounds against errors that are known."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.engines.external.accuracy import (
    extrapolation_safety,
    least_gain,
    rival_errors,
)
from hertzchain.errors import StepUnstable, Unpredictable
from hertzchain.observables.error_bound import (
    SAFETIES,
    ContactErrors,
    Safety,
    amplifies_errors,
    coarser_run,
    finer_run,
    refuse_meaningless,
    second_order_safety,
    step_for,
)
from hertzchain.observables.peaks import largest_difference
from hertzchain.observables.samples import DampedLaw
from hertzchain.observables.watch import PeakWatch
from hertzchain.scene.schedule import Leg
from tests import scenes
from tests.conftest import paper_scene

ROUND_OFF = 1e-12
"""Differences of 1e-3 or more of numbers of order 1."""


def legs_of(*steps: int) -> tuple[Leg, ...]:
    """Legs of length 1, without force, with so many steps."""
    return tuple(Leg(float(k), k + 1.0, count, None) for k, count in enumerate(steps))


def error(legs: Sequence[Leg], weights: Sequence[float]) -> float:
    """A second-order error: a sum over the legs of C h^2."""
    return sum(c * leg.dt**2 for c, leg in zip(weights, legs, strict=True))


@given(st.lists(st.tuples(st.integers(1, 1000), st.floats(1e-3, 1.0)), min_size=1, max_size=6))
def test_weight_bounds_the_error_of_many_legs(legs: list[tuple[int, float]]) -> None:
    """Whichever leg makes it, as long as the legs do not cancel each other."""
    fine, weights = legs_of(*(steps for steps, _ in legs)), [c for _, c in legs]
    other = coarser_run(fine, math.inf)
    difference = abs(error(other.legs, weights) - error(fine, weights))
    assert other.weight * difference >= error(fine, weights) * (1 - ROUND_OFF)


@pytest.mark.parametrize(("stable", "other"), [(1.5 / 0.85 * 1.001, 6), (1.5 / 0.85 * 0.999, 27)])
def test_a_coarser_run_has_no_step_near_what_is_unstable(stable: float, other: int) -> None:
    """Two thirds of nine steps of 1/9 are steps of 1.5/9, up to 0.85 of the longest stable one."""
    assert coarser_run(legs_of(9), stable / 9).legs[0].steps == other


def test_a_bound_is_the_largest_weighted_difference_times_the_safety_and_the_rest() -> None:
    """Small pulses on a static force have larger relative errors, times a factor of their own."""
    safety, dynamic = Safety("a kind", 3.0, 2.0, 4.0, 2.0), np.array([1.0, 0.5])
    differences = [
        ContactErrors(np.array([peak, math.nan]), pulse, pulse, pulse, pulse, dynamic)
        for peak, pulse in ((1e-3, np.full(2, 2e-3)), (3e-3, np.full(2, 1e-3)))
    ]
    errors = safety.bounds(differences, [1.0, 0.5], rest=1e-5)
    assert errors.peak == pytest.approx([3 * 1.5e-3 + 1e-5, math.nan], nan_ok=True)
    assert errors.first == pytest.approx([3 * 2e-3 + 1e-5, 3 * 2e-3 + 2e-5])
    assert errors.arrival == pytest.approx(np.array([8e-3 + 1.5e-5, 8e-3 + 3e-5]))
    assert errors.width == pytest.approx(errors.arrival)
    floored = safety.bounds(differences, rest=1e-5, least=0.1)
    assert floored.first == pytest.approx(0.10001 / dynamic)
    # Differences from a run that has errors itself.
    assert errors.plus(floored).peak[0] == pytest.approx(1.00451 * 1.10001 - 1)


def test_an_error_of_1_leaves_no_digit() -> None:
    refuse_meaningless("native", math.nextafter(1.0, 0.0), too_long=True)
    with pytest.raises(StepUnstable, match="its step is too long"):
        refuse_meaningless("native", 1.0, too_long=True)
    with pytest.raises(Unpredictable, match="amplify rounding errors"):
        refuse_meaningless("native", 1.0, too_long=False)


# The step for a wanted error


@pytest.mark.parametrize("wanted", [1e-5, 1e-6, 3e-8])
@pytest.mark.parametrize("coefficient", [0.4, -0.4])
def test_step_gives_the_wanted_error_where_errors_are_quadratic(
    wanted: float, coefficient: float
) -> None:
    asked: list[float] = []

    def peaks_at(step: float) -> FloatArray:
        asked.append(step)
        return np.array([1.0, 2.0 * (1.0 + coefficient * step**2), 0.5])

    step = step_for(peaks_at, 0.04, wanted, SAFETIES["smooth"])
    assert asked == [0.04, 0.02]
    # The bound, 1.5 times the error, is to be 0.9 of what is wanted; the difference of the two
    # trials is relative to the second, which is itself off by 2e-4.
    assert 1.5 * 0.4 * step**2 == pytest.approx(0.9 * wanted, rel=3e-4, abs=0)


# Bounds of whole runs


@pytest.mark.parametrize("method", ["velocity-verlet", "rk4"])
@pytest.mark.parametrize("dt", [0.2, 0.05, 0.0125])
def test_bound_of_a_run_vs_its_error(method: str, dt: float) -> None:
    scene = paper_scene("cosine-triangular", 1.3, 2.5, granules=10)
    exact = hc.Native("reference").run(scene).peak_force
    result = hc.Native(method, dt=dt * scene.units.time).run(scene)
    true_error = largest_difference(result.peak_force, exact)
    # The reference is right to 1e-11; a bound 100 times too large would be no help.
    assert true_error <= result.error_estimate + 1e-11
    assert result.error_estimate < 100 * true_error


@pytest.mark.parametrize("name", ["cosine_LM1.4_n2", "cosine_LM1.6_n4", "triangular_LM2_n4"])
def test_what_refinement_leaves_is_in_the_bound_of_the_reference(name: str) -> None:
    """It does not depend on the step, so that two runs may agree better than they are right."""
    scene = scenes.load(name)
    exact = hc.Native("reference", peaks_only=True).run(scene).peak_force
    twice = hc.Native("reference", 0.1 * scene.units.time, peaks_only=True).run(scene)
    # Off by 5e-12, of which the two runs tell 1e-12; the usual step is right to 3e-13.
    assert largest_difference(twice.peak_force, exact) <= twice.error_estimate < 2e-11


@pytest.mark.parametrize(
    ("rival", "above"),
    [
        (0.97, 0.01),  # lower, but by less than twice what the steps add to the first
        (0.95, 0.0),
        (1.01, 0.05),
    ],
)
def test_a_second_maximum_may_be_the_highest_without_what_steps_do(
    rival: float, above: float
) -> None:
    # The steps add 0.02 to the maximum of the first contact; the second has no other one.
    seen = SimpleNamespace(force=np.array([1.02, 1.0]), rival=np.array([rival, 0.0]))
    errors = rival_errors(cast(PeakWatch, seen), np.array([1.0, 1.0]))
    assert errors == pytest.approx(
        [above, 0.0], rel=1e-12, abs=1e-15
    )  # differences of numbers near 1


# Both sides of what makes an error larger


ELASTIC, SHORT = (paper_scene("cosine", 2.0, 2.0, granules) for granules in (10, 9))
DAMPED = replace(ELASTIC, contact=hc.Contact("restitution", restitution=0.9))
TABLE = hc.PulseTable((0.0, 1e-5, 2e-5), (0.0, 100.0, 0.0))


@pytest.mark.parametrize(
    ("finer", "steps", "other", "weight"),
    [
        # Two thirds of the steps, of many; or thrice as many.
        (False, (9, 300), (6, 200), 1 / ((3 / 2) ** 2 - 1)), (False, (4,), (2,), 1 / 3),
        (False, (7,), (4,), 1 / ((7 / 4) ** 2 - 1)), (False, (1, 7, 2), (3, 21, 6), 9 / 8),
        # A quarter more, and one more at least.
        (True, (9,), (11,), 1 / (1 - (9 / 11) ** 2)), (True, (1,), (2,), 4 / 3),
        (True, (100, 3, 8), (125, 4, 10), 1 / (1 - (4 / 5) ** 2)),
    ],
)  # fmt: skip
def test_steps_of_the_second_run(
    finer: bool, steps: tuple[int, ...], other: tuple[int, ...], weight: float
) -> None:
    run = finer_run(legs_of(*steps)) if finer else coarser_run(legs_of(*steps), math.inf)
    assert tuple(leg.steps for leg in run.legs) == other
    assert run.weight == pytest.approx(weight, rel=1e-15, abs=0)


@pytest.mark.parametrize(
    ("step", "rising", "safety"),
    [(0.15, False, 1.5), (0.151, False, 6.0), (0.5, True, 6.0), (0.501, True, 15.0)],
)
def test_long_steps_and_contacts_that_rise_need_more_safety(
    step: float, rising: bool, safety: float
) -> None:
    """Seen: 1.95 times the estimate above 0.15; at a rising end 2.9, above 0.5 there 6.8 times."""
    assert second_order_safety(ELASTIC, step, rising).factor == safety
    for each in SAFETIES.values():
        assert 1.04 * each.measured < each.factor
        assert 1.04 * (each.measured_of_times or each.measured) < each.factor_of_times


@pytest.mark.parametrize(
    ("scene", "rising", "steps", "factor", "by_chance"),
    [
        # Agreement by chance leaves a part that goes as the longest step to the power of 2.5.
        (ELASTIC, False, 100, 1, 0.005 * 0.04**2.5), (SHORT, False, 100, 3, 0.05 * 0.04**2.5),
        (ELASTIC, True, 16, 3, 0.05 * 0.04**2.5), (ELASTIC, True, 15, 6, 0.05 * 0.04**2.5),
        (DAMPED, False, 100, 6, 0.0), (DAMPED, True, 100, 6, 0.1 * 0.04),
        (replace(DAMPED, shock=hc.Striker(0.1)), False, 100, 6, 0.0),
    ],
)  # fmt: skip
def test_an_extrapolation_is_believed_less_where_errors_are_erratic(
    scene: hc.Scene, rising: bool, steps: int, factor: int, by_chance: float
) -> None:
    law = DampedLaw.of_elastic(np.ones(len(scene.contacts)))
    peaks = PeakWatch(law, np.ones(scene.bodies))  # has not seen anything
    step = 0.04 * scene.contact_time
    legs = (Leg(0.0, steps * step, steps, None), Leg(0.0, 0.0, 4, None))
    safety, added = extrapolation_safety(scene, legs, peaks, rising)
    assert safety.factor == factor
    assert added == pytest.approx(by_chance, rel=1e-12)
    assert least_gain(scene) == (2 if scene.striker else 4)
    assert amplifies_errors(scene) == (scene is not ELASTIC)
    assert amplifies_errors(replace(ELASTIC, shock=TABLE))
