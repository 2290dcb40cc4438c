"""The chain: accepted values, and mass and stiffness against Newton's and Hertz's own formulas."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import hertzchain as hc
from hertzchain.errors import is_finite, is_positive
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


def test_errors_are_also_value_errors() -> None:
    with pytest.raises(ValueError, match="granules = 1: must be an integer from 2"):
        chain_with(granules=1)


def test_a_chain_cannot_be_changed() -> None:
    with pytest.raises(dataclasses.FrozenInstanceError):
        chain_with().radius = 1.0  # type: ignore[misc]


def test_equal_chains_are_equal_and_hash_alike() -> None:
    assert chain_with() == chain_with()
    assert hash(chain_with()) == hash(chain_with())
    assert chain_with() != chain_with(granules=61)


@pytest.mark.parametrize("value", [0, 1, -2.5, 5e-324, np.float64(3.0)])
def test_finite_numbers_are_finite(value: object) -> None:
    assert is_finite(value)


@pytest.mark.parametrize("value", [math.inf, -math.inf, math.nan, True, "1", None, 1j, [1.0]])
def test_what_is_not_a_finite_number_is_not(value: object) -> None:
    assert not is_finite(value)
    assert not is_positive(value)


@pytest.mark.parametrize(
    ("value", "positive"), [(5e-324, True), (1, True), (0.0, False), (-1, False)]
)
def test_positive_means_above_0(value: object, positive: bool) -> None:
    assert is_positive(value) is positive
