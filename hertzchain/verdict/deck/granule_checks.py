"""Granules of a deck against the scene: count, radius, mass, place, velocity, spin."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.verdict.deck.deck_check import (
    ROUND_OFF,
    Case,
    DeckCheck,
    groups,
    names,
    placed,
    same,
    values,
)
from hertzchain.verdict.deck.measured import far_wall, spacing
from hertzchain.verdict.deck.places import is_same, numbers_in, place

_PLACES = 1e-7  # of an overlap: gaps below are rounded coordinates (chosen)


def granule_checks(case: Case) -> list[DeckCheck]:
    """All numbers of the granules before anything moves."""
    return [
        _count(case),
        *_radius(case),
        *_mass(case),
        *_spacing(case),
        *_wall_place(case),
        *_off_axis(case),
        *_velocity(case),
        *_spin(case),
    ]


def _both(measured: FloatArray, expected: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The granules that deck and scene both have."""
    count = min(measured.shape[0], expected.shape[0])
    return measured[:count], expected[:count]


def _filled(measured: FloatArray, expected: FloatArray) -> FloatArray:
    """The scene's numbers with the deck's where it has any."""
    whole = np.array(expected, np.float64)
    count = min(measured.size, whole.size)
    whole[:count] = measured[:count]
    return whole


def _count(case: Case) -> DeckCheck:
    found, wanted = case.found.radius.size, case.scene.chain.granules
    if found == wanted:
        return same("number of granules", "", found, wanted, "counts must be equal")
    check = DeckCheck(
        "number of granules", "", found, wanted, math.inf, False, True,
        f"the deck has {found} granules, the scene {wanted}", "counts must be equal",
    )  # fmt: skip
    numbers = [(found, wanted)] + ([] if found - 1 == wanted else [(found - 1, wanted - 1)])
    return placed(check, case.found, "granules", numbers)


def _radius(case: Case) -> list[DeckCheck]:
    measured, expected = _both(case.found.radius, case.scene.granules.radius)
    off = measured / expected - 1
    if not np.any(np.abs(off) > ROUND_OFF):
        return [same("radius", "m", measured[0], expected[0], case.reason)]
    checks = []
    for alike in groups(off):
        k = int(alike[np.argmax(np.abs(off[alike]))])
        mass, opening = np.array(case.twin.mass), np.array(case.twin.opening)
        count = min(mass.size, measured.size)
        mass[:count] = np.where(off != 0, case.found.mass[:count], mass[:count])
        for granule in alike:  # smaller granules no longer touch
            shorter = expected[granule] - measured[granule]
            opening[max(granule - 1, 0) : granule] += shorter
            opening[granule : granule + 1] += shorter
        name = f"radius of {names(alike, measured.size, 'granule', 1)}"
        change = case.effect(mass=mass, opening=opening)
        check = DeckCheck(
            name, "m", float(measured[k]), float(expected[k]), change,
            case.allowed(change, off[k]), True,
            f"{name} {values(measured[k], expected[k], 'm')}", case.reason,
        )  # fmt: skip
        old, new = measured[k] / case.units.length, expected[k] / case.units.length
        numbers = [(2 * old, 2 * new), (old, new)]
        checks.append(placed(check, case.found, "radius", numbers))
    return checks


def _mass(case: Case) -> list[DeckCheck]:
    """Masses, where a wrong radius does not explain them."""
    measured, expected = _both(case.found.mass, case.scene.granules.mass)
    if case.scene.piston is not None:  # its mass does not matter
        expected = np.append(measured[:1], expected[1:])
    radius, of_scene = _both(case.found.radius, case.scene.granules.radius)
    # A wrong radius has its own check: here the density counts.
    fitting = expected * (radius / of_scene) ** 3
    density = np.abs(measured / fitting - 1) <= 1e-6
    off = np.where(density, 0.0, measured / expected - 1)
    if not np.any(np.abs(off) > ROUND_OFF):
        return [same("mass", "kg", measured[0], expected[0], case.reason)]
    checks = []
    for alike in groups(off):
        k = int(alike[np.argmax(np.abs(off[alike]))])
        mass = np.array(case.twin.mass)
        mass[alike] = measured[alike]
        name = f"mass of {names(alike, measured.size, 'granule', 1)}"
        change = case.effect(mass=mass)
        check = DeckCheck(
            name, "kg", float(measured[k]), float(expected[k]), change,
            case.allowed(change, off[k]), True,
            f"{name} {values(measured[k], expected[k], 'kg')}", case.reason,
        )  # fmt: skip
        checks.append(_mass_placed(case, check, k))
    return checks


