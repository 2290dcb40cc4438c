"""Runs a user's deck unchanged and watches the contacts."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from operator import methodcaller

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.reading.allowed import IGNORES_FORCES, LEADS, QUIET
from hertzchain.engines.lammps.reading.found import Executed, FoundRun
from hertzchain.engines.lammps.reading.granules import by_fix, members
from hertzchain.engines.lammps.reading.peaks import ContactWatch, PeaksSeen
from hertzchain.engines.lammps.reading.probing import Probes
from hertzchain.engines.lammps.reading.session import GranulesChanged, Readings, Session
from hertzchain.engines.lammps.reading.text import number
from hertzchain.errors import RunFailed

_ROUNDED = 1e-9  # relative rounding of the start of a run, a sum of steps; runs are longer (chosen)


def sizes(force: FloatArray) -> FloatArray:
    """Largest forces along and off the axis, (granules, 2), of (readings, granules, 3)."""
    both = np.stack([np.abs(force[..., 0]), np.linalg.norm(force[..., 1:], axis=-1)], axis=-1)
    return np.asarray(both.max(axis=0))


class Stopped(RunFailed):
    """A run that did not end; results from before this run remain valid."""


@dataclass(eq=False)
class Watched:
    """Observations of a deck while it was played, in its units and by increasing coordinate.

    It grows as the deck is played; without motion there are no peaks (NaN).
    """

    count: int  # of granules
    version: str = ""
    commands: tuple[Executed, ...] = ()
    given: list[tuple[int, methodcaller]] = field(default_factory=list)  # calls of a ``Playing``
    runs: list[FoundRun] = field(default_factory=list)
    stopped: str = ""
    cleared: bool = False
    time: float = 0.0
    before: float = 0.0  # how long the deck had run before the first run that counts
    read_every: int = 1
    image_force: float = 0.0
    exerted: dict[int, FloatArray] = field(default_factory=dict)  # by command: along, off the axis
    driven_time: FloatArray = field(default_factory=lambda: np.zeros(0))
    driven_ends: FloatArray = field(default_factory=lambda: np.zeros((0, 2)))  # places of both ends

    def __post_init__(self) -> None:
        self.driven = np.zeros(self.count, bool)  # with prescribed motion, in any run
        self.held = np.zeros(self.count, bool)  # at rest under any force, in all runs
        self.position = self.velocity = np.full(self.count, np.nan)
        self.peaks = (PeaksSeen.unknown(self.count - 1),) * 2  # forwards and backwards

    @property
    def first_run(self) -> int:
        """Index of the first run that takes a step; -1 where there is none."""
        return self.runs[0].command if self.runs else -1

    def ran(self, steps: int, dt: float, command: int) -> None:
        """Record steps that were taken."""
        last = self.runs[-1] if self.runs else None
        if last is not None and last.command == command and last.dt == dt:  # run every
            self.runs[-1] = replace(last, steps=last.steps + steps)
        else:
            self.runs.append(FoundRun(self.time, dt, steps, command))
        self.time += steps * dt

    def lead(self, time: FloatArray, ends: FloatArray) -> None:
        """Record the places of the chain's ends while fixes lead them."""
        self.driven_time = np.concatenate([self.driven_time, time])
        self.driven_ends = np.concatenate([self.driven_ends, ends])


class Playing(ABC):
    """Gives LAMMPS the commands of a deck, by their index; ``seen`` has the observations.

    In a deck that settles first, the runs before ``begin`` are only carried out: the first run that
    counts starts at that time, counted from the deck's first step.
    """

    moves_ghosts = True
    """Whether ghosts get velocities, which damping needs: LAMMPS would stop without them."""

    def __init__(self, lammps: Session, count: int = 1, begin: float = 0.0) -> None:
        self.lammps, self.seen = lammps, Watched(count)
        self._begin = begin * (1 - _ROUNDED)

    def give(self, words: list[str], index: int) -> None:
        """Give LAMMPS a command."""
        self.lammps.carry_out(words, index)
        self.seen.given.append((index, methodcaller("give", words, index)))

    def take(self, steps: int, keywords: str, index: int) -> None:
        """Have LAMMPS take so many steps, with other keywords of ``run``."""
        self.lammps.ready()
        if self.moves_ghosts:
            self.lammps.give("comm_modify vel yes")
        text, dt, first = f"run {steps} {keywords}".strip(), self.lammps.dt(), self.lammps.step()
        if steps == 0 or self.seen.before < self._begin:
            with stopping():
                self.lammps.give(text)
            done = self.lammps.step() - first
            self.seen.before += done * dt
        else:
            done = self.run(text, steps, index, dt, first)
        self.seen.given.append((index, methodcaller("take", done, keywords, index)))

    @abstractmethod
    def run(self, text: str, steps: int, index: int, dt: float, first: int) -> int:
        """Carry out a ``run`` of so many steps after the first; return how many were taken."""

    def clear(self) -> bool:
        """Forget all before the first run; the deck ends here after it."""
        self.seen.cleared = bool(self.seen.runs)
        if not self.seen.cleared:
            self.lammps.forget()
            self.seen.given.append((-1, methodcaller("clear")))
        return not self.seen.cleared


@contextmanager
def stopping() -> Iterator[None]:
    """Raise Stopped where LAMMPS stops."""
    try:
        yield
    except GranulesChanged:
        raise Stopped("granules left the box while it ran") from None
    except RunFailed as problem:
        raise Stopped(str(problem).split("; the step is too long")[0]) from None


