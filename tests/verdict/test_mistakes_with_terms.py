"""Mistakes are planted in scenes with terms, and have to be caught and named."""

from __future__ import annotations

import contextlib
from collections.abc import Callable

import pytest

import hertzchain as hc
from tests.verdict.test_seeded_mistakes import EXAMINATION, failed
from validation.mistakes import compared
from validation.mistakes_with_terms import (
    CONSTANT,
    MISTAKES_WITH_TERMS,
    RADIUS,
    START_VELOCITY,
    WALL,
    column,
    scene_with_gaps,
)
from validation.planting import POSITION, STIFFNESS, Mistake

HELD = {RADIUS, WALL, CONSTANT, START_VELOCITY}
"""The checks that name a wrong term."""

UNBALANCED = (
    "static overlaps of half the load",
    "static overlap of the contact before, everywhere",
)

AT_THE_WALL = ("wall twice as stiff", "wall damped")


@pytest.mark.lammps
@pytest.mark.parametrize(
    "mistake",
    [
        pytest.param(one, marks=[] if k % 3 == 0 else pytest.mark.slow)
        for k, one in enumerate(MISTAKES_WITH_TERMS)
    ],
    ids=lambda mistake: mistake.what,
)
def test_a_mistake_is_caught_and_named_first(mistake: Mistake) -> None:
    comparison = compared(mistake)
    assert comparison.verdict == "fail"
    wrong = [check for check in comparison.checks if not check.passed]
    first = next(check for check in wrong if check.name in EXAMINATION | HELD)
    assert first.name == mistake.check
    # A run that fails is reported before its deck is examined.
    assert {check.name for check in wrong[: wrong.index(first)]} <= {"lammps: failed"}
    if mistake.what in AT_THE_WALL:
        assert "the wall" in first.reason
    if mistake.what in UNBALANCED:
        assert POSITION in failed(comparison.checks)


@pytest.mark.lammps
@pytest.mark.parametrize("make", [column, scene_with_gaps])
def test_without_a_mistake_nothing_is_caught(make: Callable[[], hc.Scene]) -> None:
    nothing = Mistake("nothing", contextlib.nullcontext, STIFFNESS, made_in=make)
    comparison = compared(nothing)
    assert failed(comparison.checks) == set()
    assert {check.name for check in comparison.checks} > EXAMINATION | HELD


@pytest.mark.lammps
def test_motions_alone_do_not_show_static_overlaps_that_all_simulations_share() -> None:
    """Every run is wrong in the same way: the numbers of the deck show it, and nothing else."""
    everywhere = next(one for one in MISTAKES_WITH_TERMS if one.what == UNBALANCED[1])
    wrong = failed(compared(everywhere).checks)
    assert wrong == {everywhere.check, WALL, "lammps: distance of neighbours [m]"}
