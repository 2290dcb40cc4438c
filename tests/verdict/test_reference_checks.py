"""Checks of a run against the reference, contact by contact."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.verdict.reference_checks import reference_checks, yardstick_check
from tests.conftest import STEEL

SCENE = hc.Scene(hc.Chain(8, **STEEL), hc.Striker(1.0), wall=hc.Wall("rigid"))


@pytest.fixture(scope="module")
def reference() -> hc.Result:
    return hc.Native("reference").run(SCENE)


def verdicts(result: hc.Result, reference: hc.Result) -> dict[str, bool]:
    return {
        check.kind.name.split()[0]: check.passed for check in reference_checks(result, reference)
    }


def other(reference: hc.Result, force: float = 0.0, late: float = 0.0) -> hc.Result:
    """The reference with errors of 1e-5 and 1e-9 s, and one first pulse off by these numbers."""
    first, errors = reference.first_pulses, reference.errors
    assert first is not None
    assert errors is not None
    size = first.force.size
    third: FloatArray = np.arange(size) == 3
    said = replace(errors, first=np.full(size, 1e-5), arrival=np.full(size, 1e-9))
    moved = replace(
        first, force=first.force * (1 + force * third), arrival=first.arrival + late * third
    )
    return replace(reference, first_pulses=moved, errors=said)


@pytest.mark.parametrize(("off", "passed"), [(3e-5, False), (-3e-5, False), (3.3e-6, True)])
def test_first_pulses(reference: hc.Result, off: float, passed: bool) -> None:
    found = verdicts(other(reference, force=off), reference)
    assert found == {"peaks": True, "first": passed, "arrivals": True}


@pytest.mark.parametrize(("late", "passed"), [(3e-9, False), (-3e-9, False), (3.3e-10, True)])
def test_arrivals(reference: hc.Result, late: float, passed: bool) -> None:
    found = verdicts(other(reference, late=late), reference)
    assert found == {"peaks": True, "first": True, "arrivals": passed}


def test_no_clear_pulse_is_no_check(reference: hc.Result) -> None:
    """As where a piston presses a chain onto a wall: nothing comes alone."""
    first = reference.first_pulses
    assert first is not None
    blurred = replace(reference, first_pulses=replace(first, is_clear=first.is_clear & False))
    assert verdicts(other(reference), blurred) == {"peaks": True}


@pytest.mark.parametrize(("off", "passed"), [(3.0, False), (-3.0, False), (1 / 3, True)])
def test_gauges(off: float, passed: bool) -> None:
    """One of two is off by parts of what both say of their errors."""
    true = hc.Native("reference").run(
        replace(SCENE, gauges=(hc.Gauge(granule=4), hc.Gauge(contact=3)))
    )
    one, two = true.gauges
    said = one.force * 2 * one.force_error
    mine = replace(true, gauges=(replace(one, force=one.force + off * said), two))
    found = verdicts(mine, true)
    assert found == {"peaks": True, "first": True, "arrivals": True, "gauges": passed}


def test_a_pulse_that_is_missing_fails(reference: hc.Result) -> None:
    first, errors = reference.first_pulses, reference.errors
    assert first is not None
    assert errors is not None
    assert errors.first is not None
    gone = np.arange(first.force.size) == 3
    lacks = replace(
        reference,
        first_pulses=first.only(~gone),
        errors=replace(errors, first=np.where(gone, np.nan, errors.first)),
    )
    assert not verdicts(lacks, reference)["first"]
    # One of which no digit is known has an error: nothing is said of it.
    unknown = replace(lacks, errors=replace(errors, first=np.where(gone, 0.5, errors.first)))
    assert verdicts(unknown, reference)["first"]


def test_contacts_without_a_digit_are_not_judged(reference: hc.Result) -> None:
    errors = reference.errors
    assert errors is not None
    wrong = reference.peak_force.copy()
    wrong[3] *= 1.5
    chaotic = replace(errors, peak=np.where(np.arange(wrong.size) == 3, 0.6, errors.peak))
    assert verdicts(replace(reference, peak_force=wrong, errors=chaotic), reference)["peaks"]
    assert not verdicts(replace(reference, peak_force=wrong), reference)["peaks"]
    lost = replace(errors, peak=np.full(wrong.size, 1.5))
    assert "peaks" not in verdicts(replace(reference, errors=lost), reference)


def test_the_reference_is_asked_for_first_pulses(reference: hc.Result) -> None:
    """Late collisions may leave no digit of the peaks."""
    assert yardstick_check(replace(reference, error_estimate=1.0)).passed
    errors = reference.errors
    assert errors is not None
    assert errors.first is not None
    worse = replace(errors, first=errors.first + 3e-6)
    assert not yardstick_check(replace(reference, errors=worse)).passed


def test_runs_without_any_force_agree() -> None:
    """The striker has not crossed its gap yet."""
    scene = hc.Scene(hc.Chain(5, **STEEL, gap=1e-3), hc.Striker(1.0), hc.Run(1e-5))
    reference = hc.Native("reference").run(scene)
    assert verdicts(hc.Native().run(scene), reference) == {"peaks": True}
    pressed = replace(reference, peak_force=reference.peak_force + 1.0)
    assert verdicts(pressed, reference) == {"peaks": False}
