"""Sweeps: the results of many scenes in a folder of tables, and access to them."""

from __future__ import annotations

import contextlib
import json
import math
import os
import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import closing, nullcontext
from dataclasses import dataclass, field, fields, replace
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypedDict, Unpack

from hertzchain.errors import OutputError, did_you_mean, require
from hertzchain.files import make_folder, write_text, write_with
from hertzchain.limits import RTOL
from hertzchain.observables.result import DEFINITIONS
from hertzchain.progress import telling
from hertzchain.scene.keys import Section
from hertzchain.scene.scene import DOUBTFUL_OVERLAP, SceneLike
from hertzchain.sweeps.columns import peak_columns
from hertzchain.sweeps.design import Value, design
from hertzchain.sweeps.loop import (
    KINDS,
    Backend,
    Part,
    cut,
    long_table,
    loop_here,
    loop_on,
    part_size,
)

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure


MANIFEST, TABLE = "sweep.json", "scenes"
_OF_RUNS = ("time_limit", "peaks_only")
"""Settings of backends that change no number of a sweep."""


def _read_part(path: Path, columns: list[str] | None = None) -> pandas.DataFrame:
    """Return columns of a part, all by default."""
    import pandas

    try:
        return pandas.read_parquet(path, columns=columns, page_checksum_verification=True)
    except Exception as problem:  # damage of a file may raise anything
        reason = str(problem).partition("\n")[0]
        raise OutputError(
            f"{path}: cannot be read ({reason}); delete it, and the same sweep measures its"
            " scenes again"
        ) from None


@contextlib.contextmanager
def claimed(path: Path, manifest: Section) -> Iterator[None]:
    """Claim a folder for a sweep and this process; another sweep's folder is refused.

    The lock ends with the process, even if it is killed. A new folder in which no part was stored
    is removed.
    """
    import filelock

    for above in path.resolve().parents[:2]:  # it would read these tables as its own
        if (above / MANIFEST).exists():
            raise OutputError(f"{path}: is inside of the sweep {above}; name another place")
    is_new = not path.exists()
    make_folder(path)
    _is_begun(path, manifest)
    lock = filelock.FileLock(path / ".lock", timeout=0)
    try:
        # File systems without locks: the user has to avoid starting a sweep twice.
        with contextlib.suppress(NotImplementedError):
            lock.acquire()
    except filelock.Timeout:
        raise OutputError(
            f"{path}: another process is at work on this sweep; wait for it, or stop it"
        ) from None
    except OSError as problem:
        raise OutputError(f"{path}: cannot be written ({problem.strerror})") from None
    try:
        if not _is_begun(path, manifest):
            write_text(path / MANIFEST, json.dumps(manifest, indent=1) + "\n")
        make_folder(path / TABLE)
        for left in path.rglob(".hertzchain-*"):  # unfinished files of a process that was killed
            shutil.rmtree(left, ignore_errors=True)
        yield
    except BaseException:
        if is_new and not any((path / TABLE).glob("*.parquet")):
            shutil.rmtree(path, ignore_errors=True)
        raise
    finally:
        lock.release()


def _is_begun(path: Path, manifest: Section) -> bool:
    """Return whether the folder has this sweep already; refuse a folder with anything else."""
    if (present := _read(path)) is None:
        if strangers := [other.name for other in path.iterdir() if other.name[0] != "."]:
            raise OutputError(f"{path}: is not a sweep, {strangers[0]} is in it; name a new folder")
        return False
    # Compared after JSON, where tuples become lists.
    wanted = json.loads(json.dumps(manifest))
    if differ := [key for key in {**wanted, **present} if wanted.get(key) != present.get(key)]:
        said = f"belongs to another sweep, with another value of {', '.join(differ)}"
        raise OutputError(f"{path}: {said} in its {MANIFEST}; name another folder")
    return True


def _read(folder: Path) -> Mapping[str, Any] | None:
    path = folder / MANIFEST
    try:
        manifest = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return None
    except (OSError, ValueError) as problem:
        raise OutputError(f"{path}: cannot be read ({problem})") from None
    keys = {"columns", "rows", "scene", "vary", "backends", "peaks"}
    if not isinstance(manifest, dict) or not keys <= manifest.keys():
        raise OutputError(f"{path}: describes no sweep; name another folder")
    return manifest


