"""Sweeps on a Dask cluster: scheduler and workers are processes of their own, on loopback."""

from __future__ import annotations

import json
import logging
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

import pytest
from pandas.testing import assert_frame_equal

import hertzchain as hc
from hertzchain.errors import BackendMissing, HertzchainError, RunFailed
from hertzchain.sweeps import loop
from tests.command_line import python
from tests.conftest import paper_scene
from tests.places import ROOT

_MOMENT = 0.05  # time between two checks of starting processes [s]
_PATIENCE = 60.0  # waiting time for starting processes [s]


@contextmanager
def running(command: list[str], log: Path) -> Iterator[subprocess.Popen[bytes]]:
    """A module of Python as a process, with all processes it starts; killed in the end."""
    with log.open("ab") as stream:
        process = subprocess.Popen(
            [sys.executable, "-m", *command], cwd=log.parent, start_new_session=True,
            stdin=subprocess.DEVNULL, stdout=stream, stderr=stream,
        )  # fmt: skip
    try:
        yield process
    finally:
        kill(process)


def kill(process: subprocess.Popen[bytes]) -> None:
    """Kill a process and those that it has started, but for those with a session of their own."""
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


@contextmanager
def scheduler(folder: Path, port: int = 0) -> Iterator[tuple[str, subprocess.Popen[bytes]]]:
    """A Dask scheduler on loopback, on a free port or on this one: its address, and itself."""
    described = folder / "scheduler.json"
    described.unlink(missing_ok=True)
    command = ["distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", str(port)]
    command += ["--no-dashboard", "--dashboard-address", "127.0.0.1:0"]
    command += ["--scheduler-file", str(described)]
    with running(command, log := folder / "scheduler.log") as process:
        until = time.monotonic() + _PATIENCE
        while True:
            try:
                address: str = json.loads(described.read_text(encoding="utf-8"))["address"]
                break
            except (FileNotFoundError, ValueError):  # not started yet, or not complete
                if process.poll() is not None or time.monotonic() > until:
                    raise RuntimeError(log.read_text(encoding="utf-8")) from None
                time.sleep(_MOMENT)
        yield address, process


@contextmanager
def worker(
    address: str, folder: Path, *options: str, name: str = "worker"
) -> Iterator[subprocess.Popen[bytes]]:
    """Start a Dask worker of one thread; it is there a second or so later."""
    command = ["distributed.cli.dask_worker", address, "--nthreads", "1", "--no-dashboard"]
    command += ["--name", name, "--local-directory", str(folder), *options]
    with running(command, folder / f"{name}.log") as process:
        yield process


SCENE = paper_scene("cosine-triangular", 2.0, 2.0, granules=16)
RATIOS = {"shock.momentum_ratio": "0.5:4:16:log"}
LAMMPS = hc.Lammps(rtol=1e-2)


