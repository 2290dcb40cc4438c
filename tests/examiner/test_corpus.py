"""Decks as users write them: right ones pass; mistakes are found, with a line, and corrected."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from _pytest.mark.structures import ParameterSet

import hertzchain as hc
from tests.engines.lammps.reading.chains import SCENE, Deck
from tests.examiner.corpus import (
    DECKS,
    HARMLESS,
    MISTAKES,
    PAIRS,
    UNFIXED,
    VARIABLES,
    Mistake,
    copied,
    scene_of,
)
from tests.examiner.test_lint import ROWS

pytestmark = pytest.mark.lammps

QUICK = {"steel_cgs", "struck", "a piston by setforce", "tsuji with e = 1", "no hold"}
"""Decks and mistakes that the default suite examines: one and two seconds each."""

WORSE = 1e-2, 1e-5
"""How far off a peak may be after a correction: a share of what it was, and in all. Peaks are read
between steps, which lie elsewhere in a corrected run."""


def each(names: Sequence[str]) -> list[ParameterSet]:
    """Names with their marks: all but a few are slow."""
    return [pytest.param(name, marks=[pytest.mark.slow] * (name not in QUICK)) for name in names]


@pytest.mark.parametrize("name", each([*DECKS]))
def test_right_decks(name: str, tmp_path: Path) -> None:
    deck, *changes = DECKS[name]
    path = copied(tmp_path, deck, changes)
    examined = hc.examine(scene_of(deck), path, VARIABLES.get(deck))
    assert [check.sentence for check in examined.to_correct] == []
    assert examined.verdict == "pass"
    # Another integrator, another reading of peaks; their steps are short.
    reference = hc.Native("reference").run(examined.scene).peak_force[examined.judged]
    ours = examined.contents.peak_force[: examined.judged.size][examined.judged]
    assert np.max(np.abs(ours / reference - 1)) < 2e-4  # 7.9e-5 measured


def test_a_correction_has_all_commands_that_set_a_number(tmp_path: Path) -> None:
    changes = ["* * hertz/material ${E}", "* * hertz/material 7e9", "4/3*${E}", "4/3*7e9"]
    examined = hc.examine(scene_of("wall"), copied(tmp_path, "wall", changes))
    (finding,) = examined.findings
    assert [line.line for line in finding.correction] == [19, 21]  # those of beads and of the wall


SETTLED = """fix v all viscous 70
timestep 1e-7
run 15000
unfix v
velocity all set 0 0 0
variable t0 equal $(time)
variable F equal "40*sin(PI*(time-v_t0)/40e-6)^2*(time<(v_t0+40e-6))"
"""
"""A chain settles before the shock."""

FORMULA = 'variable F equal "40*sin(PI*time/40e-6)^2*(time<40e-6)"\n'


@pytest.mark.slow
@pytest.mark.parametrize(("drag", "verdict"), [("70", "pass"), ("5", "fail")])
def test_a_chain_that_finds_its_places(tmp_path: Path, drag: str, verdict: str) -> None:
    """Its numbers are those when the shock begins: with too little drag it still swings."""
    unsettled = ("(2*${R}-${delta})", "2*${R}")
    settled = (FORMULA, SETTLED.replace("70", drag))
    path = copied(tmp_path, "precompressed", (*settled, *unsettled))
    examined = hc.examine(scene_of("precompressed"), path)
    assert examined.verdict == verdict
    assert any("the shock begins 0.0015 s after" in remark for remark in examined.remarks)
    names = {check.kind for check in examined.to_correct}
    assert names == (set() if verdict == "pass" else {"distance"})


def test_files_are_looked_for_in_the_working_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As LAMMPS does; a file of that name next to the deck is another one."""
    working, there = tmp_path / "here", tmp_path / "there"
    for folder, modulus in ((working, "193e9"), (there, "100e9")):
        folder.mkdir()
        copied(folder, "steel_data", ("193e9", modulus))
    monkeypatch.chdir(working)
    said: list[str] = []
    done = hc.examine(scene_of("steel"), there / "in.steel_data", progress=said.append)
    assert done.verdict == "pass"
    assert said == ["asking LAMMPS what it makes of the deck", "running the deck",
                    "reading the applied forces", "native: the reference method"]  # fmt: skip


# Motions that begin after the chain has settled

PRESSED = """group last id 6
fix load hit addforce 5 0 0
fix from last addforce -5 0 0
variable force equal 0
fix air all viscous 50
run 7000
unfix air
velocity hit set 0.3 0 0
"""

SHORT, LOAD = hc.Scene(SCENE.chain, hc.Striker(0.3), hc.Run(6e-5)), hc.Precompression(5.0)

LED = """variable force equal 0
run 100
unfix motion
group rest subtract all hit
fix m rest nve
fix lead hit move linear 0.3 0 0
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scene", "more", "begins"),
    [
        (
            replace(SHORT, shock=hc.Striker(0.3, loaded=True), precompression=LOAD),
            PRESSED,
            "0.0007",
        ),
        (replace(SHORT, shock=hc.Piston(velocity=0.3)), LED, "1e-05"),
    ],
    ids=["striker", "piston"],
)
def test_the_shock_is_a_motion(scene: hc.Scene, more: str, begins: str, tmp_path: Path) -> None:
    examined = hc.examine(scene, Deck(more=more, steps=600).write(tmp_path))
    assert (examined.to_correct, examined.verdict) == ((), "pass")
    assert f"the shock begins {begins} s after" in examined.remarks[0]


# Mistakes


def is_found(examined: hc.DeckExamination, mistake: Mistake) -> None:
    """Assert that a check of the mistake failed, and that its line is blamed or corrected.

    What follows from another finding has the line of that one.
    """
    blamed = [
        (check.name, [check.place.written if check.place else "",
                      *(line.written for line in examined.findings[
                          k if finding.follows is None else finding.follows].correction)])
        for k, finding in enumerate(examined.findings)
        for check in finding.checks
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


@pytest.mark.parametrize("name", each([*MISTAKES]))
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
    [pytest.param(pair, id=" and ".join(pair), marks=pytest.mark.slow) for pair in PAIRS],
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
