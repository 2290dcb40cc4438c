"""The walls across the chain of a user's deck, found by pushing the granules at its ends."""

from __future__ import annotations

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.reading.found import FoundWall
from hertzchain.engines.lammps.reading.hooks import Readings
from hertzchain.engines.lammps.reading.prober import DAMPED, DEPTHS, SPIN_STEP, Prober, by_fix


def walls_of(prober: Prober, gap: float, unit: float, time: float) -> tuple[FoundWall, ...]:
    """The walls across the chain in the deck's units, by pushing the granule at each end outwards.

    They are expected behind a ``gap`` [m], and searched up to twice that.
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
        """Largest displacement of the granule outwards [length]: twice the gap, plus a radius."""
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

        The search begins at the start, or at ``ahead`` of it if there is no wall before.
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
        """Return the command of the fix with the largest force there."""
        seen, prober = self._ask(place)[3], self._prober
        pushes = {
            fix.command: abs(force[-1, self._number, 0])
            for fix, force in by_fix(prober.stage, seen, prober.granules)
            if fix.is_wall
        }
        return max(pushes, key=pushes.__getitem__)
