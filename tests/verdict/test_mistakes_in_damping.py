"""Mistakes planted in damped contacts: each is seen and named, and right contacts are not."""

from __future__ import annotations

from contextlib import nullcontext

import pytest

import hertzchain as hc
from validation.mistakes_in_damping import (
    DASHPOT_LAW,
    MISTAKES_IN_DAMPING,
    RESTITUTION_LAW,
    TOLERANCE,
    VISCOELASTIC_LAW,
    DampingMistake,
    by_collision,
)
from validation.physics.chains import steel

NONE = [
    *(DampingMistake("none", nullcontext, law) for law in (RESTITUTION_LAW, DASHPOT_LAW)),
    DampingMistake("none", nullcontext, VISCOELASTIC_LAW),
    DampingMistake("none", nullcontext, RESTITUTION_LAW, at_wall=True),
]
"""A context without a mistake."""


def named(mistake: DampingMistake, cause: str) -> bool:
    """Whether a judgement of peaks to 1e-6 fails under a mistake, and names a cause first.

    The pulse is so short that contacts open while the wave is near. The scene is made under the
    mistake: it keeps what it has worked out.
    """
    pulse = hc.Pulse("cosine", 100.0, 2.0, momentum_ratio=0.5)
    with mistake.plant():
        scene = hc.Scene(steel(16), pulse, contact=mistake.law)
        peaks = hc.Native(rtol=1e-8).run(scene).peak_force
    judgement = hc.judge(hc.Scene(steel(16), pulse, contact=mistake.law), peaks, tolerance=1e-6)
    return judgement.verdict == "fail" and cause in (judgement.cause or "").split("; or ")[0]


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
        assert named(mistake, mistake.cause)


@pytest.mark.parametrize("right", NONE, ids=lambda mistake: f"{mistake.law.damping}")
def test_right_contacts_are_not_seen(right: DampingMistake) -> None:
    found = by_collision(right)
    assert not found.passed
    # A thousandth of the tolerance.
    assert abs(found.measured - found.expected) < 1e-3 * TOLERANCE
    assert not named(right, "")
