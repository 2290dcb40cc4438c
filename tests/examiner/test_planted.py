"""Each planted mistake is found, with the line that makes it; what is printed as right is right."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest

import hertzchain as hc
from tests.examiner.corpus import (
    DEFECTS,
    HARMLESS,
    MISTAKES,
    PAIRS,
    UNFIXED,
    Mistake,
    copied,
    scene_of,
)
from tests.examiner.lint.test_decks import ROWS

pytestmark = pytest.mark.lammps

QUICK = {"tsuji with e = 1", "no hold"}
"""Mistakes that the default suite looks for: two seconds each."""

WORSE = 1e-2, 1e-5
"""How far off a peak may be after a correction: a share of what it was, and in all. Peaks are read
between steps, which lie elsewhere in a corrected run."""


def is_found(examined: hc.DeckExamination, mistake: Mistake) -> None:
    """Assert that a check of the mistake failed, and that its line is blamed or corrected.

    What follows from another finding has the line of that one.
    """
    blamed = [
        (
            check.name,
            [check.place.written if check.place else "",
             *(line.written for line in (by if by.follows is None
                                       else examined.findings[by.follows]).correction)],
        )
        for by in examined.findings
        for check in by.checks
    ]  # fmt: skip
    assert any(
        name.startswith(mistake.check) and any(mistake.line in line for line in lines)
        for name, lines in blamed
    ), blamed


def with_corrections(
    examined: hc.DeckExamination, path: Path, findings: Sequence[int]
) -> hc.DeckExamination:
    """The examination of the deck with the corrections of some findings alone."""
    edits = {
        (line.file, line.line): line.commands
        for k in findings
        for line in examined.findings[k].correction
    }
    path.write_text(replace(examined, edits=edits).fix, encoding="utf-8")
    return hc.examine(examined.scene, path)


def nothing_is_worse(before: hc.DeckExamination, after: hc.DeckExamination) -> None:
    """Assert that nothing fails that passed, and that no peak is further off."""
    passed = {check.kind for check in before.checks if check.passed}
    assert not passed & {check.kind for check in after.to_correct}
    both = before.judged & after.judged
    was, now = before.error_of_peaks(both), after.error_of_peaks(both)
    share, least = WORSE
    assert before.contents.stopped or now <= was * (1 + share) + least


def marks(name: str) -> list[pytest.MarkDecorator]:
    """A defect that is removed fails here, and is taken out of the list."""
    slow = [] if name in QUICK else [pytest.mark.slow]
    return [*slow, *([pytest.mark.xfail(strict=True)] if name in DEFECTS else [])]


@pytest.mark.parametrize("name", [pytest.param(name, marks=marks(name)) for name in MISTAKES])
def test_a_mistake_is_found_and_corrected(name: str, tmp_path: Path) -> None:
    mistake = MISTAKES[name]
    path = copied(tmp_path, mistake.deck, mistake.changes)
    said: list[str] = []
    strict = name in HARMLESS
    if strict:
        lenient = hc.examine(scene_of(mistake.deck), path)
        assert lenient.passed
        assert any(check.name.startswith(mistake.check) for check in lenient.small)
    examined = hc.examine(scene_of(mistake.deck), path, progress=said.append, strict=strict)
    assert ("trying corrections" in said) == examined.contents.is_chain
    assert examined.verdict == "fail"
    is_found(examined, mistake)
    fixed = tmp_path / "in.fixed"
    fixed.write_text(examined.fix, encoding="utf-8")
    whole = hc.examine(examined.scene, fixed, strict=strict)
    assert (whole.verdict == "pass") == (name not in UNFIXED)
    printed = [k for k, finding in enumerate(examined.findings) if finding.correction]
    together = [k for k in printed if examined.findings[k].with_others]
    for tried in [*([k] for k in printed if k not in together), *([printed] if together else [])]:
        after = whole if tried == printed else with_corrections(examined, fixed, tried)
        corrected = {check.kind for k in tried for check in examined.findings[k].checks}
        assert not corrected & {check.kind for check in after.to_correct}
        nothing_is_worse(examined, after)


@pytest.mark.parametrize(
    "pair",
    [pytest.param(pair, id=" and ".join(pair), marks=marks(" and ".join(pair))) for pair in PAIRS],
)
def test_two_mistakes(pair: list[str], tmp_path: Path) -> None:
    first, second = (MISTAKES[name] for name in pair)
    path = copied(tmp_path, first.deck, first.changes + second.changes)
    examined = hc.examine(scene_of(first.deck), path)
    is_found(examined, first)
    is_found(examined, second)
    fixed = tmp_path / "in.fixed"
    fixed.write_text(examined.fix, encoding="utf-8")
    assert hc.examine(examined.scene, fixed).verdict == "pass"


def test_rows_are_no_chain(tmp_path: Path) -> None:
    """Four rows of 20 granules are recognized before anything runs; nothing else is said."""
    deck = tmp_path / "in.rows"
    deck.write_text(ROWS.replace("run 1000", "run 250000000"), encoding="utf-8")
    examined = hc.examine(scene_of("steel"), deck)
    (check,) = examined.to_correct
    said = "the deck is not a chain: its 80 granules lie in 4 rows of 20, not in one"
    assert check.sentence == said
    assert check.place.line == 10
    assert examined.contents.runs == ()
