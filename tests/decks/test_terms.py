"""Scenes with terms: writers of decks refuse them, as each would write another scene."""

from __future__ import annotations

from pathlib import Path

import pytest

import hertzchain as hc
from hertzchain.decks.layout import Layout
from hertzchain.decks.standalone import data_file, standalone
from hertzchain.decks.unit_test import known_motion
from hertzchain.engines.liggghts.deck import deck as liggghts_deck
from hertzchain.engines.yade.deck import deck as yade_deck
from hertzchain.errors import RunFailed
from tests.command_line import Command
from tests.conftest import STEEL
from tests.engines.native.test_terms import PULSE, SCENES

WRITERS = {
    "lammps": ("deck",),
    "lammps, lean": ("deck", "--watch-every", "0"),
    "lammps, data file": ("deck", "--atoms", "data"),
    "lammps, step given": ("deck", "--dt", "1 us"),
    "liggghts": ("deck", "--engine", "liggghts"),
    "yade": ("deck", "--engine", "yade"),
    "unit test": ("unit-test",),
}


@pytest.mark.parametrize("writer", WRITERS)
def test_nothing_is_written(hertzchain: Command, tmp_path: Path, writer: str) -> None:
    scene = tmp_path / "scene.toml"
    hc.Scene(hc.Chain(12, **STEEL), PULSE, wall=hc.Wall("rigid")).to_toml(scene)
    command, *options = WRITERS[writer]
    outcome = hertzchain(command, scene, "-o", tmp_path / "out", *options)
    assert outcome.status == 2
    assert outcome.out == ""
    assert "does not support wall: " in outcome.err
    assert "Traceback" not in outcome.err
    assert [path.name for path in tmp_path.iterdir()] == ["scene.toml"]


@pytest.mark.parametrize("name", SCENES)
def test_no_text_is_made_in_python(name: str) -> None:
    scene = SCENES[name]
    layout = Layout(0.01, 0)
    for write in (
        lambda: standalone(scene, layout),
        lambda: data_file(scene),
        lambda: known_motion(scene),
        lambda: yade_deck(scene, 1e-8, [1.0], 1e-3),
        lambda: liggghts_deck(scene, 1e-8, [1.0]),
    ):
        with pytest.raises(RunFailed, match="does not support "):
            write()
