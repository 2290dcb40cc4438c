"""Certificates of a LAMMPS: right programs pass, planted defects are found in their rows."""

from __future__ import annotations

import json
import os
import re
import stat
import sys
import tomllib
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from shutil import which

import pytest

import hertzchain as hc
from hertzchain.errors import SceneError
from hertzchain.known.certificate import CASES, ROUND_OFF, UNSUPPORTED, UNTESTED, WRONG, certify
from hertzchain.report.console import suite
from tests.command_line import Command
from tests.oracles.json_schema import problems

LMP = str(Path(sys.executable).with_name("lmp"))
DECKS = Path(__file__).parents[2] / "lammps_inputs" / "certify"

FAKE = """\
#!{python}
import os, re, sys
text = open("in.chain").read() if "-in" in sys.argv else ""
for pattern, replacement in {edits!r}:
    text = re.sub(pattern, replacement, text, flags=re.M)
{more}
name = "in.%d" % os.getpid()  # of one rank
if text:
    open(name, "w").write(text)
os.execv({lmp!r}, [{lmp!r}, *(name if word == "in.chain" else word for word in sys.argv[1:])])
"""
"""A program that changes the deck before LAMMPS gets it."""

SINGLE = """\
import struct
single = lambda x: repr(struct.unpack("f", struct.pack("f", float(x)))[0])
text = re.sub(r"(?<=single )\\S+", lambda found: single(found[0]), text)
"""

FORCES = "force over time", "gran/hertz/history", "restart in the middle"
DEFECTS = tomllib.loads(Path(__file__).with_name("defects.toml").read_text(encoding="utf-8"))
"""Edits of the deck, rows that are wrong by them, and a row that is right, by the defect's name."""

QUICK = "a wall that gives NaN", "a slow piston"
"""The command has another one, which is wrong by a number, too."""


def fake(
    folder: Path, edits: Sequence[tuple[str, str]], more: str = "", lmp: str | None = LMP
) -> str:
    path = folder / "lmp"
    path.write_text(FAKE.format(python=sys.executable, edits=list(edits), lmp=lmp, more=more))
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return str(path)


@pytest.mark.parametrize(
    ("name", "edits", "wrong", "right"),
    [
        pytest.param(name, *row.values(), id=name, marks=[pytest.mark.slow] * (name not in QUICK))
        for name, row in DEFECTS.items()
    ],
)
def test_a_planted_defect_is_found_in_its_rows(
    tmp_path: Path, name: str, edits: Sequence[tuple[str, str]], wrong: Sequence[str], right: str
) -> None:
    program = fake(tmp_path, edits, SINGLE if "single" in name else "")
    report = hc.certify(program, only=[*wrong, right])
    grades = {row.case.name: row.grade for row in report.rows}
    assert grades == {**dict.fromkeys(wrong, WRONG), right: ROUND_OFF}
    assert report.status == 1
    assert report.sentence.endswith(", ".join(wrong))


@pytest.mark.slow
def test_half_the_force_on_two_ranks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", f"{Path(LMP).parent}:{os.environ['PATH']}")
    edits = [(r"(processors 2(?s:.*?)force equal )(.*)", r"\1 0.5*(\2)")]
    program = fake(tmp_path, edits)
    rows = "force over time", "granules over ranks"
    on_two = hc.certify(program, ranks=2, only=rows)
    assert [row.grade for row in on_two.rows] == [WRONG, ROUND_OFF]
    alone = hc.certify(program, only=rows)
    assert [row.grade for row in alone.rows] == [ROUND_OFF, UNTESTED]


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> tuple[hc.Certificate, Path]:
    decks = tmp_path_factory.mktemp("decks")
    return hc.certify(folder=decks), decks


def test_the_module_is_right_in_every_row(whole: tuple[hc.Certificate, Path]) -> None:
    report, decks = whole
    grades = {row.case.name: row.grade for row in report.rows}
    assert grades == {
        name: UNTESTED if case.needs_ranks else ROUND_OFF for name, case in CASES.items()
    }
    of_lammps = {name for name, case in CASES.items() if case.of_lammps}
    assert of_lammps == {"gran/hertz/history", "granules over ranks", "restart in the middle"}
    assert (report.status, len(list(decks.glob("in.*")))) == (0, len(CASES) - 1)
    for case in CASES.values():
        assert hc.Scene.from_toml(decks / f"{case.file}.toml") == case.scene
    assert all(
        "granular" in row.styles or "gran/hertz/history" in row.styles
        for row in report.rows
        if row.passed
    )


def without_numbers(text: str) -> str:
    return re.sub(r"-?\d[\d.]*(e[-+]?\d+)?", "#", text)  # digits may round otherwise elsewhere


