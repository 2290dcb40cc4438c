"""A LAMMPS input script as text: its commands, its variables, the value of its formulas.

Nothing is run. What cannot be known without running it (thermo keywords, computes, loops, files)
has no value: None.
"""

from __future__ import annotations

import re
from bisect import bisect_left
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from hertzchain.decks.lint.arithmetic import LONGEST, Definition, Lookup, known_value, names_in


@dataclass(frozen=True)
class Command:
    """One command."""

    place: int  # its number among the commands, from 0
    line: int  # where it starts, from 1
    words: tuple[str, ...]  # name and arguments, ${x} and $(formula) filled in where known
    raw: tuple[str, ...]  # the same as written
    conditional: bool  # in if, run every or a loop: carried out never, or often

    @property
    def name(self) -> str:
        """What it does."""
        return self.words[0]

    @property
    def arguments(self) -> tuple[str, ...]:
        """All words but the first."""
        return self.words[1:]

    def after(self, keyword: str) -> str | None:
        """The word that follows a keyword among the arguments, if any."""
        words = self.words[1:]
        for word, value in pairwise(words):
            if word == keyword:
                return value
        return None


@dataclass(frozen=True)
class Script:
    """The commands of an input script, in the order they are written, and its variables."""

    commands: tuple[Command, ...]
    definitions: Mapping[str, Sequence[Definition]]

    def named(self, *names: str) -> list[Command]:
        """The commands of these names."""
        return [command for command in self.commands if command.name in names]

    def formula(self, variable: str, place: int) -> str | None:
        """The formula or text of a variable at a command; None where it has none."""
        found = self._definition(variable, place)
        return None if found is None else found.text

    def value(
        self, text: str, place: int, known: Mapping[str, float] | None = None
    ) -> float | None:
        """The value of a formula or number at a command; ``known``: keywords such as ``time``."""
        return known_value(text, self._definition, place, known or {}, 0)

    def names_in(self, text: str, place: int) -> set[str]:
        """All names that a formula uses, through its variables too."""
        return names_in(text, self._definition, place, 0)

    def _definition(self, variable: str, place: int) -> Definition | None:
        return _latest(self.definitions.get(variable, ()), place)


def _latest(made: Sequence[Definition], place: int) -> Definition | None:
    """The last definition before a command, if it has a text."""
    k = bisect_left(made, place, key=lambda definition: definition.place)
    return made[k - 1] if k and made[k - 1].style in ("text", "equal") else None


def parse(text: str) -> Script:
    """Read an input script; any text gives one."""
    commands: list[Command] = []
    made: dict[str, list[Definition]] = {}

    def look_up(variable: str, place: int) -> Definition | None:
        return _latest(made.get(variable, ()), place)

    def add(line: int, written: str, conditional: bool, depth: int) -> None:
        raw = _words(written)
        if not raw:
            return
        place = len(commands)
        words = tuple(_filled(word, look_up, place) for word in raw)
        command = Command(place, line, words, raw, conditional)
        commands.append(command)
        _define(command, made)
        if depth < 3:
            for inner in _inner(raw):
                add(line, inner, True, depth + 1)

    looping = False
    for line, written in _logical_lines(text):
        first = written.split(None, 1)[:1]
        looping = looping or first == ["label"]
        add(line, written, looping, 0)
        if first == ["jump"]:
            looping = False
    return Script(tuple(commands), made)


def _logical_lines(text: str) -> Iterator[tuple[int, str]]:
    """Lines without comments, each joined with those that it goes on in, with its number."""
    whole, start, open_quotes = "", 0, False
    for number, written in enumerate(text.splitlines(), start=1):
        if not whole:
            start = number
        piece = written if open_quotes else written.rstrip()
        if not open_quotes and piece.endswith("&"):
            whole += piece[:-1] + " "
            continue
        whole += piece
        open_quotes ^= piece.count('"""') % 2 == 1
        if open_quotes:
            whole += "\n"
            continue
        yield start, _without_comment(whole)
        whole = ""
    if whole:
        yield start, _without_comment(whole)


_QUOTED = re.compile(r'"""(?s:.*?)"""|"[^"]*"|\'[^\']*\'')
_WORD = re.compile(r'"""((?s:.*?))"""|"([^"]*)"|\'([^\']*)\'|(\S+)')


def _without_comment(line: str) -> str:
    if "#" not in line:
        return line
    at = 0
    while at < len(line):
        if line[at] == "#":
            return line[:at]
        quoted = _QUOTED.match(line, at) if line[at] in "\"'" else None
        at = quoted.end() if quoted else at + 1
    return line


def _words(line: str) -> tuple[str, ...]:
    found = _WORD.finditer(_closed_up(line))
    return tuple(next(group for group in match.groups() if group is not None) for match in found)


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


def _inner(raw: Sequence[str]) -> list[str]:
    """The commands inside a command."""
    if raw[0] == "if":
        return [word for word in raw[3:] if word not in ("elif", "else", "then")]
    if raw[0] == "run" and "every" in raw:
        return [word for word in raw[raw.index("every") + 2 :] if word != "NULL"]
    return []


def _define(command: Command, made: dict[str, list[Definition]]) -> None:
    """Note what a command makes of a variable."""
    words = command.words
    if command.name == "next":
        for variable in words[1:]:
            made.setdefault(variable, []).append(Definition(command.place, "unknown", ""))
    if command.name != "variable" or len(words) < 3:
        return
    variable, style = words[1], words[2]
    before = made.setdefault(variable, [])
    if style in ("index", "string", "equal", "internal") and len(words) > 3:
        if style == "index" and before and before[-1].style != "deleted":
            return  # the first one, or that of the command line, stays
        kind = "text" if style in ("index", "string") else "equal"
        text = words[3] if style != "equal" else " ".join(words[3:])
        before.append(Definition(command.place, "unknown" if command.conditional else kind, text))
    else:
        before.append(Definition(command.place, "deleted" if style == "delete" else "unknown", ""))


_BRACED = re.compile(r"\$\{(\w+)\}|\$([A-Za-z])(?![\w(])")


def _filled(word: str, look_up: Lookup, place: int) -> str:
    """A word with the values of variables in it; what is unknown stays as it is written."""
    if "$" not in word or len(word) > LONGEST:
        return word

    def text_of(match: re.Match[str]) -> str:
        found = look_up(match[1] or match[2], place)
        if found is None:
            return match[0]
        if found.style == "text":
            return found.text
        value = known_value(found.text, look_up, place, {}, 0)
        return match[0] if value is None else repr(value)

    filled = _BRACED.sub(text_of, word)
    for formula in _immediate(filled):
        inside = re.sub(r":%[^:]*$", "", formula[2:-1])
        value = known_value(inside, look_up, place, {}, 0)
        if value is not None:
            filled = filled.replace(formula, repr(value))
    return filled if len(filled) <= LONGEST else word


def _immediate(word: str) -> list[str]:
    """The ``$(...)`` in a word."""
    found: list[str] = []
    at = word.find("$(")
    while at >= 0 and len(found) < 100:
        depth = 0
        for k in range(at + 1, len(word)):
            depth += (word[k] == "(") - (word[k] == ")")
            if depth == 0:
                found.append(word[at : k + 1])
                break
        else:
            break
        at = word.find("$(", k)
    return found