@dataclass(frozen=True, eq=False, repr=False)
class Sweep:
    """A sweep, complete or as far as it is done.

    Parameters
    ----------
    manifest
        Description of the sweep, a JSON object; ``vary`` and ``samples`` define its scenes.
    folder
        Folder of its parts; None in memory.
    """

    manifest: Mapping[str, Any]
    folder: Path | None
    _tables: dict[str, pandas.DataFrame] = field(default_factory=dict)  # in memory, by parts

    @classmethod
    def load(cls, folder: Path | str) -> Sweep:
        """Open the folder that ``sweep`` or ``hertzchain sweep`` wrote.

        Raises
        ------
        OutputError
            If there is no such sweep.
        """
        folder = Path(folder)
        manifest = _read(folder) if folder.is_dir() else None
        if manifest is None:
            raise OutputError(f"{folder}: is not a sweep, must be what hertzchain sweep -o wrote")
        return cls(manifest, folder)

    def __repr__(self) -> str:
        varies = ", ".join(axis["name"] for axis in self.manifest["vary"])
        return f"Sweep: {self.rows:,} rows over {varies}, kept in {self.folder or 'memory'}"

    @property
    def rows(self) -> int:
        """Number of scenes times number of backends."""
        return int(self.manifest["rows"])

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
        names = self.manifest["columns"]
        for name in columns or ():
            allowed = f"is not a column of this sweep, which has {', '.join(names)}"
            require(name in names, name, None, allowed + did_you_mean(str(name), names))
        return _joined(self._frames(names if columns is None else columns))

    def peaks_to_frame(self) -> pandas.DataFrame:
        """Return one row per scene, backend and contact; OutputError if peaks were not kept."""
        if not self.manifest["peaks"]:
            raise OutputError("the sweep has no peaks of all contacts: sweep again with --peaks")
        columns = peak_columns(self.manifest["columns"])
        return _joined(map(long_table, self._frames(columns)))

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

        return draw(self, x, y, colour, where, size or SIZE).figure

    def count(self) -> Counts:
        """Count the scenes that are done, failed or inaccurate; reads one part at a time."""
        names = self.manifest["columns"]
        late = [name for name in names if name == "contacts_cut_off"]
        error = "wanted_error" if "wanted_error" in names else "error_estimate"
        aims = {
            each["name"]: math.inf if each.get("dt") or each.get("method") else each["rtol"] or RTOL
            for each in self.manifest["backends"]
        }
        counts = Counts(0, 0, 0, None, error)
        for frame in self._frames(["backend", error, "overlap_ratio", "failure", *late]):
            failures = frame["failure"].dropna()
            missed = frame[error] > frame["backend"].map(aims).astype(float)
            counts = replace(
                counts,
                done=counts.done + len(frame),
                failed=counts.failed + failures.size,
                missed=counts.missed + int(missed.sum()),
                reason=counts.reason or next(iter(failures), None),
                cut_off=counts.cut_off + int(frame[late].notna().to_numpy().sum()),
                doubtful=counts.doubtful + int((frame["overlap_ratio"] > DOUBTFUL_OVERLAP).sum()),
            )
        return counts

    def _keep(self, part: Part, table: pandas.DataFrame) -> None:
        """Store a measured part."""
        if self.folder is None:
            self._tables[part.name] = table
            return

        def write(path: Path) -> None:
            table.to_parquet(path, engine="pyarrow", index=False, write_page_checksum=True)
            with path.open("rb+") as stream:  # otherwise a power failure leaves an empty file
                os.fsync(stream.fileno())

        write_with(self._path(part), write)

    def _done(self, parts: Iterable[Part], columns: Sequence[str]) -> list[Part]:
        """Return the parts that are done: their files are whole, with their scenes and columns."""
        done = []
        for part in parts:
            with contextlib.suppress(OutputError):
                if self.folder is not None and self._path(part).exists():
                    table = _read_part(self._path(part))
                    scenes = [*range(part.start, part.stop)]
                    if {*columns} <= {*table} and table["scene"].tolist() == scenes:
                        done.append(part)
        return done

    def _frames(self, columns: Sequence[str]) -> Iterator[pandas.DataFrame]:
        """Yield columns of the table part by part."""
        for _, table in sorted(self._tables.items()):
            yield table[list(columns)]
        for path in sorted((self.folder / TABLE).glob("*.parquet")) if self.folder else ():
            yield _read_part(path, list(columns))

    def _path(self, part: Part) -> Path:
        assert self.folder is not None
        return self.folder / TABLE / f"{part.name}.parquet"


