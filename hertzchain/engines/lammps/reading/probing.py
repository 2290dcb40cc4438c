"""Queries LAMMPS for every number of the chain that a user's deck has made, before it runs."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.reading.deck import FoundWall, IntArray, Units, units_of
from hertzchain.engines.lammps.reading.session import DeckFix, Readings, Session
from hertzchain.engines.lammps.reading.text import command_of
from hertzchain.errors import RunFailed
from hertzchain.scene.scene import Scene


@dataclass(frozen=True, eq=False)
class Granules:
    """Granules by increasing coordinate along the chain, in the deck's units.

    ``order`` sorts arrays from the order of ids into this order. Vectors have the component
    along the chain first, shape (granules, 3): ``axes`` has the numbers of the components, 0 for x.
    """

    units: Units
    axes: NDArray[np.intp]
    order: NDArray[np.intp]
    ids: IntArray  # in the order of ids, as readings have them
    types: IntArray
    position: FloatArray
    velocity: FloatArray
    spin: FloatArray
    radius: FloatArray
    mass: FloatArray
    low: FloatArray  # the box in these directions
    high: FloatArray
    boundary: list[str]  # in these directions, as ``s`` or ``fs``

    @property
    def count(self) -> int:
        """Number of granules."""
        return int(self.radius.size)

    @property
    def reach(self) -> FloatArray:
        """Sum of the radii of each contact, shape (contacts,)."""
        return np.asarray(self.radius[:-1] + self.radius[1:])

    def along(self, vectors: FloatArray) -> FloatArray:
        """Vectors of granules by id, shape (..., granules, 3), in this order and these axes."""
        return np.asarray(vectors[..., self.order, :][..., self.axes])

    def by_id(self, vectors: FloatArray) -> FloatArray:
        """Vectors of granules in this order and these axes, (granules, 3), by id and x, y, z."""
        each = np.empty_like(vectors)
        each[np.ix_(self.order, self.axes)] = vectors
        return each

    @property
    def off_axis(self) -> FloatArray:
        """Distance of each granule from the axis, which runs through the middle of all [length]."""
        across = self.position[:, 1:]
        return np.asarray(np.linalg.norm(across - np.median(across, axis=0), axis=1))

    @property
    def is_chain(self) -> bool:
        """Whether at most a quarter of the granules lie off one axis; these count as misplaced."""
        return 4 * int(np.count_nonzero(self.off_axis > self.radius)) <= self.count

    def moved_from(self, place: FloatArray) -> FloatArray:
        """Coordinates, shape (..., granules, 3), nearest to the start across a periodic box."""
        span = self.high - self.low
        turns = np.round((place - self.position) / span) * span
        return np.asarray(np.where([sides == "p" for sides in self.boundary], place - turns, place))


_STATE = (
    "id", "type", "x", "y", "z", "vx", "vy", "vz", "omegax", "omegay", "omegaz", "radius", "mass",
)  # fmt: skip


def granules_of(lammps: Session) -> Granules:
    """Return the granules that LAMMPS has now; RunFailed if it has none, or point particles."""
    name, sides = lammps.system()
    units = units_of(name)
    if lammps.count() == 0:
        raise RunFailed("the deck has made no granules when it runs for the first time")
    ids, types, *vectors, radius, mass = lammps.dumped(*_STATE)
    place, velocity, spin = (np.column_stack(vectors[k : k + 3]) for k in (0, 3, 6))
    low, high = lammps.box()
    along = int(np.argmax(np.ptp(place, axis=0)))
    axes = np.array([along, *(k for k in range(3) if k != along)])
    order = np.argsort(place[:, along], kind="stable")
    cells = np.ix_(order, axes)
    return Granules(
        units, axes, order, ids.astype(np.int64), types.astype(np.int64)[order], place[cells],
        velocity[cells], spin[cells], radius[order], mass[order], low[axes], high[axes],
        [sides[k] for k in axes],
    )  # fmt: skip


def by_fix(
    lammps: Session, readings: Readings, granules: Granules
) -> Iterator[tuple[DeckFix, FloatArray]]:
    """Force of each fix, in the order and along the axes of the chain, (readings, granules, 3)."""
    forces = np.moveaxis(readings.of_fixes, 1, 0)
    for source, force in zip([*lammps.hooks.values()][1:], forces, strict=True):
        assert source is not None
        yield lammps.fixes[source], granules.along(force)


def members(lammps: Session, group: str, granules: Granules) -> NDArray[np.bool_]:
    """Tell which granules are in a group now, by increasing coordinate, shape (granules,)."""
    return np.asarray(lammps.members(group)[granules.order])


_READINGS = 2000
"""Readings of the applied force while the shock lasts: a force that is held over more of them is
detected, and a line between two is right to 1e-6 of a pulse."""


DEPTHS = (-0.1, 0.01, 0.1, 0.3, 1.0, 3.0)
"""Overlaps that are tried, over that of the scene's natural unit of length.

