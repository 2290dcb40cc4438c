"""The comparison on scenes with terms, damped ones, and what LAMMPS makes of their decks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.verdict.comparison import examined, number_checks
from hertzchain.verdict.run_checks import same_steps_checks
from tests.conftest import STEEL
from tests.scenes import LAWS, PULSE, TERMS
from validation.mistakes import DAMPING, Plant, in_set_up

pytestmark = pytest.mark.lammps

HELD = {"lammps: radius [m]", "lammps: constant force [N]", "lammps: velocity at the start [m/s]"}
"""Checks that only scenes with terms have."""


def failed(comparison: hc.Comparison) -> dict[str, str]:
    """Names and reasons of the checks that failed."""
    return {check.name: check.reason for check in comparison.checks if not check.passed}


QUICK = ("all at once", "gaps, wall")
"""Together they have each term of these scenes."""


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[] if name in QUICK else pytest.mark.slow) for name in TERMS]
)
def test_every_scene_passes(name: str) -> None:
    scene = TERMS[name]
    comparison = hc.compare(scene)
    assert failed(comparison) == {}
    assert comparison.verdict == "pass"
    names = {check.name for check in comparison.checks}
    assert names > HELD
    assert ("lammps: place of the wall [m]" in names) == (scene.wall is not None)


def test_forces_that_are_no_numbers_fail() -> None:
    scene = TERMS["all at once"]
    deck = hc.Lammps().examine(scene)
    nothing = np.full_like(deck.contact_force, np.nan)
    walls = (replace(deck.walls[0], position=np.nan),)
    moving = np.full_like(deck.damped_force, np.nan)
    wrong = replace(deck, contact_force=nothing, damped_force=moving, walls=walls)
    bad = [check for check in number_checks(scene, wrong) if not check.passed]
    assert [check.name for check in bad] == ["lammps: place of the wall [m]", "lammps: contacts"]
    assert all(check.measured is None for check in bad)


# Damped contacts

UNLIKE = hc.Chain(3, **STEEL | {"radius": [4e-3, 5e-3, 6e-3]})


@pytest.mark.parametrize("contact", [None, LAWS["viscoelastic"]])
def test_extrapolated_peaks_are_held_against_extrapolated_ones(contact: hc.Contact | None) -> None:
    """The finer of their runs takes the steps of native, on legs of all lengths."""
    scene = hc.Scene(UNLIKE, PULSE, contact=contact)
    result = hc.Lammps(rtol=1e-4, extrapolated=True).run(scene)
    # Peaks of the finer run alone differ by ten to thirty times the tolerance.
    assert [check for check in same_steps_checks(result) if not check.passed] == []


WALLED = hc.Scene(hc.Chain(3, **STEEL), PULSE, wall=hc.Wall("same"))

MISTAKES: dict[str, tuple[hc.Scene, Plant]] = {
    "another restitution": (
        replace(WALLED, contact=LAWS["restitution"]),
        in_set_up(("${k1_1} 0.8 ", "${k1_1} 0.800001 ")),
    ),
    "contacts that pull": (
        replace(WALLED, contact=hc.Contact("dashpot", coefficient=500.0)),
        in_set_up((" limit_damping", "")),
    ),
    "wall without damping": (
        replace(WALLED, contact=LAWS["dashpot"]),
        in_set_up(("${k_wall} 5.0 ", "${k_wall} 0.0 ")),
    ),
    "the mass of one granule for that of the pair": (
        hc.Scene(UNLIKE, PULSE, contact=LAWS["viscoelastic"]),
        in_set_up(("/(v_m2*v_m3/(v_m2+v_m3))", "/v_m2")),
    ),
}


@pytest.mark.parametrize("what", MISTAKES)
def test_the_examination_names_wrong_damping(what: str) -> None:
    scene, plant = MISTAKES[what]
    assert [check.name for check in examined(scene, hc.Lammps()) if not check.passed] == []
    with plant():
        named = [check.name for check in examined(scene, hc.Lammps()) if not check.passed]
    assert named == [DAMPING]
