"""Contacts of a deck against the scene: stiffness, exponent, cutoffs, damping, friction, walls."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.reading import FoundWall
from hertzchain.verdict.deck.contact_names import contact_name, reduced_modulus, role_of
from hertzchain.verdict.deck.damping_checks import QUIET, damping_check, friction_check
from hertzchain.verdict.deck.deck_check import (
    Case,
    DeckCheck,
    Indices,
    groups,
    placed,
    same,
    values,
)
from hertzchain.verdict.deck.measured import far_wall, law_of
from hertzchain.verdict.deck.places import NUMBER, place, place_at

_EXPONENT = 0.01  # of 3/2: two tries of a law of Hertz are within 1e-9, Hooke's is 0.5 off (chosen)
_BENT = 0.01  # of the force at other overlaps than the largest expected (chosen)
_ELSEWHERE = " at other overlaps"
_MIXED = "2023"  # before, LAMMPS mixes E and nu of a wall with themselves (measured: 2022)
_NEAR = 3e-3  # of a factor: digits that people carry (chosen)
_NO_FORCE = 1e-6  # of Hertz's: a contact with less pushes not at all (chosen)


def contact_checks(case: Case) -> list[DeckCheck]:
    """All forces between granules and at walls."""
    if not case.laws:
        return []
    if not np.any(np.isfinite(case.found.contact_force)):
        check = DeckCheck(
            "contacts", "", None, None, case.whole_effect, False, True,
            "the contacts of the deck could not be asked", "its granules do not lie in one row",
        )  # fmt: skip
        return [placed(check, case.found, "place")]
    checks = _laws(case)
    if not any(check.name.endswith(_ELSEWHERE) for check in checks):
        checks += damping_check(case)  # which is what is added to a law of one power
    return [*checks, friction_check(case), *_image(case), *_walls(case)]


def _laws(case: Case) -> list[DeckCheck]:
    size = len(case.laws)
    expected = case.scene.granules.stiffness[:size]
    stiffness = np.array([law.stiffness for law in case.laws])
    exponent = np.array([law.exponent for law in case.laws])
    off_exponent = np.where(stiffness > 0, exponent - 1.5, 0.0)
    bent = np.abs(off_exponent) > _EXPONENT
    # At the same overlap: a law of another exponent has a stiffness in another unit.
    near = case.near[:size]
    ratio = stiffness * near ** (exponent - 1.5) / expected
    missing = ~(ratio > _NO_FORCE)
    checks = [_missing(case, alike) for alike in groups(np.where(missing, -1.0, 0.0))]
    off_exponent = np.where(missing | ~bent, 0.0, off_exponent)
    checks += [_bent(case, alike, exponent, ratio) for alike in groups(off_exponent)]
    wrong = np.where(missing | bent, 0.0, ratio * _by_radius(case) - 1)
    checks += [_stiffness(case, alike, ratio, expected) for alike in groups(wrong)]
    if not checks:
        checks = [same("stiffness of the contacts", "N m^-1.5", stiffness[0], expected[0],
                       case.reason)]  # fmt: skip
        checks.append(same("exponent of the contact law", "", exponent[0], 1.5, case.reason))
    return checks if any(not check.passed for check in checks) else [*checks, *_limited(case)]


def _by_radius(case: Case) -> FloatArray:
    """What makes up for wrong radii in stiffnesses: they have checks of their own."""
    size, radius = len(case.laws), case.found.radius
    of_scene = case.scene.granules.radius
    factor = np.ones(size)
    count = min(radius.size, of_scene.size)
    for k in range(min(size, count - 1)):
        mine = 1 / (1 / radius[k] + 1 / radius[k + 1])
        right = 1 / (1 / of_scene[k] + 1 / of_scene[k + 1])
        factor[k] = math.sqrt(right / mine)
    fits = np.array([abs(law.ratios[np.isfinite(law.ratios)][0] * f - 1) < 1e-6
                     if np.isfinite(law.ratios).any() else False
                     for law, f in zip(case.laws, factor, strict=True)])  # fmt: skip
    return np.where(fits, factor, 1.0)


def _missing(case: Case, alike: Indices) -> DeckCheck:
    stiffness = np.array(case.twin.stiffness)
    stiffness[alike] = 0.0
    who = contact_name(alike, case)
    check = DeckCheck(
        f"force of {who}", "N m^-1.5", 0.0, float(case.scene.granules.stiffness[alike[0]]),
        case.effect(stiffness=stiffness), False, True,
        f"no force in {who} at overlaps of {case.near[alike[0]]:.2g} m",
        "contacts must push by Hertz's law",
    )  # fmt: skip
    excluded = [
        index
        for index, one in enumerate(case.found.commands)
        if one.carried_out and re.match(r"neigh_modify\s.*\bexclude\s+(?!none)", one.text)
    ]
    if excluded:
        where = place_at(case.found, excluded[-1])
        return replace(check, place=where, command="without exclude")
    return placed(check, case.found, role_of(alike, case), (), _right_law(case, int(alike[0])))


def _bent(case: Case, alike: Indices, exponent: FloatArray, ratio: FloatArray) -> DeckCheck:
    k, who = int(alike[0]), contact_name(alike, case)
    powers, stiffness = np.array(case.twin.exponent), np.array(case.twin.stiffness)
    powers[alike] = exponent[alike]
    stiffness[alike] = [case.laws[j].stiffness for j in alike]
    check = DeckCheck(
        f"exponent of {who}", "", float(exponent[k]), 1.5,
        case.effect(exponent=powers, stiffness=stiffness), False, True,
        f"the force of {who} goes as overlap^{exponent[k]:.3g}, the scene has Hertz's"
        f" overlap^1.5; at {case.near[k]:.2g} m it is {ratio[k]:.3g} times Hertz's",
        f"chosen: an exponent may be off by {_EXPONENT}, no other law is as close",
    )  # fmt: skip
    return placed(check, case.found, role_of(alike, case), (), _right_law(case, k))


def _stiffness(case: Case, alike: Indices, ratio: FloatArray, expected: FloatArray) -> DeckCheck:
    k, who = int(alike[np.argmax(np.abs(ratio[alike] - 1))]), contact_name(alike, case)
    stiffness = np.array(case.twin.stiffness)
    stiffness[alike] *= ratio[alike]
    change = case.effect(stiffness=stiffness)
    measured, right = float(ratio[k] * expected[k]), float(expected[k])
    check = DeckCheck(
        f"stiffness of {who}", "N m^-1.5", measured, right, change,
        case.allowed(change, ratio[k] - 1), True,
        f"stiffness of {who} {values(measured, right, 'N m^-1.5')} ({_times(ratio[k])}"
        f"{_slip(case, who, float(ratio[k]))})",
        case.reason,
    )  # fmt: skip
    role = role_of(alike, case)
    return placed(check, case.found, role, _moduli(case, k, float(ratio[k])), _right_law(case, k))


def _times(ratio: float) -> str:
    """A ratio in a sentence; its difference from 1 where four digits would not show it."""
    if f"{ratio:.4g}" != "1":
        return f"{ratio:.4g} times"
    return f"{abs(ratio - 1):.1e} {'less' if ratio < 1 else 'more'}"


def _slip(case: Case, who: str, ratio: float) -> str:
    """The usual slip that makes a stiffness so many times too large, in words."""
    nu = float(case.scene.granules.poisson_ratio[0])
    slips = {
        "E stands for the effective modulus E/(2(1-nu^2))": 2 * (1 - nu**2),
        "E/(1-nu^2) stands for the effective modulus, which is half of it": 2.0,
        "the factor 4/3 is missing": 0.75,
        "the factor 2/3 is missing": 1.5,
        "1-nu^2 is missing": 1 - nu**2,
        "1-nu stands for 1-nu^2": 1 + nu,
        "R stands for the effective radius R/2": math.sqrt(2.0),
        "the effective radius is halved twice": math.sqrt(0.5),
        "half of it": 0.5,
    }
    if who == "the wall" and case.found.version < _MIXED:
        text = "for a wall of hertz/material: give hertz and 4/3 of its effective modulus"
        slips = {f"LAMMPS of {case.found.version[:4]} takes E/(2(1-nu)) {text}": 1 + nu}
    near = [
        name
        for name, factor in slips.items()
        if factor != 1 and abs(ratio / factor - 1) < min(_NEAR, 0.1 * abs(factor - 1))
    ]
    return f": {' or '.join(near)}" if near else ""


def _moduli(case: Case, k: int, ratio: float) -> list[tuple[float, float]]:
    """As what the wrong and the right stiffness of a contact may stand in a line, deck's units."""
    granules, unit = case.scene.granules, case.units
    right = 4 / 3 * reduced_modulus(case, k) / unit.pressure
    if k + 1 > granules.mass.size - 1:  # a wall has no modulus in the line, but its own stiffness
        return [(right * ratio, right)]
    where = place(case.found, "contacts")
    modulus, poisson = (
        float(granules.young_modulus[min(k, granules.mass.size - 1)]),
        float(granules.poisson_ratio[min(k, granules.mass.size - 1)]),
    )
    pairs: list[tuple[float, float]] = []
    if where is not None:
        written = re.search(
            r"hertz/material\s+(\S+)\s+\S+\s+(\S+)", case.found.commands[where.index].text
        )
        if written and abs(float(written[2]) / poisson - 1 if poisson else 0) > 1e-6:
            pairs.append((float(written[2]), poisson))
        elif written:
            pairs.append((float(written[1]), float(written[1]) / ratio))
    pairs += [(modulus * ratio / unit.pressure, modulus / unit.pressure), (right * ratio, right)]
    pairs += [(0.75 * right * ratio, 0.75 * right), (1.5 * right * ratio, 1.5 * right)]
    return pairs


