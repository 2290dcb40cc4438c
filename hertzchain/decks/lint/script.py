"""A LAMMPS input script as text: its commands, its variables, the value of its formulas.

Nothing is run. What cannot be known without running it (thermo keywords, computes, loops, files)
has no value: None.
"""

from __future__ import annotations

import functools
import math
import operator
import re
from bisect import bisect_left
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

_DEEPEST = 30
"""Of variables that name variables, and of parentheses: deeper ones have no value."""

_LONGEST = 10_000
"""Characters of a formula, and of a line after its variables are filled in."""


@dataclass(frozen=True)
class Command:
    """One command.

    Parameters
    ----------
    place
        Its number among the commands, from 0.
    line
        The line that it starts on, from 1.
    words
        Name and arguments, with ``${x}`` and ``$(formula)`` filled in where their value is known.
    raw
        The same as written.
    conditional
        Whether it stands inside another command (``if``, ``run every``) or in a loop, so that it
        may be carried out never, or more than once.
    """

    place: int
    line: int
    words: tuple[str, ...]
    raw: tuple[str, ...]
    conditional: bool

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
class _Definition:
    place: int
    style: str
    text: str


@dataclass(frozen=True)
class Script:
    """The commands of an input script, in the order they are written.

    Parameters
    ----------
    commands
        All of them.
    definitions
        What each variable was made, and by which command.
    """

    commands: tuple[Command, ...]
    definitions: Mapping[str, Sequence[_Definition]]

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
        """The value of a formula at a command.

        Parameters
        ----------
        text
            The formula, as LAMMPS has it; a number too.
        place
            The number of the command: variables have the value that they have there.
        known
            Values of keywords such as ``time``.
        """
        return _value(text, self._definition, place, known or {}, 0)

    def names_in(self, text: str, place: int) -> set[str]:
        """All names that a formula uses, through its variables too."""
        return _names(text, self._definition, place, 0)

    def _definition(self, variable: str, place: int) -> _Definition | None:
        return _latest(self.definitions.get(variable, ()), place)


_Lookup = Callable[[str, int], "_Definition | None"]


def _latest(made: Sequence[_Definition], place: int) -> _Definition | None:
    """The last definition before a command, if it has a text."""
    k = bisect_left(made, place, key=lambda definition: definition.place)
    return made[k - 1] if k and made[k - 1].style in ("text", "equal") else None


def parse(text: str) -> Script:
    """Read an input script; any text gives one.

    Parameters
    ----------
    text
        The whole file.
    """
    commands: list[Command] = []
    made: dict[str, list[_Definition]] = {}

    def look_up(variable: str, place: int) -> _Definition | None:
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


def _define(command: Command, made: dict[str, list[_Definition]]) -> None:
    """Note what a command makes of a variable."""
    words = command.words
    if command.name == "next":
        for variable in words[1:]:
            made.setdefault(variable, []).append(_Definition(command.place, "unknown", ""))
    if command.name != "variable" or len(words) < 3:
        return
    variable, style = words[1], words[2]
    before = made.setdefault(variable, [])
    if style in ("index", "string", "equal", "internal") and len(words) > 3:
        if style == "index" and before and before[-1].style != "deleted":
            return  # the first one, or that of the command line, stays
        kind = "text" if style in ("index", "string") else "equal"
        text = words[3] if style != "equal" else " ".join(words[3:])
        before.append(_Definition(command.place, "unknown" if command.conditional else kind, text))
    else:
        before.append(_Definition(command.place, "deleted" if style == "delete" else "unknown", ""))


_BRACED = re.compile(r"\$\{(\w+)\}|\$([A-Za-z])(?![\w(])")


def _filled(word: str, look_up: _Lookup, place: int) -> str:
    """A word with the values of variables in it; what is unknown stays as it is written."""
    if "$" not in word or len(word) > _LONGEST:
        return word

    def text_of(match: re.Match[str]) -> str:
        found = look_up(match[1] or match[2], place)
        if found is None:
            return match[0]
        if found.style == "text":
            return found.text
        value = _value(found.text, look_up, place, {}, 0)
        return match[0] if value is None else repr(value)

    filled = _BRACED.sub(text_of, word)
    for formula in _immediate(filled):
        inside = re.sub(r":%[^:]*$", "", formula[2:-1])
        value = _value(inside, look_up, place, {}, 0)
        if value is not None:
            filled = filled.replace(formula, repr(value))
    return filled if len(filled) <= _LONGEST else word


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


def number(word: str | None) -> float | None:
    """The finite number that a word is, or None."""
    if word is None or "_" in word:
        return None
    try:
        value = float(word)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


_TOKEN = re.compile(
    r"\s*((?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?|[A-Za-z_]\w*|&&|\|\||\|\^|[<>=!]=|[-+*/^%()<>!,])"
)

