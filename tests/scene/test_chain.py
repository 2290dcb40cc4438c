"""The chain: accepted values, and mass and stiffness against Newton's and Hertz's own formulas."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

import hertzchain as hc
from tests.conftest import STEEL

ROUND_OFF = 1e-15
"""A few roundings of 1e-16."""


def chain_with(**changes: Any) -> hc.Chain:
    """The paper's chain of 60 with something else about it."""
    return hc.Chain(**{"granules": 60, **STEEL, **changes})


def test_mass_is_volume_times_density() -> None:
    volume = math.pi * 9.5e-3**3 / 6  # of a sphere, from its diameter
    assert chain_with().granule_mass == pytest.approx(volume * 7958.0, rel=ROUND_OFF)


@given(poisson_ratio=st.floats(-0.9, 0.5), radius=st.floats(1e-6, 1e3))
def test_contact_stiffness_vs_the_hertz_law_of_two_unlike_spheres(
    poisson_ratio: float, radius: float
) -> None:
    """F = 4/3 E* sqrt(R*) overlap^(3/2) with 1/E* = 2 (1 - nu^2) / E and 1/R* = 2 / R."""
    chain = chain_with(poisson_ratio=poisson_ratio, radius=radius)
    modulus = 1 / (2 * (1 - poisson_ratio**2) / 193e9)
    expected = 4 / 3 * modulus * math.sqrt(1 / (1 / radius + 1 / radius))
    assert chain.contact_stiffness == pytest.approx(expected, rel=ROUND_OFF)
