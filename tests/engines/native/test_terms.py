"""Scenes with terms by native: closed forms, identities, linear chains, and free flights.

Numbers without another source are those of independent simulations in natural units m = k = 1.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.special import jv

import hertzchain as hc
from hertzchain.engines.native.equations import Chain
from hertzchain.engines.native.simulation import Adaptive, integrate_damped
from hertzchain.observables.peaks import largest_difference
from tests.conftest import STEEL
from tests.oracles import extrapolation
from tests.oracles.scene_in_si import numbers_of_chain
from tests.scenes import DIMER, PTFE, TERMS, row


def test_two_spheres_that_meet() -> None:
    chain = row(STEEL, PTFE)
    scene = hc.Scene(chain, hc.Striker(2.0))
    result = hc.Native("reference").run(scene, record=None)
    stiffness, mass = scene.granules.stiffness[0], scene.granules.contact_mass[0]
    # Energy m* v^2 / 2 = 2/5 A d^(5/2).
    force = (1.25 * mass * 2.0**2) ** 0.6 * stiffness**0.4
    assert result.peak_force[0] == pytest.approx(force, rel=1e-11, abs=0)
    m1, m2 = scene.granules.mass
    assert result.velocity == pytest.approx(
        [2.0 * (m1 - m2) / (m1 + m2), 4.0 * m1 / (m1 + m2)], rel=1e-10, abs=0
    )


def test_a_static_load_stays_where_it_is() -> None:
    late = hc.PulseTable((1.0, 2.0), (0.0, 1.0))
    loads = hc.Precompression(force=5.0, gravity=9.81)
    wall = hc.Wall("same")
    scene = hc.Scene(DIMER, late, hc.Run(2e-4), wall, loads)
    result = hc.Native("reference").run(scene)
    # Rounding of forces and overlaps, added up over some hundred steps.
    assert np.max(np.abs(result.displacement)) < 1e-13 * scene.units.length
    assert result.static_force is not None
    assert result.peak_force == pytest.approx(result.static_force, rel=1e-14, abs=0)
    weight = 9.81 * np.cumsum(scene.granules.mass)
    assert result.static_force == pytest.approx(5.0 + weight, rel=1e-14, abs=0)


@pytest.mark.parametrize("strength", [1e-3, 1e-4])
def test_a_small_push_on_a_pressed_chain_vs_bessel_functions(strength: float) -> None:
    """v_j(t) = v0 (2j + 1) / (w0 t) J_{2j+1}(2 w0 t) on a free end, w0^2 = k' / m (Nesterenko)."""
    press = 100.0
    chain = hc.Chain(60, **STEEL)
    # As slow as the overlaps of the static load are deep: linear but for the fraction below.
    linear = 1.5 * press ** (1 / 3) * chain.contact_stiffness ** (2 / 3)
    frequency = math.sqrt(linear / chain.granule_mass)
    depth = (press / chain.contact_stiffness) ** (2 / 3)
    velocity = strength * depth * frequency
    time = np.linspace(2.0, 40.0, 20) / frequency
    scene = hc.Scene(
        chain,
        hc.Striker(velocity, loaded=True),
        hc.Run(float(time[-1])),
        precompression=hc.Precompression(press),
    )
    history = hc.Native(rtol=1e-9).run(scene, record=time).history
    j = np.arange(20)
    expected = np.array(
        [velocity * (2 * j + 1) / (frequency * t) * jv(2 * j + 1, 2 * frequency * t) for t in time]
    )
    # What the curvature of Hertz's law leaves is of first order in the push.
    assert np.max(np.abs(history.velocity[:, :20] - expected)) < 0.3 * strength * velocity


def test_a_run_that_ends_too_early_says_so() -> None:
    scene = replace(TERMS["striker, rigid wall"], run=hc.Run(5e-5))
    (warning,) = hc.Native().run(scene).warnings
    assert "the run ended before contact" in warning
    assert "had been pressed and had let up: set end_time in" in warning
    result = hc.Native().run(TERMS["striker, rigid wall"])
    assert result.warnings == ()
    assert result.peak_passed[-1]
    early = replace(scene, run=hc.Run(0.999 * float(result.peak_time[-1])))
    (warning,) = hc.Native().run(early).warnings
    assert "the wall" in warning


FAR = hc.Scene(hc.Chain(8, **STEEL), hc.Striker(0.1), hc.Run(6.0), hc.Wall("rigid", gap=0.1))
"""The last granule flies for a second, 50,000 times as long as a blow. With a wall ten times as far
away the stated error is above 1e-9 on some processors, and equal steps over the flight follow."""

GAPS = hc.Scene(hc.Chain(200, gap=1e-6, **STEEL), hc.Striker(0.1))

MANY = 20_000
"""Steps: 100 or 1000 for each of a few blows; free flights would take a thousand times as many."""


@pytest.mark.parametrize("rtol", [1e-3, 1e-6, 1e-9])
def test_a_far_wall(rtol: float) -> None:
    """The last granule hits it alone, with the speed at which it left the chain."""
    result = hc.Native(rtol=rtol).run(FAR)
    assert result.steps < MANY
    before = hc.Native(rtol=1e-9).run(replace(FAR, run=hc.Run(1e-3), wall=None))
    each = FAR.granules
    energy = float(each.mass[-1] * before.velocity[-1] ** 2 / 2)
    # k d^(5/2) / (5/2) is the energy where the overlap d is largest.
    hit = float(each.stiffness[-1] * (2.5 * energy / each.stiffness[-1]) ** 0.6)
    assert result.peak_force[-1] == pytest.approx(hit, rel=result.error_estimate + 1e-9)