@dataclass(frozen=True)
class Counts:
    """Numbers of rows of a sweep that exist, failed or are inaccurate.

    Parameters
    ----------
    done, failed
        Rows that exist, and those of them without numbers.
    missed
        Rows with a larger error than wanted, that of first pulses where ``rtol`` of ``run`` holds
        for these.
    reason
        Reason of the first failure; None where no scene failed.
    error
        Column with the error that counts.
    cut_off
        Rows whose run may have ended before all contacts had their peak.
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


class Sampling(TypedDict, total=False):
    """Keywords of points that are drawn; see ``hertzchain.sweeps.design``."""

    samples: int | None
    seed: int


def sweep(
    scene: SceneLike,
    vary: Annotated[Mapping[str, str | Iterable[Value]] | pandas.DataFrame, design],
    *,
    backends: Annotated[str | Iterable[str | Backend], _backends] = ("native",),
    rtol: float = RTOL,
    peaks: bool = False,
    output: Path | str | None = None,
    scheduler: str | None = None,
    progress: Callable[[int, int], object] | bool | None = None,
    **drawn: Unpack[Sampling],
) -> Sweep:
    """Measure scenes that differ in some parameters.

    Parameters
    ----------
    scene
        The scene that all others are derived from, or the path of its file.
    vary
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
        True to show how many rows are done in the terminal, or a function that is called after each
        part with the number of rows done and of all rows.
    drawn
        ``samples`` and ``seed`` of points drawn from ranges, as for ``design``.

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
    layout = design(scene, vary, **drawn)
    chosen = _backends(backends, rtol)
    manifest: dict[str, Any] = {
        "hertzchain": version("hertzchain"),
        "definitions": DEFINITIONS,
        "format": "parquet",
        "columns": [column.name for column in layout.columns],
        **layout.to_dict(),
        "backends": [settings(backend) for backend in chosen],
        "peaks": peaks,
        "parts": {backend.name: part_size(layout, backend) for backend in chosen},
        "rows": layout.scenes * len(chosen),
    }
    swept = Sweep(manifest, None if output is None else Path(output))
    claim = nullcontext() if swept.folder is None else claimed(swept.folder, manifest)
    engine = nullcontext(loop_here) if scheduler is None else loop_on(scheduler)
    with telling(progress is True) as tell, engine as measured, claim:

        def report(rows: int) -> None:
            tell(f"sweep: {rows:,} of {manifest['rows']:,} rows")
            if callable(progress):
                progress(rows, manifest["rows"])

        columns = peak_columns(manifest["columns"]) if peaks else ()
        done_parts = swept._done(cut(layout, chosen), (*manifest["columns"], *columns))
        there = {part.name: part.size for part in done_parts}
        report(done := sum(there.values()))
        left = (part for part in cut(layout, chosen) if part.name not in there)
        with closing(measured(layout, left, peaks)) as tables:
            for part, table in tables:
                swept._keep(part, table)
                report(done := done + part.size)
    return swept


def settings(backend: Backend) -> dict[str, Any]:
    """Return the settings of a backend that change numbers, as a JSON object."""
    names = [entry.name for entry in fields(backend)]
    kept = {name: getattr(backend, name) for name in names if name not in _OF_RUNS}
    lmp = {"lmp": str(kept["lmp"])} if kept.get("lmp") is not None else {}
    return {"name": backend.name, **kept, **lmp}


def _backends(given: str | Iterable[str | Backend], rtol: float) -> tuple[Backend, ...]:
    is_list = isinstance(given, Iterable) and not isinstance(given, str)
    is_list = is_list and getattr(given, "shape", None) != ()  # an array without axes is no list
    each: list[Any] = list(given) if is_list else [given]
    for k, backend in enumerate(each):
        if isinstance(backend, str):
            require(backend in KINDS, "backends", backend, f"must be one of {', '.join(KINDS)}")
            each[k] = KINDS[backend](rtol=rtol)
        allowed = "must be Native, Lammps or the name of a backend"
        require(isinstance(each[k], Backend), "backends", backend, allowed)
    names = [backend.name for backend in each]
    allowed = "must be at least one backend, and none twice"
    require(0 < len(names) == len(set(names)), "backends", names, allowed)
    return tuple(each)


def _joined(frames: Iterable[pandas.DataFrame]) -> pandas.DataFrame:
    import pandas

    whole = list(frames)
    if not whole:
        raise OutputError("the sweep has no rows yet: run the same sweep to measure its scenes")
    for frame in whole:
        frame.attrs = {}
    return pandas.concat(whole, ignore_index=True)
