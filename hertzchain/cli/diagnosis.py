"""Diagnosis: installed software, and tests that it works."""

from __future__ import annotations

import importlib.metadata
import os
import platform
import shutil
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from hertzchain.cli.options import LMP
from hertzchain.engines.registry import ENGINES
from hertzchain.errors import HertzchainError, RunFailed

if TYPE_CHECKING:
    from hertzchain.scene.scene import Scene

_LONGEST = 60.0  # seconds until LAMMPS counts as hanging in a run that does little more than start

PACKAGES = (
    *("hertzchain", "numpy", "scipy", "pandas", "matplotlib", "ase", "filelock"),
    *("jinja2", "numba", "pint", "rich", "tomli-w", "typer"),
)

OPTIONAL = (
    ("pyarrow", "parquet", "for Parquet: the tables of a sweep (or --format csv), -o FILE.parquet"),
    ("distributed", "cluster", "for sweep --scheduler: Dask"),
)
"""Packages that not all need: name, hertzchain's extra that brings it, and its purpose."""

_NOT_KEPT = (
    "no folder to keep them can be written; name one in the environment variable NUMBA_CACHE_DIR"
)

TRIAL_PEAKS = (1.0373, 1.0088)  # peaks of the trial chain over F0; binaries must have them to 1e-3


@dataclass(frozen=True)
class Finding:
    """The result of one examination."""

    name: str
    works: bool
    text: str  # result, or what to do
    needed: bool = True  # needed by hertzchain's defaults


def diagnose() -> list[Finding]:
    """Examine Python, the libraries, the LAMMPS module and every LAMMPS binary by a start."""
    findings = [Finding("Python", True, f"{platform.python_version()}, {platform.platform()}")]
    for package in PACKAGES:
        try:
            findings.append(Finding(package, True, importlib.metadata.version(package)))
        except importlib.metadata.PackageNotFoundError:
            findings.append(Finding(package, False, f"missing; pip install {package}"))
    for package, extra, purpose in OPTIONAL:
        try:
            found = Finding(package, True, importlib.metadata.version(package), needed=False)
        except importlib.metadata.PackageNotFoundError:
            how = f"only {purpose}; pip install 'hertzchain[{extra}]'"
            found = Finding(package, False, how, needed=False)
        findings.append(found)
    return [*findings, _kernels(), *_every_lammps(), *_other_codes()]


def _other_codes() -> list[Finding]:
    """Return the programs of other engines, which are needed only on request."""
    findings = []
    for engine in ENGINES.values():
        if engine.program is None:
            continue
        path = shutil.which(engine.program)
        how = f"only for --backend {engine.name}; {engine.load().INSTALL}"
        text = how if path is None else f"{path}, not tried"
        findings.append(Finding(engine.label, path is not None, text, needed=False))
    return findings


def _every_lammps() -> list[Finding]:
    """Return module and binaries; the one that HERTZCHAIN_LMP names, or the module, is needed."""
    named = os.environ.get(LMP)
    module = replace(_lammps(), needed=not named)
    binaries = [replace(_binary(lmp), needed=lmp == named) for lmp in _binaries(named)]
    if module.needed and not module.works:
        other = next((lmp.name.split(" ", 1)[1] for lmp in binaries if lmp.works), None)
        if other is not None:
            module = replace(module, text=f"{module.text}; or set {LMP}={other}, which works")
    return [module, *binaries]


def _kernels() -> Finding:
    """Return the finding on the folder in which compiled code is kept."""
    try:
        from hertzchain.engines.native import elastic
    except ImportError as problem:
        return Finding("kernels", False, f"{problem}; pip install numba")
    folder = elastic.march.stats.cache_path
    if folder is None:
        text = f"compiled again in every process, 6 s, as {_NOT_KEPT}"
        return Finding("kernels", False, text, needed=False)
    how = "the first run compiles them, 6 s, or doctor --compile"
    return Finding("kernels", True, f"kept in {folder}; {how}")


