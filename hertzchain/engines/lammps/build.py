"""Finds a LAMMPS binary, and reads its version and MPI."""

from __future__ import annotations

import shutil
from pathlib import Path

from hertzchain.engines.external.program import SAID, find_program, run_program, work_folder
from hertzchain.engines.lammps.dialect import INSTALL, Build, build_of
from hertzchain.errors import BackendMissing, RunFailed, TooExpensive
from hertzchain.limits import Deadline

HOW_TO_GET_IT = f"name one that is there, or install it with: {INSTALL}"


def look(lmp: str, deadline: Deadline) -> Build:
    """Version and MPI of a LAMMPS binary, asked once in a process unless the file changes."""
    program = find_program(lmp, HOW_TO_GET_IT)
    file = Path(program).stat()
    key = (program, file.st_dev, file.st_ino, file.st_size, file.st_mtime_ns)
    if key not in _SEEN:
        _SEEN[key] = _ask(lmp, program, deadline)
    return _SEEN[key]


# cached by path and file; asking takes 0.13 s
_SEEN: dict[tuple[str, int, int, int, int], Build] = {}


def _ask(lmp: str, program: str, deadline: Deadline) -> Build:
    with work_folder("LAMMPS") as folder:
        try:
            run_program([program, "-h"], folder, deadline, "LAMMPS")
        except TooExpensive:
            raise
        except RunFailed as problem:
            raise BackendMissing(f"{lmp} does not work: {problem}") from None
        said = all_said(folder)
    build = build_of(said)
    if build is None:
        raise BackendMissing(f"{lmp} is no LAMMPS: {HOW_TO_GET_IT}")
    return build


def find_mpiexec(lmp: str) -> str | None:
    """Return the mpiexec in the folder of a LAMMPS binary, or on the search path; None for none."""
    program = shutil.which(lmp)
    beside = None if program is None else shutil.which("mpiexec", path=Path(program).parent)
    found = beside or shutil.which("mpiexec")
    return None if found is None else str(Path(found).absolute())


def all_said(folder: Path) -> str:
    """Return standard output and error of a program that has run in a folder."""
    return (folder / SAID).read_text(encoding="utf-8", errors="replace")
