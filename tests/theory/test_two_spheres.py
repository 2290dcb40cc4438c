"""Two spheres that part under the damping of a scene, against SciPy and a simulated wave."""

from __future__ import annotations

import math

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.report.tables import run_document
from hertzchain.theory.two_spheres import parting
from tests.conftest import STEEL
from tests.theory.test_restitution import collide

CHAIN = hc.Chain(60, **STEEL)
RADIUS, DENSITY, MODULUS = 4.75e-3, STEEL["density"], STEEL["young_modulus"]
MASS = 4 / 3 * math.pi * RADIUS**3 * DENSITY
STIFFNESS = 2 / 3 * MODULUS / (1 - STEEL["poisson_ratio"] ** 2) * math.sqrt(RADIUS / 2)
PULSE = hc.Pulse("cosine", 100.0, 2.0, momentum_ratio=1.0)


LAWS = {
    "restitution": (hc.Contact("restitution", restitution=0.5), 0.25),
    "restitution that pulls": (hc.Contact("restitution", restitution=0.5, attraction=True), 0.25),
    "viscoelastic": (hc.Contact("viscoelastic", relaxation_time=1e-6), 0.5),
    "dashpot": (hc.Contact("dashpot", coefficient=10.0), 0.0),
}


@pytest.mark.parametrize("name", LAWS)
def test_two_spheres_part_as_the_law_says(name: str) -> None:
    law, q = LAWS[name]
    speed = 0.7
    found = parting(hc.Scene(CHAIN, hc.Striker(speed), contact=law))
    mass, decay = MASS / 2, math.log(2)
    # Dimensionless, of lengths and times of a collision at this speed.
    damping = {
        "viscoelastic": 1.5e-6 * (STIFFNESS / mass) ** 0.4 * speed**0.2,
        "dashpot": 10.0 / (mass**3 * STIFFNESS**2 * speed) ** 0.2,
    }.get(name, math.sqrt(5) * decay / math.hypot(math.pi, decay))
    # SciPy's steps across the ends of the contact are right to 1e-8.
    assert found.restitution == pytest.approx(collide(damping, q, law.attraction), abs=3e-8)
    assert found.speed == (None if q == 0.25 else speed)


def test_one_half_is_not_one_half() -> None:
    law, _ = LAWS["restitution"]
    found = parting(hc.Scene(CHAIN, PULSE, contact=law))
    assert found.restitution == pytest.approx(0.5502832, abs=0.5e-7)  # as tests of restitution have
    assert parting(hc.Scene(CHAIN, PULSE)) is None


def test_the_speed_of_a_piston_is_its_largest() -> None:
    law, _ = LAWS["dashpot"]
    struck, pushed = (
        parting(hc.Scene(CHAIN, shock, contact=law))
        for shock in (hc.Striker(0.1), hc.Piston(velocity=0.1))
    )
    assert (pushed.speed, pushed.restitution) == (struck.speed, struck.restitution)


def test_the_speed_is_that_of_a_granule_in_a_wave() -> None:
    """A wave that a striker sends, scaled to the height of the pulse: v goes as F^(5/6)."""
    scene = hc.Scene(CHAIN, hc.Striker(1.0), hc.Run(6e-4))
    result = hc.Native(rtol=1e-8).run(scene, record=np.linspace(3e-4, 6e-4, 6001))
    velocity = np.max(result.history.velocity[:, 29])
    force = math.sqrt(result.peak_at(30) * result.peak_at(31))
    found = parting(hc.Scene(CHAIN, PULSE, contact=LAWS["dashpot"][0]))
    # The wave of a striker is not yet of its final height, to 1e-5; Simpson's rule: below that.
    assert found.speed == pytest.approx(velocity * (100.0 / force) ** (5 / 6), rel=1e-4)


def test_a_document_of_a_damped_run_has_it() -> None:
    short = hc.Chain(3, **STEEL)
    for name, (law, _) in LAWS.items():
        scene = hc.Scene(short, hc.Striker(1.0), contact=law)
        found = parting(scene)
        document = run_document(hc.Native(rtol=1e-4).run(scene))
        expected = {"restitution": found.restitution, "speed_m_s": found.speed}
        assert document["two_spheres"] == expected, name
    assert "two_spheres" not in run_document(hc.Native().run(hc.Scene(short, PULSE)))
