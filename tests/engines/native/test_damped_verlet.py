"""Damped contacts by velocity Verlet: order, bounds and balances."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.engines.external.rescaling import Softening
from hertzchain.engines.native.damped_verlet import simulate_damped_verlet
from hertzchain.errors import StepUnstable
from hertzchain.observables.error_bound import _highest_frequency, highest_rate, stable_step
from hertzchain.observables.peaks import largest_difference
from hertzchain.verdict.run_checks import balance_checks
from tests.conftest import STEEL
from tests.engines.native.test_damped_scenes import LAWS, PULSE, TWO, scene_with
from validation.random_drives import random_scene_with_piston
from validation.random_scenes import random_damped_scene

FLYING = hc.Scene(hc.Chain(6, gap=2e-6, **STEEL), hc.Striker(1.0), wall=hc.Wall("same"))


@pytest.mark.parametrize("law", LAWS)
def test_first_order(law: str) -> None:
    scene = hc.Scene(hc.Chain(8, **STEEL), PULSE, contact=LAWS[law])
    exact = hc.Native(rtol=1e-8).run(scene).peak_force
    errors = [
        largest_difference(
            hc.Native("velocity-verlet", h * scene.contact_time).run(scene).peak_force, exact
        )
        for h in (0.004, 0.002)
    ]
    # 2 but for what goes as dt^2, which is more for the dashpot, whose first order is weak.
    assert 1.9 < errors[0] / errors[1] < 2.3
    fine, finer = (
        simulate_damped_verlet(scene, scene.schedule(h * scene.contact_time)).peaks.force
        for h in (0.004, 0.002)
    )
    left = largest_difference((2 * finer - fine) * scene.units.force, exact)
    assert left < 0.1 * errors[1]  # of second order: 0.06 where the first is weakest


@pytest.mark.parametrize(
    "number",
    [*range(8), *(pytest.param(number, marks=pytest.mark.slow) for number in range(100, 300))],
)
def test_error_estimates_are_bounds(number: int) -> None:
    """A random scene at a random step."""
    rng = np.random.default_rng([79, number])
    scene = random_damped_scene(rng, 30, 100.0)
    step = 10 ** rng.uniform(-2.0, -0.7) * min(stable_step(scene, 2.0), scene.contact_time)
    reference = hc.Native(rtol=1e-7).run(scene)
    result = hc.Native("velocity-verlet", step).run(scene)
    error = largest_difference(result.peak_force, reference.peak_force)
    assert error <= result.error_estimate + reference.error_estimate
    assert [check for check in balance_checks(result) if not check.passed] == []


@pytest.mark.parametrize("number", [7, 71, 74, 100])
def test_momentum_and_energy_with_a_damped_piston(number: int) -> None:
    """Its peaks are exact, where a dashpot begins or in the end at a wall; its motion is not."""
    rng = np.random.default_rng([31, number])
    scene = random_scene_with_piston(rng, 12, 200.0)
    scene = replace(scene, contact=random_damped_scene(rng, 12, 200.0).contact)
    step = min(0.01 * scene.contact_time, 0.2 * stable_step(scene, 2.0))
    result = hc.Native("velocity-verlet", step).run(scene)
    assert [check for check in balance_checks(result) if not check.passed] == []
    # A thousandth of what was pushed still shows.
    balance = result.balance
    pushed = float(np.max(result.peak_force)) * scene.end_time
    wrong = replace(result, balance=replace(balance, momentum=balance.momentum + 0.1 * pushed))
    assert not balance_checks(wrong)[0].passed


@pytest.mark.parametrize("step", [0.1, 0.01, 1e-4])
def test_the_error_estimate_is_the_error(step: float) -> None:
    """It is the difference to accurate peaks, and what these may be off by, 1e-9 or a tenth."""
    scene = hc.Scene(hc.Chain(8, **STEEL), PULSE, contact=LAWS["restitution"])
    result = hc.Native("velocity-verlet", step * scene.contact_time).run(scene)
    error = largest_difference(result.peak_force, hc.Native(rtol=1e-9).run(scene).peak_force)
    assert error - 1e-9 < result.error_estimate < 1.1 * error + 2e-9


def test_a_similar_scene_of_each_law() -> None:
    """The force does not change, velocities grow with times: see ``Softening``."""
    for law in LAWS.values():
        scene = scene_with(law)
        scene = replace(scene, run=hc.Run(scene.end_time))
        made = Softening(3)
        given = made.scene(scene)
        one, other = (
            hc.Native("velocity-verlet", 0.05 * each.contact_time).run(each)
            for each in (scene, given)
        )
        assert largest_difference(other.peak_force, one.peak_force) < 1e-12
        assert np.max(np.abs(other.velocity / made.time / one.velocity - 1)) < 1e-10


@pytest.mark.parametrize("gap", [0.0, 1e-5])
def test_a_force_that_jumps_as_a_contact_begins(gap: float) -> None:
    """Two spheres that fly at each other, so that a strong dashpot presses hardest at once."""
    chain = hc.Chain(2, gap=gap, **STEEL)
    scene = hc.Scene(chain, hc.Striker(0.5), contact=hc.Contact("dashpot", coefficient=300.0))
    dt = 0.013 * scene.contact_time
    result = hc.Native("velocity-verlet", dt).run(scene)
    # It has the speed of the flight then, wherever within a step the contact begins.
    assert result.peak_force[0] == pytest.approx(150.0, rel=1e-12, abs=0)
    assert result.peak_time[0] == pytest.approx(gap / 0.5, rel=1e-12, abs=0)


def test_a_history_has_the_forces_of_the_law() -> None:
    scene = hc.Scene(TWO, hc.Striker(1.0), contact=LAWS["restitution"])
    time = np.linspace(0, 3.0 * scene.units.time, 50)
    scene = replace(scene, run=hc.Run(float(time[-1])))
    method = hc.Native("velocity-verlet", 0.001 * scene.contact_time)
    history, exact = (each.run(scene, record=time).history for each in (method, hc.Native()))
    largest = np.max(exact.contact_force)
    # First order; a step of 0.001 leaves as much of the peak.
    assert np.max(np.abs(history.contact_force - exact.contact_force)) < 1e-3 * largest


@pytest.mark.parametrize("law", LAWS)
def test_a_step_too_long_is_refused(law: str) -> None:
    scene = hc.Scene(hc.Chain(8, **STEEL), PULSE, contact=LAWS[law])
    longest = stable_step(scene, 2.0)
    assert longest < stable_step(replace(scene, contact=None), 2.0)
    # A motion u'' = -r u' - w^2 u, whose damper acts half a step late: growth in a step.
    w, r = _highest_frequency(scene), highest_rate(scene)
    for h, is_stable in ((0.999 * longest, True), (1.001 * longest, False)):
        growth = np.roots([1, r * h + (w * h) ** 2 - 2, 1 - r * h])
        assert bool(np.all(np.abs(growth) <= 1)) is is_stable
    # Legs are cut into equal steps, which are a little shorter than what was asked for.
    with pytest.raises(StepUnstable, match="is unstable"):
        hc.Native("velocity-verlet", 1.3 * longest).run(scene)
