"""Formulas of a deck's variables, and which one of their numbers would make them right."""

from __future__ import annotations

import ast
import functools
import operator
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.reading import Executed
from hertzchain.verdict.deck.places import SIZES, variables_of

EXACT = 1e-9  # of the largest value: a formula with rounded numbers is off by more (chosen)
_MOST_DIGITS = 6  # of a number that somebody has written, not computed (chosen)
_STEPS = 30  # of Newton's method: it converges in a few, or never (chosen)
_KINDS = {"equal", "atom", "index", "string", "internal"}
_PLAIN = {0.5, 1.0, 2.0, 3.0, 4.0}  # numbers of formulas, seldom those of a chain
_OF_PLAIN = 4  # characters, with the point: others in their places are not meant (chosen)

_BINARY: dict[type, Callable[[Any, Any], Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul,
    ast.Div: operator.truediv, ast.Pow: np.power, ast.Mod: np.fmod,
    ast.Lt: operator.lt, ast.LtE: operator.le, ast.Gt: operator.gt, ast.GtE: operator.ge,
    ast.Eq: operator.eq, ast.NotEq: operator.ne, ast.And: np.logical_and, ast.Or: np.logical_or,
}  # fmt: skip
_FUNCTIONS: dict[str, Callable[..., Any]] = {
    "sqrt": np.sqrt, "exp": np.exp, "ln": np.log, "log": np.log10, "abs": np.abs, "sin": np.sin,
    "cos": np.cos, "tan": np.tan, "asin": np.arcsin, "acos": np.arccos, "atan": np.arctan,
    "ceil": np.ceil, "floor": np.floor,
}  # fmt: skip


class _Unknown(Exception):
    """A formula has what is not known here."""


@dataclass(frozen=True)
class Span:
    """What stands in place of a part of a command as it is written."""

    command: int
    start: int
    end: int
    text: str


def in_text(value: float) -> str:
    """A number as commands have it."""
    return f"{value:.10g}"


@dataclass(frozen=True)
class Formula:
    """A part of a command as it is written, with the variables that it uses.

    Parameters
    ----------
    commands
        Of the deck.
    command, start, end
        The command, and where the part stands in it.
    given
        Values of names such as ``time``, in units of the deck.
    """

    commands: Sequence[Executed]
    command: int
    start: int
    end: int
    given: Mapping[str, FloatArray | float]

    def value(self, change: Span | None = None) -> FloatArray | None:
        """Its value, with a change of one number; None where that is not known."""
        lines = {
            k: self.commands[k].written
            for k in (self.command, *variables_of(self.commands, self.command))
        }
        end = self.end
        if change is not None:
            text = lines[change.command]
            lines[change.command] = text[: change.start] + change.text + text[change.end :]
            if change.command == self.command:
                end += len(change.text) - (change.end - change.start)
        own = lines.pop(self.command)[self.start : end]
        definitions = {words[1]: words for words in (_definition(one) for one in lines.values())}
        try:
            with np.errstate(all="ignore"):
                return np.asarray(_value(own, definitions, self.given), np.float64)
        except (_Unknown, TypeError, ZeroDivisionError, OverflowError, RecursionError):
            return None

    def _numbers(self) -> Iterator[Span]:
        """The numbers in it and in its variables."""
        for k in (self.command, *variables_of(self.commands, self.command)):
            text, first, last = self.commands[k].written, self.start, self.end
            if k != self.command:
                words = _definition(text)
                if len(words) < 4 or words[2] not in _KINDS:
                    continue
                first, last = text.index(words[3]), len(text)
            for match in SIZES.finditer(text):
                if first <= match.start() < last:
                    yield Span(k, *match.span(), match.group())

    def right_numbers(
        self, target: FloatArray, known: Iterable[float], exact: float = EXACT
    ) -> list[Span]:
        """Numbers in it or its variables with which it is a target, those first that say most.

        These are numbers which the scene has, ``known``, then those of fewest digits. ``exact`` is
        how far off the result may be, as a share of the largest value.
        """
        scale = float(np.max(np.abs(target), initial=0.0)) * exact
        known, found = [*known], list[tuple[tuple[bool, bool, int, int], Span]]()

        def misfit(span: Span, number: float) -> float:
            value = self.value(_with(span, number, self.commands))
            if value is None or not np.all(np.isfinite(value)):
                return np.inf
            return float(np.max(np.abs(value - target)))

        for k, span in enumerate(self._numbers()):
            tried = [one for one in known if misfit(span, one) <= scale]
            solved = None if tried else self._solved(span, target)
            if solved is not None:
                rounded = (float(f"{solved:.{n}g}") for n in range(1, _MOST_DIGITS + 1))
                tried = [one for one in rounded if misfit(span, one) <= scale][:1]
            for number in tried[:1]:
                digits = len(f"{abs(number):e}".split("e")[0].rstrip("0"))
                is_known = any(abs(number - one) <= EXACT * abs(one) for one in known)
                is_plain = float(span.text) in _PLAIN
                if is_known or not is_plain or digits < _OF_PLAIN:
                    rank = (not is_known, is_plain, digits, k)
                    found.append((rank, _with(span, number, self.commands)))
        return [span for _, span in sorted(found, key=lambda one: one[0])]

    def _solved(self, span: Span, target: FloatArray) -> float | None:
        """The number in a place with which the formula comes nearest to a target, by Newton."""
        number = float(span.text)
        for _ in range(_STEPS):
            step = 1e-6 * number or 1e-6
            value, more = (
                self.value(_with(span, one, self.commands)) for one in (number, number + step)
            )
            if value is None or more is None:
                return None
            slope = (more - value) / step
            steep = float(np.sum(slope * slope))
            if not np.isfinite(steep) or steep == 0:
                return None
            change = float(np.sum(slope * (target - value))) / steep
            number += change
            if abs(change) <= 1e-13 * abs(number):
                break
        return number if np.isfinite(number) else None


def _with(span: Span, number: float, commands: Sequence[Executed]) -> Span:
    """A number in a place; with the sign before it, where that changes."""
    text, start, words = commands[span.command].written, span.start, in_text(number)
    if number <= 0 and text[start - 1] in "-+":
        sign = "+" if text[start - 1] == "-" else "-"
        begins = sign == "+" and (text[start - 2].isspace() or text[start - 2] in "(,\"'*/=")
        return Span(
            span.command, start - 1, span.end, ("" if begins else sign) + words.removeprefix("-")
        )
    return Span(span.command, start, span.end, words)


def _definition(text: str) -> list[str]:
    """A command ``variable`` as its name, style and formula, without quotes."""
    words = text.split(None, 3)
    if len(words) == 4:
        words[3] = words[3].strip().strip("\"'")
    return words


def _value(text: str, definitions: Mapping[str, list[str]], given: Mapping[str, Any]) -> Any:
    """The value of a formula; raises what its operators raise, and _Unknown."""
    text = re.sub(r"\$\{(\w+)\}|\$(\w)(?!\w)", r"(v_\1\2)", text.strip().strip("\"'"))
    text = re.sub(r":%[^)]*\)", ")", text).replace("$(", "(")
    text = text.replace("^", "**").replace("&&", " and ").replace("||", " or ")
    try:
        tree = ast.parse(text.strip(), mode="eval")
    except (SyntaxError, ValueError):
        raise _Unknown from None

    def of(node: Any) -> Any:  # noqa: PLR0911 - one for each kind of node
        match node:
            case ast.Constant(value=int() | float() as number):
                return float(number)
            case ast.Name(id="PI"):
                return np.pi
            case ast.Name(id=name) if name in given:
                return given[name]
            case ast.Name(id=name) if name.startswith("v_") and name[2:] in definitions:
                words = definitions[name[2:]]
                if len(words) == 4 and words[2] in _KINDS:
                    return _value(words[3], definitions, given)
            case ast.UnaryOp(op=ast.USub(), operand=inner):
                return -of(inner)
            case ast.UnaryOp(op=ast.UAdd(), operand=inner):
                return of(inner)
            case ast.BinOp(left=left, op=op, right=right) if type(op) in _BINARY:
                return _BINARY[type(op)](of(left), of(right))
            case ast.Compare(left=left, ops=[op], comparators=[right]) if type(op) in _BINARY:
                return _BINARY[type(op)](of(left), of(right)) * 1.0
            case ast.BoolOp(op=op, values=parts):
                return functools.reduce(_BINARY[type(op)], map(of, parts)) * 1.0
            case ast.Call(func=ast.Name(id=name), args=[inner]) if name in _FUNCTIONS:
                return _FUNCTIONS[name](of(inner))
        raise _Unknown

    return of(tree.body)
