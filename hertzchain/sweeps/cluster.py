"""Parts of a sweep on the workers of a Dask scheduler, which is there already.

Workers measure and write nothing: what they find comes back and is kept here, so that a worker may
be lost at any time; its parts are measured by another.
"""

from __future__ import annotations

import logging
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from functools import partial
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

from hertzchain.errors import BackendMissing, HertzchainError, RunFailed
from hertzchain.sweeps.design import Design
from hertzchain.sweeps.here import Keep, Measure, Tell
from hertzchain.sweeps.measuring import Measured, measure
from hertzchain.sweeps.parts import Part

if TYPE_CHECKING:
    from distributed import Client, Future

_PATIENCE = "10s"
"""With a scheduler that does not answer."""

_AHEAD = 3
"""Parts that are handed out for each thread of the workers: none of them waits, and memory does not
grow with the sweep."""


@contextmanager
def cluster(scheduler: str) -> Iterator[Measure]:
    """What measures parts of a sweep as ``measure_here`` does, on the workers of a scheduler.

    Parameters
    ----------
    scheduler
        Its address (``tcp://host:8786``).

    Raises
    ------
    BackendMissing
        If distributed is not installed.
    RunFailed
        If the scheduler cannot be reached.
    """
    with _client(scheduler) as client:
        yield partial(_measure_there, client, scheduler)


def _measure_there(
    client: Client,
    scheduler: str,
    design: Design,
    parts: Iterable[Part],
    peaks: bool,
    keep: Keep,
    tell: Tell,
) -> None:
    """Measure parts of a sweep on a cluster.

    Parameters
    ----------
    client, scheduler
        A connection to the scheduler, and its address.
    design, parts, peaks, keep, tell
        As for ``measure_here``.

    Raises
    ------
    BackendMissing
        If a backend is not there on a worker.
    RunFailed
        If the scheduler is lost, or hertzchain on a worker is not this one.
    """
    from distributed import as_completed

    waiting = iter(parts)
    at_work: dict[Future[Measured], Part] = {}
    done = as_completed(with_results=False)
    for future in _hand_out(client, waiting, design, peaks, at_work):
        done.add(future)
    for future in done:
        part = at_work.pop(future)
        measured = _result(future, scheduler)
        future.release()
        keep(part, measured)
        tell(part.stop - part.start)
        for another in _hand_out(client, waiting, design, peaks, at_work):
            done.add(another)


def _hand_out(
    client: Client,
    waiting: Iterator[Part],
    design: Design,
    peaks: bool,
    at_work: dict[Future[Measured], Part],
) -> Iterator[Future[Measured]]:
    """Hand out parts until there are enough for all workers that are there by now."""
    threads = sum(client.nthreads().values())
    while len(at_work) < _AHEAD * max(threads, 1):
        part = next(waiting, None)
        if part is None:
            return
        future = client.submit(measure, design, part, peaks, 1, pure=False)
        at_work[future] = part
        yield future


def _result(future: Future[Measured], scheduler: str) -> Measured:
    from distributed import KilledWorker
    from distributed.client import FutureCancelledError

    try:
        measured: Measured = future.result()
    except HertzchainError:
        raise
    except KilledWorker:
        raise RunFailed(
            "a part of the sweep was lost with worker after worker: look into their logs, they may"
            " be short of memory; the same command goes on with what is left"
        ) from None
    except ModuleNotFoundError as problem:
        raise BackendMissing(
            f"the workers of {scheduler} have no {problem.name}: install hertzchain there, too"
        ) from None
    except (FutureCancelledError, OSError) as problem:
        raise RunFailed(
            f"the scheduler {scheduler} is gone ({problem}): start it again; the same command goes"
            " on with what is left"
        ) from None
    theirs = measured.table.attrs["hertzchain"]["versions"]["hertzchain"]
    if theirs != (ours := version("hertzchain")):
        raise RunFailed(
            f"a worker of {scheduler} has hertzchain {theirs}, here it is {ours}: install the same"
        )
    return measured


@contextmanager
def _client(scheduler: str) -> Iterator[Any]:
    """A connection to a scheduler."""
    try:
        from distributed import Client
    except ModuleNotFoundError:
        raise BackendMissing(
            "sweeps on a cluster need distributed: pip install 'hertzchain[cluster]'"
        ) from None
    log = logging.getLogger("distributed")
    before = log.level
    log.setLevel(logging.CRITICAL)  # what goes wrong is said in one sentence
    try:
        try:
            client = Client(scheduler, timeout=_PATIENCE, set_as_default=False)
        except (OSError, ValueError, TypeError, ImportError) as problem:
            reason = str(problem).partition("\n")[0]
            raise RunFailed(
                f"the scheduler {scheduler} cannot be reached ({reason}): is it running, and is"
                " this its address, such as tcp://host:8786?"
            ) from None
        try:
            yield client
        finally:
            client.close(timeout=2)
    finally:
        log.setLevel(before)
