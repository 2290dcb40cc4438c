"""Reads a user's deck as LAMMPS does, and gives LAMMPS one command after another.

Conditions, loops, jumps and includes are carried out here, so that the place of each command is
known, and no command that writes files or runs programs gets through. LAMMPS inserts the values of
variables, and evaluates conditions.
"""

from __future__ import annotations

import functools
import itertools
import math
import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray, Quantity
from hertzchain.engines.external.program import work_folder
from hertzchain.engines.lammps import deck
from hertzchain.engines.lammps.engine import Child, Program, Task, engine
from hertzchain.engines.lammps.reading.deck import Executed, FoundDeck, FoundRun, scaled
from hertzchain.engines.lammps.reading.probing import Granules, Probes, Sizes, probe
from hertzchain.engines.lammps.reading.session import Module, Piped, Session
from hertzchain.engines.lammps.reading.text import (
    CONTROL,
    LEADS,
    Edits,
    Line,
    Rules,
    edited,
    in_ascii,
    read_text,
    shown,
    steps_of,
    without_comment,
    words_of,
)
from hertzchain.engines.lammps.reading.watching import (
    Applied,
    Playing,
    Replay,
    Stopped,
    Watched,
    Watcher,
    nothing_applied,
)
from hertzchain.errors import HertzchainError, RunFailed, TooExpensive
from hertzchain.limits import TIME_LIMIT, Deadline, bound_memory, in_words
from hertzchain.scene.scene import Scene

_MOST_COMMANDS = 200_000  # carried out; chosen: a deck with more seems to be endless
_MOST_STEPS = 2**31 - 1  # of one run of LAMMPS
_VARIABLE = re.compile(r"ERROR: Variable (\w+):(?!.* before simulation box)")
"""Part of LAMMPS's message on a formula with a variable that it cannot evaluate yet."""

_MOST_NESTED_FILES = 15  # files that include one another, as in LAMMPS itself


class Ended(Exception):
    """The deck is over, or the rest of it is not wanted."""


@dataclass
class _Open:
    """A file that is read, and the next line."""

    name: str  # as the deck names it
    lines: list[Line]
    next: int = 0

    @functools.cached_property
    def labels(self) -> dict[str, int]:
        """Line of each label, the first one of that name."""
        labels: dict[str, int] = {}
        for k, line in enumerate(self.lines):
            words = words_of(without_comment(line.text))
            if len(words) > 1 and words[0].value == "label":
                labels.setdefault(words[1].value, k)
        return labels


@dataclass(frozen=True)
class Source:
    """A deck: its name, as the user gives it, its path, and what it is read with.

    Variables replace those of style ``index``, as ``-var`` does. Files are searched in the working
    folder first. With ``tells`` the place of each command is written to stderr before the command
    is carried out: there it remains if the process crashes.
    """

    name: str
    path: Path
    folder: Path  # the working folder
    variables: Mapping[str, str] = field(default_factory=dict)
    edits: Edits = field(default_factory=dict)
    tells: bool = False


