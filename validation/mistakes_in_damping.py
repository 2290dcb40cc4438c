"""Deliberate mistakes in damped contacts, found by closed forms of collisions."""

from __future__ import annotations

import math
from contextlib import AbstractContextManager
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any
from unittest.mock import patch

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.dialect import tsuji
from hertzchain.engines.native import damped_runs
from hertzchain.engines.native.equations import Chain
from hertzchain.scene import granules
from hertzchain.theory.restitution import (
    collision_of,
    damping_ratio,
    dashpot,
    of_ratio,
    viscoelastic,
)
from validation.physics.chains import steel
from validation.planting import Plant
from validation.rows import Row

RESTITUTION_LAW = hc.Contact("restitution", restitution=0.8)
VISCOELASTIC_LAW = hc.Contact("viscoelastic", relaxation_time=1e-6)
DASHPOT_LAW = hc.Contact("dashpot", coefficient=20.0)

TOLERANCE = 1e-8
PARTS = "right ones are off by 5e-12; has to be exceeded"


@dataclass(frozen=True)
class DampingMistake:
    """A mistake in the damping of contacts."""

    what: str
    plant: Plant
    law: hc.Contact  # damping of the scene
    at_wall: bool = False  # whether a granule meets a wall, else two granules meet
    cause: str | None = None  # words of a judgement; None where it does not detect the mistake


def coefficients_times(factor: float) -> Plant:
    """All coefficients of damping off by a factor."""
    original = hc.Contact.coefficients

    def changed(contact: hc.Contact, stiffness: FloatArray, mass: FloatArray) -> FloatArray:
        return factor * original(contact, stiffness, mass)

    return lambda: patch.object(hc.Contact, "coefficients", changed)


def contact_mass_times(factor: float) -> Plant:
    """Another m* in the coefficients, not in the motion."""
    original = hc.Contact.coefficients

    def changed(contact: hc.Contact, stiffness: FloatArray, mass: FloatArray) -> FloatArray:
        return original(contact, stiffness, factor * mass)

    return lambda: patch.object(hc.Contact, "coefficients", changed)


def half_the_mass_at_walls() -> AbstractContextManager[Any]:
    """A wall's m* is that of two granules."""
    original = granules._contact_mass

    def changed(mass: FloatArray, contacts: int) -> FloatArray:
        masses = original(mass, contacts).copy()
        if contacts == mass.size:
            masses[-1] /= 2
        return masses

    return patch.object(granules, "_contact_mass", changed)


def another(**other: Any) -> Plant:
    """The integrator gets another chain: its fields by their names."""

    def changed(scene: hc.Scene) -> Chain:
        chain = Chain.of(scene)
        return chain._replace(**{key: change(chain) for key, change in other.items()})

    return lambda: patch.object(damped_runs, "Chain", SimpleNamespace(of=changed))


def without_the_last(chain: Chain) -> FloatArray:
    """No damping in the last contact, which is a wall's where there is one."""
    damping = chain.damping.copy()
    if chain.has_wall:
        damping[-1] = 0.0
    return damping


def _of_tsuji() -> float:
    return tsuji(0.8, root_2=False) / (math.sqrt(5) * damping_ratio(0.8))


MISTAKES_IN_DAMPING = (
    DampingMistake("overlap^(1/2) in place of overlap^(1/4)",
        another(exponent=lambda _: 0.5), RESTITUTION_LAW, cause="of viscoelastic spheres"),
    DampingMistake("overlap^0 in place of overlap^(1/2)",
        another(exponent=lambda _: 0.0), VISCOELASTIC_LAW, cause="by dashpots of"),
    DampingMistake("contacts that pull, restitution",
        another(attraction=lambda _: True), RESTITUTION_LAW, cause="contacts that pull"),
    DampingMistake("contacts that pull, dashpots",
        another(attraction=lambda _: True), DASHPOT_LAW, cause="contacts that pull"),
    DampingMistake("m in place of m*",
        contact_mass_times(2.0), RESTITUTION_LAW, cause="m in place of m*"),
    DampingMistake("m* of a wall as if it were a granule",
        half_the_mass_at_walls, RESTITUTION_LAW, at_wall=True),
    DampingMistake("3/2 missing, viscoelastic",
        coefficients_times(2 / 3), VISCOELASTIC_LAW, cause="the factor 3/2 is missing"),
    DampingMistake("alpha of LAMMPS's tsuji",
        coefficients_times(_of_tsuji()), RESTITUTION_LAW, cause="damping tsuji of LAMMPS before"),
    DampingMistake("coefficient times 1.001",
        coefficients_times(1.001), DASHPOT_LAW, cause="(coefficient 1.001 times"),
    DampingMistake("no damping at the wall",
        another(damping=without_the_last), RESTITUTION_LAW, at_wall=True),
    DampingMistake("no damping", coefficients_times(1e-12), RESTITUTION_LAW, cause="no damping"),
)  # fmt: skip
"""The mistakes: place of each, and the words with which ``hc.judge`` names it."""


def by_collision(mistake: DampingMistake) -> Row:
    """The known restitution of a collision; passes where the mistake is detected."""
    expected = restitution_of(mistake.law)
    with mistake.plant():
        measured = at_wall(mistake.law) if mistake.at_wall else of_two(mistake.law)
    caught = not abs(measured - expected) <= TOLERANCE
    who = "a granule and a wall" if mistake.at_wall else "two spheres"
    return Row(mistake.what, f"{who}: restitution", measured, expected, TOLERANCE, caught, PARTS)


def of_two(law: hc.Contact) -> float:
    """Restitution of a striker of 1 m/s and the granule that it meets."""
    velocity = hc.Native(rtol=1e-10).run(hc.Scene(steel(2), hc.Striker(1.0), contact=law)).velocity
    return float(velocity[1] - velocity[0])


def at_wall(law: hc.Contact) -> float:
    """Restitution of a granule and a wall, under a law whose restitution is independent of speed.

    A striker of 1 m/s throws granule 2 at a wall 0.1 mm away; it comes back from 0.15 to 0.23 ms.
    """
    wall, end = hc.Wall("rigid", gap=1e-4), hc.Run(1.9e-4)
    scene = hc.Scene(steel(2), hc.Striker(1.0), end, wall=wall, contact=law)
    thrown = (1 + restitution_of(law)) / 2
    return -float(hc.Native(rtol=1e-10).run(scene).velocity[1]) / thrown


def restitution_of(law: hc.Contact) -> float:
    """Return the restitution of a striker of 1 m/s and a granule, if contacts cannot pull."""
    if law.restitution is not None:
        return of_ratio(damping_ratio(law.restitution), pulls=False)
    collision = collision_of(hc.Scene(steel(2), hc.Striker(1.0)))
    if law.relaxation_time is not None:
        return viscoelastic(law.relaxation_time, collision, pulls=False)
    assert law.coefficient is not None
    return dashpot(law.coefficient, collision, pulls=False)
