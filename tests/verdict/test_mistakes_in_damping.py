"""Mistakes planted in damped contacts: each is seen and named, and right contacts are not."""

from __future__ import annotations

from contextlib import nullcontext

import pytest

from validation import mistakes_in_damping
from validation.mistakes_in_damping import (
    DASHPOT_LAW,
    MISTAKES_IN_DAMPING,
    RESTITUTION_LAW,
    TOLERANCE,
    VISCOELASTIC_LAW,
    DampingMistake,
    by_collision,
    by_judgement,
    plant_in_damping,
)

NONE = [
    *(DampingMistake("none", nullcontext, law) for law in (RESTITUTION_LAW, DASHPOT_LAW)),
    DampingMistake("none", nullcontext, VISCOELASTIC_LAW),
    DampingMistake("none", nullcontext, RESTITUTION_LAW, at_wall=True),
]
"""A context without a mistake."""


@pytest.mark.parametrize("mistake", MISTAKES_IN_DAMPING, ids=lambda mistake: mistake.what)
def test_a_collision_sees_it(mistake: DampingMistake) -> None:
    found = by_collision(mistake)
    assert found.passed
    assert abs(found.measured - found.expected) > 1e4 * found.tolerance


@pytest.mark.slow
@pytest.mark.parametrize("mistake", MISTAKES_IN_DAMPING, ids=lambda mistake: mistake.what)
def test_a_judgement_names_it(mistake: DampingMistake) -> None:
    if mistake.cause is None:
        # The wave passes the last contact but the wall's before it meets the wall.
        assert mistake.at_wall
    else:
        assert by_judgement(mistake, mistake.cause).passed


@pytest.mark.parametrize("right", NONE, ids=lambda mistake: f"{mistake.law.damping}")
def test_right_contacts_are_not_seen(right: DampingMistake) -> None:
    found = by_collision(right)
    assert not found.passed
    # A thousandth of the tolerance.
    assert abs(found.measured - found.expected) < 1e-3 * TOLERANCE
    assert not by_judgement(right, "").passed


def test_a_mistake_that_goes_unnoticed_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mistakes_in_damping, "MISTAKES_IN_DAMPING", (NONE[0],))
    assert [row.passed for row in plant_in_damping(False)] == [False]
