"""Reading of files within a limit of size; writing of whole files or none."""

from __future__ import annotations

import errno
import os
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory

from hertzchain.errors import OutputError


def read_bytes(path: Path, most: int) -> bytes:
    """Return the content of a file or pipe; OSError for more than ``most`` bytes."""
    with path.open("rb") as stream:
        content = stream.read(most + 1)
    if len(content) > most:
        raise OSError(errno.EFBIG, f"larger than {most / 1e6:g} MB")
    return content


def text_in(content: bytes) -> str | None:
    """The text in the bytes of a file, in any usual encoding; None if they are not text.

    Archives, such as spreadsheets, are none.
    """
    try:
        if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
            return content.decode("utf-16")
        is_binary = content.startswith(b"PK\x03\x04") or b"\0" in content
        return None if is_binary else content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("latin-1")


def read_rows(path: Path, most: int) -> tuple[list[str], list[list[str]]]:
    """Return the header of a CSV file and its other rows that are not empty.

    A ValueError says in a few words why the file, of at most ``most`` bytes, cannot be read.
    """
    import csv
    import io

    try:
        text = read_bytes(path, most).decode("utf-8-sig")
        rows = [row for row in csv.reader(io.StringIO(text, newline="")) if row]
    except (OSError, ValueError, csv.Error) as problem:  # ValueError: not text, or no file name
        raise ValueError(getattr(problem, "strerror", None) or "not a text file") from None
    return [cell.strip() for cell in rows[0]] if rows else [], rows[1:]


def write_text(path: Path | str, text: str) -> None:
    """Write a text file completely or not at all."""
    write_texts({Path(path): text})


def write_texts(texts: Mapping[Path, str]) -> None:
    """Write text files that belong together: none, if one fails; each is complete."""

    def writer(text: str) -> Callable[[Path], object]:
        return lambda part: part.write_text(text, encoding="utf-8", newline="\n")

    _write({path: writer(text) for path, text in texts.items()})


def write_with(path: Path | str, write: Callable[[Path], object]) -> None:
    """Let a function write a file next to its place, then move it there.

    The function gets a path of the same suffix. Nothing is left behind where it fails.
    """
    _write({Path(path): write})


def _write(writers: Mapping[Path, Callable[[Path], object]]) -> None:
    """Write files next to their places, then move all of them there."""
    for path in writers:
        check_writable(path)
    moves: list[tuple[Path, Path]] = []
    path = Path()
    try:
        with ExitStack() as folders:
            for path, write in writers.items():
                target = part = path
                if not path.exists() or path.is_file():  # a pipe or a device stays what it is
                    target = path.resolve()  # target of a link
                    target.parent.mkdir(parents=True, exist_ok=True)
                    folder = TemporaryDirectory(
                        prefix=".hertzchain-", dir=target.parent, ignore_cleanup_errors=True
                    )
                    part = Path(folders.enter_context(folder)) / path.name
                    moves.append((part, target))
                write(part)
            for part, path in moves:
                part.replace(path)
    except (OSError, UnicodeError) as problem:  # UnicodeError: text that UTF-8 cannot encode
        raise _unwritable(path, problem) from None


def check_writable(path: Path | str) -> None:
    """Raise an OutputError, before any work is done, if a file or its folder cannot be written."""
    path = Path(path)
    try:
        path.stat()
    except FileNotFoundError:
        pass
    except (OSError, ValueError) as problem:  # a name too long, or with a null in it
        raise _unwritable(path, problem) from None
    if path.is_dir():
        raise OutputError(f"{path}: is a directory, must be the name of a file")
    folder = path.resolve().parent if path.is_symlink() else path.parent
    try:
        while not folder.exists():  # it is made when the file is written
            folder = folder.parent
    except OSError as problem:  # a name too long
        raise _unwritable(path, problem) from None
    if not folder.is_dir():
        raise OutputError(f"{path}: {folder} is not a folder")
    target = path if path.exists() and not path.is_file() else folder
    if not os.access(target, os.W_OK) or (path.is_file() and not os.access(path, os.W_OK)):
        raise OutputError(f"{path}: no permission to write here, choose another place")


def check_outputs(inputs: Sequence[Path | None], outputs: Sequence[Path | None]) -> None:
    """Raise an OutputError, before any work is done, for outputs that cannot be written safely.

    An output may not be an input too, nor be given for two outputs; None stands for no file.
    """
    # A link that leads to itself is refused where it is read.
    read = {Path(os.path.realpath(path)) for path in inputs if path is not None}
    taken: set[Path] = set()
    for path in outputs:
        if path is None:
            continue
        check_writable(path)
        if not path.exists() or path.is_file():  # a device is not replaced
            where = path.resolve()
            if where in read:
                raise OutputError(f"{path}: is an input, and must not be overwritten; name another")
            if where in taken:
                raise OutputError(f"{path}: is given for two outputs, name one file for each")
            taken.add(where)


def make_folder(folder: Path) -> None:
    """Make a folder if it is missing; OutputError if that is impossible."""
    if folder.exists() and not folder.is_dir():
        raise OutputError(f"{folder}: is a file, must be a folder")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError) as problem:
        reason = getattr(problem, "strerror", None) or problem
        raise OutputError(f"{folder}: cannot be made ({reason})") from None


def _unwritable(path: Path, problem: OSError | ValueError) -> OutputError:
    reason = getattr(problem, "strerror", None) or problem
    return OutputError(f"{path}: cannot be written ({reason})")
