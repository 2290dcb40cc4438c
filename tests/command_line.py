"""Commands as people and scripts give them, in this process or in one of their own."""

from __future__ import annotations

import json
import re
import runpy
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from hertzchain.cli import main

MAIN = (
    # Tests in the background ignore Ctrl-C, and their children inherit that.
    "import signal; signal.signal(signal.SIGINT, signal.default_int_handler);"
    "from hertzchain.cli import main; main()"
)
"""Code of the command line in a process of its own."""


@dataclass(frozen=True)
class Outcome:
    """The end of a command: status, standard output, standard error."""

    status: int
    out: str
    err: str

    def json(self) -> Any:
        """The one object on standard output; NaN and infinity are no JSON."""

        def refuse(constant: str) -> None:
            raise AssertionError(f"{constant} is not JSON")

        return json.loads(self.out, parse_constant=refuse)


def without_compiling(err: str) -> str:
    """Standard error without the line that the first test of all has: kernels are kept then."""
    return re.sub(r"^hertzchain: compiling kernels .*\n", "", err, flags=re.M)


Command = Callable[..., Outcome]
"""Type of the fixture ``hertzchain``."""

PATIENCE = 300.0
"""Seconds after which a command counts as hanging; no test waits so long."""


def python(*arguments: object, **options: Any) -> subprocess.CompletedProcess[str]:
    """Run Python in a process of its own; options are those of ``subprocess.run``."""
    how: dict[str, Any] = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "check": False}
    how |= {"text": True, "timeout": PATIENCE} | options
    return subprocess.run([sys.executable, *map(str, arguments)], **how)  # noqa: PLW1510 - in how


def process(*arguments: object, code: str = MAIN, **options: Any) -> Outcome:
    """Run the command line in a process of its own.

    Parameters
    ----------
    arguments
        Of the command line.
    code
        What Python runs.
    options
        For ``subprocess.run``.
    """
    done = python("-c", code, *arguments, **options)
    return Outcome(done.returncode, done.stdout or "", without_compiling(done.stderr))


def is_refused(outcome: Outcome, *words: str) -> None:
    """Assert status 2, nothing on standard output and one line that has all the words."""
    assert outcome.status == 2, outcome
    assert outcome.out == ""
    assert outcome.err.startswith("hertzchain: ")
    assert outcome.err.endswith("\n")
    assert outcome.err.count("\n") == 1
    assert [word for word in words if word not in outcome.err] == [], outcome.err


def run_here(capfd: pytest.CaptureFixture[str], program: str, *arguments: object) -> Outcome:
    """Run a command in this process: a second less, as libraries and kernels are there.

    Parameters
    ----------
    capfd
        Captures what is printed, by LAMMPS too.
    program
        ``hertzchain``, or ``python`` with ``-m`` and a module as the first arguments.
    arguments
        Its arguments.
    """
    given = [*map(str, arguments)]
    with pytest.MonkeyPatch.context() as patch:
        try:
            if program == "hertzchain":
                patch.setattr(sys, "argv", [program, *given])
                main()
                raise AssertionError("the command line ends with a status")
            assert given[0] == "-m"
            patch.setattr(sys, "argv", given[1:])
            runpy.run_module(given[1], run_name="__main__")
            status = 0
        except SystemExit as end:
            status = end.code if isinstance(end.code, int) else -1
    out, err = capfd.readouterr()
    return Outcome(status, out, without_compiling(err))


def run_program(program: str, *arguments: object, folder: Path | None = None) -> Outcome:
    """Run a program of this environment as users run it; the folder is this one by default."""
    done = subprocess.run(
        [str(Path(sys.executable).parent / program), *map(str, arguments)],
        capture_output=True,
        cwd=folder,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    return Outcome(done.returncode, done.stdout, without_compiling(done.stderr))
