"""Asks LAMMPS for every number of a chain that somebody's deck has made, before it runs.

Granules are put where the answer is that of one contact, one wall or one fix, and forces are read
without a step. Nothing is put back: the instance is not used afterwards.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.user_deck.found import IntArray
from hertzchain.engines.lammps.user_deck.granules import Granules, granules_of
from hertzchain.engines.lammps.user_deck.hooks import Readings
from hertzchain.engines.lammps.user_deck.player import Stage
from hertzchain.engines.lammps.user_deck.session import Session
from hertzchain.errors import RunFailed
from hertzchain.scene.scene import Scene

DEPTHS = (-0.1, 0.01, 0.1, 0.3, 1.0, 3.0)
"""Overlaps that are tried, over that of the scene's natural unit of length.

Chosen: peaks are between 0.01 and 5 of the largest applied force, so that overlaps are up to 3; the
first is a gap."""

_DAMPED = (
    (1.0, 0.5), (1.0, -0.5), (0.1, 0.5), (0.1, -0.5), (1.0, 0.05), (1.0, -0.05), (0.01, -1.0),
)  # fmt: skip
"""Overlaps, as above, and closing speeds over the scene's natural unit of velocity.

In the last, granules part so fast that any damping pulls, unless it is limited."""

_SPIN_STEP = 0.05
"""Step with which friction gets a memory, over the contact time: chosen, short."""


@dataclass(frozen=True, eq=False)
class WallProbe:
    """A wall as the granule at an end feels it, in the deck's units; see ``FoundWall``."""

    at_end: bool  # at the largest coordinate
    position: float
    overlap: FloatArray
    force: FloatArray
    closing: FloatArray
    damped_overlap: FloatArray
    damped_force: FloatArray
    tangential_force: float
    command: int


@dataclass(frozen=True, eq=False)
class Probes:
    """What LAMMPS answered, in the deck's units and by increasing coordinate; see ``FoundDeck``."""

    granules: Granules
    contact_time: float  # of the fastest contact, at the overlap that is expected
    overlap: FloatArray
    contact_force: FloatArray
    closing: FloatArray
    damped_overlap: FloatArray
    damped_force: FloatArray
    tangential_force: FloatArray
    drag: FloatArray
    walls: tuple[WallProbe, ...]
    integrated: IntArray


def mirrored_probes(probes: Probes) -> Probes:
    """What was found of contacts, from the other end."""
    names = "overlap", "contact_force", "closing", "damped_overlap", "damped_force"
    return replace(probes, **{name: np.flip(getattr(probes, name), -1) for name in names})


class Prober:
    """Puts granules somewhere and reads what acts on them then."""

    def __init__(self, stage: Stage) -> None:
        self.stage, self.lammps = stage, stage.lammps
        self.granules = granules_of(stage.lammps, stage.boundary)

    def ask(
        self, place: FloatArray, velocity: FloatArray, spin: FloatArray, steps: int = 0
    ) -> tuple[Readings, FloatArray]:
        """Forces on granules at places, with velocities and spins, shape (granules, 3) each.

        All in the order and along the axes of the chain. Also the places as LAMMPS has them.
        """
        self.lammps.put(
            {
                name: self.granules.by_id(values)
                for name, values in (("x", place), ("v", velocity), ("omega", spin))
            }
        )
        found: list[Readings] = []
        self.stage.hooks.run(f"run {steps} post no", steps, max(steps, 1), found.append)
        seen = found[-1]
        where = self.granules.moved_from(self.granules.along(seen.position[-1]))
        return seen, where

    def of_pairs(self, seen: Readings) -> FloatArray:
        """Forces of contacts, shape (granules, 3)."""
        return self.granules.along(seen.of_pairs[-1])

    def of_fixes(self, seen: Readings, walls: bool) -> FloatArray:
        """Forces of all fixes that are walls, or of all others, shape (granules, 3)."""
        fixes = self.stage.fixes
        total = np.zeros((self.granules.count, 3))
        for source, force in zip(self.stage.hooks.sources[1:], seen.of_fixes[-1], strict=True):
            assert source is not None
            if fixes[source].is_wall == walls:
                total += self.granules.along(force)
        return total


