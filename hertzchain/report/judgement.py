"""The document of a judgement of given peaks."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hertzchain.report.document import Document, Failure, Peaks, Verdict
from hertzchain.report.facts import given_peaks
from hertzchain.report.style import GIVEN

if TYPE_CHECKING:
    from hertzchain.verdict.judgement import Judgement


def of_judgement(judgement: Judgement) -> Document:
    """Return the document of a judgement of given peaks."""
    native, tolerance = judgement.reference, judgement.tolerance
    failed = np.flatnonzero(judgement.judged & ~judgement.passed)
    judged = int(np.count_nonzero(judgement.judged))
    cause, hint = judgement.cause, judgement.hint
    why = [Failure("Likely cause", "", cause)] if cause else []
    why += [Failure("Hint", "", hint)] if hint else []
    said = [text for text in (cause and f"Likely cause: {cause}", hint) if text]
    if judged == 0:
        sentence = "No contact could be judged."
    elif not failed.size:
        sentence = f"All {judged} judged contacts are within {tolerance:.1e} of the reference."
    else:
        sentence = (
            f"{failed.size} of {judged} judged contacts are off by more than {tolerance:.1e}."
        )
    return Document(
        kind="Judgement of given peaks",
        numbers=judgement.to_dict,
        command="judge",
        results={"native": native},
        verdict=Verdict(
            judgement.verdict == "pass",
            sentence,
            why,
            [*judgement.remarks, *native.warnings],
        ),
        peaks=_peaks(judgement),
        drawn={GIVEN: judgement.given},
        limits=[(GIVEN, "tolerance", tolerance)],
        facts=_facts(judgement, judged, failed.size),
        remarks=[*said, *judgement.remarks],
    )


def _peaks(judgement: Judgement) -> Peaks:
    rows, known = judgement.rows, {True: "pass", False: "FAIL", None: "not judged"}
    words = ["not given" if row["given_N"] is None else known[row["passed"]] for row in rows]  # type: ignore[index]
    given, reference = (
        np.array([row[key] for row in rows], np.float64) for key in ("given_N", "reference_N")
    )
    what = "First pulse" if judgement.of_first_pulses else "Peak force"
    what = f"{what} of each contact [N]: as given"
    return given_peaks(judgement.reference, what, "given", given, reference, words)


def _facts(judgement: Judgement, judged: int, failed: int) -> list[tuple[str, str]]:
    """Return label and value of facts on all contacts together."""
    reference, missing = judgement.reference, judgement.missing
    rare = judgement.sampled_too_rarely
    weak = reference.contact.size - missing - judged - rare
    counts = [f"{judged} judged", f"{failed} failed", f"{missing} not given"]
    if weak:
        counts.append(f"{weak} below a thousandth of the largest, not judged")
    if rare:
        counts.append(f"{rare} sampled too rarely, not judged")
    largest = judgement.largest_difference
    facts = [
        ("contacts", ", ".join(counts)),
        ("largest difference", "" if largest is None else f"{largest:.1e}"),
        *([("compared with", judgement.compared_with)] if reference.first_pulses else []),
        ("tolerance", f"{judgement.tolerance:.1e}"),
        ("error of native, at most", f"{reference.wanted_error:.1e}"),
    ]
    if judgement.sampling_error is not None:
        said = f"{judgement.sampling_error:.1e}, which adds to the tolerance"
        facts.append(("error of sampling, at most", said))
    if judgement.expected is not None:
        expected = judgement.expected
        off = (
            f"{expected.interpolated:.1e} off; {expected.sampled:.1e} if only samples are looked at"
        )
        facts.append((f"velocity Verlet, steps of {expected.dt:.3g} s", off))
    return facts
