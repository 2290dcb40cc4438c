"""The document of a run or a verdict, then shown on a terminal, a page, a plot and in JUnit."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import TYPE_CHECKING, Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.observables.result import Result
from hertzchain.report.junit import ERROR, FAILURE, Case, Suite, case

if TYPE_CHECKING:
    from hertzchain.verdict.check import Check


@dataclass(frozen=True)
class Failure:
    """A failed check: its name, the number found (empty for none), and advice."""

    name: str
    found: str
    advice: str


@dataclass(frozen=True)
class Verdict:
    """The head of a page; ``passed`` is None for a run, and where no difference could be seen."""

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
    """Cells as they are shown; the first ``text`` columns are text, all others numbers.

    A page shows lines of a cell after the first one small. Facts are a table without a header.
    """

    caption: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]
    text: int = 1


@dataclass(frozen=True)
class Section:
    """A part of a page: a heading, a table, and sentences below it."""

    heading: str
    table: Table
    below: Sequence[str] = ()


@dataclass(frozen=True)
class Peaks:
    """The peak forces of all contacts; a terminal shows some of them."""

    heading: str
    columns: Sequence[tuple[str, str]]  # label and unit
    row: Callable[[int], list[str]]  # function from the index of a contact to its cells
    shown: Sequence[int]
    of_contacts: bool = True  # of gauges otherwise, all of which are shown


@dataclass(frozen=True)
class Finding:
    """Differences that a line of a user's deck causes: sentences, effects, the proven correction.

    ``passed`` if the difference is too small to matter. ``right`` has lines of the deck, with the
    text of each and the commands in its place; ``note`` is a further remark.
    """

    sentences: Sequence[str]
    passed: bool
    place: str
    written: str
    right: Sequence[tuple[str, str, Sequence[str]]] = ()
    note: str = ""


@dataclass(frozen=True, eq=False)
class Overlay:
    """Measured forces of a gauge, and those of the reference at the same times [N], (samples,)."""

    label: str
    time: FloatArray
    measured: FloatArray
    expected: FloatArray


@dataclass(frozen=True, eq=False)
class Document:
    """The content of all reports on a run, a comparison, judged peaks or an examined deck."""

    kind: str  # title of the page
    numbers: Callable[[], dict[str, Any]]  # function that returns the JSON document
    command: str  # that prints it; in the names of the JUnit suite and of the page's JSON
    results: Mapping[str, Result]  # results by the names of the engines
    verdict: Verdict  # for a run without a sentence
    peaks: Peaks
    drawn: Mapping[str, FloatArray]  # peak forces [N] next to native's, by the names of styles
    limits: Sequence[tuple[str, str, float]]  # style, label, value of lines among differences
    absent: Sequence[str] = ()  # labels of engines that did not run
    answers: Table | None = None  # the transition by each engine of a comparison
    checks: Sequence[Check] = ()  # checks that decide the verdict
    notes: Sequence[str] = ()  # remarks on the answers: formulas, engines with a similar chain
    facts: Sequence[tuple[str, str]] = ()  # label and value of facts on all contacts together
    remarks: Sequence[str] = ()  # sentences on causes, and on parts that could not be done
    # differences in a user's deck, in the order in which to correct them
    findings: Sequence[Finding] = ()
    overlays: Sequence[Overlay] = ()  # measured traces, drawn in place of peaks

    @property
    def native(self) -> Result:
        """The reference; a run itself."""
        return next(iter(self.results.values()))

    @property
    def lines(self) -> list[tuple[str, str, float]]:
        """The limits, and the error estimate of native."""
        return [*self.limits, ("native", "reference, error estimate", self.native.error_estimate)]

    @property
    def differences(self) -> dict[str, FloatArray]:
        """Absolute relative differences from native of all drawn peaks; NaN for missing ones."""
        peaks = self.native.peak_force
        pressed = np.where(peaks > 0, peaks, np.nan)
        return {name: np.abs(values / pressed - 1) for name, values in self.drawn.items()}

    def suite(self, scene: str, begun: datetime, seconds: float) -> Suite:
        """Name of the JUnit suite, without dots, which CI systems take for folders."""
        name = f"hertzchain.{self.command}.{scene.replace('.', '_')}"
        cases = tuple(
            case(one.name, one.measured, one.expected, one.tolerance, one.passed, one.reason)
            for one in self.checks
        )
        return Suite(name, cases or (self._case_of_verdict(),), begun, seconds)

    def _case_of_verdict(self) -> Case:
        """Return the verdict as the only test case."""
        verdict = self.verdict
        if verdict.passed:
            return Case("verdict")
        failures = (" ".join((f"{one.name}:", one.found, one.advice)) for one in verdict.failures)
        said = [verdict.sentence, *failures, *verdict.remarks]
        problem = ERROR if verdict.passed is None else FAILURE
        return Case("verdict", problem, verdict.sentence, "\n".join(said))