_FUNCTIONS: dict[str, Callable[..., float]] = {
    "sqrt": math.sqrt, "exp": math.exp, "ln": math.log, "log": math.log10, "abs": abs,
    "sign": lambda x: 1.0 if x >= 0 else -1.0,
    "sin": math.sin, "cos": math.cos, "tan": math.tan,
    "asin": math.asin, "acos": math.acos, "atan": math.atan, "atan2": math.atan2,
    "ceil": math.ceil, "floor": math.floor, "round": lambda x: math.floor(x + 0.5),
    "ternary": lambda x, y, z: y if x else z,
}  # fmt: skip

_OPERATORS: tuple[dict[str, Callable[[float, float], float]], ...] = (
    {"||": lambda x, y: float(bool(x) or bool(y)), "|^": lambda x, y: float(bool(x) != bool(y))},
    {"&&": lambda x, y: float(bool(x) and bool(y))},
    {"==": lambda x, y: float(x == y), "!=": lambda x, y: float(x != y)},
    {
        "<": lambda x, y: float(x < y),
        "<=": lambda x, y: float(x <= y),
        ">": lambda x, y: float(x > y),
        ">=": lambda x, y: float(x >= y),
    },
    {"+": operator.add, "-": operator.sub},
    {"*": operator.mul, "/": operator.truediv, "%": math.fmod},
    {"^": math.pow},
)
"""From the weakest to the strongest, all from left to right, as LAMMPS has them."""

_JOINS = {
    sign: (rank, join) for rank, alike in enumerate(_OPERATORS) for sign, join in alike.items()
}


class _Unknown(Exception):
    """A formula, or a part of it, has no value that can be known."""


@functools.lru_cache  # the force of a deck is asked for at hundreds of times
def _tokens(text: str) -> tuple[str, ...]:
    found: list[str] = []
    at = 0
    text = text.rstrip()
    if len(text) > _LONGEST:
        raise _Unknown
    while at < len(text):
        match = _TOKEN.match(text, at)
        if match is None:
            raise _Unknown
        found.append(match[1])
        at = match.end()
    return tuple(found)


def _value(
    text: str, look_up: _Lookup, place: int, known: Mapping[str, float], depth: int
) -> float | None:
    if depth > _DEEPEST:
        return None
    try:
        reader = _Reader(_tokens(text), look_up, place, known, depth)
        value = float(reader.level(0, 0))
    except (_Unknown, ArithmeticError, ValueError, TypeError):
        return None
    return value if not reader.left and math.isfinite(value) else None


def _names(text: str, look_up: _Lookup, place: int, depth: int) -> set[str]:
    found: set[str] = set()
    for name in re.findall(r"(?<![\w.])[A-Za-z]\w*", text[:_LONGEST]):
        found.add(name)
        made = look_up(name[2:], place) if name.startswith("v_") else None
        if made is not None and depth < 5:
            found |= _names(made.text, look_up, place, depth + 1)
    return found


class _Reader:
    """Reads a formula by recursive descent."""

    def __init__(
        self,
        tokens: tuple[str, ...],
        look_up: _Lookup,
        place: int,
        known: Mapping[str, float],
        depth: int,
    ) -> None:
        self.left = list(reversed(tokens))
        self.look_up, self.place, self.known, self.depth = look_up, place, known, depth

    def level(self, rank: int, parentheses: int) -> float:
        """What operators of a rank, and stronger ones, join."""
        value = self.factor(parentheses)
        while self.left and self.left[-1] in _JOINS:
            of_join, join = _JOINS[self.left[-1]]
            if of_join < rank:
                break
            self.left.pop()
            value = join(value, self.level(of_join + 1, parentheses))
        return value

    def factor(self, parentheses: int) -> float:
        """A number, a name, a function, or what stands in parentheses."""
        if not self.left or parentheses > _DEEPEST:
            raise _Unknown
        word = self.left.pop()
        if word == "-":
            return -self.factor(parentheses + 1)
        if word == "!":
            return float(not self.factor(parentheses + 1))
        if word == "(":
            return self.inside(parentheses)[0]
        if word[0].isdigit() or word[0] == ".":
            return float(word)
        if self.left and self.left[-1] == "(" and word in _FUNCTIONS:
            self.left.pop()
            return float(_FUNCTIONS[word](*self.inside(parentheses)))
        return self.name(word)

    def inside(self, parentheses: int) -> list[float]:
        """What stands between commas, up to the closing parenthesis."""
        values = [self.level(0, parentheses + 1)]
        while self.left and self.left[-1] == ",":
            self.left.pop()
            values.append(self.level(0, parentheses + 1))
        if not self.left or self.left.pop() != ")":
            raise _Unknown
        return values

    def name(self, word: str) -> float:
        """The value of a name."""
        if word == "PI":
            return math.pi
        if word in self.known:
            return self.known[word]
        if word.startswith("v_"):
            made = self.look_up(word[2:], self.place)
            if made is not None:
                value = _value(made.text, self.look_up, self.place, self.known, self.depth + 1)
                if value is not None:
                    return value
        raise _Unknown