Chosen: peaks are between 0.01 and 5 of the largest applied force, so that overlaps are up to 3; the
first is a gap."""

DAMPED = (
    (1.0, 0.5), (1.0, -0.5), (0.1, 0.5), (0.1, -0.5), (1.0, 0.05), (1.0, -0.05), (0.01, -1.0),
)  # fmt: skip
"""Overlaps, as above, and closing speeds over the scene's natural unit of velocity.

In the last, granules part so fast that any damping pulls unless it is limited."""

AT_REST = [DEPTHS.index(depth) for depth, _ in DAMPED]
"""The overlap of each of these among those tried at rest."""

QUIET = 1e-7
"""Smallest force that is not round-off, as a part of a contact force; or gap, of an overlap.

Chosen: coordinates of 1e-16 of a long chain change forces at the smallest overlap by 1e-9."""

_SPIN_STEP = 0.05
"""Time step over the contact time, to build up history-dependent friction: chosen, short."""


@dataclass(frozen=True)
class Sizes:
    """Expected sizes of a chain, which set where it is probed; they are not used to judge it.

    Without a scene they follow from the deck's own contacts, as Hertz's law has no length scale.
    """

    overlap: float = 1e-3  # of contacts [smallest radius]; of steel in centimetres under 100 N
    contact_time: float | None = None  # natural unit [s]; None: from the contacts, or the step
    shock_time: float | None = None  # that forces are applied [s]; None: as the contact time
    wall_gap: float = 0.0  # in front of a wall [m]

    @classmethod
    def of(cls, scene: Scene) -> Self:
        """The sizes of a scene."""
        return cls(
            overlap=scene.units.length / float(np.min(scene.granules.radius)),
            contact_time=scene.contact_time,
            shock_time=scene.pulse_end if scene.pulse_end > 0 else scene.end_time,
            wall_gap=0.0 if scene.wall is None else scene.wall.gap,
        )

    def without_contacts(self, units: Units, dt: float) -> float:
        """The contact time, in the deck's unit, where no contact of the deck gives it."""
        # Time steps of a deck in a contact time, where that is unknown (chosen)
        return 50 * dt if self.contact_time is None else self.contact_time / units.time

    def between(self, units: Units, contact_time: float) -> float:
        """Time between two readings of the applied force, in the deck's unit."""
        if self.shock_time is None or self.contact_time is None:
            # Duration of a shock in contact times, without a scene (chosen)
            return 20.0 * contact_time / _READINGS
        if units.name == "lj":
            return self.shock_time / _READINGS * contact_time / self.contact_time
        return self.shock_time / _READINGS / units.time


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

    @property
    def is_damped(self) -> bool:
        """Whether motion changes the force of any contact or wall; also if none was probed."""
        of_walls = ((np.append(np.nan, wall.force), wall.damped_force) for wall in self.walls)
        for force, damped in ((self.contact_force, self.damped_force), *of_walls):
            if np.any(np.abs(damped - force[AT_REST]) > QUIET * force[AT_REST]):
                return True
        return self.why_not is not None


