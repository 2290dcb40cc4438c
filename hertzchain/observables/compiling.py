"""Compiled functions, how they are kept, and how long their preparation takes."""

from __future__ import annotations

import math
import re
import time
from collections.abc import Callable
from contextlib import suppress
from contextvars import ContextVar, Token
from pathlib import Path
from typing import Any

import numpy as np
import numpy.ma
from numba import njit
from numba.core.caching import FunctionCache, NullCache
from numba.core.options import DefaultOptions
from numba.core.runtime.nrt import rtsys
from numba.extending import intrinsic, register_jitable
from numpy.typing import NDArray

Record = Any
"""A record of a structured array in compiled code: its dtype says which fields it has."""

Records = NDArray[np.void]
"""An array of records."""

NumbaObject = Any
"""Objects that Numba passes to its extensions: its package has no types."""

Function = Callable[..., Any]
"""A function to compile, or a compiled one."""

UNCOUNTED = {"_nrt": False} if hasattr(DefaultOptions, "_nrt") else {}
"""Code without arrays need not count references to them: counting costs a quarter of a run."""


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


class Watched:
    """Measures how long kernels are prepared for a run, in a ``with`` block.

    Preparing is compiling a kernel, or loading compiled code from disk. Only threads count that
    work in the context of the block, or in a copy of it. ``on_compiling`` is called each time that
    compiling a kernel starts.
    """

    def __init__(self, on_compiling: Callable[[], object] = lambda: None) -> None:
        self.on_compiling = on_compiling
        self.prepared, self.compiled = _Clock(), _Clock()
        self._token: Token[tuple[Watched, ...]] | None = None

    def __enter__(self) -> Watched:
        self._token = _RUNS.set((*_RUNS.get(), self))
        return self

    def __exit__(self, *_: object) -> None:
        if self._token is not None:
            _RUNS.reset(self._token)

    @property
    def compile_time(self) -> float:
        """Time spent on compiling [s]; 0 where all needed kernels are on disk."""
        return self.compiled.duration

    @property
    def time(self) -> float:
        """Time spent on compiling and on loading so far [s]."""
        return self.prepared.duration


_RUNS: ContextVar[tuple[Watched, ...]] = ContextVar("runs", default=())
"""The runs that are timed. Threads of a run work in copies of its context."""


class _Telling:
    """Reports to the runs that are timed when a kernel is loaded or compiled."""

    def load_overload(self, sig: NumbaObject, target_context: NumbaObject) -> Any:
        for run in _RUNS.get():
            run.prepared.start()
        kernel = self._loaded(sig, target_context)
        for run in _RUNS.get():
            if kernel is None:
                run.compiled.start()
                run.on_compiling()
            else:
                run.prepared.stop()
        return kernel

    def save_overload(self, sig: NumbaObject, data: NumbaObject) -> None:
        for run in _RUNS.get():
            run.compiled.stop()
        with suppress(Exception):
            super().save_overload(sig, data)  # type: ignore[misc]
        for run in _RUNS.get():
            run.prepared.stop()

    def _loaded(self, *_: NumbaObject) -> Any: ...


class Kept(_Telling, FunctionCache):
    """Compiled code in a folder; if anything there fails, the code is compiled again."""

    def _loaded(self, sig: NumbaObject, target_context: NumbaObject) -> Any:
        with suppress(Exception):  # what was damaged can raise anything
            rtsys.initialize(target_context)  # Numba loads more: a quarter of a short command
            with self._guard_against_spurious_io_errors():  # Windows: another process writes
                kernel = self._load_overload(sig, target_context)
            if kernel is None or tuple(kernel.signature.args) == tuple(sig):
                return kernel
        with suppress(Exception):  # an entry that cannot be read could not be replaced either
            self.flush()
        return None


def kept(function: Function, stamp: NumbaObject) -> Any:
    """Return the store of a function's code, valid while its source has a stamp."""
    with suppress(RuntimeError, OSError):  # no folder can be written
        cache = Kept(function)
        cache._cache_file._source_stamp = stamp
        return cache
    return type("Nowhere", (_Telling, NullCache), {})()


ONE = np.uint64(1)

# Multiplication and addition may become one instruction; no sum is reordered.
_HOW: dict[str, Any] = {
    "nogil": True,
    "error_model": "numpy",
    "fastmath": {"contract"},
    "no_cfunc_wrapper": True,
}


def compiled(function: Function) -> Any:
    """Compile a function that kernels call; it makes no arrays, and Python cannot call it."""
    return njit(**_HOW, **UNCOUNTED, no_cpython_wrapper=True)(function)


def part(function: Function) -> Any:
    """A function that is compiled only in the kernels that call it; elsewhere it is plain Python.

    All kernels compile in two thirds of the time that they take with ``compiled``. It is not used
    for the loops of a step: LLVM made them slower, by a tenth with velocity Verlet.
    """
    return register_jitable(**_HOW, **UNCOUNTED)(function)


def compiled_and_kept(**how: bool) -> Callable[[Function], Any]:
    """Compile a kernel, which Python calls, once, and keep it on disk with all that it calls.

    It is compiled again when its file changes, or a file of this package that it imports, directly
    or not: Numba itself detects changes only in the kernel's own file.
    """

    def keep(function: Function) -> Any:
        kernel = njit(**_HOW, **how)(function)
        kernel._cache = kept(function, _stamps(Path(function.__code__.co_filename)))
        return kernel

    return keep


def _stamps(file: Path) -> tuple[tuple[str, float, int], ...]:
    """Name, time of change and size of a file and of all files here that it imports."""
    stamps: dict[Path, tuple[str, float, int]] = {}
    waiting = [file]
    while waiting:
        file = waiting.pop()
        if file not in stamps:
            status = file.stat()
            stamps[file] = file.name, status.st_mtime, status.st_size
            imported = _IMPORTED.findall(file.read_text(encoding="utf-8"))
            waiting += [_PACKAGE.joinpath(*name.split(".")).with_suffix(".py") for name in imported]
    return tuple(sorted(stamps.values()))


_IMPORTED = re.compile(r"^from hertzchain\.((?:observables|engines\.native)\.\w+) import", re.M)
_PACKAGE = Path(__file__).parents[1]


def compiled_without_nan(function: Function) -> Any:
    """Compile a function as ``compiled`` does, but allow vector instructions for ``larger``.

    A maximum with NaN can be any number. NaN occurs only if the motion diverged, which its energy
    shows.
    """
    how = {**_HOW, "fastmath": {"contract", "nnan", "nsz"}}
    return njit(**how, **UNCOUNTED, no_cpython_wrapper=True)(function)


def _larger_of_two(_: NumbaObject, a: NumbaObject, b: NumbaObject) -> Any:
    """The larger of two numbers of one type, neither NaN.

    LLVM makes no vector instructions of ``max``: runs of 400 granules take 1.5 times as long.
    """

    def lowered(_: NumbaObject, builder: NumbaObject, __: NumbaObject, numbers: NumbaObject) -> Any:
        sure = {"flags": ("nnan", "nsz")}
        return builder.select(builder.fcmp_ordered(">", *numbers, **sure), *numbers, **sure)

    return (a(a, a), lowered) if a == b else None


larger: Any = intrinsic(_larger_of_two)