def test_granules_that_fly_at_others_one_by_one() -> None:
    """Only those that collide are computed, so that work grows as their number."""
    few, many = (
        hc.Native(rtol=1e-6).run(hc.Scene(hc.Chain(n, gap=1e-6, **STEEL), GAPS.shock))
        for n in (100, 200)
    )
    assert many.steps < 2.5 * few.steps
    # After a few blows each is that of two equal spheres, which hands all of the speed on.
    assert np.ptp(many.peak_force[10:]) < 1e-6 * many.peak_force[10]


def slow_dimer(gap: float, speed: float, damper: float, attraction: bool) -> hc.Scene:
    """A slow striker on light and heavy granules with dashpots, which touch again and again."""
    radii = tuple(STEEL["radius"] / (1 + i % 2) for i in range(17))
    chain = hc.Chain(17, gap=gap, **(STEEL | {"radius": radii}))
    law = hc.Contact("dashpot", coefficient=damper, attraction=attraction)
    return hc.Scene(chain, hc.Striker(speed), contact=law)


@pytest.mark.parametrize(("attraction", "rtol"), [(False, 1e-9), (True, 1e-9), (True, 1e-10)])
def test_slow_granules_that_touch_again_and_again(attraction: bool, rtol: float) -> None:
    scene = replace(slow_dimer(1.0878e-8, 1.3538e-4, 0.0597, attraction), run=hc.Run(5.79e-3))
    assert hc.Native(rtol=rtol).run(scene).steps < MANY


@pytest.mark.parametrize("exponent", [0.0, 0.25, 0.5])
def test_a_load_presses_a_contact_again_that_has_not_opened(exponent: float) -> None:
    """Its damper had made the force 0 before; momentum and energy do not tell."""
    unit = np.ones(1)
    chain = Chain(unit, unit, 0.5 * unit, 0.1 * unit, 0.3 * unit, exponent, False)
    start, rows = np.array([[0.0], [1.0]]), np.array([[0.0, 30.0, 1, 0, 0, 0, 0, 0.0]])
    run = integrate_damped(chain, rows, start, Adaptive(1e-10, 0.8))
    numbers = numbers_of_chain(chain, 1.0)
    free = np.array([[0.0, 0.0, 30.0, 0.0, 0.0]])
    true = extrapolation.integrate(numbers, free, np.zeros((0, 2)), start, 30.0)
    # Tolerances of 1e-10 a step, in 30 time units; a dashpot taken as open is 0.3 off.
    assert run.displacement == pytest.approx(true.displacement, abs=1e-8)
    assert run.velocity == pytest.approx(true.velocity, abs=1e-8)


def touching_but_for(gaps: int) -> hc.Scene:
    """A pulse in a long chain of which the last contacts have gaps."""
    gap = np.zeros(400)
    gap[400 - gaps :] = 1e-6
    pulse = hc.Pulse("cosine", 100.0, 2.0, momentum_ratio=1.0)
    return hc.Scene(hc.Chain(400, gap=tuple(gap), **STEEL), pulse)


@pytest.mark.parametrize(("gaps", "method"), [(1, "srkn-11b"), (399, "dop853")])
def test_an_expensive_scene_takes_the_cheaper_method(gaps: int, method: str) -> None:
    """Many contacts that open and close make adaptive steps short, free flights equal ones many."""
    assert hc.Native(rtol=1e-6).run(touching_but_for(gaps)).method == method


def test_both_methods_agree_where_either_may_be_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    by_events = hc.Native(rtol=1e-6).run(GAPS)
    monkeypatch.setattr("hertzchain.engines.native.backend.LONG_RUN", np.inf)
    by_equal_steps = hc.Native(rtol=1e-6).run(GAPS)
    assert (by_events.method, by_equal_steps.method) == ("dop853", "srkn-11b")
    stated = by_events.error_estimate + by_equal_steps.error_estimate
    assert largest_difference(by_events.peak_force, by_equal_steps.peak_force) < stated < 2e-6


@pytest.mark.parametrize("law", [None, hc.Contact("dashpot", coefficient=20.0)], ids=["", "damped"])
def test_what_is_recorded_in_flight(law: hc.Contact | None) -> None:
    """The last granule has left the others after 1 ms, and hits the wall after 1 s."""
    scene, native = replace(FAR, run=hc.Run(0.4), contact=law), hc.Native(rtol=1e-6)
    time = np.array([0.05, 0.1, 0.17, 0.31, 0.39])
    history = native.run(scene, record=time).history
    place, velocity = history.displacement[:, -1], history.velocity[:, -1]
    # Polynomials between states that are long apart cost 1e-9.
    assert np.ptp(velocity) < 1e-8 * velocity[0]
    assert np.diff(place) == pytest.approx(velocity[0] * np.diff(time), rel=1e-8)
    assert not history.contact_force.any()


@pytest.mark.parametrize("law", [None, hc.Contact("restitution", restitution=0.8)])
def test_a_slow_sine_that_throws_a_chain_and_catches_it_has_not_diverged(
    law: hc.Contact | None,
) -> None:
    """The chain flies at 26 m/s, though the impulse is 0."""
    shock, pressed = hc.Sine(100.0, 100.0, 1), hc.Precompression(100.0)
    scene = hc.Scene(hc.Chain(3, **STEEL), shock, precompression=pressed, contact=law)
    result, exact = (hc.Native(rtol=rtol, wanted="all").run(scene) for rtol in (1e-3, 1e-6))
    error = largest_difference(result.peak_force, exact.peak_force)
    assert error <= result.error_estimate + exact.error_estimate
