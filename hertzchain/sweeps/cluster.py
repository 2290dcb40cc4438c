"""Parts of a sweep on the workers of a Dask scheduler, which measure them and write nothing.

Results are kept here: where a worker is lost, another measures its parts.
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
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

from hertzchain.errors import BackendMissing, HertzchainError, RunFailed
from hertzchain.sweeps.design import Design
from hertzchain.sweeps.measuring import Measured
from hertzchain.sweeps.parts import Part
from hertzchain.sweeps.running import LOOK, Crew, Keep, Measure, ReportProgress

if TYPE_CHECKING:
    from distributed import Client

_log = logging.getLogger(__name__)

_PATIENCE = 10.0  # waiting time for a scheduler that does not answer [s]
_FAREWELL = 3.0  # waiting time for workers to stop and for the connection to close [s]
_AHEAD = 3  # parts handed out for each thread: no thread waits, and memory does not grow


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
        _check_versions(client, scheduler)

        def measure(
            design: Design, parts: Iterable[Part], peaks: bool, keep: Keep, report: ReportProgress
        ) -> None:
            with _Workers(design, peaks, report, client, scheduler) as workers:
                workers.measure(parts, keep)

        yield measure


class _Workers(Crew):
    """The workers of a Dask scheduler."""

    def __init__(
        self, design: Design, peaks: bool, report: ReportProgress, client: Client, scheduler: str
    ) -> None:
        super().__init__(design, peaks, report)
        self._client, self._scheduler = client, scheduler
        self._executor = client.get_executor()
        self._name = uuid.uuid4().hex
        self._threads = 0
        self._next_look = 0.0
        self._waits = False

    def __exit__(self, *_: object) -> None:
        from hertzchain.sweeps.on_worker import end

        # Dask drops parts that are not done when the connection is closed.
        with suppress(OSError):
            _ask(self._client, _FAREWELL, "run", end, self._name, on_error="ignore")

    def room(self) -> int:
        """Return enough parts for the present workers; report if there are none."""
        if time.monotonic() >= self._next_look:
            self._look()
        return _AHEAD * max(self._threads, 1)

    def _look(self) -> None:
        if self._client.status != "running":
            raise _lost(self._scheduler)
        with suppress(OSError):  # a scheduler that answers slowly, or is lost
            self._threads = sum(_ask(self._client, _PATIENCE, "nthreads").values())
            if self._threads == 0 and not self._waits:
                _log.warning(
                    "hertzchain: %s has no workers: the sweep waits for some", self._scheduler
                )
            self._waits = self._threads == 0
        self._next_look = time.monotonic() + LOOK

    def submit(self, part: Part) -> Future[Measured]:
        """Hand out a part."""
        from hertzchain.sweeps.on_worker import Task

        task = pickle.dumps(Task(self._name, self.design, part, self.peaks))
        future: Future[Measured] = self._executor.submit(
            pickle.loads, task, key=f"{part.name}-{self._name}"
        )
        return future

    def result(self, future: Future[Measured], part: Part) -> Measured:
        """Return the tables of a part, or say in a sentence what became of it."""
        from distributed import KilledWorker

        try:
            measured = future.result()
        except HertzchainError:
            raise
        except KilledWorker:
            raise RunFailed(
                f"part {part.name} was lost with worker after worker: look into their logs, they"
                " may be short of memory; the same command resumes the sweep"
            ) from None
        except ImportError as problem:  # from a worker that joined later
            raise BackendMissing(
                f"a worker of {self._scheduler} cannot import {problem.name or problem}: pip"
                f" install 'hertzchain=={version('hertzchain')}' there"
            ) from None
        except (CancelledError, OSError):
            raise _lost(self._scheduler) from None
        self.report_progress(part.stop - part.start)
        return measured


def _lost(scheduler: str) -> RunFailed:
    return RunFailed(
        f"the scheduler {scheduler} is gone: start it again; the same command resumes the sweep"
    )


def _ask(client: Client, time_limit: float, method: str, *arguments: Any, **options: Any) -> Any:
    """Return the result of a method of a client."""
    if client.status != "running":
        raise ConnectionError

    async def ask() -> Any:
        return await getattr(client, method)(*arguments, **options)

    return client.sync(ask, callback_timeout=time_limit)


def _check_versions(client: Client, scheduler: str) -> None:
    """Refuse workers without this version of hertzchain, if they are known before the work."""
    from hertzchain.sweeps.on_worker import check_version

    try:
        found = _ask(client, _PATIENCE, "get_versions", packages=["hertzchain"])
    except OSError:
        raise _lost(scheduler) from None
    for address, there in found["workers"].items():
        if there:  # None for a worker that is gone
            theirs = there["packages"]["hertzchain"]
            check_version(f"the worker {address}", theirs, version("hertzchain"))


@contextmanager
def _connected(scheduler: str) -> Iterator[Client]:
    """Connect to a scheduler."""
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
