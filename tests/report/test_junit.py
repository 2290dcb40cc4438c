"""JUnit XML: counts, messages and hostile text, by the rules of Jenkins's junit-10.xsd."""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import NoReturn
from xml.etree import ElementTree

import pytest

import hertzchain as hc
from hertzchain.report.document import Case, Suite, case_of, to_xml
from hertzchain.verdict.check import Check, Kind
from tests.command_line import Command, is_refused
from tests.conftest import paper_scene

BEGUN = datetime(2026, 11, 21, 14, 46, 44, tzinfo=UTC)
SCENE = paper_scene("cosine", 1.0, 2.0, granules=8)

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


def read(path: Path) -> ElementTree.Element:
    return checked(path.read_text(encoding="utf-8"))


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


# The commands


def of_checks(checks: Sequence[dict[str, object]]) -> dict[object, str | None]:
    """Return the expected JUnit case of each check in the JSON."""
    return {
        check["name"]: None
        if check["passed"]
        else ("error" if check["measured"] is None else "failure")
        for check in checks
    }


def problems(suite: ElementTree.Element) -> dict[object, str | None]:
    """Return the kind of each case, by its name."""
    return {case.attrib["name"]: case[0].tag if len(case) else None for case in suite}


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    SCENE.to_toml(tmp_path / "my.scene.toml")
    return tmp_path / "my.scene.toml"


@pytest.mark.lammps
def test_compare_writes_its_checks(hertzchain: Command, scene: Path, tmp_path: Path) -> None:
    there = tmp_path / "junit.xml"
    done = hertzchain("compare", scene, "--json", "--junit", there)
    assert done.status == 0
    (suite,) = read(there)
    assert suite.attrib["name"] == "hertzchain.compare.my_scene"  # dots would be folders
    assert problems(suite) == of_checks(done.json()["checks"])
    assert len(suite) > 10
    assert float(suite.attrib["time"]) > 0


def test_what_cannot_be_written_is_refused_before_the_work(
    hertzchain: Command, scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def work(*_: object) -> NoReturn:
        raise AssertionError("nothing may be computed")

    monkeypatch.setattr(hc.Native, "run", work)
    (tmp_path / "no").touch()
    there = tmp_path / "no" / "junit.xml"
    for arguments in (("compare", scene), ("judge", scene, "a.csv"), ("examine", scene, "in.a")):
        is_refused(hertzchain(*arguments, "--junit", there), "cannot be written")
