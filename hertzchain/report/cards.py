"""What objects show of themselves: cards, texts as the commands print them, and figures."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from hertzchain.observables.result import Result
from hertzchain.report.card import MOST_FACTS, Card, first_of
from hertzchain.report.document import Document
from hertzchain.report.facts import cost, describe, number
from hertzchain.report.style import LABELS
from hertzchain.scene.chain import MATERIAL, Chain
from hertzchain.scene.keys import keys_of
from hertzchain.scene.scene import Scene

if TYPE_CHECKING:
    from hertzchain.engines.native import Batch
    from hertzchain.report.picture import Picture

_MOST_ROWS = 12  # of peaks in a notebook (chosen); the rest is in the table of the object


def card_of(shown: object) -> Card:
    """The card of a scene, result, batch, comparison, judgement or examination of a deck."""
    known = (_CARDS[each.__name__] for each in type(shown).__mro__ if each.__name__ in _CARDS)
    return next(known)(shown)


def document_of(shown: Any) -> Document:
    """The document of a result, a comparison, a judgement or an examination of a deck."""
    from hertzchain.report.comparison import of_comparison
    from hertzchain.report.examination import of_examination
    from hertzchain.report.judgement import of_judgement
    from hertzchain.report.run import of_result
    from hertzchain.report.traces import of_traces

    if isinstance(shown, Result):
        return of_result(shown)
    makers: Mapping[str, Callable[[Any], Document]] = {
        "Comparison": of_comparison,
        "Judgement": of_judgement,
        "DeckExamination": of_examination,
        "TraceJudgement": of_traces,
    }
    return makers[type(shown).__name__](shown)


def printed(shown: Any) -> str:
    """What ``run`` or ``compare`` prints of a result or a verdict, without colours."""
    from hertzchain.report.console import plain_text, print_document

    document, elsewhere = document_of(shown), _elsewhere(shown)
    return plain_text(lambda console: print_document(console, document, elsewhere))


def drawn(shown: Any) -> Picture:
    """The figure of a result or a verdict."""
    from hertzchain.report.figures import figure_of

    return figure_of(document_of(shown))


def _elsewhere(shown: object) -> str:
    """Where the peaks of all contacts are; the table of an examination has its checks."""
    return "in peak_force" if type(shown).__name__ == "DeckExamination" else "in to_frame()"


# Cards


def _of_scene(scene: Scene) -> Card:
    chain, units = scene.chain, scene.units
    facts = [("granules", f"{chain.granules:,}")]
    facts += [(key, _range(getattr(chain, key), keys_of(Chain)[key].unit)) for key in MATERIAL]
    facts += [
        ("terms", ", ".join(scene.terms) or "none: like granules, free ends, one pulse"),
        ("largest applied force", f"{scene.peak_force:.6g} N"),
        ("LM_ratio", f"{scene.momentum_ratio:.6g}"),
        ("end of the shock", f"{scene.pulse_end:.6g} s"),
        ("end of the run", f"{scene.end_time:.6g} s"),
        ("natural units", f"{units.force:.4g} N, {units.length:.4g} m, {units.time:.4g} s"),
    ]
    return Card(f"Scene: {describe(scene)}", facts)


def _range(values: Any, unit: str) -> str:
    """A number with its unit, or the smallest and the largest of several."""
    ends = (min(values), max(values)) if isinstance(values, tuple) else (values,)
    return f"{' to '.join(f'{value:.6g}' for value in ends)} {unit}".rstrip()


def _more(left: int, what: str, shown: object) -> str:
    """How many rows are left out, and where they are; empty where there are none."""
    return f"{left:,} more {what} {_elsewhere(shown)}" if left else ""


def _of_batch(batch: Batch) -> Card:
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
    rows = [
        (str(k), number(largest[k], 7), f"{batch.error_estimate[k]:.1e}")
        for k in range(min(scenes, _MOST_ROWS))
    ]
    return Card(
        "Batch: peaks of many scenes",
        facts,
        ("scene", "largest peak", "error"),
        rows,
        _more(scenes - len(rows), "scenes", batch),
    )


def _of_document(shown: Any) -> Card:
    """The card of a run or a verdict: the sentence, what is known, why it failed, and its peaks."""
    document = document_of(shown)
    verdict, peaks, native = document.verdict, document.peaks, document.native
    facts = [("verdict", f"{verdict.word}. {verdict.sentence}")] if verdict.sentence else []
    if document.command == "compare":
        facts += [
            (LABELS[name], f"error at most {one.error_estimate:.1e}, {cost(one)}")
            for name, one in document.results.items()
        ]
        facts += [(label, "did not run") for label in document.absent]
        failed = [f"{one.name}: {one.found or one.advice}" for one in verdict.failures]
        facts += first_of("failed", failed, 4)
    facts += document.facts
    found = {"likely cause": document.cause, "hint": document.hint}
    facts += [(label, value) for label, value in found.items() if value]
    to_mend = [one for one in document.findings if not one.passed]
    said = [f"{one.place}: {'; '.join(one.sentences)}".removeprefix(": ") for one in to_mend]
    facts += first_of("to mend", said, 6)
    kind = document.kind
    if document.command == "run":
        kind, at = f"Result of {native.backend}", int(np.argmax(native.peak_force))
        largest = f"{number(native.peak_force[at], 9)} N in contact {native.contact[at]}"
        facts = [("largest peak", largest), *facts[: MOST_FACTS - 5]]
        if native.history is not None:
            time = native.history.time
            facts.append(("recorded", f"{time.size:,} times, {time[0]:.4g} to {time[-1]:.4g} s"))
        facts += first_of("warning", native.warnings, 3)
    rows = [peaks.row(k) for k in list(peaks.shown)[:_MOST_ROWS]]
    left = native.contact.size - len(rows)
    return Card(
        f"{kind}: {describe(native.scene)}",
        facts[:MOST_FACTS],
        [f"{label} {unit}".strip() for label, unit in peaks.columns],
        rows,
        _more(left if peaks.of_contacts else 0, "contacts", shown),
    )


_CARDS: Mapping[str, Callable[[Any], Card]] = {
    "Scene": _of_scene,
    "Batch": _of_batch,
    **dict.fromkeys(
        ("Result", "Comparison", "Judgement", "TraceJudgement", "DeckExamination"), _of_document
    ),
}
"""By the names of classes, which are not all loaded."""
