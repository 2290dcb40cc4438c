"""Contacts of a deck: stiffness, exponent, cutoffs, walls, images."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.reading.found import FoundWall
from hertzchain.verdict.deck.deck_check import PLACES, Case, Indices, groups, values
from hertzchain.verdict.deck.measured import EXPONENT, far_wall, law_of
from hertzchain.verdict.deck.number import Difference, Number, changed, same
from hertzchain.verdict.deck.places import NUMBER, WITHOUT, Pairs
from hertzchain.verdict.slips import near, slips_of_stiffness

_BENT = 0.01  # of the force at other overlaps than the largest expected (chosen)
_MIXED = "2023"  # older versions mix E and nu of a wall with themselves (measured: 2022)
QUIET = 1e-7  # of a contact force: forces below are round-off (chosen)


def _expected(case: Case) -> FloatArray:
    return case.scene.granules.stiffness[: len(case.laws)]


def is_tried(case: Case) -> bool:
    """Whether any contact of a deck was probed."""
    found = case.found
    if case.exact:
        tried = np.isfinite([*found.contact_force, *found.damped_force])
        return bool(np.all(tried) and np.all(np.isfinite(found.tangential_force)))
    return bool(case.laws) and bool(np.any(np.isfinite(found.contact_force)))


def role_of(case: Case, alike: Indices) -> str:
    """Return the kind of commands that set the force of some contacts: a key of ``ROLES``."""
    return "wall" if case.is_wall(alike) else "contacts"


def _untried(case: Case) -> Difference | list[Difference]:
    one = Difference(None, None, effect=case.whole_effect,
                     sentence="the contacts of the deck could not be asked")  # fmt: skip
    return one if case.laws else []


def _missing(case: Case) -> list[Difference]:
    made = []
    excluding = [
        index
        for index, one in enumerate(case.found.commands)
        if one.carried_out and re.match(r"neigh_modify\s.*\bexclude\s+(?!none)", one.text)
    ]
    for alike in groups(np.array([-float(law.is_missing) for law in case.laws]), 0.0):
        who, k = case.contact_name(alike), int(alike[0])
        made.append(
            Difference(
                0.0, _expected(case)[k], f"force of {who}",
                changes={"stiffness": changed(case.twin.stiffness, alike, 0.0)},
                sentence=f"no force in {who} at overlaps of {case.near[k]:.2g} m",
                role=role_of(case, alike), at=excluding[-1] if excluding else None,
                command=WITHOUT if excluding else "",
            )
        )  # fmt: skip
    return made


def _exponent(case: Case) -> list[Difference]:
    made, laws = [], case.laws
    room = np.array([3 * _rounding(case, k) if case.exact else EXPONENT for k in range(len(laws))])
    off = np.array([0.0 if law.is_missing else law.exponent - 1.5 for law in laws])
    for alike in groups(off, room):
        powers = changed(case.twin.exponent, alike, [laws[k].exponent for k in alike])
        stiffness = changed(case.twin.stiffness, alike, [laws[k].stiffness for k in alike])
        who, k = case.contact_name(alike), int(alike[0])
        made.append(
            Difference(
                laws[k].exponent, 1.5, f"exponent of {who}", role=role_of(case, alike),
                changes={"exponent": powers, "stiffness": stiffness}, room=room[k],
                sentence=f"the force of {who} goes as overlap^{laws[k].exponent:.3g}, the scene has"
                f" Hertz's overlap^1.5; at {case.near[k]:.2g} m it is {laws[k].ratio:.3g} times"
                " Hertz's",
            )
        )  # fmt: skip
    k = int(np.argmax(np.abs(off)))
    return made or [same(laws[k].exponent, 1.5, room[k])]


def _rounding(case: Case, k: int) -> float:
    """Rounding error of the force of a contact at the overlap that matters."""
    return float(case.rounding(k, case.near[k]))


def _stiffness(case: Case) -> list[Difference]:
    made, laws, expected = [], case.laws, _expected(case)
    ratio = np.array([law.ratio for law in laws])
    wrong = [law.is_missing or law.is_bent for law in laws]
    room = np.array([_rounding(case, k) for k in range(len(laws))])
    off = np.where(wrong, 0.0, ratio * _by_radius(case) - 1)
    for alike in groups(off, room):
        k, who = int(alike[np.argmax(np.abs(ratio[alike] - 1))]), case.contact_name(alike)
        stiffness = changed(case.twin.stiffness, alike, (expected * ratio)[alike])
        measured, right = float(ratio[k] * expected[k]), float(expected[k])
        made.append(
            Difference(
                measured, right, f"stiffness of {who}", relative=float(ratio[k] - 1),
                changes={"stiffness": stiffness}, role=role_of(case, alike),
                sentence=f"stiffness of {who} {values(measured, right, 'N m^-1.5')}"
                f" ({_times(ratio[k])}{_slip(case, who, float(ratio[k]))})",
                stands=_words(case, k, float(ratio[k])), room=room[k] * right,
            )
        )  # fmt: skip
    k = int(np.argmax(np.abs(off)))
    return made or [same(laws[k].stiffness, expected[k], room[k] * expected[k])]


def _words(case: Case, k: int, ratio: float) -> Pairs:
    """Numbers that alone make a contact so many times too stiff: its own, moduli, Poisson ratios.

    They are those of one granule, or of all like granules.
    """
    granules, unit = case.scene.granules, case.units.pressure
    softness = 1 / case.reduced_modulus(k)
    pairs = [(4 / 3 * ratio / softness / unit, 4 / 3 / softness / unit)] if ratio > 0 else []
    for granule in range(k, min(k + 2, granules.mass.size)) if ratio > 0 else ():
        modulus = float(granules.young_modulus[granule])
        poisson = float(granules.poisson_ratio[granule])
        own = (1 - poisson**2) / modulus
        for wrong in (own / ratio, own + softness / ratio - softness):
            if wrong > 0:
                pairs.append(((1 - poisson**2) / wrong / unit, modulus / unit))
            if 0 < wrong * modulus < 1:
                pairs.append((math.sqrt(1 - wrong * modulus), poisson))
    return pairs


def _by_radius(case: Case) -> FloatArray:
    """Factors that remove wrong radii from stiffnesses, as radii have checks of their own."""

    def effective(radius: FloatArray) -> FloatArray:
        return np.asarray(radius[:-1] * radius[1:] / (radius[:-1] + radius[1:]))

    right, mine = effective(case.scene.granules.radius), effective(case.found.radius)
    factor = np.ones(len(case.laws))
    count = min(factor.size, right.size, mine.size)
    factor[:count] = np.sqrt(right[:count] / mine[:count])
    fits = [law.ratios.size > 0 and abs(law.ratios[0] * f - 1) < 1e-6
            for law, f in zip(case.laws, factor, strict=True)]  # fmt: skip
    return np.where(fits, factor, 1.0)


def _times(ratio: float) -> str:
    """A ratio in words; its difference from 1 if four digits do not show it."""
    if f"{ratio:.4g}" != "1":
        return f"{ratio:.4g} times"
    return f"{abs(ratio - 1):.1e} {'less' if ratio < 1 else 'more'}"


def _slip(case: Case, who: str, ratio: float) -> str:
    """The usual slip that makes a stiffness too large by a ratio, in words."""
    slips = slips_of_stiffness(case.scene)
    if who == "the wall" and case.found.version < _MIXED:
        text = "for a wall of hertz/material: give hertz and 4/3 of its effective modulus"
        nu = float(case.scene.granules.poisson_ratio[0])
        slips = {f"LAMMPS of {case.found.version[:4]} takes E/(2(1-nu)) {text}": 1 + nu}
    names = near(slips, ratio)
    return f": {' or '.join(names)}" if names else ""


def elsewhere(case: Case) -> list[Difference]:
    """Forces that follow Hertz's law at the largest overlap, but not at all others."""
    factor = _by_radius(case)
    if any(
        law.is_missing
        or law.is_bent
        or abs(law.ratio * factor[k] - 1)
        > (_rounding(case, k) if case.exact else 10 * case.tolerance)
        for k, law in enumerate(case.laws)
    ):
        return []
    for k, law in enumerate(case.laws):
        ratios, room = law.ratios, case.rounding(k, law.overlap) if case.exact else _BENT
        times_allowed = np.abs(ratios / (1.0 if case.exact else law.ratio) - 1) / room
        at = int(np.argmax(times_allowed))
        if not times_allowed[at] <= 1:
            alike = np.array([k])
            who = case.contact_name(alike)
            return [
                Difference(
                    ratios[at], 1.0, f"force of {who} at other overlaps", effect=case.whole_effect,
                    role=role_of(case, alike),
                    sentence=f"the force of {who} is {ratios[at]:.3g} times Hertz's at one of the"
                    " overlaps that were tried, and Hertz's at another: there is a cutoff or a"
                    " limit", reason=f"chosen: {_BENT:g} of the force",
                )
            ]  # fmt: skip
    return []


