"""The document of a validation: that of its traces, with the three uncertainties of each number.

``Validation`` shows itself by this document, which therefore does not import it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from hertzchain.report.document import Document, Failure, Table, Verdict, number
from hertzchain.report.verdicts import of_traces

_HEADER = (
    "number", "simulated", "measured", "u run", "u input", "u noise", "error / u_val", "seen from",
    "lower first",
)  # fmt: skip


def of_validation(found: Any) -> Document:
    """Return the document of a validation, for terminal, page, picture and JUnit."""
    compared, differing, tested = found.compared, found.differing, found.tested
    if differing:
        sentence = f"{len(differing)} of {len(compared)} numbers differ by more than 2 u_val."
    elif tested:
        most = max(one.ratio for one in compared)
        sentence = (
            f"All {len(compared)} numbers agree within {most:.2g} u_val; of {len(tested)} of them a"
            f" difference of {found.tolerance:.2g} would have been seen."
        )
    else:
        least = min((one.seen_from for one in compared), default=float("inf"))
        sentence = (
            f"Nothing could have failed: differences are seen from {least:.1%} on, the tolerance is"
            f" {found.tolerance:.1%}."
        )
    traces = of_traces(found.judgement)
    return replace(
        traces,
        kind="Validation by measured traces",
        numbers=found.to_dict,
        checks=(),
        verdict=Verdict(
            None if found.verdict == "undecided" else found.verdict == "pass",
            sentence,
            [
                Failure(one.number.name, f"differs by {one.ratio:.2g} u_val", "")
                for one in differing
            ],
            [*found.remarks, *found.judgement.reference.warnings],
        ),
        answers=Table("Comparison errors and uncertainties", _HEADER, [_row(x) for x in compared]),
        remarks=(sentence.removesuffix("."), *found.remarks),
        facts=[
            ("the run begins at", f"{found.judgement.shift:.6g} s of the measured clock"),
            ("realisations", f"{len(found.spread.values):,}"),
            ("uncertain", ", ".join(one.name for one in found.spread.scene.uncertain)),
        ],
    )  # fmt: skip


def _row(one: Any) -> list[str]:
    simulated = one.number.simulated
    return [
        one.number.name, number(simulated, 5), number(one.number.measured, 5),
        *(f"{part / abs(simulated):.1e}" for part in one.parts.values()),
        f"{one.ratio:.2g}", f"{one.seen_from:.1%}", one.largest,
    ]  # fmt: skip
