"""Right decks pass, in all the styles in which people write them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import hertzchain as hc
from tests.engines.lammps.reading.chains import SCENE, Deck
from tests.examiner.corpus import DECKS, VARIABLES, copied, scene_of

pytestmark = pytest.mark.lammps

QUICK = {"steel_cgs", "struck", "a piston by setforce"}
"""Those that the default suite examines: about a second each."""


def right(name: str, folder: Path) -> hc.DeckExamination:
    """The examination of a right deck."""
    deck, *changes = DECKS[name]
    return hc.examine(scene_of(deck), copied(folder, deck, changes), VARIABLES.get(deck))


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[] if name in QUICK else pytest.mark.slow) for name in DECKS]
)
def test_right_decks(name: str, tmp_path: Path) -> None:
    examined = right(name, tmp_path)
    said = [check.sentence for check in examined.to_correct]
    assert said == []
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