# ---- The ends of the chain


def _image(case: Case) -> Difference | list[Difference]:
    """Granules at the ends that touch through a periodic boundary."""
    force = case.found.image_force
    if case.found.image_gap is None:  # the motion shows the effect of an image that is not near
        return []
    return Difference(
        force, 0.0, effect=math.inf, sentence="granules at the two ends push one another by"
        f" {force:.3g} N through the periodic boundary",
        room=case.least(QUIET) * case.scene.units.force,
    )  # fmt: skip


_PLANE = re.compile(r"fix\s+\S+\s+\S+\s+wall/.*\s([xyz])plane\s+(\S+)\s+(\S+)")


def _wall(case: Case) -> Difference | list[Difference]:
    """A wall that is missing, or that the last granule does not meet when it is pushed."""
    scene, found = case.scene, case.found
    if scene.wall is None or far_wall(found) is not None:
        return same(1, 1, 0.0) if scene.wall is not None else []
    for index, one in enumerate(found.commands):
        plane = _PLANE.match(one.text)
        if not one.carried_out or plane is None or plane[1] != found.axis:
            continue
        k, last = "xyz".index(found.axis), float(scene.granules.position[-1])
        expected = float(scene.granules.radius[-1] + case.twin.opening[-1])
        places = [
            (float(word) * case.units.length - found.origin[k]) * found.direction[k] - last
            for word in plane.groups()[1:]
            if NUMBER.fullmatch(word)
        ]
        if not places:
            continue
        measured = min(places, key=lambda place: abs(place - expected))
        if abs(measured - expected) <= PLACES * case.near[-1] + case.rounded:
            return replace(
                _no_wall(case), at=index,
                sentence="the wall stands where the scene has it, but does not push the last"
                f" granule: its fix acts on the group {one.text.split()[2]!r}",
            )  # fmt: skip
        return Difference(
            measured, expected, "place of the wall", "m", effect=case.whole_effect,
            at=index, reason=case.reason(0.0),
            sentence=f"the wall {values(measured, expected, 'm')} from the centre of the"
            " last granule",
        )  # fmt: skip
    return _no_wall(case)


