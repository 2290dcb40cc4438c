"""The document of an examination of a user's deck."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from hertzchain.report.document import Document, Failure, Finding, Peaks, Verdict
from hertzchain.report.facts import given_peaks
from hertzchain.report.style import LABELS

if TYPE_CHECKING:
    from hertzchain.engines.lammps.reading.found import Executed
    from hertzchain.examiner.case import DeckCheck
    from hertzchain.examiner.examined import DeckExamination

_NO_CHANGE = 1e-9  # relative change of peaks that is round-off (chosen)


def of_examination(examination: DeckExamination) -> Document:
    """Return the document of an examination of a user's deck."""
    native, tolerance, found = examination.reference, examination.tolerance, examination.found
    to_correct, small = examination.to_correct, examination.small
    compared = len(examination.checks)
    if examination.passed:
        sentence = f"The deck is the scene: all {compared} checks passed."
    elif to_correct:
        count = "One thing is" if len(to_correct) == 1 else f"{len(to_correct)} things are"
        sentence = f"{count} to correct in the deck."
    else:
        sentence = (
            "No number of the deck alone is to blame, but its peaks are off: small differences add"
            " up."
        )
    peaks = examination.checks[-1]
    off = _share(peaks.effect)
    if peaks.effect is None:
        sentence += " None of its peaks can be judged."
    else:
        sentence += f" Its peaks are off by {off} at most, {tolerance:g} is allowed."
    dt = max((run.dt for run in found.runs), default=0.0)
    return Document(
        kind="Examination of a deck",
        numbers=examination.to_dict,
        command="examine",
        results={"native": native},
        verdict=Verdict(
            examination.passed,
            sentence,
            [*(Failure(one.name, _with_effect(one), _advice(one)) for one in to_correct),
             *([] if peaks.passed else [Failure(peaks.name, peaks.sentence, _advice(peaks))])],
            [*examination.remarks, *native.warnings],
        ),
        peaks=_peaks(examination),
        drawn={"lammps": examination.peak_force},
        limits=[("lammps", "tolerance", tolerance)],
        facts=[
            ("deck", _about(examination)),
            ("checks", f"{sum(one.passed for one in examination.checks)} of {compared} passed"),
            ("largest difference of the peaks", off),
            ("largest time step", f"{dt:.4g} s"),
            ("LAMMPS", found.version),
        ],
        remarks=_remarks(examination),
        findings=[
            *_findings(examination),
            *([Finding([peaks.sentence], False, "", "")] if found.stopped else []),
            *(_small(one) for one in small),
        ],
    )  # fmt: skip


def _about(examination: DeckExamination) -> str:
    """Return words for units and axis of a deck."""
    found = examination.found
    end = ", shocked at its upper end" if found.reversed else ""
    return f"{examination.deck}: units {found.units}, the chain lies along {found.axis}{end}"


def _share(effect: float | None) -> str:
    """Return words for a relative change of peaks."""
    if effect is None:
        return "not known"
    return f"{effect:.1e}" if math.isfinite(effect) else "infinitely much"


def _advice(check: DeckCheck) -> str:
    """Return advice on a check that failed."""
    if check.place is None:
        return "correct what is above it"
    if not check.command:
        return f"{check.place}: {check.place.written}"
    return f"{check.place}, instead of “{check.place.written}”: {check.command}"


def _effect(check: DeckCheck) -> str:
    """Effect of a check's difference on the peaks, in words; empty where it is not known."""
    if check.effect is None:
        return ""
    if not math.isfinite(check.effect):
        return "no bound of its effect on the peaks"
    return (
        "changes no peak" if check.effect < _NO_CHANGE else f"changes peaks by {check.effect:.1e}"
    )


def _with_effect(check: DeckCheck) -> str:
    """The difference and its effect on the peaks, which sets the order, in words."""
    return f"{check.sentence} ({_effect(check)})" if _effect(check) else check.sentence


def _findings(examination: DeckExamination) -> list[Finding]:
    """Return the findings line by line, with proven corrections."""
    found = []
    for one in examination.findings:
        place, note = one.checks[0].place, ""
        if one.follows is not None:
            note = f"this follows from {one.follows + 1}"
        elif one.with_others:
            note = "correct only together with the other corrections"
        found.append(
            Finding(
                [_with_effect(check) for check in one.checks],
                False,
                "" if place is None else str(place),
                "" if place is None else place.written,
                [(f"{line.file}:{line.line}", line.written, line.commands)
                 for line in one.correction],
                note,
            )
        )  # fmt: skip
    return found


def _small(check: DeckCheck) -> Finding:
    place = check.place
    where, written = ("", "") if place is None else (str(place), place.written)
    return Finding([_with_effect(check)], True, where, written)


def _peaks(examination: DeckExamination) -> Peaks:
    native, given = examination.reference, examination.peak_force
    judged = examination.judged & np.isfinite(given)
    pressed = np.where(native.peak_force > 0, native.peak_force, np.nan)
    passed = np.abs(given / pressed - 1) <= examination.tolerance
    words = np.where(judged, np.where(passed, "pass", "FAIL"), "not judged").tolist()
    what = "Peak force of each contact [N]: of the deck"
    return given_peaks(native, what, LABELS["lammps"], given, native.peak_force, words)


def _remarks(examination: DeckExamination) -> list[str]:
    """Return sentences on parts not examined, and on commands left out."""
    left = [  # an output that is not written changes nothing
        f"{one.file}:{one.line}: “{one.written.strip()}” was left out: {one.why_not}"
        for one in _once(examination.left_out)
        if one.text.split()[0] != "print" and "write files" not in str(one.why_not)
    ]
    return [*examination.remarks, *left]


def _once(commands: Sequence[Executed]) -> list[Executed]:
    """Return commands without the repetitions of a loop."""
    return list({(one.file, one.line): one for one in commands}.values())