class Interpreter:
    """Carries out a deck; ``commands`` grows with it.

    The player gives the commands to a LAMMPS that has no box.
    """

    def __init__(self, source: Source, player: Playing) -> None:
        self._source, self._player, self._lammps = source, player, player.lammps
        self._rules = Rules((source.folder, source.path.parent))
        self._files: list[_Open] = []
        self._skips_jump = self._ran = False
        self.commands: list[Executed] = []
        self.executing: Executed | None = None

    def play(self) -> None:
        """Carry out the deck, up to its end."""
        for name, value in self._source.variables.items():
            # These are not the deck's: LAMMPS then skips a variable of this name and style in the
            # deck.
            self._player.give(["variable", name, "index", *in_ascii(value).split()], 0)
        try:
            self._read(self._source.name)
        except Ended:
            return
        except HertzchainError as problem:
            if self.executing is None or str(problem).startswith(f"{self.executing.file}:"):
                raise
            to_blame = self._variable_in(str(problem)) or self.executing
            place = f"{to_blame.file}:{to_blame.line}"
            said = str(problem)
            if self.executing.text.startswith("minimize"):  # which takes no steps in time
                said = said.split("; the step is too long", maxsplit=1)[0]
            raise type(problem)(f"{place}: {said}") from None

    def _variable_in(self, said: str) -> Executed | None:
        """Return the last command that set the variable that LAMMPS names in its error, if any."""
        named = _VARIABLE.search(said)
        words = ["variable", named[1]] if named else []
        definitions = (c for c in reversed(self.commands) if c.text.split()[:2] == words)
        return next(definitions, None)

    def _read(self, name: str) -> None:
        """Carry out the commands of a file."""
        if len(self._files) >= _MOST_NESTED_FILES:
            raise RunFailed(f"more than {_MOST_NESTED_FILES} files include one another")
        file = self._opened(name)
        self._files.append(file)
        while file.next < len(file.lines):
            line = file.lines[file.next]
            file.next += 1
            written = shown(without_comment(line.text))
            self._carry_out(line.text, Executed(written, file.name, line.number, written))
        self._files.pop()

    def _opened(self, name: str) -> _Open:
        path = self._source.path if not self._files else self._rules.path(name)
        return _Open(name, edited(in_ascii(read_text(path, name)), name, self._source.edits))

    def _carry_out(self, text: str, where: Executed) -> None:
        """Carry out one command, which may stand in quotes within another one."""
        text = without_comment(text)
        if not text:
            return
        self.executing = where
        if self._source.tells:  # not more characters than a message may have
            os.write(2, f"{where.file}:{where.line}: {shown(text)[:200]}\n".encode())
        if len(self.commands) >= _MOST_COMMANDS:
            raise RunFailed(
                f"the deck is not over after {_MOST_COMMANDS} commands: it seems to have no end"
            )
        if "$" in text:
            text = " ".join(in_ascii(self._lammps.expanded(text)).splitlines()).strip()
        words = words_of(text)
        if any("$" in word.raw and word.raw[0] not in "\"'" for word in words):
            # LAMMPS would insert values once more than in the deck itself.
            raise RunFailed(
                "the value of a variable has a $: give the value itself, without another variable"
            )
        if not words:
            return
        name, values = words[0].value, [word.value for word in words[1:]]
        if name in CONTROL:
            index = self._note(replace(where, text=shown(text)))
            getattr(self, f"_{name}")(values, index, where)
            return
        given, why_not = self._rules.decide([name, *values])
        index = self._note(
            replace(where, text=shown(text), carried_out=given is not None, why_not=why_not)
        )
        if given is not None:
            self._player.give(given, index)

    def _note(self, done: Executed) -> int:
        """Record a command; return its index."""
        self.commands.append(done)
        return len(self.commands) - 1

    # ---- Commands that are carried out here: values are the words after the command's name.

    def _include(self, values: list[str], *_: object) -> None:
        _need(values, 1, "include")
        self._read(values[0])

    def _label(self, *_: object) -> None:
        """Do nothing: a jump searches the file for its label."""

    def _jump(self, values: list[str], *_: object) -> None:
        _need(values, 1, "jump")
        if self._skips_jump:
            self._skips_jump = False
            return
        file = self._files[-1]
        if values[0] != "SELF" and Path(values[0]).name != Path(file.name).name:
            raise RunFailed(f"jump leads to another file, {values[0]}: include that file instead")
        file.next = 0
        if len(values) > 1:
            if values[1] not in file.labels:
                raise RunFailed(f"jump finds no label {values[1]} in {file.name}")
            file.next = file.labels[values[1]] + 1

    def _next(self, values: list[str], index: int, _: Executed) -> None:
        _need(values, 1, "next")
        self._player.give(["next", *values], index)
        # LAMMPS deletes the variables that have no further value, and skips the next jump.
        if not all(self._lammps.has_variable(name) for name in values):
            self._skips_jump = True

    def _if(self, values: list[str], _: int, where: Executed) -> None:
        if len(values) < 3 or values[1] != "then":
            raise RunFailed("if needs a condition in quotes, then, and commands in quotes")
        self._rules.refuse_environment(values)
        words = ["elif", values[0], *values[2:]]  # "then" stands only after the first condition
        starts = [k for k, word in enumerate(words) if word in ("elif", "else")]
        for start, end in itertools.pairwise([*starts, len(words)]):
            body = words[start + 1 : end]
            if words[start] == "elif" and not (body and self._lammps.holds(body.pop(0))):
                continue
            for text in body:
                self._carry_out(text, where)
            return

    def _quit(self, *_: object) -> None:
        raise Ended

    def _run(self, values: list[str], index: int, where: Executed) -> None:
        _need(values, 1, "run")
        steps = steps_of(values[0])
        now = self._lammps.step()
        kept, pace, texts = dict[str, str](), 0, list[str]()
        words = iter(values[1:])
        for word in words:
            if word == "upto":
                steps = max(steps - now, 0)
            elif word in ("start", "stop"):
                kept[word] = str(steps_of(next(words, "")))
            elif word in ("pre", "post"):
                kept[word] = _yes_or_no(f"run {word}", next(words, ""))
            elif word == "every":
                pace, texts = steps_of(next(words, "")), [*words]
            else:
                raise RunFailed(f"run has no keyword {word}")
        if steps > _MOST_STEPS:
            raise RunFailed(f"run {values[0]} is not a number of steps: at most {_MOST_STEPS}")
        if pace == 0:
            self._take(steps, kept, index)
            return
        kept = {"start": str(now), "stop": str(now + steps), **kept}
        done = 0
        while done < steps or done == 0:
            part = min(pace, steps - done)
            self._take(part, kept, index)
            done += max(part, 1)
            for text in texts:
                if text != "NULL":
                    self._carry_out(text, where)

    def _take(self, steps: int, keywords: dict[str, str], index: int) -> None:
        """Take steps; LAMMPS always prepares its first run, also with ``pre no``."""
        kept = [f"{word} {value}" for word, value in keywords.items() if self._ran or word != "pre"]
        self._player.take(steps, " ".join(kept), index)
        self._ran = True