def _no_wall(case: Case) -> Difference:
    assert case.scene.wall is not None
    return Difference(
        0, 1, changes={"stiffness": changed(case.twin.stiffness, -1, 0.0)},
        sentence="the deck has no wall at the far end,"
        f" the scene has one of the kind {case.scene.wall.kind!r}",
    )  # fmt: skip


def _extra_walls(case: Case) -> list[Difference]:
    """Walls that the scene does not have: they count if a granule reaches them."""
    return [
        _extra_wall(case, wall)
        for wall in case.found.walls
        if wall.end == "first" or case.scene.wall is None
    ]


def _extra_wall(case: Case, wall: FoundWall) -> Difference:
    found, ahead, twin = case.found, wall.end == "last", case.twin
    end = -1 if ahead else 0
    room = abs(wall.position - float(found.position[end])) - float(found.radius[end])
    way = case.expected.forwards if ahead else case.expected.backwards
    reached, changes = bool(way >= room), None
    if reached and ahead:
        law = law_of(wall.overlap, wall.force, float(twin.stiffness[-1]), float(case.near[-1]))
        changes = {
            "stiffness": np.append(twin.stiffness, law.stiffness),
            "exponent": np.append(twin.exponent, law.exponent),
            "opening": np.append(twin.opening, room),
            "damping": np.append(twin.damping, 0.0),
        }
    which = "far end" if ahead else "end where the shock acts"
    return Difference(
        1, 0, f"wall at the {which}", relative=None if reached else 0.0, changes=changes,
        effect=0.0,
        sentence=f"the deck has a wall at the {which}, {room:.3g} m from the granule, the scene has"
        " none", reason=f"the granule moves {way:.3g} m towards it"
        + ("" if reached else " and never touches it"), at=wall.command, command=WITHOUT,
    )  # fmt: skip


CONTACTS = (
    Number("force of the contacts", "N m^-1.5", "contacts", _missing,
           "contacts must push by Hertz's law", explains=True),
    Number("exponent of the contact law", "", "contacts", _exponent,
           f"chosen: an exponent may be off by {EXPONENT}, no other law is as close"),
    Number("stiffness of the contacts", "N m^-1.5", "contacts", _stiffness),
    Number("force at other overlaps", "", "contacts", elsewhere,
           explains=True),
    Number("contacts across the box", "N", "image", _image,
           "the chain of the scene has two ends", explains=True),
    Number("wall", "", "wall", _wall, "counts must be equal"),
    Number("wall at an end", "", "wall", _extra_walls, explains=True),
)  # fmt: skip

UNTRIED = Number("contacts", "", "granules", _untried, "its granules are in no row",
                 explains=True)  # fmt: skip
"""The number in place of all others if no contact was probed."""
