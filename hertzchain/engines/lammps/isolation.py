"""Runs LAMMPS in a new interpreter, whose crash, hang or end does not affect this process.

It receives functions and returns their results. Both are pickled twice, the second time as bytes:
an unreadable request does not affect the next.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import queue
import subprocess
import sys
import threading
import traceback
from collections.abc import Callable
from typing import Any, BinaryIO, Self

from hertzchain.engines.external.program import SLICE, kill, signal_name, start
from hertzchain.engines.lammps.dialect import is_out_of_memory, not_enough_memory, was_killed
from hertzchain.engines.lammps.engine import forget_shared_memory
from hertzchain.errors import HertzchainError, RunFailed
from hertzchain.limits import Deadline

_PROGRAM = (
    "import sys; sys.path[:] = sys.argv[1:];"
    "from hertzchain.engines.lammps.isolation import serve; serve()"
)

_CRASHES = {"SIGSEGV", "SIGBUS", "SIGABRT", "SIGFPE", "SIGILL", "SIGTRAP", "SIGSYS"}

_KEPT_BYTES = 4096  # bytes kept of the standard error of the process
_OTHER_NUMBERS = 8  # processes tried when another user's shared memory has the number of the first
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
        self, function: Callable[..., Any], *arguments: Any, time_limit: float, who: str = "LAMMPS"
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
            raise _failure(*process.last_words(), who)
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
        while not forget_shared_memory(self.popen.pid) and len(unusable) < _OTHER_NUMBERS:
            unusable.append(self.popen)
            self.popen = _start()
        for process in unusable:
            with process:
                kill(process)
        self._said = b""
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()
        self._talk: threading.Thread | None = None

    def ask(self, request: bytes, deadline: Deadline) -> tuple[bool, Any] | None:
        """Return the answer to a request; None if the process has ended."""
        answers: queue.SimpleQueue[tuple[bool, Any] | None] = queue.SimpleQueue()
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

    def _exchange(
        self, request: bytes, answers: queue.SimpleQueue[tuple[bool, Any] | None]
    ) -> None:
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


def _failure(status: int, said: str, who: str) -> RunFailed:
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
