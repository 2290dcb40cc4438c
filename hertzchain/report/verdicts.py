"""Documents of verdicts: comparisons, judgements, examinations of decks."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.report.document import (
    NO_DIGIT,
    Document,
    Failure,
    Finding,
    Overlay,
    Peaks,
    Table,
    Verdict,
    duration,
    failure_of,
    given_peaks,
    number,
    shown_contacts,
    similar_scene,
)
from hertzchain.report.run import main_facts
from hertzchain.report.style import FORMULAS, GIVEN, LABELS
from hertzchain.verdict.run_checks import FIRST_PULSES, PEAKS

if TYPE_CHECKING:
    from hertzchain.engines.lammps.reading.deck import Executed
    from hertzchain.examiner.examined import DeckCheck, DeckExamination
    from hertzchain.verdict.comparison import Comparison
    from hertzchain.verdict.judgement import Judgement
    from hertzchain.verdict.results import TrainJudgement
    from hertzchain.verdict.traces import TraceJudgement


def of_comparison(comparison: Comparison) -> Document:
    """Return the document of a comparison."""
    formulas = comparison.formulas
    others = {name: result for name, result in comparison.results.items() if name != "native"}
    named = FORMULAS if comparison.scene.is_plain else ()  # formulas are only for plain scenes
    equations = {name: getattr(formulas, name) for name in named}
    drawn = {name: result.peak_force for name, result in others.items()}
    of_formulas = [f"Formulas: {text}" for text in (formulas.applicable, formulas.note) if text]
    similar = (
        f"{LABELS[name]} computed {how}"
        for name, result in others.items()
        if (how := similar_scene(result)) is not None
    )
    return Document(
        kind="Comparison",
        numbers=comparison.to_dict,
        command="compare",
        results=comparison.results,
        verdict=_verdict(comparison),
        peaks=_compared_peaks(comparison, drawn, equations),
        drawn=drawn | (equations if formulas.applicable is None else {}),
        limits=[
            (name, f"{LABELS[name]}, error estimate", result.error_estimate)
            for name, result in others.items()
        ],
        absent=[LABELS[name] for name in comparison.wanted if name not in comparison.results],
        answers=_answers(comparison),
        checks=comparison.checks,
        notes=[*of_formulas, *similar],
    )


def _compared_peaks(
    comparison: Comparison, peaks: Mapping[str, FloatArray], equations: Mapping[str, FloatArray]
) -> Peaks:
    """Return peaks with nine digits for simulations, six for formulas, and their differences."""
    native = comparison.native
    nothing = np.full(native.contact.size, np.nan)
    codes = {name: peaks.get(name, nothing) for name in comparison.wanted if name != "native"}
    columns = {**codes, **equations}
    labels = [LABELS[name] for name in columns]

    errors = {name: comparison.results[name].peak_errors for name in ("native", *peaks)}

    def row(k: int) -> list[str]:
        peak = native.peak_force[k]
        values = [
            _of_run(column[k], errors[name][k]) if name in errors else number(column[k], 6)
            for name, column in columns.items()
        ]
        differences = [
            ""
            if not peak > 0
            or np.isnan(column[k])
            or max(errors[code][k] for code in ("native", name) if code in errors) >= 1
            else f"{column[k] / peak - 1:{'+.1e' if name in codes else '+.2%'}}"
            for name, column in columns.items()
        ]
        of_native = _of_run(peak, errors["native"][k])
        label = native.scene.contact_label(native.scene.contacts[k])
        return [label, of_native, *values, *differences]

    return Peaks(
        "Peak force of each contact [N]; then its difference from native",
        [
            *(("contact", ""), ("native", "[N]")),
            *((label, "[N]") for label in labels),
            *((label, "− native") for label in labels),  # noqa: RUF001 - a minus sign
        ],
        row,
        range(len(shown_contacts(native))),
    )


def _answers(comparison: Comparison) -> Table:
    """Return the facts of each simulation side by side, and their cost."""
    facts = {
        name: {
            **dict(main_facts(result)),
            "error, at most": f"{result.wanted_error:.1e}",
            "method": result.method,
            "steps": f"{result.steps:,}",
            "time": duration(result.wall_time),
        }
        for name, result in comparison.results.items()
    }
    formulas = comparison.formulas
    said = {}
    if formulas.transition_granules is not None:
        said["transition, p"] = f"{formulas.transition_granules:.2f}"
    if formulas.speed:
        said["speed"] = f"{formulas.speed:.2f}, exact {formulas.exact_speed:.2f} at F_SW"
    wanted = [*comparison.wanted, "formulas"] if comparison.scene.is_plain else comparison.wanted
    return Table(
        "What each of them says of the chain as a whole",
        ["", *(LABELS.get(name, name) for name in wanted)],
        [
            [label, *((facts | {"formulas": said}).get(name, {}).get(label, "") for name in wanted)]
            for label in facts["native"]
        ],
    )


def _of_run(peak: float, error: float) -> str:
    """Return a peak with nine digits, for its differences; words if no digit is right."""
    return NO_DIGIT if error >= 1 else number(peak, 9)


def _verdict(comparison: Comparison) -> Verdict:
    checks, results = comparison.checks, comparison.results
    failed = [check for check in checks if not check.passed]
    ran = [name for name in comparison.wanted if name in results and name != "native"]
    sentence = f"{len(failed)} of {len(checks)} checks failed."
    if not failed and ran:
        kind = PEAKS if comparison.native.first_pulses is None else FIRST_PULSES
        off = max((check.measured or 0.0 for check in checks if check.kind == kind), default=0.0)
        who = " and ".join(LABELS[name] for name in ran)
        what = "Peaks" if kind == PEAKS else "First pulses"
        sentence = (
            f"All {len(checks)} checks passed. {what} by {who} differ from those of native by"
            f" {off:.1e} at most, within the errors that both claim."
        )
    elif not failed:
        sentence = f"All {len(checks)} checks of native passed; no other simulation was compared."
    remarks = [
        *(f"{LABELS[name]}: {text}" for name in results for text in results[name].warnings),
        *(f"{check.name}: {check.remark}" for check in checks if check.remark),
    ]
    failures = [failure_of(check) for check in failed]
    return Verdict(not failed, sentence, failures, remarks)


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
        peaks=_judged_peaks(judgement),
        drawn={GIVEN: judgement.given},
        limits=[(GIVEN, "tolerance", tolerance)],
        facts=_facts(judgement, judged, failed.size),
        remarks=[*said, *judgement.remarks],
    )


def _judged_peaks(judgement: Judgement) -> Peaks:
    rows, verdicts = judgement.rows, {True: "pass", False: "FAIL", None: "not judged"}
    words = ["not given" if row["given_N"] is None else verdicts[row["passed"]] for row in rows]  # type: ignore[index]
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


_ROUND_OFF = 1e-9  # relative change of peaks that is round-off (chosen)


def of_examination(examination: DeckExamination) -> Document:
    """Return the document of an examination of a user's deck."""
    native, tolerance, deck = examination.reference, examination.tolerance, examination.contents
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
    dt = max((run.dt for run in deck.runs), default=0.0)
    return Document(
        kind="Examination of a deck",
        numbers=examination.to_dict,
        command="examine",
        results={"native": native},
        verdict=Verdict(
            examination.passed,
            sentence,
            [*(Failure(check.name, _with_effect(check), _advice(check)) for check in to_correct),
             *([] if peaks.passed else [Failure(peaks.name, peaks.sentence, _advice(peaks))])],
            [*examination.remarks, *native.warnings],
        ),
        peaks=_examined_peaks(examination),
        drawn={"lammps": examination.peak_force},
        limits=[("lammps", "tolerance", tolerance)],
        facts=[
            ("deck", _about(examination)),
            ("checks", f"{sum(check.passed for check in examination.checks)} of {compared} passed"),
            ("largest difference of the peaks", off),
            ("largest time step", f"{dt:.4g} s"),
            ("LAMMPS", deck.version),
        ],
        remarks=_remarks(examination),
        findings=[
            *_findings(examination),
            *([Finding([peaks.sentence], False)] if deck.stopped else []),
            *(_finding([check], passed=True) for check in small),
        ],
    )  # fmt: skip


