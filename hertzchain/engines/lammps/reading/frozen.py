"""The forces that a deck applies over its whole time, with all granules kept at rest.

A second instance gets the commands of the watched run, except the fixes that move granules:
conditions and variables that depend on the motion keep their values of that run.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.reading.contents import FoundFix
from hertzchain.engines.lammps.reading.probing import Granules, by_fix, members
from hertzchain.engines.lammps.reading.session import BLOCK, DeckFix, Readings, Session
from hertzchain.engines.lammps.reading.text import LEADS, MOVES, OF_MOTION, QUIET
from hertzchain.engines.lammps.reading.watching import Playing, sizes

_LEAST_READINGS = 400
"""Least number of readings of a run, even if no force changes (chosen)."""

_FORCE_ROUNDING = 1e-12  # fraction of the largest force: rounding of formulas at other times


@dataclass(frozen=True, eq=False)
class Applied:
    """Forces on granules over time, in the deck's units, by increasing coordinate.

    ``force`` is along the chain, shape (readings, granules), without ``constant``, which has three
    components, shape (granules, 3).
    """

    time: FloatArray
    force: FloatArray
    sideways: float
    constant: FloatArray
    fixes: tuple[FoundFix, ...]


@dataclass
class _Exerted:
    """Forces of one fix so far, by increasing coordinate, shape (granules, 3) each."""

    lowest: FloatArray
    highest: FloatArray
    largest: FloatArray  # along and off the axis, shape (granules, 2)
    readings: int = 0

    @classmethod
    def nothing(cls, granules: int) -> _Exerted:
        """Return the forces before the first readings: none."""
        most = np.full((granules, 3), np.inf)
        return cls(most, -most, np.zeros((granules, 2)))

    def update(self, force: FloatArray) -> None:
        """Take note of readings, shape (readings, granules, 3)."""
        self.lowest = np.minimum(self.lowest, force.min(axis=0))
        self.highest = np.maximum(self.highest, force.max(axis=0))
        self.largest = np.maximum(self.largest, sizes(force))
        self.readings += len(force)

    def constant(self, readings: int) -> FloatArray:
        """Return the force that was the same at all readings; 0 where it has changed."""
        if self.readings < readings:
            return np.zeros_like(self.lowest)
        most = float(np.max(self.largest, initial=0.0))
        return np.where(self.highest - self.lowest <= _FORCE_ROUNDING * most, self.lowest, 0.0)


class Replay(Playing):
    """Plays a deck without its motion; with ``leads``, granules that a fix leads are moved."""

    def __init__(
        self,
        lammps: Session,
        granules: Granules,
        between: float,
        begin: float = 0.0,
        leads: bool = False,
    ) -> None:
        super().__init__(lammps, granules.count, begin)
        self._granules, self._between, self._leads = granules, between, leads
        self._left_out: set[str] = set()
        self._time: list[FloatArray] = []
        self._force: list[FloatArray] = []  # of all fixes but walls, along the chain
        self._sideways = 0.0  # largest change of forces off the axis
        self._first_sideways: FloatArray | None = None
        self._exerted: dict[int, _Exerted] = {}  # by command
        self._masks: dict[int, tuple[DeckFix, NDArray[np.bool_]]] = {}
        self._moves: dict[str, DeckFix] = {}
        self._stride = 1  # steps between readings while forces change

    def give(self, words: list[str], index: int) -> None:
        """Give LAMMPS a command that neither moves granules nor ends a run before its time."""
        if not self._leaves_out(words, index):
            super().give(words, index)

    def clear(self) -> bool:
        """Forget all before the first run; the deck ends here after it."""
        self._left_out.clear()
        self._moves.clear()
        return super().clear()

    def _leaves_out(self, words: list[str], index: int) -> bool:
        if words[0] == "fix" and len(words) > 3:
            if words[3] in MOVES | OF_MOTION and not (self._leads and words[3] == LEADS):
                self._left_out.add(words[1])
                if words[3] != "halt":
                    self._moves[words[1]] = DeckFix(words[1], words[2], words[3], index)
                return True
            self._left_out.discard(words[1])
            return False
        if words[0] in ("unfix", "fix_modify") and len(words) > 1:
            if words[0] == "unfix":
                self._moves.pop(words[1], None)
            return words[1] in self._left_out
        return words[0] == "velocity"

    def run(self, text: str, steps: int, index: int, dt: float, first: int) -> int:
        """Carry out a ``run``, with granules at rest at its start."""
        lammps, start = self.lammps, self.seen.time
        rest = np.zeros((self._granules.count, 3))
        lammps.put({"v": rest, "omega": rest})
        self._stride = max(1, int(self._between / dt))
        lammps.twice = self._stride > 1
        self._longest = max(self._stride, steps // _LEAST_READINGS)
        acting = [fix for fix in lammps.alive.values() if fix.style not in QUIET]
        for fix in [*acting, *self._moves.values()]:
            self._masks[fix.command] = fix, members(lammps, fix.group, self._granules)

        def take(readings: Readings) -> None:
            self._take(readings, np.asarray(start + (readings.step - first) * dt))

        self.seen.ran(steps, dt, index)  # also one that LAMMPS refuses
        lammps.run(text, steps, self._stride, take)
        return steps

    def _take(self, readings: Readings, time: FloatArray) -> None:
        lammps, granules = self.lammps, self._granules
        total = np.zeros((time.size, granules.count, 3))
        for fix, force in by_fix(lammps, readings, granules):
            if fix.is_wall:
                continue
            total += force
            self._exerted.setdefault(fix.command, _Exerted.nothing(granules.count)).update(force)
        self._time.append(time)
        if self._leads:
            self.seen.lead(time, granules.along(readings.position)[:, [0, -1], 0])
        self._force.append(total[..., 0].copy())
        if self._first_sideways is None:
            self._first_sideways = total[0, :, 1:]
        change = np.linalg.norm(total[..., 1:] - self._first_sideways, axis=-1)
        self._sideways = max(self._sideways, float(np.max(change)))
        still = time.size == BLOCK and not np.any(np.ptp(total, axis=0))
        lammps.stride = min(10 * lammps.stride, self._longest) if still else self._stride

    def applied(self) -> Applied:
        """Return the forces of all fixes except walls."""
        granules = self._granules
        if not self._time:
            return nothing_applied(granules)
        time, force = np.concatenate(self._time), np.concatenate(self._force)
        constant = np.zeros((granules.count, 3))
        for exerted in self._exerted.values():
            constant += exerted.constant(time.size)
        force -= constant[:, 0]
        largest = {number: exerted.largest for number, exerted in self._exerted.items()}
        nothing = np.zeros((granules.count, 2))
        fixes = tuple(
            FoundFix(
                fix.style, number, fix.moves, mask, largest.get(number, nothing), nothing.copy()
            )
            for number, (fix, mask) in sorted(self._masks.items())
        )
        kept = _needed(force)
        return Applied(
            time=time[kept],
            force=force[kept],
            sideways=self._sideways,
            constant=constant,
            fixes=fixes,
        )


def nothing_applied(granules: Granules) -> Applied:
    """Return no forces, for a deck that takes no step."""
    constant = np.zeros((granules.count, 3))
    return Applied(np.zeros(0), np.zeros((0, granules.count)), 0.0, constant, ())


def _needed(force: FloatArray) -> NDArray[np.bool_]:
    """Tell which readings are not within a stretch of equal force, shape (readings,)."""
    changes = np.any(np.diff(force, axis=0) != 0, axis=1)
    kept = np.ones(len(force), bool)
    kept[1:-1] = changes[:-1] | changes[1:]
    return kept
