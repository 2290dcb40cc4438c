"""Runs a user's deck unchanged and watches the contacts: peaks, with the law that probes showed."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from operator import methodcaller

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.engines.external.observation import contact_forces
from hertzchain.engines.lammps.reading.deck import Executed, FoundFix, FoundRun, FoundWall
from hertzchain.engines.lammps.reading.probing import DEPTHS, Granules, Probes, by_fix, members
from hertzchain.engines.lammps.reading.session import (
    BLOCK,
    DeckFix,
    GranulesChanged,
    Readings,
    Session,
)
from hertzchain.engines.lammps.reading.text import (
    IGNORES_FORCES,
    LEADS,
    MOVES,
    OF_MOTION,
    QUIET,
    number,
)
from hertzchain.errors import RunFailed
from hertzchain.observables.samples import DampedLaw, Samples, closing
from hertzchain.observables.watch import PeakWatch

_END = {"first": (0, -1.0), "last": (-1, 1.0)}
"""Place of the granule at an end of the chain, and the direction outwards."""


@dataclass(frozen=True, eq=False)
class PeaksSeen:
    """Peaks, overlaps without a force, shape (contacts,); relative error of the peaks."""

    force: FloatArray
    missed: FloatArray
    error: float

    @classmethod
    def unknown(cls, contacts: int) -> PeaksSeen:
        """Return the peaks of a deck that does not run: NaN."""
        nothing = np.full(contacts, np.nan)
        return cls(nothing, np.zeros(contacts), np.nan)


class ContactWatch:
    """Keeps the peaks of all contacts, from all readings and from every second.

    A wall across the chain counts as a granule at rest at that end: its contact is the first or the
    last.
    """

    def __init__(self, probes: Probes) -> None:
        granules = probes.granules
        self._radius, self._mass = granules.radius, granules.mass
        self._walls = probes.walls
        first = sum(wall.end == "first" for wall in probes.walls)
        self._ends = first, len(probes.walls) - first
        contacts = granules.count - 1 + sum(self._ends)
        self._law = law_of(probes, contacts)
        self._all, self._halved = (
            PeakWatch(self._law, self._padded(1 / self._mass)) for _ in range(2)
        )
        self._rest = np.finfo(np.float64).eps * float(np.max(np.abs(granules.position)))
        self._missed = np.zeros(contacts)  # largest overlap that grew without a force
        self._before: list[FloatArray] = []  # the last reading of the run: ``Samples`` of one time

    def _padded(self, values: FloatArray) -> FloatArray:
        """Return values of granules, shape (..., granules), with 0 for walls."""
        return np.pad(values, (*[(0, 0)] * (values.ndim - 1), self._ends))

    def begin(self, free: NDArray[np.bool_]) -> None:
        """Begin a run, which may not continue the one before; its forces move ``free`` granules."""
        self._before = []
        for watch in (self._all, self._halved):
            watch.inverse_mass = self._padded(np.where(free, 1 / self._mass, 0.0))

    def take(
        self, time: FloatArray, late: FloatArray, place: FloatArray, velocity: FloatArray,
        acceleration: FloatArray, pairs: FloatArray, by_walls: FloatArray,
    ) -> float:  # fmt: skip
        """Add readings; return the largest force in open contacts.

        ``late`` is how long before it were the velocities that damped contacts then. Places have
        three components, all others that along the chain. A force of a wall at the first granule
        does not count.
        """
        along = place[..., 0]
        apart = np.linalg.norm(np.diff(place, axis=1), axis=-1)

        def deep(wall: FoundWall) -> FloatArray:
            at, sign = _END[wall.end]
            return np.asarray(self._radius[at] - sign * (wall.position - along[:, at]))

        def pushed(wall: FoundWall) -> FloatArray:
            at, sign = _END[wall.end]
            return np.asarray(-sign * by_walls[:, at])

        overlap = _columns(self._walls, self._radius[:-1] + self._radius[1:] - apart, deep)
        force = _columns(self._walls, contact_forces(pairs), pushed)
        touching = overlap > self._rest
        open_force = np.abs(np.where(touching, 0.0, force))[:, self._ends[0] :]
        force = np.where(touching, force, 0.0)
        motion = [self._padded(values) for values in (along, velocity, acceleration)]
        rate, growth = (closing(values, overlap.shape[1]) for values in motion[1:])
        # Rounding errors of a coordinate above which an overlap counts
        without = np.where((rate > 0) & (overlap > 1e3 * self._rest) & (force <= 0), overlap, 0.0)
        self._missed = np.maximum(self._missed, without.max(axis=0, initial=0.0))
        if self._law.is_damped:
            force = self._law.with_rate(force, overlap, rate - late * growth, rate)
        rows = [time, *motion, overlap, force]
        if self._before:
            rows = [np.concatenate(pair) for pair in zip(self._before, rows, strict=True)]
        self._before, last = [values[-1:] for values in rows], rows[0].size - 1
        if last > 0:
            halved = [*range(0, last, 2), last]
            self._all.update(Samples(*rows))
            self._halved.update(Samples(*(values[halved] for values in rows)))
        return float(np.max(open_force, initial=0.0))

    def seen(self, backwards: bool) -> PeaksSeen:
        """Return peaks for a chain that begins at either end; a wall's at the far end is last."""
        first, last = self._ends
        every = np.arange(self._missed.size)
        which = every[: every.size - last][::-1] if backwards else every[first:]
        force = self._all.force[which]
        error = self._all.reading_error
        counts = force > 1e-3 * np.max(force, initial=0.0)
        if np.any(counts):
            changes = np.abs(self._halved.force[which][counts] / force[counts] - 1)
            error = max(error, float(np.max(changes)))
        return PeaksSeen(force, self._missed[which], error)


