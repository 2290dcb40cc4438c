"""The time to prepare kernels: compiling them, or loading compiled code from disk."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from contextvars import ContextVar, Token

import numpy.ma  # noqa: F401 - Numba asks for it at the first array

_RUNS: ContextVar[tuple[Watched, ...]] = ContextVar("runs", default=())
"""The runs that are timed here. Threads of a run work in copies of its context."""


def begins(compiles: bool = False) -> None:
    """A kernel begins to be prepared in this thread, or after that to be compiled."""
    for run in _RUNS.get():
        run.begins(compiles)


def ends(compiles: bool = False) -> None:
    """The preparation that began in this thread has ended."""
    for run in _RUNS.get():
        run.ends(compiles)


class Watched:
    """Measures how long kernels are prepared for a run, in a ``with`` block.

    Only threads count that work in the context of the block, or in a copy of it.

    Parameters
    ----------
    on_compiling
        Called each time that compiling a kernel starts.
    """

    def __init__(self, on_compiling: Callable[[], object] | None = None) -> None:
        self._on_compiling = on_compiling
        self._prepared, self._compiled = _Clock(), _Clock()
        self._token: Token[tuple[Watched, ...]] | None = None

    def __enter__(self) -> Watched:
        self._token = _RUNS.set((*_RUNS.get(), self))
        return self

    def __exit__(self, *_: object) -> None:
        if self._token is not None:
            _RUNS.reset(self._token)

    def begins(self, compiles: bool) -> None:
        """A kernel begins to be prepared, or to be compiled."""
        (self._compiled if compiles else self._prepared).start()
        if compiles and self._on_compiling is not None:
            self._on_compiling()

    def ends(self, compiles: bool) -> None:
        """The preparation of a kernel has ended."""
        (self._compiled if compiles else self._prepared).stop()

    @property
    def compile_time(self) -> float:
        """Time spent on compiling [s]; 0 where all needed kernels are on disk."""
        return self._compiled.duration

    @property
    def time(self) -> float:
        """Time spent on compiling and on loading so far [s]."""
        return self._prepared.duration


class _Clock:
    """Adds up the time of a certain work; Numba lets one thread at a time prepare kernels."""

    def __init__(self) -> None:
        self._begin, self._done = math.inf, 0.0

    @property
    def duration(self) -> float:
        """The time so far [s], including work that has not ended yet."""
        return self._done + max(time.perf_counter() - self._begin, 0.0)

    def start(self) -> None:
        self._begin = min(self._begin, time.perf_counter())

    def stop(self) -> None:
        self._done, self._begin = self.duration, math.inf
