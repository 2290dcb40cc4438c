"""What a run may cost, refused before it starts or stopped while it runs; the default accuracy."""

from __future__ import annotations

import os
import time

from hertzchain.errors import POSITIVE, TooExpensive, is_positive, require

RTOL = 1e-6  # relative accuracy of the peaks by default: whether p is 9 or 10 can hang on 2e-5
TIME_LIMIT = 3600.0  # where nothing else is asked for [s]


class Deadline:
    """The end of the time that a run may take, which is so long from now on [s]."""

    def __init__(self, limit: float) -> None:
        self.limit = limit
        self._end = time.monotonic() + limit

    @property
    def left(self) -> float:
        """Time left [s]; negative when it is over."""
        return self._end - time.monotonic()

    def refuse(self, least: float) -> None:
        """Refuse a run that takes longer than this, at least so long [s]."""
        if least > self.limit:
            raise TooExpensive(
                f"this scene takes at least {in_words(least)}, the time limit is"
                f" {in_words(self.limit)}: shorten pulse, chain or end_time, ask for less accuracy,"
                " or raise the limit"
            )

    def passed(self) -> TooExpensive:
        """What to say of a run that was stopped."""
        return TooExpensive(
            f"stopped at the time limit of {in_words(self.limit)}: shorten pulse, chain or"
            " end_time, ask for less accuracy, or raise the limit"
        )


def check_time_limit(seconds: float) -> None:
    """Refuse a time limit that cannot be."""
    require(is_positive(seconds), "time_limit", seconds, f"{POSITIVE} [s]")


def refuse_memory(needed: float) -> None:
    """Refuse a run that takes at least so many bytes where this machine is known to have fewer."""
    if needed < 1e8:
        return  # asking takes longer than most runs of that size
    try:
        there_is = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):  # Windows has no sysconf
        return
    if needed > there_is > 0:
        raise TooExpensive(
            f"this scene takes at least {needed / 1e9:.3g} GB of memory, this machine has"
            f" {there_is / 1e9:.3g} GB: shorten the chain"
        )


def usable_cores() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def in_words(seconds: float) -> str:
    """A time as people say it."""
    for unit, length in (("years", 3.156e7), ("days", 86400.0), ("hours", 3600.0), ("min", 60.0)):
        if seconds >= 2 * length:
            return f"{seconds / length:.3g} {unit}"
    return f"{seconds:.3g} s"
