"""Numbers of a deck's granules before anything moves: count, radius, mass, place, velocity."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.reading.units import UNITS
from hertzchain.verdict.deck.deck_check import ROUND_OFF, Case, Indices, groups, names, values
from hertzchain.verdict.deck.measured import far_wall
from hertzchain.verdict.deck.number import Difference, Number, changed, same
from hertzchain.verdict.deck.places import Pairs, commands_of
from hertzchain.verdict.deck.right_commands import wall_plane

_SAME_UNIT = 0.1  # relative: lengths in other units are off by 100 or more (chosen)
_PLACES = 1e-7  # of an overlap: gaps below are rounded coordinates (chosen)


def _both(measured: FloatArray, expected: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The granules that deck and scene both have."""
    count = min(measured.shape[0], expected.shape[0])
    return measured[:count], expected[:count]


def _count(case: Case) -> Difference:
    found, wanted = case.found.radius.size, case.scene.chain.granules
    return Difference(
        found, wanted, effect=math.inf, differs=found != wanted,
        stands=[(found, wanted), *[(found - 1, wanted - 1)] * (found - 1 != wanted)],
        sentence=f"the deck has {found} granules, the scene {wanted}",
    )  # fmt: skip


def _alike(
    measured: FloatArray,
    expected: FloatArray,
    off: FloatArray,
    name: str,
    changes: Callable[[Indices], dict[str, Any]],
    stands: Callable[[float, float, int], Pairs],
) -> list[Difference]:
    """A difference for all granules that are off by the same, of the one that is off the most."""
    made = []
    for alike in groups(off):
        k = int(alike[np.argmax(np.abs(off[alike]))])
        made.append(
            Difference(
                measured[k], expected[k], f"{name} of {names(alike, measured.size, 'granule', 1)}",
                relative=off[k], changes=changes(alike), stands=stands(measured[k], expected[k], k),
            )
        )  # fmt: skip
    return made or [same(measured[0], expected[0])]


def _with_units(case: Case, one: Difference) -> Difference:
    """A difference of radii with the line of the units, where all lengths are in other ones."""
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

    made = _alike(measured, expected, off, "radius", changes,
                  lambda old, new, _: [(2 * old / unit, 2 * new / unit), (old / unit, new / unit)],
                  )  # fmt: skip
    return [_with_units(case, one) for one in made]


def _mass(case: Case) -> list[Difference]:
    """Masses, where a wrong radius does not explain them."""
    measured, expected = _both(case.found.mass, case.scene.granules.mass)
    expected = np.where(np.isinf(expected), measured, expected)  # what nothing moves weighs nothing
    radius, of_scene = _both(case.found.radius, case.scene.granules.radius)
    fitting = expected * (radius / of_scene) ** 3
    off = np.where(np.abs(measured / fitting - 1) <= 1e-6, 0.0, measured / expected - 1)
    units = case.units

    def changes(alike: Indices) -> dict[str, Any]:
        return {"mass": changed(case.twin.mass, alike, measured[alike])}

    def stands(old: float, new: float, k: int) -> Pairs:
        volume = 4 / 3 * math.pi * float(of_scene[k]) ** 3 * units.density
        early = old / units.mass / (math.pi / 6)  # LAMMPS makes granules with a diameter of 1
        right = new / volume
        return [(early, right), (old / volume, right), (old / units.mass, new / units.mass)]

    return _alike(measured, expected, off, "mass", changes, stands)


def _distance(case: Case) -> Difference | list[Difference]:
    """Gaps and overlaps at the start, by the distance of neighbours."""
    position, of_scene = _both(case.found.position, case.scene.granules.position)
    expected, measured = np.diff(of_scene), np.diff(position)
    if measured.size == 0:
        return []
    off, deep = measured - expected, case.near[: measured.size]
    rounding = 8 * np.finfo(np.float64).eps * float(np.max(np.abs(position)))
    k = int(np.argmax(np.abs(off)))
    opening = np.array(case.twin.opening)
    opening[: measured.size] += off
    alike = np.flatnonzero(np.abs(off) >= max(0.5 * float(np.abs(off[k])), rounding))
    name = f"distance of granules at {names(alike, measured.size, 'contact', 2)}"
    gap, unit = opening[k], case.units.length
    kind = f"a gap of {gap:.3g} m" if gap > 0 else f"an overlap of {-gap:.3g} m"
    first = int(alike[0]) + 1 if alike.size else 0
    stands = [(measured[k] / unit, expected[k] / unit),
              (abs(float(position[first])) / unit, float(of_scene[first]) / unit)]  # fmt: skip
    run, settled = None, ""
    if case.found.before > 0:  # no text has the places
        stands, settled = [], " after the runs before the shock"
        run = max(k for k in commands_of(case.found, "run") if k < case.found.first_run)
    return Difference(
        measured[k], expected[k], name, relative=0.0, changes={"opening": opening}, at=run,
        sentence=f"{name}{settled} {values(measured[k], expected[k], 'm')}: {kind} in contact"
        f" {k + 2}, which the shock presses by {deep[k]:.2g} m",
        stands=stands,
        differs=bool(np.any(np.abs(off) > _PLACES * deep + rounding)),
    )  # fmt: skip


