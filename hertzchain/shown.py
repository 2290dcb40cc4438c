"""Objects that show themselves, as text, as a picture or as a page.

How they do is in ``report``, above their rooms: the package registers its loader here.

PYTEST_DONT_REWRITE, as the package.
"""

from __future__ import annotations

from abc import ABC, abstractmethod

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
