"""The document of a run or a verdict, then shown on a terminal, a page, a plot and in JUnit."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from itertools import count
from typing import TYPE_CHECKING, Any, NamedTuple
from xml.etree import ElementTree

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.observables.result import Result
from hertzchain.scene.scene import Scene
from hertzchain.theory.restitution import parting

if TYPE_CHECKING:
    from hertzchain.verdict.check import Check


# too different; without a number; not wanted
FAILURE, ERROR, SKIPPED = "failure", "error", "skipped"


_NO_XML = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""Characters that XML 1.0 cannot contain, not even as references."""


@dataclass(frozen=True)
class Case:
    """A check, with its problem, if any, in one line (``message``) and in full (``text``)."""

    name: str
    problem: str | None = None
    message: str = ""
    text: str = ""


@dataclass(frozen=True)
class Suite:
    """Checks made together, with their start and their time [s]."""

    name: str
    cases: tuple[Case, ...]
    begun: datetime
    seconds: float


def case_of(check: Check) -> Case:
    """Return a check as a test case; a check without a number is an error.

    The message has the name, the difference, and its place if the reason ends with one.
    """
    name, reason = check.name, check.reason
    measured, expected, tolerance = check.measured, check.expected, check.tolerance
    if check.passed:
        return Case(name)
    if measured is None or expected is None or not math.isfinite(measured):
        return Case(name, ERROR, f"{name}: {reason}", reason)
    # The shortest text of each number that keeps all digits: differences may be 1e-13.
    numbers = {"measured": measured, "expected": expected, "tolerance": tolerance}
    lines = [f"{key} {'none' if x is None else repr(float(x))}" for key, x in numbers.items()]
    text = [*lines, f"difference {float(measured - expected)!r}", f"why this tolerance: {reason}"]
    _, largest, at = reason.rpartition("; largest at ")
    where = f", largest at {at}" if largest else ""
    allowed = "" if tolerance is None else f", allowed is {tolerance:.2g}"
    message = (
        f"{name} is {float(measured)!r}, it should be {float(expected)!r}: off by"
        f" {abs(measured - expected):.2g}{allowed}{where}"
    )
    return Case(name, FAILURE, message, "\n".join(text))


def to_xml(suites: Sequence[Suite]) -> str:
    """Return suites as JUnit XML; characters that XML cannot contain become U+FFFD.

    Only a suite has a time, because its simulations serve all its cases. A name that occurs twice
    in a suite gets a number, because CI systems drop the second.
    """
    cases = [case for suite in suites for case in suite.cases]
    seconds = sum(suite.seconds for suite in suites)
    root = ElementTree.Element("testsuites", _counts("hertzchain", cases, seconds))
    root.attrib.pop("skipped")  # the schema allows it for a suite only
    for suite in suites:
        about = _counts(suite.name, suite.cases, suite.seconds)
        about["timestamp"] = suite.begun.isoformat(timespec="seconds")
        above = ElementTree.SubElement(root, "testsuite", about)
        seen: set[str] = set()
        for case in suite.cases:
            name, number = _clean(case.name), count(2)
            while name in seen:
                name = f"{_clean(case.name)} ({next(number)})"
            seen.add(name)
            about = {"classname": suite.name, "name": name, "time": "0.000"}
            element = ElementTree.SubElement(above, "testcase", about)
            if case.problem is not None:
                why = {"message": case.message, "type": case.problem}
                ElementTree.SubElement(element, case.problem, why).text = case.text or None
    ElementTree.indent(root)
    text = ElementTree.tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="utf-8"?>\n{_clean(text)}\n'


def _counts(name: str, cases: Sequence[Case], seconds: float) -> dict[str, str]:
    problems = [case.problem for case in cases]
    counted = {"failures": FAILURE, "errors": ERROR, "skipped": SKIPPED}
    counts = {plural: str(problems.count(problem)) for plural, problem in counted.items()}
    return {"name": name, "tests": str(len(cases)), **counts, "time": f"{seconds:.3f}"}


def _clean(text: str) -> str:
    return _NO_XML.sub("\ufffd", text)


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
        cases = tuple(map(case_of, self.checks))
        return Suite(name, cases or (self._case_of_verdict(),), begun, seconds)

    def _case_of_verdict(self) -> Case:
        """Return the verdict as the only test case."""
        verdict = self.verdict
        if verdict.passed:
            return Case("verdict")
        failures = (f"{name}: {off} {advice}" for name, off, advice in verdict.failures)
        said = [verdict.sentence, *failures, *verdict.remarks]
        problem = ERROR if verdict.passed is None else FAILURE
        return Case("verdict", problem, verdict.sentence, "\n".join(said))


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


def facts_of_terms(result: Result) -> list[tuple[str, str]]:
    """Return facts of a chain that is not uniform: force on the wall, velocities, damping, end."""
    facts = []
    for wall, k in (result.scene.near_wall, 0), (result.scene.wall, -1):
        if wall is None:
            continue
        name = result.scene.contact_name(result.scene.contacts[k])
        force, time = result.peak_force[k], result.peak_time[k]
        digits = known_digits(force, result.peak_errors[k])
        at = " N" if np.isnan(time) else f" N at {time:.6g} s"
        facts.append((f"largest force on {name}", digits if digits == NO_DIGIT else digits + at))
    first, last = (f"{v:.3g} m/s" for v in (result.velocity[0], result.velocity[-1]))
    if np.isfinite(result.velocity[0]):
        others = f", the last granule {last}" if result.velocity.size > 1 else ""
        facts.append(("velocity at the end", f"granule 1 {first}{others}"))
    if (spheres := parting(result.scene)) is not None:
        at = "" if spheres.speed is None else f" of {spheres.speed:.3g} m/s, {spheres.whose}"
        part = f"{spheres.restitution:.4f} of their speed{at}"
        facts.append(("two like spheres part with", part))
    facts.append(("end of the run", f"{result.scene.end_time:.6g} s"))
    return facts


def shown_contacts(result: Result) -> list[int]:
    """Return the contacts up to p + 1; without p the first few contacts."""
    p = result.transition_granules
    last = 11 if p is None else p + 1
    return [int(contact) for contact in result.contact if contact <= last]


def cost(result: Result) -> str:
    """Return words for wall time and steps of a run."""
    return (
        f"{duration(result.wall_time)}, {result.steps:,} steps of at most {result.dt:.3g} s"
        f" ({result.backend}, {result.method})"
    )


def duration(seconds: float) -> str:
    """Return a time with three digits, in ms below a second."""
    return f"{seconds:.3g} s" if seconds >= 1 else f"{1e3 * seconds:.3g} ms"


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


def similar_scene(result: Result) -> str | None:
    """Return words for the similar scene that a code was given; None for the scene itself."""
    lost = result.lost_digits
    if lost is None or lost.young_modulus == result.scene.chain.first_modulus:
        return None
    is_measured = result.scene.chain.stiffness is not None
    chain = "softer chain" if is_measured else f"chain of E = {lost.young_modulus:.3g} Pa"
    return (
        f"a similar {chain}, scaled back: absolute coordinates"
        f" would have cost the peaks {lost.predicted:.0e}, and now cost at most {lost.bound:.0e}"
    )


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
