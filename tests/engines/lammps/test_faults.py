"""Real faults around hertzchain: LAMMPS killed, hanging, another or broken, kernels damaged.

What is asked of each fault: one clear error, everything else unharmed, nothing left behind.
"""

from __future__ import annotations

import os
import pickle
import runpy
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numba import config

import hertzchain as hc
from hertzchain.engines.lammps.backend import run_in
from hertzchain.engines.lammps.engine import Child
from hertzchain.errors import BackendMissing, RunFailed, SceneError, TooExpensive
from tests.command_line import Command
from tests.conftest import paper_scene
from tests.engines.lammps.reading.chains import BESIDE_PYTHON, SCENE, Deck
from tests.places import ROOT
from tests.processes import (
    STARTED,
    below,
    children,
    ended,
    has_lammps,
    linux,
    names,
    posix,
    runs,
    start,
    wait_for,
)

slow = pytest.mark.slow

LIMIT = 60.0
"""Seconds; no test waits for it."""

SHARED = Path("/dev/shm")  # noqa: S108

SHORT = paper_scene("cosine", 1.0, 2.0, granules=5)
LONG = replace(paper_scene("cosine", 1.0, 2.0, granules=400), run=hc.Run(0.1))
"""Ten seconds of LAMMPS."""


@pytest.fixture(autouse=True)
def _no_process_is_left() -> Iterator[None]:
    before = set(children(os.getpid())) if sys.platform == "linux" else set()
    yield
    # Those of a test that failed before it came to their end, so that no other test pays for it.
    for running in STARTED:
        with running:
            running.kill()
    STARTED.clear()
    if sys.platform == "linux":
        assert set(children(os.getpid())) - before == set()


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


# A process that breaks

SIGNALS = [
    ("SIGKILL", "LAMMPS was killed (SIGKILL), perhaps because memory ran out: free some"),
    ("SIGSEGV", "LAMMPS ended with SIGSEGV; hertzchain doctor says whether it works"),
]


@posix
@pytest.mark.parametrize(("name", "words"), SIGNALS, ids=[name for name, _ in SIGNALS])
def test_a_process_that_dies_is_an_error_and_the_next_one_works(name: str, words: str) -> None:
    with Child() as child:
        first = child.call(os.getpid, time_limit=LIMIT)
        assert first == child.pid
        threading.Timer(0.1, os.kill, (first, getattr(signal, name))).start()
        with pytest.raises(RunFailed) as caught:
            child.call(time.sleep, 50.0, time_limit=LIMIT)
        assert str(caught.value).startswith(words)
        assert "\n" not in str(caught.value)
        assert child.call(os.getpid, time_limit=LIMIT) not in (first, os.getpid())


def test_a_process_that_ends_says_its_last_words() -> None:
    with Child() as child:
        # However much was said before.
        child.call(os.write, 2, b"WARNING: a pair is far apart\n" * 10**4, time_limit=LIMIT)
        child.call(os.write, 2, b"a line\nno MPI here\n\n", time_limit=LIMIT)
        with pytest.raises(RunFailed, match="ended with status 7: no MPI here; hertzchain doctor"):
            child.call(os._exit, 7, time_limit=LIMIT)
        child.call(os.write, 2, b"  what():  std::bad_alloc\n", time_limit=LIMIT)
        with pytest.raises(RunFailed, match="not enough memory"):
            child.call(os.abort, time_limit=LIMIT)
        with pytest.raises(RunFailed, match="not enough memory"):
            child.call(bytearray, 2**60, time_limit=LIMIT)
        assert child.call(len, "unharmed", time_limit=LIMIT) == 8
        with pytest.raises(RuntimeError, match="ZeroDivisionError"):  # a mistake of hertzchain's
            child.call(divmod, 1, 0, time_limit=LIMIT)