def _yes_or_no(what: str, value: str) -> str:
    """Return a logical value as LAMMPS reads it; RunFailed for any other."""
    for answer, words in (("yes", ("yes", "on", "true")), ("no", ("no", "off", "false"))):
        if value in words:
            return answer
    raise RunFailed(f"{what} {value} is neither yes nor no")


def _need(values: list[str], least: int, name: str) -> None:
    if len(values) < least:
        raise RunFailed(f"{name} needs at least {least} word{'s' * (least > 1)} more")


def contents_of(probes: Probes, seen: Watched, applied: Applied, backwards: bool) -> FoundDeck:
    """Return the ``FoundDeck`` from probes, the watched run, and applied forces.

    ``backwards`` is true if granule 1 lies at the largest coordinate.
    """
    granules = probes.granules
    sign = -1.0 if backwards else 1.0

    def turned(values: Quantity, axis: int = -1) -> Quantity:
        return np.flip(values, axis) if backwards else values

    def vectors(values: FloatArray) -> FloatArray:
        return np.asarray(turned(values, 0) * np.array([sign, 1.0, 1.0]))

    def of(source: object, change: Callable[[Quantity], Quantity], *names: str) -> dict[str, Any]:
        return {name: change(getattr(source, name)) for name in names}

    end, along = -1 if backwards else 0, granules.axes[0]
    origin = granules.position[end, 0]
    peaks, order = seen.peaks[int(backwards)], granules.order
    ends = {"first": "last", "last": "first"} if backwards else {"first": "first", "last": "last"}
    led = slice(None) if seen.driven[end] else slice(0)
    sideways = granules.position[:, 1:] - np.median(granules.position[:, 1:], axis=0)
    remarks = []
    if probes.why_not is not None:
        remarks.append(f"the contacts of the granules were not asked: {probes.why_not}")
    deck = FoundDeck(
        **of(seen, lambda value: value,
             "version", "commands", "first_run", "before", "stopped", "image_force"),
        **of(granules, turned, "types", "radius", "mass"),
        **of(granules, vectors, "velocity", "spin"),
        **of(probes, turned, "overlap", "contact_force", "closing", "damped_overlap",
             "damped_force", "tangential_force", "drag"),
        units=granules.units.name, is_chain=granules.is_chain, axis="xyz"[along],
        direction=sign * np.eye(3)[along], reversed=backwards, ids=turned(granules.ids[order]),
        origin=granules.position[end][np.argsort(granules.axes)],
        position=turned(sign * (granules.position[:, 0] - origin)), sideways=turned(sideways, 0),
        constant_force=vectors(applied.constant),
        walls=tuple(
            replace(wall, end=ends[wall.end], position=sign * (wall.position - origin))
            for wall in probes.walls
        ),
        integrated=turned(np.where(seen.held, 0, probes.integrated)),
        image_gap=_image_gap(probes),
        fixes=tuple(
            replace(
                fix, granules=turned(fix.granules), largest=turned(fix.largest, 0),
                largest_in_motion=turned(seen.exerted.get(fix.command, 0 * fix.largest), 0),
            )
            for fix in applied.fixes
        ),
        runs=tuple(seen.runs), applied_time=applied.time,
        applied_force=sign * turned(applied.force), applied_sideways=applied.sideways,
        peak_force=peaks.force, peak_reading_error=peaks.error, missed_overlap=peaks.missed,
        driven=turned(seen.driven), driven_time=seen.driven_time[led],
        driven_displacement=sign * (seen.driven_ends[led, end] - origin), end_time=seen.time,
        final_velocity=sign * turned(seen.velocity), remarks=tuple(remarks),
    )  # fmt: skip
    return scaled(deck, granules.units)


