"""Forces of damped contacts that velocity Verlet computes with velocities of half a step before."""

from __future__ import annotations

import numpy as np
import pytest

from hertzchain.observables.damped_law import DampedLaw, true_forces
from hertzchain.observables.samples import Samples
from hertzchain.scene.schedule import Leg

LEG = Leg(1.0, 1.3, 3, None)
TIME = np.array([1.0, 1.1, 1.2, 1.3])
OVERLAP = np.array([[0.2], [0.5], [0.4], [0.1]])
RATE = np.array([3.0, 0.5, -1.0, -4.0])
GROWTH = np.array([-9.0, -20.0, -25.0, -30.0])
"""A contact that closes and opens, by the motion of the first of two granules."""


def law(exponent: float, attraction: bool) -> DampedLaw:
    return DampedLaw(np.array([7.0]), np.array([0.6]), exponent, attraction)


def samples(force: np.ndarray) -> Samples:
    def moves(values: np.ndarray) -> np.ndarray:
        return np.stack([values, np.zeros_like(values)], axis=1)

    return Samples(TIME, moves(OVERLAP[:, 0]), moves(RATE), moves(GROWTH), OVERLAP, force)


@pytest.mark.parametrize("attraction", [True, False])
@pytest.mark.parametrize("exponent", [0.0, 0.25, 0.5])
def test_forces_become_those_of_the_velocities_of_their_time(
    exponent: float, attraction: bool
) -> None:
    """At the start of a leg they are, as forces are computed again there."""
    one = law(exponent, attraction)
    half = np.where(LEG.start < TIME, LEG.dt / 2, 0.0)
    given = one.force(OVERLAP, (RATE - half * GROWTH)[:, np.newaxis])
    found = true_forces(samples(given), one, LEG).contact_force
    right = one.force(OVERLAP, RATE[:, np.newaxis])
    np.testing.assert_allclose(found, right, rtol=1e-14, atol=1e-14)
    assert found[0] == given[0]
    assert np.all(found[1:3] != given[1:3])


@pytest.mark.parametrize(("attraction", "pulls"), [(True, True), (False, False)])
def test_contacts_that_may_not_pull_do_not_in_a_softer_code(attraction: bool, pulls: bool) -> None:
    """The change from one velocity to the other is the law's own, of the full stiffness."""
    one = law(0.25, attraction)
    softer = 0.1 * one.force(OVERLAP, 0 * OVERLAP)
    found = one.with_rate(softer, OVERLAP, 0 * OVERLAP, -4.0 + 0 * OVERLAP)
    assert bool(np.any(found < 0)) is pulls
