"""Lines on stderr, which may be closed or full."""

from __future__ import annotations

import os
import sys
from typing import TextIO

from hertzchain.errors import on_one_line


def say(text: object, before: str = "hertzchain: ") -> None:
    """Write a line to stderr, above a progress line, which Typer would write into.

    A stderr that is closed or full changes no result.
    """
    try:
        if sys.stderr is not None:  # closed from the start
            sys.stderr.write(f"{before}{on_one_line(str(text))}\n")
            sys.stderr.flush()
    except OSError:
        discard(sys.stderr)


def discard(stream: TextIO) -> None:
    """Discard the rest of a stream's buffer: it must not fail again when Python ends."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
