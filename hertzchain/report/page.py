"""Verdicts as pages: one file of HTML, with Plotly inlined, that needs no network."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hertzchain.errors import OutputError
from hertzchain.files import write_text
from hertzchain.report.document import Document, Table
from hertzchain.report.facts import describe, difference, shown_contacts
from hertzchain.report.page_plots import LONG, difference_plot, peak_plot, plotted_contacts
from hertzchain.report.waterfall import waterfall, why_no_waterfall

if TYPE_CHECKING:
    from hertzchain.verdict.check import Check

TEMPLATES = Path(__file__).parent / "templates"

_ROWS = 10_000  # most rows of a table, a megabyte; all further numbers are in the page's JSON
_UNDIVIDED = 30  # most contacts in a single table


@dataclass(frozen=True)
class CheckRow:
    """A check and its numbers as a page shows them."""

    passed: bool
    name: str
    reason: str
    cells: Sequence[str]


def _check_row(check: Check) -> CheckRow:
    """Return a check's measured and expected number, difference and tolerance."""
    numbers = ["" if x is None else f"{x:.9g}" for x in (check.measured, check.expected)]
    off = ["0" if text == "0.0e+00" else text for text in difference(check)]
    return CheckRow(check.passed, check.name, check.reason, [*numbers, *off])


def _peak_tables(document: Document) -> list[Table]:
    """Return tables of the transition and of the rest; a single table for a short chain."""
    native, row = document.native, document.peaks.row
    header = [f"{label} {unit}".strip() for label, unit in document.peaks.columns]
    size, first = native.contact.size, len(shown_contacts(native))
    if not document.peaks.of_contacts:
        return [Table(document.peaks.heading, header, [row(k) for k in document.peaks.shown], 1)]
    caption = "Peak force of each contact"
    if size <= _UNDIVIDED or first >= size:
        return [Table(caption, header, [row(k) for k in range(size)], 0)]
    left = [row(k) for k in range(first, min(size, first + _ROWS))]
    p = native.transition_granules
    of_transition = "the first contacts" if p is None else "the transition and the contact after it"
    rest = f"{size - first:,} further contacts, {native.contact[first]} to {native.contact[-1]}"
    if len(left) < size - first:
        rest += f"; here to {left[-1][0]}, the rest is in the JSON"
    told = [at for at in range(len(header)) if any(cells[at] for cells in left)]
    return [
        Table(f"{caption}: {of_transition}", header, [row(k) for k in range(first)], 0),
        Table(rest, [header[at] for at in told], [[cells[at] for at in told] for cells in left], 0),
    ]


def page_of(document: Document, file: str = "scene.toml", given: str = "") -> str:
    """Return a document as an HTML page, with the names of the files of scene and given peaks."""
    native, results = document.native, document.results
    plotted = plotted_contacts(document)
    waves = waterfall(results)
    plots = [peak_plot(document, plotted), difference_plot(document, plotted)]
    plots += [] if waves is None else [waves]
    texts = native.scene.to_texts(Path("scene.toml"))
    versions: dict[str, str] = {}
    for result in results.values():
        versions |= result.numbers()["provenance"]
    return render(
        "verdict.html.jinja",
        {
            "kind": document.kind,
            "title": describe(native.scene),
            "file": file,
            "given": given,
            "verdict": document.verdict,
            "it": document,
            "plots": {plot.name: plot for plot in plots},
            "no_waterfall": why_no_waterfall(native),
            "peaks": _peak_tables(document),
            "long": LONG,
            "rows": [_check_row(check) for check in document.checks],
            "texts": [(path.name, text) for path, text in reversed(texts.items())],
            "versions": list(versions.items()),
            "findings": document.findings,
            "listings": document.listings,
            "numbers": document.numbers(),
            "numbers_name": f"{document.name}.json",
        },
    )


def render(template: str, content: Mapping[str, Any], templates: Sequence[Path] = ()) -> str:
    """Fill a template, from here or another folder, with content, which is escaped."""
    from importlib.metadata import version

    from jinja2 import Environment, FileSystemLoader, StrictUndefined
    from plotly.offline import get_plotlyjs

    environment = Environment(
        loader=FileSystemLoader([*templates, TEMPLATES]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    compact = {"separators": (",", ":"), "allow_nan": False}
    environment.policies["json.dumps_kwargs"] = compact
    return environment.get_template(template).render(
        content,
        plotly=get_plotlyjs(),
        version=version("hertzchain"),
        date=f"{datetime.now(UTC):%Y-%m-%d %H:%M} UTC",
    )


def check_page_format(path: Path | str) -> None:
    """Raise an OutputError, before any work is done, for a name without the suffix of a page."""
    if Path(path).suffix.lower() not in (".html", ".htm"):
        raise OutputError(f"{path}: a report is a page, the name must end in .html or .htm")


def write_page(
    document: Document, path: Path | str, file: str = "scene.toml", given: str = ""
) -> None:
    """Write ``page_of`` a document to a file, completely or not at all; OutputError on failure."""
    check_page_format(path)
    write_text(path, page_of(document, file, given))
