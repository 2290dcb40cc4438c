"""Stores of a sweep: memory, or a folder of parts, each complete or absent.

A folder has sweep.json, files scenes/native-0000.parquet, ... and, where peaks are wanted, files
peaks/native-0000.parquet, .... A part is done when sha256sums has the checksums of its files; parts
whose files differ from them are measured again.
"""

from __future__ import annotations

import contextlib
import hashlib
import importlib.util
import json
import os
import shutil
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from hertzchain.errors import OutputError
from hertzchain.files import make_folder, write_text, write_with
from hertzchain.sweeps.measuring import Measured
from hertzchain.sweeps.parts import Part

if TYPE_CHECKING:
    import pandas

TABLES = ("scenes", "peaks")  # names of subfolders

MANIFEST, CHECKSUMS = "sweep.json", "sha256sums"

_LONGEST_VALUE = 60  # characters of a value in a message on another sweep, chosen


class Memory(AbstractContextManager["Memory"]):
    """A sweep that is kept in memory."""

    folder = None

    def __init__(self) -> None:
        self._parts: dict[str, Measured] = {}

    def __exit__(self, *_: object) -> None:
        pass

    def has(self, part: Part) -> bool:
        """Return whether a part is done."""
        return part.name in self._parts

    def keep(self, part: Part, measured: Measured) -> None:
        """Store a measured part."""
        self._parts[part.name] = measured

    def frames(
        self, table: str, columns: Sequence[str] | None = None
    ) -> Iterator[pandas.DataFrame]:
        """Yield a table part by part."""
        for _, measured in sorted(self._parts.items()):
            frame = measured.table if table == "scenes" else measured.peaks
            if frame is not None:
                yield frame if columns is None else frame[list(columns)]


class Folder(AbstractContextManager["Folder"]):
    """A sweep kept in a folder with its manifest; as a context it is locked for one process."""

    def __init__(self, folder: Path, manifest: Mapping[str, Any]) -> None:
        self.folder, self._manifest = folder, manifest
        self._lock: Any = None
        self._made = False
        self._tables = TABLES[: 1 + manifest["peaks"]]
        self._checksums: dict[Path, str] = {}

    def __enter__(self) -> Self:
        _refuse_inside(self.folder)
        self._made = not self.folder.exists()
        make_folder(self.folder)
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
            shutil.rmtree(self.folder, ignore_errors=True)  # remove the empty folder
        self._lock.release()

    def _check(self) -> bool:
        """Return whether the folder has this sweep already; refuse a folder with anything else."""
        there = _read_manifest(self.folder)
        if there is None:
            strangers = [path.name for path in self.folder.iterdir() if path.name[0] != "."]
            if strangers:
                raise OutputError(
                    f"{self.folder}: is no sweep, {strangers[0]} is in it; name a new folder"
                )
            return False
        # Compared after JSON, where tuples become lists.
        wanted = json.loads(json.dumps(self._manifest))
        if wanted != there:
            raise OutputError(
                f"{self.folder}: belongs to another sweep, {_difference(there, wanted)}; name"
                " another folder"
            )
        return True

    def _claim(self) -> None:
        """Write the manifest of this sweep into the folder, unless it is there."""
        if not self._check():
            write_text(self.folder / MANIFEST, json.dumps(self._manifest, indent=1) + "\n")
        for name in self._tables:
            make_folder(self.folder / name)
        # Unfinished files of a process that was killed.
        for left in [*self.folder.glob(".hertzchain-*"), *self.folder.glob("*/.hertzchain-*")]:
            shutil.rmtree(left, ignore_errors=True)
        with contextlib.suppress(OSError):  # where it cannot be written, either, keep reports that
            lines = (self.folder / CHECKSUMS).read_text("utf-8", "replace").splitlines()
            words = (line.partition("  ") for line in lines)
            self._checksums = {self.folder / name: checksum for checksum, _, name in words}

    def has(self, part: Part) -> bool:
        """Return whether a part is done."""
        paths = [self._path(table, part) for table in self._tables]
        return all(_checksum(path) == self._checksums.get(path, "") for path in paths)

    def keep(self, part: Part, measured: Measured) -> None:
        """Store a measured part."""
        if measured.peaks is not None:
            self._write("peaks", part, measured.peaks)
        self._write("scenes", part, measured.table)

    def frames(
        self, table: str, columns: Sequence[str] | None = None
    ) -> Iterator[pandas.DataFrame]:
        """Yield a table part by part."""
        import pandas

        for path in self._paths(table):
            wanted = None if columns is None else list(columns)
            try:
                yield pandas.read_parquet(path, engine="pyarrow", columns=wanted)
            except (OSError, ValueError, KeyError) as problem:
                reason = str(problem).partition("\n")[0]
                raise OutputError(
                    f"{path}: cannot be read ({reason}); delete it, and the same sweep measures its"
                    " scenes again"
                ) from None

    def _paths(self, table: str) -> list[Path]:
        return sorted((self.folder / table).glob("*.parquet"))

    def _path(self, table: str, part: Part) -> Path:
        return self.folder / table / f"{part.name}.parquet"

    def _write(self, table: str, part: Part, frame: pandas.DataFrame) -> None:
        def write(path: Path) -> None:
            frame.to_parquet(path, engine="pyarrow", index=False)
            with path.open("rb+") as stream:  # otherwise a power failure leaves an empty file
                os.fsync(stream.fileno())

        path = self._path(table, part)
        write_with(path, write)
        name = path.relative_to(self.folder).as_posix()
        try:
            with (self.folder / CHECKSUMS).open("a", encoding="utf-8", newline="\n") as stream:
                stream.write(f"{_checksum(path)}  {name}\n")
        except OSError as problem:
            reason = f"{self.folder / CHECKSUMS}: cannot be written ({problem.strerror})"
            raise OutputError(reason) from None


