"""JUnit XML: counts, messages and hostile text, by the rules of Jenkins's junit-10.xsd."""

from __future__ import annotations

import re
from datetime import UTC, datetime
from xml.etree import ElementTree

from hertzchain.report.junit import Case, Suite, case_of, to_xml
from hertzchain.verdict.check import Check, Kind

BEGUN = datetime(2026, 11, 21, 14, 46, 44, tzinfo=UTC)

ATTRIBUTES = {
    "testsuites": {"name", "tests", "failures", "errors", "time"},
    "testsuite": {"name", "tests", "failures", "errors", "skipped", "time", "timestamp"},
    "testcase": {"classname", "name", "time"},
    "failure": {"message", "type"},
    "error": {"message", "type"},
    "skipped": {"message", "type"},
}
CHILDREN = {
    "testsuites": {"testsuite"},
    "testsuite": {"testcase"},
    "testcase": {"failure", "error", "skipped"},
}
"""The part of junit-10.xsd in these files."""


def checked(text: str) -> ElementTree.Element:
    """The root of a file that follows the schema and whose counts are right."""
    root = ElementTree.fromstring(text)  # noqa: S314 - our own
    assert root.tag == "testsuites"
    for element in root.iter():
        assert set(element.attrib) == ATTRIBUTES[element.tag]
        assert {child.tag for child in element} <= CHILDREN.get(element.tag, set())
        if "time" in element.attrib:
            # SUREFIRE_TIME, as far as pieces of at most three digits go.
            assert re.fullmatch(r"[0-9]+\.[0-9]{3}", element.attrib["time"])
        if element.tag == "testcase":
            assert len(element) <= 1
            assert element.attrib["name"]
    for element in (root, *root):
        assert int(element.attrib["tests"]) == len(element.findall(".//testcase"))
        assert int(element.attrib["failures"]) == len(element.findall(".//failure"))
        assert int(element.attrib["errors"]) == len(element.findall(".//error"))
    for suite in root:
        assert int(suite.attrib["skipped"]) == len(suite.findall(".//skipped"))
        assert datetime.fromisoformat(suite.attrib["timestamp"]).tzinfo is not None
        names = [case.attrib["name"] for case in suite]
        assert len(set(names)) == len(names)
    return root


def suite_of(*cases: Case) -> Suite:
    return Suite("a.suite", cases, BEGUN, 1.25)


# The text


def test_numbers_are_said_in_full() -> None:
    why = "steps end at the corners"
    off = Check(Kind("momentum", ""), "native", 1.0 + 1e-12, 1.0, 1e-13, False, why)
    (failure,) = checked(to_xml([suite_of(case_of(off))])).iter("failure")
    expected = (
        "native: momentum is 1.000000000001, it should be 1.0: off by 1e-12, allowed is 1e-13"
    )
    assert failure.attrib["message"] == expected
    assert failure.text is not None
    assert "difference 1.000088900582341e-12" in failure.text
    assert f"why this tolerance: {why}" in failure.text


def test_a_message_says_where() -> None:
    why = "only round-off; largest at granule 7"
    off = Check(Kind("mass", ""), "deck", 2.0, 1.0, None, False, why)
    (failure,) = checked(to_xml([suite_of(case_of(off))])).iter("failure")
    expected = "deck: mass is 2.0, it should be 1.0: off by 1, largest at granule 7"
    assert failure.attrib["message"] == expected


def test_suites_add_up() -> None:
    cases = (Case("a"), Case("b", "failure", "off"), Case("c", "error", "no"), Case("d", "skipped"))
    root = checked(to_xml([suite_of(*cases), suite_of(*cases[:2])]))
    assert root.attrib == {
        "name": "hertzchain", "tests": "6", "failures": "2", "errors": "1", "time": "2.500",
    }  # fmt: skip
    assert root[0].attrib["timestamp"] == "2026-11-21T14:46:44+00:00"
    assert checked(to_xml([])).attrib["tests"] == "0"


def test_names_that_come_twice_are_told_apart() -> None:
    """GitLab keeps the first of them only."""
    (suite,) = checked(to_xml([suite_of(Case("p"), Case("p", "failure"), Case("p"))]))
    assert [case.attrib["name"] for case in suite] == ["p", "p (2)", "p (3)"]
    (suite,) = checked(to_xml([suite_of(Case("p"), Case("p (2)"), Case("p"))]))
    assert [case.attrib["name"] for case in suite] == ["p", "p (2)", "p (3)"]


HOSTILE = "<b> & \"q\" 's' ]]> \x00\x08\x1b[31m \x7f\x85 \ud800 \ufffe \U0001f600 \u202e é\r\n\tend"


def test_hostile_text_goes_through() -> None:
    hostile = Suite(HOSTILE, (Case(HOSTILE, "failure", HOSTILE, HOSTILE),), BEGUN, 0.0)
    text = to_xml([hostile])
    text.encode("utf-8")
    root = checked(text)
    clean = re.sub("[\x00\x08\x1b\ud800\ufffe]", "\ufffd", HOSTILE)
    (case,) = root.iter("testcase")
    assert case.attrib["name"] == case[0].attrib["message"] == clean
    # In text XML takes a carriage return for a line's end.
    assert case[0].text == clean.replace("\r\n", "\n")
