"""The document of a run or a verdict, then shown on a terminal, a page, a plot and in JUnit."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.observables.result import Result
from hertzchain.scene.scene import Scene

if TYPE_CHECKING:
    from hertzchain.verdict.check import Check


Fact = tuple[str, str]
"""Label and value of something that holds for the whole run."""

Column = tuple[str, str, Callable[[int], str]]
"""Label, unit, and the function from the index of a contact to its cell."""


class Failure(NamedTuple):
    """A failed check: its name, the measured number (empty if unknown), and advice."""

    name: str
    difference: str
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

    A page shows a table below its heading, lines of a cell after the first one small, and sentences
    below it. Facts are a table without a header.
    """

    heading: str
    caption: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]
    text: int = 1
    below: Sequence[str] = ()


@dataclass(frozen=True)
class Peaks:
    """The peak forces of all contacts; a terminal shows some of them."""

    heading: str
    columns: Sequence[Column]
    shown: Sequence[int]
    of_contacts: bool = True  # of gauges otherwise, all of which are shown

    def row(self, k: int) -> list[str]:
        """Return the cells of a contact by its index."""
        return [cell(k) for _, _, cell in self.columns]


@dataclass(frozen=True)
class Finding:
    """Differences that a line of a user's deck causes: sentences, effects, the proven correction.

    ``passed`` if the difference is too small to matter. ``right`` has lines of the deck, with the
    text of each and the commands in its place; ``note`` is a further remark.
    """

    sentences: Sequence[str]
    passed: bool
    place: str = ""
    written: str = ""
    right: Sequence[tuple[str, str, Sequence[str]]] = ()
    note: str = ""


@dataclass(frozen=True, eq=False)
class Overlay:
    """Measured forces of a gauge, and those of the reference at the same times [N], (samples,).

    ``band`` is the range of the latter by uncertain input, if any.
    """

    label: str
    time: FloatArray
    measured: FloatArray
    expected: FloatArray
    band: tuple[FloatArray, FloatArray] | None = None


@dataclass(frozen=True, eq=False)
class Document:
    """The content of all reports on a run, a comparison, judged peaks or an examined deck."""

    kind: str  # title of the page
    numbers: Callable[[], dict[str, Any]]  # function that returns the JSON document
    command: str  # that prints it; in the names of the JUnit suite and of the page's JSON
    results: Mapping[str, Result]  # results by the names of the engines
    verdict: Verdict  # for a run without a sentence
    peaks: Peaks
    # peak forces [N] next to native's, by the names of styles
    drawn: Mapping[str, FloatArray] = field(default_factory=dict)
    limits: Sequence[tuple[str, str, float]] = ()  # style, label, value of lines among differences
    absent: Sequence[str] = ()  # labels of engines that did not run
    tables: Sequence[Table] = ()  # further ones: answers of each engine, all pulses
    checks: Sequence[Check] = ()  # checks that decide the verdict
    facts: Sequence[Fact] = ()  # on all contacts together
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


_PREFIXES = {-12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}
MULTIPLES = {"N": 6, "Pa": 9, "m": 0, "s": 0, "m/s": 0, "N s": 0, "J": 3, "Hz": 6}
"""Units with multiples, and the largest power of ten in use for each."""

_SHORT_RANGE = (1e-2, 1e5)  # beyond these, numbers at an axis are long (chosen)


def describe(scene: Scene) -> str:
    """Return one line that describes a scene."""
    kind = scene.shock.in_words(scene.chain.granules, scene.momentum_ratio)
    told = {"striker", "piston", "single granule"}
    told |= {"moving granules"} if scene.chain.granules == 1 else set()
    others = [term for term in scene.terms if term not in told]
    return f"{kind}, with {', '.join(others)}" if others else kind


def prefixed(largest: float, unit: str) -> tuple[str, float]:
    """Return a multiple of a unit in which a number is 1 to 1000, and its value in the unit.

    Units that have no multiples in use stand after a power of ten, where numbers are long.
    """
    if not 0 < largest < np.inf or (
        unit not in MULTIPLES and _SHORT_RANGE[0] <= largest < _SHORT_RANGE[1]
    ):
        return unit, 1.0
    power = 3 * int(np.floor(np.log10(largest * (1 + 1e-9)) / 3))
    if unit in MULTIPLES:
        power = min(max(power, -12), MULTIPLES[unit])
        return _PREFIXES[power] + unit, float(f"1e{power}")
    return f"$10^{{{power}}}$ {unit}".rstrip(), float(f"1e{power}")


def in_prefixed(value: float, unit: str) -> str:
    """Return a number of four digits with a suitable multiple of its unit."""
    name, scale = prefixed(abs(value), unit)
    return f"{value / scale:.4g} {name}".rstrip()


def number(value: float | None, digits: int) -> str:
    """Return a number with the given significant digits; empty for a missing number."""
    return "" if value is None or np.isnan(value) else f"{value:#.{digits}g}"


NO_DIGIT = "no digit"
"""Text in place of a number without a right digit."""


def known_digits(value: float | None, error: float, most: int = 9) -> str:
    """Return a number with the digits that its relative error leaves, the last one uncertain."""
    if error >= 1:
        return NO_DIGIT
    if value is None or np.isnan(value) or value == 0:
        return number(value, most)
    digits = int(np.clip(1 - np.ceil(np.log10(max(error, 1e-16))), 1, most))
    place = digits - 1 - int(np.floor(np.log10(abs(value))))
    if abs(value) < 1e-4:  # as the format g does
        return f"{value:#.{digits}g}"
    return f"{round(value, place):.{max(place, 0)}f}"


def with_unit(value: float | None, unit: str, error: float = 1e-6) -> str:
    """Return a number with its unit, to its relative error, or words where it is missing."""
    if value is None:
        return "unknown: the chain or the run is too short"
    if np.isnan(value):
        return "unknown"
    return f"{known_digits(value, error)} {unit}"


def difference(check: Check) -> tuple[str, str, str]:
    """Return difference, tolerance and their ratio; empty for numbers that were not measured."""
    if check.measured is None or check.expected is None or check.tolerance is None:
        return "", "", ""
    off = abs(check.measured - check.expected)
    share = off / check.tolerance if check.tolerance else math.inf if off else 0.0
    words = f"{share:.2g}" if 0.01 <= share < 100 else f"{share:,.0f}"
    return f"{off:.1e}", f"{check.tolerance:.1e}", "< 0.01" if 0 < share < 0.01 else words


def failure_of(check: Check) -> Failure:
    """Return a failed check with its difference and advice, as a page shows it."""
    off, tolerance, _ = difference(check)
    if not off:
        return Failure(check.name, "", check.reason)
    sentence = f"off by {off}, allowed is {tolerance} ({check.reason})"
    return Failure(check.name, sentence, check.kind.advice)
