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
        Name of this kind of page.
    name, numbers
        Name of the JSON document, and the function that makes it.
    command, cases
        ``compare`` or ``judge``, which is part of the name of the JUnit suite, and its cases.
    results
        Result of each simulation, by the names of the engines.
    verdict
        Head of the page.
    peaks
        Table of peak forces.
    drawn
        Peak forces [N] that are drawn next to those of native, by the names of their styles.
    limits
        Style, label and value of each line in the plot of relative differences, but for native's.
    absent
        Labels of engines that did not run.
    answers, efforts, cost
        The transition by each engine of a comparison; method, steps and time, in short and in full.
    checks
        Checks of a comparison, on which its verdict rests.
    formulas, similar
        Remarks on the formulas, and on engines that computed a similar chain.
    facts, cause, remarks
        Label and value of each thing said of all given peaks together; the likely cause of what
        failed; what could not be done.
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
    def lines(self) -> list[tuple[str, str, float]]:
        """The limits, and the error estimate of native."""
        return [*self.limits, ("native", "reference, error estimate", self.native.error_estimate)]

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