def compile_kernels() -> None:
    """Compile the kernels for runs and batches of uniform chains, unless they are cached.

    RunFailed, before compiling, where no folder can keep them.
    """
    from hertzchain.engines.native import Native, elastic, similar_peak_forces

    if elastic.march.stats.cache_path is None:
        raise RunFailed(f"kernels are not compiled ahead: {_NOT_KEPT}")
    Native().run(trial_scene())
    similar_peak_forces("cosine", 1.0, 2.0, 60)  # a batch has its own kernel


def _lammps() -> Finding:
    """Examine LAMMPS in another process, which a wrong library can crash."""
    from hertzchain.engines.lammps.dialect import INSTALL, PACKAGE
    from hertzchain.engines.lammps.engine import look
    from hertzchain.engines.lammps.isolation import Child

    try:
        with Child() as child:
            found, has_granular = child.call(look, time_limit=_LONGEST)
    except HertzchainError as problem:
        return Finding("LAMMPS", False, str(problem))
    if not has_granular:
        text = f"built without the package {PACKAGE}; a build that has it comes with: {INSTALL}"
        return Finding("LAMMPS", False, text)
    return Finding("LAMMPS", True, f"{found}, with the package {PACKAGE}")


def _binaries(named: str | None) -> Iterator[str]:
    """Yield the named binary, those in Python's folder and on the search path, each once."""
    seen = set()
    if named:
        seen.add(Path(shutil.which(named) or named).resolve())
        yield named
    folders = [str(Path(sys.executable).parent), *os.get_exec_path()]
    for folder in folders:
        others = sorted({path.stem for path in Path(folder).glob("lmp_*")})
        for name in ("lmp", "lammps", *others):
            found = shutil.which(name, path=folder)
            if found is None or Path(found).resolve() in seen:
                continue
            seen.add(Path(found).resolve())
            yield found


def _binary(lmp: str) -> Finding:
    """Examine a LAMMPS binary: its version, and whether a small chain runs on it."""
    from hertzchain.engines.lammps.binary import Program, find_mpiexec
    from hertzchain.engines.lammps.dialect import PACKAGE
    from hertzchain.limits import Deadline

    name = f"LAMMPS {lmp}"
    try:
        build = Program.find(lmp, 1, Deadline(_LONGEST)).build
        _try(lmp, 1)
    except HertzchainError as problem:
        return Finding(name, False, str(problem))
    known = f"{build.version}, with the package {PACKAGE}, {build.mpi or 'for one process'}"
    if build.mpi is None:
        return Finding(name, True, f"{known}; runs")
    mpiexec = find_mpiexec(lmp)
    if mpiexec is None:
        return Finding(name, True, f"{known}; runs, alone as there is no mpiexec")
    try:
        _try(lmp, 2)
    except HertzchainError as problem:
        return Finding(name, True, f"{known}; runs alone, not on ranks: {problem}")
    return Finding(name, True, f"{known}; runs, alone and on ranks by {mpiexec}")


def _try(lmp: str, ranks: int) -> None:
    """Run three granules."""
    import numpy as np

    from hertzchain.engines.lammps import Lammps
    from hertzchain.observables.peaks import largest_difference

    scene = trial_scene()
    lammps = Lammps(0.02 * scene.units.time, lmp=lmp, ranks=ranks, time_limit=_LONGEST)
    peaks = lammps.peaks_alone(scene)[0] / scene.units.force
    if not largest_difference(peaks, np.array(TRIAL_PEAKS)) < 1e-3:
        raise RunFailed(f"a small chain has wrong peaks, {peaks.tolist()} of F0: take another")


def trial_scene() -> Scene:
    """Return the scene with which every binary is tried: three granules of steel."""
    from hertzchain.scene.chain import Chain
    from hertzchain.scene.pulse import Pulse
    from hertzchain.scene.scene import Scene

    chain = Chain(3, radius=4.75e-3, young_modulus=193e9, poisson_ratio=0.3, density=7958.0)
    return Scene(chain, Pulse("cosine", 100.0, 2.0, momentum_ratio=1.0))
