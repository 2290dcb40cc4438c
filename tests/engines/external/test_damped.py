"""Damped scenes by LIGGGHTS and Yade: against native velocity Verlet, the truth, and refusals."""

from __future__ import annotations

import itertools
import math
from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

import hertzchain as hc
from hertzchain.engines.external.backend import _Runner
from hertzchain.engines.external.engine import ProgramEngine
from hertzchain.engines.liggghts import contacts, deck
from hertzchain.engines.native.methods import METHODS
from hertzchain.errors import RunFailed
from hertzchain.limits import Deadline
from hertzchain.observables.error_bound import stable_step
from hertzchain.observables.peaks import largest_difference
from hertzchain.verdict.run_checks import balance_checks
from tests.conftest import STEEL
from tests.engines.native.test_terms import SCENES
from tests.oracles.bounds import lasting
from validation.random_scenes import random_damped_scene

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

STEP = 0.03
"""Step of the runs at the same steps [natural time units of the fastest contact]."""

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


def largest(measured: Floats, expected: Floats, least: float = 0.0) -> float:
    """Largest difference as a fraction of the largest value expected, or of the least scale."""
    return float(np.max(np.abs(measured - expected)) / max(np.max(np.abs(expected)), least))


def refuse_other_motion(engine: type[ProgramEngine], scene: hc.Scene, law: hc.Contact) -> None:
    """Only round-off differs from native velocity Verlet, with the law, at the same steps."""
    scene = lasting(scene)
    # Strong dampers want shorter steps.
    dt = min(STEP * scene.contact_time, stable_step(scene, METHODS["velocity-verlet"].interval) / 2)
    legs = scene.schedule(dt)
    own = engine(dt=dt)
    runner = _Runner(scene, own._simulate(scene, Deadline(60.0)), own._steps)
    # One run, without those that tell its error. Native looks at the same steps.
    found = runner.simulate(legs, [runner.stride(leg, recording=False) for leg in legs])
    native = hc.Native("velocity-verlet", dt).run(replace(scene, contact=law))
    unit = scene.units
    # Absolute coordinates: a softer chain is run where they would cost more than 1e-9.
    allowed = 1e-9 + found.round_off(scene)
    assert largest(found.displacement, native.displacement, unit.length) < allowed
    assert largest(found.velocity, native.velocity, unit.velocity) < allowed
    assert largest_difference(found.peaks.force, native.peak_force) < allowed


@pytest.mark.parametrize(("engine", "law", "name"), RUNS)
def test_native_velocity_verlet_at_the_same_steps(
    engine: type[ProgramEngine], law: str, name: str
) -> None:
    """Damping takes velocities of half a step before, in all of them."""
    refuse_other_motion(engine, replace(SCENES[name], contact=LAWS[law]), LAWS[law])


def drawn(engine: type[ProgramEngine], number: int) -> hc.Scene:
    """A random scene that the engine has, of 2 to 40 granules; those of Yade are shorter."""
    most, longest_time = (20, 100.0) if engine is hc.Yade else (40, 200.0)
    rng = np.random.default_rng([19, number])
    while True:
        scene = random_damped_scene(rng, most, longest_time)
        with suppress(RunFailed):
            engine()._refuse(scene)
            return scene


NUMBERS = {hc.Liggghts: range(120), hc.Yade: range(200, 240)}
"""Seeds of random scenes; together they have every term."""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("engine", "number"),
    [
        pytest.param(engine, number, marks=getattr(pytest.mark, engine.__name__.lower()))
        for engine, numbers in NUMBERS.items()
        for number in numbers
    ],
)
def test_random_scenes_at_the_same_steps(engine: type[ProgramEngine], number: int) -> None:
    scene = drawn(engine, number)
    assert scene.contact is not None
    refuse_other_motion(engine, scene, scene.contact)


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
    scene = replace(SCENES["all at once"], contact=LAWS[law])
    assert hc.Liggghts().method_of(scene) == f"velocity-verlet, gran model {models}"


def test_laws_that_an_engine_does_not_have() -> None:
    scene = SCENES["all at once"]
    small = hc.Contact("restitution", restitution=0.05)
    allowed = [None, *LAWS.values(), replace(small, restitution=math.nextafter(0.05, 1))]
    for engine, laws in ((hc.Liggghts, allowed), (hc.Yade, [None, RESTITUTION])):
        for law in laws:
            engine()._refuse(replace(scene, contact=law))
    for engine, law, words in (
        (hc.Liggghts, replace(DASHPOT, attraction=False), "dashpots always pull in LIGGGHTS: set"),
        (hc.Liggghts, small, "restitution above 0.05, this one is 0.05: take another"),
        (hc.Yade, VISCOELASTIC, "Yade has no viscoelastic damping with Hertz's law"),
        (hc.Yade, DASHPOT, "Yade has no dashpot damping with Hertz's law"),
        (hc.Yade, LAWS["restitution, pulling"], "never pull in Yade: leave out attraction"),
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
