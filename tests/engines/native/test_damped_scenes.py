"""Scenes with damped contacts: closed forms, hard bounds, and dampers that nothing can follow."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.decks.known_answer import deck_step
from hertzchain.errors import SceneError
from hertzchain.observables.error_bound import refuse_strong_dampers
from tests.conftest import STEEL
from tests.oracles import extrapolation
from validation.random_drives import random_hard_scene

TWO = hc.Chain(2, **STEEL)
PULSE = hc.Pulse("cosine", 100.0, 2.0, momentum_ratio=1.0)

RESTITUTION = {0.9: 0.9020261, 0.8: 0.8080993, 0.7: 0.7182014, 0.5: 0.5502832, 0.3: 0.3971405}
"""Restitution without attraction by the nominal one; from the closed form."""


def restitution(scene: hc.Scene) -> float:
    """Velocity of parting over that of approach, of two spheres."""
    lasting = replace(scene, run=hc.Run(scene.end_time))
    velocity = hc.Native(rtol=1e-10, wanted="all").run(lasting).velocity
    return float(velocity[1] - velocity[0]) / scene.shock.start_velocity


@pytest.mark.parametrize(("asked", "found"), RESTITUTION.items())
def test_two_spheres_part_as_the_closed_form_says(asked: float, found: float) -> None:
    law = hc.Contact("restitution", restitution=asked)
    scene = hc.Scene(TWO, hc.Striker(1.0), contact=law)
    assert restitution(scene) == pytest.approx(found, rel=0, abs=5.1e-8)  # half of its last digit
    pulling = replace(scene, contact=replace(law, attraction=True))
    # Peaks are asked for to 1e-10, of which the velocity has as much.
    assert restitution(pulling) == pytest.approx(asked, rel=1e-9, abs=0)


LAWS = {
    "restitution": hc.Contact("restitution", restitution=0.8),
    "viscoelastic": hc.Contact("viscoelastic", relaxation_time=1e-6),
    "dashpot": hc.Contact("dashpot", coefficient=5.0),
    "restitution, pulling": hc.Contact("restitution", restitution=0.8, attraction=True),
}


def scene_with(law: hc.Contact) -> hc.Scene:
    """All terms at once."""
    granules = [STEEL, STEEL | {"density": 3000.0}, STEEL | {"radius": 4e-3}] * 3
    chain = hc.Chain(9, **{key: [each[key] for each in granules] for key in STEEL})
    load = hc.Precompression(2.0, 9.81)
    striker = hc.Striker(0.5, radius=6e-3)
    return hc.Scene(
        chain, striker, wall=hc.Wall("elastic", 70e9, 0.33), precompression=load, contact=law
    )


@pytest.mark.parametrize(("named", "how"), [("method", {"method": "rk4"}), ("dt", {"dt": 1e-7})])
def test_what_has_no_damping_says_so(named: str, how: dict[str, Any]) -> None:
    with pytest.raises(hc.HertzchainError, match=f"{named}.*left out for damped"):
        hc.Native(**how).run(scene_with(LAWS["dashpot"]))


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
    """A light granule in the chain bears less than the wall, which a heavy one touches."""
    material: dict[str, Any] = {key: [value] * 4 for key, value in STEEL.items()}
    chain = hc.Chain(4, **material | {"radius": [5e-3, 5e-3, 1e-3, 5e-3]})

    def damped(of_contacts: float, of_wall: float) -> hc.Scene:
        contact = hc.Contact("dashpot", coefficient=of_contacts)
        wall = hc.Wall("rigid", coefficient=of_wall)
        return hc.Scene(chain, hc.Striker(1.0), wall=wall, contact=contact)

    def limit(named: str, of_contacts: float, of_wall: float) -> float:
        with pytest.raises(SceneError, match=rf"^{named}\.coefficient = .*at most ") as refused:
            refuse_strong_dampers(damped(of_contacts, of_wall))
        return float(str(refused.value).split("at most ")[1].split()[0])

    light, heavy = limit("contact", 1e300, 1.0), limit("wall", 1.0, 1e300)
    assert light < heavy / 10
    assert limit("contact", 1.1 * light, 0.9 * heavy) == light
    assert limit("wall", 0.9 * light, 1.1 * heavy) == heavy
    refuse_strong_dampers(damped(0.9 * light, 0.9 * heavy))


def test_no_run_for_the_end_of_a_scene_that_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """Waves of unlike granules are reflected: quick runs tell when all pulses are over."""

    def run(*_: object, **__: object) -> None:
        pytest.fail("a run that nothing can follow")

    monkeypatch.setattr("hertzchain.engines.native.damped_runs.simulate_damped", run)
    scene = scene_with(hc.Contact("dashpot", coefficient=1e300))
    with pytest.raises(SceneError, match="beyond what can be computed"):
        hc.Lammps().run(scene)


def test_a_maximum_in_a_step_as_long_as_its_leg() -> None:
    """Every run that tells the error has this step: 1.7e-7 by interpolation, the whole bound."""
    scene = random_hard_scene(np.random.default_rng([7, 1, 20364]), 30, 200.0, is_damped=True)
    result = hc.Native(rtol=4.183e-6).run(scene)
    error = extrapolation.solve(scene).error_of(result.peak_force)
    assert error <= result.error_estimate
    assert error < 1e-9  # 2.5e-10 by the steps


@pytest.mark.parametrize("own", [None, 0.4])
def test_a_bead_leaves_a_wall_with_its_restitution(own: float | None) -> None:
    contact = hc.Contact("restitution", restitution=0.9, attraction=True)
    chain = hc.Chain(2, **STEEL, gap=1e-2, velocity=(0.0, 1.0))
    scene = hc.Scene(chain, wall=hc.Wall("rigid", restitution=own), contact=contact)
    collision = hc.Run(20 * scene.contact_time)  # and the flight back is far longer
    found = hc.Native(rtol=1e-8).run(replace(scene, run=collision))
    assert found.velocity[1] == pytest.approx(-(own or 0.9), rel=1e-7)
