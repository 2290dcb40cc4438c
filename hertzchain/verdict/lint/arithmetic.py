"""Numbers of a LAMMPS deck: equal-style formulas whose values are known."""

from __future__ import annotations

import functools
import math
import operator
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass

_DEEPEST = 30  # of variables that name variables, and of parentheses: deeper ones have no value
LONGEST = 10_000  # characters of a formula, and of a line after its variables are filled in


@dataclass(frozen=True)
class Definition:
    """A variable as a deck defines it, from a place in the deck on."""

    place: int
    style: str
    text: str


Lookup = Callable[[str, int], "Definition | None"]


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

_OF_RUNS: dict[str, tuple[str, Callable[..., float]]] = {
    "ramp": ("part", lambda part, x, y: x + (y - x) * part),
    "vdisplace": ("since", lambda time, x, y: x + y * time),
    "swiggle": ("since", lambda time, x, y, z: x + y * math.sin(2 * math.pi * time / z)),
    "cwiggle": ("since", lambda time, x, y, z: x + y * (1 - math.cos(2 * math.pi * time / z))),
}
"""Functions of the part of a run that is over, or of the time since it began."""

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
    if len(text) > LONGEST:
        raise _Unknown
    while at < len(text):
        match = _TOKEN.match(text, at)
        if match is None:
            raise _Unknown
        found.append(match[1])
        at = match.end()
    return tuple(found)


def known_value(
    text: str, look_up: Lookup, place: int, known: Mapping[str, float], depth: int
) -> float | None:
    """The value of a formula, None where it is not known before the deck runs."""
    if depth > _DEEPEST:
        return None
    try:
        reader = _Reader(list(reversed(_tokens(text))), look_up, place, known, depth)
        value = float(reader.level(0, 0))
    except (_Unknown, ArithmeticError, ValueError, TypeError):
        return None
    return value if not reader.left and math.isfinite(value) else None


def names_in(text: str, look_up: Lookup, place: int, depth: int) -> set[str]:
    """Names of thermo keywords and variables that a formula rests on."""
    found: set[str] = set()
    for name in re.findall(r"(?<![\w.])[A-Za-z]\w*", text[:LONGEST]):
        found.add(name)
        made = look_up(name[2:], place) if name.startswith("v_") else None
        if made is not None and depth < 5:
            found |= names_in(made.text, look_up, place, depth + 1)
    return found


@dataclass
class _Reader:
    """Reads a formula by recursive descent."""

    left: list[str]  # its tokens, the next one last
    look_up: Lookup
    place: int
    known: Mapping[str, float]
    depth: int

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
        if self.left and self.left[-1] == "(" and word in (_FUNCTIONS | _OF_RUNS):
            self.left.pop()
            return self.called(word, self.inside(parentheses))
        return self.name(word)

    def called(self, function: str, values: list[float]) -> float:
        """The value of a function."""
        if function in _FUNCTIONS:
            return float(_FUNCTIONS[function](*values))
        keyword, compute = _OF_RUNS[function]
        return float(compute(self.name(keyword), *values))

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
                value = known_value(made.text, self.look_up, self.place, self.known, self.depth + 1)
                if value is not None:
                    return value
        raise _Unknown