def _is_reversed(probes: Probes, seen: Watched, applied: Applied, scene: Scene) -> bool:
    """Whether granule 1 lies at the largest coordinate, by most signs of the shocked end.

    A deck may have one of the signs wrong. In a tie, granule 1 has the lowest id.
    """
    granules = probes.granules
    shocked, pushed = _shocked(probes, seen, applied, bool(scene.ramps))
    half = 1.0  # a shock on another granule than the first may be in the far half
    if scene.shock.granule > 1:
        half = float(np.sign((scene.chain.granules + 1) / 2 - scene.shock.granule))
    walls = [wall.end for wall in probes.walls]
    signs = [
        half * _middle(shocked), -pushed, float(walls == ["first"]) - float(walls == ["last"]),
        _misfit(granules, scene, 1) - _misfit(granules, scene, -1),
        # Weight and loads push towards the far end.
        0.0 if scene.precompression is None else -np.sum(applied.constant[:, 0]),
    ]  # fmt: skip
    first, last = granules.ids[granules.order[[0, -1]]]
    return bool(np.sum(np.sign(signs)) + 0.5 * np.sign(float(first - last)) > 0)


def _shocked(
    probes: Probes, seen: Watched, applied: Applied, is_pushed: bool
) -> tuple[FloatArray, float]:
    """Return the weight of the shock on each granule, shape (granules,), and its sign.

    If no force pushes the chain in its scene, the shock is where granules move, if any do.
    """
    acts, velocity = np.abs(applied.force), probes.granules.velocity[:, 0]
    if np.any(acts) and applied.time.size > 1 and (is_pushed or not np.any(velocity)):
        impulse = np.diff(applied.time) @ (acts[1:] + acts[:-1])
        # Fraction of the largest force that is above round-off (chosen)
        begun = int(np.argmax(acts.max(axis=1) > 1e-3 * acts.max()))
        return impulse, float(np.sum(applied.force[begun]))
    if np.any(seen.driven) and seen.driven_time.size:
        way = seen.driven_ends[:, 0 if seen.driven[0] else -1]
        return seen.driven.astype(np.float64), float(np.mean(way - way[0]))
    return np.abs(velocity), float(np.sum(velocity))


def _middle(weight: FloatArray) -> float:
    """Return on which side of the chain's middle most of a weight is: below 0 near the start."""
    place = np.linspace(-1, 1, weight.size) if weight.size > 1 else np.zeros(1)
    middle = float(np.sum(weight * place))
    # Fraction of all weight: a middle within round-off and equal granules (chosen)
    return middle if abs(middle) > 1e-6 * float(np.sum(np.abs(weight))) else 0.0


def _misfit(granules: Granules, scene: Scene, step: int) -> float:
    """Misfit of the deck's granules with the scene's, relative to a median, from either end on."""
    if granules.count != scene.chain.granules:
        return 0.0
    # Relative difference below which granules are of one kind (chosen)
    return sum(
        float(np.sum(np.abs(read[::step] / np.median(read) - true / np.nanmedian(true)) > 1e-2))
        for read, true in (
            (granules.radius, scene.granules.radius),
            (granules.mass, np.where(np.isinf(scene.granules.mass), np.nan, scene.granules.mass)),
        )
    )  # fmt: skip


