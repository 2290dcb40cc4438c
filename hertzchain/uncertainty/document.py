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


def of_validation(validation: Any) -> Document:
    """Return the document of a validation, for terminal, page, picture and JUnit."""
    compared, differing, tested = validation.compared, validation.differing, validation.tested
    if len(differing):
        sentence = f"{len(differing)} of {len(compared)} numbers differ by more than 2 u_val."
    elif len(tested):
        most = compared["error_over_u"].max()
        sentence = (
            f"All {len(compared)} numbers agree within {most:.2g} u_val; of {len(tested)} of them a"
            f" difference of {validation.tolerance:.2g} would have been seen."
        )
    else:
        least = compared["seen_from"].min() if len(compared) else float("inf")
        sentence = (
            f"Nothing could have failed: differences are seen from {least:.1%} on, the tolerance is"
            f" {validation.tolerance:.1%}."
        )
    traces = of_traces(validation.judgement)
    return replace(
        traces,
        kind="Validation by measured traces",
        numbers=validation.to_dict,
        checks=(),
        verdict=Verdict(
            None if validation.verdict == "undecided" else validation.verdict == "pass",
            sentence,
            [
                Failure(row.name, f"differs by {row.error_over_u:.2g} u_val", "")
                for row in differing.itertuples(index=False)
            ],
            [*validation.remarks, *validation.judgement.reference.warnings],
        ),
        answers=Table(
            "Comparison errors and uncertainties", _HEADER, [*map(_row, compared.itertuples())]
        ),
        remarks=(sentence.removesuffix("."), *validation.remarks),
        facts=[
            ("the run begins at", f"{validation.judgement.shift:.6g} s of the measured clock"),
            ("realisations", f"{len(validation.spread.values):,}"),
            ("uncertain", ", ".join(entry.name for entry in validation.spread.scene.uncertain)),
        ],
    )  # fmt: skip


def _row(row: Any) -> list[str]:
    parts = row.u_numerical, row.u_input, row.u_measured
    return [
        row.name, number(row.simulated, 5), number(row.measured, 5),
        *(f"{part / abs(row.simulated):.1e}" for part in parts),
        f"{row.error_over_u:.2g}", f"{row.seen_from:.1%}", row.largest,
    ]  # fmt: skip