def _mass_placed(case: Case, check: DeckCheck, k: int) -> DeckCheck:
    """The line of a mass: by its density, itself, or a density given before the diameter."""
    units, volume = case.units, 4 / 3 * math.pi * case.scene.granules.radius[k] ** 3
    assert check.measured is not None
    assert check.expected is not None
    old, new = check.measured / units.mass, check.expected / units.mass
    right = check.expected / volume / units.density
    early = old / (math.pi / 6)  # LAMMPS makes granules with a diameter of 1
    where = place(case.found, "mass", [early])
    if where is not None and "density" in where.written and _stands(case, early, where.index):
        why = f"{check.sentence}: the density was set while the diameter was still 1"
        return replace(check, place=where, sentence=why)
    numbers = [(old * units.mass / volume / units.density, right), (old, new)]
    return placed(check, case.found, "mass", numbers)


def _stands(case: Case, number: float, index: int) -> bool:
    return any(is_same(n, number) for n in numbers_in(case.found.commands[index].text))


def _spacing(case: Case) -> list[DeckCheck]:
    """Gaps and overlaps at the start, by the distance of neighbours."""
    count = min(case.found.position.size, case.scene.chain.granules)
    expected = np.diff(case.scene.granules.position)[: count - 1]
    measured = spacing(case.found)[: count - 1]
    if measured.size == 0:
        return []
    off, deep = measured - expected, case.near[: count - 1]
    rounding = 8 * np.finfo(np.float64).eps * float(np.max(np.abs(case.found.position)))
    k = int(np.argmax(np.abs(off)))
    if np.all(np.abs(off) <= _PLACES * deep + rounding):
        return [same("distance of neighbours", "m", measured[k], expected[k], case.reason)]
    opening = np.array(case.twin.opening)
    opening[: count - 1] += off
    change = case.effect(opening=opening)
    significant = np.abs(off) > max(0.5 * float(np.abs(off[k])), rounding)
    alike = np.flatnonzero(significant)
    name = f"distance of granules at {names(alike, measured.size, 'contact', 2)}"
    gap = off[k] + (case.twin.opening[k])
    kind = f"a gap of {gap:.3g} m" if gap > 0 else f"an overlap of {-gap:.3g} m"
    check = DeckCheck(
        name, "m", float(measured[k]), float(expected[k]), change,
        case.allowed(change, 0.0), True,
        f"{name} {values(measured[k], expected[k], 'm')}: {kind} in contact {k + 2}, which the"
        f" shock presses by {deep[k]:.2g} m",
        f"allowed is what changes no peak by more than {case.tolerance:g}",
    )  # fmt: skip
    unit = case.units.length
    size = case.scene.granules.position / unit
    numbers = [
        (measured[k] / unit, expected[k] / unit),
        *((abs(float(case.found.position[j])) / unit, float(size[j])) for j in alike[:1] + 1),
    ]
    return [placed(check, case.found, "place", numbers)]


def _wall_place(case: Case) -> list[DeckCheck]:
    wall, scene = far_wall(case.found), case.scene
    if scene.wall is None or wall is None or case.found.position.size != scene.chain.granules:
        return []
    last = case.scene.granules.position[-1]
    expected = float(scene.granules.radius[-1] + case.twin.opening[-1])
    measured = wall.position - float(case.found.position[-1])
    off, deep = measured - expected, float(case.near[-1])
    rounding = 8 * np.finfo(np.float64).eps * float(last)
    if abs(off) <= _PLACES * deep + rounding:
        return [same("place of the wall", "m", wall.position, last + expected, case.reason)]
    opening = np.array(case.twin.opening)
    opening[-1] += off
    change = case.effect(opening=opening)
    check = DeckCheck(
        "place of the wall", "m", measured, expected, change, case.allowed(change, 0.0), True,
        f"the wall {values(measured, expected, 'm')} from the centre of the last granule",
        f"allowed is what changes no peak by more than {case.tolerance:g}",
    )  # fmt: skip
    return [placed(check, case.found, "wall")]