def _image_gap(probes: Probes) -> float | None:
    granules = probes.granules
    if granules.boundary[0] != "p":
        return None
    length = float(granules.high[0] - granules.low[0])
    extent = float(granules.position[-1, 0] - granules.position[0, 0])
    return length - extent - float(granules.radius[0] + granules.radius[-1])


_READ_EVERY = 0.2
"""Contact times between two readings: the interpolation between them is right to 1e-6 then."""


class Reader(ExitStack):
    """Reads a deck, with or without edits, as often as wanted, in one process; a context.

    The scene, which the deck should compute, sets the overlaps, speeds and times at which LAMMPS is
    probed, and the order of the granules. Variables are as ``-var`` gives them, the deadline is
    that of all readings together, ``lmp`` is a binary in place of the Python module, and ``say``
    takes lines of text about progress.
    """

    def __init__(
        self,
        path: Path | str,
        scene: Scene,
        variables: Mapping[str, object] | Iterable[tuple[str, object]] = (),
        deadline: Deadline | None = None,
        lmp: str | Path | None = None,
        say: Callable[[str], object] = lambda _: None,
    ) -> None:
        super().__init__()
        self._deck, self._scene, self._lmp, self._say = str(path), scene, lmp, say
        self._sizes = Sizes.of(scene)
        self._variables = {name: str(value) for name, value in dict(variables).items()}
        self._deadline = deadline or Deadline(TIME_LIMIT)

    def __enter__(self) -> Self:
        folder = self.enter_context(work_folder("LAMMPS"))
        self._child = self.enter_context(Child())
        program = None if self._lmp is None else Program.find(str(self._lmp), 1, self._deadline)
        self._start = Start(folder, program)
        self._source = Source(
            self._deck, Path(self._deck).absolute(), Path.cwd(), self._variables, tells=True
        )
        return self

    def _call(self, function: Task, *arguments: object) -> Any:
        left = min(self._deadline.left, self._until.left)
        return self._child.call(function, self._start, *arguments, time_limit=left)

    def read(
        self, edits: Edits | None = None, limit: float = math.inf, begin: float = 0.0
    ) -> FoundDeck:
        """Have LAMMPS read the deck with some edits; query every number, run the deck and watch it.

        ``limit`` is for this reading alone [s]. A deck that settles first is read as it is at the
        start of the run that begins ``begin`` after its first step, in the deck's unit of time.

        Raises
        ------
        BackendMissing
            If the LAMMPS module is not there or too old.
        RunFailed
            If the deck cannot be read, stops with an error before its first run, crashes LAMMPS,
            has a command that is not supported here, or is not over in time.
        """
        self._until = Deadline(limit)
        source = replace(self._source, edits=dict(edits or {}))
        try:
            return self._examined(source, begin)
        except TooExpensive:
            whole = in_words(self._deadline.limit)
            raise TooExpensive(
                f"{self._deck}: not over after {whole}: shorten the deck, if it is to end"
                " at all, or raise the limit"
            ) from None

    def _examined(self, source: Source, begin: float) -> FoundDeck:
        self._say("asking LAMMPS what it makes of the deck")
        probes, seen = self._call(probed, source, self._sizes, begin)
        if not probes.granules.is_chain:
            nothing = nothing_applied(probes.granules)
            return contents_of(
                probes, seen, nothing, _is_reversed(probes, seen, nothing, self._scene)
            )
        self._say("running the deck")
        between = _READ_EVERY * probes.contact_time
        # Error of the peaks by the interval of readings above which the deck is run again; how much
        # denser readings are then; and most repetitions. This occurs where contacts are stiffer, or
        # pressed harder, than those of the scene.
        for _ in range(3):
            seen = self._call(_watch, source, probes, between, begin)
            if max(peaks.error for peaks in seen.peaks) < 1e-5 or seen.read_every == 1:
                break
            if seen.stopped:
                break
            between *= 0.1
        self._say("reading the applied forces")
        each = self._sizes.between(probes.granules.units, probes.contact_time)
        if seen.stopped:
            stopped = seen.stopped
            seen, applied = self._call(without_motion, source, probes, each, seen.driven, begin)
            seen.stopped = stopped
        else:
            applied = self._call(_freeze, seen, probes, each, begin)
        return contents_of(probes, seen, applied, _is_reversed(probes, seen, applied, self._scene))


