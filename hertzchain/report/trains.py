"""The document of a judgement of measured trains."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hertzchain.report.document import Document, Peaks, Verdict, failure_of, number

if TYPE_CHECKING:
    from hertzchain.verdict.trains import TrainJudgement


def of_trains(judgement: TrainJudgement) -> Document:
    """Return the document of a judgement of measured pulses."""
    checks, tolerance = judgement.checks, judgement.tolerance
    failed = [check for check in checks if not check.passed]
    sentence = f"All {len(checks)} numbers are within {tolerance:.1e}."
    if failed:
        sentence = f"{len(failed)} of {len(checks)} numbers do not agree within {tolerance:.1e}."
    forces = [check for check in checks if check.kind.name.startswith("force")]

    def row(k: int) -> list[str]:
        check = forces[k]
        place = f"{check.engine}, {check.kind.name.removeprefix('force of ').removesuffix(' [N]')}"
        if check.measured is None or check.expected is None:
            return [place, "", "", ""]
        off = f"{check.measured / check.expected - 1:+.1e}"
        return [place, number(check.measured, 6), number(check.expected, 6), off]

    return Document(
        kind="Judgement of measured pulses",
        numbers=judgement.to_dict,
        command="judge",
        results={"native": judgement.reference},
        verdict=Verdict(
            not failed, sentence, [failure_of(check) for check in failed],
            judgement.reference.warnings,
        ),
        peaks=Peaks(
            "Dynamic force of each pulse [N]: as measured, and by the reference method",
            [("pulse", ""), ("measured", "[N]"), ("native", "[N]"), ("difference", "")],
            row,
            range(len(forces)),
            of_contacts=False,
        ),
        drawn={},
        limits=[],
        checks=checks,
        facts=[("tolerance", f"{tolerance:.1e}")],
    )  # fmt: skip