def test_processes_that_cannot_be_started(monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patch, Child() as child:
        patch.setattr(sys, "executable", "/no/python")
        with pytest.raises(RunFailed, match="cannot be started"):
            child.call(len, "", time_limit=LIMIT)
    monkeypatch.syspath_prepend(ROOT / "tests" / "no_lammps")
    with Child() as child, pytest.raises(BackendMissing):
        run_in(child, hc.Lammps(), SHORT)


@linux
def test_a_process_that_hangs_is_killed_at_the_time_limit() -> None:
    with Child() as child:
        pid = child.call(os.getpid, time_limit=LIMIT)
        os.kill(pid, signal.SIGSTOP)
        # More than a pipe holds: even the request would block.
        with pytest.raises(TooExpensive, match=r"time limit of 0\.5 s: shorten"):
            child.call(len, bytes(10**6), time_limit=0.5)
        assert not runs(pid)
        assert child.pid is None


def kinds(kind: type[hc.HertzchainError]) -> list[type[hc.HertzchainError]]:
    """An error and all those that are one."""
    return [kind, *(below for subclass in kind.__subclasses__() for below in kinds(subclass))]


@pytest.mark.parametrize("kind", kinds(hc.HertzchainError))
def test_every_error_can_go_from_one_process_to_another(kind: type[hc.HertzchainError]) -> None:
    given = ("dt", -1.0, "must be above 0", "a.toml") if issubclass(kind, SceneError) else ("no",)
    problem = kind(*given)
    copy = pickle.loads(pickle.dumps(problem))  # noqa: S301 - just made
    assert type(copy) is kind
    assert (str(copy), copy.args) == (str(problem), problem.args)
    assert vars(copy) == vars(problem)


PARENT = """
import os, signal, time
signal.signal(signal.SIGINT, signal.default_int_handler)
from hertzchain.engines.lammps.engine import Child

with Child() as child:
    print(child.call(os.getpid, time_limit=60), flush=True)
    child.call(time.sleep, 1000.0, time_limit=2000)
"""


@linux
@pytest.mark.parametrize("name", ["SIGKILL", "SIGINT"])
def test_no_process_outlives_the_one_that_started_it(name: str) -> None:
    with subprocess.Popen(
        [sys.executable, "-c", PARENT], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    ) as parent:
        pid = int(parent.stdout.readline())
        assert runs(pid)
        # Ctrl-C goes to a whole group: the process is not in it.
        assert os.getpgid(pid) != os.getpgid(parent.pid)
        parent.send_signal(getattr(signal, name))
        parent.wait(timeout=300)
        wait_for(lambda: not runs(pid))


EXAMINE = ("examine", "scene.toml", "in.mine", "--lmp", BESIDE_PYTHON)
RUN = ("run", "long.toml", "--backend", "lammps", "--dt", "1e-7", "--lmp", BESIDE_PYTHON)


@linux
@pytest.mark.lammps
@pytest.mark.parametrize("arguments", [EXAMINE, RUN], ids=["examine", "run"])
def test_lammps_ends_with_the_process_that_started_it(
    arguments: tuple[str, ...], folder: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    temporary = tmp_path_factory.mktemp("temporary")
    SCENE.to_toml("scene.toml")
    LONG.to_toml("long.toml")
    Deck(run="run 2000000000").write(folder)
    running = start(*arguments, env={**os.environ, "TMPDIR": str(temporary)})
    wait_for(lambda: any(file.stat().st_size > 1e5 for file in temporary.glob("*/*")))
    lammps = wait_for(lambda: [*filter(has_lammps, below(running.pid))])
    running.kill()
    wait_for(lambda: not any(runs(pid) for pid in lammps))
    wait_for(lambda: not names(temporary))


# LAMMPS in such a process


@pytest.mark.lammps
def test_a_run_ends_at_its_time_limit() -> None:
    # Stopping LAMMPS at every step takes 30 times as long as the steps, and only these are counted
    # beforehand: at 6/7 of the limit the run is not refused, and would take 25 times the limit.
    lammps = hc.Lammps(dt=1e-7, read_every=1, time_limit=0.2)
    with pytest.raises(TooExpensive, match=r"stopped at the time limit of 0\.2 s"):
        lammps.peaks_alone(replace(SHORT, run=hc.Run(0.17 / 0.7 * 0.2)))
    with pytest.raises(TooExpensive, match=r"at least [\d.]+ min, the time limit is 10 min"):
        hc.Lammps(dt=1e-10, time_limit=600.0).run(LONG)  # is not started


# The command line


LAMMPS = ("run", "scene.toml", "--backend", "lammps", "--dt", "1e-7")


@linux
@pytest.mark.lammps
def test_a_stopped_run_says_so_and_leaves_nothing(folder: Path) -> None:
    LONG.to_toml("scene.toml")
    running = start(*LAMMPS, "-o", "peaks.csv")
    wait_for(lambda: has_lammps(running.pid))
    time.sleep(0.3)
    running.send_signal(signal.SIGINT)
    assert ended(running) == (130, "", "hertzchain: interrupted\n")
    assert names(folder) == ["scene.toml"]


@linux
@pytest.mark.lammps
def test_a_want_of_memory_is_one_line(folder: Path) -> None:
    scene = replace(SHORT, chain=replace(SHORT.chain, granules=1_000_000), run=hc.Run(1e-5))
    scene.to_toml("scene.toml")
    # With 500 MB LAMMPS corrupts its heap as it fails, and the process aborts after the line.
    limits = "ulimit -v 650000; export OPENBLAS_NUM_THREADS=1;"
    running = start(*LAMMPS, before=limits)
    status, out, err = ended(running)
    assert (status, out) == (2, "")
    assert err.startswith("hertzchain: there is not enough memory for LAMMPS")
    assert err.count("\n") == 1
    assert names(folder) == ["scene.toml"]


@pytest.mark.lammps
def test_lammps_leaves_no_files(folder: Path) -> None:
    # Neither here, nor where temporary files go, nor in shared memory: 1 MB each time, once.
    work, temporary = folder / "work", folder / "tmp"
    work.mkdir()
    temporary.mkdir()
    SHORT.to_toml(folder / "scene.toml")
    arguments = [LAMMPS[0], folder / "scene.toml", *LAMMPS[2:]]
    environment = {**os.environ, "TMPDIR": str(temporary)}
    pids = []
    with start(*arguments, cwd=work, env=environment) as running:
        pids.append(running.pid)
        before = set(SHARED.glob("mpich_shm_*"))  # numbers of processes come again
        while running.poll() is None:
            pids += children(running.pid) if sys.platform == "linux" else []
            time.sleep(0.01)
        assert running.returncode == 0
    assert names(work) == names(temporary) == []
    files = {SHARED / f"mpich_shm_{pid:x}_0" for pid in pids}
    assert files & set(SHARED.glob("mpich_shm_*")) <= before


# Wrong installs


WRONG_LAMMPS = {
    "crashes": (
        "import ctypes\nctypes.string_at(0)",
        "LAMMPS ended with SIGSEGV; hertzchain doctor says",
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
    damage = [
        (index, index.read_bytes()[: index.stat().st_size // 2]),
        (code, code.read_bytes()[:-100]),
        (code, bytes(1000)),
        (code, other.read_bytes()),
    ]
    for path, content in damage[: 1 if kernels else None]:
        path.write_bytes(content)
        assert read_small(tmp_path) < 2
        assert read_small(tmp_path) == 2
