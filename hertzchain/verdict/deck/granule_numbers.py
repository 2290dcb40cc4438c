"""Numbers of a deck's granules before anything moves: count, radius, mass, place, velocity."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.reading.units import UNITS
from hertzchain.scene.chain import granule_mass
from hertzchain.verdict.deck.deck_check import (
    EXAMINED,
    PLACES,
    ROUND_OFF,
    Case,
    Indices,
    groups,
    values,
)
from hertzchain.verdict.deck.expected import length, places
from hertzchain.verdict.deck.measured import far_wall
from hertzchain.verdict.deck.number import Difference, Number, changed, same
from hertzchain.verdict.deck.places import Pairs, commands_of, is_of
from hertzchain.verdict.deck.right_commands import wall_plane

_SAME_UNIT = 0.1  # relative: lengths in other units are off by 100 or more (chosen)


def _both(measured: FloatArray, expected: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The granules that deck and scene both have."""
    count = min(measured.shape[0], expected.shape[0])
    return measured[:count], expected[:count]


def _count(case: Case) -> Difference:
    found, wanted = case.found.radius.size, case.scene.bodies
    walls = case.scene.first_granule
    noun = "granule" if found - walls == 1 else "granules"
    return Difference(
        found - walls, wanted - walls, effect=math.inf, room=0.0,
        stands=[(found, wanted), *[(found - 1, wanted - 1)] * (found - 1 != wanted)],
        sentence=f"the deck has {found - walls} {noun}, the scene {wanted - walls}",
    )  # fmt: skip


def _alike(
    case: Case,
    measured: FloatArray,
    expected: FloatArray,
    off: FloatArray,
    room: float,
    name: str,
    changes: Callable[[Indices], dict[str, Any]],
    stands: Callable[[float, float, int], Pairs],
) -> list[Difference]:
    """A difference for all granules with equal errors, with the numbers of the worst."""
    made = []
    for alike in groups(off, room):
        k = int(alike[np.argmax(np.abs(off[alike]))])
        made.append(
            Difference(
                measured[k], expected[k], f"{name} of {case.granule_name(alike)}",
                relative=off[k], changes=changes(alike), stands=stands(measured[k], expected[k], k),
                room=room * expected[k],
            )
        )  # fmt: skip
    k = int(np.argmax(np.abs(off)))
    return made or [same(measured[k], expected[k], room * expected[k])]


def _with_units(case: Case, one: Difference) -> Difference:
    """A difference of radii at the line of the units, if all lengths are in another unit."""
    both = [_both(case.found.radius, case.scene.granules.radius),
            _both(case.found.position, case.scene.granules.position)]  # fmt: skip
    for index, command in enumerate(case.found.commands):
        words = command.text.split()
        if words[:1] != ["units"] or words[1] not in UNITS:
            continue
        for name, other in UNITS.items():
            factor = other.length / case.units.length
            fits = [np.allclose(found * factor, own, _SAME_UNIT, _SAME_UNIT * own[-1])
                    for found, own in both]  # fmt: skip
            if factor != 1 and all(fits):
                return replace(one, at=index, stands=(), command=f"units {name}")
    return one


def _radius(case: Case) -> list[Difference]:
    measured, expected = _both(case.found.radius, case.scene.granules.radius)
    off, unit = measured / expected - 1, case.units.length

    def changes(alike: Indices) -> dict[str, Any]:
        mass, opening = np.array(case.twin.mass), np.array(case.twin.opening)
        count = measured.size
        mass[:count] = np.where(off != 0, case.found.mass[:count], mass[:count])
        for granule in alike:  # smaller granules no longer touch
            opening[max(granule - 1, 0) : granule + 1] += expected[granule] - measured[granule]
        return {"mass": mass, "opening": opening}

    made = _alike(case, measured, expected, off, case.least(ROUND_OFF), "radius", changes,
                  lambda old, new, _: [(2 * old / unit, 2 * new / unit), (old / unit, new / unit)],
                  )  # fmt: skip
    return [_with_units(case, one) for one in made]


