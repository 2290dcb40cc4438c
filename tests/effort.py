"""Processor time in a unit that is the same on every machine, busy or idle."""

from __future__ import annotations

import functools
import time
from collections.abc import Callable


def effort(work: Callable[[], object]) -> float:
    """Processor time of some work in this process, over that of a million additions in Python."""
    unit = _unit()
    begin = time.process_time()
    work()
    return (time.process_time() - begin) / unit


@functools.cache
def _unit() -> float:
    """About 0.03 s: the least of three, as the first may find the processor asleep."""
    return min(_additions() for _ in range(3))


def _additions() -> float:
    begin, total = time.process_time(), 0
    for number in range(1_000_000):
        total += number
    return time.process_time() - begin
