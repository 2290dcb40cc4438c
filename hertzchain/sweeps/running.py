"""One loop over the parts of a sweep, by any executor; and the cores of this machine as one.

LAMMPS and long work run in processes of their own.
"""

from __future__ import annotations

import queue
from collections.abc import Callable, Iterable
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import AbstractContextManager

from hertzchain.engines.lammps.backend import Lammps
from hertzchain.engines.lammps.isolation import Child
from hertzchain.limits import usable_cores
from hertzchain.sweeps.design import Design
from hertzchain.sweeps.measuring import YEAR, Measured, measure
from hertzchain.sweeps.parts import NAMES, Backend, Part, is_batched, is_short

LOOK = 1.0  # longest time between two checks of the workers [s]
_MOMENT = 0.05  # time between two checks of processes that are to end [s]

Keep = Callable[[Part, Measured], None]
ReportProgress = Callable[[int], None]
Measure = Callable[[Design, Iterable[Part], bool, Keep, ReportProgress], None]


def in_turn(
    submit: Callable[[Part], Future[Measured]],
    room: Callable[[], int],
    parts: Iterable[Part],
    keep: Callable[[Part, Future[Measured]], None],
) -> None:
    """Submit parts, as many at once as there is room for; ``keep`` is called in this thread."""
    waiting, at_work = iter(parts), dict[Future[Measured], Part]()
    while True:
        while len(at_work) < room() and (part := next(waiting, None)) is not None:
            future = submit(part)
            at_work[future] = part
            if future.done():  # kept before another is measured
                break
        if not at_work:
            return
        done, _ = wait(at_work, timeout=LOOK, return_when=FIRST_COMPLETED)
        for future in done:
            keep(at_work.pop(future), future)


def measure_here(
    design: Design, parts: Iterable[Part], peaks: bool, keep: Keep, report_progress: ReportProgress
) -> None:
    """Measure parts on this machine."""
    with _Cores(design, peaks, report_progress) as cores:
        in_turn(cores.submit, cores.room, parts, lambda part, future: keep(part, future.result()))


class _Stopped(Exception):
    """Raised to stop work on a part that is no longer wanted."""


class _Cores(AbstractContextManager["_Cores"]):
    """One thread for each core, each with a process that may crash; short work stays here."""

    def __init__(self, design: Design, peaks: bool, report_progress: ReportProgress) -> None:
        self._design, self._peaks, self._report_progress = design, peaks, report_progress
        self._at_work: list[Future[Measured]] = []
        self._here: dict[Backend, bool] = {}
        self._children = [Child() for _ in range(usable_cores())]
        self._idle: queue.SimpleQueue[Child] = queue.SimpleQueue()
        for child in self._children:
            self._idle.put(child)
        self._pool = ThreadPoolExecutor(len(self._children))
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

    def room(self) -> int:
        """Return the number of cores."""
        return len(self._children)

    def submit(self, part: Part) -> Future[Measured]:
        """Start a part in a thread, or measure it now where a process would only cost time."""
        backend, design = part.backend, self._design
        if backend not in self._here:
            self._here[backend] = is_batched(design, backend) or is_short(design, backend)
        if not self._here[backend]:
            future = self._pool.submit(self._measure, part)
            self._at_work = [future, *(one for one in self._at_work if not one.done())]
            return future
        future = Future[Measured]()
        future.set_result(measure(design, part, self._peaks, report_progress=self._report_progress))
        return future

    def _measure(self, part: Part) -> Measured:
        child, given = self._idle.get(), (self._design, part, self._peaks)
        try:
            if isinstance(part.backend, Lammps):
                return measure(*given, child=child, report_progress=self._report_on)
            who = NAMES[type(part.backend)]
            found: Measured = child.call(measure, *given, 1, time_limit=YEAR, who=who)
        finally:
            self._idle.put(child)
        self._report_on(part.stop - part.start)
        return found

    def _report_on(self, scenes: int) -> None:
        if self._stopped:
            raise _Stopped
        self._report_progress(scenes)
