"""Puts granules somewhere and reads what acts on them, a wall as well; where, by their sizes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.reading.found import FoundWall
from hertzchain.engines.lammps.reading.granules import Granules, granules_of
from hertzchain.engines.lammps.reading.hooks import Readings
from hertzchain.engines.lammps.reading.session import DeckFix, Session, Stage
from hertzchain.engines.lammps.reading.units import Units
from hertzchain.scene.scene import Scene

_READINGS = 2000
"""Readings of the applied force while the shock lasts: a force that is held over more of them is
detected, and a line between two is right to 1e-6 of a pulse."""

_CONTACT_STEPS = 50  # of a deck's time steps in a contact time where neither is known (chosen)
_SHOCK = 20.0  # contact times that a shock lasts where no scene says how long (chosen)

DEPTHS = (-0.1, 0.01, 0.1, 0.3, 1.0, 3.0)
"""Overlaps that are tried, over that of the scene's natural unit of length.

Chosen: peaks are between 0.01 and 5 of the largest applied force, so that overlaps are up to 3; the
first is a gap."""

DAMPED = (
    (1.0, 0.5), (1.0, -0.5), (0.1, 0.5), (0.1, -0.5), (1.0, 0.05), (1.0, -0.05), (0.01, -1.0),
)  # fmt: skip
"""Overlaps, as above, and closing speeds over the scene's natural unit of velocity.

In the last, granules part so fast that any damping pulls, unless it is limited."""

SPIN_STEP = 0.05
"""Step with which friction gets a memory, over the contact time: chosen, short."""


@dataclass(frozen=True)
class Sizes:
    """Sizes that are expected of a chain; they say where it is probed, and judge nothing.

    Without a scene they are those of a deck's own contacts: Hertz's law has no size of its own.
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
        """The contact time, in the deck's unit, where no contact of the deck tells it."""
        return _CONTACT_STEPS * dt if self.contact_time is None else self.contact_time / units.time

    def between(self, units: Units, contact_time: float) -> float:
        """Time between two readings of the applied force, in the deck's unit."""
        if self.shock_time is None or self.contact_time is None:
            return _SHOCK * contact_time / _READINGS
        if units.name == "lj":
            return self.shock_time / _READINGS * contact_time / self.contact_time
        return self.shock_time / _READINGS / units.time


class Prober:
    """Puts granules somewhere and reads what acts on them then."""

    def __init__(self, stage: Stage) -> None:
        self.stage, self.lammps = stage, stage.lammps
        self.granules = granules_of(stage.lammps)

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
        total = np.zeros((self.granules.count, 3))
        for fix, force in by_fix(self.stage, seen, self.granules):
            if fix.is_wall == walls:
                total += force[-1]
        return total


def by_fix(
    stage: Stage, seen: Readings, granules: Granules
) -> Iterator[tuple[DeckFix, FloatArray]]:
    """What each fix of the deck adds, shape (readings, granules, 3), along the chain."""
    for source, force in zip(
        stage.hooks.sources[1:], np.moveaxis(seen.of_fixes, 1, 0), strict=True
    ):
        assert source is not None
        yield stage.fixes[source], granules.along(force)


def members(lammps: Session, group: str, granules: Granules) -> NDArray[np.bool_]:
    """Which granules are in a group now, by increasing coordinate, shape (granules,)."""
    return np.asarray(lammps.members(group)[granules.order])


# ---- Walls, by pushing the granules at the ends


def walls_of(prober: Prober, gap: float, unit: float, time: float) -> tuple[FoundWall, ...]:
    """The walls across the chain in the deck's units, by pushing the granule at each end outwards.

    They are expected behind a ``gap`` [m], and looked for up to twice that.
    """
    stage = prober.stage
    if not any(fix.is_wall for fix in stage.alive.values()):
        return ()
    gap /= prober.granules.units.length
    found = [_Wall(prober, at_end, unit).found(gap, time) for at_end in (False, True)]
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

    def _limit(self, gap: float) -> float:
        """How far outwards the granule may go [length]: twice the gap and a radius."""
        granules = self._prober.granules
        farthest = self._radius + 2 * gap
        first = int(np.argmax(np.abs(granules.frame[0])))
        if granules.boundary.split()[first][-1 if self._at_end else 0] in "sm":
            return farthest  # the box follows
        box = granules.high[0] - self._start if self._at_end else self._start - granules.low[0]
        return min(farthest, 0.999 * float(box)) if box > 0 else 0.0

    def found(self, gap: float, time: float) -> FoundWall | None:
        """The wall, or None if the granule meets none."""
        onset = self._onset(self._limit(gap), gap - self._radius)
        if onset is None:
            return None
        reach = onset + self._sign * self._radius
        deepest = max(DEPTHS) * self._unit
        room = abs(self._limit(gap) - self._sign * (onset - self._start))
        unit = self._unit * min(1.0, room / deepest) if room > 0 else self._unit
        tries = [self._ask(onset + self._sign * depth * unit) for depth in DEPTHS[1:]]
        damped = []
        for depth, fraction in DAMPED:
            speed = fraction * unit / time
            damped.append((speed, *self._ask(onset + self._sign * depth * unit, speed)[:2]))
        self._prober.lammps.give(f"timestep {SPIN_STEP * time!r}")
        off = self._ask(onset + self._sign * unit, 0.0, unit / time, steps=2)[2]
        return FoundWall(
            end="last" if self._at_end else "first",
            position=reach,
            overlap=np.array([self._sign * (place - onset) for place, *_ in tries]),
            force=np.array([force for _, force, *_ in tries]),
            closing=np.array([speed for speed, *_ in damped]),
            damped_overlap=np.array([self._sign * (place - onset) for _, place, _ in damped]),
            damped_force=np.array([force for *_, force in damped]),
            tangential_force=float(np.max(np.abs(off[1:]))),
            command=self._command(onset + self._sign * unit),
        )

    def _onset(self, limit: float, ahead: float) -> float | None:
        """Place of the granule at which the wall begins to push it.

        That is sought from the start on, or from ``ahead`` of it where no wall is before.
        """
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
            if 0 < ahead < limit and not self._pushed(self._start + self._sign * ahead):
                gone, inner = ahead, self._start + self._sign * ahead
            while gone < limit:
                gone = min(gone + step, limit)
                step = min(2 * step, 0.5 * self._radius)
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
        forces = by_fix(self._prober.stage, self._ask(place)[3], self._prober.granules)
        return max(
            (abs(force[-1, self._number, 0]), fix.command) for fix, force in forces if fix.is_wall
        )[1]