def _mass(case: Case) -> list[Difference]:
    """Masses, where a wrong radius does not explain them."""
    measured, expected = _both(case.found.mass, case.scene.granules.mass)
    each, held = case.scene.granules, np.isinf(expected)  # what nothing moves weighs nothing
    free = granule_mass(each.radius, each.density)[: held.size]
    measured, expected = (np.where(held, free, mass) for mass in (measured, expected))
    radius, of_scene = _both(case.found.radius, case.scene.granules.radius)
    fitting, room = expected * (radius / of_scene) ** 3, case.least(ROUND_OFF)
    explained = np.abs(measured / fitting - 1) <= case.least(1e-6)
    off = np.where(explained, 0.0, measured / expected - 1)
    units = case.units

    def changes(alike: Indices) -> dict[str, Any]:
        return {"mass": changed(case.twin.mass, alike, measured[alike])}

    def stands(old: float, new: float, k: int) -> Pairs:
        volume = 4 / 3 * math.pi * float(of_scene[k]) ** 3 * units.density
        early = old / units.mass / (math.pi / 6)  # LAMMPS makes granules with a diameter of 1
        right = new / volume
        return [(early, right), (old / volume, right), (old / units.mass, new / units.mass)]

    return _alike(case, measured, expected, off, room, "mass", changes, stands)


def _place(case: Case) -> Difference | list[Difference]:
    """Places of granules: a generated chain begins at 0, others may begin anywhere."""
    if not case.exact:
        return []
    begin = float(case.found.origin @ case.found.direction)
    measured, expected = _both(begin + case.found.position, places(case.scene))
    k = int(np.argmax(np.abs(measured - expected)))
    return Difference(measured[k], expected[k], f"place of {case.granule_name(k)}",
                      room=EXAMINED * length(case.scene))  # fmt: skip


def _distance(case: Case) -> Difference | list[Difference]:
    """Gaps and overlaps at the start, from the distance of neighbours."""
    position, of_scene = _both(case.found.position, places(case.scene)[: case.scene.bodies])
    expected, measured = np.diff(of_scene), np.diff(position)
    if measured.size == 0:
        return []
    off, deep = measured - expected, case.near[: measured.size]
    room = PLACES * deep + case.rounded
    over = np.abs(off) > room
    k = int(np.argmax(np.where(over | ~np.any(over), np.abs(off), 0.0)))
    opening = np.array(case.twin.opening)
    opening[: measured.size] += off
    alike = np.flatnonzero(np.abs(off) >= max(0.5 * float(np.abs(off[k])), case.rounded))
    name = f"distance of granules at {case.contact_name(alike, measured.size)}"
    gap, unit = opening[k], case.units.length
    kind = f"a gap of {gap:.3g} m" if gap > 0 else f"an overlap of {-gap:.3g} m"
    first = int(alike[0]) + 1 if alike.size else 0
    stands = [(measured[k] / unit, expected[k] / unit),
              (abs(float(position[first])) / unit, float(of_scene[first]) / unit)]  # fmt: skip
    run, settled = None, ""
    if case.found.before > 0:  # the places stand in no line
        stands, settled = [], " after the runs before the shock"
        run = max(k for k in commands_of(case.found, "run") if k < case.found.first_run)
    return Difference(
        measured[k], expected[k], name, relative=0.0, changes={"opening": opening}, at=run,
        sentence=f"{name}{settled} {values(measured[k], expected[k], 'm')}: {kind} in"
        f" {case.contact_name(k)}, which the shock presses by {deep[k]:.2g} m",
        stands=stands, room=room[k],
    )  # fmt: skip


def _wall_place(case: Case) -> Difference | list[Difference]:
    wall, scene = far_wall(case.found), case.scene
    if scene.wall is None or wall is None or case.found.position.size != scene.bodies:
        return []
    expected = float(np.diff(places(scene))[-1])
    measured = wall.position - float(case.found.position[-1])
    opening = changed(case.twin.opening, -1, case.twin.opening[-1] + measured - expected)
    stands = []
    if case.found.axis in "xyz":
        plane, further = wall_plane(case), (measured - expected) / case.units.length
        stands = [(plane + float(case.found.direction.sum()) * further, plane)]
    return Difference(
        measured, expected, relative=0.0, at=wall.command, stands=stands,
        changes={"opening": opening}, room=case.least(PLACES) * case.near[-1] + case.rounded,
        sentence=f"the wall {values(measured, expected, 'm')} from the centre of the last granule",
    )  # fmt: skip


def _tilt(case: Case, sideways: float) -> float:
    """Effect of granules off the axis on a peak: a contact that tilts by s / 2R loses overlap."""
    radius = float(np.min(case.scene.granules.radius))
    return 1.5 * sideways**2 / (4 * radius) / float(np.max(case.near))