def probe(lammps: Session, sizes: Sizes) -> Probes:
    """Query all numbers of the chain that LAMMPS has now, at overlaps of about these sizes."""
    granules = granules_of(lammps)
    integrated = np.zeros(granules.count, np.int64)
    for fix in [fix for fix in lammps.alive.values() if fix.moves]:
        integrated += members(lammps, fix.group, granules)
        lammps.give(command_of(("unfix", fix.name)))
    unit = sizes.overlap * float(np.min(granules.radius))
    contacts, each = granules.count - 1, np.full(granules.count, np.nan)
    pressed, damped = (np.full((rows, contacts), np.nan) for rows in (len(DEPTHS), len(DAMPED)))
    nothing = Probes(
        granules, sizes.without_contacts(granules.units, lammps.dt()), pressed, pressed,
        damped, damped, damped, each, each, (), integrated, _why_not(granules, unit),
    )  # fmt: skip
    if nothing.why_not is not None:
        return nothing
    try:
        return Prober(lammps, granules, unit).probes(nothing, sizes.wall_gap)
    except RunFailed as problem:  # for example too many neighbours, where radii are wrong
        return replace(nothing, why_not=str(problem))


def _why_not(granules: Granules, unit: float) -> str | None:
    """Return why contacts cannot be probed at overlaps of a unit; None if they can."""
    if np.any(granules.off_axis > granules.radius):
        return "they do not lie in one row"
    shrinks = granules.boundary[0][-1] in "sm"
    for turn, depth in itertools.product((0, 1), DEPTHS):
        outside = _row(granules, turn, depth * unit)[-1, 0] >= granules.high[0] and not shrinks
        if outside and granules.boundary[0] != "p":
            return "the box has no room for a row in which they touch"
    return None


def _row(granules: Granules, turn: int, depth: float) -> FloatArray:
    """Return places on the axis: every other contact has this overlap, the others this gap."""
    opened = np.full(granules.count - 1, -abs(depth))
    opened[turn::2] = depth
    place = np.zeros((granules.count, 3))
    place[1:, 0] = np.cumsum(granules.reach - opened)
    place[:, 0] += granules.position[0, 0]
    place[:, 1:] = np.median(granules.position[:, 1:], axis=0)
    return place