def _wall_place(case: Case) -> Difference | list[Difference]:
    wall, scene = far_wall(case.found), case.scene
    if scene.wall is None or wall is None or case.found.position.size != scene.chain.granules:
        return []
    last = float(scene.granules.position[-1])
    expected = float(scene.granules.radius[-1] + case.twin.opening[-1])
    measured = wall.position - float(case.found.position[-1])
    rounding = 8 * np.finfo(np.float64).eps * last
    opening = changed(case.twin.opening, -1, case.twin.opening[-1] + measured - expected)
    stands = []
    if case.found.axis in "xyz":
        plane, further = wall_plane(case), (measured - expected) / case.units.length
        stands = [(plane + float(case.found.direction.sum()) * further, plane)]
    return Difference(
        measured, expected, relative=0.0, at=wall.command, stands=stands,
        changes={"opening": opening},
        differs=bool(abs(measured - expected) > _PLACES * float(case.near[-1]) + rounding),
        sentence=f"the wall {values(measured, expected, 'm')} from the centre of the last granule",
    )  # fmt: skip


def _tilt(case: Case, sideways: float) -> float:
    """What granules off the axis cost a peak: the overlap of a contact that tilts by s / 2R."""
    radius = float(np.min(case.scene.granules.radius))
    return 1.5 * sideways**2 / (4 * radius) / float(np.max(case.near))


def _off_axis(case: Case) -> Difference:
    each = np.max(np.abs(case.found.sideways - case.found.sideways[0]), axis=1)
    k = int(np.argmax(each))
    off, radius = float(each[k]), float(case.scene.granules.radius[0])
    return Difference(
        off, 0.0, relative=0.0, effect=_tilt(case, off),
        sentence=f"granule {k + 1} is {off:.3g} m off the axis of the chain, the scene is straight",
        reason="a contact that tilts by s / 2R loses s^2 / 4R of its overlap",
        stands=[(off / case.units.length, 0.0)], differs=off > ROUND_OFF * radius,
    )  # fmt: skip


def _velocity(case: Case) -> Difference:
    """Velocities at the start: those of a striker, else none."""
    measured, expected = _both(case.found.velocity[:, 0], case.twin.velocity)
    off = measured - expected
    if case.scene.piston is not None:  # a fix leads it
        off[0] = 0.0
    k = int(np.argmax(np.abs(off)))
    unit, alone = case.units.velocity, np.count_nonzero(np.abs(off) > 0) == 1
    who = f"granule {k + 1}" if alone else f"granules, largest at granule {k + 1},"
    return Difference(
        measured[k], expected[k], f"velocity of granule {k + 1} at the start",
        relative=off[k] / expected[k] if expected[k] != 0 else None,
        changes={"velocity": np.append(measured, case.twin.velocity[measured.size :])},
        sentence=f"velocity of {who} at the start {values(measured[k], expected[k], 'm/s')}",
        stands=[(abs(measured[k]) / unit, abs(expected[k]) / unit)],
        differs=abs(off[k]) > ROUND_OFF * case.scene.units.velocity,
    )  # fmt: skip


def _velocity_across(case: Case) -> Difference:
    side = float(np.max(np.abs(case.found.velocity[:, 1:]), initial=0.0))
    radius = float(np.min(case.scene.granules.radius))
    return Difference(
        side, 0.0, effect=_tilt(case, min(side * case.found.end_time, radius)),
        sentence=f"granules move across the chain with {side:.3g} m/s, the scene has no such"
        " velocity", stands=[(side / case.units.velocity, 0.0)],
        differs=side > ROUND_OFF * case.scene.units.velocity,
    )  # fmt: skip


def _spin(case: Case) -> Difference:
    spin = float(np.max(np.abs(case.found.spin), initial=0.0))
    surface = spin * float(np.max(case.scene.granules.radius))
    return Difference(
        spin, 0.0, effect=case.whole_effect, stands=[(spin * case.units.time, 0.0)],
        sentence=f"granules spin with {spin:.3g} 1/s at the start, the scene has no spin",
        differs=surface > ROUND_OFF * case.scene.units.velocity,
    )  # fmt: skip


_NO_VELOCITY = "a striker alone moves at the start"

GRANULES = (
    Number("number of granules", "", "granules", _count, "counts must be equal",
           explains=True),
    Number("radius", "m", "radius", _radius),
    Number("mass", "kg", "mass", _mass),
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
