"""Speed of a Dask cluster with two workers over one with a single worker: `make cluster`.

Scheduler and workers are started here, on this machine, as processes of their own with one thread
each. LAMMPS scenes are measured, by one worker and by two in turn, so that what else the machine
does at the time hits both alike. It takes two cores that rest to see what the cluster costs.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

import pandas
from rich.console import Console
from rich.table import Table

import hertzchain as hc
from hertzchain.files import check_writable, write_text
from validation.script import dated, leave_with
from validation.shipped import load

TITLE = "Two workers of a Dask cluster beside one"

WANTED = 1.8
"""Least ratio of speeds: 2, less the loss at the end, where one worker has no part left."""

_MOMENT = 0.05
"""Time between two checks of starting processes [s]."""

_PATIENCE = 60.0
"""Waiting time for starting processes [s]."""


@contextmanager
def running(command: list[str], log: Path) -> Iterator[subprocess.Popen[bytes]]:
    """A module of Python as a process, with all processes it starts; killed in the end."""
    with log.open("ab") as stream:
        process = subprocess.Popen(  # noqa: S603 - this interpreter, modules of Dask
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


def await_workers(address: str, count: int) -> None:
    """Wait until a scheduler has so many workers."""
    from distributed import Client

    with Client(address, set_as_default=False) as client:
        client.wait_for_workers(count, timeout=_PATIENCE)


def seconds(workers: int, scenes: int) -> float:
    """Measure the time of a LAMMPS sweep on a cluster of warm workers [s]."""
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        address, _ = stack.enter_context(scheduler(folder))
        for number in range(workers):
            stack.enter_context(worker(address, folder, "--no-nanny", name=f"worker-{number}"))
        await_workers(address, workers)

        def sweep(count: int, rtol: float) -> float:
            begin, vary = time.perf_counter(), {"shock.momentum_ratio": f"1:2:{count}"}
            hc.sweep(load("demo"), vary, backends=[hc.Lammps(rtol=rtol)], scheduler=address)
            return time.perf_counter() - begin

        sweep(4 * workers, 1e-2)  # modules are imported by now
        return sweep(scenes, 1e-4)


def measure(pairs: int, scenes: int) -> list[tuple[int, int, float, float]]:
    """Return workers, scenes, seconds and ratio of speeds for pairs of sweeps, alternately."""
    measured = []
    for number in range(pairs):
        order = (1, 2) if number % 2 == 0 else (2, 1)
        took = {workers: seconds(workers, scenes) for workers in order}
        measured += [(count, scenes, took[count], took[1] / took[count]) for count in (1, 2)]
    return measured


def run() -> bool:
    """Print the times of sweeps; return whether two workers are fast enough."""
    parser = argparse.ArgumentParser(description=TITLE)
    parser.add_argument("--pairs", type=int, default=3, help="of sweeps, by one worker and by two")
    parser.add_argument("--scenes", type=int, default=128, help="of each sweep")
    parser.add_argument("-o", "--output", type=Path, help="write the table as CSV")
    chosen = parser.parse_args()
    if chosen.output is not None:
        check_writable(chosen.output)
    before = os.getloadavg()[0]
    measured = measure(chosen.pairs, chosen.scenes)
    print(TITLE)
    columns = ["workers", "scenes", "seconds", "ratio"]
    table = Table(*columns)
    for workers, scenes, took, ratio in measured:
        table.add_row(str(workers), str(scenes), f"{took:.2f}", f"{ratio:.2f}")
    Console(width=100).print(table)
    middle = statistics.median(ratio for workers, *_, ratio in measured if workers == 2)
    facts = f"{os.cpu_count()} cores, load before {before:.1f}"
    print(f"Median of the ratios {middle:.2f}, wanted {WANTED}; {facts}")
    if chosen.output is not None:
        rows = pandas.DataFrame(measured, columns=columns)
        text = rows.to_csv(index=False, float_format="%.3f")
        write_text(chosen.output, dated(f"hertzchain {hc.__version__}; {facts}", text))
    return middle >= WANTED


if __name__ == "__main__":
    leave_with(run)
