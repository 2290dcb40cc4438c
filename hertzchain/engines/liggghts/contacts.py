"""Contact models of LIGGGHTS: Hertz's law with each of LIGGGHTS's laws of damping.

``model hertz`` takes E and nu of each type and the restitution of each pair of types. The two
others take numbers for each pair of types, and use masses and radii of their own:

=================== ==========================================================
model               normal force at an overlap d
=================== ==========================================================
``hertz/stiffness`` sqrt(R* d) (k_n d + gamma_n m* d')
``hooke/stiffness`` k_n d + gamma_n d' with ``absolute_damping on``
=================== ==========================================================

The first is viscoelastic with k_n = 4/3 E* and gamma_n = 2 tau E*/m*, for a relaxation time tau; a
type is then a material and a mass. The second with k_n = 0, laid over ``hertz``, is a dashpot.
``limitForce on`` forbids one model to pull, but not the sum of two.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from hertzchain.engines.external.terms import (
    MOST_MATERIALS,
    Material,
    materials_of,
    numbered,
    wall_material,
)
from hertzchain.errors import RunFailed
from hertzchain.scene.scene import Scene
from hertzchain.scene.terms import Contact

_LEAST_RESTITUTION = 0.05
"""Restitution above which LIGGGHTS accepts values."""

Type = tuple[Material, float]
"""A material and the mass of its granules [kg]: infinite for a wall, NaN if not needed."""


def refuse_damping(contact: Contact | None) -> None:
    """Raise RunFailed for damping that LIGGGHTS does not have."""
    if contact is None:
        return
    if contact.restitution is not None and contact.restitution <= _LEAST_RESTITUTION:
        raise RunFailed(
            f"LIGGGHTS takes a restitution above {_LEAST_RESTITUTION:g}, this one is"
            f" {contact.restitution:g}: take another backend"
        )
    if contact.coefficient is not None and not contact.attraction:
        raise RunFailed(
            "contacts with dashpots always pull in LIGGGHTS: set attraction = true, or take another"
            " backend"
        )


def types_of(scene: Scene) -> tuple[list[Type], list[int]]:
    """Return the types, the wall's last, and for each granule the number of its type, from 1.

    RunFailed for more of them than a deck can have.
    """
    each = scene.granules
    materials, kinds = materials_of("LIGGGHTS", each)
    types = [(material, math.nan) for material in materials]
    if scene.contact is not None and scene.contact.damping == "viscoelastic":
        masses = zip(kinds, each.mass.tolist(), strict=True)
        pairs = [(materials[kind - 1], mass) for kind, mass in masses]
        types, kinds = numbered(pairs)
        if len(types) > MOST_MATERIALS:
            raise RunFailed(
                f"{len(types)} pairs of material and mass are too many for viscoelastic contacts in"
                f" a LIGGGHTS deck: at most {MOST_MATERIALS}"
            )
    if scene.wall is not None:
        types.append((wall_material(scene), math.inf))  # the wall's own type
    return types, kinds


def models(contact: Contact | None) -> list[tuple[str, str]]:
    """Return the models whose forces add up in a contact, with their options."""
    if contact is None:
        return [("hertz", "")]
    if contact.coefficient is not None:
        return [("hertz", ""), ("hooke/stiffness", " absolute_damping on")]
    limit = "" if contact.attraction else " limitForce on"
    return [("hertz/stiffness" if contact.damping == "viscoelastic" else "hertz", limit)]


def pair_commands(types: list[Type], contact: Contact | None) -> list[str]:
    """Yield the commands for Hertz's law between all types, and damping."""
    damping = (
        "without damping (coefficient of restitution 1)" if contact is None else "with damping"
    )
    styles = [f"gran model {model} tangential off{options}" for model, options in models(contact)]
    if len(styles) == 1:
        style = [f"pair_style {styles[0]}", "pair_coeff * *"]
    else:
        coefficients = (f"pair_coeff * * gran {k}" for k in range(1, len(styles) + 1))
        style = [f"pair_style hybrid/overlay {' '.join(styles)}", *coefficients]
    return [f"# Hertz's law {damping} and tangential force.", *_numbers(types, contact), *style]


def _numbers(types: list[Type], contact: Contact | None) -> list[str]:
    """Yield the numbers of the models."""
    if contact is not None and contact.damping == "viscoelastic":
        return _viscoelastic(types, contact.parameter)
    modulus, poisson = zip(*(material for material, _ in types), strict=True)
    restitution = None if contact is None else contact.restitution
    lines = [
        _each("youngsModulus", modulus),
        _each("poissonsRatio", poisson),
        *_all_pairs("coefficientRestitution", types, restitution or 1.0),
    ]
    if contact is None or contact.coefficient is None:
        return lines
    return [
        *lines,
        *_all_pairs("kn", types, 0.0),
        *_all_pairs("kt", types, 0.0),
        *_all_pairs("gamman_abs", types, contact.coefficient),
        *_all_pairs("gammat_abs", types, 0.0),
    ]


def _viscoelastic(types: list[Type], tau: float) -> list[str]:
    """Yield the numbers of Hertz's law with the damping of Kuwabara and Kono."""

    def reduced(first: Type, other: Type) -> float:
        """Return E* of two materials [Pa]."""
        return 1 / sum((1 - poisson**2) / modulus for (modulus, poisson), _ in (first, other))

    def stiffness(first: Type, other: Type) -> float:
        return 4 / 3 * reduced(first, other)

    def damping(first: Type, other: Type) -> float:
        return 2 * tau * reduced(first, other) * (1 / first[1] + 1 / other[1])

    return [
        *_pairs("kn", types, stiffness),
        *_pairs("gamman", types, damping),
        *_all_pairs("kt", types, 0.0),
        *_all_pairs("gammat", types, 0.0),
    ]


def _each(what: str, values: Sequence[float]) -> str:
    """Return the command for a property of each type."""
    return f"fix {what} all property/global {what} peratomtype {' '.join(map(repr, values))}"


def _all_pairs(what: str, types: list[Type], value: float) -> list[str]:
    """Return the command for a property with the same value for all pairs of types."""
    return _pairs(what, types, lambda *_: value)


def _pairs(what: str, types: list[Type], value: Callable[[Type, Type], float]) -> list[str]:
    """Return the command for a property of each pair of types, a line for each first type."""
    rows = [f"    {' '.join(repr(value(first, other)) for other in types)}" for first in types]
    return [
        f"fix {what} all property/global {what} peratomtypepair {len(types)} &",
        *(f"{row} &" for row in rows[:-1]),
        rows[-1],
    ]
