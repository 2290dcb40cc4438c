"""Contacts of a deck's granules, with one another and with a wall, in the deck's units."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from itertools import pairwise

from hertzchain.engines.lammps.damping import tsuji
from hertzchain.engines.lammps.dialect import NUMBERS_OF
from hertzchain.verdict.lint.arithmetic import number
from hertzchain.verdict.lint.deck import Deck
from hertzchain.verdict.lint.granules import Row
from hertzchain.verdict.lint.script import Command

NO_DAMPING = 1e-100
"""Numbers for damping up to this are 0, in all units (chosen)."""

_HERTZ = ("hertz", "hertz/material", "dmt", "jkr")


@dataclass(frozen=True)
class Contact:
    """F = A d^p + c d^q d' of one contact, in the deck's units; None: not known.

    Parameters
    ----------
    command
        The command that gives it.
    stiffness, exponent
        A and p: 1.5, or 1 for a linear spring.
    damping, power
        c and q; 0 for an elastic contact.
    """

    command: Command
    stiffness: float | None
    exponent: float
    damping: float | None
    power: float


@dataclass(frozen=True)
class Wall:
    """A plane wall across the chain: its contact, and where it stands (None: not known)."""

    contact: Contact
    place: float | None


@dataclass(frozen=True)
class _Pair:
    """R* and m* of a contact."""

    radius: float
    mass: float | None


def contacts_of(deck: Deck, row: Row) -> list[Contact] | None:
    """The contact of each granule with the next; None where the law is none of those known."""
    found: list[Contact] = []
    laws = _laws_by_types(deck)
    for k, (one, other) in enumerate(pairwise(row.diameter)):
        if one is None or other is None or one <= 0 or other <= 0:
            return None
        mass, next_mass = row.mass[k], row.mass[k + 1]
        both = None
        if mass is not None and next_mass is not None and mass + next_mass > 0:
            both = mass * next_mass / (mass + next_mass)
        pair = _Pair(one * other / (one + other) / 2, both)
        contact = None
        if deck.pair_style is not None and deck.pair_style.words[1] == "granular":
            kinds = sorted(kind for kind in row.kind[k : k + 2] if kind is not None)
            law = laws.get((kinds[0], kinds[1])) if len(kinds) == 2 else None
            contact = None if law is None else _granular(law, law.words[3:], pair)
        elif deck.pair_style is not None:
            contact = _classic(deck.pair_style, deck.pair_style.words[1:], pair)
        if contact is None:
            return None
        found.append(contact)
    return found


def walls_of(deck: Deck, row: Row) -> list[Wall] | None:
    """The walls across the chain; None where it is not known which there are."""
    found: list[Wall] = []
    if any(fix.words[3] == "wall/gran/region" for fix in deck.fixes()):
        return None
    for fix in deck.fixes("wall/gran"):
        plane = f"{'xyz'[row.axis]}plane"
        if plane not in fix.words or fix.never:
            continue
        at = fix.words.index(plane)
        last = row.members(fix.words[2])
        for end, word in ((0, fix.words[at + 1 : at + 2]), (-1, fix.words[at + 2 : at + 3])):
            if word == ("NULL",) or (last is not None and row.ids[end] not in last):
                continue
            diameter = row.diameter[end]
            if diameter is None or fix.conditional:
                return None
            pair = _Pair(diameter / 2, row.mass[end])
            words = fix.words[4:at]
            contact = (
                _granular(fix, words[1:], pair)
                if words[:1] == ("granular",)
                else _classic(fix, (f"gran/{' '.join(words[:1])}", *words[1:]), pair)
            )
            if contact is None:
                return None
            found.append(Wall(contact, number(" ".join(word))))
    return found


def _laws_by_types(deck: Deck) -> dict[tuple[int, int], Command]:
    """The ``pair_coeff`` of each pair of types, the last that was given."""
    boxes = [number(" ".join(box.words[1:2])) for box in deck.named("create_box")]
    count = int(boxes[0]) if len(boxes) == 1 and boxes[0] and boxes[0] <= 100 else 0
    found: dict[tuple[int, int], Command] = {}
    for command in deck.named("pair_coeff"):
        first, second = (_types(word, count) for word in (*command.words[1:3], "", "")[:2])
        for i in first:
            for j in second:
                found[min(i, j), max(i, j)] = command
    return found


def _types(word: str, count: int) -> range:
    match = re.fullmatch(r"(\d{0,4})(\*?)(\d{0,4})", word)
    if not word or match is None or (not match[2] and match[3]):
        return range(0)
    first = int(match[1] or 1)
    return range(first, min(first if not match[2] else int(match[3] or count), count) + 1)


def _granular(command: Command, words: tuple[str, ...], pair: _Pair) -> Contact | None:
    """A law of ``pair_style granular``."""
    count = NUMBERS_OF.get(" ".join(words[:1]), 0)
    if words[:1] not in [(name,) for name in (*_HERTZ, "hooke")] or len(words) <= count:
        return None
    normal, given = words[0], [number(word) for word in words[1 : 1 + count]]
    modulus, g = given[0], given[1]
    stiffness, exponent = modulus, 1.0
    if normal != "hooke":
        exponent = 1.5
        if normal != "hertz" and modulus is not None:
            nu = given[2]
            known = nu is not None and abs(nu) < 1
            modulus = 2 * modulus / (3 * (1 - nu**2)) if known else None  # type: ignore[operator]
        stiffness = None if modulus is None else modulus * math.sqrt(pair.radius)
    option = dict(pairwise(words)).get("damping", "viscoelastic")
    c, q = _damping(option, g, stiffness, exponent, pair)
    return Contact(command, stiffness, exponent, c, q)


def _damping(
    option: str, g: float | None, stiffness: float | None, exponent: float, pair: _Pair
) -> tuple[float | None, float]:
    """C and q of the damping c d^q d' of a law; see ``engines.lammps.damping``."""
    restitutions = ("tsuji", "coeff_restitution")
    none = g is not None and abs(g) <= NO_DAMPING
    if option == "none" or (none and option not in restitutions):
        return 0.0, 0.0
    power = {"viscoelastic": 0.5, **dict.fromkeys(restitutions, (exponent - 1) / 2)}.get(
        option, 0.0
    )
    c = None
    if g is not None and option == "velocity":
        c = g
    elif g is not None and pair.mass is not None:
        if option == "mass_velocity":
            c = g * pair.mass
        elif option == "viscoelastic":
            c = g * pair.mass * math.sqrt(pair.radius)
        elif option in restitutions and stiffness is not None and 0 < g <= 1:
            log = math.log(g)
            beta = -log / math.hypot(math.pi, log)
            alpha = tsuji(g, root_2=False) if option == "tsuji" else math.sqrt(5) * beta
            c = alpha * math.sqrt(pair.mass * stiffness)
    return c, power


def _classic(command: Command, words: tuple[str, ...], pair: _Pair) -> Contact | None:
    """A law of the ``gran`` styles: Kn Kt gamma_n ... in this order."""
    name = words[0] if words else ""
    kn, gamma = (number(" ".join(words[k : k + 1])) for k in (1, 3))
    if name not in ("gran/hertz/history", "gran/hooke", "gran/hooke/history"):
        return None
    if gamma is not None and abs(gamma) <= NO_DAMPING:
        gamma = 0.0
    if pair.mass is None and gamma != 0:
        gamma = None
    weight = pair.mass or 0.0
    if name != "gran/hertz/history":
        return Contact(command, kn, 1.0, None if gamma is None else gamma * weight, 0.0)
    root = math.sqrt(pair.radius)
    stiffness = None if kn is None else kn * root
    c = None if gamma is None else gamma * weight * root
    return Contact(command, stiffness, 1.5, c, 0.5 if c else 0.0)
