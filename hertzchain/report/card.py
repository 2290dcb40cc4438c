"""A card: an object in at most 15 lines of text, or as a table in a notebook."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

MOST_FACTS = 14  # lines of text under the title
_WIDEST = 160  # characters of a value; sentences may be longer

_TEXT = ' style="text-align: left; padding: 0 0.5em"'
_NUMBER = ' style="text-align: right; padding: 0 0.5em; font-variant-numeric: tabular-nums"'


@dataclass(frozen=True)
class Card:
    """What an object says of itself.

    Parameters
    ----------
    title
        Kind and what it is, in one line.
    facts
        Label and value of each thing to know, at most ``MOST_FACTS``.
    header, rows
        A table for notebooks; none if empty.
    note
        Where the rest of that table is, if it is not whole.
    """

    title: str
    facts: Sequence[tuple[str, str]]
    header: Sequence[str] = ()
    rows: Sequence[Sequence[str]] = ()
    note: str = ""

    @property
    def text(self) -> str:
        """The title and a line for each fact."""
        assert len(self.facts) <= MOST_FACTS
        width = max((len(label) for label, _ in self.facts), default=0)
        lines = (
            f"  {label:<{width}}  {textwrap.shorten(value, _WIDEST, placeholder=' ...')}"
            for label, value in self.facts
        )
        return "\n".join([self.title, *lines])

    @property
    def html(self) -> str:
        """The title, the facts and the table, as a piece of HTML."""
        facts = "".join(
            f"<tr><td{_TEXT}>{escape(label)}</td><td{_TEXT}>{escape(value)}</td></tr>"
            for label, value in self.facts
        )
        parts = [f"<p><b>{escape(self.title)}</b></p>", f"<table>{facts}</table>"]
        if self.rows:
            head = "".join(f"<th{_NUMBER}>{escape(cell)}</th>" for cell in self.header)
            body = "".join(
                f"<tr>{''.join(f'<td{_NUMBER}>{escape(cell)}</td>' for cell in row)}</tr>"
                for row in self.rows
            )
            parts.append(f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>")
        if self.note:
            parts.append(f"<p>({escape(self.note)})</p>")
        return f"<div>{''.join(parts)}</div>"


def first_of(label: str, sentences: Sequence[str], most: int) -> list[tuple[str, str]]:
    """Facts of the first few sentences, and how many more there are, ``most`` together."""
    shown = sentences if len(sentences) <= most else sentences[: most - 1]
    facts = [(label, sentence) for sentence in shown]
    if len(shown) < len(sentences):
        facts.append(("", f"and {len(sentences) - len(shown):,} more"))
    return facts
