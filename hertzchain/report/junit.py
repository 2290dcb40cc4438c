"""Checks as JUnit XML, in the form that Jenkins, GitLab and GitHub Actions read (junit-10.xsd)."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from itertools import count
from typing import TYPE_CHECKING
from xml.etree import ElementTree

if TYPE_CHECKING:
    from hertzchain.verdict.comparison import Comparison
    from hertzchain.verdict.judgement import Judgement

FAILURE, ERROR, SKIPPED = "failure", "error", "skipped"
"""What a case may be that did not pass: off; without a number; not asked for."""

_NO_XML = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""What XML 1.0 has no way to write, not even as a reference."""


@dataclass(frozen=True)
class Case:
    """One check as CI systems count them.

    Parameters
    ----------
    name
        What was checked.
    problem
        ``failure``, ``error`` or ``skipped``; None where it passed.
    message
        One line on why it did not pass.
    text
        All that is known about it.
    """

    name: str
    problem: str | None = None
    message: str = ""
    text: str = ""


@dataclass(frozen=True)
class Suite:
    """Checks that were made together.

    Parameters
    ----------
    name
        Of the suite: what CI systems tell its cases from others by.
    cases
        Its checks.
    begun
        When it began.
    seconds
        How long all of it took.
    """

    name: str
    cases: tuple[Case, ...]
    begun: datetime
    seconds: float

    def count(self, problem: str) -> int:
        """Number of cases with a problem."""
        return sum(case.problem == problem for case in self.cases)


def case(
    name: str,
    measured: float | None,
    expected: float | None,
    tolerance: float | None,
    passed: bool,
    reason: str,
) -> Case:
    """A number beside the one it should be, as a case.

    Parameters
    ----------
    name
        What was measured.
    measured, expected, tolerance
        The numbers; None, or not finite, where nothing could be measured.
    passed
        Whether they agree.
    reason
        Why this tolerance, or why there is no number.

    Returns
    -------
    A case that failed where the number is off, and an error where there is none: what could not be
    checked has not passed.
    """
    if passed:
        return Case(name)
    if measured is None or expected is None or not math.isfinite(measured):
        return Case(name, ERROR, f"{name}: {reason}", reason)
    lines = [
        f"measured {_shortest(measured)}",
        f"expected {_shortest(expected)}",
        f"tolerance {'none' if tolerance is None else _shortest(tolerance)}",
    ]
    message = f"{', '.join(lines)}: {reason}"
    difference = f"difference {_shortest(measured - expected)}"
    return Case(name, FAILURE, message, "\n".join([*lines, difference, f"reason: {reason}"]))


def _shortest(number: float) -> str:
    """As few digits as tell it from every other: differences may be of 1e-13."""
    return repr(float(number))


def of_comparison(comparison: Comparison, name: str, begun: datetime, seconds: float) -> Suite:
    """The checks of a comparison, each a case.

    Parameters
    ----------
    comparison
        What was compared.
    name
        Of the scene.
    begun, seconds
        When, and for how long.
    """
    cases = tuple(
        case(
            check.name,
            check.measured,
            check.expected,
            check.tolerance,
            check.passed,
            check.reason,
        )
        for check in comparison.checks
    )
    return Suite(f"hertzchain.compare.{_one_part(name)}", cases, begun, seconds)


def of_judgement(judgement: Judgement, name: str, begun: datetime, seconds: float) -> Suite:
    """The verdict over peaks from any code, then each contact, each a case.

    Contacts that were not given, or are not pressed enough to be judged, are skipped: they have no
    part in the verdict.

    Parameters
    ----------
    judgement
        What was judged.
    name
        Of the scene.
    begun, seconds
        When, and for how long.
    """
    cases = [Case("verdict")]
    if judgement.verdict != "pass":
        cause = "" if judgement.cause is None else f"Likely cause: {judgement.cause}"
        message = "; ".join(part for part in (judgement.summary, cause) if part)
        text = "\n".join(part for part in (judgement.summary, cause, *judgement.remarks) if part)
        none_judged = judgement.largest_difference is None
        cases = [Case("verdict", ERROR if none_judged else FAILURE, message, text)]
    unit = "peak force [N] within the relative tolerance asked for"
    for row in judgement.rows:
        contact = f"contact {row['contact']}"
        given, reference = row["given_N"], row["reference_N"]
        assert reference is not None
        if row["passed"] is None:
            why = "no peak was given" if given is None else "pressed too little to be judged"
            cases.append(Case(contact, SKIPPED, why))
            continue
        tolerance = judgement.tolerance * reference
        cases.append(case(contact, given, reference, tolerance, bool(row["passed"]), unit))
    return Suite(f"hertzchain.judge.{_one_part(name)}", tuple(cases), begun, seconds)


def _one_part(name: str) -> str:
    """A name without dots: CI systems take what is before the last one for a folder."""
    return name.replace(".", "_")


def to_xml(suites: Sequence[Suite]) -> str:
    """Suites as JUnit XML.

    The time is that of a suite: its simulations serve all its cases, and a case by itself, two
    numbers compared, takes none. A name that comes twice in a suite gets a number, as CI systems
    drop the second. What XML cannot hold is replaced by U+FFFD.
    """
    root = ElementTree.Element(
        "testsuites",
        {
            "name": "hertzchain",
            "tests": str(sum(len(suite.cases) for suite in suites)),
            "failures": str(sum(suite.count(FAILURE) for suite in suites)),
            "errors": str(sum(suite.count(ERROR) for suite in suites)),
            "time": f"{sum(suite.seconds for suite in suites):.3f}",
        },
    )
    for suite in suites:
        _add_suite(root, suite)
    ElementTree.indent(root)
    body = ElementTree.tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="utf-8"?>\n{body}\n'


def _add_suite(root: ElementTree.Element, suite: Suite) -> None:
    above = ElementTree.SubElement(
        root,
        "testsuite",
        {
            "name": _clean(suite.name),
            "tests": str(len(suite.cases)),
            "failures": str(suite.count(FAILURE)),
            "errors": str(suite.count(ERROR)),
            "skipped": str(suite.count(SKIPPED)),
            "time": f"{suite.seconds:.3f}",
            "timestamp": suite.begun.isoformat(timespec="seconds"),
        },
    )
    seen: set[str] = set()
    for one in suite.cases:
        clean = name = _clean(one.name)
        numbers = count(2)
        while name in seen:
            name = f"{clean} ({next(numbers)})"
        seen.add(name)
        here = ElementTree.SubElement(
            above,
            "testcase",
            {"classname": _clean(suite.name), "name": name, "time": "0.000"},
        )
        if one.problem is not None:
            attributes = {"message": _clean(one.message), "type": one.problem}
            ElementTree.SubElement(here, one.problem, attributes).text = _clean(one.text) or None


def _clean(text: str) -> str:
    return _NO_XML.sub("\ufffd", text)
