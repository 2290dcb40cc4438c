"""Each number of a deck of our own: a third of what is allowed passes, three times it fails."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.reading.deck import FoundDeck
from hertzchain.engines.lammps.reading.reading import DEPTH
from hertzchain.examiner.examined import EXAMINED
from hertzchain.examiner.measured import applied_force
from hertzchain.verdict.comparison import number_checks
from tests.conftest import STEEL

pytestmark = pytest.mark.lammps

PULSE = hc.Pulse("cosine", 50.0, 2.0, rise_time=3e-5)
SCENE = hc.Scene(hc.Chain(6, **STEEL), PULSE)
LENGTH = 12 * STEEL["radius"]


@cache
def right(driven: bool = False) -> FoundDeck:
    """What LAMMPS makes of the deck of a scene, with a pulse or a piston."""
    return hc.Lammps().examine(PISTON if driven else SCENE)


PISTON = replace(SCENE, shock=hc.Piston(0.2))


def set_to(name: str, index: object, value: float | FloatArray) -> Callable[[FoundDeck], FoundDeck]:
    """Replace one element of an array."""

    def change(deck: FoundDeck) -> FoundDeck:
        array: FloatArray = np.array(getattr(deck, name))
        array[index] = value  # type: ignore[call-overload]
        changes: dict[str, Any] = {name: array}
        return replace(deck, **changes)

    return change


def by(name: str, index: object, factor: float) -> Callable[[FoundDeck], FoundDeck]:
    """Multiply one element of an array."""
    return lambda deck: set_to(name, index, getattr(deck, name)[index] * factor)(deck)


MASS = SCENE.chain.granule_mass
ROUNDED = 6 * np.finfo(np.float64).eps * 2 / DEPTH  # of 2R in an overlap of R / 100
FORCE = SCENE.units.force

ALLOWED: dict[str, Callable[[float], Callable[[FoundDeck], FoundDeck]]] = {
    "place of granules": lambda k: set_to("position", 2, 2 * 2 * STEEL["radius"]
                                         + k * EXAMINED * LENGTH),
    "distance from the axis": lambda k: set_to("sideways", (2, 1), k * EXAMINED * STEEL["radius"]),
    "radius": lambda k: by("radius", 2, 1 + k * EXAMINED),
    "mass": lambda k: set_to("mass", 2, MASS * (1 + k * EXAMINED)),
    "stiffness of the contacts": lambda k: by("contact_force", (4, 2), 1 + k * EXAMINED),
    "exponent of the contact law": lambda k: by("contact_force", (5, 2),
                                     1 + 3 * k * EXAMINED * np.log(3)),
    "damping": lambda k: by("damped_force", (0, 2), 1 + 2 * k * EXAMINED),
    "friction": lambda k: set_to("tangential_force", 2, k * EXAMINED
                                         * SCENE.chain.contact_stiffness
                                         * (1.01 * DEPTH * STEEL["radius"]) ** 1.5),
    "constant force": lambda k: set_to("constant_force", (2, 0), k * EXAMINED * FORCE),
    "constant force across the chain": lambda k: set_to("constant_force", (2, 1),
                                                        k * EXAMINED * FORCE),
    "drag": lambda k: set_to("drag", 2, k * EXAMINED * FORCE / SCENE.units.velocity),
    "granules that are pushed": lambda k: set_to("applied_force", (0, 3), k * EXAMINED * FORCE),
    "applied force": lambda k: set_to("applied_force", (9, 0), float(right().applied_force[9, 0])
                                      + k * EXAMINED * FORCE),
    "applied force across the chain": lambda k: lambda deck: replace(
        deck, applied_sideways=k * EXAMINED * FORCE),
    "force at other overlaps": lambda k: by("contact_force", (2, 2), 1 + k * 10 * ROUNDED),
}  # fmt: skip
"""By the name of a number: the deck that is off by so many times what is allowed."""


@pytest.mark.parametrize("name", ALLOWED)
def test_both_sides_of_what_is_allowed(name: str) -> None:
    named = [
        {check.name.removeprefix("lammps: ").split(" [")[0]
         for check in number_checks(SCENE, ALLOWED[name](share)(right())) if not check.passed}
        for share in (1 / 3, 3.0)
    ]  # fmt: skip
    assert name not in named[0]
    assert name in named[1]


def test_counts_and_velocities_are_exact() -> None:
    exact = {check.kind.name for check in number_checks(SCENE, right()) if check.tolerance == 0}
    assert exact == EXACT


EXACT = {
    "number of granules", "velocity at the start [m/s]", "velocity across the chain [m/s]",
    "spin at the start [1/s]", "driven granules",
}  # fmt: skip
"""Numbers of a scene that starts at rest of which no difference is allowed."""


def test_a_chain_that_begins_elsewhere() -> None:
    moved = replace(right(), origin=np.array([3 * EXAMINED * LENGTH, 0.0, 0.0]))
    assert failed(moved) == ["lammps: place of granules [m]"]


def failed(deck: FoundDeck, scene: hc.Scene = SCENE) -> list[str]:
    """The names of the checks that fail."""
    return [check.name for check in number_checks(scene, deck) if not check.passed]


def test_the_rounding_of_a_long_run_excuses_no_force_between_corners() -> None:
    """The time at a corner may be off by as much, which on a ramp would be a larger force."""
    scene = replace(SCENE, run=hc.Run(0.1))
    deck = hc.Lammps().examine(scene)
    late = deck.applied_time[2:3] + 4 * len(deck.runs) * np.spacing(0.1)
    force = float(applied_force(scene, late)[0])
    assert failed(deck, scene) == []
    wrong = failed(set_to("applied_force", (2, 0), force)(deck), scene)
    assert wrong == ["lammps: applied force [N]"]


UNLIKE = hc.Scene(hc.Chain(4, **STEEL | {"radius": [4e-3, 5e-3, 6e-3, 5e-3]}), PULSE,
                  wall=hc.Wall("rigid"))  # fmt: skip


def test_numbers_behind_a_near_wall_are_those_of_tables() -> None:
    """The wall is a granule of the deck, its first."""
    scene = replace(SCENE, near_wall=hc.Wall("rigid"))
    deck = hc.Lammps().examine(scene)
    for change, words in (
        (by("mass", 2, 1.1), "mass of granule 2"),
        (by("damped_force", (0, 0), 1.1), "damping of the near wall"),
        (by("damped_force", (0, 2), 1.1), "damping of contact 3"),
        (set_to("applied_force", (9, 3), 1.0), "acts on granule 1 and on granule 3, too"),
        (set_to("integrated", 0, 1), "the near wall is moved by a fix"),
        (by("radius", slice(3), 1.1), "radius of the near wall and granules 1 to 2"),
    ):
        reasons = [check.reason for check in number_checks(scene, change(deck)) if not check.passed]
        assert words in " ".join(reasons)


@pytest.mark.parametrize(("share", "passed"), [(0.8, True), (1.2, False)])
def test_both_sides_of_the_wall_and_of_friction_by_the_softest_contact(
    share: float, passed: bool
) -> None:
    deck, near = hc.Lammps().examine(UNLIKE), 1.01 * DEPTH * 4e-3
    room = EXAMINED * near + ROUNDED / 2 * DEPTH * 2 * (4e-3 + 5e-3 + 6e-3 + 5e-3)
    (wall,) = deck.walls
    walls = (replace(wall, position=wall.position + share * room),)
    wrong = failed(replace(deck, walls=walls), UNLIKE)
    assert ("lammps: place of the wall [m]" not in wrong) == passed
    least = share * EXAMINED * float(np.min(UNLIKE.granules.stiffness)) * near**1.5
    wrong = failed(set_to("tangential_force", 2, least)(deck), UNLIKE)
    assert wrong == ([] if passed else ["lammps: friction [N]"])


def test_both_sides_of_the_displacement_of_a_piston() -> None:
    deck = right(driven=True)
    way = 0.2 * PISTON.end_time + 1.01 * DEPTH * STEEL["radius"]
    room = EXAMINED * way + ROUNDED / 2 * DEPTH * LENGTH
    for share, passed in ((1 / 3, True), (3.0, False)):
        moved = set_to("driven_displacement", -1, 0.2 * float(deck.driven_time[-1])
                       + share * room)(deck)  # fmt: skip
        checks = {check.name: check.passed for check in number_checks(PISTON, moved)}
        assert checks["lammps: displacement of the piston [m]"] == passed


def test_a_fixed_granule_that_moves_is_named() -> None:
    chain = replace(SCENE.chain, fixed=[False, False, False, True, False, False])
    load = hc.Precompression(20.0)
    scene = replace(SCENE, chain=chain, precompression=load)
    deck = hc.Lammps().examine(scene)
    assert failed(deck, scene) == []
    (moved,) = (check for check in number_checks(scene, deck) if check.kind.name == "integrators")
    assert moved.tolerance == 0
    assert failed(set_to("integrated", 3, 1)(deck), scene) == ["lammps: integrators"]
    free = hc.Lammps().examine(replace(SCENE, precompression=load))
    assert {*failed(free, scene)} >= {"lammps: integrators", "lammps: place of granules [m]"}
