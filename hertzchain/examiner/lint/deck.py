"""A deck in the form for the rules of lint: its commands in order, and what LAMMPS finds in it.

The commands are those that LAMMPS has carried out, with the values of variables. If LAMMPS did not
run, or has stopped, the rest is the text as written.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from hertzchain.engines.lammps.dialect import DEFAULT_SKIN, NUMBERS_OF
from hertzchain.engines.lammps.reading.text import (
    closed,
    in_ascii,
    lines_of,
    number,
    without_comment,
    words_of,
)

if TYPE_CHECKING:
    from hertzchain.arrays import FloatArray
    from hertzchain.engines.lammps.reading.contents import Executed
    from hertzchain.engines.lammps.reading.frozen import Applied
    from hertzchain.engines.lammps.reading.probing import Granules
    from hertzchain.engines.lammps.reading.reading import Look

MOST_BYTES = 5_000_000  # of a deck: more are not written by hand


@dataclass(frozen=True)
class Command:
    """One command."""

    place: int  # its number among the commands
    line: int  # line of the deck, from 1, with it or with the ``include`` of its file
    inside: str  # where it stands in an included file, as ``name:line``; else empty
    words: tuple[str, ...]  # name and arguments, with values where they are known
    raw: tuple[str, ...]  # the same as written
    index: int | None = None  # among those that LAMMPS carried out; None for text

    @property
    def name(self) -> str:
        """Its first word."""
        return self.words[0]

    def word(self, k: int) -> str:
        """Its k-th word; empty if it has fewer."""
        return self.words[k] if k < len(self.words) else ""

    def after(self, keyword: str) -> str | None:
        """The word that follows a keyword among the arguments, if any."""
        return next((b for a, b in pairwise(self.words[1:]) if a == keyword), None)


def script_of(
    path: Path,
    text: str,
    carried_out: Sequence[Executed] = (),
    stopped: bool = True,
) -> list[Command]:
    """The commands of a deck: those carried out, and the text behind them if LAMMPS stopped."""
    commands: list[Command] = []
    line = 0
    for index, done in enumerate(carried_out):
        in_deck = Path(done.file) == path
        line = done.line if in_deck else line
        inside = "" if in_deck else f"{Path(done.file).name}:{done.line}"
        words = _split(done.text)
        raw = _split(done.written)
        raw = raw if raw[:1] == words[:1] else words  # of an if, or run every
        if words:
            commands.append(Command(len(commands), line, inside, words, raw, index))
    if stopped:
        for written_line in lines_of(in_ascii(text)):
            words = _split(without_comment(written_line.text))
            if words and written_line.number > line:
                commands.append(Command(len(commands), written_line.number, "", words, words))
    return commands


def _split(text: str) -> tuple[str, ...]:
    return tuple(word.value for word in words_of(_closed_up(text)))


def _closed_up(line: str) -> str:
    """Return a line without blanks in ``$(...)``, which LAMMPS evaluates before it splits words."""
    text, k = "", 0
    while (start := line.find("$(", k)) >= 0:
        end = closed(line, start + 1)
        if end is None:
            break
        text += line[k:start] + "".join(line[start:end].split())
        k = end
    return text + line[k:]


# ---- A deck

Severity = Literal["error", "warning", "note"]


@dataclass(frozen=True)
class Finding:
    """One thing that is wrong, or worth knowing, in a deck."""

    line: int  # from 1
    rule: str
    severity: Severity  # wrong or stops; likely not intended; costs time, or is worth knowing
    text: str  # what is wrong, and what to write instead


Found = Iterator[tuple[Command | None, Severity, str]]  # command (None: line 1), severity, sentence

_STYLE = {"fix": 3, "dimension": 1, "bond_style": 1, "atom_style": 1}
"""Index of the word of a command that is its style."""

_NO_CHAIN = (
    ("fix", "(pour|deposit|insert)(/.*)?", "granules are poured"),
    ("fix", "rigid.*|multisphere.*|poems", "granules are rigid bodies of several spheres"),
    ("bond_style", "(?!none).+", "granules are bonded"),
    ("atom_style", "bpm/.*|bond|molecular|full", "granules are bonded"),
    ("atom_style", "(?!sphere|granular|hybrid|.*[$]).+", "its atoms are no spheres"),
)
"""Signs of a deck that is certainly no chain: a command, its style, and the words for it."""

_HARDLY_A_CHAIN = (
    ("fix", "wall/gran/region|mesh/.*|wall/region", "granules lie in a vessel"),
    ("fix", "freeze", "granules are frozen"),
    ("dimension", "2", "it is two-dimensional"),
)
"""Signs of a deck that is no chain, unless its granules are known to lie in one row."""

_OF_LIGGGHTS = re.compile("(property/global|particletemplate/|particledistribution/|mesh/).*")
"""Fixes that only LIGGGHTS has."""


CLASSIC = "gran/hooke", "gran/hooke/history", "gran/hertz/history"
"""The pair styles of granules whose numbers are Kn, Kt, gamma_n, gamma_t, friction, 0 or 1."""


@dataclass(frozen=True)
class Law:
    """A contact law as a deck states it: the command, its normal model and its numbers.

    The second number is the damping.
    """

    command: Command
    normal: str
    numbers: tuple[str, ...]


class Deck:
    """The commands of a deck, and what LAMMPS finds in it (None if LAMMPS did not read it)."""

    def __init__(self, commands: Sequence[Command], look: Look | None = None) -> None:
        self.commands, self.look = commands, look

    def named(self, *names: str) -> list[Command]:
        """The commands of these names."""
        return [command for command in self.commands if command.name in names]

    def _last(self, name: str) -> Command | None:
        """The last command of this name that has a word."""
        return next((c for c in self.named(name)[::-1] if c.word(1)), None)

    def fixes(self, *styles: str) -> list[Command]:
        """The fixes of these styles, or all."""
        fixes = [fix for fix in self.named("fix") if len(fix.words) > 3]
        return [fix for fix in fixes if not styles or fix.words[3] in styles]

    def carried_out(self, index: int | None) -> Command | None:
        """The command with an index among those that LAMMPS carried out."""
        return next((c for c in self.commands if index is not None and c.index == index), None)

    @cached_property
    def unread(self) -> list[Command]:
        """Commands that read other commands, which are not known."""
        last = None if self.look is None or not self.look.stopped else len(self.look.commands) - 1
        readers = [c for c in self.named("include") if c.index is None or c.index == last]
        if self.look is None or self.look.stopped:
            readers += [jump for jump in self.named("jump") if jump.word(1) != "SELF"]
        return [*readers, *self.named("read_restart")]

    @cached_property
    def is_partial(self) -> bool:
        """Whether parts of it are elsewhere: files that are not known, restarts, programs."""
        return bool(self.unread or self.named("python", "plugin"))

    @cached_property
    def units(self) -> str:
        """The units that it uses."""
        last = self._last("units")
        return "lj" if last is None else last.words[1]

    @cached_property
    def pair_style(self) -> Command | None:
        """The last pair style."""
        return self._last("pair_style")

    @cached_property
    def contact_style(self) -> tuple[str, ...]:
        """LAMMPS's pair style of granules and its numbers, also of a hybrid one; else empty."""
        words = () if self.pair_style is None or self.is_of_liggghts else self.pair_style.words
        for k, word in enumerate(words):
            if word.split("/")[0] in ("granular", "gran"):
                return (re.sub("/(omp|kk.*)", "", word), *words[k + 1 :])
        return ()

    @cached_property
    def is_granular(self) -> bool:
        """Whether the deck has contact laws of granules."""
        return bool(self.contact_style)

    @cached_property
    def is_of_liggghts(self) -> bool:
        """Whether it is a deck of LIGGGHTS, which is like LAMMPS except for the contact laws."""
        return bool(
            self.named("hard_particles", "coarsegraining")
            or any(style.word(1) == "gran" for style in self.named("pair_style"))
            or any(_OF_LIGGGHTS.match(fix.word(3)) for fix in self.fixes())
        )

    @cached_property
    def laws(self) -> list[Law]:
        """The contact laws between granules, and those of granular walls."""
        laws: list[Law] = []
        style = self.contact_style
        if style[:1] and style[0] in CLASSIC and len(style) > 3 and self.pair_style is not None:
            laws.append(Law(self.pair_style, style[0], (style[1], style[3])))
        elif self.is_granular:
            for command in self.named("pair_coeff"):
                rest = command.words[3:]
                laws += _law(command, rest[1:] if rest[:1] == ("granular",) else rest)
        walls = [w for w in self.fixes("wall/gran", "wall/gran/region") if w.word(4) == "granular"]
        return [*laws, *(law for wall in walls for law in _law(wall, wall.words[5:]))]

    def given(self, attribute: str) -> list[tuple[Command, str]]:
        """The ``set`` commands that give an attribute, and what they give."""
        each = ((command, command.after(attribute)) for command in self.named("set"))
        return [(command, value) for command, value in each if value is not None]

    @cached_property
    def runs(self) -> list[Command]:
        """The runs that take steps, or may."""
        return [
            command
            for command in self.named("run", "minimize", "rerun")
            if command.name != "run" or number(command.word(1)) != 0
        ]

    @cached_property
    def may_run(self) -> bool:
        """Whether it takes steps, or may: in files or conditions that are not known."""
        is_known = self.look is not None and not self.look.stopped
        unknown = [] if is_known else self.named("if", "include", "jump")
        return bool(self.runs or unknown or self.is_partial)

    @cached_property
    def granules(self) -> Granules | None:
        """The granules of a chain before the first run."""
        granules = None if self.look is None else self.look.granules
        is_row = granules is not None and granules.count > 1 and granules.is_chain
        return granules if is_row else None

    @cached_property
    def applied(self) -> Applied | None:
        """The forces of fixes during its runs; None where they are not known."""
        applied = None if self.look is None else self.look.applied
        return applied if applied is not None and applied.time.size else None

    @cached_property
    def pushes(self) -> dict[int, FloatArray]:
        """The largest force of each ``fix addforce`` on each granule, by the index of its command.

        Shape (granules, 2): along the chain and across.
        """
        fixes = () if self.applied is None else self.applied.fixes
        return {fix.command: fix.largest for fix in fixes if fix.style == "addforce"}

    @cached_property
    def is_loaded(self) -> bool:
        """Whether forces that never change press the chain: gravity, or static loads."""
        return bool(self.fixes("gravity")) or (
            self.applied is not None and bool(self.applied.constant.any())
        )

    @cached_property
    def skin(self) -> float | None:
        """Distance beyond a contact within which neighbours are listed."""
        given = [command for command in self.named("neighbor") if command.word(1)]
        return number(given[-1].word(1)) if given else DEFAULT_SKIN.get(self.units)

    @cached_property
    def no_chain(self) -> tuple[Command | None, str] | None:
        """Why it is certainly no chain, and the command that shows it; None if it may be one."""
        if self.is_other or self.granules is not None:
            return self.is_other
        unlikely = self._first_of(_HARDLY_A_CHAIN)
        if unlikely is None and self.look is not None and self.look.granules is not None:
            maker = next(iter(self.named("create_atoms", "read_data")), None)
            count = self.look.granules.count
            rows = f"its {count} granules do not lie in one row"
            return maker, rows if count > 1 else "it has one granule"
        return unlikely

    @cached_property
    def is_other(self) -> tuple[Command, str] | None:
        """The command that excludes a chain, wherever granules lie, and the words for it."""
        return self._first_of(_NO_CHAIN)

    def _first_of(self, signs: Sequence[tuple[str, str, str]]) -> tuple[Command, str] | None:
        for command in self.commands:
            for name, style, what in signs:
                if command.name == name and re.fullmatch(style, command.word(_STYLE[name])):
                    return command, what
        return None

    @cached_property
    def boundary(self) -> Command | None:
        """The last command that sets the boundary."""
        box = [c for c in self.named("change_box") if "boundary" in c.words]
        return next(iter([*box[::-1], *self.named("boundary")[::-1]]), None)


def _law(command: Command, words: tuple[str, ...]) -> list[Law]:
    count = NUMBERS_OF.get(" ".join(words[:1]))
    if count is None or len(words) <= count:
        return []
    return [Law(command, words[0], words[1 : 1 + count])]
