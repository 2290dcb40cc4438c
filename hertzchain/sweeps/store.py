"""Where a sweep is kept: in memory, or in a folder of parts that are there whole or not at all.

A folder has sweep.json, files scenes/native-0000.parquet, ... and, where peaks are wanted, files
peaks/native-0000.parquet, ..., which are written before: a part is done when its scenes are there.
"""

from __future__ import annotations

import contextlib
import importlib.util
import json
import os
import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Self

from hertzchain.errors import OutputError, require
from hertzchain.files import write_text, write_with
from hertzchain.sweeps.columns import COUNTS, PEAK_COLUMNS, columns_of
from hertzchain.sweeps.measuring import Measured
from hertzchain.sweeps.parts import Part

if TYPE_CHECKING:
    import pandas

Format = Literal["parquet", "csv"]

TABLES = ("scenes", "peaks")  # names of folders

MANIFEST = "sweep.json"


class Memory(AbstractContextManager["Memory"]):
    """A sweep that is kept in memory."""

    folder = None

    def __init__(self) -> None:
        self._parts: dict[str, Measured] = {}

    def __exit__(self, *_: object) -> None:
        pass

    def has(self, part: Part) -> bool:
        """Whether a part is done."""
        return part.name in self._parts

    def keep(self, part: Part, measured: Measured) -> None:
        """Keep what a part has become."""
        self._parts[part.name] = measured

    def finish(self) -> None:
        """Nothing is left to do."""

    def frames(
        self, table: str, columns: Sequence[str] | None = None
    ) -> Iterator[pandas.DataFrame]:
        """A table, part by part."""
        for _, measured in sorted(self._parts.items()):
            frame = measured.table if table == "scenes" else measured.peaks
            if frame is not None:
                yield frame if columns is None else frame[list(columns)]


class Folder(AbstractContextManager["Folder"]):
    """A sweep kept in a folder; as a context, for one process alone. The manifest describes it."""

    def __init__(self, folder: Path, manifest: Mapping[str, Any]) -> None:
        self.folder, self._manifest = folder, manifest
        self._format: Format = manifest["format"]
        self._lock: Any = None
        self._made = False

    def __enter__(self) -> Self:
        _refuse_inside(self.folder)
        self._made = not self.folder.exists()
        _make(self.folder)
        self._check()
        self._lock = _locked(self.folder)
        try:
            self._claim()
        except BaseException:
            self._lock.release()
            raise
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is not None and self._made and not self._paths("scenes"):
            shutil.rmtree(self.folder, ignore_errors=True)  # it was made for nothing
        self._lock.release()

    def _check(self) -> bool:
        """Whether the folder is that of this sweep already; refuse any that is not free."""
        there = _read_manifest(self.folder)
        if there is None:
            strangers = [path.name for path in self.folder.iterdir() if path.name[0] != "."]
            if strangers:
                raise OutputError(
                    f"{self.folder}: is no sweep, {strangers[0]} is in it; name a new folder"
                )
            return False
        # Compared as JSON has it: what was a tuple comes back as a list.
        wanted = json.loads(json.dumps(self._manifest))
        if wanted != there:
            raise OutputError(
                f"{self.folder}: belongs to another sweep, {_difference(there, wanted)}; name"
                " another folder"
            )
        return True

    def _claim(self) -> None:
        """Make the folder that of this sweep, unless it is."""
        if not self._check():
            write_text(self.folder / MANIFEST, json.dumps(self._manifest, indent=1) + "\n")
        for name in TABLES[: 1 + self._manifest["peaks"]]:
            _make(self.folder / name)
        # What a process was writing when it was killed.
        for left in [*self.folder.glob(".hertzchain-*"), *self.folder.glob("*/.hertzchain-*")]:
            shutil.rmtree(left, ignore_errors=True)

    def has(self, part: Part) -> bool:
        """Whether a part is done."""
        return self._path("scenes", part).exists()

    def keep(self, part: Part, measured: Measured) -> None:
        """Keep what a part has become."""
        if measured.peaks is not None:
            self._write("peaks", part, measured.peaks)
        self._write("scenes", part, measured.table)

    def finish(self) -> None:
        """Put parts in CSV together, as few programs read many files as one table."""
        if self._format != "csv":
            return
        for table in TABLES:
            if paths := self._paths(table):
                write_with(self.folder / f"{table}.csv", partial(_join, paths))

    def frames(
        self, table: str, columns: Sequence[str] | None = None
    ) -> Iterator[pandas.DataFrame]:
        """A table, part by part."""
        import pandas

        for path in self._paths(table):
            wanted = None if columns is None else list(columns)
            try:
                if self._format == "parquet":
                    yield pandas.read_parquet(path, engine="pyarrow", columns=wanted)
                else:
                    yield _read_csv(path, wanted or self._header(table))
            except (OSError, ValueError, KeyError) as problem:
                reason = str(problem).partition("\n")[0]
                raise OutputError(
                    f"{path}: cannot be read ({reason}); delete it, and the same sweep measures its"
                    " scenes anew"
                ) from None

    def _header(self, table: str) -> list[str]:
        """The columns of a table."""
        if table == "peaks":
            return list(PEAK_COLUMNS)
        varied = [axis["name"] for axis in self._manifest["vary"]]
        return [column.name for column in columns_of(self._manifest["scene"], varied)]

    def _paths(self, table: str) -> list[Path]:
        return sorted((self.folder / table).glob(f"*.{self._format}"))

    def _path(self, table: str, part: Part) -> Path:
        return self.folder / table / f"{part.name}.{self._format}"

    def _write(self, table: str, part: Part, frame: pandas.DataFrame) -> None:
        def write(path: Path) -> None:
            if self._format == "parquet":
                frame.to_parquet(path, engine="pyarrow", index=False)
            else:
                frame.to_csv(path, index=False)
            with path.open("rb+") as stream:  # or a machine that dies leaves an empty file
                os.fsync(stream.fileno())

        write_with(self._path(table, part), write)


