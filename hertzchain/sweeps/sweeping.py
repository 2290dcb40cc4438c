"""A sweep: scenes that differ in some parameters, measured by one backend or several."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from hertzchain.errors import OutputError, did_you_mean, require
from hertzchain.limits import RTOL
from hertzchain.observables.definitions import DEFINITIONS
from hertzchain.scene.given import SceneLike
from hertzchain.scene.validity import DOUBTFUL_OVERLAP
from hertzchain.showing import telling
from hertzchain.sweeps import parts
from hertzchain.sweeps.axes import Value
from hertzchain.sweeps.cluster import cluster
from hertzchain.sweeps.columns import columns_in
from hertzchain.sweeps.design import design
from hertzchain.sweeps.running import measure_here
from hertzchain.sweeps.store import Folder, Memory, check_parquet, read_manifest

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False, repr=False)
class Sweep:
    """A sweep, complete or as far as it is done.

    Parameters
    ----------
    manifest
        Description of the sweep, a JSON object; ``vary`` and ``samples`` define its scenes.
    rows
        Number of scenes times number of backends.
    """

    manifest: Mapping[str, Any]
    rows: int
    _store: Memory | Folder

    @classmethod
    def load(cls, folder: Path | str) -> Sweep:
        """Open the folder that ``sweep`` or ``hertzchain sweep`` wrote.

        Raises
        ------
        OutputError
            If there is no such sweep.
        """
        folder = Path(folder)
        manifest = read_manifest(folder)
        return cls(manifest, manifest["rows"], Folder(folder, manifest))

    def __repr__(self) -> str:
        varies = ", ".join(axis["name"] for axis in self.manifest["vary"])
        return f"Sweep: {self.rows:,} rows over {varies}, kept in {self.folder or 'memory'}"

    @property
    def folder(self) -> Path | None:
        """Folder of the sweep; None in memory."""
        return self._store.folder

    def to_frame(self, columns: Sequence[str] | None = None) -> pandas.DataFrame:
        """Return one row per scene and backend: scene, backend, parameters in SI, and results.

        Parameters
        ----------
        columns
            Wanted columns; all by default.

        Raises
        ------
        SceneError
            For a column that the sweep does not have.
        """
        known = [column.name for column in columns_in(self.manifest)]
        for name in columns or ():
            allowed = f"is no column of this sweep, which has {', '.join(known)}"
            require(name in known, name, None, allowed + did_you_mean(str(name), known))
        return _joined(self._store.frames("scenes", columns))

    def peaks_to_frame(self) -> pandas.DataFrame:
        """Return one row per scene, backend and contact; OutputError if peaks were not kept."""
        return _joined(self._store.frames("peaks"))

    def plot(
        self,
        x: str,
        y: str,
        colour: str | None = None,
        where: Mapping[str, Any] | None = None,
        size: tuple[float, float] | None = None,
    ) -> Figure:
        """Draw a column over another, or a map; see ``hertzchain.sweeps.drawing.draw``."""
        from hertzchain.sweeps.drawing import SIZE, draw

        return draw(self, x, y, colour, where, SIZE if size is None else size).figure

    def count(self) -> Counts:
        """Count the scenes that are done, failed or inaccurate; reads one part at a time."""
        done = failed = missed = cut_off = doubtful = 0
        known = [column.name for column in columns_in(self.manifest)]
        late = [name for name in known if name == "contacts_cut_off"]
        error = "wanted_error" if "wanted_error" in known else "error_estimate"
        reason = None
        aims = {each["name"]: _aim(each) for each in self.manifest["backends"]}
        read = ["backend", error, "overlap_ratio", "failure", *late]
        for frame in self._store.frames("scenes", read):
            failures = frame["failure"].dropna()
            done, failed = done + len(frame), failed + len(failures)
            if reason is None and len(failures):
                reason = str(failures.iloc[0])
            aim = frame["backend"].map(aims).astype(float)
            missed += int((frame[error] > aim).sum())
            cut_off += int(frame[late].notna().to_numpy().sum())
            doubtful += int((frame["overlap_ratio"] > DOUBTFUL_OVERLAP).sum())
        return Counts(done, failed, missed, reason, error, cut_off, doubtful)


@dataclass(frozen=True)
class Counts:
    """Numbers of scenes of a sweep that are done, failed or inaccurate.

    Parameters
    ----------
    done
        Rows that exist.
    failed
        Rows without numbers.
    missed
        Rows with a larger error than wanted, that of first pulses where ``rtol`` of ``run`` holds
        for these.
    reason
        Reason of the first failure; None where no scene failed.
    error
        Column with the error that counts.
    cut_off
        Rows of scenes with terms whose run may have ended before all contacts had their peak.
    doubtful
        Rows whose largest overlap is above the valid range of Hertz's law, 0.01 radii.
    """

    done: int
    failed: int
    missed: int
    reason: str | None
    error: str
    cut_off: int = 0
    doubtful: int = 0


def sweep(
    scene: SceneLike,
    vary: Annotated[Mapping[str, str | Iterable[Value]], design],
    *,
    samples: Annotated[int | None, design] = None,
    seed: Annotated[int, design] = 0,
    ties: Mapping[str, str] | None = None,
    backends: Annotated[str | Iterable[str | parts.Backend], _backends] = ("native",),
    rtol: float = RTOL,
    peaks: bool = False,
    output: Path | str | None = None,
    scheduler: str | None = None,
    progress: Callable[[int, int], object] | bool | None = None,
) -> Sweep:
    """Measure scenes that differ in some parameters.

    Parameters
    ----------
    scene
        The scene that all others are derived from, or the path of its file.
    vary, samples, seed, ties
        Parameters that vary and their values, and those that follow from them; see
        ``hertzchain.sweeps.design``.
    backends
        Backends that measure each scene: ``native``, ``lammps``, or a ``Native`` or ``Lammps`` with
        its parameters.
    rtol
        Wanted relative accuracy of the peaks, for backends given by name.
    peaks
        Whether the peaks of all contacts are kept, not only the largest.
    output
        Folder for the parts; it is created. An existing folder of the same sweep is resumed: only
        missing parts are measured. By default the sweep is kept in memory.
    scheduler
        Address of a Dask scheduler whose workers measure; by default this machine measures, on all
        cores.
    progress
        True to show how many rows are done in the terminal, or a function that is
        called from time to time, from any thread, with the number of rows done and of all rows.

    Returns
    -------
    Sweep
        With ``to_frame()``.

    Raises
    ------
    SceneError
        For parameters that cannot have these values. A scene that is impossible only by a
        combination of values gets a row with the reason.
    OutputError
        If the folder is of another sweep, or cannot be written.
    BackendMissing
        If a backend is not installed.
    RunFailed
        If the scheduler cannot be reached, or its workers are lost.
    """
    found = design(scene, vary, samples, seed, ties)
    chosen = _backends(backends, rtol)
    if output is not None:
        check_parquet()
    manifest = {
        "hertzchain": version("hertzchain"),
        "definitions": DEFINITIONS,
        "format": "parquet",
        **({} if found.are_plain else {"columns": [column.name for column in found.columns]}),
        **found.to_dict(),
        "backends": [parts.settings(backend) for backend in chosen],
        "peaks": peaks,
        "parts": {
            parts.NAMES[type(backend)]: parts.part_size(found, backend) for backend in chosen
        },
        "rows": found.scenes * len(chosen),
    }
    store = Memory() if output is None else Folder(Path(output), manifest)
    engine = nullcontext(measure_here) if scheduler is None else cluster(scheduler)
    with telling(progress is True) as tell, engine as measure, store:

        def in_words(done: int, total: int) -> object:
            return tell(f"sweep: {done:,} of {total:,} rows")

        counted = progress if callable(progress) else in_words
        counter = _Counter(found.scenes * len(chosen), counted)
        there = {part.name: part for part in parts.cut(found, chosen) if store.has(part)}
        counter.add(sum(part.stop - part.start for part in there.values()))
        todo = (part for part in parts.cut(found, chosen) if part.name not in there)
        measure(found, todo, peaks, store.keep, counter.add)
    return Sweep(manifest, counter.total, store)


def _aim(settings: Mapping[str, Any]) -> float:
    """Return the accuracy wanted of a backend; infinite where steps were given."""
    if settings.get("dt") is not None or settings.get("method") is not None:
        return math.inf
    return float(settings.get("rtol") or RTOL)


class _Counter:
    """Counts rows of all threads, and reports the sum."""

    def __init__(self, total: int, progress: Callable[[int, int], object]) -> None:
        self.total, self._done, self._progress = total, 0, progress
        self._lock = threading.Lock()

    def add(self, rows: int) -> None:
        """Add a number of further rows done."""
        with self._lock:
            self._done += rows
            self._progress(self._done, self.total)


def _backends(given: str | Iterable[str | parts.Backend], rtol: float) -> tuple[parts.Backend, ...]:
    found: list[parts.Backend] = []
    each: Iterable[Any] = given
    if (
        isinstance(given, str)
        or not isinstance(given, Iterable)
        or getattr(given, "shape", 1) == ()
    ):
        each = (given,)
    for one in each:
        if isinstance(one, str):
            require(one in parts.KINDS, "backends", one, f"must be one of {', '.join(parts.KINDS)}")
            found.append(parts.KINDS[one](rtol=rtol))
        else:
            allowed = "must be Native, Lammps or the name of a backend"
            require(isinstance(one, parts.Backend), "backends", one, allowed)
            found.append(one)
    names = [parts.NAMES[type(backend)] for backend in found]
    require(len(names) > 0, "backends", None, "must be at least one")
    require(len(set(names)) == len(names), "backends", names, "must not be given twice")
    return tuple(found)


def _joined(frames: Iterable[pandas.DataFrame]) -> pandas.DataFrame:
    import pandas

    whole = list(frames)
    if not whole:
        raise OutputError("the sweep has no such rows: not measured yet, or not asked for")
    for frame in whole:
        frame.attrs = {}
    return pandas.concat(whole, ignore_index=True)
