"""Keys that a fit may change: start values, ranges, and keys tied to them by a formula."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.errors import SceneError, require
from hertzchain.scene.scene import Scene
from hertzchain.sweeps.columns import OTHER_MEASURE, is_whole, unit_of
from hertzchain.sweeps.design import Axis, axis_of
from hertzchain.sweeps.keys import base_values, changed, full_name

_KEY = re.compile(r"[A-Za-z_]\w*(?:\.\w+)+")
_VALUE = re.compile(_KEY.pattern + r"|(?<!\w)(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?(?!\w)|\bpi\b")
_ARITHMETIC = re.compile(r"(?:[-+*/()\s]|\bsqrt\b|_\(\))*")  # _() returns one value after another
_MOST_FORMULA_CHARS = 1000  # (chosen); Python limits how deep brackets may be
_ALLOWED_FORMULA = (
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
        is_short = len(self.formula) <= _MOST_FORMULA_CHARS and "_(" not in self.formula
        require(is_short and _ARITHMETIC.fullmatch(text) is not None, "tie", said, _ALLOWED_FORMULA)
        numbers, words = {"pi": np.pi, **values}, iter(_VALUE.findall(self.formula))
        names = {"_": lambda: np.float64(numbers.get(word := next(words), word)), "sqrt": np.sqrt}
        try:
            with np.errstate(all="ignore"):
                return eval(text, names) + 0.0  # noqa: S307 - arithmetic and nothing else
        except (SyntaxError, TypeError, ValueError, RecursionError, MemoryError):
            raise SceneError("tie", said, _ALLOWED_FORMULA) from None


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


GAIN = "gain"
"""A key that no scene has: ratio of measured to true force, the same for all gauges."""

_MOST_FACTOR = 100.0
"""Largest factor by which a value may change if no range is given."""

_VALUE_RANGES = {"restitution": (1e-3, 0.9999), "poisson_ratio": (-0.999, 0.5)}
"""Ranges of values that have one."""


def limits_of(key: str) -> tuple[float, float]:
    """Return the range of the values of a key."""
    return _VALUE_RANGES.get(key.rpartition(".")[2], (-math.inf, math.inf))


def with_unit(key: str, value: float) -> str:
    """Return the value of a key in words, such as 1.93e+11 Pa."""
    return f"{value:g} {unit_of(key)}".rstrip()


@dataclass(frozen=True, eq=False)
class Free:
    """Keys that may change.

    Parameters
    ----------
    keys
        Their full names.
    start
        Their values in the scene, in SI units; the middle of the range if the scene has none, or 0.
    low, high
        Ends of their ranges over the start values, shape (keys,).
    is_given
        Whether the ends were given, of each key.
    ties
        Keys that follow from them.
    """

    keys: tuple[str, ...]
    start: tuple[float, ...]
    low: FloatArray
    high: FloatArray
    is_given: tuple[bool, ...]
    ties: tuple[Tie, ...]

    def values(self, x: FloatArray) -> dict[str, float]:
        """Values of the keys by name, from those over the start values; x may have others after."""
        pairs = zip(self.keys, x, self.start, strict=False)
        return {key: float(at) * start for key, at, start in pairs}

    def scene(self, base: Scene, x: FloatArray) -> Scene:
        """Return a scene with these values."""
        values = {key: value for key, value in self.values(x).items() if key != GAIN}
        return changed(base, tied(base, self.ties, values))


def free_of(scene: Scene, given: Sequence[str], ties: Mapping[str, str] | None) -> Free:
    """Return free keys, from their names or from ``"chain.radius=4 mm:6 mm"``."""
    is_list = isinstance(given, Sequence) and not isinstance(given, str) and len(given) > 0
    require(is_list, "free", given, "must be a list of keys, such as ['chain.young_modulus']")
    pairs = [text.partition("=")[::2] for text in given]
    keys = [name if name == GAIN else full_name(name.strip(), scene) for name, _ in pairs]
    require(len(set(keys)) == len(keys), "free", given, "names a key twice")
    start, ranges = [], []
    for key, (_, text) in zip(keys, pairs, strict=True):
        value: Any = 1.0 if key == GAIN else base_values(scene, [key])[key]
        span = _span(key, text) if text else None
        if span is not None and isinstance(value, float) and (value == 0 or np.isnan(value)):
            value = float(span.values.mean())
        is_number = isinstance(value, float) and not (key != GAIN and is_whole(key))
        allowed = (
            "cannot be fitted: the scene must have a number other than 0, and no whole number, from"
            " which the fit starts, or be given a range"
        )
        require(is_number and np.isfinite(value) and value != 0, key, value, allowed)
        least, most = limits_of(key)
        if span is None:
            ends = sorted((least / value, most / value))
            ranges.append((max(ends[0], 1 / _MOST_FACTOR), min(ends[1], _MOST_FACTOR)))
        else:
            least, most = max(least, float(span.values[0])), min(most, float(span.values[1]))
            ranges.append(tuple(sorted((least / value, most / value))))
        start.append(float(value))
        within = f"{least:g} and {with_unit(key, most)}"
        allowed = f"is {with_unit(key, value)}, must be within {within}, to begin with"
        require(ranges[-1][0] <= 1 <= ranges[-1][1], key, None, allowed)
    low, high = np.array(ranges).T
    is_given = tuple(bool(text) for _, text in pairs)
    tied = ties_of(scene, ties or {}, keys)
    return Free(tuple(keys), tuple(start), low, high, is_given, tied)


def _span(key: str, text: str) -> Axis:
    span = axis_of(key, text) if key != GAIN and ":" in text else None
    if span is None or not span.is_sampled or span.form == "log":
        raise SceneError(key, text, "must be the ends of its range, LOW:HIGH")
    return span
