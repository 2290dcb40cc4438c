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
    """The peak forces of all contacts, of which a terminal shows some."""

    heading: str
    columns: Sequence[tuple[str, str]]  # label and unit
    row: Callable[[int], list[str]]  # makes the cells of a contact, by its index
    shown: Sequence[int]


@dataclass(frozen=True)
class Finding:
    """What differs in somebody's deck: what it costs, which line makes it, how it would be right.

    ``passed`` where the difference is too small to matter.
    """

    sentence: str
    effect: str
    passed: bool
    place: str
    written: str
    command: str


@dataclass(frozen=True)
class Listing:
    """A file of a deck: number and text of each line, with what is said of it.

    Each of these sentences comes with whether it is a remark only.
    """

    name: str
    lines: Sequence[tuple[int, str, Sequence[tuple[bool, str]]]]


@dataclass(frozen=True, eq=False)
class Document:
    """All that reports show of a comparison, a judgement of given peaks or an examined deck."""

    kind: str  # of page
    name: str  # of the JSON document
    numbers: Callable[[], dict[str, Any]]  # makes the JSON document
    command: str  # compare or judge: part of the name of the JUnit suite
    cases: tuple[Case, ...]  # of the JUnit suite
    results: Mapping[str, Result]  # by the names of the engines
    verdict: Verdict
    peaks: Peaks
    drawn: Mapping[str, FloatArray]  # peak forces [N] next to native's, by the names of styles
    limits: Sequence[tuple[str, str, float]]  # style, label, value of lines among differences
    absent: Sequence[str] = ()  # labels of engines that did not run
    answers: Table | None = None  # the transition by each engine of a comparison
    efforts: Sequence[Sequence[str]] = ()  # further rows of it: method, steps and time, in short
    cost: Table | None = None  # method, steps and time in full
    checks: Sequence[Check] = ()  # on which the verdict of a comparison rests
    formulas: Sequence[str] = ()  # remarks on the formulas
    similar: Sequence[str] = ()  # remarks on engines that computed a similar chain
    facts: Sequence[tuple[str, str]] = ()  # label and value of what is said of all given peaks
    cause: str | None = None  # likely one, of what failed
    hint: str | None = None  # what comes nearest where no cause is known
    remarks: Sequence[str] = ()  # what could not be done
    findings: Sequence[Finding] = ()  # what differs in somebody's deck, first what to mend first
    listings: Sequence[Listing] = ()  # the files of that deck

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
