"""Granules by their numbers or types, as ``group`` and ``set`` name them."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence

from hertzchain.verdict.lint.arithmetic import number

MOST = 20_000  # granules of a chain that are looked at one by one (chosen: a second)

_COMPARE: dict[str, Callable[..., bool]] = {
    "<": lambda x, a: x < a, ">": lambda x, a: x > a, "<=": lambda x, a: x <= a,
    ">=": lambda x, a: x >= a, "==": lambda x, a: x == a, "!=": lambda x, a: x != a,
    "<>": lambda x, a, b: a <= x <= b,
}  # fmt: skip


def listed(numbers: Sequence[float | None], words: Sequence[str]) -> frozenset[int] | None:
    """The granules, from 1, whose numbers are listed: 3, 2:5, 1:9:2, or <= 4; None if not known."""
    if words[:1] and words[0] in _COMPARE:
        bounds = [number(word) for word in words[1:]]
        if None in bounds or not bounds or None in numbers:
            return None
        holds = _COMPARE[words[0]]
        return frozenset(k for k, value in enumerate(numbers, start=1) if holds(value, *bounds))
    chosen: set[int] = set()
    for word in words:
        ends = [number(part) for part in word.split(":")]
        known = [int(end) for end in ends if end is not None and abs(end) < 1e9]
        if len(known) != len(ends) or not 1 <= len(known) <= 3:
            return None
        high, step = known[min(1, len(known) - 1)], known[2] if len(known) == 3 else 1
        chosen |= set(range(known[0], min(high, MOST) + 1, max(step, 1)))
    return frozenset(k for k, value in enumerate(numbers, start=1) if value in chosen)


def span(word: str, most: int) -> Iterable[int] | None:
    """The numbers of 2, *, 2*3; None for a word that is no such."""
    match = re.fullmatch(r"(\d{0,9})(\*?)(\d{0,9})", word)
    if not word or match is None or (not match[2] and match[3]):
        return None
    first = int(match[1] or 1)
    return range(first, (first if not match[2] else min(int(match[3] or most), most)) + 1)
