"""What is being done, in one line of a terminal that changes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def shown_progress() -> Iterator[Callable[[str], None]]:
    """Show on stderr what is being done, with the time it takes; nothing is left when it is done.

    Without a terminal there is no line, nor in a notebook, where Rich would need ipywidgets.
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
