"""Mistakes in damping: added, missing, of another law or with another coefficient."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.damping import BEFORE_ROOT_2, WITH_ROOT_2, tsuji
from hertzchain.scene.keys import keys_of
from hertzchain.scene.scene import Scene
from hertzchain.scene.terms import DAMPING, Contact, DampingLaw
from hertzchain.theory.restitution import damping_ratio, of_ratio
from hertzchain.verdict.case import Case, Mistake, fixed
from hertzchain.verdict.slips import near

_TRIALS = np.log(np.geomspace(1e-6, 2.2, 14)).tolist()
"""Logarithms of trial coefficients in natural units; sqrt(5) is a restitution of 0."""

_BETTER = 3.0
"""Factor by which a coefficient must leave less than no damping does to be named (chosen)."""

_NAMES = {
    "restitution": "damping of restitution",
    "viscoelastic": "damping of viscoelastic spheres with the relaxation time",
    "dashpot": "damping by dashpots of",
}


def damping(case: Case) -> Iterator[Mistake]:
    """Yield no damping, contacts that pull or not, and each law with any coefficient."""
    scene, own = case.scene, case.scene.contact
    without, pulls = case.size, own is not None and own.attraction
    if own is not None:
        elastic = case.of(_with(scene, None))
        without = case.residual(elastic)
        yield fixed("no damping", elastic)
        text = "contacts that are kept from pulling" if pulls else "contacts that pull as they open"
        other = replace(own, attraction=not pulls)
        yield fixed(text, case.of(_with(scene, other)))
    for law in DAMPING:
        contact = partial(contact_of, scene, law, attraction=pulls)
        words, peaks = partial(in_words, scene, contact), partial(_peaks, case, contact)
        yield Mistake(words, peaks, _TRIALS, without / _BETTER)


def _peaks(case: Case, contact: partial[Contact], log: float) -> FloatArray:
    """Return peaks with a law of damping in place of the scene's [N], (N - 1,)."""
    return case.of(_with(case.scene, contact(log)))


def _with(scene: Scene, contact: Contact | None) -> Scene:
    """Return the scene with another damping of all contacts, also the walls'."""
    walls: Any = {
        name: wall.damped(None)
        for name in ("wall", "near_wall")
        if (wall := getattr(scene, name)) is not None
    }
    return replace(scene, contact=contact, **walls)


def contact_of(scene: Scene, law: DampingLaw, log: float, attraction: bool) -> Contact:
    """Return a law of damping by the logarithm of its coefficient in natural units.

    The coefficient is c in F = d^(3/2) + c d^q d', and alpha in the law of restitution.
    """
    units, strength = scene.units, math.exp(log)
    if law == "restitution":
        parameter = of_ratio(strength / math.sqrt(5), pulls=True)
    elif law == "viscoelastic":
        parameter = strength / 1.5 * units.time
    else:
        parameter = strength * units.force * units.time / units.length
    return Contact(law, attraction=attraction, **{DAMPING[law]: parameter})


def in_words(scene: Scene, contact: partial[Contact], log: float) -> str:
    """Return words for a law of damping with a fitted coefficient, in place of the scene's."""
    found, own = contact(log), scene.contact
    if own is None:
        return _described(found)
    if own.damping != found.damping:
        return f"{_described(found)} in place of {_described(own)}"
    if own.restitution is None:
        factor = found.parameter / own.parameter
    else:
        factor = math.exp(log) / math.sqrt(5) / damping_ratio(own.restitution)
    text = f"{_described(found)} in place of {_value(own)}"
    text += f" (coefficient {factor:.4g} times the scene's)"
    names = near(_known_factors(scene), factor)
    return f"{text}: {' or '.join(names)}" if names else text


def _described(contact: Contact) -> str:
    return f"{_NAMES[contact.damping]} {_value(contact)}"


def _value(contact: Contact) -> str:
    """Return the coefficient of a law with three digits, as many as noisy peaks determine."""
    if contact.restitution is not None:
        return f"{contact.restitution:.3g}"
    return f"{contact.parameter:.3g} {keys_of(Contact)[DAMPING[contact.damping]].unit}"


def _known_factors(scene: Scene) -> dict[str, float]:
    """Return factors of the coefficient of a law by known mistakes, by name."""
    contact = scene.contact
    assert contact is not None
    if contact.damping == "viscoelastic":
        return {"the factor 3/2 is missing": 2 / 3, "the factor 3/2 is there twice": 3 / 2}
    if contact.restitution is None:
        return {"half of the coefficient": 0.5, "twice the coefficient": 2.0}
    e = contact.restitution
    known = {
        f"damping tsuji of LAMMPS {version} for {e:g}": tsuji(e, root_2)
        / (math.sqrt(5) * damping_ratio(e))
        for version, root_2 in ((BEFORE_ROOT_2, False), (WITH_ROOT_2, True))
    }
    if not {"unlike granules", "wall", "near wall"} & set(scene.terms):
        known |= {"m in place of m*": math.sqrt(2), "m*/2 in place of m*": math.sqrt(0.5)}
    return known