@pytest.fixture(scope="module")
def lonely(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The address of a scheduler: tests bring workers, and take them away again."""
    with scheduler(tmp_path_factory.mktemp("lonely")) as (address, _):
        yield address


def sweep(
    address: str | None = None,
    backends: Sequence[object] = (hc.Native(rtol=1e-4), LAMMPS),
    **more: object,
) -> hc.Sweep:
    return hc.sweep(SCENE, RATIOS, backends=backends, peaks=True, scheduler=address, **more)  # type: ignore[arg-type]


@pytest.mark.slow
@pytest.mark.lammps
def test_a_worker_that_ends_in_the_middle_changes_nothing(lonely: str, tmp_path: Path) -> None:
    """It is killed: another takes its part."""
    from distributed import Client

    with ExitStack() as stack:
        first, _second = (
            stack.enter_context(worker(lonely, tmp_path, "--no-nanny", name=name))
            for name in ("first", "second")
        )
        with Client(lonely, set_as_default=False) as client:
            client.wait_for_workers(2, timeout=_PATIENCE)
        killed: list[int] = []

        def kill_it(done: int, _: int) -> None:
            if not killed and done >= 4:
                killed.append(done)
                kill(first)

        swept, local = sweep(lonely, progress=kill_it), sweep()
        assert_frame_equal(swept.to_frame(), local.to_frame(), check_exact=True)
        assert_frame_equal(swept.peaks_to_frame(), local.peaks_to_frame(), check_exact=True)
        assert killed
        assert killed[0] < local.rows


def test_a_part_that_ends_workers_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # Not 3: each worker that is lost takes a second to start.
    monkeypatch.setenv("DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES", "0")
    deadly = tmp_path / "deadly.py"
    deadly.write_text(
        "import os\nfrom hertzchain.sweeps import loop\n"
        "loop.measure = lambda *_, **__: os._exit(1)\n",
        encoding="utf-8",
    )
    lost = pytest.raises(RunFailed, match="was lost with worker after worker")
    preloaded = ("--no-nanny", "--preload", str(deadly))
    with scheduler(tmp_path) as (address, _), worker(address, tmp_path, *preloaded), lost:
        sweep(address, ["native"])


# Workers without this hertzchain

WITHOUT = """
import importlib.metadata as metadata
import sys

sys.modules["hertzchain"] = None
find = metadata.Distribution.from_name.__func__

def from_name(cls, name):
    if name == "hertzchain":
        raise metadata.PackageNotFoundError(name)
    return find(cls, name)

metadata.Distribution.from_name = classmethod(from_name)
"""


def without_hertzchain(folder: Path) -> None:
    """Let a Python that has this folder on its path have none."""
    (folder / "sitecustomize.py").write_text(WITHOUT, encoding="utf-8")


def other_hertzchain(folder: Path) -> None:
    """Let a Python that has this folder on its path have another."""
    described = folder / "hertzchain-99.0.dist-info"
    described.mkdir()
    text = "Metadata-Version: 2.1\nName: hertzchain\nVersion: 99.0\n"
    (described / "METADATA").write_text(text, encoding="utf-8")


@pytest.mark.parametrize(
    ("differ", "error", "said"),
    [
        (without_hertzchain, BackendMissing, "pip install 'hertzchain=="),
        (other_hertzchain, RunFailed, "has hertzchain 99.0, this is "),
    ],
)
def test_workers_without_this_hertzchain_are_named(
    differ: Callable[[Path], None],
    error: type[HertzchainError],
    said: str,
    lonely: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """They come when the sweep is waiting for workers."""
    before = tmp_path / "before"
    before.mkdir()
    differ(before)
    with ExitStack() as stack:

        class Handler(logging.Handler):
            def emit(self, _: logging.LogRecord) -> None:
                path = os.pathsep.join([str(before), os.environ.get("PYTHONPATH", "")])
                with monkeypatch.context() as changed:
                    changed.setenv("PYTHONPATH", path)
                    stack.enter_context(worker(lonely, tmp_path, "--no-nanny"))

        waiting = logging.getLogger(loop.__name__)
        waiting.addHandler(handler := Handler())
        stack.callback(waiting.removeHandler, handler)
        with pytest.raises(error, match=said) as it:
            sweep(lonely, output=tmp_path / "out")
        assert "\n" not in str(it.value)
        assert not (tmp_path / "out").exists()  # made, but for nothing


@pytest.mark.slow
@pytest.mark.lammps
def test_the_script_of_the_page_runs_on_jobs_of_this_machine(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """dask-jobqueue starts the jobs that it would submit to Slurm."""
    options = "{'host': '127.0.0.1', 'dashboard_address': '127.0.0.1:0'}"
    monkeypatch.setenv("DASK_JOBQUEUE__LOCAL__SCHEDULER_OPTIONS", options)
    monkeypatch.setenv("DASK_JOBQUEUE__LOCAL__LOCAL_DIRECTORY", str(tmp_path))
    page = (ROOT / "docs" / "clusters.md").read_text(encoding="utf-8")
    script = page.partition("```python\n# sweep_on_slurm.py\n")[2].partition("```")[0]
    SCENE.to_toml(tmp_path / "chain.toml")
    for shown, smaller in {
        "from dask_jobqueue import": "from dask_jobqueue.local import LocalCluster as",
        "validation/scenes/demo.toml": "chain.toml",
        "0.1:10:300:log": "0.5:4:6:log",
        "1.1:4:30": "1.5:2:2",
        "cores=32, processes=32": "cores=2, processes=2",
        "64 GB": "2 GB",
        "maximum_jobs=10": "maximum_jobs=1",
    }.items():
        assert shown in script
        script = script.replace(shown, smaller)
    (tmp_path / "sweep_on_slurm.py").write_text(script, encoding="utf-8")
    done = python("sweep_on_slurm.py", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("Counts(done=24, failed=0, missed=0")
    alone = hc.sweep(
        SCENE,
        {"shock.momentum_ratio": "0.5:4:6:log", "shock.duration_ratio": "1.5:2:2"},
        backends=["native", "lammps"],
    )
    frame = hc.Sweep.load(tmp_path / "out").to_frame()
    assert_frame_equal(frame, alone.to_frame(), check_exact=True)
