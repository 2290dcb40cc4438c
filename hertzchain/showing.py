"""Display of objects and of progress: as text, as a picture, as a page, as a line.

Texts, pictures and pages are those of ``report``, which stands above the rooms of these objects:
the package gives it to ``Shown``, and it is loaded when an object is shown.

PYTEST_DONT_REWRITE, as the package.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext

ShowProgress = Callable[[str], object] | bool | None
"""True for a line in the terminal, or a function that is called with lines of text."""

TYPE_CHECKING = False  # typing takes time, see the package
if TYPE_CHECKING:
    from pathlib import Path
    from typing import Any

    from matplotlib.figure import Figure


class Shown:
    """An object that prints as a few lines."""

    @staticmethod
    def module_of_report(name: str) -> Any:
        """Load a module of ``report``, by its name; the package gives it."""
        raise NotImplementedError

    def __repr__(self) -> str:
        return str(self.module_of_report("documents").card_of(self))


class ShownRun(Shown):
    """A run: it prints as ``hertzchain run`` does, and can be drawn."""

    def __repr__(self) -> str:
        return str(self.module_of_report("documents").printed(self._document))

    @property
    def _document(self) -> Any:
        return self.module_of_report("documents").document_of(self)

    def plot(self, size: tuple[float, float] | None = None) -> Figure:
        """Draw peak forces (for a verdict also differences), and force over time if recorded.

        A picture of a ``size`` [inches] has as many panels as have room.
        """
        figure: Figure = self.module_of_report("figures").figure_of(self._document, size)
        return figure


class ShownVerdict(ShownRun, ABC):
    """A verdict: it prints as ``hertzchain compare`` does, and can be drawn and written.

    It is true if the verdict is ``pass``: ``assert hc.judge(scene, peaks)`` is a test.
    """

    @property
    @abstractmethod
    def verdict(self) -> str:
        """``pass``, or ``fail`` where something differs or could not be compared."""

    def __bool__(self) -> bool:
        return self.verdict == "pass"

    def report(self, path: Path | str) -> None:
        """Write a page (.html) to read and to send: verdict, plots, tables and all numbers.

        It has forces over time where the runs recorded them (``record``).

        Raises
        ------
        OutputError
            If the name does not end in .html, or the file cannot be written.
        """
        self.module_of_report("page").write_page(self._document, path)


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
