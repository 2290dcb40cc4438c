"""Queries LAMMPS for every number of the chain that a user's deck has made, before it runs.

Granules are moved so that a single contact, wall or fix acts, and forces are read without a step.
Granules are not moved back: the instance is not used afterwards.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.reading.found import FoundWall, IntArray
from hertzchain.engines.lammps.reading.granules import Granules
from hertzchain.engines.lammps.reading.prober import (
    DAMPED,
    DEPTHS,
    SPIN_STEP,
    Prober,
    Sizes,
    members,
)
from hertzchain.engines.lammps.reading.session import Stage
from hertzchain.engines.lammps.reading.text import command_of
from hertzchain.engines.lammps.reading.walls import walls_of
from hertzchain.errors import RunFailed

NOT_IN_A_ROW = "they do not lie in one row"
NO_ROOM = "the box has no room for a row in which they touch"


@dataclass(frozen=True, eq=False)
class Probes:
    """The answers of LAMMPS, in the deck's units, by increasing coordinate: see ``FoundDeck``."""

    granules: Granules
    contact_time: float  # of the fastest contact, at the expected overlap
    overlap: FloatArray
    contact_force: FloatArray
    closing: FloatArray
    damped_overlap: FloatArray
    damped_force: FloatArray
    tangential_force: FloatArray
    drag: FloatArray
    walls: tuple[FoundWall, ...]
    integrated: IntArray
    why_not: str | None = None  # why only the granules were read


def probe(stage: Stage, sizes: Sizes) -> Probes:
    """Query all numbers of the chain that LAMMPS has now, at overlaps of about these sizes."""
    stage.ready()
    prober = Prober(stage)
    granules = prober.granules
    integrated = _integrated(stage, granules)
    for fix in list(stage.alive.values()):
        if fix.moves:
            stage.lammps.give(command_of(("unfix", fix.name)))
    unit = sizes.overlap * float(np.min(granules.radius))
    time = sizes.without_contacts(granules.units, stage.lammps.dt())
    contacts = granules.count - 1
    pressed, damped = (np.full((rows, contacts), np.nan) for rows in (len(DEPTHS), len(DAMPED)))
    each = np.full(granules.count, np.nan)
    nothing = Probes(
        granules=granules,
        contact_time=time,
        overlap=pressed,
        contact_force=pressed,
        closing=damped,
        damped_overlap=damped,
        damped_force=damped,
        tangential_force=each,
        drag=each,
        walls=(),
        integrated=integrated,
        why_not=_why_not(granules, unit),
    )
    if nothing.why_not is not None:
        return nothing
    try:
        return _asked(prober, sizes, unit, nothing)
    except RunFailed as problem:  # for example too many neighbours, where radii are wrong
        return replace(nothing, why_not=str(problem))


def _asked(prober: Prober, sizes: Sizes, unit: float, nothing: Probes) -> Probes:
    """Return the answers of LAMMPS with granules at overlaps of about a ``unit``."""
    granules = prober.granules
    turns = [turn for turn in (0, 1) if granules.count > 1 + turn]
    overlap, force = nothing.overlap.copy(), nothing.contact_force.copy()
    for turn in turns:
        for k, depth in enumerate(DEPTHS):
            overlap[k, turn::2], force[k, turn::2] = _pressed(prober, turn, depth * unit, 0.0)
    time = _contact_time(granules, overlap, force, nothing.contact_time)
    closing, damped_overlap, damped = (nothing.damped_force.copy() for _ in range(3))
    tangential = np.zeros(granules.count)
    drag = _drag(prober, unit / time)
    walls = walls_of(prober, sizes.wall_gap, unit, time)
    for turn in turns:
        for k, (depth, fraction) in enumerate(DAMPED):
            closing[k, turn::2] = speed = fraction * unit / time
            found = _pressed(prober, turn, depth * unit, speed)
            damped_overlap[k, turn::2], damped[k, turn::2] = found
    for turn in turns:
        tangential = np.maximum(tangential, _friction(prober, turn, unit, time))
    return replace(
        nothing,
        contact_time=time,
        overlap=overlap,
        contact_force=force,
        closing=closing,
        damped_overlap=damped_overlap,
        damped_force=damped,
        tangential_force=tangential,
        drag=drag,
        walls=walls,
    )


