"""A LAMMPS input script as the rules of lint see it: its commands in their order.

They are those that LAMMPS has carried out, with the values of variables; where it was not asked, or
has stopped, the rest is the text as it is written.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

from hertzchain.engines.lammps.reading.text import in_ascii, lines_of, without_comment, words_of
from hertzchain.files import read_bytes

if TYPE_CHECKING:
    from hertzchain.engines.lammps.reading.found import Executed

MOST_BYTES = 5_000_000  # of a deck and all that it includes: more are not written by hand
_DEEPEST, _MOST_FILES = 15, 100  # files that include one another, as in LAMMPS; and all (chosen)


@dataclass(frozen=True)
class Command:
    """One command.

    Parameters
    ----------
    place
        Its number among the commands.
    line
        Line of the deck, from 1, in which it, or the file that brings it, stands.
    inside
        Where it stands in an included file, as ``name:line``; empty in the deck itself.
    words
        Name and arguments, with values where they are known.
    raw
        The same as written.
    index
        Its number among the commands that LAMMPS carried out; None for one that is text.
    """

    place: int
    line: int
    inside: str
    words: tuple[str, ...]
    raw: tuple[str, ...]
    index: int | None = None

    @property
    def name(self) -> str:
        """What it does."""
        return self.words[0]

    def word(self, k: int) -> str:
        """A word of it; empty where there are not so many."""
        return self.words[k] if k < len(self.words) else ""

    def after(self, keyword: str) -> str | None:
        """The word that follows a keyword among the arguments, if any."""
        return next((b for a, b in pairwise(self.words[1:]) if a == keyword), None)


def number(word: str | None) -> float | None:
    """The finite number that a word is, or None."""
    if word is None or "_" in word:
        return None
    try:
        value = float(word)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def types_of(word: str, count: int) -> range | None:
    """The types of a word such as 2, *, 2*3; None for one that cannot be known."""
    match = re.fullmatch(r"(\d*)(\*?)(\d*)", word)
    if not word or match is None or (not match[2] and match[3]):
        return None
    first = int(match[1] or 1)
    last = first if not match[2] else int(match[3] or count)
    return range(first, last + 1)


def script_of(
    path: Path,
    text: str,
    carried_out: Sequence[Executed] = (),
    stopped: bool = True,
) -> list[Command]:
    """The commands of a deck: those carried out, and the text behind them if LAMMPS stopped."""
    found: list[Command] = []
    line = 0
    for index, done in enumerate(carried_out):
        own = Path(done.file) == path
        line = done.line if own else line
        inside = "" if own else f"{Path(done.file).name}:{done.line}"
        words = _split(done.text)
        raw = _split(done.written)
        raw = raw if raw[:1] == words[:1] else words  # of an if, or run every
        if words:
            found.append(Command(len(found), line, inside, words, raw, index))
    if stopped:
        for at, inside, words in _Reader(path.parent).commands(text):
            if at > line:
                found.append(Command(len(found), at, inside, words, words))
    return found


def names_in(text: str, commands: Iterable[Command], place: int) -> set[str]:
    """All names in a formula before a command, through the variables in it too."""
    formulas = {
        command.words[1]: " ".join(command.words[3:])
        for command in commands
        if command.name == "variable" and len(command.words) > 3 and command.place < place
    }
    names: set[str] = set()
    wanted, seen = [text], set[str]()
    while wanted:
        found = set(re.findall(r"[A-Za-z_]\w*", wanted.pop()))
        names |= found
        for name in sorted(found):
            if name.startswith("v_") and name[2:] in formulas and name not in seen:
                seen.add(name)
                wanted.append(formulas[name[2:]])
    return names


class _Reader:
    """Commands of a text, with those of the files that it includes in their place."""

    def __init__(self, folder: Path) -> None:
        self._folder, self._bytes, self._files = folder, MOST_BYTES, _MOST_FILES

    def commands(self, text: str, depth: int = 0) -> Iterator[tuple[int, str, tuple[str, ...]]]:
        """Line, place in an included file, and words of each command."""
        for line in lines_of(in_ascii(text)):
            words = _split(without_comment(line.text))
            if not words:
                continue
            brought = self._read(words[1], depth) if words[0] == "include" and words[1:] else None
            if brought is None:
                yield line.number, "", words
                continue
            for at, inside, inner in self.commands(brought, depth + 1):
                yield line.number, inside or f"{Path(words[1]).name}:{at}", inner

    def _read(self, name: str, depth: int) -> str | None:
        """The text of a file; None where it cannot be read."""
        if depth >= _DEEPEST or self._files == 0:
            return None
        try:
            content = read_bytes(self._folder / name, self._bytes)
        except (OSError, ValueError):
            return None
        self._files -= 1
        self._bytes -= len(content)
        return content.decode("utf-8-sig", errors="replace")


def _split(text: str) -> tuple[str, ...]:
    return tuple(word.value for word in words_of(_closed_up(text)))


def _closed_up(line: str) -> str:
    """A line whose ``$(...)`` have no blanks in them, as LAMMPS fills them in before it splits."""
    if "$(" not in line:
        return line
    pieces: list[str] = []
    depth, at = 0, 0
    for k, character in enumerate(line):
        if depth == 0 and line.startswith("$(", k):
            depth, at = 1, k + 1
        elif depth and k > at:
            depth += (character == "(") - (character == ")")
        if not (depth and character.isspace()):
            pieces.append(character)
    return "".join(pieces)
