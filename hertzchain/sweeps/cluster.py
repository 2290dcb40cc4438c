"""Parts of a sweep on the workers of a Dask scheduler, which measure them and write nothing.

The results are collected in this process. If a worker is lost, another one measures its parts.
"""

from __future__ import annotations

import asyncio
import logging
import pickle
import time
import uuid
from collections.abc import Iterable, Iterator
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

from hertzchain.errors import BackendMissing, HertzchainError, RunFailed
from hertzchain.sweeps.design import Design
from hertzchain.sweeps.measuring import Measured, measure
from hertzchain.sweeps.parts import Part
from hertzchain.sweeps.running import LOOK, Keep, Measure, ReportProgress, in_turn

if TYPE_CHECKING:
    from distributed import Client

_log = logging.getLogger(__name__)

_PATIENCE = 10.0  # waiting time for a scheduler that does not answer [s]
_FAREWELL = 3.0  # waiting time for the connection to close [s]
_AHEAD = 3  # parts sent for each thread: no thread waits, and memory does not grow


@contextmanager
def cluster(scheduler: str) -> Iterator[Measure]:
    """Return ``measure_here`` for the workers of a Dask scheduler at ``tcp://host:8786``."""
    try:
        import distributed  # noqa: F401 - what is imported below
    except ModuleNotFoundError:
        raise BackendMissing(
            "sweeps on a cluster need distributed: pip install 'hertzchain[cluster]'"
        ) from None
    with _quiet(), _connected(scheduler) as client:
        room, name = _Room(client, scheduler), uuid.uuid4().hex

        def measure(
            design: Design, parts: Iterable[Part], peaks: bool, keep: Keep, report: ReportProgress
        ) -> None:
            executor = client.get_executor()

            def submit(part: Part) -> Future[Measured]:
                task = pickle.dumps(Task(design, part, peaks))
                future: Future[Measured] = executor.submit(
                    pickle.loads, task, key=f"{part.name}-{name}"
                )
                return future

            def keep_found(part: Part, future: Future[Measured]) -> None:
                measured = _found(future, part, scheduler)
                report(part.stop - part.start)
                keep(part, measured)

            in_turn(submit, room.now, parts, keep_found)

        yield measure


@dataclass(frozen=True)
class Task:
    """A part sent to a worker: pickled here, measured where it is unpickled.

    Versions are compared before the part is read.
    """

    design: Design
    part: Part
    peaks: bool

    def __reduce__(self) -> tuple[Any, ...]:
        """Return the call that pickle.loads makes."""
        packed = pickle.dumps((self.design, self.part, self.peaks))
        return work, (version("hertzchain"), packed)


def work(wanted: str, packed: bytes) -> Measured:
    """Measure the part of a ``Task``, in a thread of a worker that must have the wanted version."""
    from distributed import get_worker

    who, found = f"the worker {get_worker().address}", version("hertzchain")
    if found != wanted:
        raise RunFailed(f"{who} has hertzchain {found}, this is {wanted}: install the same on both")
    design, part, peaks = pickle.loads(packed)  # noqa: S301 - whoever sends it may run anything here
    try:
        return measure(design, part, peaks, cores=1)
    except BackendMissing as problem:
        raise BackendMissing(f"on {who}: {problem}") from None


class _Room:
    """The number of parts that the present workers take."""

    def __init__(self, client: Client, scheduler: str) -> None:
        self._client, self._scheduler = client, scheduler
        self._threads, self._next_look, self._waits = 0, 0.0, False

    def now(self) -> int:
        """Return enough parts for the workers; report if there are none."""
        if time.monotonic() < self._next_look:
            return _AHEAD * max(self._threads, 1)
        if self._client.status != "running":
            raise _lost(self._scheduler)
        with suppress(OSError):  # a scheduler that answers slowly, or is lost
            there = self._client.sync(self._client.nthreads, callback_timeout=_PATIENCE)
            self._threads = sum(there.values())
            if self._threads == 0 and not self._waits:
                _log.warning(
                    "hertzchain: %s has no workers: the sweep waits for some", self._scheduler
                )
            self._waits = self._threads == 0
        self._next_look = time.monotonic() + LOOK
        return _AHEAD * max(self._threads, 1)


def _found(future: Future[Measured], part: Part, scheduler: str) -> Measured:
    """Return the tables of a part, or raise an error that says why there are none."""
    from distributed import KilledWorker

    try:
        return future.result()
    except HertzchainError:
        raise
    except KilledWorker:
        raise RunFailed(
            f"part {part.name} was lost with worker after worker: look into their logs, they"
            " may be short of memory; the same command resumes the sweep"
        ) from None
    except (ImportError, AttributeError) as problem:  # the latter in another version
        raise BackendMissing(
            f"a worker of {scheduler} cannot import {problem.name or problem}: pip"
            f" install 'hertzchain=={version('hertzchain')}' there"
        ) from None
    except (CancelledError, OSError):
        raise _lost(scheduler) from None


def _lost(scheduler: str) -> RunFailed:
    return RunFailed(
        f"the scheduler {scheduler} is gone: start it again; the same command resumes the sweep"
    )


@contextmanager
def _connected(scheduler: str) -> Iterator[Client]:
    """Connect to a scheduler; parts that are not done are dropped when the connection ends."""
    from distributed import Client

    try:
        with ThreadPoolExecutor(1) as pool:  # in a thread: a notebook has an event loop of its own
            pool.submit(asyncio.run, _knock(scheduler)).result()
        client = Client(scheduler, timeout=_PATIENCE, set_as_default=False)
    except (OSError, ValueError, TypeError, ImportError) as problem:
        reason = str(problem).partition("\n")[0] or "it does not answer"
        raise RunFailed(
            f"the scheduler {scheduler!r} cannot be reached ({reason}): is it running, and is this"
            " its address, such as tcp://host:8786?"
        ) from None
    try:
        yield client
    finally:
        with suppress(OSError):
            client.close(timeout=_FAREWELL)


async def _knock(scheduler: str) -> None:
    """Check that a scheduler answers: with any other program a client would wait without end."""
    from distributed import Security
    from distributed.comm.core import connect

    options = Security().get_connection_args("client")
    there = await asyncio.wait_for(connect(scheduler, timeout=_PATIENCE, **options), _PATIENCE + 1)
    there.abort()


@contextmanager
def _quiet() -> Iterator[None]:
    """Silence Dask's loggers; errors are reported in one sentence."""
    # Dask gives some of its loggers their own level and handler.
    loggers = [
        logger
        for name, logger in logging.root.manager.loggerDict.items()
        if isinstance(logger, logging.Logger) and name.partition(".")[0] == "distributed"
    ]
    before = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for logger, level in zip(loggers, before, strict=True):
            logger.setLevel(level)
