"""Checks as JUnit XML, which CI systems read."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from itertools import count
from typing import TYPE_CHECKING
from xml.etree import ElementTree

from hertzchain.known.certificate import WRONG, Certificate
from hertzchain.report.document import Document

if TYPE_CHECKING:
    from hertzchain.verdict.check import Check

# too different; without a number; not wanted
FAILURE, ERROR, SKIPPED = "failure", "error", "skipped"


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
    cases: Sequence[Case]
    begun: datetime
    seconds: float


def of_document(document: Document, scene: str, begun: datetime, seconds: float) -> Suite:
    """Return the checks of a document as test cases, or its verdict if it has no checks."""
    cases = [case_of(check) for check in document.checks]
    if not cases:
        verdict = document.verdict
        failures = (f"{name}: {off} {advice}" for name, off, advice in verdict.failures)
        text = "\n".join([verdict.sentence, *failures, *verdict.remarks])
        problem = ERROR if verdict.passed is None else FAILURE
        failed = Case("verdict", problem, verdict.sentence, text)
        cases = [Case("verdict") if verdict.passed else failed]
    # CI systems take dots for folders.
    name = f"hertzchain.{document.command}.{scene.replace('.', '_')}"
    return Suite(name, cases, begun, seconds)


def of_certificate(certificate: Certificate, begun: datetime) -> Suite:
    """Return the rows as test cases; those that could not be tested by choice are skipped."""
    cases = []
    for row in certificate.rows:
        problem = FAILURE if row.grade == WRONG else ERROR if row.failed else SKIPPED
        failed = Case(row.case.name, problem, f"{row.words}: {row.reason}", row.case.tests)
        cases.append(Case(row.case.name) if row.passed else failed)
    name = f"hertzchain.certify.{certificate.program.replace('.', '_')}"
    return Suite(name, cases, begun, certificate.seconds)


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
        names: set[str] = set()
        for case in suite.cases:
            name, number = _clean(case.name), count(2)
            while name in names:
                name = f"{_clean(case.name)} ({next(number)})"
            names.add(name)
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
    """Replace the characters that XML 1.0 cannot contain, not even as references."""
    no_xml = "[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]"
    return re.sub(no_xml, "\ufffd", text)
