"""Decks as people write them are examined: right ones pass, others are told what differs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.verdict.user_deck import DeckCheck
from tests.verdict.user_deck.corpus import DECKS, FOLDER, Deck, copied, scene_of

pytestmark = pytest.mark.lammps

QUICK = {"in.steel_cgs", "in.striker_wall"}
"""Those that the default suite examines: about a second each."""


def name(deck: Deck) -> str:
    words = [deck.scene, deck.name.removeprefix("in."), *deck.variables.values()]
    return "-".join(words)


def failed(checks: tuple[DeckCheck, ...]) -> dict[str, str]:
    return {check.name: check.sentence for check in checks if not check.passed}


@pytest.mark.parametrize(
    "deck",
    [
        pytest.param(deck, id=name(deck), marks=[] if deck.name in QUICK else pytest.mark.slow)
        for deck in DECKS
    ],
)
def test_the_corpus(deck: Deck, tmp_path: Path) -> None:
    examined = hc.examine(scene_of(deck.scene), copied(tmp_path, deck), deck.variables)
    if deck.right:
        assert failed(examined.checks) == {}
        assert examined.verdict == "pass"
        # Another integrator, another reading of peaks; their steps are short.
        reference = hc.Native("reference").run(examined.scene).peak_force
        assert np.max(np.abs(examined.peak_force / reference - 1)) < 2e-4  # 7.9e-5 measured
    else:
        assert examined.verdict == "fail"
        assert examined.to_mend
        for check in examined.to_mend:
            assert check.place is not None
            assert check.command


def test_nothing_is_written(tmp_path: Path) -> None:
    deck = next(deck for deck in DECKS if deck.name == "in.steel_if")
    path = copied(tmp_path, deck)
    before = {file.name: file.read_bytes() for file in tmp_path.iterdir()}
    examined = hc.examine(scene_of(deck.scene), path)
    assert {file.name: file.read_bytes() for file in tmp_path.iterdir()} == before
    left = {one.written.split()[0] for one in examined.left_out}
    assert {"dump", "write_data", "shell"} <= left


def test_the_decks_of_the_corpus_are_thirty() -> None:
    assert len(DECKS) >= 30
    assert {deck.name for deck in DECKS} | {"in.make_restart"} == {
        path.name for path in FOLDER.glob("in.*")
    }


SETTLED = """fix v all viscous 5
timestep 1e-7
run 5000
unfix v
velocity all set 0 0 0
variable t0 equal $(time)
variable F equal "40*sin(PI*(time-v_t0)/40e-6)^2*(time<(v_t0+40e-6))"
"""
"""A chain settles before the shock."""


def settled(folder: Path) -> Path:
    path = folder / "in.settled"
    text = (FOLDER / "in.precompressed").read_text(encoding="utf-8")
    formula = 'variable F equal "40*sin(PI*time/40e-6)^2*(time<40e-6)"\n'
    assert formula in text
    path.write_text(text.replace(formula, SETTLED), encoding="utf-8")
    return path


@pytest.mark.slow
def test_a_shock_that_begins_later(tmp_path: Path) -> None:
    examined = hc.examine(scene_of("precompressed"), settled(tmp_path))
    assert failed(examined.checks) == {}
    assert any("the shock begins 0.0005 s after" in remark for remark in examined.remarks)


@pytest.mark.slow
def test_a_chain_that_finds_its_places_is_refused(tmp_path: Path) -> None:
    path = settled(tmp_path)
    text = path.read_text(encoding="utf-8").replace("(2*${R}-${delta})", "2*${R}")
    path.write_text(text, encoding="utf-8")
    with pytest.raises(hc.HertzchainError, match="settles before the shock"):
        hc.examine(scene_of("precompressed"), path)