def law_of(probes: Probes, contacts: int) -> DampedLaw:
    """Return the law of all contacts and walls in the deck's units; stiffness 1 if elastic."""
    elastic_law = DampedLaw.of_elastic(np.ones(contacts))
    at, walls = DEPTHS.index(1.0), probes.walls
    on_wall = at - 1  # no gap is probed there
    overlap = _columns(walls, probes.overlap[[at]], lambda wall: wall.overlap[[on_wall]])[0]
    elastic = _columns(walls, probes.contact_force[[at]], lambda wall: wall.force[[on_wall]])[0]
    closing = _columns(walls, probes.closing, lambda wall: wall.closing)
    deep = _columns(walls, probes.damped_overlap, lambda wall: wall.damped_overlap)
    force = _columns(walls, probes.damped_force, lambda wall: wall.damped_force)
    if overlap.size == 0:
        return elastic_law
    with np.errstate(divide="ignore", invalid="ignore"):
        stiffness = np.nan_to_num(elastic / overlap**1.5)
        # Approach at the same speed, with the larger and with the smaller overlap.
        added = [force[k] - stiffness * deep[k] ** 1.5 for k in (0, 2)]
        # Fraction of a force that is above the rounding of a difference
        is_damped = added[0] > 1e-9 * elastic
        if not np.any(is_damped):
            return elastic_law
        exponents = np.log(added[0] / added[1]) / np.log(deep[0] / deep[2])
        exponent = float(np.median(exponents[is_damped & np.isfinite(exponents)]))
    # Those of the laws are multiples of 1/4; they are off by rounding (chosen).
    nearest = round(4 * exponent) / 4
    exponent = nearest if abs(nearest - exponent) < 1e-3 else exponent
    coefficient = np.where(is_damped, added[0] / (closing[0] * deep[0] ** exponent), 0.0)
    return DampedLaw(
        stiffness,
        np.nan_to_num(coefficient, posinf=0.0, neginf=0.0),
        exponent,
        bool(np.any(force < 0)),
    )


def _columns(
    walls: Sequence[FoundWall],
    of_contacts: FloatArray,
    of_wall: Callable[[FoundWall], FloatArray],
) -> FloatArray:
    """Return values of contacts, (n, contacts), between those of walls, (n,), at either end."""
    first, last = ([of_wall(wall) for wall in walls if wall.end == end] for end in _END)
    return np.column_stack([*first, of_contacts, *last])


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
        self.velocity = np.full(self.count, np.nan)
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
        # Relative rounding of the start of a run, a sum of steps; runs are longer (chosen)
        self._begin = begin * (1 - 1e-9)

    def give(self, words: list[str], index: int) -> None:
        """Give LAMMPS a command."""
        self.lammps.carry_out(words, index)
        self.seen.given.append((index, methodcaller("give", words, index)))

    def take(self, steps: int, keywords: str, index: int) -> None:
        """Let LAMMPS take a number of steps, with other keywords of ``run``."""
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
        """Carry out a ``run`` of some steps after the first; return the number of steps taken."""


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
        """Carry out a ``run``, and read it at a fixed interval of steps."""
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
        along = granules.axes[0]
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
        for fix, force in by_fix(self.lammps, readings, granules):
            if fix.is_wall:
                walls += force[..., 0]
            largest = self.seen.exerted.setdefault(fix.command, np.zeros((granules.count, 2)))
            np.maximum(largest, sizes(force), out=largest)
        stray = self._contacts.take(time, late, place, velocity, acceleration, pairs, walls)
        self.seen.image_force = max(self.seen.image_force, stray)
        self.seen.velocity = velocity[-1]
        if self._led[0] or self._led[-1]:
            self.seen.lead(time, place[:, [0, -1], 0])


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
        # Fraction of the largest force: rounding of formulas at other times
        return np.where(self.highest - self.lowest <= 1e-12 * most, self.lowest, 0.0)


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
        # Least number of readings of a run, even if no force changes (chosen)
        self._longest = max(self._stride, steps // 400)
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
    """Return which readings are outside stretches of equal force, shape (readings,)."""
    changes = np.any(np.diff(force, axis=0) != 0, axis=1)
    kept = np.ones(len(force), bool)
    kept[1:-1] = changes[:-1] | changes[1:]
    return kept