class Prober:
    """Moves granules to given places and reads the forces on them there.

    Overlaps are about a ``unit``.
    """

    def __init__(self, lammps: Session, granules: Granules, unit: float) -> None:
        self.lammps, self.granules, self.unit = lammps, granules, unit

    def probes(self, nothing: Probes, wall_gap: float) -> Probes:
        """Return all answers in place of those that are missing."""
        granules, unit = self.granules, self.unit
        turns = [turn for turn in (0, 1) if granules.count > 1 + turn]
        overlap, force = nothing.overlap.copy(), nothing.contact_force.copy()
        for turn in turns:
            for k, depth in enumerate(DEPTHS):
                overlap[k, turn::2], force[k, turn::2] = self._pressed(turn, depth * unit, 0.0)
        fastest = self._contact_time(overlap[-1], force[-1])
        time = fastest if math.isfinite(fastest) else nothing.contact_time
        drag, walls = self._drag(unit / time), self._walls(wall_gap / granules.units.length, time)
        closing, damped_overlap, damped = (nothing.damped_force.copy() for _ in range(3))
        for turn in turns:
            for k, (depth, fraction) in enumerate(DAMPED):
                closing[k, turn::2] = speed = fraction * unit / time
                both = self._pressed(turn, depth * unit, speed)
                damped_overlap[k, turn::2], damped[k, turn::2] = both
        frictions = [np.zeros(granules.count), *(self._friction(turn, time) for turn in turns)]
        return Probes(
            granules, time, overlap, force, closing, damped_overlap, damped,
            np.max(frictions, axis=0), drag, walls, nothing.integrated,
        )  # fmt: skip

    def ask(
        self, place: FloatArray, velocity: FloatArray, spin: FloatArray, steps: int = 0
    ) -> tuple[Readings, FloatArray]:
        """Return forces on granules at places, with velocities and spins, shape (granules, 3) each.

        All are in the order and along the axes of the chain. Also returns the places as LAMMPS has
        them.
        """
        state = {"x": place, "v": velocity, "omega": spin}
        self.lammps.put({name: self.granules.by_id(values) for name, values in state.items()})
        taken: list[Readings] = []
        self.lammps.run(f"run {steps} post no", steps, max(steps, 1), taken.append)
        where = self.granules.moved_from(self.granules.along(taken[-1].position[-1]))
        return taken[-1], where

    def of_fixes(self, readings: Readings, walls: bool) -> FloatArray:
        """Forces of all fixes that are walls, or of all other fixes, shape (granules, 3)."""
        total = np.zeros((self.granules.count, 3))
        for fix, force in by_fix(self.lammps, readings, self.granules):
            if fix.is_wall == walls:
                total += force[-1]
        return total

    def _pressed(self, turn: int, depth: float, speed: float) -> tuple[FloatArray, FloatArray]:
        """Overlaps of every other contact and the forces there, with a closing speed."""
        granules = self.granules
        velocity = np.zeros((granules.count, 3))
        velocity[turn : granules.count - (granules.count - turn) % 2 : 2, 0] = speed / 2
        velocity[turn + 1 :: 2, 0] = -speed / 2
        readings, where = self.ask(_row(granules, turn, depth), velocity, 0 * velocity)
        overlap = granules.reach - np.diff(where[:, 0])
        # The force on the granule behind each contact, which has no other contact.
        force = granules.along(readings.of_pairs[-1])[turn + 1 :: 2, 0]
        return overlap[turn::2], force

    def _contact_time(self, overlap: FloatArray, force: FloatArray) -> float:
        """The natural unit of time of the fastest contact at an overlap; infinite without."""
        mass = self.granules.mass
        reduced = mass[:-1] * mass[1:] / (mass[:-1] + mass[1:])
        with np.errstate(divide="ignore", invalid="ignore"):
            times = np.sqrt(reduced * overlap / force)
        return float(np.min(times[np.isfinite(times) & (times > 0)], initial=np.inf))

    def _friction(self, turn: int, time: float) -> FloatArray:
        """Force off the axis, or torque over radius, with spins and sideways velocities."""
        granules, depth = self.granules, self.unit
        number = np.arange(granules.count)
        # About any axis neighbours have neither equal nor opposite spins.
        speed = depth / time * np.array([1 + 0.5 * np.cos(number + k) for k in range(3)]).T
        sideways = speed * np.array([0.0, 1.0, 1.0])
        self.lammps.give(f"timestep {_SPIN_STEP * time!r}")
        spin = speed / granules.radius[:, np.newaxis]
        readings, _ = self.ask(_row(granules, turn, depth), sideways, spin, steps=2)
        off = np.max(np.abs(granules.along(readings.of_pairs[-1])[:, 1:]), axis=1)
        torque = np.max(np.abs(granules.along(readings.torque[-1])), axis=1) / granules.radius
        return np.asarray(np.maximum(off, torque))

    def _drag(self, speed: float) -> FloatArray:
        """Force of all fixes except walls against a motion along the chain, over its velocity."""
        rest = np.zeros((self.granules.count, 3))
        moving = rest + np.array([speed, 0.0, 0.0])
        at_rest, in_motion = (
            self.of_fixes(self.ask(self.granules.position, velocity, rest)[0], walls=False)
            for velocity in (rest, moving)
        )
        return np.asarray((at_rest - in_motion)[:, 0] / speed)

    def _walls(self, gap: float, time: float) -> tuple[FoundWall, ...]:
        """The walls across the chain, by pushing the granule at each end outwards.

        A wall is expected behind ``gap``, and searched within twice that distance.
        """
        if not any(fix.is_wall for fix in self.lammps.alive.values()):
            return ()
        walls = [_Wall(self, at_end).measured(gap, time) for at_end in (False, True)]
        return tuple(wall for wall in walls if wall is not None)