def probe(stage: Stage, scene: Scene) -> Probes:
    """Ask LAMMPS for all numbers of the chain that it has now."""
    stage.ready()
    prober = Prober(stage)
    granules = prober.granules
    integrated = _integrated(stage, granules)
    for fix in list(stage.alive.values()):
        if fix.moves:
            stage.lammps.give(f"unfix {fix.name}")
    unit = scene.units.length / _smallest(scene.granules.radius) * _smallest(granules.radius)
    turns = [turn for turn in (0, 1) if granules.count > 1 + turn]
    shape = (len(DEPTHS), granules.count - 1)
    overlap, force = np.full(shape, np.nan), np.full(shape, np.nan)
    for turn in turns:
        for k, depth in enumerate(DEPTHS):
            overlap[k, turn::2], force[k, turn::2] = _pressed(prober, turn, depth * unit, 0.0)
    time = _contact_time(granules, overlap, force, scene)
    shape = (len(_DAMPED), granules.count - 1)
    closing, damped_overlap, damped = (np.full(shape, np.nan) for _ in range(3))
    tangential = np.zeros(granules.count)
    drag = _drag(prober, unit / time)
    walls = _walls(prober, scene, unit, time)
    for turn in turns:
        for k, (depth, fraction) in enumerate(_DAMPED):
            closing[k, turn::2] = speed = fraction * unit / time
            found = _pressed(prober, turn, depth * unit, speed)
            damped_overlap[k, turn::2], damped[k, turn::2] = found
    for turn in turns:
        tangential = np.maximum(tangential, _friction(prober, turn, unit, time))
    return Probes(
        granules=granules,
        contact_time=time,
        overlap=overlap,
        contact_force=force,
        closing=closing,
        damped_overlap=damped_overlap,
        damped_force=damped,
        tangential_force=tangential,
        drag=drag,
        walls=walls,
        integrated=integrated,
    )


def _smallest(values: FloatArray) -> float:
    return float(np.min(values))


def members(lammps: Session, group: str, granules: Granules) -> NDArray[np.bool_]:
    """Which granules are in a group now, by increasing coordinate, shape (granules,)."""
    return np.asarray(lammps.members(group)[granules.order])


def _integrated(stage: Stage, granules: Granules) -> IntArray:
    """How many fixes move each granule, shape (granules,)."""
    count = np.zeros(granules.count, np.int64)
    for fix in stage.alive.values():
        if fix.moves:
            count += members(stage.lammps, fix.group, granules)
    return count


def _row(granules: Granules, turn: int, depth: float) -> FloatArray:
    """Places on the axis where every other contact has a depth, and the others are as far apart."""
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
    # Of the granule behind each contact, which touches nothing else.
    return overlap[turn::2], prober.of_pairs(seen)[turn + 1 :: 2, 0]


def _contact_time(
    granules: Granules, overlap: FloatArray, force: FloatArray, scene: Scene
) -> float:
    """The natural unit of time of the fastest contact at the largest overlap, in deck's units."""
    if granules.count > 1:
        mass = granules.mass[:-1] * granules.mass[1:] / (granules.mass[:-1] + granules.mass[1:])
        largest = overlap[-1], force[-1]
        with np.errstate(divide="ignore", invalid="ignore"):
            times = np.sqrt(mass * largest[0] / largest[1])
        good = times[np.isfinite(times) & (times > 0)]
        if good.size:
            return float(np.min(good))
    return scene.contact_time / granules.units.time


def _friction(prober: Prober, turn: int, depth: float, time: float) -> FloatArray:
    """Force off the axis, or torque over radius, with spins and sideways velocities."""
    granules = prober.granules
    number = np.arange(granules.count)
    # Neither alike nor opposite from one granule to the next, about any axis.
    speed = depth / time * np.array([1 + 0.5 * np.cos(number + k) for k in range(3)]).T
    sideways = speed * np.array([0.0, 1.0, 1.0])
    prober.lammps.give(f"timestep {_SPIN_STEP * time!r}")
    spin = speed / granules.radius[:, np.newaxis]
    seen, _ = prober.ask(_row(granules, turn, depth), sideways, spin, steps=2)
    off = np.max(np.abs(prober.of_pairs(seen)[:, 1:]), axis=1)
    torque = np.max(np.abs(granules.along(seen.torque[-1])), axis=1) / granules.radius
    return np.asarray(np.maximum(off, torque))


def _drag(prober: Prober, speed: float) -> FloatArray:
    """Force of fixes but walls against a motion along the chain, over its velocity."""
    granules = prober.granules
    rest = np.zeros((granules.count, 3))
    moving = np.zeros_like(rest)
    moving[:, 0] = speed
    still, _ = prober.ask(granules.position, rest, rest)
    seen, _ = prober.ask(granules.position, moving, rest)
    change = prober.of_fixes(seen, walls=False) - prober.of_fixes(still, walls=False)
    return np.asarray(-change[:, 0] / speed)


