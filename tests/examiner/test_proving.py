"""Which corrections are proven: decks whose checks and peaks are a function of their edits."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import pytest

import hertzchain as hc
from hertzchain.engines.lammps.reading.deck import Executed, FoundDeck
from hertzchain.engines.lammps.reading.text import Edits
from hertzchain.errors import RunFailed
from hertzchain.examiner import correct
from hertzchain.examiner.examined import Changes, DeckCheck, Place
from tests.examiner.made import changed, examined

LINES = ("variable V equal 1", "set all mass", "pair_coeff", "fix load", "run 10")

Outcome = Callable[[set[str]], tuple[Sequence[str], float]]
"""Function from the lines of a deck to the names of failed checks and the error of its peaks."""


def edit(line: int, *lines: str) -> Changes:
    """What stands in place of a line of the deck, counted from 1."""
    return {("in.made", line, LINES[line - 1]): lines}


def failed(name: str, line: int, *tried: Changes) -> DeckCheck:
    """A failed check of a line."""
    place = Place("in.made", line, LINES[line - 1], line - 1)
    return DeckCheck(name, "", 1.0, 2.0, 0.1, False, True, f"{name} is wrong", "", place,
                     corrections=tried)  # fmt: skip


class Deck:
    """A deck with some checks, and what is found of it with edits."""

    def __init__(
        self, scene: hc.Scene, right: FoundDeck, checks: Sequence[DeckCheck], outcome: Outcome
    ) -> None:
        self.done = examined(scene, right)
        self.checks, self.outcome = checks, outcome
        self.tried: list[Edits] = []
        commands = tuple(Executed(t, "in.made", k, t) for k, t in enumerate(LINES, start=1))
        self.contents = changed(right, commands=commands)

    def __call__(self, edits: Edits, limit: float = math.inf) -> hc.DeckExamination:
        """The examination of the deck with edits."""
        assert limit > 0
        self.tried.append(edits)
        lines = {("in.made", line): (text,) for line, text in enumerate(LINES, start=1)}
        assert edits.keys() <= lines.keys()
        now = {text for texts in (lines | dict(edits)).values() for text in texts}
        if "bad syntax" in now:
            raise RunFailed("LAMMPS stopped")
        names, error = self.outcome(now)
        checks = [
            c if c.name in names else replace(c, passed=True, differs=False, effect=0.0)
            for c in self.checks if c.name in names or c.role != "motion"
        ]  # fmt: skip
        peaks = replace(self.done.checks[-1], passed=error < 1e-3)
        stopped = "granules left the box" if "stops" in now else ""
        contents = changed(
            self.contents, peak_force=self.done.reference.peak_force * (1 + error), stopped=stopped
        )
        return replace(self.done, checks=(*checks, peaks), contents=contents)

    def proven(self) -> hc.DeckExamination:
        """The examination of the deck as it is, with its proven corrections."""
        return correct.with_findings(correct.Prover(self({}), self, 1e3))


def shown(done: hc.DeckExamination) -> list[tuple[str, list[str], bool, int | None]]:
    """Of each finding its checks, its lines, whether only with others, and what it follows."""
    return [
        (
            " ".join(check.name for check in finding.checks),
            [f"{line.line}: {'; '.join(line.commands)}" for line in finding.correction],
            finding.with_others,
            finding.follows,
        )
        for finding in done.findings
    ]


MASS, LAW, LOAD = edit(2, "right mass"), edit(3, "right law"), edit(4, "right load")


def wrong(now: set[str], **needs: str) -> list[str]:
    """Names of the checks whose line is not there."""
    return [name for name, line in needs.items() if line.replace("_", " ") not in now]


def mass_and_law(now: set[str]) -> tuple[list[str], float]:
    names = wrong(now, mass="right mass", law="right law")
    return names, 0.1 * len(names)


def law_explains_mass(now: set[str]) -> tuple[list[str], float]:
    return ([] if "right law" in now else ["mass", "law"]), 0.1 * ("right law" not in now)


def make_up(now: set[str]) -> tuple[list[str], float]:
    """Two errors that make up for one another: with one of them alone peaks are further off."""
    names = wrong(now, mass="right mass", law="right law")
    return names, (0.0, 0.3, 0.1)[len(names)]


def load_behind_mass(now: set[str]) -> tuple[list[str], float]:
    """The motion is looked at only where no number explains the peaks."""
    if "right mass" not in now:
        return ["mass"], 0.1
    names = wrong(now, motion="right load")
    return names, 0.04 * len(names)


def load_breaks(now: set[str]) -> tuple[list[str], float]:
    """A wrong line makes the mass right, and something else wrong."""
    names = wrong(now, mass="right mass", law="right law")
    if "other mass" in now:
        names = ["law", "load"]
    return names, 0.1


NOT_FIRST = edit(2, "bad syntax"), edit(2, "no help"), edit(2, "stops"), edit(2, "other mass")

CASES: dict[str, tuple[list[DeckCheck], Outcome, list[tuple[str, list[str], bool, int | None]],
                       dict[int, tuple[str, ...]]]] = {
    "the first that helps": (
        [failed("mass", 2, *NOT_FIRST, MASS), failed("law", 3, LAW), failed("load", 4)],
        load_breaks,
        [("mass", ["2: right mass"], False, None), ("law", ["3: right law"], False, None)],
        {2: ("right mass",), 3: ("right law",)},
    ),
    "one that no correction helps": (
        [failed("mass", 2, *NOT_FIRST[:2]), failed("law", 3, LAW)],
        mass_and_law,
        [("mass", [], False, None), ("law", ["3: right law"], False, None)],
        {3: ("right law",)},
    ),
    "two numbers of one line": (
        [failed("mass", 2, edit(2, "half", "x")), failed("size", 2, edit(2, "y", "half"))],
        lambda now: (wrong(now, mass="x", size="y"), 0.1),
        [("mass size", [], False, None)],
        {},
    ),
    "two numbers of one line, one after the other": (
        [failed("mass", 2, edit(2, "right mass", LINES[1])),
         failed("size", 2, edit(2, LINES[1], "right size"))],
        lambda now: (wrong(now, mass="right_mass", size="right_size"), 0.1),
        [("mass size", ["2: right mass; set all mass; right size"], False, None)],
        {2: ("right mass", "set all mass", "right size")},
    ),
    "what follows stands behind": (
        [failed("mass", 2), failed("law", 3, LAW)],
        law_explains_mass,
        [("law", ["3: right law"], False, None), ("mass", [], False, 0)],
        {3: ("right law",)},
    ),
    "what follows is not tried": (
        [failed("law", 3, LAW), failed("mass", 2, MASS)],
        law_explains_mass,
        [("law", ["3: right law"], False, None), ("mass", [], False, 0)],
        {3: ("right law",)},
    ),
    "errors that make up for one another": (
        [failed("mass", 2, MASS), failed("law", 3, LAW)],
        make_up,
        [("mass", ["2: right mass"], True, None), ("law", ["3: right law"], True, None)],
        {2: ("right mass",), 3: ("right law",)},
    ),
    "something else acts, too": (
        [failed("mass", 2, MASS), replace(failed("motion", 4, LOAD), role="motion")],
        load_behind_mass,
        [("mass", ["2: right mass"], False, None), ("motion", ["4: right load"], False, None)],
        {2: ("right mass",), 4: ("right load",)},
    ),
    "together no better": (
        [failed("mass", 2, MASS), failed("law", 3, LAW)],
        lambda now: (make_up(now)[0], 0.3 - 0.1 * len(make_up(now)[0])),
        [("mass", [], False, None), ("law", [], False, None)],
        {},
    ),
}  # fmt: skip
"""Checks that fail in front, what follows from edits, the findings, and all edits together."""


@pytest.mark.parametrize("name", CASES)
def test_corrections(name: str, scene: hc.Scene, right: FoundDeck) -> None:
    checks, outcome, findings, edits = CASES[name]
    deck = Deck(scene, right, checks, outcome)
    done = deck.proven()
    assert shown(done) == findings
    assert done.edits == {("in.made", line): lines for line, lines in edits.items()}
    assert done.remarks == deck.done.remarks
    for finding in done.findings:
        for check in finding.checks:
            assert check in done.checks
            commands = [line.commands for line in finding.correction]
            assert check.command == ("\n".join(commands[0]) if commands else "")
    assert len(deck.tried) == len({frozenset(edit.items()) for edit in deck.tried})  # none twice
    printed = repr(done)
    assert printed.count("correct only together with") == sum(row[2] for row in findings)
    assert printed.count("this follows from 1") == sum(row[3] == 0 for row in findings)


def test_time_is_over(scene: hc.Scene, right: FoundDeck) -> None:
    """What is proven by then is in the fixed deck, with a remark that not all was tried."""
    deck = Deck(scene, right, [failed("mass", 2, MASS), failed("law", 3, LAW)], mass_and_law)

    def slowly(edits: Edits, limit: float) -> hc.DeckExamination:
        prover._begun -= 40.0
        return deck(edits, limit)

    prover = correct.Prover(deck({}), slowly, 2.0)
    assert prover.left == pytest.approx(32.0, abs=1.0)  # sixteen readings of the deck
    assert replace(prover, seconds=0.5).left == pytest.approx(8.0, abs=1.0)  # or 8 s
    done = correct.with_findings(prover)
    assert shown(done) == [
        ("mass", ["2: right mass"], False, None), ("law", [], False, None)
    ]  # fmt: skip
    assert done.edits == {("in.made", 2): ("right mass",)}
    assert done.remarks[-1].startswith("not all corrections were tried")