def check_format(name: Format) -> None:
    """Raise an error, before any work is done, for a format that cannot be written."""
    require(name in ("parquet", "csv"), "file_format", name, "must be parquet or csv")
    if name == "parquet" and importlib.util.find_spec("pyarrow") is None:
        raise OutputError(
            "sweeps are kept as Parquet, which needs pyarrow: pip install 'hertzchain[parquet]', or"
            " ask for the format csv"
        )


def read_manifest(folder: Path) -> Mapping[str, Any]:
    """What sweep a folder has."""
    there = _read_manifest(folder) if folder.is_dir() else None
    if there is None:
        raise OutputError(f"{folder}: is no sweep, must be what hertzchain sweep -o wrote")
    return there


def _read_manifest(folder: Path) -> Mapping[str, Any] | None:
    path = folder / MANIFEST
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return None
    except (OSError, ValueError) as problem:
        raise OutputError(f"{path}: cannot be read ({problem})") from None
    keys = {"layout", "format", "rows", "scene", "vary", "backends", "peaks"}
    if not isinstance(found, dict) or not keys <= found.keys():
        raise OutputError(f"{path}: describes no sweep; name another folder")
    return found


def _refuse_inside(folder: Path) -> None:
    """Refuse a folder among the tables of another sweep, which would be read as one of them."""
    for above in folder.resolve().parents[:2]:
        if (above / MANIFEST).exists():
            raise OutputError(f"{folder}: is inside of the sweep {above}; name another place")


def _make(folder: Path) -> None:
    if folder.exists() and not folder.is_dir():
        raise OutputError(f"{folder}: is a file, must be a folder")
    try:
        folder.mkdir(exist_ok=True)
    except FileNotFoundError:
        raise OutputError(f"{folder}: {folder.parent} does not exist, create it first") from None
    except (OSError, ValueError) as problem:
        reason = getattr(problem, "strerror", None) or problem
        raise OutputError(f"{folder}: cannot be made ({reason})") from None


def _locked(folder: Path) -> Any:
    """A lock that no other process holds; it goes with the process, whatever becomes of that."""
    import filelock

    lock = filelock.FileLock(folder / ".lock", timeout=0)
    try:
        # File systems without locks: it is for who starts a sweep to start it once.
        with contextlib.suppress(NotImplementedError):
            lock.acquire()
    except filelock.Timeout:
        raise OutputError(
            f"{folder}: another process is at work on this sweep; wait for it, or stop it"
        ) from None
    except OSError as problem:
        raise OutputError(f"{folder}: cannot be written ({problem.strerror})") from None
    return lock


def _difference(there: Mapping[str, Any], wanted: Mapping[str, Any]) -> str:
    """In what one sweep is not the other."""
    for key in {**there, **wanted}:
        if there.get(key) != wanted.get(key):
            before, now = (json.dumps(one.get(key)) for one in (there, wanted))
            if len(before) + len(now) < 100:
                return f"{key} is {before} there and {now} here"
            return f"its {key} is {before:.300}" + "..." * (len(before) > 300)
    return "it is not the same"


def _join(paths: Sequence[Path], whole: Path) -> None:
    """Write CSV files of one header one behind the other."""
    with whole.open("wb") as out:
        for number, path in enumerate(paths):
            with path.open("rb") as part:
                header = part.readline()
                if number == 0:
                    out.write(header)
                shutil.copyfileobj(part, out)


def _read_csv(path: Path, columns: Sequence[str]) -> pandas.DataFrame:
    """A part as it was written, to the last digit."""
    import pandas

    types = {**dict.fromkeys(COUNTS, "Int64"), "failure": "string"}
    # From pandas 3 on every number is read to the last digit, and must not be asked to be.
    exact: Any = {} if pandas.__version__[:2] == "3." else {"float_precision": "round_trip"}
    whole: pandas.DataFrame = pandas.read_csv(path, dtype=types, **exact)
    return whole[list(columns)]
