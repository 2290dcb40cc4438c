"""Output of the commands that end with a verdict: compare, judge and examine."""

from __future__ import annotations

import time
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

import typer

from hertzchain.cli import output

if TYPE_CHECKING:
    from hertzchain.report.document import Document


class Shown:
    """Where a verdict is shown: on stdout, as a plot, as a page and as JUnit XML.

    Parameters
    ----------
    scene, given
        The scene's file, and the files that are judged; none of them is overwritten.
    as_json
        Whether stdout has one JSON object.
    plot, report, junit
        Files to write, if any. They are refused here, before any work is done.
    """

    def __init__(
        self,
        scene: Path,
        given: Sequence[Path],
        as_json: bool,
        plot: Path | None,
        report: Path | None,
        junit: Path | None,
    ) -> None:
        from hertzchain.files import check_outputs
        from hertzchain.report import figures, page

        self._begun, self._begin = datetime.now(UTC), time.perf_counter()
        check_outputs([scene, *given], [plot, report, junit])
        if plot is not None:
            figures.check_plot_format(plot)
        if report is not None:
            page.check_page_format(report)
        ends = dict.fromkeys(file.name for file in (*given[:1], *given[-1:]))
        self._names = scene.name, " ... ".join(ends)
        self._scene, self._as_json = scene, as_json
        self._plot, self._report, self._junit = plot, report, junit

    def end(self, document: Document) -> NoReturn:
        """Print the document, write the files, and end with the status of the verdict."""
        from hertzchain.files import write_text
        from hertzchain.report import figures, page
        from hertzchain.report.console import print_document
        from hertzchain.report.junit import to_xml
        from hertzchain.verdict.check import NOT_RUN

        seconds = time.perf_counter() - self._begin
        suite = document.suite(self._scene.stem, self._begun, seconds)
        if self._as_json:
            output.print_json(document.numbers())
        else:
            print_document(output.console(), document)
        output.write_file("Plot", self._plot, lambda path: figures.plot_document(document, path))
        output.write_file(
            "Report", self._report, lambda path: page.write_page(document, path, *self._names)
        )
        output.write_file("JUnit XML", self._junit, lambda path: write_text(path, to_xml([suite])))
        missing = [check for check in document.checks if check.kind == NOT_RUN]
        for check in missing:
            output.say(f"{check.name}: {check.reason}")
        if missing:
            raise typer.Exit(output.UNUSABLE)
        raise typer.Exit(output.DONE if document.verdict.passed else output.OUT_OF_TOLERANCE)
