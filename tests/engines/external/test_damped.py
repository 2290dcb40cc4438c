"""Damped scenes by LIGGGHTS and Yade: against native velocity Verlet, the truth, and refusals."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

import hertzchain as hc
from hertzchain.engines.external.engine import ProgramEngine
from hertzchain.engines.liggghts import contacts
from hertzchain.engines.liggghts import deck as liggghts_deck
from hertzchain.engines.yade import damping as yade_damping
from hertzchain.engines.yade import deck as yade_deck
from hertzchain.errors import RunFailed
from hertzchain.limits import Deadline
from hertzchain.observables.peaks import largest_difference
from tests.conftest import STEEL
from tests.engines.native.test_terms import SCENES

Floats = NDArray[np.float64]

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

STEP = 0.02
"""Of the runs at the same steps [natural time units of the fastest contact]."""

QUICK = {
    hc.Liggghts: {
        "restitution": "all at once",
        "restitution, pulling": "gaps",
        "viscoelastic": "dimer, elastic wall",
        "viscoelastic, pulling": "precompression",
        "dashpot, pulling": "column",
    },
    hc.Yade: {"restitution": "all at once"},
}
"""Every law and every term is in one of them; a run of Yade takes two seconds."""


RUNS = [
    pytest.param(
        engine,
        law,
        name,
        marks=[getattr(pytest.mark, engine.__name__.lower())]
        + [pytest.mark.slow] * (quick[law] != name),
    )
    for engine, quick in QUICK.items()
    for law, name in itertools.product(quick, SCENES)
]


def largest(measured: Floats, expected: Floats) -> float:
    """Largest difference as a fraction of the largest value expected."""
    return float(np.max(np.abs(measured - expected)) / np.max(np.abs(expected)))


def at_the_same_steps(engine: type[ProgramEngine], scene: hc.Scene) -> tuple[float, float, float]:
    """Largest differences of displacements, velocities and peaks from native velocity Verlet."""
    dt = STEP * scene.contact_time
    legs = scene.schedule(dt)
    # One run, without those that tell its error.
    simulate = engine()._simulate(scene, Deadline(60.0))
    found = simulate(legs, [2] * len(legs), None)
    native = hc.Native("velocity-verlet", dt).run(scene)
    return (
        largest(found.displacement, native.displacement),
        largest(found.velocity, native.velocity),
        largest_difference(found.peaks.force, native.all_peaks),
    )


@pytest.mark.parametrize(("engine", "law", "name"), RUNS)
def test_native_velocity_verlet_at_the_same_steps(
    engine: type[ProgramEngine], law: str, name: str
) -> None:
    """Damping takes velocities of half a step before, in all of them."""
    displacement, velocity, peaks = at_the_same_steps(
        engine, replace(SCENES[name], contact=LAWS[law])
    )
    # Round-off of absolute coordinates: a softer chain is run where it would cost more than 1e-9.
    assert displacement < 1e-9
    assert velocity < 1e-9
    assert peaks < 2e-8


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


@pytest.mark.parametrize(
    ("engine", "said"),
    [
        pytest.param(hc.Liggghts, "always pull in LIGGGHTS", marks=pytest.mark.liggghts),
        pytest.param(hc.Yade, "no dashpot damping", marks=pytest.mark.yade),
    ],
)
def test_a_run_is_refused(engine: type[ProgramEngine], said: str) -> None:
    law = replace(DASHPOT, attraction=False)
    with pytest.raises(RunFailed, match=said):
        engine().run(replace(SCENES["gaps"], contact=law))


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
