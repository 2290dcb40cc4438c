"""Damped contacts by native: the kernel, closed forms, hard scenes, and velocity Verlet."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

import hertzchain as hc
from hertzchain.engines.native import elastic_chain
from hertzchain.engines.native.equations import Chain
from hertzchain.engines.native.simulation import Adaptive, integrate_damped
from hertzchain.engines.native.verlet import simulate_damped_verlet
from hertzchain.errors import SceneError, StepUnstable
from hertzchain.known.answer import deck_step
from hertzchain.observables.error_bound import (
    _highest_frequency,
    highest_rate,
    refuse_strong_dampers,
    stable_step,
)
from hertzchain.observables.peaks import largest_difference
from hertzchain.verdict.run_checks import balance_checks
from tests.conftest import STEEL
from tests.oracles import extrapolation
from tests.scenes import LAWS, PULSE, scene_with
from validation.random_scenes import (
    random_damped_scene,
    random_hard_scene,
    random_scene_with_piston,
)

TWO = hc.Chain(2, **STEEL)

PARTED = {0.9: 0.9020261, 0.8: 0.8080993, 0.7: 0.7182014, 0.5: 0.5502832, 0.3: 0.3971405}
"""Restitution without attraction by the nominal one; from the closed form."""


def restitution(scene: hc.Scene) -> float:
    """Velocity of parting over that of approach, of two spheres."""
    lasting = replace(scene, run=hc.Run(scene.end_time))
    velocity = hc.Native(rtol=1e-10, wanted="all").run(lasting).velocity
    return float(velocity[1] - velocity[0]) / scene.shock.start_velocity


@pytest.mark.parametrize(("asked", "ratio"), PARTED.items())
def test_two_spheres_part_as_the_closed_form_says(asked: float, ratio: float) -> None:
    law = hc.Contact("restitution", restitution=asked)
    scene = hc.Scene(TWO, hc.Striker(1.0), contact=law)
    assert restitution(scene) == pytest.approx(ratio, rel=0, abs=5.1e-8)  # half of its last digit
    pulling = replace(scene, contact=replace(law, attraction=True))
    # Peaks are asked for to 1e-10, of which the velocity has as much.
    assert restitution(pulling) == pytest.approx(asked, rel=1e-9, abs=0)


@pytest.mark.parametrize("key", ["coefficient", "relaxation_time"])
def test_dampers_that_nothing_can_follow_are_refused(key: str) -> None:
    law = {"coefficient": "dashpot", "relaxation_time": "viscoelastic"}[key]

    def damped(value: float) -> hc.Scene:
        contact = hc.Contact(law, **{key: value})  # type: ignore[arg-type]
        return replace(scene_with(LAWS[law]), contact=contact, run=hc.Run(1e-3))

    with pytest.raises(SceneError, match=f"contact.{key} = 1e.300: must be at most ") as refused:
        hc.Native().run(damped(1e300))
    said = re.search(r"at most (\S+) (kg/s|s) in this scene", str(refused.value))
    most = float(said[1])
    refuse_strong_dampers(damped(0.95 * most))  # two digits are stated
    for refuse in (hc.Native().run, hc.Lammps().run, deck_step, refuse_strong_dampers):
        with pytest.raises(SceneError, match="beyond what can be computed"):
            refuse(damped(1.05 * most))
    refuse_strong_dampers(replace(damped(1.0), contact=None))


def test_the_damper_that_is_too_strong_is_named() -> None:
    contact = hc.Contact("dashpot", coefficient=1.0)
    scene = hc.Scene(hc.Chain(4, **STEEL), hc.Striker(1.0), contact=contact)
    for name in ("wall", "near_wall"):
        walled = {name: hc.Wall("rigid", coefficient=1e300)}
        scene = replace(scene, shock=PULSE, **walled)  # type: ignore[arg-type]
        with pytest.raises(SceneError, match=rf"^{name}\.coefficient = .*at most "):
            refuse_strong_dampers(scene)
        scene = replace(scene, **{name: None})  # type: ignore[arg-type]


def test_a_maximum_in_a_step_as_long_as_its_leg() -> None:
    """Every run that tells the error has this step: 1.7e-7 by interpolation, the whole bound."""
    scene = random_hard_scene(np.random.default_rng([7, 1, 20364]), 30, 200.0, is_damped=True)
    result = hc.Native(rtol=4.183e-6).run(scene)
    error = extrapolation.solve(scene).error_of(result.peak_force)
    assert error <= result.error_estimate
    assert error < 1e-9  # 2.5e-10 by the steps


Floats = NDArray[np.float64]

DASHPOT, RESTITUTION, VISCOELASTIC = 0.0, 0.25, 0.5


def uniform(granules: int, exponent: float, damping: float, attraction: bool = False) -> Chain:
    """A chain of equal granules that just touch, k = m = 1."""
    return Chain(
        stiffness=np.ones(granules - 1),
        inverse_mass=np.ones(granules),
        gap=np.zeros(granules - 1),
        constant=np.zeros(granules),
        damping=np.full(granules - 1, damping),
        damping_exponent=exponent,
        attraction=attraction,
    )


def pulse_until(end: float) -> Floats:
    """Legs of a force that rises to 1 and falls to 0."""
    rise, fall = [0.0, 1.5, 1, 2, 0.0, 1.5, 0.0, 1.0], [1.5, 4.0, 1, 2, 1.5, 4.0, 1.0, 0.0]
    return np.array([rise, fall, [4.0, end, 1, 0, 0, 0, 0, 0]])


@pytest.mark.parametrize("exponent", [DASHPOT, RESTITUTION, VISCOELASTIC])
def test_order_over_a_run(exponent: float) -> None:
    """Errors fall with the eighth power of the steps, with contacts that begin and end.

    Without attraction: where contacts pull, their end is singular, and orders of 6 to 7 were found.
    """
    chain, rows = uniform(12, exponent, 0.1), pulse_until(25.0)
    true = integrate_damped(chain, rows, None, Adaptive(1e-14, 0.1))
    tolerances = 10.0 ** -np.arange(5.0, 13.1, 0.25)
    runs = [integrate_damped(chain, rows, None, Adaptive(each, 10.0)) for each in tolerances]
    errors = np.array([largest_difference(run.peaks.force, true.peaks.force) for run in runs])
    order = -np.polyfit(np.log([run.steps for run in runs]), np.log(errors), 1)[0]
    # 7.9 to 8.4 were found, and an order less would be told.
    assert order == pytest.approx(8.0, rel=0, abs=0.5)
    above_rounding = tolerances > 2e-12
    assert np.max((errors / tolerances)[above_rounding]) < 3.0  # 1 was found
    assert errors[-1] < 1e-11


@pytest.mark.parametrize(
    ("exponent", "damping"), [(DASHPOT, 100.0), (DASHPOT, 1000.0), (VISCOELASTIC, 10000.0)]
)
def test_strong_dampers(exponent: float, damping: float) -> None:
    """Contacts that creep, with forces near 0, neither hold a run up nor cost it its accuracy."""
    chain, rows = uniform(6, exponent, damping), pulse_until(30.0)
    true = integrate_damped(chain, rows, None, Adaptive(1e-11, 0.8, most_work=1e8))
    for tolerance in (3e-5, 1e-6, 3e-9):
        # 383 to 3,929 steps were measured, 2.3e6; a run that stood still took what it was given.
        run = integrate_damped(chain, rows, None, Adaptive(tolerance, 0.8, most_work=5e6))
        assert run.status == elastic_chain.DONE
        # At most 0.3 of the tolerance was measured, and 2e-10.
        assert largest_difference(run.peaks.force, true.peaks.force) < max(tolerance, 1e-9)


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
    for engine in (hc.Native("velocity-verlet", step), hc.Native()):
        result = engine.run(scene)
        assert [check for check in balance_checks(result) if not check.passed] == []
        # A thousandth of what was pushed still shows.
        balance = result.balance
        pushed = float(np.max(result.peak_force)) * scene.end_time
        wrong = replace(result, balance=replace(balance, momentum=balance.momentum + 0.1 * pushed))
        assert not balance_checks(wrong)[0].passed


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
