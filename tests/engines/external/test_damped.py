"""Damped scenes by LIGGGHTS and Yade: their accuracy, their decks, and refusals."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

import hertzchain as hc
from hertzchain.engines.external.engine import ProgramEngine
from hertzchain.engines.liggghts import contacts, deck
from hertzchain.errors import RunFailed
from hertzchain.observables.peaks import largest_difference
from hertzchain.verdict.run_checks import balance_checks
from tests.conftest import STEEL
from tests.engines.external.test_same_steps import DAMPED, DASHPOT, RESTITUTION, VISCOELASTIC
from tests.engines.native.test_terms import SCENES

EACH = [
    pytest.param(hc.Liggghts, marks=[pytest.mark.liggghts, pytest.mark.slow]),
    pytest.param(hc.Yade, marks=[pytest.mark.yade, pytest.mark.slow]),
]


@pytest.mark.parametrize("engine", EACH)
@pytest.mark.parametrize(("rtol", "extrapolated"), [(1e-2, False), (1e-5, True)])
def test_the_wanted_error(engine: type[ProgramEngine], rtol: float, extrapolated: bool) -> None:
    scene = replace(SCENES["all at once"], contact=RESTITUTION)
    result = engine(rtol=rtol, extrapolated=extrapolated).run(scene)
    truth = hc.Native(rtol=1e-9).run(scene)
    error = largest_difference(result.peak_force, truth.peak_force)
    assert error <= result.error_estimate <= rtol
    assert [check for check in balance_checks(result) if not check.passed] == []
    if not extrapolated:  # balances are of one run
        lost = truth.balance.dissipated
        assert result.balance.dissipated == pytest.approx(lost, rel=rtol, abs=0)


@pytest.mark.parametrize(
    ("law", "models"),
    [
        ("restitution", "hertz"),
        ("viscoelastic", "hertz/stiffness"),
        ("dashpot, pulling", "hertz + hooke/stiffness"),
    ],
)
def test_the_method_of_liggghts_names_the_models_that_run(law: str, models: str) -> None:
    assert hc.Liggghts().method_of(DAMPED[law]) == f"velocity-verlet, gran model {models}"


def test_laws_that_an_engine_does_not_have() -> None:
    scene = SCENES["all at once"]
    small = hc.Contact("restitution", restitution=0.05)
    laws = {law: one.contact for law, one in DAMPED.items()}
    allowed = [None, *laws.values(), replace(small, restitution=math.nextafter(0.05, 1))]
    for engine, some in ((hc.Liggghts, allowed), (hc.Yade, [None, RESTITUTION])):
        for law in some:
            engine()._refuse(replace(scene, contact=law))
    for engine, law, words in (
        (hc.Liggghts, replace(DASHPOT, attraction=False), "dashpots always pull in LIGGGHTS: set"),
        (hc.Liggghts, small, "restitution above 0.05, this one is 0.05: take another"),
        (hc.Yade, VISCOELASTIC, "Yade has no viscoelastic damping with Hertz's law"),
        (hc.Yade, DASHPOT, "Yade has no dashpot damping with Hertz's law"),
        (hc.Yade, laws["restitution, pulling"], "never pull in Yade: leave out attraction"),
    ):
        with pytest.raises(RunFailed, match=words):
            engine()._refuse(replace(scene, contact=law))


def test_the_damping_of_a_viscoelastic_deck() -> None:
    """3/2 A k over the contact mass, from the material; k = 4/3 E* without the radius."""
    scene = hc.Scene(hc.Chain(3, **STEEL), hc.Striker(1.0), contact=VISCOELASTIC)
    text = deck.set_up(scene).replace("&\n", "")
    modulus = STEEL["young_modulus"] / (2 * (1 - STEEL["poisson_ratio"] ** 2))
    mass = STEEL["density"] * 4 / 3 * math.pi * STEEL["radius"] ** 3 / 2
    expected = 1.5e-6 * 4 / 3 * modulus / mass
    found = float(text.partition("gamman peratomtypepair 1 ")[2].split()[0])
    assert found == pytest.approx(expected, rel=1e-12)  # rounding


def taper(granules: int) -> hc.Scene:
    """Granules of one material, each lighter than the one before."""
    chain = hc.Chain(granules, **{**STEEL, "radius": [4e-3 * 0.999**k for k in range(granules)]})
    return hc.Scene(chain, hc.Striker(1.0), contact=VISCOELASTIC)


def test_types_of_viscoelastic_contacts() -> None:
    """A number for each pair of materials and masses, of which a deck can have so many."""
    types, kinds = contacts.types_of(replace(taper(100), wall=hc.Wall("same")))
    assert kinds == list(range(1, 101))
    assert len(types) == 101
    with pytest.raises(RunFailed, match="101 pairs of material and mass are too many"):
        contacts.types_of(taper(101))
    alike, kinds = contacts.types_of(replace(taper(101), contact=RESTITUTION))
    assert len(alike) == 1
    assert set(kinds) == {1}


@pytest.mark.parametrize("engine", [hc.Liggghts, hc.Yade])
def test_damping_of_the_walls_own_is_refused_before_a_run(engine: type[ProgramEngine]) -> None:
    wall = hc.Wall("rigid", restitution=0.5)
    scene = hc.Scene(hc.Chain(3, **STEEL), hc.Striker(1.0), wall=wall, contact=RESTITUTION)
    with pytest.raises(RunFailed, match="gets one damping for all contacts: take a wall without"):
        engine()._refuse(scene)