def _about(examination: DeckExamination) -> str:
    """Return words for units and axis of a deck."""
    deck = examination.contents
    end = ", shocked at its upper end" if deck.reversed else ""
    return f"{examination.deck}: units {deck.units}, the chain lies along {deck.axis}{end}"


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
        "changes no peak" if check.effect < _ROUND_OFF else f"changes peaks by {check.effect:.1e}"
    )


def _with_effect(check: DeckCheck) -> str:
    """The difference and its effect on the peaks, which sets the order, in words."""
    return f"{check.sentence} ({_effect(check)})" if _effect(check) else check.sentence


def _findings(examination: DeckExamination) -> list[Finding]:
    """Return the findings line by line, with proven corrections."""
    findings = []
    for finding in examination.findings:
        note = ""
        if finding.follows is not None:
            note = f"this follows from {finding.follows + 1}"
        elif finding.with_others:
            note = "correct only together with the other corrections"
        right = [
            (f"{line.file}:{line.line}", line.written, line.commands) for line in finding.correction
        ]
        findings.append(replace(_finding(finding.checks, passed=False), right=right, note=note))
    return findings


def _finding(checks: Sequence[DeckCheck], *, passed: bool) -> Finding:
    place = checks[0].place
    where, written = ("", "") if place is None else (str(place), place.written)
    return Finding([_with_effect(check) for check in checks], passed, where, written)


