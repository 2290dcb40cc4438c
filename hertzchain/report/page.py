"""Runs and verdicts as pages: one file of HTML that needs no network."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hertzchain.arrays import apart
from hertzchain.files import write_text
from hertzchain.report.document import Document, Section, Table, describe, difference
from hertzchain.report.files import check_format

if TYPE_CHECKING:
    from markupsafe import Markup

    from hertzchain.report.picture import Picture
    from hertzchain.verdict.check import Check

TEMPLATES = Path(__file__).parent / "templates"

_MOST_ROWS = 200  # most rows of a table; all further numbers are in the page's JSON


CHECKED = ("", "check, and why this tolerance", "measured", "expected", "difference", "tolerance")
"""Columns of a table of checks, before the one of the difference over the tolerance."""


def mark(passed: bool) -> str:
    """Return the word and sign of a verdict for a cell."""
    return "✓ pass" if passed else "✗ FAIL"


def _check_row(check: Check) -> list[str]:
    """Return a check's measured and expected number, difference, tolerance and their ratio.

    Only numbers that should be equal and are not have all the digits that distinguish them.
    """
    numbers = ["" if x is None else f"{x:.9g}" for x in (check.measured, check.expected)]
    if not check.passed and check.measured is not None and check.expected is not None:
        numbers = list(apart(check.measured, check.expected, 9))
    off = ["0" if text == "0.0e+00" else text for text in difference(check)]
    return [mark(check.passed), f"{check.name}\n{check.reason}", *numbers, *off]


def _peak_table(document: Document) -> Table:
    """Return the table of peaks, of the first contacts in a long chain."""
    header = [f"{label} {unit}".strip() for label, unit in document.peaks.columns]
    if not document.peaks.of_contacts:
        rows = [document.peaks.row(k) for k in document.peaks.shown]
        return Table(document.peaks.heading, header, rows, 1)
    size = document.native.contact.size
    rows = [document.peaks.row(k) for k in range(min(size, _MOST_ROWS))]
    caption = "Peak force of each contact"
    if size > _MOST_ROWS:
        caption = f"Peak force of the first {_MOST_ROWS} of {size:,} contacts; all are in the JSON"
    return Table(caption, header, rows, 0)


def _sections(document: Document) -> list[Section]:
    """Return the sections between the figure of a page and its scene."""
    sections = []
    if document.facts:
        facts = Table("All contacts together", (), document.facts, 2)
        said = () if document.verdict.sentence else [f"{text}." for text in document.remarks]
        sections.append(Section("Summary", facts, said))
    sections.append(Section("Peak forces", _peak_table(document)))
    if document.pulses is not None:
        sections.append(Section("Pulses", document.pulses))
    if document.checks:
        rows = [_check_row(check) for check in document.checks]
        checks = Table(
            "Each check: a number beside the one it should be",
            (*CHECKED, "of the tolerance"),
            rows,
            2,
        )
        only = "The verdict rests on these and on nothing else; the formulas never decide."
        sections.append(Section("Checks", checks, [only]))
    if (answers := document.answers) is not None:
        of_run = (
            "The number of steps is of the run itself; time is of the whole call, with the runs"
            " that find its step and its error."
        )
        said = [" ".join([of_run, *(f"{note}." for note in document.notes)])]
        if "formulas" in answers.header:
            said.append(
                "p: granules in the transition; F_SW: peak force of contact p + 1. The formulas are"
                " given p and F_SW of native."
            )
        sections.append(Section(answers.caption, answers, said))
    return sections


def page_of(document: Document, file: str = "scene.toml", given: str = "") -> str:
    """Return a document as an HTML page, with the names of the files of scene and given peaks."""
    from hertzchain.report.figures import figure_of

    native = document.native
    texts = native.scene.to_texts(Path("scene.toml"))
    versions: dict[str, str] = {}
    for result in document.results.values():
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
            "pictures": pictures(partial(figure_of, document)),
            "caption": _caption(document),
            "sections": _sections(document),
            "texts": [(path.name, text) for path, text in reversed(texts.items())],
            "versions": list(versions.items()),
            "numbers": document.numbers(),
            "numbers_name": f"{document.command}.json",
        },
    )


def pictures(draw: Callable[..., Picture]) -> list[Markup]:
    """Return a figure as SVG for a wide and a narrow window; ``draw`` takes its size [inches]."""
    from markupsafe import Markup

    wide = draw()
    # Width of the figure there; its height over the wide one
    narrow = draw(size=(3.8, wide.get_figheight() * 0.9))
    shown = {"wide": wide, "narrow": narrow}
    return [Markup(figure.inline(name)) for name, figure in shown.items()]  # noqa: S704


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


def render(template: str, content: Mapping[str, Any], templates: Sequence[Path] = ()) -> str:
    """Fill a template, from here or another folder, with content, which is escaped."""
    from importlib.metadata import version

    from jinja2 import Environment, FileSystemLoader, StrictUndefined

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
        content, version=version("hertzchain"), date=f"{datetime.now(UTC):%Y-%m-%d %H:%M} UTC"
    )


def write_page(
    document: Document, path: Path | str, file: str = "scene.toml", given: str = ""
) -> None:
    """Write ``page_of`` a document to a file, completely or not at all; OutputError on failure."""
    check_format(path, "page")
    write_text(path, page_of(document, file, given))
