"""A Dask scheduler and its workers as processes of their own, on loopback."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

_MOMENT = 0.05  # time between two checks of starting processes [s]
_PATIENCE = 60.0  # waiting time for starting processes [s]


@contextmanager
def running(command: list[str], log: Path) -> Iterator[subprocess.Popen[bytes]]:
    """A module of Python as a process, with all processes it starts; killed in the end."""
    with log.open("ab") as stream:
        process = subprocess.Popen(
            [sys.executable, "-m", *command], cwd=log.parent, start_new_session=True,
            stdin=subprocess.DEVNULL, stdout=stream, stderr=stream,
        )  # fmt: skip
    try:
        yield process
    finally:
        kill(process)


def kill(process: subprocess.Popen[bytes]) -> None:
    """Kill a process and those that it has started, but for those with a session of their own."""
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


@contextmanager
def scheduler(folder: Path, port: int = 0) -> Iterator[tuple[str, subprocess.Popen[bytes]]]:
    """A Dask scheduler on loopback, on a free port or on this one: its address, and itself."""
    described = folder / "scheduler.json"
    described.unlink(missing_ok=True)
    command = ["distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", str(port)]
    command += ["--no-dashboard", "--dashboard-address", "127.0.0.1:0"]
    command += ["--scheduler-file", str(described)]
    with running(command, log := folder / "scheduler.log") as process:
        until = time.monotonic() + _PATIENCE
        while True:
            try:
                address: str = json.loads(described.read_text(encoding="utf-8"))["address"]
                break
            except (FileNotFoundError, ValueError):  # not started yet, or not complete
                if process.poll() is not None or time.monotonic() > until:
                    raise RuntimeError(log.read_text(encoding="utf-8")) from None
                time.sleep(_MOMENT)
        yield address, process


@contextmanager
def worker(
    address: str, folder: Path, *options: str, name: str = "worker"
) -> Iterator[subprocess.Popen[bytes]]:
    """Start a Dask worker of one thread; it is there a second or so later."""
    command = ["distributed.cli.dask_worker", address, "--nthreads", "1", "--no-dashboard"]
    command += ["--name", name, "--local-directory", str(folder), *options]
    with running(command, folder / f"{name}.log") as process:
        yield process


def await_workers(address: str, count: int) -> None:
    """Wait until a scheduler has so many workers."""
    from distributed import Client

    with Client(address, set_as_default=False) as client:
        client.wait_for_workers(count, timeout=_PATIENCE)
