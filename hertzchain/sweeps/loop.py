"""One loop over the scenes of a sweep, part by part, and the table that it fills."""

from __future__ import annotations

import asyncio
import functools
import itertools
import logging
import math
import pickle
import queue
import threading
import time
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass, replace
from importlib.metadata import version
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.backend import Lammps
from hertzchain.engines.lammps.engine import Child
from hertzchain.engines.native.backend import Native
from hertzchain.engines.native.backend import versions as native_versions
from hertzchain.errors import BackendMissing, HertzchainError, RunFailed, TooExpensive
from hertzchain.limits import RTOL, Deadline, usable_cores
from hertzchain.observables.peaks import times_of_peaks
from hertzchain.observables.wave import solitary_waves, transitions
from hertzchain.scene import hertz
from hertzchain.scene.chain import MOMENTUM_IN_NATURAL_UNITS, granule_mass, length_and_time
from hertzchain.scene.scene import IMPOSSIBLE_OVERLAP
from hertzchain.scene.schedule import watched_time
from hertzchain.sweeps.columns import FIRST, Column, is_result, numbers_of, peak_columns
from hertzchain.sweeps.design import Design

if TYPE_CHECKING:
    import pandas

    from hertzchain.engines.native.batch import Batch
    from hertzchain.observables.result import Result
    from hertzchain.scene.scene import Scene


_SAFE_RANGE = 1e200  # numbers between it and its inverse are far from the limits of floating point


class Natural(NamedTuple):
    """Similarity of scenes; arrays of shape (scenes,), NaN for pulse tables."""

    length: FloatArray  # natural unit [m]
    time: FloatArray  # natural unit [s]
    momentum_ratio: FloatArray  # LM_ratio, given or from t0
    rise_time: FloatArray  # t0 [s]
    duration: FloatArray  # until every contact has peaked [natural units]
    is_moderate: NDArray[np.bool_]  # derived numbers are far from the limits of floats


def natural(given: Mapping[str, NDArray[Any]]) -> Natural:
    """Return the natural units of scenes from the parameters that ``Design.parameters`` returns."""
    radius, force = given["chain.radius"], given["shock.peak_force"]
    ratio, rise = given["shock.momentum_ratio"], given["shock.rise_time"]
    n = given["shock.duration_ratio"]
    with np.errstate(all="ignore"):
        stiffness = hertz.stiffness_of_equals(
            radius, given["chain.young_modulus"], given["chain.poisson_ratio"]
        )
        mass = granule_mass(radius, given["chain.density"])
        length, time = length_and_time(stiffness, mass, force)
        unit = 2 * MOMENTUM_IN_NATURAL_UNITS * time / n  # the rise time at LM_ratio 1
        by_ratio = np.isnan(rise)
        ratio, rise = np.where(by_ratio, ratio, rise / unit), np.where(by_ratio, ratio * unit, rise)
        duration = n * rise / time + watched_time(given["chain.granules"], ratio)
        derived = (radius**3, stiffness, mass, force, length, time, time**2, mass * length, ratio)
        is_moderate = np.isfinite(duration)
        for values in (*derived, rise, length / time, force * time, force * length):
            is_moderate &= (values > 1 / _SAFE_RANGE) & (values < _SAFE_RANGE)
    return Natural(length, time, ratio, rise, duration, is_moderate)


def batch_columns(batch: Batch, radius: FloatArray, *units: FloatArray) -> dict[str, Any]:
    """Return columns of results of a batch of similar scenes, and lists of peaks, by name.

    ``units`` are the natural units of force, length and time in SI, shape (scenes,).
    """
    force, length, time = units
    peak_force, passed = batch.peak_force * force[:, None], batch.peak_passed
    peak_time = times_of_peaks(peak_force, batch.peak_time * time[:, None])
    p = transitions(batch.peak_force, passed)
    slowness = time * np.power(force, 1 / 6)
    near, far, speed, far_off, speed_off = solitary_waves(
        peak_force, peak_time, passed, p, 2 * radius, slowness
    )
    at = np.argmax(peak_force, axis=1)
    largest = peak_force[np.arange(at.size), at]
    return {
        "transition_granules": p,
        "solitary_wave_force_N": near,
        "far_field_force_N": far,
        "far_field_error": far_off,
        "speed_m_s": speed,
        "speed_error": speed_off,
        "largest_peak_force_N": largest,
        "largest_peak_contact": at + 2,
        "overlap_ratio": np.power(largest / force, 2 / 3) * length / radius,
        "error_estimate": batch.error_estimate,
        "force_evaluations": batch.force_evaluations,
        "contact": [*np.tile(2 + np.arange(passed.shape[1]), (at.size, 1))],
        "peak_force_N": [*peak_force],
        "peak_time_s": [*peak_time],
    }


