"""The examination of a user's deck: its numbers, its peaks and a verdict."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray, or_none
from hertzchain.engines.lammps.reading.found import Executed, FoundDeck
from hertzchain.engines.lammps.reading.text import Edits, lines_of
from hertzchain.examiner.case import DeckCheck
from hertzchain.examiner.twin import change_of_peaks
from hertzchain.observables.definitions import context_of
from hertzchain.observables.result import Result
from hertzchain.scene.scene import Scene
from hertzchain.showing import ShownVerdict

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True)
class Correction:
    """Commands that replace a line of a deck, proven to be right."""

    file: str  #: as the deck names it
    line: int
    written: str  #: the command that stands there
    commands: tuple[str, ...]  #: those in its place; a removed command has a ``#`` before it

    def to_dict(self) -> dict[str, Any]:
        """Return the correction as a JSON object."""
        return {"file": self.file, "line": self.line, "commands": list(self.commands)}


@dataclass(frozen=True)
class Finding:
    """The numbers that one command of a deck makes wrong."""

    checks: tuple[DeckCheck, ...]  #: that failed because of it, that of the largest effect first
    #: Lines with which all of these pass and no peak gets worse; empty if none was found.
    correction: tuple[Correction, ...] = ()
    with_others: bool = False  #: whether only together with the corrections of other findings
    follows: int | None = None  #: index of the finding whose correction makes these pass, too


@dataclass(frozen=True, eq=False, repr=False)
class DeckExamination(ShownVerdict):
    """A user's deck as LAMMPS reads it, compared with a scene number by number.

    It is true if the verdict is ``pass``.
    """

    scene: Scene  #: what the deck should compute
    deck: str  #: its name
    found: FoundDeck  #: what LAMMPS found in it, in SI units
    checks: tuple[DeckCheck, ...]  #: the one to correct first in front; the peaks are the last
    reference: Result  #: the scene by the reference method, up to the end of the deck
    judged: NDArray[np.bool_]  #: contacts whose peaks were judged, (contacts,), a wall's the last
    tolerance: float  #: largest relative difference of the peaks that passes
    remarks: tuple[str, ...]  #: sentences on parts that were not examined
    texts: tuple[tuple[str, str], ...] = ()  #: name and text of each file, as its commands have it
    findings: tuple[Finding, ...] = ()  #: what to correct, command by command
    edits: Edits = field(default_factory=dict)  #: all proven corrections, by file and line

    @property
    def passed(self) -> bool:
        """Whether the whole deck agrees with the scene."""
        return all(check.passed for check in self.checks)

    @property
    def verdict(self) -> str:
        """``pass`` if the whole deck agrees with the scene, else ``fail``."""
        return "pass" if self.passed else "fail"

    @property
    def peak_force(self) -> FloatArray:
        """Peak forces of the deck [N], shape (contacts,), NaN where it has no such contact."""
        whole = np.full(self.reference.peak_force.size, np.nan)
        count = min(whole.size, self.found.peak_force.size)
        whole[:count] = self.found.peak_force[:count]
        return whole

    @property
    def to_correct(self) -> tuple[DeckCheck, ...]:
        """The failed checks except that of the peaks, the one with the largest effect first."""
        return tuple(check for check in self.checks[:-1] if not check.passed)

    @property
    def fix(self) -> str:
        """The text of the deck with all proven corrections; included files that change stand in it.

        It is the text of the deck itself if nothing could be corrected.
        """
        texts = dict(self.texts)
        return _edited(self.deck, texts, self.edits) if self.deck in texts else ""

    def corrections_of(self, edits: Edits) -> tuple[Correction, ...]:
        """Edits as corrections of this deck, line by line."""
        written = {(one.file, one.line): one.written for one in self.found.commands}
        return tuple(
            Correction(file, line, written.get((file, line), ""), commands)
            for (file, line), commands in sorted(edits.items(), key=lambda item: item[0][1])
        )

    def error_of_peaks(self, which: NDArray[np.bool_]) -> float:
        """Largest relative difference from the reference of some contacts; infinite without one."""
        return change_of_peaks(self.found.peak_force, self.reference.peak_force, which)

    @property
    def small(self) -> tuple[DeckCheck, ...]:
        """The checks that passed with a difference."""
        return tuple(check for check in self.checks if check.passed and check.differs)

    @property
    def left_out(self) -> tuple[Executed, ...]:
        """Commands that were not carried out, or not in full."""
        return tuple(one for one in self.found.commands if one.why_not is not None)

    def to_frame(self) -> pandas.DataFrame:
        """A table with one row for each check."""
        import pandas

        return pandas.DataFrame([check.to_dict() for check in self.checks])

    def to_dict(self) -> dict[str, Any]:
        """Return the examination as a JSON object; null stands for a missing value."""
        found = self.found
        return {
            "verdict": self.verdict,
            "deck": self.deck,
            "tolerance": self.tolerance,
            "checks": [check.to_dict() for check in self.checks],
            "findings": [
                {
                    "checks": [check.name for check in one.checks],
                    "correction": [line.to_dict() for line in one.correction] or None,
                    "with_others": one.with_others,
                    "follows": one.follows,
                }
                for one in self.findings
            ],
            "stopped": found.stopped or None,
            "left_out": [
                {"file": one.file, "line": one.line, "command": one.written, "why": one.why_not}
                for one in self.left_out
            ],
            "remarks": list(self.remarks),
            "units": found.units,
            "axis": found.axis,
            "lammps": found.version,
            "end_time_s": found.end_time,
            "dt_s": max((run.dt for run in found.runs), default=None),
            "peak_force_N": or_none(self.peak_force),
            "peak_reading_error": (
                found.peak_reading_error if math.isfinite(found.peak_reading_error) else None
            ),
            "judged": self.judged.tolist(),
            "reference": self.reference.numbers(),
            **context_of(self.scene),
        }


def _edited(name: str, texts: Mapping[str, str], edits: Edits) -> str:
    """Return a file of a deck with edits; included files with edits stand in it."""
    changed = {file for file, _ in edits}
    rows: list[str] = []
    text = texts[name]
    for line in lines_of(text):
        own = edits.get((name, line.number))
        words = line.text.split()
        if own is not None:
            rows += own
        elif words[:1] == ["include"] and words[1] in changed & set(texts):
            rows.append(_edited(words[1], texts, edits).rstrip("\n"))
        else:
            rows += text.split("\n")[line.number - 1 : line.last]
    return "\n".join(rows) + ("\n" if not text.endswith("\n") else "")


def by_command(checks: Iterable[DeckCheck]) -> list[list[DeckCheck]]:
    """Failed checks by the command that causes them, in their order."""
    made: dict[object, list[DeckCheck]] = {}
    for check in checks:
        if not check.passed:
            at = id(check) if check.place is None else (check.place.file, check.place.line)
            made.setdefault(at, []).append(check)
    return list(made.values())


def in_order(checks: Sequence[DeckCheck]) -> list[DeckCheck]:
    """Failed checks first, by their effect on the peaks; then those that differ; then the rest."""

    def rank(check: DeckCheck) -> tuple[int, float]:
        group = 0 if not check.passed else 1 if check.differs else 2
        effect = -math.inf if check.effect is None else check.effect
        return group, -effect if group < 2 else 0.0

    return sorted(checks, key=rank)
