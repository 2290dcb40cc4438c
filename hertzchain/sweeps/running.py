"""One loop over the parts of a sweep, by any executor; and the cores of this machine as one.

LAMMPS and long work run in processes of their own.
"""

from __future__ import annotations

import queue
from abc import abstractmethod
from collections.abc import Callable, Iterable
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import AbstractContextManager

from hertzchain.engines.lammps import Lammps
from hertzchain.engines.lammps.isolation import Child
from hertzchain.limits import usable_cores
from hertzchain.sweeps.design import Design
from hertzchain.sweeps.measuring import YEAR, Measured, measure
from hertzchain.sweeps.parts import Backend, Part, is_batched, is_short

LOOK = 1.0  # longest time without a look at who measures [s]
_MOMENT = 0.05  # time between two checks of processes that are to end [s]

Keep = Callable[[Part, Measured], None]
ReportProgress = Callable[[int], None]
Measure = Callable[[Design, Iterable[Part], bool, Keep, ReportProgress], None]


class Crew(AbstractContextManager["Crew"]):
    """Those who measure the parts of a sweep; progress is reported from any thread."""

    def __init__(self, design: Design, peaks: bool, report_progress: ReportProgress) -> None:
        self.design, self.peaks, self.report_progress = design, peaks, report_progress
        self.at_work: dict[Future[Measured], Part] = {}

    @abstractmethod
    def room(self) -> int:
        """Return how many parts are taken at once."""

    @abstractmethod
    def submit(self, part: Part) -> Future[Measured]:
        """Start a part."""

    def result(self, future: Future[Measured], part: Part) -> Measured:  # noqa: ARG002
        """Return the tables of a part that is done."""
        return future.result()

    def measure(self, parts: Iterable[Part], keep: Keep) -> None:
        """Measure parts; ``keep`` is called in this thread."""
        waiting = iter(parts)
        while True:
            while len(self.at_work) < self.room() and (part := next(waiting, None)) is not None:
                future = self.submit(part)
                self.at_work[future] = part
                if future.done():  # kept before another is measured
                    break
            if not self.at_work:
                return
            done, _ = wait(self.at_work, timeout=LOOK, return_when=FIRST_COMPLETED)
            for future in done:
                part = self.at_work.pop(future)
                keep(part, self.result(future, part))


def measure_here(
    design: Design, parts: Iterable[Part], peaks: bool, keep: Keep, report_progress: ReportProgress
) -> None:
    """Measure parts on this machine."""
    with _Cores(design, peaks, report_progress) as cores:
        cores.measure(parts, keep)


class _Stopped(Exception):
    """Raised to stop work on a part that is no longer wanted."""


class _Cores(Crew):
    """One thread for each core, each with a process that may crash; short work stays here."""

    def __init__(self, design: Design, peaks: bool, report_progress: ReportProgress) -> None:
        super().__init__(design, peaks, report_progress)
        self._here: dict[Backend, bool] = {}
        self._children = [Child() for _ in range(usable_cores())]
        self._idle: queue.SimpleQueue[Child] = queue.SimpleQueue()
        for child in self._children:
            self._idle.put(child)
        self._pool = ThreadPoolExecutor(len(self._children))
        self._stopped = False

    def __exit__(self, *_: object) -> None:
        self._stopped = True
        for future in self.at_work:
            future.cancel()
        while True:  # a thread may be about to start its process again
            for child in self._children:
                child.end()
            if not wait(self.at_work, timeout=_MOMENT).not_done:
                break
        self._pool.shutdown()

    def room(self) -> int:
        """Return the number of cores."""
        return len(self._children)

    def submit(self, part: Part) -> Future[Measured]:
        """Start a part in a thread, or measure it now where a process would only cost time."""
        backend, design = part.backend, self.design
        if backend not in self._here:
            self._here[backend] = is_batched(design, backend) or is_short(design, backend)
        if not self._here[backend]:
            return self._pool.submit(self._measure, part)
        future: Future[Measured] = Future()
        future.set_result(measure(design, part, self.peaks, report_progress=self.report_progress))
        return future

    def _measure(self, part: Part) -> Measured:
        child, given = self._idle.get(), (self.design, part, self.peaks)
        try:
            if isinstance(part.backend, Lammps):
                return measure(*given, child=child, report_progress=self._report_on)
            found: Measured = child.call(measure, *given, 1, time_limit=YEAR)
        finally:
            self._idle.put(child)
        self._report_on(part.stop - part.start)
        return found

    def _report_on(self, scenes: int) -> None:
        if self._stopped:
            raise _Stopped
        self.report_progress(scenes)
