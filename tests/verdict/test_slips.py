"""Known slips: their factors, and when a fitted factor is named after one."""

from __future__ import annotations

import re
from dataclasses import replace

import pint
import pytest

import hertzchain as hc
from hertzchain.verdict.mistakes import with_rise_time
from hertzchain.verdict.slips import (
    SLIPS_OF_FORCE,
    UNITS_OF_PEAKS,
    force_in_words,
    near,
    scale_in_words,
    slips_of_stiffness,
    slips_of_stretch,
    stretch_in_words,
)
from tests.conftest import paper_scene

SCENE = paper_scene("cosine-triangular", 2.0, 2.0, 30)
NU = 0.3
SLIPS = {
    "effective modulus E/(1 - nu^2) in place of half of it": (2, 1),
    "effective modulus E in place of E/(2 (1 - nu^2))": (2 * (1 - NU**2), 1),
    "effective modulus halved twice": (0.5, 1),
    "E in place of E/(1 - nu^2)": (1 - NU**2, 1),
    "1 - nu in place of 1 - nu^2": (1 + NU, 1),
    "shear modulus in place of E": (1 / 2.6, 1),
    "the factor 2/3 is missing": (3 / 2, 1),
    "the factor 4/3 is missing": (3 / 4, 1),
    "R in place of the effective radius R/2": (2**0.5, 1),
    "diameter taken for radius": (2**0.5, 8),
    "radius taken for diameter": (2**-0.5, 1 / 8),
    "diameter taken for radius in the mass": (1, 8),
    "radius taken for diameter in the mass": (1, 1 / 8),
    "half the mass": (1, 0.5),
    "twice the mass": (1, 2),
    "density in g/cm^3 taken for kg/m^3": (1, 1e-3),
    "E in dyn/cm^2 taken for Pa": (10, 1),
    "radius in cm taken for m": (10, 1e6),
    "radius in mm taken for m": (1000**0.5, 1e9),
    "E in GPa taken for Pa": (1e-9, 1),
    "E in MPa taken for Pa": (1e-6, 1),
    "density set before the diameter": (1, 0.0095**-3),
}
"""Factors of stiffness and mass: the stiffness goes as E R^(1/2), the mass as R^3."""


def test_slips_of_the_chain_follow_from_its_stiffness_and_mass() -> None:
    found = slips_of_stretch(SCENE)
    # The natural time goes as m^(1/2) A^(-1/3) at the same force.
    expected = {name: a ** (1 / 3) * m**-0.5 for name, (a, m) in SLIPS.items()}
    expected |= {"duration taken for rise time": 2.0, "rise time taken for duration": 0.5}
    assert found == pytest.approx(expected, rel=1e-12, abs=0)


def test_units_of_force_are_those_of_pint() -> None:
    units: pint.UnitRegistry[float] = pint.UnitRegistry()
    for name, factor in UNITS_OF_PEAKS.items():
        newton = units.Quantity(1.0, "newton").to("micronewton" if name == "uN" else name)
        # Pound forces have seven digits here.
        assert factor == pytest.approx(newton.magnitude, rel=1e-8, abs=0)
    for name, factor in SLIPS_OF_FORCE.items():
        asked, taken = re.findall(r"in (\w+) taken for (\w+)", name)[0] if " in " in name else "NN"
        known = units.Quantity(1.0, taken).to(asked).magnitude if " in " in name else factor
        assert factor == pytest.approx(known, rel=1e-8, abs=0)
    assert (SLIPS_OF_FORCE["half of F0"], SLIPS_OF_FORCE["twice F0"]) == (0.5, 2.0)


@pytest.mark.parametrize(
    ("nu", "stretch", "name", "within"),
    [
        (0.0, 2**0.5, "half the mass", 3e-3),
        # 1 - nu^2 changes the length of the pulse by 3.3e-3: a tenth of that.
        (0.1, 0.99 ** (1 / 3), "E in place of E/(1 - nu^2)", 3.3e-4),
    ],
)
def test_a_known_factor_is_named_where_it_is_near(
    nu: float, stretch: float, name: str, within: float
) -> None:
    scene = with_rise_time(SCENE)
    scene = replace(scene, chain=replace(scene.chain, poisson_ratio=nu))
    for off, named in ((0.9, True), (-0.9, True), (1.1, False), (-1.1, False)):
        assert (name in stretch_in_words(scene, stretch * (1 + off * within))) is named


def test_factors_that_cannot_be_told_apart_have_no_name() -> None:
    """1 - nu^2 is 1 - 9e-4; of two factors that are that far apart the nearer one is named."""
    scene = with_rise_time(SCENE)
    scene = replace(scene, chain=replace(scene.chain, poisson_ratio=0.03))
    known = slips_of_stiffness(scene)
    assert near(known, 1 - 0.03**2) == []
    assert near(known, 2.0) == ["effective modulus E/(1 - nu^2) in place of half of it"]


def test_factors_in_words() -> None:
    """A known factor has its name, any other what may have made it."""
    force = SCENE.units.force
    unit = 1 / force
    for words, expected in (
        (force_in_words(0.5), "applied force 0.5 times that of the scene: half of F0"),
        (force_in_words(0.7), "applied force 0.7 times that of the scene"),
        (scale_in_words(SCENE, 1e-3), "every peak 0.001 times the true one: in units of kN"),
        (scale_in_words(SCENE, unit), f"every peak {unit:.6g} times the true one: in units of F0"),
        (scale_in_words(SCENE, 0.7), f"{PEAKS}, or another applied force at the same LM_ratio"),
        (scale_in_words(replace(SCENE, shock=hc.Striker(0.5)), 0.7), PEAKS),
        (stretch_in_words(SCENE, 1.2), STRETCHED),
        (stretch_in_words(SCENE, 2.0).partition("apart)")[2], ": duration taken for rise time"),
    ):
        assert words == expected


PEAKS = "every peak 0.7 times the true one: another unit"
STRETCHED = (
    "contact stiffness 1.728 times that of the scene, or mass 0.694444 times, or pulse 1.2 times"
    " as long (peaks cannot tell these apart)"
)
