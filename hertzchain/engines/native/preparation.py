"""The time that kernels take before they can run: compiling them, or loading what is kept.

Of events that Numba reports, ``numba:compile`` is compiling alone; its lock is held for both. Numba
reports those of all threads to all listeners.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from contextvars import ContextVar, Token

import numpy.ma  # noqa: F401 - Numba asks for it at the first array
from numba.core import event

import hertzchain.engines.native.elastic  # noqa: F401 - loaded before any clock starts

_COMPILED, _PREPARED = "numba:compile", "numba:compiler_lock"

_RUNS: ContextVar[tuple[Watched, ...]] = ContextVar("runs", default=())
"""The runs that are watched here. Threads of a run work in copies of its context."""


class Watched:
    """Measures how long Numba prepares kernels for a run, in a ``with`` block.

    Only threads count that work in the context of the block, or in a copy of it.

    Parameters
    ----------
    on_compiling
        Called each time that compiling a function starts.
    """

    def __init__(self, on_compiling: Callable[[], object] | None = None) -> None:
        # Numba's own listeners and their contexts would take a tenth of the time of a short run.
        self._compiled, self._prepared = _Clock(self, on_compiling), _Clock(self)
        self._token: Token[tuple[Watched, ...]] | None = None

    def __enter__(self) -> Watched:
        self._token = _RUNS.set((*_RUNS.get(), self))
        event.register(_COMPILED, self._compiled)  # type: ignore[no-untyped-call]
        event.register(_PREPARED, self._prepared)  # type: ignore[no-untyped-call]
        return self

    def __exit__(self, *_: object) -> None:
        event.unregister(_PREPARED, self._prepared)  # type: ignore[no-untyped-call]
        event.unregister(_COMPILED, self._compiled)  # type: ignore[no-untyped-call]
        if self._token is not None:
            _RUNS.reset(self._token)

    @property
    def compile_time(self) -> float:
        """Time spent on compiling [s]; 0 where all that was needed is kept on disk."""
        return self._compiled.duration

    @property
    def time(self) -> float:
        """Time spent on compiling and on loading so far [s]."""
        return self._prepared.duration


class _Clock(event.Listener):
    """Adds up the time in which any thread of a run is within an event."""

    def __init__(self, run: Watched, on_start: Callable[[], object] | None = None) -> None:
        self._run, self._on_start = run, on_start
        self._lock = threading.Lock()
        self._depth: dict[int, int] = {}  # how many events a thread is in, one within the other
        self._begin = self._done = 0.0

    @property
    def duration(self) -> float:
        """The time so far [s], including an event that has not ended yet."""
        with self._lock:
            return self._done + (time.perf_counter() - self._begin if self._depth else 0.0)

    def on_start(self, _: object) -> None:
        if self._run not in _RUNS.get():
            return
        thread = threading.get_ident()
        with self._lock:
            if not self._depth:
                self._begin = time.perf_counter()
            self._depth[thread] = self._depth.get(thread, 0) + 1
        if self._on_start is not None:
            self._on_start()

    def on_end(self, _: object) -> None:
        thread = threading.get_ident()
        with self._lock:
            if thread not in self._depth:
                return
            self._depth[thread] -= 1
            if self._depth[thread] == 0:
                del self._depth[thread]
                if not self._depth:
                    self._done += time.perf_counter() - self._begin
