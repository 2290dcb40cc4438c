"""Formulas that tie a key of a scene file to others, such as those for a fixed length or mass."""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from hertzchain.errors import SceneError, require
from hertzchain.scene.scene import Scene
from hertzchain.sweeps.columns import OTHER_MEASURE, is_whole
from hertzchain.sweeps.keys import base_values, full_name

_KEY = re.compile(r"[A-Za-z_]\w*(?:\.\w+)+")
_OPERATORS: dict[type, Callable[..., Any]] = {
    ast.Add: np.add,
    ast.Sub: np.subtract,
    ast.Mult: np.multiply,
    ast.Div: np.divide,
    ast.Pow: np.power,
    ast.USub: np.negative,
}
_FUNCTIONS: dict[str, Callable[..., Any]] = {"sqrt": np.sqrt, "round": np.round}
_LONGEST = 1000
"""Most characters of a formula (chosen): deep ones would end the interpreter."""

_ALLOWED = (
    "must be + - * / ** and brackets over numbers in SI units, pi, sqrt(), round() and full keys"
    " of the scene, such as 0.1 - chain.radius"
)


@dataclass(frozen=True)
class Tie:
    """A key whose value follows from others.

    Parameters
    ----------
    key
        Its full name.
    formula
        Arithmetic over full names of keys, in SI units.
    """

    key: str
    formula: str

    @property
    def uses(self) -> tuple[str, ...]:
        """Keys in the formula."""
        return tuple(dict.fromkeys(_KEY.findall(self.formula)))

    def value(self, values: Mapping[str, Any]) -> Any:
        """Return the value, also of arrays; that of a whole number is rounded to the nearest.

        It need not be possible: a scene of it says so.
        """
        names = {f"key{k}": values[key] for k, key in enumerate(self.uses)}
        places = {key: name for name, key in zip(names, self.uses, strict=True)}
        text = _KEY.sub(lambda found: places[found[0]], self.formula)
        try:
            tree = ast.parse(text.strip(), mode="eval").body
            with np.errstate(all="ignore"):
                found = _evaluated(tree, {**names, "pi": np.pi})
        except (ArithmeticError, SyntaxError, ValueError, TypeError, RecursionError, MemoryError):
            raise SceneError("tie", f"{self.key}={self.formula}", _ALLOWED) from None
        if is_whole(self.key):  # no scene has the number that stands for what is not finite
            return np.nan_to_num(np.round(found), nan=-1, posinf=-1, neginf=-1).astype(np.int64)
        return found


def _evaluated(node: ast.AST, names: Mapping[str, Any]) -> Any:
    """Return the value of an expression; a ValueError for anything but arithmetic."""
    if isinstance(node, ast.BinOp | ast.UnaryOp) and type(node.op) in _OPERATORS:
        parts = (node.left, node.right) if isinstance(node, ast.BinOp) else (node.operand,)
        return _OPERATORS[type(node.op)](*(_evaluated(part, names) for part in parts))
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and not node.keywords:
        function = _FUNCTIONS.get(node.func.id)
        if function is not None and len(node.args) == 1:
            return function(_evaluated(node.args[0], names))
    if isinstance(node, ast.Name) and node.id in names:
        return np.asarray(names[node.id], np.float64)
    if isinstance(node, ast.Constant) and isinstance(node.value, int | float):
        return np.float64(node.value)
    raise ValueError


def ties_of(scene: Scene, given: Mapping[str, str], free: Iterable[str]) -> tuple[Tie, ...]:
    """Return ties by the names of their keys, each over other keys and ties before it.

    Raises
    ------
    SceneError
        For keys that cannot vary, a key that is free as well or stands in its own formula, two
        keys of which one replaces the other, and anything but arithmetic.
    """
    found: list[Tie] = []
    keys, free = [full_name(name, scene) for name in given], tuple(free)
    both = [key for key in (*keys, *free) if OTHER_MEASURE.get(key) in {*keys, *free}]
    require(not both, " and ".join(both), None, "replace each other: leave one of them out")
    for key, formula in zip(keys, given.values(), strict=True):
        is_text = isinstance(formula, str) and len(formula) <= _LONGEST
        require(is_text, "tie", f"{key}={str(formula)[:40]}", _ALLOWED)
        tie = Tie(key, formula)
        require(key not in free, key, None, "is both free and tied to other keys: leave one out")
        for used in tie.uses:
            full = full_name(used, scene)
            require(full == used, used, None, f"stands in a formula by its full name, {full}")
            allowed = "is tied to itself, or to a tie that stands below it"
            require(used not in keys[len(found) :], key, formula, allowed)
        found.append(tie)
    require(len(set(keys)) == len(keys), "tie", None, "names a key twice")
    tied(scene, tuple(found), {})
    return tuple(found)


def tied(scene: Scene, ties: tuple[Tie, ...], values: Mapping[str, Any]) -> dict[str, Any]:
    """Return values of a scene's keys with those of ties; other keys are as in the scene."""
    if not ties:
        return dict(values)
    every = base_values(scene, {key for tie in ties for key in tie.uses}) | dict(values)
    for tie in ties:
        every[tie.key] = tie.value(every)
    return {name: every[name] for name in (*values, *(tie.key for tie in ties))}
