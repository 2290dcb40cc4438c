"""What is being done, in one line that changes: in a terminal, or below a notebook's cell."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console


@contextmanager
def shown_progress() -> Iterator[Callable[[str], None]]:
    """Show on stderr what is being done, with the time it takes; nothing is left when it is done.

    In a notebook the line stands below the cell; without a terminal there is none.
    """
    from rich.console import Console

    err = Console(stderr=True)
    with _in_notebook() if err.is_jupyter else _in_terminal(err) as report_progress:
        yield report_progress


@contextmanager
def _in_terminal(err: Console) -> Iterator[Callable[[str], None]]:
    from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    text = TextColumn("{task.description}", markup=False)  # names of files may have brackets
    columns = (SpinnerColumn(), text, TimeElapsedColumn())
    with Progress(*columns, console=err, transient=True, disable=not err.is_terminal) as bar:
        task = bar.add_task("")
        yield lambda text: bar.update(task, description=text)


@contextmanager
def _in_notebook() -> Iterator[Callable[[str], None]]:
    """Rich would need ipywidgets there."""
    from IPython.display import display

    begin = time.monotonic()
    line = display({"text/plain": ""}, raw=True, display_id=True)

    def report_progress(text: str) -> None:
        shown = f"{text} ({time.monotonic() - begin:.0f} s)" if text else ""
        line.update({"text/plain": shown}, raw=True)

    try:
        yield report_progress
    finally:
        report_progress("")
