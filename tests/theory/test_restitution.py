"""Restitution of damped contacts: closed forms, SciPy, and a simulated wave."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.errors import SceneError
from hertzchain.report.files import run_document
from hertzchain.theory import restitution
from hertzchain.theory.restitution import (
    Collision,
    of_natural,
    of_ratio,
    parting,
)
from tests.conftest import STEEL

ROOT_5 = math.sqrt(5)
BOTH = pytest.mark.parametrize("pulls", [False, True])


def collide(damping: float, exponent: float, pulls: bool, duration: float = 60.0) -> float:
    """Speed after a collision of speed 1: the force as it stands, no end of contact looked for.

    Steps are short where the contact ends, as SciPy finds them.
    """

    def motion(_: float, state: FloatArray) -> tuple[float, float]:
        d, v = state
        if d <= 0:
            return v, 0.0
        force = d**1.5 + damping * d**exponent * v
        return v, -force if pulls else -max(force, 0.0)

    solution = solve_ivp(motion, (0, duration), (0, 1), rtol=1e-10, atol=1e-13, method="RK45")
    assert solution.success
    return float(-solution.y[1, -1])


@pytest.mark.parametrize(
    ("asked", "given"),
    [(0.9, 0.9020261), (0.8, 0.8080993), (0.7, 0.7182014), (0.5, 0.5502832), (0.3, 0.3971405)],
)
def test_contacts_that_do_not_pull_give_more_than_was_asked(asked: float, given: float) -> None:
    """Found by independent integration, to all digits shown."""
    ratio = restitution.damping_ratio(asked)
    assert of_ratio(ratio, False) == pytest.approx(given, abs=0.5e-7)  # half a unit of the last
    assert of_ratio(ratio, True) == pytest.approx(asked, rel=1e-14)  # round-off


@BOTH
@pytest.mark.parametrize("ratio", [0.05, 0.6, 1.4])
def test_the_closed_form_is_the_motion(ratio: float, pulls: bool) -> None:
    expected = collide(ROOT_5 * ratio, 0.25, pulls, 60.0 if ratio < 1 else 400.0)
    # SciPy's steps are right to 1e-8 across the ends of the contact. Above a ratio of 1 the overlap
    # of a contact that pulls creeps to 0, and the speed falls as t^-5: 2.7e-5 at 60, 2e-9 at 400.
    assert of_ratio(ratio, pulls) == pytest.approx(expected, abs=3e-8)


@pytest.mark.parametrize(
    ("relaxation", "pulled", "parted"),
    [(0.01, 0.98287613, 0.98288329), (0.1, 0.84333941, 0.84514381)],
)
def test_kuwabara_and_kono(relaxation: float, parted: float, pulled: float) -> None:
    """The spheres part at a lower speed where the contact pulls as it opens."""
    collision = Collision(mass=1.0, stiffness=1.0, velocity=1.0)
    # Half a unit of the last digit that is known.
    assert restitution.viscoelastic(relaxation, collision, False) == pytest.approx(parted, abs=5e-9)
    assert restitution.viscoelastic(relaxation, collision, True) == pytest.approx(pulled, abs=5e-9)


@BOTH
@pytest.mark.parametrize(("exponent", "damping"), [(0.0, 0.1), (0.0, 0.9), (0.5, 0.3), (0.5, 2.0)])
def test_laws_that_depend_on_the_velocity(exponent: float, damping: float, pulls: bool) -> None:
    expected = collide(damping, exponent, pulls)
    # As above; the force of a dashpot jumps where the contact ends.
    assert of_natural(damping, exponent, pulls) == pytest.approx(expected, abs=3e-8)


@BOTH
@pytest.mark.parametrize("exponent", [0.0, 0.5])
def test_extremes(exponent: float, pulls: bool) -> None:
    for weak in (1e-300, 1.1e-12, 1e-9):
        # 1 - e is at most 1.8 c; e is right to 1e-10.
        assert of_natural(weak, exponent, pulls) == pytest.approx(1.0, abs=1.8e-9)
    for strong in (1e9, 1e11, 1e300):
        assert 0 <= of_natural(strong, exponent, pulls) < 1e-10
    assert 0 <= of_ratio(1e300, pulls) < 1e-300
    assert of_ratio(0.0, pulls) == 1.0
    # Critical damping, and (2 z)^-2 for a large z; the next term is of the order of ln z / z^2.
    assert of_ratio(1.0, pulls) == (0.0 if pulls else math.exp(-2))
    assert of_ratio(1e4, pulls) == pytest.approx(0.0 if pulls else 2.5e-9, rel=1e-6)


def test_a_dashpot_that_pulls_holds_the_spheres() -> None:
    """From c = 1.17 on: in SciPy's motion the overlap is still there after a long time."""
    below = of_natural(1.1, 0.0, True)
    assert below == pytest.approx(collide(1.1, 0.0, True), abs=3e-8)  # as above
    assert below > 0
    assert of_natural(1.2, 0.0, True) == of_natural(100.0, 0.0, True) == 0.0
    assert abs(collide(1.2, 0.0, True, 400.0)) < 1e-6  # creeps: 8 c^2 / t^3 = 2e-7


