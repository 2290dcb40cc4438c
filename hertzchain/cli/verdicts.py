"""Output of the commands that end with a verdict: compare, judge and examine."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

import typer

from hertzchain.cli import options, output

if TYPE_CHECKING:
    from hertzchain.report.document import Document


@dataclass
class Shown:
    """Where a verdict is shown: on stdout, as a plot, as a page and as JUnit XML.

    Files that cannot be written are refused here, before any work is done.

    Parameters
    ----------
    scene, given
        The scene's file, and the files that are judged; none of them is overwritten.
    as_json
        Whether stdout has one JSON object.
    plot, report, junit
        Files to write, if any.
    every
        Whether stdout has every contact.
    size
        Width and height of the plot, as the option has them.
    """

    scene: Path
    given: Sequence[Path]
    as_json: bool
    plot: Path | None
    report: Path | None
    junit: Path | None
    every: bool = False
    size: str | None = None

    def __post_init__(self) -> None:
        options.refuse_without_need(self.plot is not None, size=self.size is not None)
        self._inches = options.to_inches(self.size)
        self._begun, self._begin = datetime.now(UTC), time.perf_counter()
        given = [self.scene, *self.given]
        output.check_files(given, [self.junit], plot=self.plot, page=self.report)

    def end(self, document: Document) -> NoReturn:
        """Print the document, write the files, and end with the status of the verdict."""
        from hertzchain.files import write_text
        from hertzchain.report import figures, page
        from hertzchain.report.console import print_document
        from hertzchain.report.junit import to_xml
        from hertzchain.verdict.check import NOT_RUN

        ends = dict.fromkeys(file.name for file in (*self.given[:1], *self.given[-1:]))
        names = self.scene.name, " ... ".join(ends)
        seconds = time.perf_counter() - self._begin
        suite = document.suite(self.scene.stem, self._begun, seconds)
        output.show(
            self.as_json,
            document.numbers,
            lambda console: print_document(console, document, every=self.every),
        )
        output.write_file(
            "Plot",
            self.plot,
            lambda path: figures.figure_of(document, self._inches).write(path),
        )
        output.write_file(
            "Report", self.report, lambda path: page.write_page(document, path, *names)
        )
        output.write_file("JUnit XML", self.junit, lambda path: write_text(path, to_xml([suite])))
        missing = [check for check in document.checks if check.kind == NOT_RUN]
        for check in missing:
            output.say(f"{check.name}: {check.reason}")
        if missing:
            raise typer.Exit(output.UNUSABLE)
        raise typer.Exit(output.DONE if document.verdict.passed else output.OUT_OF_TOLERANCE)