def _right_law(case: Case, k: int) -> str:
    """The command of a contact as it would be right, in the style of the deck."""
    granules, unit, commands = case.scene.granules, case.units, case.found.commands
    normal = 4 / 3 * reduced_modulus(case, k) / unit.pressure
    if case.scene.wall is not None and k + 1 == case.near.size:
        where = place(case.found, "wall")
        text = "" if where is None else commands[where.index].text
        if "granular" in text:
            wall = re.compile(r"hertz(?:/material)?\s+\S+(\s+\S+)(\s+0\.\d+)?")
            return wall.sub(rf"hertz {normal:.10g}\1", text)
        return (
            f"fix wall all wall/gran granular hertz {normal:.10g} 0.0 tangential"
            " linear_nohistory 0.0 0.0 damping velocity ..."
        )
    modulus = float(granules.young_modulus[k]) / unit.pressure
    poisson = float(granules.poisson_ratio[k])
    styles = [one.text for one in commands if one.text.split()[:1] == ["pair_style"]]
    style = styles[-1].split() if styles else []
    if "gran/hertz/history" in style:
        at = style.index("gran/hertz/history")
        return " ".join([*style[: at + 1], f"{normal:.10g}", *style[at + 2 :]])
    if "granular" in style or not style:
        where = place(case.found, "contacts")
        text = "pair_coeff * *" if where is None else commands[where.index].text
        hertz = re.search(r"\bhertz\s+\S+", text)
        if hertz:
            return text.replace(hertz.group(), f"hertz {normal:.10g}")
        text = re.sub(r"\b(?:jkr|dmt)(\s+\S+\s+\S+\s+\S+)\s+\S+", r"hertz/material\1", text)
        material = re.sub(
            r"hertz/material\s+\S+\s+(\S+)\s+\S+",
            rf"hertz/material {modulus:.10g} \1 {poisson:.10g}", text,
        )  # fmt: skip
        if material != text:
            return material
    return f"pair_style gran/hertz/history {normal:.10g} NULL 0.0 0.0 0.0 0"