def test_units_of_a_collision() -> None:
    """A scene, and the same in natural units: lengths, times and masses are scaled."""
    scene = hc.Scene(hc.Chain(2, **STEEL), hc.Striker(2.0, radius=6e-3))
    mass, other = scene.granules.mass
    collision = Collision(mass * other / (mass + other), float(scene.granules.stiffness[0]), 2.0)
    # x = 3/2 A (k/m)^(2/5) v^(1/5) and g (m^3 k^2 v)^(-1/5), formulas of dimensions
    m, k, v = collision.mass, collision.stiffness, 2.0
    x, c = 1.5e-6 * (k / m) ** 0.4 * v**0.2, 20 / (m**3 * k**2 * v) ** 0.2
    expected = of_natural(x, 0.5, True)
    assert restitution.viscoelastic(1e-6, collision, True) == pytest.approx(expected, rel=1e-10)
    expected = of_natural(c, 0.0, False)
    assert restitution.dashpot(20.0, collision, False) == pytest.approx(expected, rel=1e-10)


def test_what_cannot_be_is_refused() -> None:
    for wrong in (0.0, 1.001, math.nan):
        with pytest.raises(SceneError, match="must be a finite number above 0 and at most 1"):
            restitution.damping_ratio(wrong)
    for wrong in (-1.0, math.inf):
        with pytest.raises(SceneError, match=r"ratio = .*at least 0"):
            of_ratio(wrong, True)
        with pytest.raises(SceneError, match="damping"):
            of_natural(wrong, 0.0, True)
    with pytest.raises(SceneError, match="exponent"):
        of_natural(0.1, 0.25, True)
    with pytest.raises(SceneError, match="velocity"):
        Collision(1.0, 1.0, 0.0)


# Two spheres of a scene


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
    parted = parting(hc.Scene(CHAIN, hc.Striker(speed), contact=law))
    mass, decay = MASS / 2, math.log(2)
    # Dimensionless, of lengths and times of a collision at this speed.
    damping = {
        "viscoelastic": 1.5e-6 * (STIFFNESS / mass) ** 0.4 * speed**0.2,
        "dashpot": 10.0 / (mass**3 * STIFFNESS**2 * speed) ** 0.2,
    }.get(name, math.sqrt(5) * decay / math.hypot(math.pi, decay))
    # SciPy's steps across the ends of the contact are right to 1e-8.
    assert parted.restitution == pytest.approx(collide(damping, q, law.attraction), abs=3e-8)
    assert parted.speed == (None if q == 0.25 else speed)
    assert parting(hc.Scene(CHAIN, hc.Piston(speed), contact=law)).speed == parted.speed
    assert parting(hc.Scene(CHAIN, PULSE)) is None


def test_a_granule_in_a_wave_is_as_fast_as_in_a_run() -> None:
    law, _ = LAWS["dashpot"]
    speed = parting(hc.Scene(CHAIN, PULSE, contact=law)).speed
    result = hc.Native(rtol=1e-6).run(hc.Scene(CHAIN, PULSE), record=10_000)
    # The velocity goes as F^(5/6); 10,000 samples miss the maximum by 1e-5 of it.
    height = result.solitary_wave.far_field_force / PULSE.peak_force
    assert np.max(result.history.velocity[:, 40]) == pytest.approx(
        speed * height ** (5 / 6), rel=1e-4
    )


def test_a_document_of_a_damped_run_has_it() -> None:
    short = hc.Chain(3, **STEEL)
    for name, (law, _) in LAWS.items():
        scene = hc.Scene(short, hc.Striker(1.0), contact=law)
        parted = parting(scene)
        document = run_document(hc.Native(rtol=1e-4).run(scene))
        expected = {"restitution": parted.restitution, "speed_m_s": parted.speed}
        assert document["two_spheres"] == expected, name
    assert "two_spheres" not in run_document(hc.Native().run(hc.Scene(short, PULSE)))