@dataclass(frozen=True, eq=False)
class Look:
    """Contents of a deck as LAMMPS reads it: the whole deck of a chain, else up to the run."""

    commands: tuple[Executed, ...]  # in the order in which they were carried out
    stopped: str  # why LAMMPS stopped after them; empty where it did not
    probes: Probes | None = None  # before the first run; None where there is none
    runs: tuple[FoundRun, ...] = ()
    applied: Applied | None = None  # forces during these runs; None if it is not a chain

    @property
    def is_whole(self) -> bool:
        """Whether the deck was carried out to its end."""
        return not self.stopped and (self.probes is None or self.applied is not None)

    @property
    def granules(self) -> Granules | None:
        """The granules before the first run; None where there are none."""
        return None if self.probes is None else self.probes.granules

    @property
    def law(self) -> tuple[FloatArray, FloatArray] | None:
        """A and p in F = A d^p of each contact, by its two largest overlaps; None if unknown."""
        probes = self.probes
        if probes is None or probes.why_not is not None:
            return None
        with np.errstate(all="ignore"):  # NaN where a contact has no force
            force, overlap = (np.log(each[-2:]) for each in (probes.contact_force, probes.overlap))
            exponent = np.diff(force, axis=0)[0] / np.diff(overlap, axis=0)[0]
            return np.exp(force[-1] - exponent * overlap[-1]), exponent


def look(path: Path, variables: Mapping[str, str], time_limit: float) -> Look:
    """Return what LAMMPS finds in a deck without motion, in a separate process; needs no scene.

    Raises BackendMissing without a LAMMPS module, RunFailed if it crashes, TooExpensive if it is
    not done in time [s].
    """
    with work_folder("LAMMPS") as folder, Child() as child:
        result: Look = child.call(
            looked, Start(folder, None), path, Path.cwd(), dict(variables), time_limit=time_limit
        )
    return result


# ---- In the process that runs LAMMPS


@dataclass(frozen=True)
class Start:
    """Way to start LAMMPS in a separate folder: the Python module, or a binary."""

    folder: Path
    program: Program | None
    alone: bool = True  # whether this process serves LAMMPS only

    @contextmanager
    def session(self) -> Iterator[Session]:
        """Return a LAMMPS without a box."""
        if self.alone:
            os.chdir(self.folder)
            bound_memory()  # a lattice a hundred times too fine makes a million times the granules
        if self.program is None:
            with engine() as lammps:
                yield Module(lammps, self.folder)
        else:
            path, version = self.program.command[0], self.program.build.version
            with closing(Piped(path, version, self.folder)) as session:
                yield session


class First(Playing):
    """Plays a deck up to its first run that counts, and probes there."""

    def __init__(self, lammps: Session, sizes: Sizes, begin: float = 0.0) -> None:
        super().__init__(lammps, begin=begin)
        self._sizes = sizes
        self.probes: Probes | None = None

    def run(self, *_: object) -> int:
        """Query all numbers, instead of taking steps."""
        self.probes = probe(self.lammps, self._sizes)
        raise Ended


def probed(
    start: Start, source: Source, sizes: Sizes, begin: float = 0.0
) -> tuple[Probes, Watched]:
    """Return the answers of LAMMPS before the deck's first run, and the commands up to there."""
    with start.session() as lammps:
        first = First(lammps, sizes, begin)
        seen = _played(source, first)
    if first.probes is None:
        raise RunFailed(f"{source.name}: the deck takes no step: it has no run, or ends before it")
    return first.probes, replace(seen, count=first.probes.granules.count)


def _watch(start: Start, source: Source, probes: Probes, between: float, begin: float) -> Watched:
    with start.session() as lammps:
        watcher = Watcher(lammps, probes, between, begin)
        seen = _played(source, watcher, Stopped)
        seen.peaks = watcher.peaks
        return seen


