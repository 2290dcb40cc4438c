"""What lint says of a deck."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from hertzchain.verdict.lint.script import Command

Severity = Literal["error", "warning", "note"]


@dataclass(frozen=True)
class Finding:
    """One thing that is wrong, or worth knowing, in a deck."""

    line: int  # from 1
    rule: str
    severity: Severity  # wrong or stops; likely not meant; costs time, or is worth knowing
    text: str  # what is wrong, and what to write instead


Found = Iterator[tuple[Command | None, Severity, str]]  # where (None: line 1), how bad, sentence
