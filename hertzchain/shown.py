"""Objects that show themselves, as text, as a picture or as a page.

How they do is in ``report``, above their rooms: a method loads it when it is called.

PYTEST_DONT_REWRITE, as the package.
"""

from __future__ import annotations

from abc import ABC, abstractmethod

TYPE_CHECKING = False  # typing takes time, see the package
if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.figure import Figure

    from hertzchain.report.document import Document


class Shown:
    """An object that prints as a few lines."""

    def __repr__(self) -> str:
        from hertzchain.report.contents import card_of

        return card_of(self)


class ShownRun(Shown):
    """A run: it prints as ``hertzchain run`` does, and can be drawn."""

    def __repr__(self) -> str:
        from hertzchain.report.console import printed

        return printed(self._document)

    @property
    def _document(self) -> Document:
        from hertzchain.report.contents import document_of

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
