"""The comparison can fail: mistakes are planted, and have to be caught and named.

All of them are in ``python -m validation mistakes``; some are here.
"""

from __future__ import annotations

import contextlib
from dataclasses import replace

import pytest

import hertzchain as hc
from hertzchain.engines.lammps import deck
from hertzchain.engines.lammps.engine import command, engine
from hertzchain.errors import RunFailed
from hertzchain.verdict.check import Check
from hertzchain.verdict.comparison import number_checks
from tests.conftest import paper_scene
from validation.mistakes import (
    APPLIED,
    CONSTANT,
    MISTAKES,
    MISTAKES_WITH_TERMS,
    POSITION,
    RADIUS,
    START_VELOCITY,
    STIFFNESS,
    WALL,
    Mistake,
    Plant,
    compared,
    in_set_up,
    small_scene,
)

EXAMINATION = {
    "lammps: number of granules",
    "lammps: place of granules [m]",
    "lammps: mass [kg]",
    "lammps: stiffness of the contacts [N m^-1.5]",
    "lammps: exponent of the contact law",
    "lammps: damping [N]",
    "lammps: friction [N]",
    "lammps: applied force [N]",
}
"""The checks that name a mistake in a deck."""

NONE = Mistake("nothing", contextlib.nullcontext, STIFFNESS)


def failed(checks: tuple[Check, ...]) -> set[str]:
    return {check.name for check in checks if not check.passed}


def seen(plant: Plant, name: str) -> Check:
    """A check of the examination under a mistake."""
    with plant():
        scene = small_scene()
        checks = number_checks(scene, hc.Lammps().examine(scene))
    return next(check for check in checks if check.name == name)


# Every mistake


@pytest.mark.lammps
@pytest.mark.parametrize("mistake", MISTAKES[::2], ids=lambda mistake: mistake.what)
def test_a_mistake_is_caught_and_named(mistake: Mistake) -> None:
    comparison = compared(mistake)
    assert comparison.verdict == "fail"
    wrong = failed(comparison.checks)
    assert mistake.check in wrong
    # Right numbers of a deck pass; another law has another stiffness, too.
    innocent = EXAMINATION - {mistake.check}
    if mistake.what == "contact law linear":
        innocent -= {STIFFNESS}
    if mistake.what == "steps that pass over the corners":
        innocent -= {APPLIED}
    assert wrong & innocent == set()
    if mistake.what == "peaks of samples only, everywhere":
        # Both backends agree then; the reference is no longer a yardstick.
        assert wrong == {mistake.check}


@pytest.mark.lammps
def test_without_a_mistake_nothing_is_caught() -> None:
    comparison = compared(replace(NONE, pair_style="gran/hertz/history", read_every=1))
    assert failed(comparison.checks) == set()
    assert {check.name for check in comparison.checks} > EXAMINATION
    assert comparison.verdict == "pass"


# The number of granules


@pytest.mark.lammps
@pytest.mark.parametrize("granules", [2, 4999, 5000])
def test_the_deck_makes_as_many_granules_as_asked_for(granules: int) -> None:
    """LAMMPS makes its box a ten-thousandth longer at both ends; granules must not fill that."""
    scene = paper_scene("cosine", 1.0, 2.0, granules=granules)
    with engine() as lammps:
        command(lammps, deck.set_up(scene))
        assert lammps.get_natoms() == granules
    checks = number_checks(scene, hc.Lammps().examine(scene))
    assert failed(tuple(checks)) == set()


@pytest.mark.lammps
def test_one_granule_more_is_refused_and_named() -> None:
    plant = in_set_up((" block -0.5 11.5 ", " block -0.5 12.5 "))
    check = seen(plant, "lammps: number of granules")
    assert (check.measured, check.expected, check.passed) == (13.0, 12.0, False)
    with plant(), pytest.raises(RunFailed, match="made 13 granules of a chain of 12"):
        hc.Lammps().run(small_scene())
    comparison = compared(replace(NONE, plant=plant))
    assert failed(comparison.checks) == {"lammps: failed", "lammps: number of granules"}


# Examined numbers


@pytest.mark.lammps
def test_a_deck_that_lammps_refuses_is_a_failed_check() -> None:
    plant = in_set_up(("units si", "units none_such"))
    comparison = compared(replace(NONE, plant=plant))
    assert comparison.verdict == "fail"
    assert failed(comparison.checks) == {"lammps: failed", "lammps: not examined"}


# In scenes with terms

HELD = {RADIUS, WALL, CONSTANT, START_VELOCITY}
"""The checks that name a wrong term."""

UNBALANCED = (
    "static overlaps of half the load",
    "static overlap of the contact before, everywhere",
)

AT_THE_WALL = ("wall twice as stiff", "wall damped")


@pytest.mark.lammps
@pytest.mark.parametrize("mistake", MISTAKES_WITH_TERMS[::3], ids=lambda mistake: mistake.what)
def test_a_mistake_in_a_term_is_caught_and_named_first(mistake: Mistake) -> None:
    comparison = compared(mistake)
    assert comparison.verdict == "fail"
    # Without a mistake nothing fails, or another check would be the first for some of them.
    wrong = [check for check in comparison.checks if not check.passed]
    first = next(check for check in wrong if check.name in EXAMINATION | HELD)
    assert first.name == mistake.check
    # A run that fails is reported before its deck is examined.
    assert {check.name for check in wrong[: wrong.index(first)]} <= {"lammps: failed"}
    if mistake.what in AT_THE_WALL:
        assert "the wall" in first.reason
    if mistake.what in UNBALANCED:
        assert POSITION in failed(comparison.checks)
    if mistake.what == UNBALANCED[1]:
        # Every run is wrong in the same way: the numbers of the deck show it, and nothing else.
        names = {mistake.check, WALL, "lammps: distance of neighbours [m]"}
        assert failed(comparison.checks) == names