class _Wall:
    """Pushes the granule at one end of the chain outwards."""

    def __init__(self, prober: Prober, at_end: bool) -> None:
        self._prober, self._at_end, self._unit = prober, at_end, prober.unit
        self._number = prober.granules.count - 1 if at_end else 0
        self._sign = 1.0 if at_end else -1.0
        self._start = float(prober.granules.position[self._number, 0])
        self._radius = float(prober.granules.radius[self._number])

    def _ask(
        self, place: float, speed: float = 0.0, slip: float = 0.0, steps: int = 0
    ) -> tuple[float, float, FloatArray, Readings]:
        """Place as LAMMPS has it, force of walls against the push, the whole force, readings."""
        where = self._prober.granules.position.copy()
        where[self._number, 0] = place
        velocity, spin = np.zeros_like(where), np.zeros_like(where)
        velocity[self._number] = self._sign * speed, slip, slip
        spin[self._number] = np.array([0.9, 1.0, 1.1]) * slip / self._radius
        readings, placed = self._prober.ask(where, velocity, spin, steps)
        force = self._prober.of_fixes(readings, walls=True)[self._number]
        return float(placed[self._number, 0]), float(-self._sign * force[0]), force, readings

    def _limit(self, gap: float) -> float:
        """Largest displacement of the granule outwards [length]: twice the gap, plus a radius."""
        granules = self._prober.granules
        farthest = self._radius + 2 * gap
        if granules.boundary[0][-1 if self._at_end else 0] in "sm":
            return farthest  # the box follows
        box = granules.high[0] - self._start if self._at_end else self._start - granules.low[0]
        return min(farthest, 0.999 * float(box)) if box > 0 else 0.0

    def measured(self, gap: float, time: float) -> FoundWall | None:
        """The wall, or None if the granule meets none."""
        onset = self._onset(self._limit(gap), gap - self._radius)
        if onset is None:
            return None
        room = abs(self._limit(gap) - self._sign * (onset - self._start))
        unit = self._unit * (min(1.0, room / (max(DEPTHS) * self._unit)) if room > 0 else 1.0)
        tries = [self._ask(onset + self._sign * depth * unit) for depth in DEPTHS[1:]]
        closing = [fraction * unit / time for _, fraction in DAMPED]
        damped = [
            self._ask(onset + self._sign * depth * unit, speed)
            for (depth, _), speed in zip(DAMPED, closing, strict=True)
        ]
        self._prober.lammps.give(f"timestep {_SPIN_STEP * time!r}")
        off = self._ask(onset + self._sign * unit, 0.0, unit / time, steps=2)[2]
        deep, push = ([*column] for column in list(zip(*tries, strict=True))[:2])
        deeper, damping = ([*column] for column in list(zip(*damped, strict=True))[:2])
        return FoundWall(
            "last" if self._at_end else "first", onset + self._sign * self._radius,
            self._sign * (np.array(deep) - onset), np.array(push), np.array(closing),
            self._sign * (np.array(deeper) - onset), np.array(damping),
            float(np.max(np.abs(off[1:]))), self._command(onset + self._sign * unit),
        )  # fmt: skip

    def _onset(self, limit: float, ahead: float) -> float | None:
        """Place of the granule at which the wall begins to push it.

        The search begins at the start, or at ``ahead`` of it if there is no wall before.
        """
        inner, outer = self._start, None
        if self._pushed(inner):
            outer, step = inner, self._unit
            while self._pushed(inner):
                inner -= self._sign * step
                step *= 2
                if abs(inner - self._start) > self._radius:
                    return None
        else:
            step, gone = min(self._unit, 0.05 * self._radius), 0.0
            if 0 < ahead < limit and not self._pushed(self._start + self._sign * ahead):
                gone = ahead
            while outer is None and gone < limit:
                inner = self._start + self._sign * gone
                gone, step = min(gone + step, limit), min(2 * step, 0.5 * self._radius)
                place = self._start + self._sign * gone
                outer = place if self._pushed(place) else None
        if outer is None:
            return None
        # To the last digit of the coordinate.
        for _ in range(64):
            middle = inner + (outer - inner) / 2
            if middle in (inner, outer):
                break
            inner, outer = (inner, middle) if self._pushed(middle) else (middle, outer)
        return inner

    def _pushed(self, place: float) -> bool:
        return self._ask(place)[1] > 0

    def _command(self, place: float) -> int:
        """Return the command of the fix with the largest force there."""
        readings, prober = self._ask(place)[3], self._prober
        pushes = {
            fix.command: abs(force[-1, self._number, 0])
            for fix, force in by_fix(prober.lammps, readings, prober.granules)
            if fix.is_wall
        }
        return max(pushes, key=pushes.__getitem__)
