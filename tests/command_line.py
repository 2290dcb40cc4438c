"""Commands as people and scripts give them, in this process or in one of their own."""

from __future__ import annotations

import json
import runpy
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from hertzchain.cli import main

MAIN = (
    # Where the tests run in the background, Ctrl-C is ignored, and children inherit that.
    "import signal; signal.signal(signal.SIGINT, signal.default_int_handler);"
    "from hertzchain.cli import main; main()"
)
"""Code of the command line in a process of its own."""


@dataclass(frozen=True)
class Outcome:
    """How a command ended: status, standard output, standard error."""

    status: int
    out: str
    err: str

    def json(self) -> Any:
        """The one object on standard output; NaN and infinity are no JSON."""

        def refuse(constant: str) -> None:
            raise AssertionError(f"{constant} is not JSON")

        return json.loads(self.out, parse_constant=refuse)


def run_here(capfd: pytest.CaptureFixture[str], program: str, *arguments: object) -> Outcome:
    """Run a command in this process: a second less, as libraries and kernels are there.

    Parameters
    ----------
    capfd
        Captures what is printed, by LAMMPS too.
    program
        ``hertzchain``, or ``python`` with a script as the first argument.
    arguments
        Its arguments.
    """
    given = [*map(str, arguments)]
    path = sys.path.copy()
    with pytest.MonkeyPatch.context() as patch:
        try:
            if program == "hertzchain":
                patch.setattr(sys, "argv", [program, *given])
                main()
            else:
                patch.setattr(sys, "argv", given)
                sys.path.insert(0, str(Path(given[0]).parent.resolve()))
                runpy.run_path(given[0], run_name="__main__")
            status = 0
        except SystemExit as end:
            status = end.code if isinstance(end.code, int) else -1
        finally:
            sys.path[:] = path
    out, err = capfd.readouterr()
    return Outcome(status, out, err)


def run_process(*command: object, folder: Path | None = None, **options: Any) -> Outcome:
    """Run a program of this environment in a process of its own.

    Parameters
    ----------
    command
        Its name or path, and its arguments.
    folder
        Where; by default here.
    options
        For ``subprocess.run``.
    """
    program, *arguments = map(str, command)
    done = subprocess.run(
        [str(Path(sys.executable).parent / program), *arguments],
        **({"stdout": subprocess.PIPE} | options),
        stderr=subprocess.PIPE,
        cwd=folder,
        text=True,
        check=False,
    )
    return Outcome(done.returncode, done.stdout or "", done.stderr)
