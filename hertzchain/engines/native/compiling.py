"""How kernels are compiled, and kept on disk."""

from __future__ import annotations

import re
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from numba import njit
from numba.core.caching import FunctionCache
from numba.core.options import DefaultOptions
from numba.core.runtime.nrt import rtsys
from numba.extending import intrinsic, register_jitable

ONE = np.uint64(1)

# Multiplication and addition may become one instruction; nothing else is reordered.
_HOW: dict[str, Any] = {
    "nogil": True,
    "error_model": "numpy",
    "fastmath": {"contract"},
    "no_cfunc_wrapper": True,
}

# What makes no arrays need not count references to them; counting costs a sixth of a run. Numba
# has no public name for that.
UNCOUNTED = {"_nrt": False} if hasattr(DefaultOptions, "_nrt") else {}


def compiled(function: Any) -> Any:
    """A function that kernels call, compiled; it makes no arrays, and Python cannot call it."""
    return njit(**_HOW, **UNCOUNTED, no_cpython_wrapper=True)(function)


def part(function: Any) -> Any:
    """A function that is compiled only in the kernels that call it; elsewhere it is plain Python.

    All kernels compile in two thirds of the time that they take with ``compiled``. Not for the
    loops of a step: LLVM made them slower, by a tenth with velocity Verlet.
    """
    return register_jitable(**_HOW, **UNCOUNTED)(function)


class _Kept(FunctionCache):
    """Compiled code on disk; whatever is wrong with that, it is compiled again.

    Numba itself lets every problem through: a disk that is full, an index that was cut off. And
    of two processes that keep different versions at the same moment, one can get the other's.
    """

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """What is kept for types of arguments, or None."""
        try:
            # Numba's own method first loads all that it compiles with, a quarter of the time that a
            # short command takes; what is compiled already needs its runtime alone.
            rtsys.initialize(target_context)
            found = None
            with self._guard_against_spurious_io_errors():  # Windows: another process writes
                found = self._load_overload(sig, target_context)
            if found is None or tuple(found.signature.args) == tuple(sig):
                return found
        except Exception:  # noqa: S110 - what was damaged can raise anything
            pass
        with suppress(Exception):
            self.flush()  # what cannot be read could not be replaced either
        return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep code, if that can be done."""
        with suppress(Exception):
            super().save_overload(sig, data)


def compiled_and_kept(**how: Any) -> Callable[[Any], Any]:
    """A kernel, called from Python: compiled once, and kept on disk with all that it calls.

    It is compiled again when its file changes, or one here that it imports, however indirectly:
    Numba itself sees changes in the kernel's own file alone.
    """

    def keep(function: Any) -> Any:
        kernel = njit(**_HOW, **how)(function)
        # njit(cache=True) fails where there is no place to keep it.
        with suppress(RuntimeError, OSError):  # no folder can be written
            cache = _Kept(function)
            cache._cache_file._source_stamp = _stamps(Path(function.__code__.co_filename))
            kernel._cache = cache
        return kernel

    return keep


def _stamps(file: Path) -> tuple[tuple[str, float, int], ...]:
    """Name, time of change and size of a file and of all here that it imports."""
    found: dict[Path, tuple[str, float, int]] = {}
    waiting = [file]
    while waiting:
        file = waiting.pop()
        if file not in found:
            status = file.stat()
            found[file] = file.name, status.st_mtime, status.st_size
            imported = _IMPORTED.findall(file.read_text(encoding="utf-8"))
            waiting += [Path(__file__).with_name(f"{name}.py") for name in imported]
    return tuple(sorted(found.values()))


_IMPORTED = re.compile(r"^from hertzchain\.engines\.native\.(\w+) import", re.MULTILINE)


def compiled_without_nan(function: Any) -> Any:
    """As ``compiled``; the compiler takes vector instructions for maxima, as no number is NaN."""
    return njit(
        **{**_HOW, "fastmath": {"contract", "nnan", "nsz"}}, **UNCOUNTED, no_cpython_wrapper=True
    )(function)


@intrinsic
def larger(_: Any, a: Any, b: Any) -> Any:
    """The larger of two numbers of one type, neither NaN.

    Of ``max`` LLVM makes vector instructions in some places and not in others.
    """

    def lowered(_: Any, builder: Any, __: Any, numbers: Any) -> Any:
        sure = {"flags": ("nnan", "nsz")}
        return builder.select(builder.fcmp_ordered(">", *numbers, **sure), *numbers, **sure)

    return (a(a, a), lowered) if a == b else None
