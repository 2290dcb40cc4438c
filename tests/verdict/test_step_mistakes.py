"""Parts of the search for steps and samples."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.arrays import Array
from hertzchain.limits import Deadline
from hertzchain.verdict.case import Case
from hertzchain.verdict.judgement import judged_peaks
from hertzchain.verdict.step_mistakes import mean_interval, round_steps, samples
from tests.verdict.test_mistakes import QUICK, Planting, planting


def case_of(at: Planting, given: Array) -> Case:
    reference = hc.Native("reference").run(at.scene)
    peaks = np.asarray(given, np.float64)
    return Case(
        at.scene,
        reference,
        peaks,
        judged_peaks(reference.peak_force, peaks),
        None,
        1e-3,
        Deadline(60),
    )


def test_the_interval_of_samples_follows_from_their_mean() -> None:
    distance = np.random.default_rng(0).uniform(-0.1, 0.1, 10_000)
    found = mean_interval(-0.4 * distance**2, np.full(10_000, -0.4))
    assert found == pytest.approx(0.2, rel=0.02)  # the mean of 10,000 squares is known to 1 %


@pytest.mark.parametrize(("contacts", "sought"), [(11, False), (12, True)])
def test_samples_are_sought_in_twelve_contacts(contacts: int, sought: bool) -> None:
    at = planting(QUICK[0])
    case = case_of(at, at.samples(0.3))
    few = replace(case, judged=np.arange(29) < contacts)
    assert bool(list(samples(few))) is sought


def test_steps_are_not_sought_where_one_is_known() -> None:
    at = planting(QUICK[0])
    case = case_of(at, 1.01 * at.truth)
    assert list(round_steps(replace(case, dt=1e-6))) == []
