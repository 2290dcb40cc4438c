"""Runs other programs as processes in a temporary folder."""

from __future__ import annotations

import errno
import os
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

from hertzchain.errors import BackendMissing, RunFailed
from hertzchain.limits import Deadline

Option = Any
"""A keyword argument of ``subprocess.Popen``."""

Stream = Any
"""``str`` or ``bytes``, whichever a program was started with."""

SAID = "said.txt"  # file in the folder with all of a program's standard output and error
SLICE = 0.5  # seconds of one wait; on Windows Ctrl-C has to wait for its end
_GRACE = 2.0  # seconds that a program gets to end on request

END_GROUP = f'kill -s TERM -- "-$TARGET" && sleep {_GRACE:g} && kill -s KILL -- "-$TARGET"'
_CLEAR = 'for k in 1 2 3 4 5; do rm -rf -- "$TARGET" && exit; sleep 1; done'


@contextmanager
def if_killed(script: str, target: object) -> Iterator[None]:
    """Have a shell carry out a script, on its ``$TARGET``, if this process ends in the context.

    The shell waits at a pipe from this process, also where that is killed: unlike Linux's
    PR_SET_PDEATHSIG it reaches what a program has started, and does not act where a thread ends. A
    fork of this process without another program keeps the pipe open. Windows has no shell.
    """
    quiet = "exec > /dev/null 2>&1; cd /; read -r end"
    environment = {"PATH": os.defpath, "TARGET": str(target)}
    with ExitStack() as stack:
        with suppress(OSError):
            command = ["/bin/sh", "-c", f"{quiet}; {script}"]
            shell = stack.enter_context(start(command, stdin=subprocess.PIPE, env=environment))
            stack.callback(shell.kill)
        yield


@contextmanager
def work_folder(code: str) -> Iterator[Path]:
    """Temporary folder for a run; a full disk is reported in one sentence."""
    try:
        with tempfile.TemporaryDirectory(prefix="hertzchain-") as folder, if_killed(_CLEAR, folder):
            _refuse_full(folder)
            try:
                yield Path(folder)
            except RunFailed:
                _refuse_full(folder)
                raise
    except OSError as problem:
        where = problem.filename or tempfile.gettempdir()
        raise RunFailed(
            f"{code} needs room for temporary files ({where}: {problem.strerror}): free some, or"
            " name another folder in the environment variable TMPDIR"
        ) from None


def _refuse_full(folder: str) -> None:
    # Bytes that must be free for temporary files of any run
    if shutil.disk_usage(folder).free < 1e6:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), folder)


def find_program(name: str, what_to_do: str) -> str:
    """Return the path of a program, given as a path or as a name on the search path."""
    path = shutil.which(name)
    if path is None:
        raise BackendMissing(f"{name} is missing or not a program: {what_to_do}")
    return str(Path(path).absolute())


def run_program(
    command: Sequence[str], folder: Path, deadline: Deadline, code: str, **environment: str
) -> str:
    """Run a program to its end in a folder; return its output.

    If the wait ends early, or this process is killed, its process group is killed with all
    processes that it has started. For a status other than 0 the error contains the last line that
    names an error.
    """
    said = folder / SAID
    with said.open("wb") as output:
        try:
            process = start(
                command, cwd=folder, stdin=subprocess.DEVNULL, stdout=output,
                stderr=subprocess.STDOUT, env={**os.environ, **environment},
            )  # fmt: skip
        except OSError as problem:
            raise BackendMissing(
                f"{code} cannot be started ({command[0]}: {problem.strerror})"
            ) from None
        with if_killed(END_GROUP, process.pid):
            try:
                _wait(process, deadline)
            finally:
                _kill(process)
    text = said.read_text(encoding="utf-8", errors="replace")
    if (status := process.returncode) != 0:
        how = f"ended with status {status}" if status > 0 else f"was ended by {signal_name(status)}"
        raise RunFailed(f"{code} {how}{_last_words(text)}")
    return text


def start(command: Sequence[str], **options: Option) -> subprocess.Popen[Stream]:
    """Start a program in a process group of its own, which Ctrl-C does not reach."""
    if sys.platform == "win32":
        options["creationflags"] = subprocess.CREATE_NEW_PROCESS_GROUP
    else:
        options["start_new_session"] = True
    return subprocess.Popen(list(command), **options)  # noqa: S603 - the user's, or this one


def _wait(process: subprocess.Popen[Stream], deadline: Deadline) -> None:
    while True:
        try:
            process.wait(min(max(deadline.left, 0.0), SLICE))
        except subprocess.TimeoutExpired:
            if deadline.left <= 0:
                raise deadline.passed() from None
        else:
            return


def _kill(process: subprocess.Popen[Stream]) -> None:
    """End the whole group, first by a request: only mpiexec may know the groups of its ranks."""
    try:
        if sys.platform != "win32" and process.poll() is None:
            os.killpg(process.pid, signal.SIGTERM)
            process.wait(_GRACE)
    except (OSError, subprocess.TimeoutExpired):
        pass
    finally:
        kill(process)


def kill(process: subprocess.Popen[Stream]) -> None:
    """Kill the group of a program at once, and wait until it is gone."""
    with suppress(OSError):
        if sys.platform == "win32":
            process.kill()
        else:
            os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def signal_name(status: int) -> str:
    """Return the name of the signal that ended a process, from its negative status."""
    try:
        return signal.Signals(-status).name
    except ValueError:  # a real-time signal
        return f"signal {-status}"


def _last_words(text: str) -> str:
    """Return the last line that names an error, or the last line."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    errors = [line for line in lines if "ERROR" in line or "Error" in line]
    last = (errors or lines)[-1:]
    return f": {last[0]}" if last else ""
