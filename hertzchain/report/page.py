"""Runs and verdicts as pages: one file of HTML that needs no network."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from hertzchain.arrays import apart
from hertzchain.files import write_text
from hertzchain.report.document import Document, Table, describe, difference
from hertzchain.report.files import check_format

if TYPE_CHECKING:
    from hertzchain.verdict.check import Check

_MOST_ROWS = 200  # most rows of a table; all further numbers are in the page's JSON


def _check_row(check: Check) -> list[str]:
    """Return the cells of a check; numbers that should be equal have the digits that differ."""
    numbers = ["" if x is None else f"{x:.9g}" for x in (check.measured, check.expected)]
    if not check.passed and check.measured is not None and check.expected is not None:
        numbers = list(apart(check.measured, check.expected, 9))
    off = ["0" if text == "0.0e+00" else text for text in difference(check)]
    mark = "✓ pass" if check.passed else "✗ FAIL"
    return [mark, f"{check.name}\n{check.reason}", *numbers, *off]


def _peak_table(document: Document) -> Table:
    """Return the table of peaks, of the first contacts in a long chain."""
    peaks, size = document.peaks, document.native.contact.size
    header = [f"{label} {unit}".strip() for label, unit, _ in peaks.columns]
    if not peaks.of_contacts:
        return Table("Peak forces", peaks.heading, header, [peaks.row(k) for k in peaks.shown])
    rows = [peaks.row(k) for k in range(min(size, _MOST_ROWS))]
    caption = "Peak force of each contact"
    if size > _MOST_ROWS:
        caption = f"Peak force of the first {_MOST_ROWS} of {size:,} contacts; all are in the JSON"
    return Table("Peak forces", caption, header, rows, 0)


def _tables(document: Document) -> list[Table]:
    """Return the tables between the figure of a page and its scene."""
    said = () if document.verdict.sentence else [f"{text}." for text in document.remarks]
    checks = Table(
        "Checks",
        "Each check: a number beside the one it should be",
        (
            *("", "check, and why this tolerance", "measured", "expected"),
            *("difference", "tolerance", "of the tolerance"),
        ),
        [_check_row(check) for check in document.checks],
        2,
        ["The verdict rests on these and on nothing else; the formulas never decide."],
    )
    facts = Table("Summary", "All contacts together", (), document.facts, 2, said)
    tables = [facts, _peak_table(document), checks, *document.tables]
    return [table for table in tables if table.rows]


def page_of(document: Document, file: str = "scene.toml", given: str = "") -> str:
    """Return a document as an HTML page, with the names of the files of scene and given peaks."""
    from importlib.metadata import version

    from jinja2 import Environment, FileSystemLoader, StrictUndefined
    from markupsafe import Markup

    from hertzchain.report.figures import figure_of

    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent / "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    compact = {"separators": (",", ":"), "allow_nan": False}
    environment.policies["json.dumps_kwargs"] = compact
    native = document.native
    texts = native.scene.to_texts(Path("scene.toml"))
    versions: dict[str, str] = {}
    for result in document.results.values():
        versions |= result.numbers()["provenance"]
    return environment.get_template("page.html.jinja").render(
        kind=document.kind,
        title=describe(native.scene),
        file=file,
        given=given,
        verdict=document.verdict,
        picture=Markup(figure_of(document).inline()),  # noqa: S704 - made here
        label=(
            "Measured forces over time, on those of the reference."
            if document.overlays
            else "Peak force of each contact along the chain; the numbers are in the table of peak"
            " forces."
        ),
        caption=_caption(document),
        tables=_tables(document),
        texts=[(path.name, text) for path, text in reversed(texts.items())],
        versions=list(versions.items()),
        numbers=document.numbers(),
        numbers_name=f"{document.command}.json",
        version=version("hertzchain"),
        date=f"{datetime.now(UTC):%Y-%m-%d %H:%M} UTC",
    )


def _caption(document: Document) -> str:
    """Return the caption of the figure of a document."""
    if document.overlays:
        said = ["Dots are measured, lines are the reference, each gauge above its own zero."]
        if any(overlay.band is not None for overlay in document.overlays):
            said.append("The band has 90 % of the runs with values drawn from the uncertain input.")
        return " ".join(said)
    said = ["Contact i lies between granules i \u2212 1 and i."]
    if document.native.transition_granules is not None:
        said.append("p is the end of the transition.")
    if document.absent:
        said.append(f"{' and '.join(document.absent)}: not run.")
    if document.drawn:
        said.append(
            "Differences are relative and without their sign; exact agreement is not drawn. A line"
            " is the error bound of that simulation."
        )
    return " ".join(said)


def write_page(
    document: Document, path: Path | str, file: str = "scene.toml", given: str = ""
) -> None:
    """Write ``page_of`` a document to a file, completely or not at all; OutputError on failure."""
    check_format(path, "page")
    write_text(path, page_of(document, file, given))
