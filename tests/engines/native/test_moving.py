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


LIKE_A_SPHERE = hc.Wall(
    "elastic", STEEL["young_modulus"] / (2 * np.sqrt(2) - 1), STEEL["poisson_ratio"]
)
"""A wall against which a bead is as stiff as against another: E* is less by the root of 2 in R*."""


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


@pytest.mark.parametrize("granules", [6, 7])
def test_equal_strikers_from_both_sides_vs_a_wall(granules: int) -> None:
    """Two mirror waves meet in a contact as at a rigid wall, at a granule as at a frozen one."""
    both = cradle([1.0, *[0.0] * (granules - 2), -1.0])
    half = hc.Scene(hc.Chain(granules // 2, **STEEL), hc.Striker(1.0), wall=hc.Wall("rigid"))
    found = hc.Native("reference", dt=0.002 * both.contact_time).run(lasting(both))
    assert found.peak_force == pytest.approx(found.peak_force[::-1], rel=1e-12)
    assert abs(found.balance.momentum) < 1e-13 * both.largest_impulse
    if granules % 2 == 0:
        wall = hc.Native("reference", dt=0.002 * half.contact_time).run(
            replace(half, run=hc.Run(both.end_time))
        )
        middle = granules // 2
        assert found.peak_force[:middle] == pytest.approx(wall.peak_force, rel=1e-10)
        return
    frozen = hc.Native(rtol=1e-9).run(lasting(cradle([1.0, 0.0, 0.0], wall=LIKE_A_SPHERE)))
    assert found.displacement[granules // 2] == pytest.approx(0, abs=1e-13 * both.units.length)
    assert found.peak_force[: granules // 2] == pytest.approx(frozen.peak_force, rel=1e-8)


def test_a_chain_that_flies_onto_a_wall_is_one_that_a_piston_hits() -> None:
    """It is seen from the chain: the piston is a sphere, and so the wall has to be as stiff."""
    five = cradle([1.0] * 5, wall=LIKE_A_SPHERE)
    pushed = hc.Scene(hc.Chain(6, **STEEL), hc.Piston(1.0), hc.Run(five.end_time))
    found, other = (hc.Native(rtol=1e-9).run(lasting(scene)) for scene in (five, pushed))
    assert found.peak_force[::-1] == pytest.approx(other.peak_force, rel=1e-8)


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
