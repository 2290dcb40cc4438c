"""Each planted mistake is found, with the line that makes it and the right command."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import pytest
from markupsafe import escape

import hertzchain as hc
from hertzchain.report.examination import of_examination
from hertzchain.report.junit import to_xml
from hertzchain.report.page import page_of
from tests.verdict.deck.corpus import Deck, copied, scene_of
from tests.verdict.deck.mistakes import ELSEWHERE, PAIRS, PLAIN, Mistake
from tests.verdict.deck.slips import ALIVE, DEAD

pytestmark = pytest.mark.lammps

QUICK = {"wall place"}
"""Mistakes that the default suite looks for: a second each."""

QUICK_SLIPS = {"piston in mm/s", "modulus of type 1", "tsuji with e = 1"}
"""Slips that it corrects: two seconds each."""


def planted(folder: Path, *mistakes: Mistake) -> Path:
    """A deck of the corpus with mistakes in it."""
    path = copied(folder, Deck(mistakes[0].scene, mistakes[0].deck))
    for mistake in mistakes:
        file = folder / (mistake.file or mistake.deck)
        text = file.read_text(encoding="utf-8")
        for old, new in mistake.change:
            assert old in text, old
            text = text.replace(old, new)
        file.write_text(text, encoding="utf-8")
    return path


def is_found(examined: hc.DeckExamination, mistake: Mistake) -> None:
    """Assert that a check of the mistake failed, and names its line and the right command."""
    said = [
        (check.name, str(check.place), check.place and check.place.written, check.command)
        for check in examined.checks
        if not check.passed
    ]
    found = [
        check
        for check in examined.to_mend
        if check.name.startswith(mistake.check)
        and check.place is not None
        and (mistake.line in check.place.written or mistake.line in lines_of(examined, check))
    ]
    assert found, said


def lines_of(examined: hc.DeckExamination, check: hc.DeckCheck) -> str:
    """The lines that the correction of a check changes, as they are written."""
    return "\n".join(
        line.written
        for finding in examined.findings
        if check in finding.checks
        for line in finding.correction
    )


def is_reported(examined: hc.DeckExamination) -> None:
    """Assert that all reports can be made, and have what is to mend."""
    document = of_examination(examined)
    json.dumps(document.numbers(), allow_nan=False)
    page = page_of(document)
    xml = to_xml([document.suite("scene", datetime.now(UTC), 1.0)])
    for check in examined.to_mend:
        assert escape(check.sentence) in page
        assert xml.count("<failure") + xml.count("<error") > len(examined.to_mend) - 1


def marked(mistakes: dict[str, Mistake]) -> list[object]:
    return [
        pytest.param(one, id=name, marks=[] if name in QUICK else pytest.mark.slow)
        for name, one in mistakes.items()
    ]


@pytest.mark.parametrize("mistake", [*marked(PLAIN), *marked(ELSEWHERE)])
def test_one_mistake(mistake: Mistake, tmp_path: Path) -> None:
    examined = hc.examine(scene_of(mistake.scene), planted(tmp_path, mistake))
    assert examined.verdict == "fail"
    is_found(examined, mistake)
    is_reported(examined)


SAID = {
    "restitution": (
        r"damping of contact \d+ is \S+ N, the scene has \S+ N, where granules approach with"
        r" \S+ m/s and the elastic force is \S+ N"
    ),
    "attraction": (
        r"contact \d+ pulls: where granules part with \S+ m/s, damping is -\S+ N and the elastic"
        r" force \S+ N; contacts of the scene do not pull"
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize(("name", "words"), SAID.items(), ids=SAID)
def test_what_damping_does_is_said(name: str, words: str, tmp_path: Path) -> None:
    mistake = ELSEWHERE[name]
    done = hc.examine(scene_of(mistake.scene), planted(tmp_path, mistake))
    assert re.fullmatch(words, done.to_mend[0].sentence)


@pytest.mark.slow
@pytest.mark.parametrize("pair", PAIRS, ids="-".join)
def test_two_mistakes(pair: tuple[str, str], tmp_path: Path) -> None:
    both = [PLAIN[name] for name in pair]
    examined = hc.examine(scene_of("steel"), planted(tmp_path, *both))
    assert examined.verdict == "fail"
    for mistake in both:
        is_found(examined, mistake)


@pytest.mark.parametrize(
    "slip",
    [
        pytest.param(one, id=name, marks=[] if name in QUICK_SLIPS else pytest.mark.slow)
        for name, one in {**DEAD, **ALIVE, **PLAIN, **ELSEWHERE}.items()
    ],
)
def test_a_slip_is_corrected(slip: Mistake, tmp_path: Path) -> None:
    """The deck with all corrections is the scene's; each that is shown makes nothing worse."""
    scene, path = scene_of(slip.scene), planted(tmp_path, slip)
    examined = hc.examine(scene, path)
    assert examined.verdict == "fail"
    assert any(check.name.startswith(slip.check) for check in examined.to_mend)
    fixed = tmp_path / "in.fixed"
    fixed.write_text(examined.fix, encoding="utf-8")
    assert hc.examine(scene, fixed).verdict == "pass"
    passed = {check.kind for check in examined.checks if check.passed}
    for finding in examined.findings:
        if finding.with_others or not finding.correction:
            continue
        alone = {(line.file, line.line): line.commands for line in finding.correction}
        fixed.write_text(replace(examined, edits=alone).fix, encoding="utf-8")
        after = hc.examine(scene, fixed)
        mine = {check.kind for check in finding.checks}
        assert not mine & {check.kind for check in after.to_mend}
        assert not passed & {check.kind for check in after.to_mend}
        both = examined.judged & after.judged
        was, now = examined.error_of_peaks(both), after.error_of_peaks(both)
        assert examined.found.stopped or now <= was * 1.01 + 1e-5


def test_rows_are_no_chain(tmp_path: Path) -> None:
    """Four rows of 100 granules are recognized before anything runs; nothing else is said."""
    deck = tmp_path / "in.rows"
    deck.write_text(ROWS, encoding="utf-8")
    examined = hc.examine(scene_of("steel"), deck)
    (check,) = examined.to_mend
    assert check.sentence == (
        "the deck is no chain: its 400 granules lie in 4 rows of 100, not in one"
    )
    assert check.place is not None
    assert check.place.line == 10
    assert examined.found.runs == ()


ROWS = """units si
atom_style sphere
boundary p f f
newton off
comm_modify vel yes
lattice sc 0.0095
region box block 0 100 -2 6 -2 2
create_box 1 box
region rows block -0.1 99.1 -0.1 3.1 -0.1 0.1
create_atoms 1 region rows
set group all diameter 0.0095
set group all density 7958
pair_style granular
pair_coeff * * hertz/material 193e9 0 0.3 tangential linear_nohistory 0 0
fix 1 all nve
fix m all momentum 100 linear 1 1 1
run 250000000
"""