def _limited(case: Case) -> list[DeckCheck]:
    """Forces that are Hertz's at the largest overlap, but not at all others."""
    for k, law in enumerate(case.laws):
        tried = np.isfinite(law.ratios)
        if not tried.any():
            continue
        reference = law.stiffness * case.near[k] ** (law.exponent - 1.5)
        off = law.ratios[tried] * case.scene.granules.stiffness[k] / reference - 1
        at = int(np.argmax(np.abs(off)))
        if abs(off[at]) > _BENT:
            who, ratio = contact_name(np.array([k]), case), float(law.ratios[tried][at])
            check = DeckCheck(
                f"force of {who}{_ELSEWHERE}", "", ratio, 1.0, case.whole_effect, False, True,
                f"the force of {who} is {ratio:.3g} times Hertz's at one of the overlaps that were"
                " tried, and Hertz's at another: there is a cutoff or a limit",
                f"chosen: {_BENT:g} of the force",
            )  # fmt: skip
            return [
                placed(check, case.found, role_of(np.array([k]), case), (), _right_law(case, k))
            ]
    return []


def _image(case: Case) -> list[DeckCheck]:
    """Granules at the ends that touch through a periodic boundary."""
    force = case.found.image_force
    if case.found.image_gap is None:  # none of an image: the motion shows it
        return []
    if force <= QUIET * case.scene.units.force:
        return []
    check = DeckCheck(
        "contacts across the box", "N", force, 0.0, math.inf, False, True,
        f"granules at the two ends push one another by {force:.3g} N through the periodic boundary",
        "the chain of the scene has two ends",
    )  # fmt: skip
    return [placed(check, case.found, "image")]


