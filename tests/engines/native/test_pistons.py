"""Pistons by the native backend: closed forms, identities, balances, and another solver."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import jv

import hertzchain as hc
from hertzchain.verdict.run_checks import balance_checks
from tests.conftest import STEEL
from tests.oracles import extrapolation
from tests.oracles.bounds import at_three_accuracies, by_methods, check_answers, lasting
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

LAWS = {
    "elastic": None,
    "restitution": hc.Contact("restitution", restitution=0.8),
    "dashpot, pulling": hc.Contact("dashpot", coefficient=2.0, attraction=True),
}


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("name", SCENES)
def test_momentum_and_energy(name: str, law: str) -> None:
    scene = replace(SCENES[name], contact=LAWS[law])
    result = hc.Native(rtol=1e-8, wanted="all").run(scene)
    assert result.error_estimate <= 1e-8
    balance = result.balance
    # The force of the piston is integrated, so that both sides are as good as the peaks.
    given = np.max(result.peak_force) * scene.end_time
    assert balance.momentum == pytest.approx(balance.impulse, rel=0, abs=1e-8 * given)
    worked = abs(balance.work) + abs(balance.energy) + balance.dissipated
    left = balance.energy + balance.dissipated - balance.work
    assert abs(left) < 1e-8 * worked
    assert [check for check in balance_checks(result) if not check.passed] == []


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


@pytest.mark.parametrize(("asked", "returned"), [(0.8, 0.8080993), (0.5, 0.5502832)])
def test_restitution_at_a_piston(asked: float, returned: float) -> None:
    """The granule leaves with 1 + e times the velocity; e without attraction, in closed form."""
    law = hc.Contact("restitution", restitution=asked)
    chain = hc.Chain(2, **STEEL)
    scene = hc.Scene(chain, hc.Piston(0.2), hc.Run(1e-3), contact=law)
    velocity = hc.Native(rtol=1e-10).run(scene).velocity
    assert velocity[1] / 0.2 - 1 == pytest.approx(returned, rel=0, abs=5.1e-8)
    pulling = replace(scene, contact=replace(law, attraction=True))
    velocity = hc.Native(rtol=1e-10).run(pulling).velocity
    assert velocity[1] / 0.2 - 1 == pytest.approx(asked, rel=1e-9)


@pytest.mark.parametrize("strength", [1e-3, 1e-4])
def test_a_slow_piston_on_a_pressed_chain_vs_bessel_functions(strength: float) -> None:
    """v_j(t) = v times the integral of 2 j J_{2j}(2 w0 s) / s from 0 to t, w0^2 = k' / m.

    The linear chain passes on (sqrt(p^2 + 4 w0^2) - p)^2 / 4 w0^2 from granule to granule in terms
    of Laplace's p, whose j-th power is the transform of 2 j J_{2j}(2 w0 t) / t.
    """
    press, chain = 100.0, hc.Chain(40, **STEEL)
    linear = 1.5 * press ** (1 / 3) * chain.contact_stiffness ** (2 / 3)
    frequency = math.sqrt(linear / chain.granule_mass)
    velocity = strength * (press / chain.contact_stiffness) ** (2 / 3) * frequency
    time = np.array([5.0, 12.0, 25.0]) / frequency
    pressed = hc.Precompression(press)
    scene = hc.Scene(chain, hc.Piston(velocity), hc.Run(float(time[-1])), precompression=pressed)
    history = hc.Native(rtol=1e-9).run(scene, record=time).history

    def passed_on(j: int, t: float) -> float:
        return float(quad(lambda s: 2 * j * jv(2 * j, 2 * s) / s, 0, t, limit=200)[0])

    for k, t in enumerate(time * frequency):
        expected = [velocity, *(velocity * passed_on(j, float(t)) for j in range(1, 12))]
        # What the curvature of Hertz's law leaves is of first order in the push.
        assert np.max(np.abs(history.velocity[k, :12] - expected)) < 2 * strength * velocity


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


def test_history_follows_the_table() -> None:
    scene = SCENES["forwards and backwards"]
    time = np.linspace(0.0, scene.end_time, 41)
    for law in LAWS.values():
        history = hc.Native().run(replace(scene, contact=law), record=time).history
        expected = np.interp(time, TABLE.time or (), TABLE.displacement or ())
        assert history.displacement[:, 0] == pytest.approx(expected, rel=0, abs=1e-18)


def test_a_piston_at_rest_holds_the_static_load() -> None:
    late = hc.Piston(None, (1.0, 2.0), (0.0, 1e-6))
    loads, wall = hc.Precompression(5.0, 9.81), hc.Wall("same")
    scene = hc.Scene(UNIFORM, late, hc.Run(2e-4), wall, loads)
    result = hc.Native("reference").run(scene)
    assert np.max(np.abs(result.displacement)) < 1e-13 * scene.units.length
    assert result.static_force is not None
    assert result.peak_force == pytest.approx(result.static_force, rel=1e-14, abs=0)


@pytest.mark.parametrize("name", SCENES)
def test_peaks_and_velocities(name: str) -> None:
    scene = lasting(SCENES[name])
    asked = at_three_accuracies() + by_methods(scene)
    found = check_answers(scene, asked)
    assert len(found) == len(asked)
    true = extrapolation.peaks(scene).velocity
    largest = np.max(np.abs(true))
    # After many collisions; 3e-9 seen.
    assert found[2].velocity == pytest.approx(true, rel=0, abs=1e-8 * largest)


def test_short_strokes_have_other_steps_in_every_run_that_tells_an_error() -> None:
    """Three strokes of one step: the second run and the third had the same, 3.5 bounds off."""
    scene = random_scene_with_piston(np.random.default_rng([7001, 2653]), 12, 250.0)
    check_answers(scene, [(hc.Native(rtol=1e-3), 1e-3)])


def test_a_piston_that_stops_before_a_strong_damper() -> None:
    """Its contact would pull at once, and presses again before a step is over."""
    stops = hc.Piston(None, (1e-5, 1.5e-5), (0.0, 1e-6))
    law = hc.Contact("restitution", restitution=0.01)
    chain, pressed = hc.Chain(4, **STEEL), hc.Precompression(10.0)
    scene = hc.Scene(chain, stops, hc.Run(1e-4), precompression=pressed, contact=law)
    asked = at_three_accuracies()
    assert len(check_answers(scene, asked)) == len(asked)


def test_a_stroke_shorter_than_a_step() -> None:
    """It is not a single step, both of a run and of that which tells its error."""
    short = hc.Piston(None, (1e-5, 1.2e-5, 3e-5), (0.0, 1e-7, -3e-7))
    law, pressed = hc.Contact("dashpot", coefficient=10.0), hc.Precompression(0.01)
    chain, end = hc.Chain(4, **STEEL), hc.Run(1.5e-4)
    scene = hc.Scene(chain, short, end, precompression=pressed, contact=law)
    asked = at_three_accuracies()
    assert len(check_answers(scene, asked)) == len(asked)