def _played(source: Source, player: Playing, *ends: type[HertzchainError]) -> Watched:
    """Return what is observed while a deck is played to its end, or to an error of these kinds."""
    script, seen = Interpreter(source, player), player.seen
    try:
        script.play()
    except ends as problem:
        seen.stopped = str(problem)
    seen.version, seen.commands = player.lammps.version, tuple(script.commands)
    return seen


def _freeze(start: Start, seen: Watched, probes: Probes, between: float, begin: float) -> Applied:
    """Return the forces of a deck without its motion; variables have their values of the run."""
    with start.session() as lammps:
        replay = Replay(lammps, probes.granules, between, begin)
        for index, give in seen.given:
            try:
                give(replay)
            except HertzchainError as problem:
                place = seen.commands[index]
                raise type(problem)(f"{place.file}:{place.line}: {problem}") from None
        return replay.applied()


def without_motion(
    start: Start,
    source: Source,
    probes: Probes,
    between: float,
    driven: NDArray[np.bool_],
    begin: float = 0.0,
) -> tuple[Watched, Applied]:
    """Return the forces of a deck, and its runs, played without its motion.

    ``driven`` are granules that are known to be driven, apart from those that a fix leads.
    """
    granules = probes.granules

    def replayed(leads: bool) -> tuple[Watched, Applied]:
        with start.session() as lammps:
            replay = Replay(lammps, granules, between, begin, leads)
            # LAMMPS may refuse to run such granules even at rest.
            return _played(source, replay, RunFailed), replay.applied()

    seen, applied = replayed(leads=False)
    leading = [fix.granules for fix in applied.fixes if fix.style == LEADS]
    seen.driven = np.any([driven, *leading], axis=0)
    if leading:
        led, _ = replayed(leads=True)
        seen.lead(led.driven_time, led.driven_ends)
    elif np.any(driven):
        time = applied.time
        ways = np.outer(time, granules.velocity[[0, -1], 0])
        seen.lead(time, granules.position[[0, -1], 0] + ways)
    return seen, applied


def looked(start: Start, path: Path, folder: Path, variables: Mapping[str, str]) -> Look:
    """Do the work of ``look`` in this process."""
    source = Source(str(path), folder / path, folder, variables)
    with start.session() as lammps:
        first = First(lammps, Sizes())
        seen = _played(source, first, RunFailed)
    probes = first.probes
    # Most granules of a chain whose runs are played for lint (chosen)
    if probes is None or not 1 < probes.granules.count <= 2000 or not probes.granules.is_chain:
        return Look(seen.commands, seen.stopped, probes)
    nobody = np.zeros(probes.granules.count, bool)
    seen, applied = without_motion(start, source, probes, _READ_EVERY * probes.contact_time, nobody)
    return Look(seen.commands, seen.stopped, probes, tuple(seen.runs), applied)


# ---- The generated deck: the same probes, but without motion

DEPTH = 0.01
"""Overlap at which contacts are pressed [smallest radius], and a third, a tenth, a hundredth and
three times of it: independent of the shock, so that forces have all digits even if it is weak."""


def examine_deck(folder: Path, scene: Scene, text: str, program: Program | None) -> FoundDeck:
    """Return what LAMMPS finds in the deck of a scene; the folder outlives the process."""
    path = folder / "in.generated"
    path.write_text(text)
    start, source = Start(folder, program, alone=False), Source("generated", path, folder)
    probes, _ = probed(start, source, replace(Sizes.of(scene), overlap=DEPTH))
    driven = np.zeros(probes.granules.count, bool)
    seen, applied = without_motion(start, source, probes, 0.0, driven)
    return contents_of(probes, seen, applied, backwards=False)


def examined_deck(scene: Scene, pair_style: str, version: str) -> str:
    """Return the generated deck, with a few steps on each leg of the shock."""
    # Natural time units; step of the schedule whose corners are examined
    # Readings of the applied force on a leg, besides its start
    legs = [leg.in_steps(4) for leg in scene.schedule(0.01 * scene.units.time)]
    lines = [deck.set_up(scene, pair_style, version)]
    for before, leg in zip((None, *legs[:-1]), legs, strict=True):
        lines += [*deck.leg_commands(scene, leg, before), f"run {leg.steps}"]
    return "\n".join(lines) + "\n"
