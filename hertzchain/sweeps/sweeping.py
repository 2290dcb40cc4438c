"""A sweep: scenes that differ in some parameters, measured by one backend or several."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import closing, nullcontext
from dataclasses import dataclass, fields
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from hertzchain.errors import OutputError, did_you_mean, require
from hertzchain.limits import RTOL
from hertzchain.observables.result import DEFINITIONS
from hertzchain.scene.scene import DOUBTFUL_OVERLAP, SceneLike
from hertzchain.showing import telling
from hertzchain.sweeps.columns import columns_in, peak_columns
from hertzchain.sweeps.design import Value, design
from hertzchain.sweeps.folder import Folder, Memory, claimed, read_manifest
from hertzchain.sweeps.loop import (
    KINDS,
    NAMES,
    Backend,
    cut,
    long_table,
    loop_here,
    loop_on,
    part_size,
)

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
    _parts: Memory | Folder

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
        return cls(manifest, manifest["rows"], Folder(folder))

    def __repr__(self) -> str:
        varies = ", ".join(axis["name"] for axis in self.manifest["vary"])
        return f"Sweep: {self.rows:,} rows over {varies}, kept in {self.folder or 'memory'}"

    @property
    def folder(self) -> Path | None:
        """Folder of the sweep; None in memory."""
        return self._parts.path if isinstance(self._parts, Folder) else None

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
        names = [column.name for column in columns_in(self.manifest)]
        for name in columns or ():
            allowed = f"is no column of this sweep, which has {', '.join(names)}"
            require(name in names, name, None, allowed + did_you_mean(str(name), names))
        return _joined(self._parts.frames(names if columns is None else columns))

    def peaks_to_frame(self) -> pandas.DataFrame:
        """Return one row per scene, backend and contact; OutputError if peaks were not kept."""
        if not self.manifest["peaks"]:
            raise OutputError("the sweep has no peaks of all contacts: sweep again with --peaks")
        columns = peak_columns(columns_in(self.manifest))
        return _joined(map(long_table, self._parts.frames(columns)))

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
        names = [column.name for column in columns_in(self.manifest)]
        late = [name for name in names if name == "contacts_cut_off"]
        error = "wanted_error" if "wanted_error" in names else "error_estimate"
        aims = {each["name"]: _aim(each) for each in self.manifest["backends"]}
        done, reason, sums = 0, None, np.zeros(4, np.int64)
        for frame in self._parts.frames(["backend", error, "overlap_ratio", "failure", *late]):
            failures = frame["failure"].dropna()
            done, reason = done + len(frame), reason or next(iter(failures), None)
            missed = frame[error] > frame["backend"].map(aims).astype(float)
            doubtful = frame["overlap_ratio"] > DOUBTFUL_OVERLAP
            rows = failures.size, missed.sum(), frame[late].notna().to_numpy().sum(), doubtful.sum()
            sums += np.array(rows, np.int64)
        failed, inaccurate, cut_off, above = sums.tolist()
        return Counts(done, failed, inaccurate, reason, error, cut_off, above)


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
    vary: Annotated[Mapping[str, str | Iterable[Value]] | pandas.DataFrame, design],
    *,
    samples: Annotated[int | None, design] = None,
    seed: Annotated[int, design] = 0,
    backends: Annotated[str | Iterable[str | Backend], _backends] = ("native",),
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
    vary, samples, seed
        Parameters that vary and their values, or a table with a row for each scene; see
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
    layout = design(scene, vary, samples, seed)
    chosen = _backends(backends, rtol)
    manifest: dict[str, Any] = {
        "hertzchain": version("hertzchain"),
        "definitions": DEFINITIONS,
        "format": "parquet",
        **({} if layout.are_plain else {"columns": [column.name for column in layout.columns]}),
        **layout.to_dict(),
        "backends": [settings(backend) for backend in chosen],
        "peaks": peaks,
        "parts": {NAMES[type(backend)]: part_size(layout, backend) for backend in chosen},
        "rows": layout.scenes * len(chosen),
    }
    folder = None if output is None else Path(output)
    store = Memory() if folder is None else Folder(folder)
    claim = nullcontext() if folder is None else claimed(folder, manifest)
    engine = nullcontext(loop_here) if scheduler is None else loop_on(scheduler)
    lock, done = threading.Lock(), 0
    with telling(progress is True) as tell, engine as measured, claim:

        def add(rows: int) -> None:
            nonlocal done
            with lock:
                done += rows
                if callable(progress):
                    progress(done, manifest["rows"])
                else:
                    tell(f"sweep: {done:,} of {manifest['rows']:,} rows")

        there = {part.name: part.size for part in cut(layout, chosen) if store.has(part)}
        add(sum(there.values()))
        left = (part for part in cut(layout, chosen) if part.name not in there)
        with closing(measured(layout, left, peaks, add)) as tables:
            for part, table in tables:
                store.keep(part, table)
    return Sweep(manifest, manifest["rows"], store)


def settings(backend: Backend) -> dict[str, Any]:
    """Return the settings of a backend that change numbers, as a JSON object."""
    of_runs = {"time_limit", "isolated", "peaks_only"}
    names = [field.name for field in fields(backend) if field.name not in of_runs]
    kept = {name: getattr(backend, name) for name in names}
    lmp = {"lmp": str(kept["lmp"])} if kept.get("lmp") is not None else {}
    return {"name": NAMES[type(backend)], **kept, **lmp}


def _aim(settings: Mapping[str, Any]) -> float:
    """Return the accuracy wanted of a backend; infinite where steps were given."""
    if settings.get("dt") is not None or settings.get("method") is not None:
        return math.inf
    return float(settings.get("rtol") or RTOL)


def _backends(given: str | Iterable[str | Backend], rtol: float) -> tuple[Backend, ...]:
    is_alone = isinstance(given, str) or not isinstance(given, Iterable)
    each: Iterable[Any] = [given] if is_alone or getattr(given, "shape", 1) == () else given
    backends: list[Backend] = []
    for backend in each:
        if isinstance(backend, str):
            require(backend in KINDS, "backends", backend, f"must be one of {', '.join(KINDS)}")
            backends.append(KINDS[backend](rtol=rtol))
        else:
            allowed = "must be Native, Lammps or the name of a backend"
            require(isinstance(backend, Backend), "backends", backend, allowed)
            backends.append(backend)
    names = [NAMES[type(backend)] for backend in backends]
    require(len(names) > 0, "backends", None, "must be at least one")
    require(len(set(names)) == len(names), "backends", names, "must not be given twice")
    return tuple(backends)


def _joined(frames: Iterable[pandas.DataFrame]) -> pandas.DataFrame:
    import pandas

    whole = list(frames)
    if not whole:
        raise OutputError("the sweep has no such rows: not measured yet, or not asked for")
    for frame in whole:
        frame.attrs = {}
    return pandas.concat(whole, ignore_index=True)
