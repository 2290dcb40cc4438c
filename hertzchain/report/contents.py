"""Documents of runs, verdicts and examinations, and cards of objects."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.observables.result import Result
from hertzchain.report.document import (
    NO_DIGIT,
    Document,
    Failure,
    Finding,
    Overlay,
    Peaks,
    Table,
    Verdict,
    cost,
    describe,
    duration,
    facts_of_terms,
    failure_of,
    known_digits,
    number,
    shown_contacts,
    similar_scene,
    with_unit,
)
from hertzchain.report.files import run_document
from hertzchain.report.style import FORMULAS, GIVEN, LABELS
from hertzchain.scene.chain import MATERIAL, MEASURED, Chain
from hertzchain.scene.keys import keys_of
from hertzchain.scene.scene import Scene
from hertzchain.verdict.run_checks import FIRST_PULSES, PEAKS

if TYPE_CHECKING:
    from hertzchain.engines.native.batch import Batch
    from hertzchain.examiner.examined import DeckCheck, DeckExamination
    from hertzchain.verdict.comparison import Comparison
    from hertzchain.verdict.judgement import Judgement
    from hertzchain.verdict.results import TrainJudgement
    from hertzchain.verdict.traces import TraceJudgement


def of_result(result: Result, pulses: bool = False) -> Document:
    """Return the document of a run, which has no verdict; with all pulses on request."""
    return Document(
        kind="Run",
        numbers=lambda: run_document(result, pulses),
        command="run",
        results={result.backend: result},
        verdict=Verdict(None, ""),
        peaks=_peaks(result),
        facts=_facts(result),
        remarks=result.warnings,
        tables=[_pulses(result)] if pulses else [],
    )


def _peaks(result: Result) -> Peaks:
    """Return peaks with their known digits, and the other numbers of each contact."""
    static, first = result.static_force, result.first_pulses
    of_static = [] if static is None else [("static force", "[N]")]
    waits = ~result.peak_passed & result.is_reached
    of_first = [("first pulse", "[N]"), ("arrival", "[s]"), ("width", "[s]")]

    def row(k: int) -> list[str]:
        return [
            result.scene.contact_label(result.scene.contacts[k]),
            known_digits(result.peak_force[k], result.peak_errors[k]),
            *([] if static is None else [number(static[k], 7)]),
            number(result.peak_time[k], 6),
            *([] if first is None else _first_pulse(result, k)),
            "not peaked yet" if waits[k] else "",
        ]

    return Peaks(
        "Peak force of each contact",
        [
            ("contact", ""),
            ("peak force", "[N]"),
            *of_static,
            ("peak time", "[s]"),
            *([] if first is None else of_first),
            ("", ""),
        ],
        row,
        range(len(shown_contacts(result))),
    )


def _pulses(result: Result) -> Table:
    """Return all pulses with their known digits; a width is empty where it has no right one."""
    rows = [
        [
            train.gauge.place,
            number(pulse["time_s"], 6),
            known_digits(pulse["force_N"], pulse["force_error"]),
            number(pulse["arrival_time_s"], 6),
            number(pulse["width_s"], 6) if pulse["width_error_s"] < pulse["width_s"] else "",
        ]
        for train in result.trains
        for pulse in train.to_frame().to_dict("records")
    ]
    header = ("pulse of", "time [s]", "dynamic force [N]", "arrival [s]", "width [s]")
    return Table("Pulses", "All pulses, incident and reflected", header, rows)


def _facts(result: Result) -> list[tuple[str, str]]:
    """Return label and value of the facts of the whole run."""
    facts = [
        *main_facts(result),
        *_facts_of_collision(result),
        *_facts_of_wave(result),
        *_facts_of_gauges(result),
        ("error of the peaks, at most", f"{result.error_estimate:.1e}"),
        *_first_facts(result),
        ("largest overlap", f"{result.overlap_ratio:.2g} radii"),
        ("largest pressure", largest_pressure(result)),
        ("cost", cost(result)),
    ]
    if (similar := similar_scene(result)) is not None:
        facts.append(("computed as", similar))
    return facts


def largest_pressure(result: Result) -> str:
    """Return the largest pressure, where it is, and the strength below which a metal yields."""
    largest = result.largest_pressure
    if np.isnan(largest.pressure):
        return "not known: a measured stiffness does not tell it"
    if largest.time is None:
        return "0 Pa: no contact was pressed"
    return (
        f"{largest.pressure:.3g} Pa, {result.scene.contact_name(largest.contact)} at"
        f" {largest.time:.3g} s; metals of yield strength < {largest.needed_strength:.3g} Pa yield"
    )


def _first_pulse(result: Result, k: int) -> tuple[str, ...]:
    """Return force, arrival and width of the first pulse of a contact; empty where it has none."""
    columns = result.first_columns
    if np.isnan(columns["first_peak_force_N"][k]):
        return "", "", ""
    return (
        known_digits(columns["first_peak_force_N"][k], columns["first_peak_error"][k]),
        number(columns["arrival_time_s"][k], 6),
        number(columns["first_width_s"][k], 6),
    )


def _first_facts(result: Result) -> list[tuple[str, str]]:
    """Return the largest errors of first pulses; nothing if they were not wanted."""
    columns = result.first_columns
    if not columns or not np.isfinite(columns["first_peak_error"]).any():
        return []
    force, arrival = (np.nanmax(columns[key]) for key in ("first_peak_error", "arrival_error_s"))
    return [
        ("error of first pulses, at most", f"{force:.1e}"),
        ("error of arrivals, at most", with_unit(float(arrival), "s", 0.1)),
    ]


def _facts_of_collision(result: Result) -> list[tuple[str, str]]:
    """Return contact times with walls, and the momentum that came back; nothing without walls."""
    facts, columns, scene = [], result.first_columns, result.scene
    for section, k in ("near_wall", 0), ("wall", -1):
        if getattr(scene, section) is None or not columns:
            continue
        time, error = (columns[name][k] for name in ("contact_time_s", "contact_time_error_s"))
        if np.isfinite(time):
            name = section.replace("_", " ")
            facts.append((f"contact time with the {name}", with_unit(time, "s", error / time)))
    has_wall = scene.wall is not None or scene.near_wall is not None
    if has_wall and (restitution := result.restitution) is not None:
        parts = zip(("granule 1", "all granules"), restitution, strict=True)
        values = [f"{name} {value:.3g}" for name, value in parts if value is not None]
        facts += [("momentum back over momentum in", ", ".join(values))] if values else []
    return facts


def _facts_of_gauges(result: Result) -> list[tuple[str, str]]:
    """Return the first pulse of each gauge."""
    facts = []
    for read in result.gauges:
        said = "no first pulse that is known to its end"
        if np.isfinite(read.force):
            force = with_unit(read.force, "N", read.force_error)
            arrival = with_unit(read.arrival, "s", read.arrival_error / read.arrival)
            width = with_unit(read.width, "s", read.width_error / read.width)
            said = f"{force}, arrival {arrival}, width {width}"
            if np.isfinite(read.speed):
                speed = with_unit(read.speed, "m/s", read.speed_error)
                said += f", {speed} from the gauge before"
            elif read.speed_reason:
                said += f", {read.speed_reason}"
        facts.append((f"gauge, {read.gauge.key} {read.gauge.number}", said))
    return facts


def _facts_of_wave(result: Result) -> list[tuple[str, str]]:
    """Return speed, height and width of the wave by first pulses; nothing where there is none."""
    wave = result.usual_wave
    if wave is None:
        return []
    height = with_unit(wave.height, "N", wave.height_error)
    width = with_unit(wave.width, "s", wave.width_error)
    if np.isfinite(wave.width) and "unlike granules" not in result.scene.terms:
        width += f", {wave.width_granules:.3g} granules"
    return [
        (
            f"speed, contacts {wave.first} to {wave.last}",
            with_unit(wave.speed, "m/s", wave.speed_error),
        ),
        (f"height and width, contact {wave.last}", f"{height}, {width}"),
    ]


def main_facts(result: Result) -> list[tuple[str, str]]:
    """Return the main facts of a run besides peaks.

    They describe the wave in a uniform chain, otherwise the ends of the chain.
    """
    return _wave_facts(result) if result.scene.is_plain else facts_of_terms(result)


def _wave_facts(result: Result) -> list[tuple[str, str]]:
    """Return the facts of a plain scene: the transition and the wave after it."""
    wave, p, estimate = result.solitary_wave, result.transition_granules, result.error_estimate
    return [
        ("transition, p", "none ends here" if p is None else f"{p} granules"),
        ("solitary wave, F_SW", with_unit(wave.peak_force, "N", estimate)),
        ("far-field force", _settled(wave.far_field_force, "N", wave.far_field_error, estimate)),
        ("speed", _settled(wave.speed, "m/s", wave.speed_error, estimate)),
    ]


def _settled(value: float | None, unit: str, error: float | None, estimate: float) -> str:
    """Return words for a number of the wave, and its largest difference from the settled wave."""
    if error is None:
        return with_unit(value, unit, estimate)
    if value is None:
        return f"not reached: the wave may change by {error:.0%} in a longer chain"
    return f"{with_unit(value, unit, max(estimate, error))}, settled to {error:.1e}"


def of_comparison(comparison: Comparison) -> Document:
    """Return the document of a comparison."""
    formulas = comparison.formulas
    others = {name: result for name, result in comparison.results.items() if name != "native"}
    named = FORMULAS if comparison.scene.is_plain else ()  # formulas are only for plain scenes
    equations = {name: getattr(formulas, name) for name in named}
    drawn = {name: result.peak_force for name, result in others.items()}
    notes = [
        *(f"Formulas: {text}" for text in (formulas.applicable, formulas.note) if text),
        *(
            f"{LABELS[name]} computed {how}"
            for name, result in others.items()
            if (how := similar_scene(result)) is not None
        ),
    ]
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
        tables=[_answers(comparison, notes)],
        checks=comparison.checks,
        remarks=notes,
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


def _answers(comparison: Comparison, notes: Sequence[str]) -> Table:
    """Return the facts of each simulation side by side, and their cost, with notes on them."""
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
    said_of_all = (
        "The number of steps is of the run itself; time is of the whole call, with the runs that"
        " find its step and its error."
    )
    below = [" ".join([said_of_all, *(f"{note}." for note in notes)])]
    if comparison.scene.is_plain:
        below.append(
            "p: granules in the transition; F_SW: peak force of contact p + 1. The formulas are"
            " given p and F_SW of native."
        )
    return Table(
        "What each of them says of the chain as a whole",
        "What each of them says of the chain as a whole",
        ["", *(LABELS.get(name, name) for name in wanted)],
        [
            [label, *((facts | {"formulas": said}).get(name, {}).get(label, "") for name in wanted)]
            for label in facts["native"]
        ],
        below=below,
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
            judgement.verdict == "pass", sentence, why, [*judgement.remarks, *native.warnings]
        ),
        peaks=_judged_peaks(judgement),
        drawn={GIVEN: judgement.given},
        limits=[(GIVEN, "tolerance", tolerance)],
        facts=_facts_of_peaks(judgement, judged, failed.size),
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


def _facts_of_peaks(judgement: Judgement, judged: int, failed: int) -> list[tuple[str, str]]:
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
            f"{expected.interpolated:.1e} off; {expected.sampled:.1e} if only samples are compared"
        )
        facts.append((f"velocity Verlet, steps of {expected.dt:.3g} s", off))
    return facts


def given_peaks(
    native: Result,
    what: str,
    label: str,
    given: FloatArray,
    reference: FloatArray,
    words: Sequence[str],
) -> Peaks:
    """Return given peaks next to those of the reference, with a word on each contact."""

    def row(k: int) -> list[str]:
        is_known = np.isfinite(given[k]) and reference[k] > 0
        off = f"{given[k] / reference[k] - 1:+.1e}" if is_known else ""
        name = native.scene.contact_label(native.scene.contacts[k])
        return [name, number(given[k], 9), number(reference[k], 9), off, words[k]]

    failed = [k for k, word in enumerate(words) if word == "FAIL"]
    off = np.nan_to_num(given / np.where(reference > 0, reference, np.nan) - 1, nan=np.inf)
    most = 0.99 * max(np.abs(off[failed]), default=0.0)  # as two digits show it
    worst = [k for k in failed if abs(off[k]) >= most][:1]
    # Most failed contacts outside the transition on a terminal
    return Peaks(
        f"{what}, and by the reference method",
        [("contact", ""), (label, "[N]"), ("native", "[N]"), ("difference", ""), ("", "")],
        row,
        sorted({*range(len(shown_contacts(native))), *failed[:10], *worst}),
    )


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
    right, outcome = compared - 1 - len(to_correct), "passed" if peaks.passed else "failed"
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
            (
                "deck",
                f"{examination.deck}: units {deck.units}, the chain lies along {deck.axis}"
                + (", shocked at its upper end" if deck.reversed else ""),
            ),
            ("checks", f"{right} of {compared - 1} numbers passed; the peaks {outcome}"),
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
    # Relative change of peaks that is round-off (chosen)
    return "changes no peak" if check.effect < 1e-9 else f"changes peaks by {check.effect:.1e}"


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
    # A command that a loop repeats is named only at its last repetition.
    commands = {(line.file, line.line): line for line in examination.left_out}
    left = [  # an output that is not written changes nothing
        f"{line.file}:{line.line}: “{line.written.strip()}” was left out: {line.why_not}"
        for line in commands.values()
        if line.text.split()[0] != "print" and "write files" not in str(line.why_not)
    ]
    return [*examination.remarks, *left]


def _of_checked(
    judgement: TraceJudgement | TrainJudgement, kind: str, within: str, peaks: Peaks, **parts: Any
) -> Document:
    """Return the document of a judgement that rests on checks: ``within`` what all of them are."""
    checks, native = judgement.checks, judgement.reference
    failed = [check for check in checks if not check.passed]
    sentence = f"All {len(checks)} numbers are within {within}." if checks else _NOTHING
    if failed:
        off = f"{judgement.tolerance:.1e}"
        sentence = f"{len(failed)} of {len(checks)} numbers do not agree within {off}."
    said = [*parts.get("remarks", ()), *native.warnings]
    failures = [failure_of(check) for check in failed]
    return Document(
        kind=kind,
        numbers=judgement.to_dict,
        command="judge",
        results={"native": native},
        verdict=Verdict(judgement.verdict == "pass", sentence, failures, said),
        peaks=peaks,
        checks=checks,
        **parts,
    )


_NOTHING = "Nothing could be judged."


def of_traces(judgement: TraceJudgement) -> Document:
    """Return the document of a judgement of measured forces over time."""
    within = f"{judgement.tolerance:.1e} and their noise"
    return _of_checked(
        judgement,
        "Judgement of measured traces",
        within,
        _pulses_of_traces(judgement),
        overlays=_overlays(judgement),
        facts=[
            ("the run begins at", f"{judgement.shift:.6g} s of the measured clock"),
            ("the reference is known until", f"{judgement.expected.until:.3g} s of the run"),
            ("tolerance", f"{judgement.tolerance:.1e}, and the noise"),
        ],
        remarks=judgement.remarks,
    )


def _overlays(judgement: TraceJudgement) -> list[Overlay]:
    """Return the traces with the reference, while it is known."""
    expected, traces = judgement.expected, judgement.traces
    time = traces.time - judgement.shift
    during = (time >= 0) & (time <= expected.until)
    return [
        Overlay(
            gauge.place, time[during], traces.force[during, k],
            expected.at(k, time[during]),
        )
        for k, gauge in enumerate(traces.gauges)
    ]  # fmt: skip


def _pulses_of_traces(judgement: TraceJudgement) -> Peaks:
    """Return the first pulse of each gauge next to that of the reference."""
    readings, noise = judgement.expected.readings, judgement.traces.noise
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
    forces = [check for check in judgement.checks if check.kind.name.startswith("force")]

    def row(k: int) -> list[str]:
        check = forces[k]
        place = f"{check.engine}, {check.kind.name.removeprefix('force of ').removesuffix(' [N]')}"
        if check.measured is None or check.expected is None:
            return [place, "", "", ""]
        off = f"{check.measured / check.expected - 1:+.1e}"
        return [place, number(check.measured, 6), number(check.expected, 6), off]

    peaks = Peaks(
        "Dynamic force of each pulse [N]: as measured, and by the reference method",
        [("pulse", ""), ("measured", "[N]"), ("native", "[N]"), ("difference", "")],
        row,
        range(len(forces)),
        of_contacts=False,
    )
    within = f"{judgement.tolerance:.1e}"
    facts = [("tolerance", within)]
    return _of_checked(judgement, "Judgement of measured pulses", within, peaks, facts=facts)


_MOST_VALUE_CHARS = 160  # characters of a value; sentences may be longer


def card(title: str, facts: Sequence[tuple[str, str]]) -> str:
    """Return a title, and a line with label and value for each fact."""
    width = max((len(label) for label, _ in facts), default=0)
    indent = " " * (width + 4)

    def shown(label: str, value: str) -> str:
        if label == "remark":  # a sentence is not shortened
            return f"\n{indent}".join(textwrap.wrap(value, _MOST_VALUE_CHARS))
        return textwrap.shorten(value, _MOST_VALUE_CHARS, placeholder=" ...")

    lines = (f"  {label:<{width}}  {shown(label, value)}" for label, value in facts)
    return "\n".join([title, *lines])


def card_of(shown: Any) -> str:
    """A scene or a batch in a few lines."""
    return _of_scene(shown) if isinstance(shown, Scene) else _of_batch(shown)


def document_of(shown: object) -> Document:
    """The document of a result, a comparison, a judgement or an examination of a deck."""
    if isinstance(shown, Result):
        return of_result(shown)
    makers: Mapping[str, Callable[[Any], Document]] = {
        "Comparison": of_comparison,
        "Judgement": of_judgement,
        "DeckExamination": of_examination,
        "TraceJudgement": of_traces,
        "TrainJudgement": of_trains,
    }
    return makers[type(shown).__name__](shown)


# Cards


def _of_scene(scene: Scene) -> str:
    chain, units = scene.chain, scene.units
    facts = [("granules", f"{chain.granules:,}")]
    given = [key for key in (*MATERIAL, *MEASURED) if getattr(chain, key) is not None]
    facts += [(key, _range(getattr(chain, key), keys_of(Chain)[key].unit)) for key in given]
    facts += [
        ("terms", ", ".join(scene.terms) or "none: like granules, free ends, one pulse"),
        ("largest applied force", f"{scene.peak_force:.6g} N"),
        ("LM_ratio", f"{scene.momentum_ratio:.6g}"),
        ("end of the shock", f"{scene.pulse_end:.6g} s"),
        ("end of the run", f"{scene.end_time:.6g} s"),
        ("natural units", f"{units.force:.4g} N, {units.length:.4g} m, {units.time:.4g} s"),
    ]
    return card(f"Scene: {describe(scene)}", facts)


def _range(values: float | tuple[float, ...], unit: str) -> str:
    """A number with its unit, or the smallest and the largest of several."""
    ends = (min(values), max(values)) if isinstance(values, tuple) else (values,)
    return f"{' to '.join(f'{value:.6g}' for value in ends)} {unit}".rstrip()


def _of_batch(batch: Batch) -> str:
    scenes, contacts = batch.peak_force.shape
    unpassed = int(np.count_nonzero(~batch.peak_passed))
    largest = np.max(batch.peak_force, axis=1)
    facts = [
        ("scenes", f"{scenes:,}, of {contacts + 1:,} granules each"),
        ("largest peaks", f"{np.min(largest):.7g} to {np.max(largest):.7g} (N, or F0)"),
        ("errors, at most", f"{np.max(batch.error_estimate):.1e}"),
        ("force evaluations", f"{int(np.sum(batch.force_evaluations)):,}"),
    ]
    if unpassed:
        facts.append(("not peaked yet", f"{unpassed:,} contacts where the run ended"))
    return card("Batch: peaks of many scenes", facts)
