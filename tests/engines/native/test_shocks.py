"""Drives and ends by native: pistons, local forces, moving and fixed granules, near walls."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.errors import HertzchainError
from hertzchain.observables.wave import usual_wave
from hertzchain.report.contents import of_result
from tests.conftest import STEEL
from tests.oracles.bounds import lasting
from tests.scenes import (
    FOURTH_PUSHED,
    LOAD,
    MOTION,
    PISTONS,
    SAME,
    WITHIN,
    at_near_wall,
    held,
    local,
)


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
        expected = np.interp(time, MOTION.time or (), MOTION.displacement or ())
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
    last = [replace(scene, shock=replace(pulse, granule=12)).rise_time for scene in scenes]
    assert last == pytest.approx([uniform.rise_time] * 2, rel=1e-14)
    peaks = [hc.Native(rtol=1e-9).run(scene).peak_force[4:] for scene in scenes]
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
    result, other = (
        hc.Native("reference", dt=0.002 * scene.contact_time).run(scene)
        for scene in (scene, replace(scene, chain=cradle(flying(BEADS - many)).chain))
    )
    mass = scene.granules.mass[0]
    # Rounding of some thousand steps; that of energy grows with them, of order 11 otherwise.
    assert np.sum(result.velocity) == pytest.approx(many, rel=1e-13)
    assert result.balance.momentum == pytest.approx(many * mass, rel=1e-13)
    assert np.sum(result.velocity**2) == pytest.approx(many, rel=1e-12)
    assert result.balance.energy == pytest.approx(many * mass / 2, rel=1e-12)
    assert result.velocity == pytest.approx(1.0 - other.velocity[::-1], abs=1e-12)
    assert result.peak_force == pytest.approx(other.peak_force[::-1], rel=1e-12)


def test_a_striker_is_the_short_form_for_granule_1() -> None:
    striker = hc.Scene(hc.Chain(BEADS, **STEEL), hc.Striker(1.0))
    thrown = cradle(flying(1))
    assert thrown.end_time == striker.end_time
    assert thrown.momentum_ratio == striker.momentum_ratio
    result, same = (hc.Native(rtol=1e-9).run(lasting(scene)) for scene in (striker, thrown))
    # A striker's wave may leave granules behind, which these do not.
    assert same.peak_force == pytest.approx(result.peak_force, rel=1e-9)


def test_weight_is_carried_by_fixed_granules() -> None:
    scene = held(3, 6, granules=6, precompression=hc.Precompression(2.0, gravity=10.0))
    weight = 10.0 * scene.granules.mass[0]
    expected = [2 + weight, 2 + 2 * weight, 0, weight, 2 * weight]
    assert scene.granules.static_force.tolist() == pytest.approx(expected, rel=1e-14)


def test_no_wave_beyond_a_fixed_granule() -> None:
    """It is that of a chain that ends there, and of contacts behind nothing is awaited."""
    scene = held(9, granules=16)
    long, short = (
        hc.Native(rtol=1e-8, wanted="first").run(scene)
        for scene in (scene, replace(scene, chain=held(9, granules=9).chain))
    )
    waves = [usual_wave(result.scene, result.first_columns) for result in (long, short)]
    assert (waves[0].first, waves[0].last) == (waves[1].first, waves[1].last)
    assert waves[0].speed == pytest.approx(waves[1].speed, rel=1e-6)
    assert long.is_reached.tolist() == [True] * 8 + [False] * 7
    document = of_result(long)
    assert document.peaks.row(12)[-1] == ""


def test_steps_that_are_shorter_where_contacts_open_follow_contact_2() -> None:
    """The near wall's contact is as hard as steel, the others as rubber: measured 3e-11."""
    rubber = [193e9] + [1e6] * 5
    walled = replace(at_near_wall(chain={"young_modulus": rubber}), run=hc.Run(2e-2))
    assert hc.Native("reference", wanted="all").run(walled).error_estimate < 1e-10


REFUSED: dict[str, tuple[Callable[[], Any], str]] = {
    **{
        f"granule {k}": (lambda k=k: local(replace(WITHIN, granule=k)), "granule")  # type: ignore[misc]
        for k in (0, 13, 2.5)
    },
    "together": (lambda: cradle([1.0, 1.0, 1.0]), "no granule meets another or a wall"),
    "apart": (lambda: cradle([-1.0, 0.0, 1.0]), "no granule meets another or a wall"),
    "away": (lambda: cradle([-1.0] * 3, hc.Wall("rigid")), "no granule meets another or a wall"),
    "at rest": (lambda: cradle([0.0, 0.0]), r"missing section: give \[shock\], \[striker\] or"),
    "no faster": (
        lambda: hc.Scene(hc.Chain(2, **STEEL, velocity=2.0), hc.Striker(1.0)),
        "no granule meets another",
    ),
    "side by side": (lambda: held(3, 4), "granule 3: is next to what does not move"),
    "beside a wall": (
        lambda: held(8, wall=hc.Wall("rigid")),
        "granule 8: is next to what does not move",
    ),
    "all": (lambda: held(*range(1, 9)), "granule 1: is next to what does not move"),
    "pushed": (lambda: held(1), "must not be fixed: the pulse moves it"),
    "piston": (lambda: held(1, shock=hc.Piston(1.0)), "must not be fixed: the piston moves it"),
    "loaded": (
        lambda: held(2, shock=hc.Striker(0.5), precompression=LOAD),
        "the static load presses it",
    ),
    "gravity": (
        lambda: held(4, precompression=hc.Precompression(gravity=9.8)),
        "or a fixed last granule",
    ),
    "sine": (
        lambda: held(4, shock=hc.Sine(1.0, 5e3, 2, granule=6), precompression=LOAD),
        "must be at most the static load",
    ),
    "moving": (
        lambda: hc.Scene(hc.Chain(2, **STEEL, velocity=[0.0, 1.0], fixed=[False, True])),
        "has a velocity at the start",
    ),
    "striker": (lambda: at_near_wall(shock=hc.Striker(1.0)), "granule 1 is the striker"),
    "fixed": (
        lambda: at_near_wall(shock=FOURTH_PUSHED, chain={"fixed": [True] + [False] * 5}),
        "the near wall",
    ),
    "gap": (lambda: at_near_wall(replace(SAME, gap=1e-6), precompression=LOAD), "near_wall.gap"),
    "damping": (lambda: at_near_wall(hc.Wall("rigid", restitution=0.5)), r"needs \[contact\]"),
    "liggghts": (lambda: hc.Liggghts().run(at_near_wall()), "does not support near wall"),
    "examine": (lambda: hc.examine(at_near_wall(), "in.mine"), "near_wall: cannot be in the scene"),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_refused(kind: str) -> None:
    make, words = REFUSED[kind]
    with pytest.raises(HertzchainError, match=words):
        make()


def test_a_fixed_granule_takes_the_load_of_the_near_wall() -> None:
    walled = at_near_wall(
        SAME, FOURTH_PUSHED, precompression=LOAD, chain={"fixed": [False, True] + [False] * 4}
    )
    assert walled.granules.static_force.tolist() == [20.0, 20.0, 0.0, 0.0, 0.0, 0.0]
