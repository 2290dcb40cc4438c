"""Keys that a fit may change: start values, ranges, and keys tied to them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.errors import SceneError, require
from hertzchain.fits.ties import Tie, tied, ties_of
from hertzchain.scene.scene import Scene
from hertzchain.sweeps.axes import Span, axis_of
from hertzchain.sweeps.columns import is_whole, unit_of
from hertzchain.sweeps.keys import base_values, changed, full_name

GAIN = "gain"
"""A key that no scene has: ratio of measured to true force, the same for all gauges."""

_RANGE = 100.0
"""Largest factor by which a value may change if no range is given."""

_LIMITS = {"restitution": (1e-3, 0.9999), "poisson_ratio": (-0.999, 0.5)}
"""Ranges of values that have one."""


def limits_of(key: str) -> tuple[float, float]:
    """Return the range of the values of a key."""
    return _LIMITS.get(key.rpartition(".")[2], (-math.inf, math.inf))


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
    pairs = [one.partition("=")[::2] for one in given]
    keys = [name if name == GAIN else full_name(name.strip(), scene) for name, _ in pairs]
    require(len(set(keys)) == len(keys), "free", given, "names a key twice")
    start, ranges = [], []
    for key, (_, text) in zip(keys, pairs, strict=True):
        value: Any = 1.0 if key == GAIN else base_values(scene, [key])[key]
        span = _span(key, text) if text else None
        if span is not None and isinstance(value, float) and (value == 0 or np.isnan(value)):
            value = (span.low + span.high) / 2
        is_number = isinstance(value, float) and not (key != GAIN and is_whole(key))
        allowed = (
            "cannot be fitted: the scene must have a number other than 0, and no whole number, from"
            " which the fit starts, or be given a range"
        )
        require(is_number and np.isfinite(value) and value != 0, key, value, allowed)
        least, most = limits_of(key)
        if span is None:
            ends = sorted((least / value, most / value))
            ranges.append((max(ends[0], 1 / _RANGE), min(ends[1], _RANGE)))
        else:
            least, most = max(least, span.low), min(most, span.high)
            ranges.append(tuple(sorted((least / value, most / value))))
        start.append(float(value))
        within = f"{least:g} and {with_unit(key, most)}"
        allowed = f"is {with_unit(key, value)}, must be within {within}, to begin with"
        require(ranges[-1][0] <= 1 <= ranges[-1][1], key, None, allowed)
    low, high = np.array(ranges).T
    is_given = tuple(bool(text) for _, text in pairs)
    found = ties_of(scene, ties or {}, keys)
    return Free(tuple(keys), tuple(start), low, high, is_given, found)


def _span(key: str, text: str) -> Span:
    span = axis_of(key, text) if key != GAIN and ":" in text else None
    if not isinstance(span, Span) or span.count is not None or span.log:
        raise SceneError(key, text, "must be the ends of its range, LOW:HIGH")
    return span
