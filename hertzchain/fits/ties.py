"""Keys of a scene file that follow from others by a formula, such as one for a fixed length."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from hertzchain.errors import SceneError, require
from hertzchain.scene.scene import Scene
from hertzchain.sweeps.columns import OTHER_MEASURE, is_whole
from hertzchain.sweeps.keys import base_values, full_name

_KEY = re.compile(r"[A-Za-z_]\w*(?:\.\w+)+")
_VALUE = re.compile(_KEY.pattern + r"|(?<!\w)(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?(?!\w)|\bpi\b")
_ARITHMETIC = re.compile(r"(?:[-+*/()\s]|\bsqrt\b|_\(\))*")  # _() returns one value after another
_LONGEST = 1000  # characters of a formula (chosen); Python limits how deep brackets may be
_ALLOWED = (
    "must be + - * / ** and brackets over numbers in SI units, pi, sqrt() and full keys of the"
    " scene, such as 0.1 - chain.radius"
)


@dataclass(frozen=True)
class Tie:
    """A key, by its full name, whose value follows from a formula of full names, in SI units."""

    key: str
    formula: str

    @property
    def uses(self) -> tuple[str, ...]:
        """Keys in the formula."""
        return tuple(dict.fromkeys(_KEY.findall(self.formula)))

    def value(self, values: Mapping[str, Any]) -> Any:
        """Return the number of the formula, rounded for keys with whole numbers.

        It may be impossible: a scene with it is then refused.
        """
        value = self.number(values)
        if is_whole(self.key):  # an impossible number stands for one that is not finite
            return np.nan_to_num(np.round(value), nan=-1, posinf=-1, neginf=-1).astype(np.int64)
        return value

    def number(self, values: Mapping[str, Any]) -> Any:
        """Return the number of the formula; it need not be finite.

        ``values`` has those of the keys, numbers or arrays of shape (scenes,).
        """
        text, said = _VALUE.sub("_()", self.formula).strip(), f"{self.key}={self.formula[:40]}"
        is_short = len(self.formula) <= _LONGEST and "_(" not in self.formula
        require(is_short and _ARITHMETIC.fullmatch(text) is not None, "tie", said, _ALLOWED)
        known, found = {"pi": np.pi, **values}, iter(_VALUE.findall(self.formula))
        names = {"_": lambda: np.float64(known.get(one := next(found), one)), "sqrt": np.sqrt}
        try:
            with np.errstate(all="ignore"):
                return eval(text, names) + 0.0  # noqa: S307 - arithmetic and nothing else
        except (SyntaxError, TypeError, ValueError, RecursionError, MemoryError):
            raise SceneError("tie", said, _ALLOWED) from None


def ties_of(scene: Scene, given: Mapping[str, str], free: Iterable[str]) -> tuple[Tie, ...]:
    """Return ties by the names of their keys, each over other keys and ties before it.

    SceneError for keys that cannot vary or are free as well, for a key in its own formula, two keys
    of which one replaces the other, and anything but arithmetic.
    """
    ties = tuple(Tie(full_name(name, scene), str(formula)) for name, formula in given.items())
    keys = [*free, *(tie.key for tie in ties)]
    both = [key for key in keys if OTHER_MEASURE.get(key) in keys]
    require(not both, " and ".join(both), None, "replace each other: leave one of them out")
    for k, tie in enumerate(ties, start=len(keys) - len(ties)):
        allowed = "is both free and tied, or tied twice: leave one out"
        require(tie.key not in keys[:k], tie.key, None, allowed)
        for used in tie.uses:
            full = full_name(used, scene)
            require(full == used, used, None, f"stands in a formula by its full name, {full}")
            allowed = "is tied to itself, or to a tie that stands below it: put that one first"
            require(used not in keys[k:], tie.key, tie.formula, allowed)
    tied(scene, ties, {})
    return ties


def tied(scene: Scene, ties: tuple[Tie, ...], values: Mapping[str, Any]) -> dict[str, Any]:
    """Return values of a scene's keys with those of ties; other keys are as in the scene."""
    if not ties:
        return dict(values)
    every = base_values(scene, {key for tie in ties for key in tie.uses}) | dict(values)
    for tie in ties:
        every[tie.key] = tie.value(every)
    return {name: every[name] for name in (*values, *(tie.key for tie in ties))}
