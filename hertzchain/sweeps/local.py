"""Parts of a sweep on this machine: LAMMPS and long work in processes of their own."""

from __future__ import annotations

import queue
from collections.abc import Callable, Iterable
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import AbstractContextManager

from hertzchain.engines.lammps import Lammps
from hertzchain.engines.lammps.isolation import Child
from hertzchain.limits import usable_cores
from hertzchain.sweeps.design import Design
from hertzchain.sweeps.measuring import YEAR, Measured, measure
from hertzchain.sweeps.parts import Backend, Part, is_batched, is_short

_MOMENT = 0.05  # time between two checks of processes that are to end [s]

Keep = Callable[[Part, Measured], None]
ReportProgress = Callable[[int], None]
Measure = Callable[[Design, Iterable[Part], bool, Keep, ReportProgress], None]


class _Stopped(Exception):
    """Raised to stop work on a part that is no longer wanted."""


def measure_here(
    design: Design, parts: Iterable[Part], peaks: bool, keep: Keep, report_progress: ReportProgress
) -> None:
    """Measure parts; ``keep`` is called in this thread, progress is reported from any thread."""
    here: dict[Backend, bool] = {}
    with _Workers(design, peaks, keep, report_progress) as workers:
        for part in parts:
            backend = part.backend
            if backend not in here:
                here[backend] = is_batched(design, backend) or is_short(design, backend)
            if here[backend]:
                keep(part, measure(design, part, peaks, report_progress=report_progress))
            else:
                workers.take(part)
        workers.keep_all()


class _Workers(AbstractContextManager["_Workers"]):
    """One thread for each core, each with a process that may crash."""

    def __init__(
        self, design: Design, peaks: bool, keep: Keep, report_progress: ReportProgress
    ) -> None:
        self._design, self._peaks = design, peaks
        self._keep, self._report_progress = keep, report_progress
        cores = usable_cores()
        self._children = [Child() for _ in range(cores)]
        self._idle: queue.SimpleQueue[Child] = queue.SimpleQueue()
        for child in self._children:
            self._idle.put(child)
        self._pool = ThreadPoolExecutor(cores)
        self._at_work: dict[Future[Measured], Part] = {}
        self._stopped = False

    def __exit__(self, *_: object) -> None:
        self._stopped = True
        for future in self._at_work:
            future.cancel()
        while True:  # a thread may be about to start its process again
            for child in self._children:
                child.end()
            if not wait(self._at_work, timeout=_MOMENT).not_done:
                break
        self._pool.shutdown()

    def take(self, part: Part) -> None:
        """Start a part as soon as a core is free."""
        while len(self._at_work) >= len(self._children):
            self._keep_some()
        self._at_work[self._pool.submit(self._measure, part)] = part

    def keep_all(self) -> None:
        """Wait for all parts."""
        while self._at_work:
            self._keep_some()

    def _keep_some(self) -> None:
        done, _ = wait(self._at_work, return_when=FIRST_COMPLETED)
        for future in done:
            self._keep(self._at_work.pop(future), future.result())

    def _measure(self, part: Part) -> Measured:
        child = self._idle.get()
        try:
            if isinstance(part.backend, Lammps):
                return measure(
                    self._design, part, self._peaks, child=child, report_progress=self._report_on
                )
            found: Measured = child.call(
                measure, self._design, part, self._peaks, 1, time_limit=YEAR
            )
        finally:
            self._idle.put(child)
        self._report_on(part.stop - part.start)
        return found

    def _report_on(self, scenes: int) -> None:
        if self._stopped:
            raise _Stopped
        self._report_progress(scenes)
