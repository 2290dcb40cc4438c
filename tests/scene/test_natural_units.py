"""Natural units against Hertz's law, Newton's law and LAMMPS."""

from __future__ import annotations

import math

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
from tests.conftest import paper_scene

ROUND_OFF = 1e-14
"""A few dozen roundings of 1e-16."""


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