def _why_not(granules: Granules, unit: float) -> str | None:
    """Return why contacts cannot be probed at overlaps of a unit; None if they can."""
    if np.any(granules.off_axis > granules.radius):
        return NOT_IN_A_ROW
    first = int(np.argmax(np.abs(granules.frame[0])))
    for turn, depth in itertools.product((0, 1), DEPTHS):
        place = _row(granules, turn, depth * unit)[:, 0]
        shrinks = granules.boundary.split()[first][-1] in "sm"
        outside = place[-1] >= granules.high[0] and not shrinks
        if outside and not granules.periodic[0]:
            return NO_ROOM
    return None


def _integrated(stage: Stage, granules: Granules) -> IntArray:
    """Return how many fixes move each granule, shape (granules,)."""
    count = np.zeros(granules.count, np.int64)
    for fix in stage.alive.values():
        if fix.moves:
            count += members(stage.lammps, fix.group, granules)
    return count


def _row(granules: Granules, turn: int, depth: float) -> FloatArray:
    """Return places on the axis: every other contact has this overlap, the others this gap."""
    opened = np.full(granules.count - 1, -abs(depth))
    opened[turn::2] = depth
    place = np.zeros((granules.count, 3))
    place[1:, 0] = np.cumsum(granules.reach - opened)
    place[:, 0] += granules.position[0, 0]
    place[:, 1:] = np.median(granules.position[:, 1:], axis=0)
    return place


def _pressed(
    prober: Prober, turn: int, depth: float, speed: float
) -> tuple[FloatArray, FloatArray]:
    """Overlaps of every other contact and the forces there, with a closing speed."""
    granules = prober.granules
    velocity = np.zeros((granules.count, 3))
    velocity[turn : granules.count - (granules.count - turn) % 2 : 2, 0] = speed / 2
    velocity[turn + 1 :: 2, 0] = -speed / 2
    rest = np.zeros_like(velocity)
    seen, where = prober.ask(_row(granules, turn, depth), velocity, rest)
    overlap = granules.reach - np.diff(where[:, 0])
    # The force on the granule behind each contact, which has no other contact.
    return overlap[turn::2], prober.of_pairs(seen)[turn + 1 :: 2, 0]


def _contact_time(
    granules: Granules, overlap: FloatArray, force: FloatArray, expected: float
) -> float:
    """The natural unit of time of the fastest contact at the largest overlap, or the expected."""
    if granules.count > 1:
        mass = granules.mass[:-1] * granules.mass[1:] / (granules.mass[:-1] + granules.mass[1:])
        largest = overlap[-1], force[-1]
        with np.errstate(divide="ignore", invalid="ignore"):
            times = np.sqrt(mass * largest[0] / largest[1])
        good = times[np.isfinite(times) & (times > 0)]
        if good.size:
            return float(np.min(good))
    return expected


def _friction(prober: Prober, turn: int, depth: float, time: float) -> FloatArray:
    """Force off the axis, or torque over radius, with spins and sideways velocities."""
    granules = prober.granules
    number = np.arange(granules.count)
    # About any axis neighbours have neither equal nor opposite spins.
    speed = depth / time * np.array([1 + 0.5 * np.cos(number + k) for k in range(3)]).T
    sideways = speed * np.array([0.0, 1.0, 1.0])
    prober.lammps.give(f"timestep {SPIN_STEP * time!r}")
    spin = speed / granules.radius[:, np.newaxis]
    seen, _ = prober.ask(_row(granules, turn, depth), sideways, spin, steps=2)
    off = np.max(np.abs(prober.of_pairs(seen)[:, 1:]), axis=1)
    torque = np.max(np.abs(granules.along(seen.torque[-1])), axis=1) / granules.radius
    return np.asarray(np.maximum(off, torque))


def _drag(prober: Prober, speed: float) -> FloatArray:
    """Force of all fixes except walls against a motion along the chain, over its velocity."""
    granules = prober.granules
    rest = np.zeros((granules.count, 3))
    moving = np.zeros_like(rest)
    moving[:, 0] = speed
    still, _ = prober.ask(granules.position, rest, rest)
    seen, _ = prober.ask(granules.position, moving, rest)
    change = prober.of_fixes(seen, walls=False) - prober.of_fixes(still, walls=False)
    return np.asarray(-change[:, 0] / speed)