def test_the_decks_that_the_matrix_links(whole: tuple[hc.Certificate, Path]) -> None:
    for case in CASES.values():
        name = f"in.{case.file}"
        assert hc.Scene.from_toml(DECKS / f"{case.file}.toml") == case.scene
        if not case.needs_ranks:
            deck, linked = (folder / name for folder in (whole[1], DECKS))
            assert without_numbers(deck.read_text()) == without_numbers(linked.read_text())


EACH = [
    pytest.param("liggghts", 13, marks=[pytest.mark.liggghts, pytest.mark.slow]),
    pytest.param("yade", 12, marks=[pytest.mark.yade, pytest.mark.slow]),
]


@pytest.mark.parametrize(("program", "right"), EACH)
def test_other_codes(program: str, right: int, tmp_path: Path) -> None:
    report = certify(program, folder=tmp_path)
    start = f"{report.code} {report.version} ({program}): {right} right to "
    assert report.sentence.startswith(start)
    assert report.status == 0
    assert [row.case.name for row in report.rows if row.grade == UNTESTED] == [
        name for name, case in CASES.items() if case.of_lammps
    ]
    assert len(list(tmp_path.glob("in.*"))) == right


@pytest.mark.liggghts
def test_a_defect_planted_in_another_code(tmp_path: Path) -> None:
    path = Path(fake(tmp_path, [(r"(density) 7958\.0", r"\1 7950.0")], lmp=which("liggghts")))
    path = path.rename(tmp_path / "liggghts-wrong")
    (row,) = certify(path, only=["like granules"]).rows
    assert row.grade == WRONG, row.reason


def test_a_suffix_that_fell_back_is_not_tested() -> None:
    report = certify(LMP, suffix="omp", only=["like granules", "gran/hertz/history", "gravity"])
    assert [row.grade for row in report.rows] == [UNTESTED, ROUND_OFF, ROUND_OFF]
    assert "granular ran without /omp" in report.rows[0].reason
    assert "gran/hertz/history/omp" in report.rows[1].styles
    assert report.status == 0


def test_a_package_that_is_not_there_is_not_supported() -> None:
    report = certify(LMP, suffix="kk", only=["like granules"])
    assert (report.rows[0].grade, report.status) == (UNSUPPORTED, 2)


@pytest.mark.parametrize(("how", "word"), [
    ({"suffix": "cuda"}, "suffix"), ({"ranks": 0}, "ranks"), ({"ranks": 2}, "lmp"),
    ({"only": ["friction"]}, "only"), ({"lmp": "yade", "ranks": 2}, "ranks"),
    ({"lmp": "/opt/liggghts", "suffix": "omp"}, "suffix"),
])  # fmt: skip
def test_what_cannot_be(how: dict[str, object], word: str) -> None:
    with pytest.raises(SceneError, match=word):
        certify(**how)  # type: ignore[arg-type]


def test_a_program_that_is_missing_or_crashes(tmp_path: Path) -> None:
    missing = certify("no-such-lmp", only=["striker"], folder=tmp_path)
    assert (tmp_path / f"{CASES['striker'].file}.toml").exists()
    crashing = certify(fake(tmp_path, [], "if text: os.kill(os.getpid(), 11)"), only=["striker"])
    assert "SIGSEGV" in crashing.rows[0].reason
    stopped = certify(fake(tmp_path, [], "if text: sys.exit(3)"), only=["striker"])
    certificates = missing, crashing, stopped
    grades = [(report.rows[0].grade, report.status) for report in certificates]
    assert grades == [(UNTESTED, 2), (WRONG, 1), (UNTESTED, 2)]
    problems = [suite(report, datetime.now(UTC)).cases[0].problem for report in certificates]
    assert problems == ["error", "failure", "error"]


def test_the_command(hertzchain: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    said = hertzchain("certify", "--lmp", "no-such-lmp", "--lmp", "liggghts-none")
    assert said.status == 2
    lines = said.out.splitlines()
    assert lines[0].startswith("no-such-lmp is missing or not a program: name one that is there")
    assert lines[-2:] == [
        "LAMMPS (no-such-lmp): 19 not tested",
        "LIGGGHTS (liggghts-none): 19 not tested",
    ]
    few = {name: CASES[name] for name in (*FORCES, "striker")}
    monkeypatch.setattr("hertzchain.known.certificate.CASES", few)
    folder, junit = tmp_path / "out", tmp_path / "junit.xml"
    program = fake(tmp_path, DEFECTS["half the force"]["edits"])
    done = hertzchain("certify", "--lmp", program, "-o", folder, "--junit", junit, "--json")
    document = done.json()
    assert (done.status, document["status"]) == (1, 1)
    assert not list(problems(document, "certify.json"))
    assert document == json.loads((folder / "certify.json").read_text())
    failures = re.findall(r'<failure message="wrong by \d\.\de-01: differs', junit.read_text())
    assert len(failures) == len(FORCES)
