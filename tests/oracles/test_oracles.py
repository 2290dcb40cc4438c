"""The oracle that judges error bounds, against known answers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import hertzchain as hc
from tests.conftest import STEEL, paper_scene
from tests.oracles import extrapolation


def test_two_granules_under_a_constant_force() -> None:
    # The peak is 5/4 F0, from the balance of energy. A rise of a hundred-thousandth of the time
    # of contact changes it by the square of that.
    unit = paper_scene("cosine", 1.0, 2.0, 2).units.time
    shock = hc.PulseTable((0.0, 1e-5 * unit, 50 * unit), (0.0, 100.0, 100.0))
    truth = extrapolation.solve(hc.Scene(hc.Chain(2, **STEEL), shock))
    assert truth.force[0] == pytest.approx(125.0, rel=1e-11, abs=0)
    assert truth.error < 1e-10  # ten times the difference of two runs; 3e-12 is what it is off


COLLISIONS = {
    "restitution": (hc.Contact("restitution", restitution=0.5), 0.5502832),
    "weak restitution": (hc.Contact("restitution", restitution=0.9), 0.9020261),
    "with attraction": (hc.Contact("restitution", restitution=0.5, attraction=True), 0.5),
    # Of the series of Kuwabara and Kono's law, at a tenth of the time of the collision.
    "viscoelastic": (hc.Contact("viscoelastic", relaxation_time=0.1), 0.84514381),
    "viscoelastic with attraction": (
        hc.Contact("viscoelastic", relaxation_time=0.1, attraction=True), 0.84333941,
    ),
}  # fmt: skip
"""Laws, and the speed after a collision over that before."""


@pytest.mark.parametrize("name", COLLISIONS)
def test_speeds_after_a_collision(name: str) -> None:
    law, expected = COLLISIONS[name]
    scene = hc.Scene(hc.Chain(2, **STEEL), hc.Striker(0.1))
    each = scene.granules
    unit = float((each.contact_mass[0] / each.stiffness[0]) ** 0.4 * 0.1**-0.2)
    if law.relaxation_time is not None:
        law = replace(law, relaxation_time=law.relaxation_time * unit)
    before, after = extrapolation.peaks(replace(scene, contact=law)).velocity
    # All digits that are known; 1e-12 of 0.5.
    assert (after - before) / 0.1 == pytest.approx(expected, rel=1e-7, abs=0)


def test_errors_are_told() -> None:
    truth = extrapolation.Truth(np.array([1.0, 2.0, 1e-4]), 0.0)
    assert truth.error_of(np.array([1.0, 2.0, 5.0])) == 0  # below a thousandth of the largest
    assert truth.error_of(np.array([1.0, 2.002, 0.0])) == pytest.approx(1e-3)
    nothing = extrapolation.Truth(np.zeros(3), 0.0)
    assert nothing.error_of(np.zeros(3)) == 0
    assert nothing.error_of(np.array([0.0, 1e-9, 0.0])) == 1
