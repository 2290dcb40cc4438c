"""Tables of a page, and its checks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hertzchain.observables.result import Result
from hertzchain.report.facts import (
    difference,
    number,
    shown_contacts,
)
from hertzchain.report.page_plots import (
    Series,
)
from hertzchain.report.style import LABELS

if TYPE_CHECKING:
    from hertzchain.verdict.check import Check
    from hertzchain.verdict.comparison import Comparison


_ROWS = 10_000
"""Of a table, a megabyte; all further numbers are in the page's JSON."""


@dataclass(frozen=True)
class Table:
    """A table of a page.

    Parameters
    ----------
    caption
        What it is.
    header
        Names of the columns.
    rows
        Cells as they are shown.
    text
        How many of the first columns are text; all further ones are numbers.
    """

    caption: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]
    text: int = 1


def _peak_rows(native: Result, series: Series, codes: int) -> tuple[list[str], list[list[str]]]:
    """Header and rows of the table of peaks: digits of simulations, per cent of formulas."""
    labels = [label for _, label, _ in series]
    header = ["contact", "native [N]", *(f"{label} [N]" for label in labels)]
    header += [f"{label} − native" for label in labels]  # noqa: RUF001 - a minus sign
    rows = []
    columns = [values.tolist() for _, _, values in series]
    for contact, peak, *others in zip(
        native.contact.tolist(), native.peak_force.tolist(), *columns, strict=True
    ):
        cells = [str(contact), number(peak, 9)]
        for at, value in enumerate(others):
            cells.append(number(value, 9 if at < codes else 6))
        for at, value in enumerate(others):
            known = peak > 0 and not np.isnan(value)
            off = value / peak - 1 if known else 0.0
            cells.append((f"{off:+.1e}" if at < codes else f"{off:+.2%}") if known else "")
        rows.append(cells)
    return header, rows


def split_table(
    result: Result, caption: str, header: list[str], rows: list[list[str]]
) -> list[Table]:
    """The transition, then the rest; one table where the chain is short."""
    if len(rows) <= 30:
        return [Table(caption, header, rows, 0)]
    first = len(shown_contacts(result))
    if first >= len(rows):
        return [Table(caption, header, rows, 0)]
    left = rows[first : first + _ROWS]
    p = result.transition_granules
    of_transition = "the first contacts" if p is None else "the transition and the contact after it"
    rest = f"{len(rows) - first:,} further contacts, {rows[first][0]} to {rows[-1][0]}"
    if len(left) < len(rows) - first:
        rest += f"; here to {left[-1][0]}, the rest is in the JSON"
    told = [at for at in range(len(header)) if any(row[at] for row in left)]
    return [
        Table(f"{caption}: {of_transition}", header, rows[:first], 0),
        Table(rest, [header[at] for at in told], [[row[at] for at in told] for row in left], 0),
    ]


def peak_tables(comparison: Comparison, series: Series, codes: int) -> list[Table]:
    """Peak forces of all contacts, in a table or two."""
    header, rows = _peak_rows(comparison.native, series, codes)
    return split_table(comparison.native, "Peak force of each contact", header, rows)


def cost_table(comparison: Comparison) -> Table:
    """What each answer of a comparison cost, and its error."""
    header = ["", "method", "largest step [s]", "steps", "force evaluations", "wall time [s]"]
    rows = [
        [
            LABELS[name],
            result.method,
            f"{result.dt:.3g}",
            f"{result.steps:,}",
            f"{result.force_evaluations:,}",
            f"{result.wall_time:.3g}",
            f"{result.error_estimate:.1e}",
        ]
        for name, result in comparison.results.items()
    ]
    rows += [
        [LABELS[name], "did not run", *[""] * 5]
        for name in comparison.wanted
        if name not in comparison.results
    ]
    said = "see differences" if comparison.formulas.applicable is None else ""
    rows.append(["formulas", "Eqs. 3 to 9, given p and F_SW", "", "0", "0", "0", said])
    return Table("What each answer cost", [*header, "error of the peaks, at most"], rows, text=2)


@dataclass(frozen=True)
class CheckRow:
    """A check in a table.

    Parameters
    ----------
    passed, name, reason
        As the check has them.
    cells
        Its numbers, as they are shown.
    """

    passed: bool
    name: str
    reason: str
    cells: Sequence[str]

    @classmethod
    def of(cls, check: Check) -> CheckRow:
        """A check, with measured, expected, difference and tolerance."""
        measured = "" if check.measured is None else f"{check.measured:.9g}"
        expected = "" if check.expected is None else f"{check.expected:.9g}"
        off = ["0" if text == "0.0e+00" else text for text in difference(check)]
        return cls(check.passed, check.name, check.reason, [measured, expected, *off])
