"""The forces that a deck applies over its whole time, all granules staying where they are.

What LAMMPS was given while the deck was watched is given to a second instance, but for the fixes
that move granules: conditions and variables of the motion have their values from there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.user_deck.allowed import MOVES
from hertzchain.engines.lammps.user_deck.granules import Granules
from hertzchain.engines.lammps.user_deck.hooks import Readings
from hertzchain.engines.lammps.user_deck.player import DeckFix, Stage
from hertzchain.engines.lammps.user_deck.probing import members
from hertzchain.engines.lammps.user_deck.watching import Given

_UNCHANGED = 1e-12  # of the largest force: what formulas of other times round to


@dataclass(frozen=True, eq=False)
class FixSeen:
    """A fix that exerts forces or moves granules, by increasing coordinate."""

    fix: DeckFix
    granules: NDArray[np.bool_]
    largest: FloatArray


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
    every: int
    fixes: tuple[FixSeen, ...]


class Replay:
    """Gives LAMMPS what it was given before, without motion."""

    def __init__(self, stage: Stage, granules: Granules, between: float) -> None:
        self.stage, self._granules, self._between = stage, granules, between
        self._left_out: set[str] = set()
        self._time: list[FloatArray] = []
        self._force: dict[int, list[FloatArray]] = {}  # by command
        self._count = 0  # readings so far
        self._masks: dict[int, tuple[DeckFix, NDArray[np.bool_]]] = {}
        self._moves: dict[str, DeckFix] = {}
        self.every = 1

    def play(self, given: Sequence[Given]) -> Applied:
        """Play all commands; the forces that fixes but walls exert."""
        end = 0.0
        for one in given:
            if one.steps is not None:
                end = self._run(one, end)
            elif one.words[0] == "clear":
                self.stage.forget()
                self._left_out.clear()
            elif not self._leaves_out(one):
                self.stage.give(one.text, list(one.words), one.index)
        return self._applied()

    def _leaves_out(self, one: Given) -> bool:
        """Whether a command would move granules or end a run before its time."""
        words = one.words
        if words[0] == "fix" and len(words) > 3:
            if words[3] in MOVES or words[3] == "halt":
                self._left_out.add(words[1])
                if words[3] in MOVES:
                    self._moves[words[1]] = DeckFix(words[1], words[2], words[3], one.index)
                return True
            self._left_out.discard(words[1])
            return False
        if words[0] in ("unfix", "fix_modify") and len(words) > 1:
            if words[0] == "unfix":
                self._moves.pop(words[1], None)
            return words[1] in self._left_out
        return False

    def _run(self, one: Given, start: float) -> float:
        assert one.steps is not None
        lammps = self.stage.lammps
        self.stage.ready()
        lammps.numpy.extract_atom("v")[: self._granules.count] = 0.0
        lammps.numpy.extract_atom("omega")[: self._granules.count] = 0.0
        dt, first = float(lammps.extract_global("dt")), int(lammps.extract_global("ntimestep"))
        stride = max(1, int(self._between / dt))
        self.every = max(self.every, min(stride, max(one.steps, 1)))
        for fix in [*self.stage.alive.values(), *self._moves.values()]:
            self._masks[fix.command] = fix, members(lammps, fix.group, self._granules)

        def take(readings: Readings) -> None:
            self._take(readings, np.asarray(start + (readings.step - first) * dt))

        self.stage.hooks.run(one.text, one.steps, stride, take)
        return start + one.steps * dt

    def _take(self, readings: Readings, time: FloatArray) -> None:
        forces = np.moveaxis(readings.of_fixes, 1, 0)
        alive = {fix.command for fix in self.stage.alive.values() if not fix.is_wall}
        self._time.append(time)
        for source, force in zip(self.stage.hooks.sources[1:], forces, strict=True):
            assert source is not None
            if source in alive:
                own = self._force.setdefault(source, [])
                missing = self._count - sum(map(len, own))
                if missing:
                    own.append(np.zeros((missing, *force.shape[1:])))
                own.append(self._granules.along(force))
        self._count += time.size

    def _applied(self) -> Applied:
        granules = self._granules
        time = np.concatenate(self._time) if self._time else np.zeros(0)
        total = np.zeros((time.size, granules.count))
        constant = np.zeros((granules.count, 3))
        off = np.zeros((time.size, granules.count, 2))
        largest: dict[int, FloatArray] = {}
        for command, parts in self._force.items():
            force = np.concatenate(parts)
            force = np.concatenate([force, np.zeros((time.size - len(force), *force.shape[1:]))])
            sideways = np.linalg.norm(force[..., 1:], axis=-1)
            both = np.stack([np.abs(force[..., 0]), sideways], axis=-1)
            largest[command] = np.max(both, axis=0, initial=0.0)
            span = np.ptp(force, axis=0)
            always = np.where(span <= _UNCHANGED * np.max(np.abs(force), initial=0.0), force[0], 0)
            constant += always
            total += force[..., 0] - always[:, 0]
            off += force[..., 1:] - always[:, 1:]
        fixes = tuple(
            FixSeen(fix, mask, largest.get(number, np.zeros((granules.count, 2))))
            for number, (fix, mask) in sorted(self._masks.items())
        )
        kept = _needed(total)
        return Applied(
            time=time[kept],
            force=total[kept],
            sideways=float(np.max(np.linalg.norm(off, axis=-1), initial=0.0)),
            constant=constant,
            every=self.every,
            fixes=fixes,
        )


def _needed(force: FloatArray) -> NDArray[np.bool_]:
    """Which readings are not within a stretch of one force, shape (readings,)."""
    if len(force) == 0:
        return np.zeros(0, bool)
    changes = np.any(np.diff(force, axis=0) != 0, axis=1)
    kept = np.ones(len(force), bool)
    kept[1:-1] = changes[:-1] | changes[1:]
    return kept
