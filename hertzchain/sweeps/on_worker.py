"""Code on a worker of a Dask scheduler: measures parts of a sweep, LAMMPS in child processes."""

from __future__ import annotations

import pickle
import threading
from dataclasses import dataclass
from importlib.metadata import version
from typing import Any

from distributed import Reschedule, Worker, WorkerPlugin, get_worker

from hertzchain.engines.lammps.isolation import Child
from hertzchain.errors import BackendMissing, RunFailed
from hertzchain.sweeps.design import Design
from hertzchain.sweeps.measuring import Measured, measure
from hertzchain.sweeps.parts import Part


@dataclass(frozen=True)
class Task:
    """A part sent to a worker: pickled here, measured where it is unpickled.

    Versions are compared before the part is read. Parts of the same sweep, known by its name, share
    processes.
    """

    sweep: str
    design: Design
    part: Part
    peaks: bool

    def __reduce__(self) -> tuple[Any, ...]:
        """Return the call that pickle.loads makes."""
        packed = pickle.dumps((self.design, self.part, self.peaks))
        return work, (self.sweep, version("hertzchain"), packed)


def work(sweep: str, wanted: str, packed: bytes) -> Measured:
    """Measure the part of a ``Task``, in a thread of a worker of the wanted version."""
    worker = get_worker()
    check_version(f"the worker {worker.address}", version("hertzchain"), wanted)
    design, part, peaks = pickle.loads(packed)  # noqa: S301 - whoever sends it may run anything here
    bench = _bench(worker, sweep)
    bench.report_progress(0)
    try:
        return measure(
            design, part, peaks, cores=1, child=bench.child(), report_progress=bench.report_progress
        )
    except BackendMissing as problem:
        raise BackendMissing(f"on the worker {worker.address}: {problem}") from None
    finally:
        bench.end_if_ended()


def end(sweep: str, dask_worker: Worker) -> None:
    """End the processes of a sweep on a worker; Dask passes ``dask_worker`` by name."""
    _bench(dask_worker, sweep).teardown(dask_worker)


def check_version(who: str, found: str | None, wanted: str) -> None:
    """Refuse a version of hertzchain other than that of the sweep; None for no hertzchain."""
    if found is None:
        raise BackendMissing(f"{who} has no hertzchain: pip install 'hertzchain=={wanted}' there")
    if found != wanted:
        raise RunFailed(f"{who} has hertzchain {found}, this is {wanted}: install the same on both")


class _Bench(WorkerPlugin):
    """Child processes of a worker, one for each thread; a Dask plugin, to end with the worker."""

    def __init__(self) -> None:
        self._children: dict[int, Child] = {}
        self._ended = False

    def child(self) -> Child:
        """The process of this thread, which starts when it is first used."""
        return self._children.setdefault(threading.get_ident(), Child())

    def report_progress(self, _: int) -> None:
        """Stop after a scene if the rest of the part is no longer wanted."""
        if self._ended:
            raise Reschedule

    def end_if_ended(self) -> None:
        """End processes that were started during the end of all others."""
        if self._ended:
            self.teardown(None)

    def teardown(self, worker: Any) -> None:  # noqa: ARG002 - Dask's signature
        """End the processes; a run in one of them fails."""
        self._ended = True
        for child in list(self._children.values()):
            child.end()


def _bench(worker: Worker, sweep: str) -> _Bench:
    """Return the processes of a sweep, created at first use; an ended sweep keeps an ended one."""
    # Not worker.plugin_add: that replaces the one that another thread has just made.
    bench = worker.plugins.setdefault(f"hertzchain-{sweep}", _Bench())
    assert isinstance(bench, _Bench)
    return bench
