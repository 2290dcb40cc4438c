"""Errors of LAMMPS runs are within their bounds: dashpots that close at a speed, late hard blows.

What is true comes from an independent solver: order 8, steps that end at contacts, 80 bits.
"""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.engines.external.step_error import usual_accuracy
from hertzchain.errors import Unpredictable
from hertzchain.observables.peaks import largest_difference
from hertzchain.verdict.comparison import compare
from tests.conftest import STEEL
from tests.oracles.bounds import lasting
from validation.random_drives import random_hard_scene

pytestmark = pytest.mark.lammps

GAPS = hc.Scene(
    hc.Chain(5, gap=1e-6, **STEEL),
    hc.Striker(1.0),
    contact=hc.Contact("dashpot", coefficient=500.0),
)
TRUE = np.array([500.0, 185.783452, 119.598186, 90.111754])  # each to 5e-9
LATE_BLOW = hc.Scene(
    hc.Chain(
        4,
        radius=(0.003314703394290296, *[0.0024408153634609014] * 2, 0.006359322660300662),
        young_modulus=(1329227108153.9133, *[163518955910.85895] * 2, 281952189320.8835),
        poisson_ratio=-0.337842832621993,
        density=(1009.6438934095372, *[7490.333982665544] * 2, 13764.554246927562),
        gap=(0.0, *[3.416938455569586e-07] * 3),
    ),
    hc.Pulse("triangular", 0.3216736092781682, 4.290700253765737, rise_time=0.0001785312076816918),
    hc.Run(0.004585358584143651),
    hc.Wall("elastic", 3507151349.8010793, 0.1870779367935715, gap=5.798022907763981e-09),
)
"""The first contact is pressed hardest by a blow that long steps make lower than the first."""


@functools.cache
def truth(scene: hc.Scene) -> hc.Result:
    return hc.Native(rtol=1e-9).run(scene)


TWO_GAPS = hc.Scene(
    hc.Chain(3, gap=3e-7, **STEEL),
    hc.Striker(1.0),
    contact=hc.Contact("dashpot", coefficient=100.0),
)
FLYING = random_hard_scene(np.random.default_rng([7, 1, 20047]), 30, 200.0, is_damped=True)
EXTRAPOLATED = hc.Lammps(rtol=3e-3, extrapolated=True, wanted="all")


@pytest.mark.parametrize(
    ("scene", "lammps", "least"),
    [
        *((GAPS, hc.Lammps(rtol=rtol), 0.0) for rtol in (1e-2, 3e-3, 1e-3)),
        (GAPS, hc.Lammps(rtol=1e-2, extrapolated=True), 0.0),
        pytest.param(GAPS, hc.Lammps(rtol=1e-3, extrapolated=True), 0.0, marks=pytest.mark.slow),
        # The error of a contact that closes within a step is no power of the step.
        (lasting(TWO_GAPS), EXTRAPOLATED, 1e-4),
        # Three extrapolations within a fifth of the error of the last, 1.0014 of the bound once.
        (FLYING, hc.Lammps(rtol=3.35e-3, extrapolated=True), 7e-4),
        *(
            (LATE_BLOW, hc.Lammps(dt, rtol=1 - 1e-9, extrapolated=extrapolated), 5e-3)
            for dt in (6.346564384108137e-07, 4.2e-7)
            for extrapolated in (False, True)
        ),
    ],
)
def test_errors_are_within_their_bounds(scene: hc.Scene, lammps: hc.Lammps, least: float) -> None:
    """Errors of which runs by chance say little are large, and stated."""
    result = lammps.run(scene)
    error = largest_difference(result.peak_force, truth(scene).peak_force)
    assert least < error < result.error_estimate < lammps.rtol


def test_the_truth_is_that_of_another_solver() -> None:
    assert truth(GAPS).peak_force == pytest.approx(TRUE, rel=1e-8)


def test_readings_too_rare_for_a_dashpot_say_so() -> None:
    """Every tenth of the decay of its force, every decay, and every ten decays."""
    stated = []
    for decays in (0.1, 1.0, 10.0):
        mass = GAPS.granules.mass[0]
        every = max(1, round(decays * mass / 1000.0 / 1e-9))
        try:
            result = hc.Lammps(1e-9, read_every=every).run(GAPS)
        except Unpredictable:
            stated.append(1.0)
            continue
        assert largest_difference(result.peak_force, TRUE) < result.error_estimate
        stated.append(min(result.error_estimate, 1.0))  # at 1 and above no digit is known
    assert stated[0] < 0.01
    assert 0.2 < stated[1] <= stated[2]


def test_compare_asks_for_what_takes_seconds() -> None:
    assert usual_accuracy(GAPS) == 1e-4
    assert usual_accuracy(replace(GAPS, contact=None)) == 1e-6


def test_a_scene_without_terms_states_what_it_did() -> None:
    """Second maxima count twice the error of the first there; a factor of 1.5 is enough."""
    scene = hc.Scene(hc.Chain(6, **STEEL), hc.Pulse("cosine", 100.0, 2.0, momentum_ratio=1.0))
    with_gap = replace(scene, chain=replace(scene.chain, gap=1e-15))
    dt = 0.05 * scene.contact_time
    plain, other = (hc.Lammps(dt).run(each).error_estimate for each in (scene, with_gap))
    assert 1.9 < other / plain < 2.1


def test_a_right_deck_with_dashpots_passes() -> None:
    comparison = compare(GAPS, [hc.Lammps(rtol=1e-2)])
    assert comparison.verdict == "pass", [
        check.name for check in comparison.checks if not check.passed
    ]
