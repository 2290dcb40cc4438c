"""The report of all validation scripts: a page, with a table and a figure file for each."""

from __future__ import annotations

import base64
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import hertzchain as hc
from hertzchain.errors import OutputError
from hertzchain.files import check_writable, write_text
from hertzchain.report.document import Failure, Table, Verdict
from hertzchain.report.page import CHECKED, mark, pictures, render
from hertzchain.report.picture import Picture, legend_above
from hertzchain.verdict.tradeoff import provenance
from validation.rows import Row
from validation.script import write_figure, write_table

if TYPE_CHECKING:
    from validation.run_all import Outcome

HERE = Path(__file__).parent

_LEAST, _MOST = 1e-6, 1e3
"""Least and largest drawn difference [tolerances]; values beyond, or missing, are drawn there."""

_FEW = 12
"""Rows that are shown unfolded."""

_NAMED = 10
"""Rows that failed, named at the top of the page."""


def make_folder(folder: Path) -> None:
    """Make the folder of a report, before any work is done; OutputError if that cannot be."""
    if folder.exists() and not folder.is_dir():
        raise OutputError(f"{folder}: is a file, must be the name of a folder")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError) as problem:
        reason = getattr(problem, "strerror", None) or problem
        raise OutputError(f"{folder}: cannot be made ({reason}), choose another place") from None
    check_writable(folder / "index.html")


@dataclass(frozen=True)
class Section:
    """One script in the page."""

    outcome: Outcome
    drawing: str  # its figure as a data URI; empty where there is none
    missing: str  # why there is no figure

    @property
    def passed(self) -> int:
        """Number of rows that pass."""
        return len(self.outcome.rows) - self.outcome.failed

    @property
    def mark(self) -> str:
        """Its verdict."""
        return mark(not self.outcome.failed)

    def rows(self, passed: bool) -> Table:
        """Rows that pass, or those that fail."""
        rows = [_cells(entry) for entry in self.outcome.rows if entry.passed == passed]
        caption = "Rows that pass" if passed else "Rows that fail"
        return Table(caption, (*CHECKED, "times"), rows, 2)


def write_outcome(folder: Path, outcome: Outcome) -> Section:
    """Write the table (CSV) and the figure (SVG) of a script, and return its section."""
    if outcome.table is None:
        return Section(outcome, "", "it could not be measured")
    write_table(folder / f"{outcome.name}.csv", outcome.table)
    path = folder / f"{outcome.name}.svg"
    try:
        figure = outcome.script.draw(outcome.table)
    except hc.HertzchainError as problem:
        return Section(outcome, "", str(problem))
    write_figure(path, figure)
    # As an image: ids of several figures within one page would clash.
    encoded = base64.b64encode(path.read_bytes()).decode()
    return Section(outcome, f"data:image/svg+xml;base64,{encoded}", "")


def write_report(folder: Path, sections: Sequence[Section], document: dict[str, Any]) -> None:
    """Write index.html, with the document as JSON to be saved from the page."""
    outcomes = [section.outcome for section in sections]
    rows = [entry for outcome in outcomes for entry in outcome.rows]
    failed = [(o.name, entry) for o in outcomes for entry in o.rows if not entry.passed]
    named = [
        Failure(f"{name}: {_name(entry)}", _found(entry), entry.reason)
        for name, entry in failed[:_NAMED]
    ]
    more = [f"{len(failed) - _NAMED} more rows failed, see below"] if len(failed) > _NAMED else []
    passing = sum(not outcome.failed for outcome in outcomes)
    sentence = (
        f"{len(rows) - len(failed)} of {len(rows)} rows pass; {passing} of {len(outcomes)} scripts"
        " have no row that fails."
    )
    content = {
        "kind": "Validation",
        "title": "Every validation script",
        "file": "",
        "verdict": Verdict(not failed, sentence, named, more),
        "sections": sections,
        "overview": pictures(partial(_overview, outcomes)),
        "caption": OVERVIEW,
        "few": _FEW,
        "versions": list(provenance().items()),
        "numbers": document,
        "numbers_name": "validation.json",
    }
    write_text(folder / "index.html", render("run_all.html.jinja", content, [HERE]))


def _found(entry: Row) -> str:
    if not math.isfinite(entry.measured):
        return "no number"
    return f"{entry.measured:.6g}, expected {entry.expected:.6g} to {entry.tolerance:.2g}"


def _cells(entry: Row) -> list[str]:
    off, times = abs(entry.measured - entry.expected), _times(entry)
    numbers = (entry.measured, ".6g"), (entry.expected, ".6g"), (off, ".2g")
    cells = [f"{value:{form}}" if math.isfinite(value) else "" for value, form in numbers]
    cells += [f"{entry.tolerance:.2g}", "" if times is None else f"{times:.2g}"]
    return [mark(entry.passed), f"{_name(entry)}\n{entry.reason}", *cells]


def _name(entry: Row) -> str:
    return f"{entry.what} ({entry.backend})"


def _times(entry: Row) -> float | None:
    """The difference in units of the tolerance; None where that is no number."""
    off = abs(entry.measured - entry.expected)
    return off / entry.tolerance if math.isfinite(off) and entry.tolerance > 0 else None


def _overview(outcomes: Sequence[Outcome], size: tuple[float, float] | None = None) -> Picture:
    """Draw every row: how far off it is, in tolerances, script by script."""
    figure = Picture(size or (8.0, 1.2 + 0.28 * len(outcomes)))
    axes = figure.subplots()
    for passed, label, marker, colour in (
        (True, "passes", "o", "#0072B2"),
        (False, "fails", "x", "#D55E00"),
    ):
        points = [
            # Neighbours lie on seven heights, so that they do not cover one another.
            (_drawn_at(entry), line + 0.1 * (place % 7 - 3))
            for line, outcome in enumerate(outcomes)
            for place, entry in enumerate(outcome.rows)
            if entry.passed == passed
        ]
        look: dict[str, Any] = {
            "marker": marker,
            "color": colour,
            "markersize": 4,
            "fillstyle": "none",
        }
        x, y = zip(*points, strict=True) if points else ((), ())
        axes.plot(x, y, linestyle="none", label=label, **look)
    axes.axvline(1, color="0.35", linewidth=1)
    axes.set_xscale("log")
    axes.set(xlabel="difference / tolerance", ylim=(len(outcomes) - 0.4, -0.6))
    axes.set_yticks(range(len(outcomes)), [outcome.name for outcome in outcomes])
    legend_above(axes)
    return figure


OVERVIEW = (
    "Every row of every script: its difference in units of its tolerance, of which 1 (the line) is"
    " the limit, except for planted mistakes, which have to be off. Differences below"
    f" {_LEAST:g}, among them those of numbers that have to be met exactly, are drawn at"
    f" {_LEAST:g}; rows without a number, and what is off by more, at {_MOST:g}."
)


def _drawn_at(entry: Row) -> float:
    times = _times(entry)
    if times is None:
        return _LEAST if entry.passed else _MOST
    return min(max(times, _LEAST), _MOST)
