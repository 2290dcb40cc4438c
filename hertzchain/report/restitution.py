"""Restitution of damping options as text for a terminal."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from hertzchain.decks.restitution import RATIO, RESTITUTION, Answer
from hertzchain.report.console import table

if TYPE_CHECKING:
    from rich.console import Console

_LEFT = ("code", "versions", "option", "pulls")


def print_restitution(console: Console, wanted: float, answers: Sequence[Answer]) -> None:
    """Print restitution and number to write of each option, then coefficients."""
    asked = [answer for answer in answers if not answer.option.needs_spheres]
    rows = [_row(answer, wanted) for answer in asked]
    console.print(table((*_LEFT, f"{wanted:g} gives", "write"), rows, _LEFT))
    if others := answers[len(asked) :]:
        written = others[0].written
        gives = "" if written is None else f"{written:g} gives"
        console.print()
        rows = [_row(answer, wanted) for answer in others]
        console.print(table((*_LEFT, gives, "write"), rows, _LEFT))


def _row(answer: Answer, wanted: float) -> tuple[str, ...]:
    option, gives = answer.option, answer.gives
    refused = "" if answer.written is None else "refused"
    return (
        option.code,
        option.versions,
        option.words,
        "yes" if option.pulls else "no",
        refused if gives is None else f"{gives:.4f}",
        _number(answer, wanted),
    )


def _number(answer: Answer, wanted: float) -> str:
    """Return the number to write with its unit, or the restitutions that the option cannot give."""
    option = answer.option
    if answer.write is None:
        lowest, highest = option.range
        return f"none below {lowest:.3f}" if wanted < lowest else f"none above {highest:.4f}"
    unit = "" if option.number in (RESTITUTION, RATIO) else f" {option.number}"
    return f"{answer.write:.6g}{unit}"
