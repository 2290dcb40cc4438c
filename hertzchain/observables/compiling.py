"""Compiled functions, and how they are kept."""

from __future__ import annotations

import re
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from numba import njit
from numba.core.caching import FunctionCache, NullCache
from numba.core.options import DefaultOptions
from numba.core.runtime.nrt import rtsys
from numba.extending import intrinsic, register_jitable
from numpy.typing import NDArray

from hertzchain.observables.preparation import begins, ends

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


class _Telling:
    """Reports to ``preparation`` when a kernel is loaded or compiled."""

    def load_overload(self, sig: NumbaObject, target_context: NumbaObject) -> Any:
        begins()
        kernel = self._found(sig, target_context)
        (begins if kernel is None else ends)(compiles=kernel is None)
        return kernel

    def save_overload(self, sig: NumbaObject, data: NumbaObject) -> None:
        ends(compiles=True)
        with suppress(Exception):
            super().save_overload(sig, data)  # type: ignore[misc]
        ends()

    def _found(self, *_: NumbaObject) -> Any: ...


class Kept(_Telling, FunctionCache):
    """Compiled code in a folder; if anything there fails, the code is compiled again."""

    def _found(self, sig: NumbaObject, target_context: NumbaObject) -> Any:
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
