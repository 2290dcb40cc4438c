"""A LAMMPS input script as text: its commands, its variables, the value of its formulas.

Nothing is run. What cannot be known without running it (thermo keywords, computes, files) has no
value: None. Loops over known values are written out, ``if`` with a known condition is decided.
"""

from __future__ import annotations

import re
from bisect import bisect_left
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from hertzchain.verdict.lint.arithmetic import (
    LONGEST,
    Definition,
    Lookup,
    known_value,
    names_in,
    number,
)


@dataclass(frozen=True)
class Command:
    """One command."""

    place: int  # its number among the commands, from 0
    line: int  # where it starts, from 1
    words: tuple[str, ...]  # name and arguments, ${x} and $(formula) filled in where known
    raw: tuple[str, ...]  # the same as written
    conditional: bool  # in if, run every or a loop: carried out never, or often
    never: bool = False  # in the branch of an ``if`` that is not taken

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
    comments: tuple[tuple[int, str], ...] = ()  # line and text of each

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


def parse(text: str, variables: Mapping[str, str] | None = None) -> Script:
    """Read an input script; any text gives one.

    ``variables`` are those of the command line: the first definition of style index stays.
    """
    lines = list(_logical_lines(text))
    reader = _Reader(lines)
    for name, value in (variables or {}).items():
        reader.given(name, value)
    reader.carry_out(0, len(lines), looping=False)
    return Script(tuple(reader.commands), reader.made, _comments(text))


_MOST_WRITTEN_OUT = 10_000  # commands of all loops together: chains have about 100 granules


class _Reader:
    """Reads commands in the order in which LAMMPS carries them out, as far as it is known."""

    def __init__(self, lines: Sequence[tuple[int, str]]) -> None:
        self._lines = lines
        self.commands: list[Command] = []
        self.made: dict[str, list[Definition]] = {}
        self._values: dict[str, list[str]] = {}  # of variables that loops count with
        self._left = _MOST_WRITTEN_OUT
        self._jumps: dict[str, list[int]] = {}  # lines that jump to a label
        self._written: dict[str, list[int]] = {}  # lines that define a variable to count with
        for at, (_, written) in enumerate(lines):
            words = written.split(None, 3)[:3]
            if len(words) == 3 and words[0] == "variable" and words[2] in ("index", "loop"):
                self._written.setdefault(words[1], []).append(at)
            if len(words) == 3 and words[:2] == ["jump", "SELF"]:
                self._jumps.setdefault(words[2], []).append(at)

    def given(self, variable: str, value: str) -> None:
        """Note a variable of the command line, which has the words of its value one by one."""
        values = value.split() or [""]
        self._define(variable, "text", values[0])
        self._values[variable] = values

    def carry_out(self, first: int, last: int, looping: bool) -> None:
        """Read some lines; ``looping``: in a loop that is not written out."""
        at = first
        while at < last:
            line, written = self._lines[at]
            head = written.split(None, 2)[:2]
            at += 1
            end = None if looping or head[:1] != ["label"] else self._end_of_loop(at, last, head)
            if end is None:
                looping = looping or head[:1] == ["label"]
                self._add(line, written, looping, 0)
                looping = looping and head[:1] != ["jump"]
                continue
            variable = self._lines[end][1].split()[1]
            values = self._values.pop(variable)
            self._left -= len(values) * (end - at)
            for value in values:
                self._define(variable, "text", value)
                self.carry_out(at, end, looping=False)
            self._define(variable, "deleted", "")
            at = end + 2

    def _end_of_loop(self, at: int, last: int, head: Sequence[str]) -> int | None:
        """The line of ``next`` of a loop that begins here; None where it is not known what it does.

        Its last lines are ``next VARIABLE`` and ``jump SELF LABEL``, and nothing else jumps.
        """
        jumps = self._jumps.get(" ".join(head[1:]), [])
        k = bisect_left(jumps, at + 1)
        if k == len(jumps) or jumps[k] >= last:
            return None
        end = jumps[k] - 1
        words = self._lines[end][1].split()
        if len(words) != 2 or words[0] != "next":
            return None
        if words[1] not in self._values and not self._is_defined_within(words[1], at, end):
            return None
        if max(1, len(self._values[words[1]])) * (end - at) > self._left:
            return None
        body = self._lines[at:end]
        leaves = any("jump" in written and "if" in written.split()[:1] for _, written in body)
        return None if leaves else end

    def _is_defined_within(self, variable: str, at: int, end: int) -> bool:
        """Whether a loop defines what it counts with in its first round; later ones ignore that."""
        lines = self._written.get(variable, [])
        k = bisect_left(lines, at)
        if k == len(lines) or lines[k] >= end:
            return False
        raw, place = _words(self._lines[lines[k]][1]), len(self.commands)
        values = _values_of([_filled(word, self._look_up, place) for word in raw])
        if values is not None:
            self._values[variable] = values
        return values is not None

    def _define(self, variable: str, style: str, text: str) -> None:
        self.made.setdefault(variable, []).append(Definition(len(self.commands) - 1, style, text))

    def _look_up(self, variable: str, place: int) -> Definition | None:
        return _latest(self.made.get(variable, ()), place)

    def _add(
        self, line: int, written: str, conditional: bool, depth: int, never: bool = False
    ) -> None:
        raw = _words(written)
        if not raw:
            return
        place = len(self.commands)
        words = tuple(_filled(word, self._look_up, place) for word in raw)
        command = Command(place, line, words, raw, conditional, never)
        self.commands.append(command)
        if not never and not self._exists(command):
            _define(command, self.made)
            self._note_values(command)
        if depth >= 3:
            return
        if raw[0] == "if":
            for taken, inner in self._branches(command):
                unsure = conditional or taken is not True
                self._add(line, inner, unsure, depth + 1, never or taken is False)
        elif raw[0] == "run" and "every" in raw:
            for inner in raw[raw.index("every") + 2 :]:
                if inner != "NULL":
                    self._add(line, inner, True, depth + 1, never)

    def _exists(self, command: Command) -> bool:
        """Whether a command defines a variable that stays as it is, as it exists."""
        words = command.words
        if command.name != "variable" or len(words) < 4 or words[2] not in ("index", "loop"):
            return False
        before = self.made.get(words[1], [])
        return bool(before) and before[-1].style != "deleted"

    def _note_values(self, command: Command) -> None:
        """Note the values that a variable of style ``loop`` or ``index`` goes through."""
        words = command.words
        if command.name != "variable" or len(words) < 4:
            return
        self._values.pop(words[1], None)
        values = _values_of(words)
        if values is not None and not (words[2] == "loop" and command.conditional):
            self._values[words[1]] = values

    def _branches(self, command: Command) -> Iterator[tuple[bool | None, str]]:
        """The commands in an ``if``, each with whether it is carried out, if that is known."""
        taken: bool | None = None
        decided: bool | None = False  # whether an earlier branch is taken
        position = "if"
        for word, raw in zip(command.words, command.raw, strict=True):
            if position in ("if", "elif") and word != "if":
                value = known_value(word, self._look_up, command.place, {}, 0)
                holds = None if value is None else value != 0
                taken = False if decided or holds is False else None if decided is None else holds
                decided = True if taken else None if decided is None or holds is None else decided
                position = "then"
            elif word in ("elif", "else"):
                position = word
                if word == "else":
                    taken = None if decided is None else not decided
            elif word not in ("if", "then"):
                yield taken, raw


