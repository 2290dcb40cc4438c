"""Damped scenes in which bounds are hard to keep, and walls with damping of their own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import hertzchain as hc
from tests.conftest import STEEL
from tests.oracles import extrapolation
from validation.random_drives import random_hard_scene


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
