"""Progress: the present work, in a line of the terminal that is updated."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager


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