def _lists_of(result: Result) -> dict[str, Any]:
    """Return the columns of peaks of a result: lists of all contacts, by name."""
    never = np.full(result.contact.size, np.nan)
    lists = {**dict.fromkeys(FIRST, never), **result.first_columns}
    lists |= {"peak_force_N": result.peak_force, "peak_time_s": result.peak_time}
    lost = result.is_cut_off
    cut = {name: np.where(lost, np.nan, values) for name, values in lists.items()}
    return {"contact": result.contact, **cut}


def long_table(frame: pandas.DataFrame) -> pandas.DataFrame:
    """Return one row per contact of rows whose cells have lists of all contacts."""
    frame = frame[frame["contact"].notna()]
    kinds = {name: np.int64 if name == "contact" else float for name in frame.columns[2:]}
    return frame.explode([*kinds], ignore_index=True).astype(kinds)


Backend = Native | Lammps

KINDS: dict[str, type[Backend]] = {"native": Native, "lammps": Lammps}
"""Names of the backends in the table."""

MOST_ROWS, MOST_PEAKS = 10_000, 500_000  # scenes and contacts of a part, chosen: about 30 MB
_SERIAL_WORK, _SMALL_CHAIN_GRANULES = 2_000_000, 40
"""Scenes times granules squared, at least those of a small chain, below which no process is started
(measured): two take 2 s to start, as long as 1,200 elastic scenes of 31 granules or 550 of 60.
"""
_SINGLE_SCENE_WORK = 1e8  # natural time units times granules (1 s): longer scenes run by themselves
_YEAR = 3e7  # no time limit [s]

_MOMENT = 0.05  # time between two checks of processes that are to end [s]
_PATIENCE = 10.0  # waiting time for a scheduler that does not answer [s]

_log = logging.getLogger(__name__)

Tables = Generator[tuple["Part", "pandas.DataFrame"], None, None]
Loop = Callable[[Design, Iterable["Part"], bool], Tables]


@dataclass(frozen=True)
class Part:
    """Scenes from ``start`` to before ``stop``, measured by one backend and stored together."""

    name: str
    backend: Backend
    start: int
    stop: int

    @property
    def size(self) -> int:
        """Number of scenes."""
        return self.stop - self.start


def cut(design: Design, backends: Sequence[Backend]) -> Iterator[Part]:
    """Yield the parts of a sweep, one backend after another; the cut is always the same."""
    for backend in backends:
        size = part_size(design, backend)
        starts = range(0, design.scenes, size)
        digits = max(4, len(str(len(starts) - 1)))
        for number, start in enumerate(starts):
            name = f"{backend.name}-{number:0{digits}d}"
            yield Part(name, backend, start, min(start + size, design.scenes))


