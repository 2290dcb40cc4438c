"""Output of run, compare, judge and examine: stdout, plot, page and JUnit XML."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

import typer

from hertzchain.cli import options, output

if TYPE_CHECKING:
    from hertzchain.report.document import Document


@dataclass
class Shown:
    """The outputs of a document.

    Files that cannot be written are refused here, before any work is done.

    Parameters
    ----------
    scene
        The scene's file.
    wanted
        What of it is printed and written.
    given
        The files that are judged; no given file is overwritten.
    every
        Whether stdout has every contact.
    others
        Further files that the command writes, by the kinds of ``check_format`` or "".
    """

    scene: Path
    wanted: options.DocumentOptions
    given: Sequence[Path] = ()
    every: bool = False
    others: Mapping[str, Path | None] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._inches = self.wanted.inches
        self._begun, self._begin = datetime.now(UTC), time.perf_counter()
        others = dict(self.others)
        without_format = [self._junit, others.pop("", None)]
        files = {**others, "plot": self.wanted.plot, "page": self.wanted.report}
        output.check_files([self.scene, *self.given], without_format, **files)

    @property
    def _junit(self) -> Path | None:
        return self.wanted.junit if isinstance(self.wanted, options.VerdictOptions) else None

    def print(self, document: Document, rest: str | None = None) -> None:
        """Print the document; ``rest`` says where the peaks not shown on the terminal are."""
        from hertzchain.report.console import print_document

        output.show(
            self.wanted.as_json,
            document.numbers,
            lambda console: print_document(console, document, rest, self.every),
        )

    def write(self, document: Document) -> None:
        """Write plot and page."""
        if (
            self.wanted.plot is None and self.wanted.report is None
        ):  # Matplotlib is loaded only if needed
            return
        from hertzchain.report import figures, page

        ends = dict.fromkeys(file.name for file in (*self.given[:1], *self.given[-1:]))
        names = self.scene.name, " ... ".join(ends)
        output.write_file(
            "Plot",
            self.wanted.plot,
            lambda path: figures.figure_of(document, self._inches).write(path),
        )
        output.write_file(
            "Report", self.wanted.report, lambda path: page.write_page(document, path, *names)
        )

    def end(self, document: Document) -> NoReturn:
        """Print a verdict, write the files, and end with its status."""
        from hertzchain.files import write_text
        from hertzchain.report.document import to_xml
        from hertzchain.verdict.check import NOT_RUN

        seconds = time.perf_counter() - self._begin
        suite = document.suite(self.scene.stem, self._begun, seconds)
        self.print(document)
        self.write(document)
        output.write_file("JUnit XML", self._junit, lambda path: write_text(path, to_xml([suite])))
        missing = [check for check in document.checks if check.kind == NOT_RUN]
        for check in missing:
            output.say(f"{check.name}: {check.reason}")
        if missing:
            raise typer.Exit(output.UNUSABLE)
        raise typer.Exit(output.DONE if document.verdict.passed else output.OUT_OF_TOLERANCE)