def check_parquet() -> None:
    """Raise an error, before any work is done, where Parquet cannot be written."""
    if importlib.util.find_spec("pyarrow") is None:
        raise OutputError(
            "sweeps are kept as Parquet, which needs pyarrow: pip install 'hertzchain[parquet]'"
        )


def read_manifest(folder: Path) -> Mapping[str, Any]:
    """Read the manifest of the sweep in a folder."""
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
    keys = {"format", "rows", "scene", "vary", "backends", "peaks"}
    if not isinstance(found, dict) or not keys <= found.keys():
        raise OutputError(f"{path}: describes no sweep; name another folder")
    return found


def _checksum(path: Path) -> str | None:
    """Return the checksum of a file; None if it cannot be read."""
    try:
        with path.open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError:
        return None


def _refuse_inside(folder: Path) -> None:
    """Refuse a folder inside another sweep, which would read its tables as its own."""
    for above in folder.resolve().parents[:2]:
        if (above / MANIFEST).exists():
            raise OutputError(f"{folder}: is inside of the sweep {above}; name another place")


def _locked(folder: Path) -> Any:
    """Lock a folder for this process; the lock ends with the process, even if it is killed."""
    import filelock

    lock = filelock.FileLock(folder / ".lock", timeout=0)
    try:
        # File systems without locks: the user has to avoid starting a sweep twice.
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
    """Return a sentence on the first entry in which two sweeps differ."""
    old, new = _entries(there), _entries(wanted)
    name = next(name for name in {**new, **old} if old.get(name) != new.get(name))
    return f"{name} is {_in_words(old.get(name))} there and {_in_words(new.get(name))} here"


def _entries(value: Any, name: str = "") -> dict[str, Any]:
    """Return the values in a part of a manifest, by names with points; items count from 1."""
    if not isinstance(value, dict | list):
        return {name: value}
    items = value.items() if isinstance(value, dict) else enumerate(value, start=1)
    below = (_entries(one, f"{name}.{key}".lstrip(".")) for key, one in items)
    return {key: one for entries in below for key, one in entries.items()}


def _in_words(value: Any) -> str:
    return "not given" if value is None else textwrap.shorten(json.dumps(value), _LONGEST_VALUE)
