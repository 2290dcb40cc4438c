"""Pistons by the native backend: closed forms, identities and hard scenes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import hertzchain as hc
from tests.conftest import STEEL
from validation.random_drives import random_scene_with_piston

UNIFORM = hc.Chain(12, **STEEL)
TABLE = hc.Piston(None, (1e-5, 5e-5, 9e-5, 2e-4), (0.0, 4e-6, 1e-6, 2e-6))
PRESSED = hc.Precompression(10.0)

SCENES = {
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

DAMPED = {
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
    scene = SCENES["forwards and backwards"]
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
