"""Mass, stiffness and natural units against the laws of Hertz and Newton."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

import hertzchain as hc
from hertzchain.scene.natural_units import (
    MOMENTUM_IN_NATURAL_UNITS,
    PAPER_MOMENTUM,
    force_scale,
    natural_units,
)
from tests.conftest import STEEL, paper_scene

ROUND_OFF = 1e-14
"""A few dozen roundings of 1e-16."""


def chain_with(**changes: Any) -> hc.Chain:
    """The paper's chain of 60 with something else about it."""
    return hc.Chain(**{"granules": 60, **STEEL, **changes})


def test_mass_is_volume_times_density() -> None:
    volume = math.pi * 9.5e-3**3 / 6  # of a sphere, from its diameter
    assert chain_with().granule_mass == pytest.approx(volume * 7958.0, rel=1e-15)  # a few roundings


@given(poisson_ratio=st.floats(-0.9, 0.5), radius=st.floats(1e-6, 1e3))
def test_contact_stiffness_vs_the_hertz_law_of_two_unlike_spheres(
    poisson_ratio: float, radius: float
) -> None:
    """F = 4/3 E* sqrt(R*) overlap^(3/2) with 1/E* = 2 (1 - nu^2) / E and 1/R* = 2 / R."""
    chain = chain_with(poisson_ratio=poisson_ratio, radius=radius)
    modulus = 1 / (2 * (1 - poisson_ratio**2) / 193e9)
    expected = 4 / 3 * modulus * math.sqrt(1 / (1 / radius + 1 / radius))
    assert chain.contact_stiffness == pytest.approx(expected, rel=1e-15)  # a few roundings


factor = st.floats(1e-6, 1e6)


@given(modulus=factor, force=factor, radius=factor, density=factor, nu=st.floats(-0.99, 0.5))
def test_units_vs_the_laws_of_hertz_and_newton(
    modulus: float, force: float, radius: float, density: float, nu: float
) -> None:
    """The unit force presses two granules by the unit length, and moves one as far."""
    modulus, force, radius, density = 193e9 * modulus, 100 * force, 4.75e-3 * radius, 7958 * density
    units = natural_units(hc.Chain(60, radius, modulus, nu, density), force)
    # Effective, of two equal granules.
    hertz = 4 / 3 * modulus / (2 * (1 - nu**2)) * math.sqrt(radius / 2)
    mass = 4 / 3 * math.pi * radius**3 * density
    assert units.force == force
    assert hertz * units.length**1.5 == pytest.approx(force, rel=ROUND_OFF, abs=0)
    assert mass * units.length / units.time**2 == pytest.approx(force, rel=ROUND_OFF, abs=0)
    assert units.velocity * units.time == pytest.approx(units.length, rel=ROUND_OFF, abs=0)
    assert units.momentum == pytest.approx(mass * units.velocity, rel=ROUND_OFF, abs=0)
    assert units.energy == pytest.approx(mass * units.velocity**2, rel=ROUND_OFF, abs=0)


def test_momentum_of_the_unit_wave_is_1_651778333() -> None:
    assert PAPER_MOMENTUM == 4.34375
    assert round(MOMENTUM_IN_NATURAL_UNITS, 9) == 1.651778333


@pytest.mark.parametrize("momentum_ratio", [1e-3, 1e-4])
def test_a_short_pulse_presses_as_hard_as_its_momentum_does(momentum_ratio: float) -> None:
    """Two granules: no other takes momentum away from the one that is pushed."""
    peak = hc.Native("reference").run(paper_scene("cosine", momentum_ratio, 2.0, granules=2))
    # The momentum that the contact takes during the pulse is of the order of LM_ratio squared.
    scale = force_scale(momentum_ratio)
    assert peak.peak_force[0] / 100 == pytest.approx(scale, rel=3 * momentum_ratio, abs=0)


def test_a_long_pulse_presses_with_about_its_force() -> None:
    # 0.754272 I^1.2 is 1 at LM_ratio 0.76579.
    assert 0.999 < force_scale(0.7655) < 1
    assert [force_scale(ratio) for ratio in (0.766, 1.0, 2.0, 1e308)] == [1.0] * 4
