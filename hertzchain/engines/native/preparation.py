"""The time that kernels take before they can run: compiling them, or loading what is kept.

Of events that Numba reports, ``numba:compile`` is compiling alone; its lock is held for both.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass

from numba.core import event

import hertzchain.engines.native.kernels  # noqa: F401 - loaded before any clock starts

_COMPILED, _PREPARED = "numba:compile", "numba:compiler_lock"


@dataclass(frozen=True)
class Preparation:
    """What Numba spent on kernels while this was watched."""

    _compiled: event.TimingListener
    _prepared: event.TimingListener

    @property
    def compile_time(self) -> float:
        """Time spent on compiling [s]; 0 where all that was needed is kept on disk."""
        return _duration(self._compiled)

    @property
    def time(self) -> float:
        """Time spent on compiling and on loading [s]."""
        return _duration(self._prepared)


@contextmanager
def watched(on_compiling: Callable[[], object] | None = None) -> Iterator[Preparation]:
    """Measure how long kernels are prepared meanwhile; call a function where one is compiled."""
    compiled, prepared = _clock(), _clock()
    with ExitStack() as stack:
        stack.enter_context(event.install_listener(_COMPILED, compiled))
        stack.enter_context(event.install_listener(_PREPARED, prepared))
        if on_compiling is not None:
            stack.enter_context(event.install_listener(_COMPILED, _Notice(on_compiling)))
        yield Preparation(compiled, prepared)


class _Notice(event.Listener):
    """Calls a function each time that compiling starts."""

    def __init__(self, on_compiling: Callable[[], object]) -> None:
        self._on_compiling = on_compiling

    def on_start(self, _: object) -> None:
        self._on_compiling()

    def on_end(self, _: object) -> None:
        pass


def _duration(listener: event.TimingListener) -> float:
    return float(listener.duration) if listener.done else 0.0


def _clock() -> event.TimingListener:
    return event.TimingListener()  # type: ignore[no-untyped-call]