def _walls(prober: Prober, scene: Scene, unit: float, time: float) -> tuple[WallProbe, ...]:
    """The walls across the chain, by pushing the granule at each end outwards."""
    stage = prober.stage
    if not any(fix.is_wall for fix in stage.alive.values()):
        return ()
    found = [_Wall(prober, at_end, unit).found(scene, time) for at_end in (False, True)]
    return tuple(wall for wall in found if wall is not None)


class _Wall:
    """Pushes the granule at one end of the chain outwards."""

    def __init__(self, prober: Prober, at_end: bool, unit: float) -> None:
        self._prober, self._at_end, self._unit = prober, at_end, unit
        self._number = prober.granules.count - 1 if at_end else 0
        self._sign = 1.0 if at_end else -1.0
        self._start = float(prober.granules.position[self._number, 0])
        self._radius = float(prober.granules.radius[self._number])

    def _ask(
        self, place: float, speed: float = 0.0, slip: float = 0.0, steps: int = 0
    ) -> tuple[float, float, FloatArray, Readings]:
        """Place as LAMMPS has it, force of walls against the push, the whole force, readings."""
        granules = self._prober.granules
        where = granules.position.copy()
        where[self._number, 0] = place
        velocity, spin = np.zeros_like(where), np.zeros_like(where)
        velocity[self._number] = self._sign * speed, slip, slip
        spin[self._number] = np.array([0.9, 1.0, 1.1]) * slip / self._radius
        seen, placed = self._prober.ask(where, velocity, spin, steps)
        force = self._prober.of_fixes(seen, walls=True)[self._number]
        return float(placed[self._number, 0]), float(-self._sign * force[0]), force, seen

    def _limit(self, scene: Scene) -> float:
        """How far outwards the granule may go [length]: the scene's gap and a radius."""
        granules = self._prober.granules
        gap = 0.0 if scene.wall is None else scene.wall.gap / granules.units.length
        farthest = self._radius + 2 * gap
        box = granules.high[0] - self._start if self._at_end else self._start - granules.low[0]
        return min(farthest, 0.999 * float(box)) if box > 0 else 0.0

    def found(self, scene: Scene, time: float) -> WallProbe | None:
        """The wall, or None if the granule meets none."""
        onset = self._onset(self._limit(scene))
        if onset is None:
            return None
        reach = onset + self._sign * self._radius
        deepest = max(DEPTHS) * self._unit
        room = abs(self._limit(scene) - self._sign * (onset - self._start))
        unit = self._unit * min(1.0, room / deepest) if room > 0 else self._unit
        tries = [self._ask(onset + self._sign * depth * unit) for depth in DEPTHS[1:]]
        damped = []
        for depth, fraction in _DAMPED:
            speed = fraction * unit / time
            damped.append((speed, *self._ask(onset + self._sign * depth * unit, speed)[:2]))
        self._prober.lammps.give(f"timestep {_SPIN_STEP * time!r}")
        off = self._ask(onset + self._sign * unit, 0.0, unit / time, steps=2)[2]
        return WallProbe(
            at_end=self._at_end,
            position=reach,
            overlap=np.array([self._sign * (place - onset) for place, *_ in tries]),
            force=np.array([force for _, force, *_ in tries]),
            closing=np.array([speed for speed, *_ in damped]),
            damped_overlap=np.array([self._sign * (place - onset) for _, place, _ in damped]),
            damped_force=np.array([force for *_, force in damped]),
            tangential_force=float(np.max(np.abs(off[1:]))),
            command=self._command(onset + self._sign * unit),
        )

    def _onset(self, limit: float) -> float | None:
        """Place of the granule at which the wall begins to push it."""
        outer: float | None = None
        inner = self._start
        if self._pushed(inner):
            outer, step = inner, self._unit
            while self._pushed(inner):
                inner -= self._sign * step
                step *= 2
                if abs(inner - self._start) > self._radius:
                    return None
        else:
            step = min(self._unit, 0.05 * self._radius)
            gone = 0.0
            while gone < limit:
                gone = min(gone + step, limit)
                step = min(2 * step, 0.05 * self._radius)
                if self._pushed(self._start + self._sign * gone):
                    outer = self._start + self._sign * gone
                    break
                inner = self._start + self._sign * gone
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
        """The command of the fix that pushes there most."""
        seen = self._ask(place)[3]
        fixes = self._prober.stage.fixes
        best, largest = -1, -math.inf
        sources = self._prober.stage.hooks.sources[1:]
        for source, force in zip(sources, seen.of_fixes[-1], strict=True):
            assert source is not None
            own = self._prober.granules.along(force)[self._number, 0]
            if fixes[source].is_wall and abs(own) > largest:
                best, largest = source, abs(own)
        if best < 0:
            raise RunFailed("the wall is gone while it is looked at")
        return best
