"""A verdict as people read it: made once, then shown on a terminal, a page, a plot and in JUnit."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import TYPE_CHECKING, Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.observables.result import Result
from hertzchain.report.junit import Case, Suite

if TYPE_CHECKING:
    from hertzchain.verdict.check import Check


@dataclass(frozen=True)
class Failure:
    """What failed, what was found (empty where nothing was), and what to do."""

    name: str
    found: str
    advice: str


@dataclass(frozen=True)
class Verdict:
    """The head of a page; ``passed`` is None where nothing could be said."""

    passed: bool | None
    sentence: str
    failures: Sequence[Failure] = ()
    remarks: Sequence[str] = ()

    @property
    def word(self) -> str:
        """``PASS``, ``FAIL`` or ``UNDECIDED``."""
        return "UNDECIDED" if self.passed is None else "PASS" if self.passed else "FAIL"


@dataclass(frozen=True)
class Table:
    """Cells as they are shown; the first ``text`` columns are text, all others numbers."""

    caption: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]
    text: int = 1


@dataclass(frozen=True)
class Peaks:
    """The peak forces of all contacts, of which a terminal shows some below a heading.

    Columns have a label and a unit. ``row`` makes the cells of a contact, by its index: there may
    be millions, of which few are shown.
    """

    heading: str
    columns: Sequence[tuple[str, str]]
    row: Callable[[int], list[str]]
    shown: Sequence[int]


@dataclass(frozen=True, eq=False)
class Document:
    """All that reports show of a comparison, or of a judgement of given peaks.

    Parameters
    ----------
    kind
        What a page calls it.
    name, numbers
        Of the document of JSON: its name, and what makes it.
    command, cases
        Of the JUnit suite: ``compare`` or ``judge``, and what the verdict rests on.
    results
        What each simulation found, by the names of the engines.
    verdict
        The head of a page.
    peaks
        The table of peak forces.
    drawn
        Peak forces [N] that are drawn next to those of native, by the names of their styles.
    limits
        Style, label and value of the lines in a plot of relative differences.
    absent
        Labels of engines that did not run.
    answers, efforts, cost
        Of a comparison: what each engine says of the transition, in short what it took, and in
        full.
    checks
        Of a comparison: what the verdict rests on.
    formulas, similar
        Of a comparison: remarks on the formulas, and on engines that computed another chain.
    facts, cause, remarks
        Of a judgement: label and value of what is said of all contacts; the likely cause; what
        could not be done.
    """

    kind: str
    name: str
    numbers: Callable[[], dict[str, Any]]
    command: str
    cases: tuple[Case, ...]
    results: Mapping[str, Result]
    verdict: Verdict
    peaks: Peaks
    drawn: Mapping[str, FloatArray]
    limits: Sequence[tuple[str, str, float]]
    absent: Sequence[str] = ()
    answers: Table | None = None
    efforts: Sequence[Sequence[str]] = ()
    cost: Table | None = None
    checks: Sequence[Check] = ()
    formulas: Sequence[str] = ()
    similar: Sequence[str] = ()
    facts: Sequence[tuple[str, str]] = ()
    cause: str | None = None
    remarks: Sequence[str] = ()

    @property
    def native(self) -> Result:
        """The reference."""
        return self.results["native"]

    @property
    def differences(self) -> dict[str, FloatArray]:
        """Relative differences of what is drawn from native, no signs, NaN where there is none."""
        peaks = self.native.peak_force
        pressed = np.where(peaks > 0, peaks, np.nan)
        return {name: np.abs(values / pressed - 1) for name, values in self.drawn.items()}

    def suite(self, scene: str, begun: datetime, seconds: float) -> Suite:
        """The JUnit suite: no dots in a scene's name, which CI systems take for folders."""
        name = f"hertzchain.{self.command}.{scene.replace('.', '_')}"
        return Suite(name, self.cases, begun, seconds)
