"""Each planted mistake is found, with the line that makes it and the right command."""

from __future__ import annotations

import json
import re
from datetime import UTC, datetime
from pathlib import Path

import pytest
from markupsafe import escape

import hertzchain as hc
from hertzchain.report.junit import to_xml
from hertzchain.report.page import page_of
from hertzchain.report.user_deck import of_examination
from tests.verdict.user_deck.corpus import Deck, copied, scene_of
from tests.verdict.user_deck.mistakes import ELSEWHERE, PAIRS, PLAIN, Mistake

pytestmark = pytest.mark.lammps

QUICK = {"wall place"}
"""Mistakes that the default suite looks for: a second each."""


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
        and mistake.line in check.place.written
        and mistake.right in check.command
    ]
    assert found, said
    place = found[0].place
    assert place is not None
    texts = dict(examined.texts)
    line = texts[place.file].splitlines()[place.line - 1]
    assert mistake.line in " ".join(line.split())


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