def part_size(design: Design, backend: Backend) -> int:
    """Return the number of scenes in a part."""
    size = min(MOST_ROWS, MOST_PEAKS // _largest(design))
    if not _is_batched(design, backend):
        # A kill loses a part: 50 scenes. At least 16 parts keep all cores busy.
        size = min(size, 50, math.ceil(design.scenes / 16))
    return max(size, 1)


def _largest(design: Design) -> int:
    """Return the granules of the longest chain of some scenes."""
    return int(np.max(design.some_parameters["chain.granules"]))


def _is_batched(design: Design, backend: Backend) -> bool:
    """Return whether the compiled batch takes these scenes: single pulses, default end time."""
    if not isinstance(backend, Native) or backend.method is not None or backend.dt is not None:
        return False
    fits = design.are_plain and design.base.pulse is not None
    return fits and "run.end_time" not in design.names and design.base.run.end_time is None


def _is_short(design: Design, backend: Backend) -> bool:
    """Return whether scenes are few and quick: elastic, by accuracy, native, and chains short."""
    if isinstance(backend, Lammps) or backend.dt is not None or backend.method is not None:
        return False
    if design.base.contact is not None:
        return False
    return design.scenes * max(_largest(design), _SMALL_CHAIN_GRANULES) ** 2 < _SERIAL_WORK


# One part


def measure(
    design: Design,
    part: Part,
    peaks: bool,
    cores: int | None = None,
    child: Child | None = None,
    is_over: Callable[[], bool] = lambda: False,
) -> pandas.DataFrame:
    """Measure the scenes of a part; a scene that fails has a row with the reason.

    The numbers are the same on every machine and in every call. The compiled batch uses all
    ``cores`` by default, LAMMPS runs in ``child`` or a process for this part, and no further scene
    is run once work ``is_over``.
    """
    begin = time.perf_counter()
    numbers = np.arange(part.start, part.stop)
    given = design.parameters(numbers)
    others = {"scene": numbers, "backend": np.full(numbers.size, part.backend.name), **given}
    cells: dict[int, dict[str, Any]] = {}
    if design.are_plain:
        similar = natural(given)
        others["shock.momentum_ratio"] = similar.momentum_ratio
        others["shock.rise_time"] = similar.rise_time
        if _is_batched(design, part.backend):
            assert isinstance(part.backend, Native)
            cells = _batched(given, similar, part.backend, cores or usable_cores())
    versions: Mapping[str, str] = native_versions() if cells else {}
    scenes: dict[int, Scene] = {}
    for row in (row for row in range(numbers.size) if row not in cells):
        try:
            scenes[row] = scene = design.scene(given, row)
        except HertzchainError as problem:
            cells[row] = {"failure": str(problem)}
            continue
        if scene.shock.section == "shock" and not (design.are_plain and scene.pulse):
            others["shock.momentum_ratio"][row] = scene.momentum_ratio
            if scene.rise_time is not None:
                others["shock.rise_time"][row] = scene.rise_time
    results = _results(list(scenes.values()), part.backend, child, cores)
    for row, result in zip(scenes, results, strict=True):
        if isinstance(result, BackendMissing):
            raise result
        if is_over():
            raise CancelledError
        if isinstance(result, MemoryError):
            cells[row] = {"failure": "there is not enough memory for this scene"}
        elif isinstance(result, HertzchainError):
            cells[row] = {"failure": str(result)}
        else:
            cells[row], versions = numbers_of(result), result.versions
            cells[row] |= _lists_of(result) if peaks else {}
    table = _typed(cells, design.columns, numbers.size, peaks).assign(**others)
    table = table[[*dict.fromkeys([*(column.name for column in design.columns), *table])]]
    table.attrs["hertzchain"] = {
        "wall_time_s": time.perf_counter() - begin,
        "versions": {"hertzchain": version("hertzchain"), **versions},
    }
    return table


def _typed(
    cells: dict[int, dict[str, Any]], columns: Sequence[Column], rows: int, peaks: bool
) -> pandas.DataFrame:
    """Return the columns of results, and those of peaks if wanted, with a type each."""
    import pandas

    kinds = {column.name: column.kind for column in columns if is_result(column.name)}
    of_peaks = peak_columns([column.name for column in columns])[2:] if peaks else ()
    names = *kinds, "failure", *of_peaks
    table = pandas.DataFrame.from_dict(cells, "index").reindex(range(rows)).reindex(columns=names)
    table = table.astype(object).where(table.notna(), None)
    for name, kind in kinds.items():
        table[name] = table[name].astype(float)
        if kind == "int":
            table[name] = table[name].where(table[name] != 0).astype("Int64")
    return table.assign(failure=table["failure"].astype("string"))


def _batched(
    given: Mapping[str, NDArray[Any]], similar: Natural, native: Native, cores: int
) -> dict[int, dict[str, Any]]:
    """Measure scenes in the compiled batch, those of each length together; cells by rows.

    Scenes whose peaks are uncertain, whose overlap is impossible, or that take long are left out.
    """
    import pandas

    from hertzchain.engines.native.batch import on_cores, plain_peaks

    rtol = RTOL if native.rtol is None else native.rtol
    granules = given["chain.granules"]
    fits = similar.is_moderate & (similar.duration * granules < _SINGLE_SCENE_WORK)
    alike = [np.flatnonzero(fits & (granules == count)) for count in np.unique(granules[fits])]
    # Many small batches keep all cores busy side by side, a few large ones each by itself.
    at_once = cores if len(alike) >= 2 * cores else 1

    def batch(some: NDArray[np.intp]) -> dict[int, dict[str, Any]]:
        names = "shock.profile", "shock.duration_ratio"
        profiles, n = (given[name][some] for name in names)
        ratio, limit = similar.momentum_ratio[some], min(native.time_limit * some.size, _YEAR)
        how = int(granules[some[0]]), rtol, limit, cores // at_once
        try:
            batched = plain_peaks(profiles, ratio, n, *how)
        except TooExpensive:  # measured one by one, the failing scene gets the reason
            return {}
        similarity = given["chain.radius"], given["shock.peak_force"], *similar[:2]
        columns = batch_columns(batched, *(values[some] for values in similarity))
        table = pandas.DataFrame(columns, index=some)
        is_sure = (table["error_estimate"] < 1) & (table["overlap_ratio"] <= IMPOSSIBLE_OVERLAP)
        rows: Any = table[is_sure].to_dict("index")
        return rows  # type: ignore[no-any-return]

    batches = map(batch, alike) if at_once == 1 else on_cores(batch, alike, at_once)
    return {row: cells for rows in batches for row, cells in rows.items()}


def _results(
    scenes: Sequence[Scene], backend: Backend, child: Child | None, cores: int | None
) -> Iterator[Result | HertzchainError | MemoryError]:
    """Yield the result of each scene, or why there is none; LAMMPS runs in a child process."""
    if isinstance(backend, Native):
        from hertzchain.engines.native.batch import results_of

        yield from results_of(scenes, replace(backend, peaks_only=True), Deadline(_YEAR), cores)
        return
    from hertzchain.engines.lammps.backend import run_in

    is_process = backend.lmp is not None  # a binary is a separate process anyway
    with Child() if child is None else nullcontext(child) as process:  # starts when it is called
        for scene in scenes:
            try:
                yield backend.run(scene) if is_process else run_in(process, backend, scene)
            except (HertzchainError, MemoryError) as problem:
                yield problem


# All parts


def _in_turn(
    submit: Callable[[Part], Future[Any]], room: Callable[[], int], parts: Iterable[Part]
) -> Iterator[tuple[Part, Future[Any]]]:
    """Submit parts, as many at once as there is room for, and yield those that are done."""
    waiting, at_work = iter(parts), dict[Future[Any], Part]()
    while True:
        for part in itertools.islice(waiting, max(0, room() - len(at_work))):
            future = submit(part)
            at_work[future] = part
            if future.done():  # stored before another is measured
                break
        if not at_work:
            return
        for future in wait(at_work, timeout=1.0, return_when=FIRST_COMPLETED).done:
            yield at_work.pop(future), future


def loop_here(design: Design, parts: Iterable[Part], peaks: bool) -> Tables:
    """Measure parts in one thread for each core, each with a process that may crash.

    Batches use all cores by themselves, and short work starts no process.
    """
    cores, stopped = usable_cores(), threading.Event()
    children = [Child() for _ in range(cores)]
    idle: queue.SimpleQueue[Child] = queue.SimpleQueue()
    for child in children:
        idle.put(child)

    def in_process(part: Part) -> pandas.DataFrame:
        child = idle.get()
        try:
            if isinstance(part.backend, Lammps):
                return measure(design, part, peaks, child=child, is_over=stopped.is_set)
            given, who = (design, part, peaks, 1), part.backend.name
            return child.call(measure, *given, time_limit=_YEAR, who=who)  # type: ignore[no-any-return]
        finally:
            idle.put(child)

    @functools.cache
    def is_simple(backend: Backend) -> bool:
        return _is_batched(design, backend) or _is_short(design, backend)

    def submit(part: Part) -> Future[pandas.DataFrame]:
        if not is_simple(part.backend):
            return pool.submit(in_process, part)
        future = Future[Any]()
        future.set_result(measure(design, part, peaks))
        return future

    with ThreadPoolExecutor(cores) as pool:
        try:
            for part, future in _in_turn(submit, lambda: cores, parts):
                yield part, future.result()
        finally:
            stopped.set()
            pool.shutdown(wait=False, cancel_futures=True)
            while idle.qsize() < cores:  # a thread may be about to start its process again
                for child in children:
                    child.end()
                time.sleep(_MOMENT)
            for child in children:
                child.end()


@contextmanager
def loop_on(scheduler: str) -> Iterator[Loop]:
    """Yield ``loop_here`` for the workers of a Dask scheduler at ``tcp://host:8786``."""
    try:
        from distributed import Client
    except ModuleNotFoundError:
        raise BackendMissing(
            "sweeps on a cluster need distributed: pip install 'hertzchain[cluster]'"
        ) from None
    with _quiet():
        try:
            with ThreadPoolExecutor(1) as pool:  # a notebook has an event loop of its own
                pool.submit(asyncio.run, _check_scheduler(scheduler)).result()
            client = Client(scheduler, timeout=_PATIENCE, set_as_default=False)
        except (OSError, ValueError, TypeError, ImportError) as problem:
            reason = str(problem).partition("\n")[0] or "it does not answer"
            raise RunFailed(
                f"the scheduler {scheduler!r} cannot be reached ({reason}): is it running, and is"
                " this its address, such as tcp://host:8786?"
            ) from None
        try:
            yield functools.partial(_loop_of, client, scheduler)
        finally:  # parts that are not done are dropped
            with suppress(OSError):
                client.close(timeout=_PATIENCE)


def _loop_of(
    client: Any, scheduler: str, design: Design, parts: Iterable[Part], peaks: bool
) -> Tables:
    """Measure parts on the workers of a client of Dask."""
    from distributed import KilledWorker

    executor, threads = client.get_executor(pure=False), -1
    lost = RunFailed(
        f"the scheduler {scheduler} is gone: start it again; the same command resumes the sweep"
    )

    def submit(part: Part) -> Future[Any]:
        task = pickle.dumps(Task((version("hertzchain"), design, part, peaks)))
        return executor.submit(pickle.loads, task)  # type: ignore[no-any-return]

    def room() -> int:
        nonlocal threads
        if client.status != "running":
            raise lost
        before = threads
        with suppress(OSError):  # a scheduler that answers slowly, or is lost
            there = client.sync(client.nthreads, callback_timeout=_PATIENCE)
            threads = sum(there.values())
        if threads == 0 != before:
            _log.warning("hertzchain: %s has no workers: the sweep waits for some", scheduler)
        return 3 * max(threads, 1)  # parts: no thread waits, and memory does not grow

    for part, future in _in_turn(submit, room, parts):
        try:
            table: pandas.DataFrame = future.result()
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
            raise lost from None
        yield part, table


async def _check_scheduler(address: str) -> None:
    """Check that a scheduler answers: with any other program a client would wait without end."""
    from distributed import Security
    from distributed.comm.core import connect

    options = Security().get_connection_args("client")
    there = await asyncio.wait_for(connect(address, timeout=_PATIENCE, **options), _PATIENCE + 1)
    there.abort()


class Task(NamedTuple):
    """The arguments of ``work``, which pickle.loads calls: a scheduler needs no hertzchain."""

    arguments: tuple[str, Design, Part, bool]

    def __reduce__(self) -> tuple[Any, ...]:
        """Return the call that pickle.loads makes."""
        return work, self.arguments


def work(wanted: str, design: Design, part: Part, peaks: bool) -> pandas.DataFrame:
    """Measure a part in a thread of a worker, which must have the wanted version."""
    from distributed import get_worker

    who, installed = f"the worker {get_worker().address}", version("hertzchain")
    if installed != wanted:
        raise RunFailed(
            f"{who} has hertzchain {installed}, this is {wanted}: install the same on both"
        )
    try:
        return measure(design, part, peaks, cores=1)
    except BackendMissing as problem:
        raise BackendMissing(f"on {who}: {problem}") from None


@contextmanager
def _quiet() -> Iterator[None]:
    """Silence Dask's loggers; errors are reported in one sentence."""
    # Dask gives some of its loggers their own level and handler.
    names = [name for name in logging.root.manager.loggerDict if name.startswith("distributed")]
    levels = {logging.getLogger(name): logging.getLogger(name).level for name in names}
    for logger in levels:
        logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for logger, level in levels.items():
            logger.setLevel(level)
