"""The folder of a sweep: a manifest, and Parquet parts that are complete or absent.

A folder has sweep.json and files scenes/native-0000.parquet, .... A part is done when sha256sums
has the checksum of its file; parts that are damaged are measured again.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import shutil
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hertzchain.errors import OutputError
from hertzchain.files import make_folder, write_text, write_with
from hertzchain.sweeps.loop import Part

if TYPE_CHECKING:
    import pandas

MANIFEST, CHECKSUMS, TABLE = "sweep.json", "sha256sums", "scenes"

_LONGEST_VALUE = 60  # characters of a value in a message on another sweep, chosen


class Memory(dict[str, "pandas.DataFrame"]):
    """Parts in memory, by name."""

    def keep(self, part: Part, table: pandas.DataFrame) -> None:
        """Store a measured part."""
        self[part.name] = table

    def has(self, part: Part) -> bool:
        """Return whether a part is done."""
        return part.name in self

    def frames(self, columns: Sequence[str] | None = None) -> Iterator[pandas.DataFrame]:
        """Yield the table part by part."""
        for _, table in sorted(self.items()):
            yield table if columns is None else table[list(columns)]


class Folder:
    """Parts in a folder."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def keep(self, part: Part, table: pandas.DataFrame) -> None:
        """Store a measured part."""

        def write(path: Path) -> None:
            table.to_parquet(path, engine="pyarrow", index=False)
            with path.open("rb+") as stream:  # otherwise a power failure leaves an empty file
                os.fsync(stream.fileno())

        path = self._path(part)
        write_with(path, write)
        name = path.relative_to(self.path).as_posix()
        try:
            with (self.path / CHECKSUMS).open("a", encoding="utf-8", newline="\n") as stream:
                stream.write(f"{_checksum(path)}  {name}\n")
        except OSError as problem:
            reason = f"{self.path / CHECKSUMS}: cannot be written ({problem.strerror})"
            raise OutputError(reason) from None

    def has(self, part: Part) -> bool:
        """Return whether a part is done: its file has the checksum that it was given."""
        path = self._path(part)
        checksum = self._checksums.get(path.relative_to(self.path).as_posix(), "")
        return _checksum(path) == checksum

    @cached_property
    def _checksums(self) -> dict[str, str]:
        """Checksums of files by their names in the folder."""
        with contextlib.suppress(OSError):  # where it cannot be written, either, keep reports that
            lines = (self.path / CHECKSUMS).read_text("utf-8", "replace").splitlines()
            words = (line.partition("  ") for line in lines)
            return {name: checksum for checksum, _, name in words}
        return {}

    def frames(self, columns: Sequence[str] | None = None) -> Iterator[pandas.DataFrame]:
        """Yield the table part by part."""
        import pandas

        for path in sorted((self.path / TABLE).glob("*.parquet")):
            wanted = None if columns is None else list(columns)
            try:
                yield pandas.read_parquet(path, engine="pyarrow", columns=wanted)
            except (OSError, ValueError, KeyError) as problem:
                reason = str(problem).partition("\n")[0]
                raise OutputError(
                    f"{path}: cannot be read ({reason}); delete it, and the same sweep measures its"
                    " scenes again"
                ) from None

    def _path(self, part: Part) -> Path:
        return self.path / TABLE / f"{part.name}.parquet"


@contextlib.contextmanager
def claimed(path: Path, manifest: Mapping[str, Any]) -> Iterator[None]:
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
    _check(path, manifest)
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
        if not _check(path, manifest):
            write_text(path / MANIFEST, json.dumps(manifest, indent=1) + "\n")
        make_folder(path / TABLE)
        # Unfinished files of a process that was killed.
        for left in [*path.glob(".hertzchain-*"), *path.glob("*/.hertzchain-*")]:
            shutil.rmtree(left, ignore_errors=True)
        yield
    except BaseException:
        if is_new and not any((path / TABLE).glob("*.parquet")):
            shutil.rmtree(path, ignore_errors=True)
        raise
    finally:
        lock.release()


def _check(path: Path, manifest: Mapping[str, Any]) -> bool:
    """Return whether the folder has this sweep already; refuse a folder with anything else."""
    if (there := _read(path)) is None:
        if strangers := [other.name for other in path.iterdir() if other.name[0] != "."]:
            raise OutputError(f"{path}: is no sweep, {strangers[0]} is in it; name a new folder")
        return False
    # Compared after JSON, where tuples become lists.
    old, new = _entries(there), _entries(json.loads(json.dumps(manifest)))
    if old != new:
        name = next(name for name in {**new, **old} if old.get(name) != new.get(name))
        raise OutputError(
            f"{path}: belongs to another sweep, {name} is {_in_words(old.get(name))} there and"
            f" {_in_words(new.get(name))} here; name another folder"
        )
    return True


def read_manifest(path: Path) -> Mapping[str, Any]:
    """Read the manifest of the sweep in a folder."""
    there = _read(path) if path.is_dir() else None
    if there is None:
        raise OutputError(f"{path}: is no sweep, must be what hertzchain sweep -o wrote")
    return there


def _checksum(path: Path) -> str | None:
    """Return the checksum of a file; None if it cannot be read."""
    try:
        with path.open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError:
        return None


def _read(folder: Path) -> Mapping[str, Any] | None:
    path = folder / MANIFEST
    try:
        manifest = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return None
    except (OSError, ValueError) as problem:
        raise OutputError(f"{path}: cannot be read ({problem})") from None
    keys = {"format", "rows", "scene", "vary", "backends", "peaks"}
    if not isinstance(manifest, dict) or not keys <= manifest.keys():
        raise OutputError(f"{path}: describes no sweep; name another folder")
    return manifest


def _entries(value: Any, name: str = "") -> dict[str, Any]:
    """Return the values in a part of a manifest, by names with points; items count from 1."""
    if not isinstance(value, dict | list):
        # Folders of before keep a version of SciPy, on which drawn points do not depend.
        return {} if name == "samples.scipy" else {name: value}
    items = value.items() if isinstance(value, dict) else enumerate(value, start=1)
    below = (_entries(entry, f"{name}.{key}".lstrip(".")) for key, entry in items)
    return {key: entry for entries in below for key, entry in entries.items()}


def _in_words(value: Any) -> str:
    return "not given" if value is None else textwrap.shorten(json.dumps(value), _LONGEST_VALUE)
