"""A sweep as a page: one file of HTML that needs no network."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from hertzchain.errors import HertzchainError
from hertzchain.files import write_text
from hertzchain.report.document import Table, Verdict
from hertzchain.report.page import pictures, render
from hertzchain.sweeps.card import card_of
from hertzchain.sweeps.columns import TEXT, column_named
from hertzchain.sweeps.selection import varied_names

if TYPE_CHECKING:
    from markupsafe import Markup

    from hertzchain.report.picture import Picture
    from hertzchain.sweeps import Sweep

_ROWS = 300  # most rows of the table; all are in the folder of the sweep
_DRAWN = "largest_peak_force_N"  # what every sweep has


def write_page(sweep: Sweep, path: Path, file: str) -> None:
    """Write a sweep of a scene's file to a page, completely or not at all."""
    write_text(path, page_of(sweep, file))


def page_of(sweep: Sweep, file: str) -> str:
    """Return a sweep as an HTML page: what varies, the largest peak over it, and the rows."""
    card, frame = card_of(sweep.manifest, sweep.rows, sweep.folder), sweep.to_frame()
    differ = [name for name in frame if name == "scene" or frame[name].nunique(dropna=False) > 1]
    frame = frame[differ]  # the scene says the others
    header = [column_named(str(name)).label or str(name) for name in frame.columns]
    few = frame.head(_ROWS).astype(object)
    shown = [[_text(cell) for cell in row] for row in few.where(few.notna(), "").to_numpy()]
    left = len(frame) - len(shown)
    caption = f"Rows, and {left:,} more in the folder" if left else "Rows"
    drawn, said = _drawn(sweep)
    return render(
        "sweep.html.jinja",
        {
            "kind": "Sweep",
            "title": f"Sweep over {' and '.join(varied_names(sweep.manifest))}",
            "file": file,
            "verdict": Verdict(None, ""),
            "pictures": drawn,
            "caption": said,
            "summary": card.facts,
            "scenes": Table(caption, header, shown, 2),
            "versions": [("hertzchain", sweep.manifest["hertzchain"])],
            "numbers": {**sweep.manifest, "shown": shown},
            "numbers_name": "sweep.json",
        },
    )


def _text(cell: object) -> str:
    return f"{cell:.7g}" if isinstance(cell, float) else str(cell)


def _drawn(sweep: Sweep) -> tuple[list[Markup], str]:
    """Return pictures of the largest peak over what varies, and a sentence on them."""
    from hertzchain.sweeps.drawing import SIZE, draw

    varied = varied_names(sweep.manifest)
    numbers = [name for name in varied if name not in TEXT]
    if not numbers:
        return [], "No number varies that the largest peak could be drawn over."
    others = [name for name in varied if name != numbers[0]]
    colour = others[0] if others else None

    def drawn(size: tuple[float, float] = SIZE) -> Picture:
        return draw(sweep, numbers[0], _DRAWN, colour, size=size).figure

    try:
        return pictures(drawn), "Largest peak of each scene."
    except HertzchainError as problem:
        return [], f"Not drawn: {problem}."
