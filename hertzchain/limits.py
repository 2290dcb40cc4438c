"""Limits of time and memory, checked before and during a run; the default accuracy."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from hertzchain.errors import POSITIVE, TooExpensive, is_positive, require

RTOL = 1e-6  # default relative accuracy of the peaks: whether p is 9 or 10 can depend on 2e-5
TIGHTEST = 1e-10  # least accuracy that can be wanted: below it round-off dominates
TOLERANCE = 1e-3  # default tolerance of a verdict: a tenth of the one per cent on which p depends
TIME_LIMIT = 3600.0  # default time limit [s]


class Deadline:
    """Time limit of a run, counted from now on [s].

    ``uncounted`` returns the time so far that does not count [s], such as that of compiling.
    """

    def __init__(self, limit: float, uncounted: Callable[[], float] | None = None) -> None:
        self.limit = limit
        self._end = time.monotonic() + limit
        self._uncounted = uncounted

    @property
    def left(self) -> float:
        """Time left [s]; negative after the limit."""
        left = self._end - time.monotonic()
        return left if self._uncounted is None else left + self._uncounted()

    def spend(self, part: Callable[[float], Any]) -> Any:
        """Return what a part computes in the time left [s]; it stops at the limit of the whole."""
        if self.left <= 0:
            raise self.passed()
        try:
            return part(self.left)
        except TooExpensive as problem:
            raise (self.passed() if problem.is_late else problem) from None

    def refuse(self, least: float, cheaper: str = "") -> None:
        """Refuse a run of at least ``least`` [s] above the limit; ``cheaper`` says what to do."""
        if least > self.limit:
            raise _late(
                f"this scene takes at least {in_words(least)}, the time limit is"
                f" {in_words(self.limit)}: shorten pulse, chain or end_time, ask for less accuracy,"
                f" or raise the limit{cheaper}"
            )

    def passed(self) -> TooExpensive:
        """Return the error for a run that was stopped at the limit."""
        return _late(
            f"stopped at the time limit of {in_words(self.limit)}: shorten pulse, chain or"
            " end_time, ask for less accuracy, or raise the limit"
        )


def _late(text: str) -> TooExpensive:
    problem = TooExpensive(text)
    problem.is_late = True
    return problem


def check_time_limit(seconds: float) -> None:
    """Raise an error unless a time limit is a possible one."""
    require(is_positive(seconds), "time_limit", seconds, f"{POSITIVE} [s]")


def refuse_memory(needed: float) -> None:
    """Refuse a run that takes at least ``needed`` bytes if this machine is known to have fewer."""
    if needed < 1e8:
        return  # reading the size of the memory takes longer than most runs below this size
    if needed > (there_is := _memory()) > 0:
        raise TooExpensive(
            f"this scene takes at least {needed / 1e9:.3g} GB of memory, this machine has"
            f" {there_is / 1e9:.3g} GB: shorten the chain"
        )


def check_tolerance(tolerance: float) -> None:
    """Raise a SceneError for an impossible tolerance of a verdict."""
    allowed = "must be a number above 0 and below 1"
    require(is_positive(tolerance) and tolerance < 1, "tolerance", tolerance, allowed)


def bound_memory() -> None:
    """Limit what this process may add to its memory to half of the machine's memory.

    This works on Linux only; elsewhere memory is not limited.
    """
    if sys.platform != "linux":
        return
    import resource

    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    pages = Path("/proc/self/statm").read_text(encoding="ascii").split()[0]
    taken = int(pages) * os.sysconf("SC_PAGE_SIZE")
    most = taken + _memory() // 2
    if most > taken and (soft == resource.RLIM_INFINITY or soft > most):
        resource.setrlimit(resource.RLIMIT_AS, (most, hard))


def _memory() -> int:
    """Return the bytes of memory of this machine; 0 if they are not known."""
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):  # Windows has no sysconf
        return 0


def usable_cores() -> int:
    """Number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def in_words(seconds: float) -> str:
    """Return a time [s] as text with a suitable unit."""
    for unit, length in (("years", 3.156e7), ("days", 86400.0), ("hours", 3600.0), ("min", 60.0)):
        if seconds >= 2 * length:
            return f"{seconds / length:.3g} {unit}"
    return f"{seconds:.3g} s"