def _values_of(words: Sequence[str]) -> list[str] | None:
    """What a variable goes through, by the words of its definition; None where it is not known."""
    style = words[2] if len(words) > 3 else ""
    if style == "index":
        return list(words[3:])
    if style != "loop":
        return None
    ends = [number(word) for word in words[3:] if word != "pad"]
    known = [int(end) for end in ends if end is not None]
    if len(known) != len(ends) or len(known) not in (1, 2):
        return None
    low, high = (1, known[0]) if len(known) == 1 else known
    return [str(k) for k in range(low, high + 1)] if high - low < _MOST_WRITTEN_OUT else None


def _logical_lines(text: str) -> Iterator[tuple[int, str]]:
    """Lines without comments, each joined with those that it goes on in, with its number."""
    whole, start, open_quotes = "", 0, False
    for line, written in enumerate(text.splitlines(), start=1):
        if not whole:
            start = line
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


def _comments(text: str) -> tuple[tuple[int, str], ...]:
    """Comments with their lines, as they stand alone or after a command."""
    found: list[tuple[int, str]] = []
    for line, written in enumerate(text.splitlines(), start=1):
        kept = _without_comment(written)
        if len(kept) < len(written):
            found.append((line, written[len(kept) + 1 :].strip()))
    return tuple(found)


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
        kind = "text" if style in ("index", "string") else "equal"
        text = words[3] if style != "equal" else " ".join(words[3:])
        before.append(Definition(command.place, "unknown" if command.conditional else kind, text))
    elif style == "format" and len(words) > 3 and not command.conditional:
        before.append(Definition(command.place, "equal", f"v_{words[3]}"))
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
