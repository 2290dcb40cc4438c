"""Pistons, forces within a chain and granules that move at the start, by the native backend."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.errors import SceneError
from tests.conftest import STEEL
from tests.oracles.bounds import lasting
from validation.random_drives import random_scene_with_piston

UNIFORM = hc.Chain(12, **STEEL)
TABLE = hc.Piston(None, (1e-5, 5e-5, 9e-5, 2e-4), (0.0, 4e-6, 1e-6, 2e-6))
PRESSED = hc.Precompression(10.0)

PISTONS = {
    "constant velocity": hc.Scene(UNIFORM, hc.Piston(0.1)),
    "forwards and backwards": hc.Scene(UNIFORM, TABLE, precompression=PRESSED),
    "backwards alone": hc.Scene(
        UNIFORM, hc.Piston(None, (0.0, 1e-4), (0.0, -1e-5)), precompression=PRESSED
    ),
    "gaps, wall": hc.Scene(
        hc.Chain(4, **STEEL, gap=1e-6), hc.Piston(0.1), wall=hc.Wall("same", gap=2e-6)
    ),
    "column": hc.Scene(
        hc.Chain(
            6, radius=[5e-3, 4e-3] * 3, young_modulus=193e9, poisson_ratio=0.3, density=7958.0
        ),
        TABLE,
        wall=hc.Wall("elastic", 70e9, 0.33),
        precompression=hc.Precompression(3.0, 9.81),
    ),
}

DAMPED_PISTONS = {
    # Three strokes of one step: the second run and the third had the same, 3.5 bounds off.
    "short strokes": random_scene_with_piston(np.random.default_rng([7001, 2653]), 12, 250.0),
    # Its contact would pull at once, and presses again before a step is over.
    "stops before a strong damper": hc.Scene(
        hc.Chain(4, **STEEL),
        hc.Piston(None, (1e-5, 1.5e-5), (0.0, 1e-6)),
        hc.Run(1e-4),
        precompression=PRESSED,
        contact=hc.Contact("restitution", restitution=0.01),
    ),
    # It is not a single step, both of a run and of that which tells its error.
    "a stroke shorter than a step": hc.Scene(
        hc.Chain(4, **STEEL),
        hc.Piston(None, (1e-5, 1.2e-5, 3e-5), (0.0, 1e-7, -3e-7)),
        hc.Run(1.5e-4),
        precompression=hc.Precompression(0.01),
        contact=hc.Contact("dashpot", coefficient=10.0),
    ),
}


def test_a_granule_hit_by_a_piston() -> None:
    """It leaves with twice the velocity; m v^2 / 2 = 2/5 A d^(5/2) at the peak."""
    chain = hc.Chain(2, radius=[3e-3, 5e-3], young_modulus=193e9, poisson_ratio=0.3, density=7958.0)
    scene = hc.Scene(chain, hc.Piston(0.2))
    result = hc.Native("reference").run(scene)
    stiffness, mass = float(scene.granules.stiffness[0]), float(scene.granules.mass[1])
    force = (1.25 * mass * 0.2**2) ** 0.6 * stiffness**0.4
    assert result.peak_force[0] == pytest.approx(force, rel=1e-11, abs=0)
    assert result.peak_force[0] == pytest.approx(scene.peak_force, rel=1e-11, abs=0)
    assert result.velocity == pytest.approx([0.2, 0.4], rel=1e-10, abs=0)
    assert result.balance.impulse == pytest.approx(2 * mass * 0.2, rel=1e-9)
    assert result.displacement[0] == pytest.approx(0.2 * result.scene.end_time, rel=1e-14)


def test_history_follows_the_table() -> None:
    scene = PISTONS["forwards and backwards"]
    time = np.linspace(0.0, scene.end_time, 41)
    for law in (None, hc.Contact("restitution", restitution=0.8)):
        history = hc.Native().run(replace(scene, contact=law), record=time).history
        expected = np.interp(time, TABLE.time or (), TABLE.displacement or ())
        assert history.displacement[:, 0] == pytest.approx(expected, rel=0, abs=1e-18)


def test_a_piston_that_turns_round_makes_a_peak() -> None:
    """The contact is pressed hardest at the instant at which the piston turns."""
    turn, law = 1e-5, hc.Contact("restitution", restitution=0.9)
    chain = hc.Chain(4, **STEEL)
    for contact in (None, law):
        back = hc.Piston(None, (0.0, turn, 2 * turn), (0.0, 2e-6, -2e-6))
        scene = hc.Scene(chain, back, contact=contact)
        result = hc.Native(rtol=1e-9).run(scene)
        assert result.peak_time[0] == pytest.approx(turn, rel=1e-12)
        until = hc.Scene(chain, hc.Piston(0.2), hc.Run(turn), contact=contact)
        at_turn = hc.Native(rtol=1e-9).run(until).peak_force[0]
        assert result.peak_force[0] == pytest.approx(at_turn, rel=1e-8)


PULSE = hc.Pulse("cosine", 100.0, 2.0, rise_time=2e-5, granule=5)


def local(shock: Any = PULSE, **more: Any) -> hc.Scene:
    return hc.Scene(hc.Chain(12, **STEEL), shock, hc.Run(4e-4), **more)


LOCAL_LOAD = hc.Precompression(20.0)

LOCAL = {
    "free": local(),
    "pressed": local(precompression=LOCAL_LOAD),
    "gaps": local(wall=hc.Wall("rigid", gap=1e-6)),
    "damped": local(contact=hc.Contact("restitution", restitution=0.9)),
    "sine": local(hc.Sine(10.0, 5000.0, 2, granule=3), precompression=LOCAL_LOAD),
}


def test_a_granule_that_the_chain_does_not_have_is_refused() -> None:
    wrong: tuple[Any, ...] = (0, 13, 2.5)
    for granule in wrong:
        with pytest.raises(SceneError, match=r"granule"):
            hc.Scene(hc.Chain(12, **STEEL), replace(PULSE, granule=granule))


def test_all_of_the_chain_is_watched() -> None:
    """The default end lets the wave pass every contact."""
    scene = replace(local(), run=hc.Run())
    assert hc.Native().run(lasting(scene)).peak_passed[4:].all()


def test_the_unit_of_a_local_shock_is_that_of_the_contact_ahead() -> None:
    """Granules behind, which touch nothing that moves, change neither pulse nor wave."""
    sizes = np.full(12, STEEL["radius"])
    pulse = hc.Pulse("cosine", 100.0, 2.0, momentum_ratio=1.0, granule=5)
    scenes = []
    for behind in (1.0, 0.4):
        sizes[:2] = behind * STEEL["radius"]
        chain = hc.Chain(12, **{**STEEL, "radius": sizes.tolist()})
        scenes.append(hc.Scene(chain, pulse))
    like, unlike = scenes
    assert unlike.rise_time == pytest.approx(like.rise_time, rel=1e-14)
    uniform = hc.Scene(hc.Chain(12, **STEEL), replace(pulse, granule=1))
    assert like.rise_time == pytest.approx(uniform.rise_time, rel=1e-14)
    last = [replace(one, shock=replace(pulse, granule=12)).rise_time for one in scenes]
    assert last == pytest.approx([uniform.rise_time] * 2, rel=1e-14)
    peaks = [hc.Native(rtol=1e-9).run(one).peak_force[4:] for one in scenes]
    assert peaks[1] == pytest.approx(peaks[0], rel=3e-9)


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
