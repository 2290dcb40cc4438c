"""How objects show themselves: as text, as a picture, as a page.

Texts, pictures and pages come from ``report``, which stands above the rooms of these objects and is
loaded when an object is shown. This module is the only one that looks upwards.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

ShowProgress = Callable[[str], object] | bool | None
"""True for a line in the terminal, or a function that is called with lines of text."""

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from hertzchain.report.document import Document


class Shown:
    """An object that prints as a few lines."""

    def __repr__(self) -> str:
        from hertzchain.report.cards import card_of

        return card_of(self)


class ShownRun:
    """A run: it prints as ``hertzchain run`` does, and can be drawn."""

    def __repr__(self) -> str:
        from hertzchain.report.cards import printed

        return printed(self._document)

    @property
    def _document(self) -> Document:
        from hertzchain.report.cards import document_of

        return document_of(self)

    def plot(self, size: tuple[float, float] | None = None) -> Figure:
        """Draw peak forces (for a verdict also differences), and force over time if recorded.

        A picture of a ``size`` [inches] has as many panels as have room.
        """
        from hertzchain.report.figures import figure_of

        return figure_of(self._document, size)


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
        from hertzchain.report.page import write_page

        write_page(self._document, path)


def telling(progress: ShowProgress) -> AbstractContextManager[Callable[[str], object]]:
    """Return a context with a function that reports progress: it takes a line of text."""
    if progress is True:
        from hertzchain.report.progress import shown_progress

        return shown_progress()
    return nullcontext(progress or (lambda _: None))