def _examined_peaks(examination: DeckExamination) -> Peaks:
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
        f"{line.file}:{line.line}: “{line.written.strip()}” was left out: {line.why_not}"
        for line in _once(examination.left_out)
        if line.text.split()[0] != "print" and "write files" not in str(line.why_not)
    ]
    return [*examination.remarks, *left]


def _once(commands: Sequence[Executed]) -> list[Executed]:
    """Return commands without the repetitions of a loop."""
    return list({(command.file, command.line): command for command in commands}.values())


def of_traces(judgement: TraceJudgement) -> Document:
    """Return the document of a judgement of measured forces over time."""
    checks, tolerance = judgement.checks, judgement.tolerance
    failed = [check for check in checks if not check.passed]
    if not checks:
        sentence = "Nothing could be judged."
    elif failed:
        sentence = f"{len(failed)} of {len(checks)} numbers are off by more than {tolerance:.1e}."
    else:
        sentence = f"All {len(checks)} numbers are within {tolerance:.1e} and their noise."
    return Document(
        kind="Judgement of measured traces",
        numbers=judgement.to_dict,
        command="judge",
        results={"native": judgement.reference},
        verdict=Verdict(
            judgement.verdict == "pass",
            sentence,
            [failure_of(check) for check in failed],
            [*judgement.remarks, *judgement.reference.warnings],
        ),
        peaks=_pulses(judgement),
        drawn={},
        limits=[],
        checks=checks,
        overlays=_overlays(judgement),
        facts=[
            ("the run begins at", f"{judgement.shift:.6g} s of the measured clock"),
            ("the reference is known until", f"{judgement.known.until:.3g} s of the run"),
            ("tolerance", f"{tolerance:.1e}, and the noise"),
        ],
        remarks=judgement.remarks,
    )  # fmt: skip


def _overlays(judgement: TraceJudgement) -> list[Overlay]:
    """Return the traces with the reference, while it is known."""
    expected, traces = judgement.known, judgement.traces
    time = traces.time - judgement.shift
    during = (time >= 0) & (time <= expected.until)
    return [
        Overlay(
            gauge.place, time[during], traces.force[during, k],
            expected.at(k, time[during]),
        )
        for k, gauge in enumerate(traces.gauges)
    ]  # fmt: skip


def _pulses(judgement: TraceJudgement) -> Peaks:
    """Return the first pulse of each gauge next to that of the reference."""
    readings, noise = judgement.known.readings, judgement.traces.noise
    numbers = {(value.of, value.kind.name.split()[0]): value for value in judgement.numbers}

    def row(k: int) -> list[str]:
        read, of = readings[k], readings[k].gauge.place
        scatter = f"{noise[k] / read.force:.1e}" if read.force > 0 else ""
        if (of, "first") not in numbers:
            return [of, "", "", "", "", scatter]
        height, width = numbers[of, "first"], numbers[of, "width"]
        off = (f"{value.measured / value.simulated - 1:+.1e}" for value in (height, width))
        return [of, number(height.measured, 6), number(height.simulated, 6), *off, scatter]

    return Peaks(
        "First pulse of each gauge [N]: as measured, and by the reference method",
        [
            ("gauge", ""), ("measured", "[N]"), ("native", "[N]"), ("height", ""), ("width", ""),
            ("noise", ""),
        ],
        row,
        range(len(readings)),
        of_contacts=False,
    )  # fmt: skip


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