def _tilt(case: Case, sideways: float) -> float:
    """What granules off the axis cost a peak: the overlap of a contact that tilts by s / 2R."""
    radius = float(np.min(case.scene.granules.radius))
    return 1.5 * sideways**2 / (4 * radius) / float(np.max(case.near))


def _off_axis(case: Case) -> list[DeckCheck]:
    off = float(np.max(np.abs(case.found.sideways - case.found.sideways[0]), initial=0.0))
    radius = float(case.scene.granules.radius[0])
    if off <= ROUND_OFF * radius:
        return [same("distance from the axis", "m", off, 0.0, case.reason)]
    change = _tilt(case, off)
    k = int(np.argmax(np.max(np.abs(case.found.sideways - case.found.sideways[0]), axis=1)))
    check = DeckCheck(
        "distance from the axis", "m", off, 0.0, change, case.allowed(change, off / radius / 10),
        True, f"granule {k + 1} is {off:.3g} m off the axis of the chain, the scene is straight",
        "a contact that tilts by s / 2R loses s^2 / 4R of its overlap",
    )  # fmt: skip
    numbers = [(off / case.units.length, 0.0)]
    return [placed(check, case.found, "place", numbers)]


def _velocity(case: Case) -> list[DeckCheck]:
    """Velocities at the start: those of a striker, else none."""
    measured, expected = _both(case.found.velocity[:, 0], case.twin.velocity)
    scale = case.scene.units.velocity
    side = float(np.max(np.abs(case.found.velocity[:, 1:]), initial=0.0))
    off, checks = measured - expected, []
    if case.scene.piston is not None:  # a fix leads it
        off[0] = 0.0
    k = int(np.argmax(np.abs(off)))
    if abs(off[k]) <= ROUND_OFF * scale:
        checks.append(same("velocity at the start", "m/s", measured[k], expected[k], case.reason))
    else:
        whole = _filled(measured, case.twin.velocity)
        change, alone = case.effect(velocity=whole), np.count_nonzero(np.abs(off) > 0) == 1
        wanted = expected[k] != 0
        relative = off[k] / expected[k] if wanted else math.inf
        who = f"granule {k + 1}" if alone else f"granules, largest at granule {k + 1},"
        check = DeckCheck(
            f"velocity of granule {k + 1} at the start", "m/s", float(measured[k]),
            float(expected[k]), change, wanted and case.allowed(change, relative), True,
            f"velocity of {who} at the start {values(measured[k], expected[k], 'm/s')}",
            case.reason if wanted else "the scene has no such velocity",
        )  # fmt: skip
        old, new = measured[k] / case.units.velocity, expected[k] / case.units.velocity
        checks.append(placed(check, case.found, "velocity", [(abs(old), abs(new))]))
    if side > ROUND_OFF * scale:
        radius = float(np.min(case.scene.granules.radius))
        change = _tilt(case, min(side * case.found.end_time, radius))
        check = DeckCheck(
            "velocity across the chain", "m/s", side, 0.0, change, False, True,
            f"granules move across the chain with {side:.3g} m/s, the scene has no such velocity",
            "the scene has no such velocity",
        )  # fmt: skip
        old = side / case.units.velocity
        checks.append(placed(check, case.found, "velocity", [(old, 0.0)]))
    return checks


def _spin(case: Case) -> list[DeckCheck]:
    spin = float(np.max(np.abs(case.found.spin), initial=0.0))
    surface = spin * float(np.max(case.scene.granules.radius))
    if surface <= ROUND_OFF * case.scene.units.velocity:
        return [same("spin at the start", "1/s", spin, 0.0, case.reason)]
    check = DeckCheck(
        "spin at the start", "1/s", spin, 0.0, case.whole_effect, False, True,
        f"granules spin with {spin:.3g} 1/s at the start, the scene has no spin",
        "the scene has no spin; with friction it pushes granules off the axis",
    )  # fmt: skip
    numbers = [(spin * case.units.time, 0.0)]
    return [placed(check, case.found, "spin", numbers)]
