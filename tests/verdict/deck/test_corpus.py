"""Decks as people write them are examined: right ones pass, others are told what differs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.verdict.deck import DeckCheck
from tests.verdict.deck.corpus import DECKS, FOLDER, Deck, copied, scene_of

pytestmark = pytest.mark.lammps

QUICK = {"in.steel_cgs", "in.striker_wall"}
"""Those that the default suite examines: about a second each."""


UNPROVEN = {"steel-random_places": ["chain"], "striker-piston": ["granules that are led"]}
"""Findings without a correction: granules anywhere in a box; a piston in place of a striker."""


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
        assert all(check.place is not None for check in examined.to_mend)
        unproven = [one for one in examined.findings if not one.correction and one.follows is None]
        assert [one.checks[0].name for one in unproven] == UNPROVEN.get(name(deck), [])


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


def edited(name: str, *changes: tuple[str, str]) -> str:
    """A deck of the corpus with some texts replaced."""
    text = (FOLDER / name).read_text(encoding="utf-8")
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new)
    return text


NVE = ("fix             1 all nve", "fix             1 all nve/sphere")
PLACES = "create_atoms    1 single $x 0.0 0.0 units box"
STYLES = {
    "a diagonal": ("steel", edited(
        "in.steel_plain", ("-0.02 0.21 -0.02 0.02 -0.02 0.02", "-0.02 0.2 -0.02 0.2 -0.02 0.2"),
        (PLACES, "create_atoms 1 single $(v_x*0.48) $(v_x*0.6) $(v_x*0.64) units box"),
        ("F equal", ("Fz equal 0.64*v_F\nvariable Fx equal 0.48*v_F\n"
                     "variable Fy equal 0.6*v_F\nvariable F equal")),
        ("addforce v_F 0.0 0.0", "addforce v_Fx v_Fy v_Fz"))),
    "backwards on a diagonal": ("steel", edited(
        "in.steel_plain", ("-0.02 0.21 -0.02 0.02 -0.02 0.02", "-0.2 0.02 -0.2 0.02 -0.02 0.02"),
        (PLACES, "create_atoms 1 single $(-v_x*0.8) $(-v_x*0.6) 0 units box"),
        ("F equal", "Fx equal -0.8*v_F\nvariable Fy equal -0.6*v_F\nvariable F equal"),
        ("addforce v_F 0.0 0.0", "addforce v_Fx v_Fy 0"))),
    "a piston by setforce": ("piston", edited(
        "in.piston", ("fix 1 rest nve\nfix 2 p move linear 0.2 0 0",
                      "velocity p set 0.2 0 0\nfix 1 all nve\nfix 2 p setforce 0 0 0"))),
    "a piston by setforce NULL": ("piston", edited(
        "in.piston", ("fix 1 rest nve\nfix 2 p move linear 0.2 0 0",
                      "set group p vx 0.2\nfix 1 all nve\nfix 2 p setforce 0.0 NULL NULL"))),
    "a mark of the byte order": ("steel", "\ufeff" + edited("in.steel_plain")),
    "lines of DOS": ("steel", edited("in.steel_plain", ("\n", "\r\n"))),
    "nve/sphere": ("steel", edited("in.steel_plain", NVE)),
    "a lighter skin": ("steel", edited("in.steel_plain", ("0.002 bin", "0.0002 bin"))),
    "two halves": ("steel", edited("in.steel_plain", ("run             2500",
                                                      "run 1250\nrun 1250 pre no"))),
    "periodic across": ("steel", edited("in.steel_plain", ("boundary        f f f",
                                                           "boundary f p p"))),
}  # fmt: skip
"""Right decks in styles that the folder has not, by name: their scene and text."""


@pytest.mark.parametrize(
    "style",
    [
        pytest.param(name, marks=[] if name.startswith("a ") else pytest.mark.slow)
        for name in STYLES
    ],
)
def test_right_decks_in_other_styles(style: str, tmp_path: Path) -> None:
    scene, text = STYLES[style]
    (tmp_path / "in.mine").write_text(text, encoding="utf-8", newline="")
    examined = hc.examine(scene_of(scene), tmp_path / "in.mine")
    assert failed(examined.checks) == {}


def test_files_are_looked_for_in_the_working_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As LAMMPS does; a file of that name next to the deck is another one."""
    here, there = tmp_path / "here", tmp_path / "there"
    for folder, modulus in ((here, "193e9"), (there, "100e9")):
        folder.mkdir()
        text = (FOLDER / "material.inc").read_text(encoding="utf-8")
        (folder / "material.inc").write_text(text.replace("193e9", modulus), encoding="utf-8")
    for name in ("in.steel_data", "chain.data"):
        (there / name).write_text((FOLDER / name).read_text(encoding="utf-8"), encoding="utf-8")
    monkeypatch.chdir(here)
    assert hc.examine(scene_of("steel"), there / "in.steel_data").verdict == "pass"
    monkeypatch.chdir(tmp_path)
    assert hc.examine(scene_of("steel"), there / "in.steel_data").verdict == "fail"