class Watcher(Playing):
    """Plays a deck to its end and keeps the peaks; ``between`` is the time between two readings."""

    moves_ghosts = False

    def __init__(self, lammps: Session, probes: Probes, between: float, begin: float) -> None:
        super().__init__(lammps, probes.granules.count, begin)
        self.probes, self._between = probes, between
        self._contacts = ContactWatch(probes)
        self._changed = False  # whether fixes have been made or ended since the last run

    def give(self, words: list[str], index: int) -> None:
        """Give LAMMPS a command."""
        # A fix replaces an earlier one with the same id.
        is_new = words[0] == "fix" and words[1:2] and words[1] not in self.lammps.alive
        self._changed |= bool(is_new) or words[0] == "unfix"
        super().give(words, index)

    def run(self, text: str, steps: int, index: int, dt: float, first: int) -> int:
        """Carry out a ``run``, and read every so many of its steps."""
        stride = max(1, min(steps, int(self._between / dt)))
        self.seen.read_every = max(self.seen.read_every, stride)
        if self.lammps.count() != self.probes.granules.count:
            raise RunFailed(
                "the deck makes or deletes granules after its first run: make the whole chain"
                " before it"
            )
        self._free, self._led = self._moved()
        if "pre no" not in text:  # which reads no start: it goes on where the run before ended
            self._contacts.begin(self._free)
        elif self._changed:
            raise RunFailed(
                "with pre no LAMMPS takes no note of fixes that were made or ended since the run"
                " before: leave pre no out"
            )
        self._changed = False

        def take(readings: Readings) -> None:
            self._take(readings, readings.step - first, dt)

        with stopping():
            self.lammps.run(text, steps, stride, take)
        done = self.lammps.step() - first
        self.seen.ran(done, dt, index)
        return done

    @property
    def peaks(self) -> tuple[PeaksSeen, PeaksSeen]:
        """Peaks with contacts counted from either end of the chain."""
        return self._contacts.seen(backwards=False), self._contacts.seen(backwards=True)

    def _moved(self) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Tell which granules fixes move by forces, and which they lead, shape (granules,)."""
        granules = self.probes.granules
        free, led, unpressed = np.zeros((3, granules.count), bool)
        for fix in self.lammps.alive.values():
            if fix.moves:
                inside = members(self.lammps, fix.group, granules)
                if fix.style == LEADS:
                    led |= inside
                else:
                    free |= inside
                    unpressed |= inside & (fix.style == IGNORES_FORCES)
        without = (self._takes_all_forces() | unpressed) & free & ~led
        moving = granules.along(self.lammps.velocity())[:, 0] != 0
        self.seen.held = without & ~moving & (self.seen.held | (not self.seen.runs))
        led |= without & moving  # they keep their velocities
        self.seen.driven |= led
        return free & ~led, led

    def _takes_all_forces(self) -> NDArray[np.bool_]:
        """Granules that no force can move, shape (granules,): pistons, as some write, or held ones.

        These are granules on which no fix exerts forces after ``setforce`` or ``freeze``.
        """
        granules, lammps = self.probes.granules, self.lammps
        taken = np.zeros(granules.count, bool)
        along = int(np.argmax(np.abs(granules.frame[0])))
        for fix in self.lammps.alive.values():
            inside = members(lammps, fix.group, granules)
            if fix.style == "freeze":
                taken |= inside
            elif fix.style == "setforce":
                taken |= inside & (number("".join(fix.values[along : along + 1])) == 0)
            elif fix.style not in QUIET:
                taken &= ~inside
        return taken

    def _take(self, readings: Readings, done: NDArray[np.int64], dt: float) -> None:
        """Add readings; ``done`` has the number of steps of the run before each."""
        granules, time = self.probes.granules, np.asarray(self.seen.time + done * dt)
        if not np.array_equal(readings.ids[-1], granules.ids):
            raise GranulesChanged
        if not np.all(np.isfinite(readings.position)) or not np.all(np.isfinite(readings.net)):
            raise Stopped("the motion diverged")
        place = granules.moved_from(granules.along(readings.position))
        net = granules.along(readings.net)[..., 0]
        velocity = granules.along(readings.velocity)[..., 0]
        # Steps of velocity Verlet: a half step is missing where forces are added up, and damped
        # contacts had velocities of half a step before but at the start.
        acceleration = np.where(self._free, net / granules.mass, 0.0)
        missing, late = (
            np.where(flags, dt / 2, 0.0)[:, np.newaxis] for flags in (readings.half, done > 0)
        )
        velocity = velocity + missing * acceleration
        pairs = granules.along(readings.of_pairs)[..., 0]
        walls = np.zeros_like(pairs)
        for fix, own in by_fix(self.lammps, readings, granules):
            if fix.is_wall:
                walls += own[..., 0]
            known = self.seen.exerted.setdefault(fix.command, np.zeros((granules.count, 2)))
            np.maximum(known, sizes(own), out=known)
        stray = self._contacts.take(time, late, place, velocity, acceleration, pairs, walls)
        self.seen.image_force = max(self.seen.image_force, stray)
        self.seen.position, self.seen.velocity = place[-1, :, 0], velocity[-1]
        if self._led[0] or self._led[-1]:
            self.seen.lead(time, place[:, [0, -1], 0])
