"""Lint on whole decks: right ones, ones in another style, and ones that are not chains."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.engines.lammps.dialect import NO_FRICTION, PAIR_STYLES
from hertzchain.engines.lammps.reading import reading
from hertzchain.examiner.lint import lint_file
from hertzchain.known.answer import KnownAnswer, Layout, deck
from tests import scenes
from tests.command_line import Command
from tests.examiner.lint.test_lint import CLEAN, HEAP, TRAPS, lint, planted
from tests.places import ROOT

pytestmark = pytest.mark.lammps

ASKED = reading.look

LAW = "hertz/material 1e7 0.5 0.3 tangential mindlin NULL 1.0 0.5 damping tsuji"
CLASSIC = "hooke/history 2000.0 NULL 50.0 NULL 0.5 0"

HEAD = f"""\
units si
atom_style sphere
boundary p p f
newton off
comm_modify vel yes
region box block 0 1 0 1 0 1
create_box 2 box
region part block 0.2 0.8 0.2 0.8 0.6 0.9
pair_style gran/{CLASSIC}
pair_coeff * *
neigh_modify delay 0 every 1 check no
neighbor 0.01 bin
timestep 1e-5
fix move all nve/sphere
fix down all gravity 9.81 vector 0 0 -1
"""

RANDOM = """\
create_atoms 1 random 40 12345 part
create_atoms 2 random 40 54321 part
set group all diameter 0.05
set group all density 2500
"""

POUR = "fix rain all pour 100 1 3123 region part\nrun 1000\nunfix rain\nrun 1000\n"

LIGGGHTS = """\
units si
atom_style granular
boundary f f f
newton off
communicate single vel yes
region box block -0.5 0.5 -0.5 0.5 0 1 units box
create_box 1 box
neighbor 0.004 bin
fix m1 all property/global youngsModulus peratomtype 5.e6
pair_style gran model hertz tangential history
pair_coeff * *
timestep 1e-5
fix down all gravity 9.81 vector 0.0 0.0 -1.0
"""

OLD = "pair_style gran/hertz/history 1 0"
"""The pair style of LIGGGHTS before its models had names: two switches, no stiffness."""

POURED, VESSEL, BODIES = (
    "granules are poured",
    "granules lie in a vessel",
    "rigid bodies of several",
)

OTHERS = {
    "pour": (POURED, HEAD + POUR),
    "a mixture": (POURED, HEAP),
    "deposit": (POURED, HEAD + POUR.replace("pour 100 1", "deposit 100 1 50")),
    "vessel": (VESSEL, HEAD + f"fix v all wall/gran/region granular {LAW} region part\nrun 1000\n"),
    "chute": ("granules are frozen", HEAD.replace("vector 0 0 -1", "chute 26.0")
        + "read_data data.chute\ngroup bottom type 2\nfix 2 bottom freeze\nrun 1000\n"),
    "rigid bodies": (BODIES, HEAD.replace("fix move all nve/sphere\n", "")
        + "read_data clumps\nfix body all rigid molecule\nrun 10\n"),
    "bonded": ("granules are bonded", HEAD.replace("atom_style sphere", "atom_style bpm/sphere")
        + "create_atoms 1 box\nset group all diameter 1 mass 1.0\nbond_style bpm/rotational\n"
        "run 100\n"),
    "two-dimensional": ("it is two-dimensional", "dimension 2\n" + HEAD
        + "create_atoms 1 region part\nset group all diameter 0.1 density 2500\n"
        "fix 2 all enforce2d\nrun 10\n"),
    "one granule on a plate": ("it has one granule", HEAD + "create_atoms 1 single 0.5 0.5 0.5\n"
        "set group all diameter 0.1\nset group all density 2500\n"
        f"fix plate all wall/gran {CLASSIC} zplane 0 NULL\nrun 100\n"),
    "atoms": ("its atoms are not spheres", HEAD.replace("atom_style sphere", "atom_style atomic")),
    "12,000 granules": ("12000 granules do not lie", HEAD.replace("p p f", "p p p")
        + RANDOM.replace("random 40", "random 6000").replace("0.05", "0.002") + "run 100\n"),
    "meshes": (VESSEL, LIGGGHTS + "fix m all mesh/surface file a.stl type 1\nfix w all wall/gran"
        " model hertz tangential history mesh n_meshes 1 meshes m\nfix i all nve/sphere\nrun 10\n"),
    "insert": (POURED, LIGGGHTS + "fix i all insert/stream seed 1\nfix m all nve/sphere\nrun 9\n"),
    "pack": (POURED, LIGGGHTS.replace("granular", "sphere") + "fix t all particletemplate/"
        "multisphere 1 nspheres 4\nfix i all insert/pack seed 1\nfix m all multisphere\nrun 9\n"),
    "old LIGGGHTS": (POURED, LIGGGHTS.replace("pair_style gran model hertz tangential history", OLD)
        + "fix m all nve/sphere\nfix w all wall/gran/hertz/history 1 0 zplane 0 NULL 1\n"
        "fix i all pour/dev nparticles 600 massrate 0.1 1\nrun 9\n"),
}  # fmt: skip
"""Words for decks that are not chains, and decks as they are published."""

OF_LIGGGHTS = {"meshes", "insert", "pack", "old LIGGGHTS"}


@pytest.mark.parametrize("name", OTHERS)
def test_a_deck_that_is_no_chain_is_said_to_be_none_and_has_no_error(name: str) -> None:
    """Whatever traps are in it, too."""
    why, text = OTHERS[name]
    findings = lint(text.replace("fix down", "fix again all nve/sphere\nfix down"))
    (said,) = [finding.text for finding in findings if finding.rule == "no-chain"]
    assert why in said
    assert {finding.severity for finding in findings} == {"note"}
    assert any("for LIGGGHTS" in finding.text for finding in findings) == (name in OF_LIGGGHTS)
    is_partial = any(f.text.startswith("LAMMPS read a part of the deck") for f in findings)
    assert is_partial or name != "chute"  # its file is missing


ROWS = """\
units si
atom_style sphere
boundary p f f
comm_modify vel yes
newton off
lattice sc 0.01
region box block 0 20 -2 6 -2 2
create_box 1 box
region rows block 0 19.5 0 3 0 0
create_atoms 1 region rows
set group all diameter 0.01
set group all density 2500
neighbor 0.002 bin
pair_style gran/hertz/history 1e9 NULL 0.0 NULL 0.0 0
pair_coeff * *
timestep 1e-6
fix 1 all nve/sphere
fix 2 all momentum 1 linear 1 1 1
group one id 1
velocity one set 0.1 0 0 units box
run 1000
"""


@pytest.mark.parametrize(
    ("rows", "said"),
    [("0 3", {("no-chain", "note")}), ("0 0", {("periodic", "warning")})],
    ids=["rows", "ring"],
)
def test_rows_and_rings_are_told_by_their_granules(rows: str, said: set[tuple[str, str]]) -> None:
    findings = lint(ROWS.replace("19.5 0 3", f"19.5 {rows}"))
    assert {(finding.rule, finding.severity) for finding in findings} == said


STYLES = {
    "two-dimensional": "boundary f f f|lattice sc|fix motion all nve||dimension 2\nboundary f f p|"
    "lattice sq|fix motion all nve/sphere\nfix plane all enforce2d",
    "in a tube": "fix motion||region tube cylinder x 0 0 0.005 INF INF\nfix tube all"
    f" wall/gran/region granular hertz 1e11 0.0 {NO_FRICTION} region tube\nfix motion",
    "last granule frozen": "fix motion all||group last id 30\ngroup free subtract all last\n"
    "fix held last freeze\nfix motion free",
    "hybrid": "pair_style granular|pair_coeff * *||pair_style hybrid/overlay granular zero 0.01|"
    "pair_coeff * * zero\npair_coeff * * granular",
}
"""Chains in other styles: texts of the clean deck, and those in their place."""


@pytest.mark.parametrize("name", STYLES)
def test_a_chain_in_another_style_is_a_chain(name: str) -> None:
    text = CLEAN
    old, new = (part.split("|") for part in STYLES[name].split("||"))
    for word, other in zip(old, new, strict=True):
        assert word in text
        text = text.replace(word, other)
    assert lint(text) == []
    pushed = lint(text.replace("group first id 1\n", "group first id 1:3\n"))
    assert {finding.rule for finding in pushed} == {"force-on-all"}


def test_without_lammps_the_text_is_read(
    tmp_path: Path, hertzchain: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(reading, "look", ASKED)  # in a process of its own, as users do
    monkeypatch.syspath_prepend(ROOT / "tests" / "no_lammps")
    file = tmp_path / "in.chain"
    file.write_text(planted(TRAPS["density first"]), encoding="utf-8")
    done = hertzchain("lint", file)
    note, *rest = done.out.splitlines()
    assert note.startswith(f"{file}:1: note: LAMMPS could not be asked")
    assert "lammps" in note
    assert [line.split("[")[-1] for line in rest[:-1]] == ["density-before-diameter]"]
    assert (done.status, rest[-1]) == (1, "1 error, 0 warnings, 1 note")


# Right decks

SHIPPED = sorted((ROOT / "lammps_inputs").glob("in.*"))

MEANT = {
    "in.damped": ["damping"],
    "in.damped_striker_on_a_wall": ["damping"] * 4,
    "in.gapped": ["not-touching"],
}
"""Findings in shipped decks whose granules are apart, pressed or damped on purpose."""


@pytest.mark.parametrize(
    "path",
    [pytest.param(p, marks=[pytest.mark.slow] * (p.name != "in.demo")) for p in SHIPPED],
    ids=lambda path: path.name,
)
def test_nothing_else_is_said_of_shipped_decks(path: Path) -> None:
    assert [finding.rule for finding in lint_file(path)] == MEANT.get(path.name, [])


def generated(scene: hc.Scene, pair_style: str = "granular") -> str:
    """Return a deck of a scene; its expected peaks do not matter here."""
    ones = np.ones(scene.chain.granules - 1)
    return deck(scene, Layout(0.05, 2, pair_style), KnownAnswer(ones, 1e-3 * ones))


@pytest.mark.parametrize("pair_style", PAIR_STYLES)
@pytest.mark.parametrize(
    "name", ["demo", *(pytest.param(k, marks=pytest.mark.slow) for k in scenes.NAMES[::4])]
)
def test_nothing_is_said_of_generated_decks(name: str, pair_style: str) -> None:
    assert lint(generated(scenes.load(name), pair_style)) == []
