"""The document of a comparison."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.report.document import Document, Peaks, Table, Verdict
from hertzchain.report.facts import (
    NO_DIGIT,
    duration,
    failure_of,
    number,
    shown_contacts,
    similar_scene,
)
from hertzchain.report.run import main_facts
from hertzchain.report.style import FORMULAS, LABELS
from hertzchain.verdict.reference_checks import FIRST_PULSES, PEAKS

if TYPE_CHECKING:
    from hertzchain.verdict.comparison import Comparison


def of_comparison(comparison: Comparison) -> Document:
    """Return the document of a comparison."""
    formulas = comparison.formulas
    others = {name: found for name, found in comparison.results.items() if name != "native"}
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
        peaks=_peaks(comparison, drawn, equations),
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


def _peaks(
    comparison: Comparison, found: Mapping[str, FloatArray], equations: Mapping[str, FloatArray]
) -> Peaks:
    """Return peaks with nine digits for simulations, six for formulas, and their differences."""
    native = comparison.native
    nothing = np.full(native.contact.size, np.nan)
    codes = {name: found.get(name, nothing) for name in comparison.wanted if name != "native"}
    columns = {**codes, **equations}
    labels = [LABELS[name] for name in columns]

    errors = {name: comparison.results[name].peak_errors for name in ("native", *found)}

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
            or max(errors[one][k] for one in ("native", name) if one in errors) >= 1
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
    known = {
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
            [label, *((known | {"formulas": said}).get(name, {}).get(label, "") for name in wanted)]
            for label in known["native"]
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
