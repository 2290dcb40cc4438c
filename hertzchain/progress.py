"""Progress of long work, in the terminal or by calls of a function; lines on stderr."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from typing import TextIO

from hertzchain.errors import on_one_line

ShowProgress = Callable[[str], object] | bool | None
"""True for a line in the terminal, or a function that is called with lines of text."""


def telling(progress: ShowProgress) -> AbstractContextManager[Callable[[str], object]]:
    """Return a context with a function that reports progress: it takes a line of text."""
    if progress is True:
        return shown_progress()
    return nullcontext(progress or (lambda _: None))


@contextmanager
def shown_progress() -> Iterator[Callable[[str], None]]:
    """Show the present work and its time on stderr; the line is removed at the end.

    There is no line without a terminal, or in a notebook, where Rich would need ipywidgets.
    """
    from rich.console import Console
    from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    err = Console(stderr=True)
    text = TextColumn("{task.description}", markup=False)  # names of files may have brackets
    columns = (SpinnerColumn(), text, TimeElapsedColumn())
    is_shown = err.is_terminal and not err.is_jupyter
    with Progress(*columns, console=err, transient=True, disable=not is_shown) as bar:
        task = bar.add_task("")
        yield lambda text: bar.update(task, description=text)


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