def _off_axis(case: Case) -> Difference:
    each = np.max(np.abs(case.found.sideways - case.found.sideways[0]), axis=1)
    k = int(np.argmax(each))
    off, radius = float(each[k]), float(case.scene.granules.radius[0])
    return Difference(
        off, 0.0, relative=0.0, effect=_tilt(case, off),
        sentence=f"{case.granule_name(k)} is {off:.3g} m off the axis of the chain, the scene is"
        " straight",
        reason="a contact that tilts by s / 2R loses s^2 / 4R of its overlap",
        stands=[(off / case.units.length, 0.0)], room=case.least(ROUND_OFF) * radius,
    )  # fmt: skip


def _velocity(case: Case) -> Difference:
    """Velocities at the start: those of moving granules or a striker, otherwise 0."""
    measured, expected = _both(case.found.velocity[:, 0], case.twin.velocity)
    if case.scene.piston is not None:  # a fix prescribes its motion
        expected = np.append(measured[:1], expected[1:])
    off = measured - expected
    k = int(np.argmax(np.abs(off)))
    unit, alone = case.units.velocity, np.count_nonzero(np.abs(off) > 0) == 1
    who = case.granule_name(k) if alone else f"granules, largest at {case.granule_name(k)},"
    return Difference(
        measured[k], expected[k], f"velocity of {case.granule_name(k)} at the start",
        relative=off[k] / expected[k] if expected[k] != 0 else None,
        changes={"velocity": np.append(measured, case.twin.velocity[measured.size :])},
        sentence=f"velocity of {who} at the start {values(measured[k], expected[k], 'm/s')}",
        stands=[(abs(measured[k]) / unit, abs(expected[k]) / unit)], at=_drawn(case),
        room=case.least(ROUND_OFF) * _fastest(case),
    )  # fmt: skip


def _drawn(case: Case) -> int | None:
    """The command that draws random velocities in all directions; None if none is visible."""
    if not np.any(case.found.velocity[:, 1:]):
        return None
    drawing = [k for k in commands_of(case.found, "random") if is_of(case.found, k, "velocity")]
    return drawing[-1] if drawing else None


def _fastest(case: Case) -> float:
    """Velocity that others are compared with [m/s]: resting granules of our own decks have none."""
    largest = float(np.max(np.abs(case.twin.velocity)))
    return largest if case.exact else case.scene.units.velocity


def _velocity_across(case: Case) -> Difference:
    side = float(np.max(np.abs(case.found.velocity[:, 1:]), initial=0.0))
    radius = float(np.min(case.scene.granules.radius))
    tilt = _tilt(case, min(side * case.found.end_time, radius))  # at the end: peaks come before
    return Difference(
        side, 0.0, effect=min(tilt, case.whole_effect),
        sentence=f"granules move across the chain with {side:.3g} m/s, the scene has no such"
        " velocity", stands=[(side / case.units.velocity, 0.0)], at=_drawn(case),
        room=case.least(ROUND_OFF) * _fastest(case),
    )  # fmt: skip


def _spin(case: Case) -> Difference:
    spin = float(np.max(np.abs(case.found.spin), initial=0.0))
    radius = float(np.max(case.scene.granules.radius))
    return Difference(
        spin, 0.0, effect=case.whole_effect, stands=[(spin * case.units.time, 0.0)],
        sentence=f"granules spin with {spin:.3g} 1/s at the start, the scene has no spin",
        room=case.least(ROUND_OFF) * _fastest(case) / radius,
    )  # fmt: skip


_NO_VELOCITY = "a striker alone moves at the start"

GRANULES = (
    Number("number of granules", "", "granules", _count, "counts must be equal",
           explains=True),
    Number("radius", "m", "radius", _radius),
    Number("mass", "kg", "mass", _mass),
    Number("place of granules", "m", "place", _place),
    Number("distance of neighbours", "m", "place", _distance),
    Number("place of the wall", "m", "wall", _wall_place),
    Number("distance from the axis", "m", "place", _off_axis, explains=True),
    Number("velocity at the start", "m/s", "velocity", _velocity,
           _NO_VELOCITY),
    Number("velocity across the chain", "m/s", "velocity", _velocity_across,
           _NO_VELOCITY, explains=True),
    Number("spin at the start", "1/s", "spin", _spin,
           "the scene has no spin; with friction it pushes granules off the axis", explains=True),
)  # fmt: skip
