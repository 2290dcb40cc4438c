"""Compiled code on disk, by parts of Numba that have no public name.

Numba does not handle full disks, truncated indices, or another process that writes another version.
And with its own ``cache=True`` a short command takes 0.46 s of processor time more (1.14 for 0.68):
before it loads code it registers everything that it can compile.
"""

from __future__ import annotations

from contextlib import suppress
from typing import Any

from numba.core.caching import FunctionCache, NullCache
from numba.core.options import DefaultOptions
from numba.core.runtime.nrt import rtsys

from hertzchain.observables.preparation import begins, ends

UNCOUNTED = {"_nrt": False} if hasattr(DefaultOptions, "_nrt") else {}
"""Code without arrays need not count references to them: counting costs a quarter of a run."""


class _Telling:
    """Reports to ``preparation`` when a kernel is loaded or compiled."""

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        begins()
        kernel = self._found(sig, target_context)
        (begins if kernel is None else ends)(compiles=kernel is None)
        return kernel

    def save_overload(self, sig: Any, data: Any) -> None:
        ends(compiles=True)
        with suppress(Exception):
            super().save_overload(sig, data)  # type: ignore[misc]
        ends()

    def _found(self, *_: Any) -> Any: ...


class Kept(_Telling, FunctionCache):
    """Compiled code in a folder; if anything there fails, the code is compiled again."""

    def _found(self, sig: Any, target_context: Any) -> Any:
        with suppress(Exception):  # what was damaged can raise anything
            rtsys.initialize(target_context)  # Numba loads more: a quarter of a short command
            with self._guard_against_spurious_io_errors():  # Windows: another process writes
                kernel = self._load_overload(sig, target_context)  # type: ignore[no-untyped-call]
            if kernel is None or tuple(kernel.signature.args) == tuple(sig):
                return kernel
        with suppress(Exception):  # an entry that cannot be read could not be replaced either
            self.flush()  # type: ignore[no-untyped-call]
        return None


def kept(function: Any, stamp: Any) -> Any:
    """Return the store of a function's code, valid while its source has a stamp."""
    with suppress(RuntimeError, OSError):  # no folder can be written
        cache = Kept(function)  # type: ignore[no-untyped-call]
        cache._cache_file._source_stamp = stamp
        return cache
    return type("Nowhere", (_Telling, NullCache), {})()
