"""Damped scenes by LIGGGHTS and Yade."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

import hertzchain as hc
from hertzchain.engines.liggghts import contacts
from hertzchain.engines.liggghts import deck as liggghts_deck
from hertzchain.engines.yade import damping as yade_damping
from hertzchain.engines.yade import deck as yade_deck
from hertzchain.errors import RunFailed
from tests.conftest import STEEL
from tests.engines.native.test_terms import SCENES

RESTITUTION = hc.Contact("restitution", restitution=0.8)
VISCOELASTIC = hc.Contact("viscoelastic", relaxation_time=1e-6)
DASHPOT = hc.Contact("dashpot", coefficient=5.0, attraction=True)

LAWS = {
    "restitution": RESTITUTION,
    "restitution, pulling": replace(RESTITUTION, attraction=True),
    "viscoelastic": VISCOELASTIC,
    "viscoelastic, pulling": replace(VISCOELASTIC, attraction=True),
    "dashpot, pulling": DASHPOT,
}
"""All that LIGGGHTS has; Yade has the first."""


def test_what_liggghts_does_not_have() -> None:
    for law in LAWS.values():
        contacts.refuse_damping(law)
    with pytest.raises(RunFailed, match="dashpots always pull in LIGGGHTS: set attraction = true"):
        contacts.refuse_damping(replace(DASHPOT, attraction=False))
    with pytest.raises(RunFailed, match=r"restitution above 0.05, this one is 0.05: take another"):
        contacts.refuse_damping(hc.Contact("restitution", restitution=0.05))
    contacts.refuse_damping(hc.Contact("restitution", restitution=math.nextafter(0.05, 1)))


def test_what_yade_does_not_have() -> None:
    yade_damping.refuse_damping(RESTITUTION)
    yade_damping.refuse_damping(None)
    for law in (VISCOELASTIC, DASHPOT):
        with pytest.raises(RunFailed, match=f"Yade has no {law.damping} damping with Hertz's law"):
            yade_damping.refuse_damping(law)
    with pytest.raises(RunFailed, match="never pull in Yade: leave out attraction"):
        yade_damping.refuse_damping(LAWS["restitution, pulling"])


@pytest.mark.parametrize("law", LAWS)
def test_decks_have_no_mass_no_contact_stiffness_and_no_damping_computed_here(law: str) -> None:
    scene = replace(SCENES["all at once"], contact=LAWS[law])
    legs = scene.schedule(0.1 * scene.contact_time)
    decks = [liggghts_deck.watched(scene, legs, [1] * len(legs))]
    if law == "restitution":
        decks.append(yade_deck.watched(scene, legs, [1] * len(legs)))
    each = scene.granules
    assert each.damping is not None
    values = {*each.stiffness.tolist(), *each.mass.tolist()}
    if law != "dashpot, pulling":  # whose coefficient is given
        values.update(each.damping.tolist())
    for text in decks:
        assert all(repr(x) in text for x in each.position.tolist())
        for value in values:
            assert f"{value:.6g}"[:6] not in text


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
