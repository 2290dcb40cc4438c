"""Texts of objects: cards, and documents as the commands print them."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from hertzchain.observables.result import Result
from hertzchain.report.document import Document, describe
from hertzchain.scene.chain import MATERIAL, MEASURED, Chain
from hertzchain.scene.keys import keys_of
from hertzchain.scene.scene import Scene

if TYPE_CHECKING:
    from hertzchain.engines.native.batch import Batch

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


def document_of(shown: Any) -> Document:
    """The document of a result, a comparison, a judgement or an examination of a deck."""
    from hertzchain.report.run import of_result
    from hertzchain.report.verdicts import (
        of_comparison,
        of_examination,
        of_judgement,
        of_traces,
        of_trains,
    )

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


def printed(document: Document) -> str:
    """Return what ``run`` or ``compare`` prints for a result or a verdict, without colours."""
    from hertzchain.report.console import plain_text, print_document

    # The table of an examination has its checks.
    others = "in peak_force" if document.command == "examine" else "in to_frame()"
    return plain_text(lambda console: print_document(console, document, others))


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


def _range(values: Any, unit: str) -> str:
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
