"""Scenes with damped contacts: closed forms, series, similarity, and commands without damping."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.decks.known_answer import deck_step
from hertzchain.errors import SceneError
from hertzchain.observables.error_bound import refuse_strong_dampers
from hertzchain.verdict.run_checks import balance_checks
from tests.conftest import STEEL

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


@pytest.mark.parametrize(
    ("relaxation", "limited", "pulling"),
    [(0.01, 0.98288329, 0.98287613), (0.1, 0.84514381, 0.84333941)],
)
def test_spheres_of_kuwabara_and_kono(relaxation: float, limited: float, pulling: float) -> None:
    """Compare with independent simulations, in units in which m*, A and the velocity are 1."""
    granules = hc.Scene(TWO, hc.Striker(1.0)).granules
    mass, stiffness = float(granules.contact_mass[0]), float(granules.stiffness[0])
    time = (mass / stiffness) ** 0.4  # at the velocity 1 m/s
    law = hc.Contact("viscoelastic", relaxation_time=relaxation * time)
    scene = hc.Scene(TWO, hc.Striker(1.0), contact=law)
    half_a_digit = 5.1e-9
    assert restitution(scene) == pytest.approx(limited, rel=0, abs=half_a_digit)
    scene = replace(scene, contact=replace(law, attraction=True))
    assert restitution(scene) == pytest.approx(pulling, rel=0, abs=half_a_digit)


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


@pytest.mark.parametrize("law", LAWS)
def test_momentum_and_energy_with_all_terms(law: str) -> None:
    result = hc.Native(rtol=1e-8).run(scene_with(LAWS[law]))
    assert result.error_estimate <= 1e-8
    assert [check for check in balance_checks(result) if not check.passed] == []
    balance = result.balance
    # Steps are right to a tenth of 1e-8, and hundreds of them add up.
    lost = balance.energy + balance.dissipated - balance.work
    assert abs(lost) < 1e-8 * balance.work
    assert 0.1 * balance.work < balance.dissipated


def test_the_law_of_restitution_is_similar_at_all_forces() -> None:
    """Peaks over F0 do not depend on F0, E, R and density: alpha is a number."""
    law = LAWS["restitution"]
    found = [
        hc.Native(rtol=1e-9).run(hc.Scene(hc.Chain(12, **granules), pulse, contact=law)).peak_force
        / pulse.peak_force
        for granules, pulse in (
            (STEEL, PULSE),
            (STEEL, replace(PULSE, peak_force=0.01)),
            ({"radius": 1e-3, "young_modulus": 1e9, "poisson_ratio": 0.1, "density": 900.0}, PULSE),
        )
    ]
    for other in found[1:]:
        assert np.max(np.abs(other / found[0] - 1)) < 2e-9  # both are right to 1e-9


@pytest.mark.parametrize("law", LAWS)
def test_weak_damping_is_none(law: str) -> None:
    weak: dict[str, Any] = {"restitution": 1 - 1e-9, "relaxation_time": 1e-15, "coefficient": 1e-8}
    given = LAWS[law]
    same = {key: weak[key] for key in weak if getattr(given, key) is not None}
    scene = hc.Scene(hc.Chain(15, **STEEL), PULSE)
    damped = hc.Native(rtol=1e-8).run(replace(scene, contact=replace(given, **same)))
    elastic = hc.Native(rtol=1e-8).run(scene)
    # Damping itself takes about 1e-8 of the peaks.
    assert np.max(np.abs(damped.peak_force / elastic.peak_force - 1)) < 1e-7


REFUSED: dict[str, Callable[[hc.Scene], object]] = {
    "method": lambda scene: hc.Native("rk4").run(scene),
    "dt": lambda scene: hc.Native(dt=1e-7).run(scene),
}


@pytest.mark.parametrize("who", REFUSED)
def test_what_has_no_damping_says_so(who: str) -> None:
    scene = scene_with(LAWS["dashpot"])
    with pytest.raises(hc.HertzchainError, match=f"{who}.*left out for damped"):
        REFUSED[who](scene)


def test_damping_of_walls_takes_the_mass_of_the_last_granule() -> None:
    scene = hc.Scene(
        hc.Chain(1 + 1, **STEEL),
        hc.Striker(1.0),
        wall=hc.Wall("rigid"),
        contact=LAWS["restitution"],
    )
    granules = scene.granules
    assert granules.damping is not None
    alpha = math.sqrt(5) * math.log(1 / 0.8) / math.hypot(math.pi, math.log(0.8))
    for mass, stiffness, damping in zip(
        granules.mass[0] * np.array([0.5, 1.0]), granules.stiffness, granules.damping, strict=True
    ):
        assert damping == pytest.approx(alpha * math.sqrt(mass * stiffness), rel=1e-14, abs=0)


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
