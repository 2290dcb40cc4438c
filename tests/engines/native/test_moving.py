"""Granules that move at the start, wherever they are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.errors import SceneError
from tests.conftest import STEEL
from tests.oracles.bounds import lasting

BEADS = 5
"""Beads of Newton's cradle."""


def cradle(velocity: list[float], wall: hc.Wall | None = None) -> hc.Scene:
    """Steel beads that touch, with a velocity of each [m/s]."""
    return hc.Scene(hc.Chain(len(velocity), **STEEL, velocity=velocity), wall=wall)


def flying(many: int) -> list[float]:
    return [1.0] * many + [0.0] * (BEADS - many)


@pytest.mark.parametrize("many", range(1, BEADS))
def test_newtons_cradle(many: int) -> None:
    """Momentum and energy stay; seen by the beads that flew it is the cradle of the others."""
    scene = lasting(cradle(flying(many)))
    found, other = (
        hc.Native("reference", dt=0.002 * scene.contact_time).run(one)
        for one in (scene, replace(scene, chain=cradle(flying(BEADS - many)).chain))
    )
    mass = scene.granules.mass[0]
    # Rounding of some thousand steps; that of energy grows with them, of order 11 otherwise.
    assert np.sum(found.velocity) == pytest.approx(many, rel=1e-13)
    assert found.balance.momentum == pytest.approx(many * mass, rel=1e-13)
    assert np.sum(found.velocity**2) == pytest.approx(many, rel=1e-12)
    assert found.balance.energy == pytest.approx(many * mass / 2, rel=1e-12)
    assert found.velocity == pytest.approx(1.0 - other.velocity[::-1], abs=1e-12)
    assert found.peak_force == pytest.approx(other.peak_force[::-1], rel=1e-12)


def test_a_striker_is_the_short_form_for_granule_1() -> None:
    striker = hc.Scene(hc.Chain(BEADS, **STEEL), hc.Striker(1.0))
    one = cradle(flying(1))
    assert one.end_time == striker.end_time
    assert one.momentum_ratio == striker.momentum_ratio
    own, same = (hc.Native(rtol=1e-9).run(lasting(scene)) for scene in (striker, one))
    # A striker's wave may leave granules behind, which these do not.
    assert same.peak_force == pytest.approx(own.peak_force, rel=1e-9)


@pytest.mark.parametrize(
    ("velocity", "wall"),
    [([1.0, 1.0, 1.0], None), ([-1.0, 0.0, 1.0], None),
     ([-1.0, -1.0, -1.0], hc.Wall("rigid"))],
)  # fmt: skip
def test_granules_that_meet_nothing_are_refused(
    velocity: list[float], wall: hc.Wall | None
) -> None:
    with pytest.raises(SceneError, match="no granule meets another or a wall"):
        cradle(velocity, wall=wall)


def test_granules_at_rest_without_a_shock_are_refused() -> None:
    with pytest.raises(SceneError, match=r"missing section: give \[shock\], \[striker\] or"):
        cradle([0.0, 0.0])
    with pytest.raises(SceneError, match="no granule meets another"):
        hc.Scene(hc.Chain(2, **STEEL, velocity=2.0), hc.Striker(1.0))
