"""Processes that tests start, watch and end."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from tests.command_line import MAIN

posix = pytest.mark.skipif(os.name != "posix", reason="needs signals")
linux = pytest.mark.skipif(sys.platform != "linux", reason="needs /proc")


def wait_for(what: Callable[[], Any], seconds: float = 150.0) -> Any:
    """Return a function's first result that is not empty."""
    end = time.monotonic() + seconds
    while not (result := what()):
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.01)
    return result


def children(parent: int) -> list[int]:
    """The processes that another has started and that still run."""
    numbers = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            state, ppid = (folder / "stat").read_text().rpartition(")")[2].split()[:2]
        except OSError:  # it has just ended
            continue
        if int(ppid) == parent and state != "Z":
            numbers.append(int(folder.name))
    return numbers


def below(parent: int) -> list[int]:
    """The processes that another has started, those that these have started, and so on."""
    return [pid for child in children(parent) for pid in (child, *below(child))]


def command_line(pid: int) -> bytes:
    """The words of the command that started a process; none if it has ended."""
    with suppress(OSError):
        return Path(f"/proc/{pid}/cmdline").read_bytes()
    return b""


def runs(pid: int) -> bool:
    """Return whether a process runs or is stopped."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def has_lammps(pid: int) -> bool:
    """Return whether a process has loaded LAMMPS and is about to run it."""
    try:
        return "liblammps" in Path(f"/proc/{pid}/maps").read_text()
    except OSError:
        return False


STARTED: list[subprocess.Popen[str]] = []
"""Processes started by ``start`` in this test."""


def start(
    *arguments: object, before: str = "", code: str = MAIN, **options: Any
) -> subprocess.Popen[str]:
    """The command line in a process of its own, with something for a shell to do before it."""
    # -P: as the installed command, it does not look for modules in the working folder.
    line = [sys.executable, "-P", "-c", code, *map(str, arguments)]
    if before:
        line = ["sh", "-c", f'{before} exec "$@"', "sh", *line]
    running = subprocess.Popen(
        line, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options
    )
    STARTED.append(running)
    return running


def ended(running: subprocess.Popen[str]) -> tuple[int, str, str]:
    """Status, standard output and standard error."""
    with running:
        out, err = running.communicate(timeout=600)
    return running.returncode, out, err


def names(folder: Path = Path()) -> list[str]:
    """Return the names of all files in a folder, by default the current one, also hidden ones."""
    return sorted(path.name for path in folder.iterdir())
