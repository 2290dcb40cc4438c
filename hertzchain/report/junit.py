"""Checks as JUnit XML, in the form that Jenkins, GitLab and GitHub Actions read (junit-10.xsd)."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from itertools import count
from xml.etree import ElementTree

# too different; without a number; not wanted
FAILURE, ERROR, SKIPPED = "failure", "error", "skipped"

Value = float | None  # numbers of a check; None where nothing could be measured

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


def case(
    name: str,
    measured: Value,
    expected: Value,
    tolerance: Value,
    passed: bool,
    reason: str,
    subject: str = "",
) -> Case:
    """Return a check as a test case; a check without a number is an error.

    The message has the ``subject``, by default the name, the difference, and its place if the
    reason ends with one.
    """
    if passed:
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
        f"{subject or name} is {float(measured)!r}, it should be {float(expected)!r}: off by"
        f" {abs(measured - expected):.2g}{allowed}{where}"
    )
    return Case(name, FAILURE, message, "\n".join(text))


def to_xml(suites: Sequence[Suite]) -> str:
    """Return suites as JUnit XML; characters that XML cannot contain become U+FFFD.

    Only a suite has a time, because its simulations serve all its cases. A name that occurs twice
    in a suite gets a number, because CI systems drop the second.
    """
    cases = [one for suite in suites for one in suite.cases]
    seconds = sum(suite.seconds for suite in suites)
    root = ElementTree.Element("testsuites", _counts("hertzchain", cases, seconds))
    root.attrib.pop("skipped")  # the schema allows it for a suite only
    for suite in suites:
        about = _counts(suite.name, suite.cases, suite.seconds)
        about["timestamp"] = suite.begun.isoformat(timespec="seconds")
        above = ElementTree.SubElement(root, "testsuite", about)
        seen: set[str] = set()
        for one in suite.cases:
            name, number = _clean(one.name), count(2)
            while name in seen:
                name = f"{_clean(one.name)} ({next(number)})"
            seen.add(name)
            about = {"classname": suite.name, "name": name, "time": "0.000"}
            here = ElementTree.SubElement(above, "testcase", about)
            if one.problem is not None:
                why = {"message": one.message, "type": one.problem}
                ElementTree.SubElement(here, one.problem, why).text = one.text or None
    ElementTree.indent(root)
    text = ElementTree.tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="utf-8"?>\n{_clean(text)}\n'


def _counts(name: str, cases: Sequence[Case], seconds: float) -> dict[str, str]:
    problems = [one.problem for one in cases]
    counted = {"failures": FAILURE, "errors": ERROR, "skipped": SKIPPED}
    counts = {plural: str(problems.count(problem)) for plural, problem in counted.items()}
    return {"name": name, "tests": str(len(cases)), **counts, "time": f"{seconds:.3f}"}


def _clean(text: str) -> str:
    return _NO_XML.sub("\ufffd", text)