def _walls(case: Case) -> list[DeckCheck]:
    """A wall that is missing, and walls that the scene has not."""
    scene, found, checks = case.scene, case.found, []
    if scene.wall is not None and far_wall(found) is None and (elsewhere := _elsewhere(case)):
        checks.append(elsewhere)
    elif scene.wall is not None and far_wall(found) is None:
        stiffness = np.array(case.twin.stiffness)
        stiffness[-1] = 0.0
        change = case.effect(stiffness=stiffness)
        check = DeckCheck(
            "wall", "", 0, 1, change, False, True, "the deck has no wall at the far end, the scene"
            f" has one of the kind {scene.wall.kind!r}", "counts must be equal",
        )  # fmt: skip
        checks.append(placed(check, found, "wall"))
    for wall in found.walls:
        if wall.end == "last" and scene.wall is not None:
            continue
        checks.append(_extra_wall(case, wall))
    if not checks:
        number = int(scene.wall is not None)
        checks.append(same("number of walls", "", number, number, "counts must be equal"))
    return checks


_PLANE = re.compile(r"fix\s+\S+\s+\S+\s+wall/.*\s([xyz])plane\s+(\S+)\s+(\S+)")


def _elsewhere(case: Case) -> DeckCheck | None:
    """A wall that the last granule does not meet where it is pushed: its command says where."""
    found = case.found
    for index, one in enumerate(found.commands):
        plane = _PLANE.match(one.text)
        if not one.carried_out or plane is None or plane[1] != found.axis:
            continue
        k, unit = "xyz".index(found.axis), case.units.length
        numbers = [float(word) * unit for word in plane.groups()[1:] if NUMBER.fullmatch(word)]
        if not numbers:
            continue
        last = float(case.scene.granules.position[-1])
        expected = float(case.scene.granules.radius[-1] + case.twin.opening[-1])
        places = [(n - found.origin[k]) * found.direction[k] - last for n in numbers]
        measured = min(places, key=lambda place: abs(place - expected))
        check = DeckCheck(
            "place of the wall", "m", float(measured), expected, case.whole_effect, False, True,
            f"the wall {values(float(measured), expected, 'm')} from the centre of the last"
            " granule", f"allowed is what changes no peak by more than {case.tolerance:g}",
        )  # fmt: skip
        return replace(check, place=place_at(found, index))
    return None


def _extra_wall(case: Case, wall: FoundWall) -> DeckCheck:
    """A wall that the scene has not matters where a granule reaches it."""
    found, ahead = case.found, wall.end == "last"
    end = -1 if ahead else 0
    room = abs(wall.position - float(found.position[end])) - float(found.radius[end])
    way = case.expected.forwards if ahead else case.expected.backwards
    reached = bool(way >= room)
    change: float | None = 0.0
    if reached and ahead:
        law = law_of(wall.overlap, wall.force, float(case.twin.stiffness[-1]), float(case.near[-1]))
        twin = case.twin
        change = case.effect(
            stiffness=np.append(twin.stiffness, law.stiffness),
            exponent=np.append(twin.exponent, law.exponent),
            opening=np.append(twin.opening, room),
            damping=np.append(twin.damping, 0.0),
        )
    which = "far end" if ahead else "end where the shock acts"
    check = DeckCheck(
        f"wall at the {which}", "", 1, 0, change, not reached, True,
        f"the deck has a wall at the {which}, {room:.3g} m from the granule, the scene has none",
        f"the granule moves {way:.3g} m towards it" + ("" if reached else " and never touches it"),
    )  # fmt: skip
    check = placed(check, found, "wall", (), "without this fix")
    return replace(check, place=place_at(found, wall.command))
