"""Comparisons of damped scenes, and mistakes in their damping, each planted and to be named."""

from __future__ import annotations

from dataclasses import replace

import pytest

import hertzchain as hc
from hertzchain.verdict.deck.own import examined
from hertzchain.verdict.run_checks import balance_checks, same_steps_checks
from tests.conftest import STEEL
from tests.engines.native.test_damped import LAWS, PULSE, scene_with
from validation.planting import DAMPING, Plant, in_set_up

pytestmark = pytest.mark.lammps

UNLIKE = hc.Chain(3, **STEEL | {"radius": [4e-3, 5e-3, 6e-3]})


def test_a_comparison_passes() -> None:
    scene = scene_with(LAWS["restitution"])
    found = hc.compare(scene, [hc.Lammps(rtol=1e-2)])
    assert [check for check in found.checks if not check.passed] == []
    names = {check.name for check in found.checks}
    assert {DAMPING, "lammps: velocity, same steps", "lammps: energy [J]"} <= names


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
        in_set_up(('restitution string 0.8"', 'restitution string 0.800001"')),
    ),
    "restitution asked of tsuji": (
        replace(WALLED, contact=LAWS["restitution"]),
        in_set_up(("string coeff_restitution", "string tsuji")),
    ),
    "contacts that pull": (
        replace(WALLED, contact=hc.Contact("dashpot", coefficient=500.0)),
        in_set_up((" limit_damping", "")),
    ),
    "contacts that do not": (
        replace(WALLED, contact=hc.Contact("dashpot", coefficient=500.0, attraction=True)),
        in_set_up(("damping velocity", "damping velocity limit_damping")),
    ),
    "wall without damping": (
        replace(WALLED, contact=LAWS["dashpot"]),
        in_set_up(("${k_wall} 5.0 ", "${k_wall} 0.0 ")),
    ),
    "another law": (
        replace(WALLED, contact=LAWS["dashpot"]),
        in_set_up(("damping velocity", "damping viscoelastic")),
    ),
    "the mass of one granule for that of the pair": (
        hc.Scene(UNLIKE, PULSE, contact=LAWS["viscoelastic"]),
        in_set_up(("/(v_m2*v_m3/(v_m2+v_m3))", "/v_m2")),
    ),
    "no damping": (
        hc.Scene(UNLIKE, PULSE, contact=LAWS["dashpot"]),
        in_set_up(("} 5.0 tangential", "} 0.0 tangential")),
    ),
}


@pytest.mark.parametrize("what", MISTAKES)
def test_the_examination_names_wrong_damping(what: str) -> None:
    scene, plant = MISTAKES[what]
    assert [check.name for check in examined(scene, hc.Lammps()) if not check.passed] == []
    with plant():
        named = [check.name for check in examined(scene, hc.Lammps()) if not check.passed]
    assert named == [DAMPING]


def test_energy_shows_damping_that_is_not_the_scene_s() -> None:
    scene = hc.Scene(hc.Chain(5, **STEEL), PULSE, contact=LAWS["restitution"])
    lammps = hc.Lammps(0.005 * scene.contact_time)
    assert all(check.passed for check in balance_checks(lammps.run(scene)))
    with in_set_up(('restitution string 0.8"', 'restitution string 0.6"'))():
        energy = balance_checks(lammps.run(scene))[1]
    assert energy.name == "lammps: energy [J]"
    assert not energy.passed
