"""Files are read within bounds, and appear whole or not at all."""

from __future__ import annotations

import errno
import os
import select
import stat
import tempfile
from collections.abc import Callable
from pathlib import Path

from hertzchain.errors import OutputError

_PATIENCE = 5.0
"""Seconds to wait for somebody to write to a pipe or to type."""


def read_bytes(path: Path, most: int) -> bytes:
    """The whole of a file, which may be a pipe, but neither endless nor silent for ever.

    Parameters
    ----------
    path
        The file.
    most
        Bytes that it may have.

    Raises
    ------
    OSError
        If it cannot be read, is larger, or a pipe that nobody writes to.
    ValueError
        If the name is none.
    """
    content = b""
    with open(path, "rb", buffering=0, opener=_open_at_once) as stream:
        comes_later = not stat.S_ISREG(os.fstat(stream.fileno()).st_mode) and os.name == "posix"
        while len(content) <= most:
            if comes_later and not select.select([stream], [], [], _PATIENCE)[0]:
                raise OSError(errno.ETIMEDOUT, f"nothing came out of it for {_PATIENCE:g} s")
            piece = stream.read(most + 1 - len(content))
            if not piece:
                return content
            content += piece
    raise OSError(errno.EFBIG, f"larger than {most / 1e6:g} MB")


def _open_at_once(name: str, flags: int) -> int:
    """Open a file; one that is a pipe without waiting for who writes to it."""
    return os.open(name, flags | getattr(os, "O_NONBLOCK", 0))


def write_text(path: Path | str, text: str) -> None:
    """Write a text file, whole or not at all.

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    write_with(path, lambda part: part.write_text(text, encoding="utf-8", newline="\n"))


def write_with(path: Path | str, write: Callable[[Path], object]) -> None:
    """Let a function write a file next to its place, then move it there.

    Parameters
    ----------
    path
        Where the file is wanted; its folder must exist.
    write
        Is called with a path of the same suffix and writes the file there.

    Raises
    ------
    OutputError
        If it cannot be written; nothing is left behind then.
    """
    path = Path(path)
    check_writable(path)
    try:
        if path.exists() and not path.is_file():  # a pipe or a device cannot be replaced
            write(path)
            return
        with tempfile.TemporaryDirectory(prefix=".hertzchain-", dir=path.parent) as folder:
            part = Path(folder) / path.name
            write(part)
            part.replace(path.resolve())  # where a link points to
    except (OSError, UnicodeError) as problem:  # UnicodeError: text that UTF-8 has no bytes for
        raise _unwritable(path, problem) from None


def check_writable(path: Path | str) -> None:
    """Raise an OutputError, before any work is done, if a file could not be written.

    Raises
    ------
    OutputError
        If the folder is missing or read-only, or the path is a directory.
    """
    path = Path(path)
    try:
        path.stat()
    except FileNotFoundError:
        pass
    except (OSError, ValueError) as problem:  # a name too long, or with a null in it
        raise _unwritable(path, problem) from None
    if path.is_dir():
        raise OutputError(f"{path}: is a directory, must be the name of a file")
    if not path.parent.is_dir():
        reason = "is not a folder" if path.parent.exists() else "does not exist, create it first"
        raise OutputError(f"{path}: {path.parent} {reason}")
    target = path if path.exists() and not path.is_file() else path.parent
    if not os.access(target, os.W_OK) or (path.is_file() and not os.access(path, os.W_OK)):
        raise OutputError(f"{path}: no permission to write here, choose another place")


def _unwritable(path: Path, problem: OSError | ValueError) -> OutputError:
    reason = getattr(problem, "strerror", None) or problem
    return OutputError(f"{path}: cannot be written ({reason})")
