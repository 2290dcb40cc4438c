"""Lint with a scene: the text of a deck against the scene that it should be."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import hertzchain as hc
from hertzchain.decks.layout import KnownAnswer, Layout
from hertzchain.decks.lint.against import CLOSE
from hertzchain.decks.lint.finding import Finding
from hertzchain.decks.lint.rules import lint, lint_file
from hertzchain.decks.standalone import standalone
from tests import scenes
from tests.command_line import Command
from tests.conftest import STEEL
from tests.test_public_names import modules_after
from validation.gallery import FOLDER, GALLERY, Entry

CHAIN = hc.Chain(30, **STEEL)
PULSE = hc.Pulse("cosine", 100.0, 2.0, rise_time=5e-5)
SCENE = hc.Scene(CHAIN, PULSE, hc.Run(4e-4))


@dataclass(frozen=True)
class Units:
    """What units of a deck are worth in SI, as LAMMPS's manual has them."""

    name: str
    length: float
    mass: float
    time: float

    def number(self, value: float, length: float = 0, mass: float = 0, time: float = 0) -> str:
        """A number in SI as the deck has it."""
        unit = self.length**length * self.mass**mass * self.time**time
        return f"{value / unit:.12g}"

    def force(self, value: float) -> str:
        """A force [N]."""
        return self.number(value, 1, 1, -2)

    def pressure(self, value: float) -> str:
        """A Young's modulus [Pa]."""
        return self.number(value, -1, 1, -2)


SI = Units("si", 1.0, 1.0, 1.0)
ALL_UNITS = (
    SI,
    Units("cgs", 1e-2, 1e-3, 1.0),
    Units("micro", 1e-6, 1e-15, 1e-6),
    Units("nano", 1e-9, 1e-21, 1e-9),
    Units("lj", 4.75e-3, 2e-3, 3e-5),  # any
)


def deck(units: Units = SI, axis: int = 0, sign: int = 1, style: str = "granular") -> str:
    """A deck of the scene as people write it, along any axis, pushed at its lower or upper end."""
    u = units
    n, r = CHAIN.granules, 4.75e-3
    at = ["0", "0", "0"]
    at[axis] = "${x}"
    force = ["0.0", "0.0", "0.0"]
    force[axis] = "v_push"
    ends = [(-4 * r, 4 * r)] * 3
    ends[axis] = (-4 * r, 2 * r * (n + 2))
    box = " ".join(u.number(x, 1) for pair in ends for x in pair)
    plane = STEEL["young_modulus"] / (1 - STEEL["poisson_ratio"] ** 2)
    young = u.pressure(STEEL["young_modulus"])
    law = f"pair_style granular\npair_coeff * * hertz/material {young} 0.0 0.3 &\n"
    law += "    tangential linear_nohistory 0.0 0.0"
    if style != "granular":
        kn = u.pressure(2 / 3 * plane)
        law = f"pair_style gran/hertz/history {kn} NULL 0.0 0.0 0.0 0\npair_coeff * *"
    return f"""\
units {u.name}
atom_style sphere
boundary f f f
comm_modify vel yes
newton off
region box block {box} units box
create_box 1 box
variable i loop {n}
label granule
variable x equal (v_i-1)*{u.number(2 * r, 1)}
create_atoms 1 single {" ".join(at)} units box
next i
jump SELF granule
set group all diameter {u.number(2 * r, 1)}
set group all density {u.number(7958.0, -3, 1)}
neighbor {u.number(r / 2, 1)} bin
{law}
fix motion all nve
group first id {1 if sign > 0 else n}
variable push equal {u.force(sign * 100.0)}*sin(PI/2*time/{u.number(5e-5, 0, 0, 1)})^2
fix shock first addforce {" ".join(force)}
timestep {u.number(5e-8, 0, 0, 1)}
run 2000
unfix shock
run 6000
"""


def bad(findings: Sequence[Finding]) -> list[Finding]:
    return [finding for finding in findings if finding.severity != "note"]


def rules(text: str, scene: hc.Scene = SCENE) -> set[str]:
    return {finding.rule for finding in bad(lint(text, scene))}


@pytest.mark.parametrize(
    ("axis", "sign", "style"),
    [(0, 1, "granular"), (1, -1, "gran/hertz/history"), (2, 1, "granular"), (2, -1, "granular")],
)
@pytest.mark.parametrize("units", ALL_UNITS, ids=lambda units: units.name)
def test_nothing_is_said_of_the_scene_in_any_units(
    units: Units, axis: int, sign: int, style: str
) -> None:
    assert lint(deck(units, axis, sign, style), SCENE) == []


NOT_IN_THE_TEXT = {
    "in.damped": "damping of contacts",  # chosen by LAMMPS's version
    "in.piston": "motion of the piston",  # a formula
}


@pytest.mark.parametrize("entry", GALLERY, ids=lambda entry: entry.title)
def test_nothing_is_said_of_shipped_decks_of_their_scenes(entry: Entry) -> None:
    text = (FOLDER / entry.name).read_text(encoding="utf-8")
    unknown = NOT_IN_THE_TEXT.get(entry.name)
    said = [f"not known from the text: {unknown}; compare --deck asks LAMMPS"] if unknown else []
    assert [finding.text for finding in lint(text, entry.load())] == said


@pytest.mark.parametrize(
    ("rise", "peak", "said"),
    [
        ("5e-5", "100.0", None),
        ("4e-5", "100.0", "the force rises to half of its peak at 2e-05, in the scene at 2.5e-05"),
        ("5e-5", "110.0", "the largest force is 110, in the scene it is 100"),
    ],
)
def test_a_static_load_in_the_formula_of_the_pulse_is_no_part_of_it(
    rise: str, peak: str, said: str | None
) -> None:
    push = f"20.0+{peak}*sin(PI/2*time/{rise})^2*(time<2*{rise})"
    hold = "group last id 30\nfix hold last addforce -20.0 0.0 0.0"
    text, count = re.subn(
        "(variable push equal ).*", rf"\g<1>{push}\n{hold}", deck().replace("unfix shock\n", "")
    )
    assert count == 1
    pressed = replace(SCENE, precompression=hc.Precompression(force=20.0))
    texts = [one.text for one in lint(text, pressed) if one.rule == "scene-force"]
    assert len(texts) == (said is not None)
    assert said is None or texts[0].startswith(said)


@pytest.mark.parametrize(
    ("stored", "put_back", "found"),
    [
        ("0 vx", "f_kept", None),
        ("0 vy vx", "f_kept[2]", None),
        ("0 vy vx", "f_kept[1]", 0.0),
        ("10 vx", "f_kept", "unknown"),  # stored again while it runs
        ("0 vx", "f_kept*2", "unknown"),
        ("0 vx", "", 2.0),  # not put back
    ],
)
def test_velocities_that_are_put_back_are_known(
    stored: str, put_back: str, found: float | str | None
) -> None:
    """A deck that changes velocities after it has stored them, and gives them back."""
    start = "velocity first set 1.0 0.0 0.0 units box\n"
    start += f"fix kept all store/state {stored}\nvelocity all set 2.0 0.0 0.0 units box\n"
    if put_back:
        start += f"variable back atom {put_back}\nvelocity all set v_back NULL NULL units box\n"
    text = deck().replace("timestep", f"{start}timestep").replace(PUSH, "*0")
    findings = lint(text, replace(SCENE, shock=hc.Striker(1.0)))
    velocities = [one.found for one in findings if one.rule == "scene-velocity"]
    if found == "unknown":
        assert "velocities at the start" in findings[0].text
    else:
        assert velocities == ([] if found is None else [found])


@pytest.mark.parametrize(
    ("right", "wrong", "said"),
    [
        (r"(known_start atom \"[^\"]*\(id==5\)\*0\.0)", r"\g<1>1", "put granule 5 there"),
        (
            r"(known_start atom \"[^\"]*\(id==5\)\*\S+)",
            r"\g<1>*2",
            "not known from the text: places",
        ),
        (
            r"(known_start atom \"[^\"]*\(id)==5(\)\*\S+)",
            r"\g<1>==999\2",
            "not known from the text: places",
        ),
        (r"(known_start atom \"[^\"]*\(id)==20\)", r"\g<1>>=20)*(id<=30)", ""),
    ],
    ids=["another place", "another formula", "no place", "more granules than there are"],
)
def test_places_that_a_formula_gives_granules_are_known(right: str, wrong: str, said: str) -> None:
    entry = next(one for one in GALLERY if one.name == "in.upright_column")
    text, count = re.subn(right, wrong, (FOLDER / entry.name).read_text(encoding="utf-8"))
    assert count == 1
    findings = lint(text, entry.load())
    assert said in "".join(finding.text for finding in findings)
    assert said or not findings


def test_a_piston_that_the_deck_does_not_have_is_found() -> None:
    entry = next(one for one in GALLERY if one.name == "in.piston")
    text, scene = (FOLDER / entry.name).read_text(encoding="utf-8"), entry.load()
    assert "scene-piston" not in {finding.rule for finding in lint(text, scene)}
    text, count = re.subn(r"^fix piston .*$", "", text, flags=re.MULTILINE)
    assert count == 1
    (finding,) = (one for one in lint(text, scene) if one.rule == "scene-piston")
    assert finding.text.startswith("nothing moves granule 1 as the scene's piston does")


def test_velocities_that_may_not_be_stored_are_not_known() -> None:
    start = "velocity first set 1.0 0.0 0.0 units box\nvariable wanted index 0\n"
    start += 'if "${wanted} > $(random(0,1,5))" then "fix kept all store/state 0 vx"\n'
    start += "velocity all set 2.0 0.0 0.0 units box\nvariable back atom f_kept\n"
    start += "velocity all set v_back NULL NULL units box\n"
    text = deck().replace("timestep", f"{start}timestep").replace(PUSH, "*0")
    findings = lint(text, replace(SCENE, shock=hc.Striker(1.0)))
    assert "velocities at the start" in findings[0].text


def test_damping_is_noted_where_the_scene_has_none() -> None:
    entry = next(one for one in GALLERY if one.name == "in.damped_striker_on_a_wall")
    text, scene = (FOLDER / entry.name).read_text(encoding="utf-8"), entry.load()
    for of, noted in ((None, True), (scene, False), (replace(scene, contact=None), True)):
        assert ("damping" in {finding.rule for finding in lint(text, of)}) == noted


@pytest.mark.slow
@pytest.mark.parametrize("entry", GALLERY, ids=lambda entry: entry.title)
def test_a_shipped_deck_is_of_one_scene(entry: Entry) -> None:
    text = (FOLDER / entry.name).read_text(encoding="utf-8")
    scene = entry.load()
    others = [other.load() for other in GALLERY]
    assert all(bad(lint(text, other)) for other in others if other != scene)


@pytest.mark.parametrize("pair_style", ["granular", "gran/hertz/history"])
@pytest.mark.parametrize("name", ["demo", "pulse_table", "weak_shock", *scenes.NAMES[::4]])
def test_nothing_is_said_of_generated_decks_of_their_scenes(name: str, pair_style: str) -> None:
    scene = scenes.load(name)
    ones = np.ones(scene.chain.granules - 1)
    for watch_every, known in ((0, None), (2, KnownAnswer(ones, 1e-3 * ones))):
        layout = Layout(0.05, watch_every, pair_style)
        assert lint(standalone(scene, layout, known), scene) == []


WALL = "wall/gran granular hertz 1e11 0.0 tangential linear_nohistory 0.0 0.0 xplane NULL 0.28025"
SIZE, WEIGHT = "set group all diameter 0.0095", "set group all density 7958"
PUSH = "*sin(PI/2*time/5e-05)^2"


@dataclass(frozen=True)
class Planted:
    """A mistake: text of the deck, its replacement, and the expected message.

    Parameters
    ----------
    rule, line
        Of the finding: its name, and how the line begins that it points to.
    found, expected
        Its numbers, where they are known here.
    """

    old: str
    new: str
    rule: str
    line: str
    found: float | None = None
    expected: float | None = None


MOTION = "fix motion all nve"
PLANTED = {
    "a granule too many": Planted("loop 30", "loop 31", "granules", "create_atoms", 31, 30),
    "diameter": Planted(SIZE, f"{SIZE[:-6]}0.00475", "diameter", "set group", 4.75e-3, 9.5e-3),
    "density": Planted("7958", "7.958", "mass", "set group all density"),
    "gap": Planted(")*0.0095", ")*0.00951", "places", "create_atoms", 9.51e-3, 9.5e-3),
    "modulus": Planted("193000000000 0.0 0.3", "70e9 0.0 0.3", "stiffness", "pair_coeff"),
    "Poisson's ratio": Planted("0.0 0.3", "0.0 0.0", "stiffness", "pair_coeff"),
    "damping": Planted(" 0.0 0.3", " 0.9 0.3", "damping", "pair_coeff", None, 0),
    "peak force": Planted("equal 100*", "equal 200*", "force", "fix shock", 200, 100),
    "sign": Planted("equal 100*", "equal -100*", "force", "fix shock"),
    "rise time": Planted("time/5e-05", "time/4e-05", "force", "fix shock"),
    "profile": Planted(PUSH, "*abs(sin(PI/2*time/5e-05))", "force", "fix shock"),
    "pushed granule": Planted("first id 1\n", "first id 2\n", "force", "fix shock"),
    "no force": Planted("addforce v_push", "addforce 0.0", "force", "fix shock"),
    "velocity": Planted(
        MOTION, f"velocity all set 1 0 0 units box\n{MOTION}", "velocity", "velocity", 1, 0
    ),
    "gravity": Planted(
        MOTION, f"fix g all gravity 9.81 vector 1 0 0\n{MOTION}", "gravity", "fix g", 9.81, 0
    ),
    "wall": Planted(MOTION, f"fix w all {WALL}\n{MOTION}", "wall", "fix w"),
    "end": Planted("run 6000", "run 2000", "end", "run 2000", 2e-4, 4e-4),
    "one granule's size": Planted(
        "neighbor",
        "set atom 7 diameter 0.01\nset atom 7 density 7958\nneighbor",
        "diameter",
        "set atom 7 diameter",
        0.01,
        0.0095,
    ),
    "density before diameter": Planted(
        f"{SIZE}\n{WEIGHT}", f"{WEIGHT}\n{SIZE}", "mass", "set group all density"
    ),
}


@pytest.mark.parametrize(
    ("ids", "words"),
    [("2", "on granule 2, in"), ("2 3", "2 and 1 more, in"), ("1 2:4", "2 and 2 more, in")],
)
def test_forces_on_other_granules_are_counted(ids: str, words: str) -> None:
    found = lint(deck().replace("first id 1\n", f"first id {ids}\n"), SCENE)
    assert words in next(finding.text for finding in found if finding.rule == "scene-force")


@pytest.mark.parametrize("name", PLANTED)
def test_what_differs_from_the_scene_is_found_with_its_line(name: str) -> None:
    planted = PLANTED[name]
    text = deck()
    assert planted.old in text
    wrong = text.replace(planted.old, planted.new)
    held = [finding for finding in lint(wrong, SCENE) if finding.rule.startswith("scene-")]
    assert {finding.rule for finding in held} == {f"scene-{planted.rule}"}
    assert wrong.splitlines()[held[0].line - 1].startswith(planted.line)
    if planted.expected is not None:
        assert held[0].expected == pytest.approx(planted.expected, rel=1e-9, abs=1e-12)
    if planted.found is not None:
        # The pulse is sampled.
        assert held[0].found == pytest.approx(planted.found, rel=1e-3, abs=0)


@pytest.mark.parametrize("units", ALL_UNITS[1:4], ids=lambda units: units.name)
def test_numbers_of_the_scene_are_said_in_the_units_of_the_deck(units: Units) -> None:
    text = deck(units)
    right = re.search(r"density (\S+)", text)
    assert right is not None
    wrong = text.replace(right[0], "density 1.0")
    (found,) = [finding for finding in lint(wrong, SCENE) if finding.rule == "scene-mass"]
    assert f"density {right[1]} after" in found.text


def test_a_wrong_size_is_one_finding() -> None:
    wrong = deck().replace("diameter 0.0095", "diameter 0.0094").replace(")*0.0095", ")*0.0094")
    assert rules(wrong) == {"scene-diameter"}


@pytest.mark.parametrize(("factor", "found"), [(0.9, False), (1.1, True)])
@pytest.mark.parametrize("what", ["density 7958", "193000000000", "equal 100"])
def test_numbers_may_differ_by_a_thousandth(what: str, factor: float, found: bool) -> None:
    text = deck()
    value = float(re.findall(r"[\d.]+", what)[0])
    wrong = text.replace(what, what.replace(f"{value:.12g}", f"{value * (1 + factor * CLOSE)!r}"))
    assert wrong != text
    assert bool(rules(wrong)) is found


@pytest.mark.parametrize(("factor", "found"), [(0.9, False), (1.1, True)])
def test_gaps_may_be_a_thousandth_of_an_overlap(factor: float, found: bool) -> None:
    gap = factor * CLOSE * SCENE.units.length
    assert bool(rules(deck().replace(")*0.0095", f")*{0.0095 + gap!r}"))) is found


def test_granules_a_little_too_large_press_one_another() -> None:
    """By half of the largest overlap of the wave, though the size is off by 3e-4 only."""
    assert rules(deck().replace(SIZE, f"{SIZE}0285")) == {"scene-places"}


@pytest.mark.parametrize("examples", [30, pytest.param(1000, marks=pytest.mark.slow)])
def test_any_change_of_a_deck_gives_findings_or_none(examples: int) -> None:
    text = deck()
    words = sorted({*text.split(), "0", "-1", "1e300", "nan", "v_push", "all", "*", "1:3", "NULL"})
    changes = st.lists(
        st.tuples(st.integers(0, 400), st.sampled_from(["", *words])), min_size=1, max_size=6
    )

    def is_held(changes: list[tuple[int, str]]) -> None:
        pieces = re.split(r"(\s+)", text)
        for place, new in changes:
            pieces[place % len(pieces)] = new
        assert all(finding.line >= 1 for finding in lint("".join(pieces), SCENE))

    settings(max_examples=examples)(given(changes)(is_held))()


@pytest.mark.slow
def test_peaks_move_by_a_thousandth_with_numbers_that_do() -> None:
    truth = hc.Native(rtol=1e-8).run(SCENE).peak_force[:20]
    for changed in (
        replace(SCENE, chain=replace(CHAIN, density=CHAIN.density * (1 + CLOSE))),
        replace(SCENE, chain=replace(CHAIN, young_modulus=CHAIN.young_modulus * (1 + CLOSE))),
        replace(SCENE, shock=replace(PULSE, peak_force=100.0 * (1 + CLOSE))),
        replace(SCENE, shock=replace(PULSE, rise_time=5e-5 * (1 + CLOSE))),
        replace(SCENE, chain=replace(CHAIN, gap=CLOSE * SCENE.units.length)),
    ):
        moved = np.abs(hc.Native(rtol=1e-8).run(changed).peak_force[:20] / truth - 1)
        assert np.max(moved) < 1.6 * CLOSE


def test_what_cannot_be_known_is_listed_in_one_note() -> None:
    text = deck().replace("equal 100*", "equal c_something*")
    notes = [finding for finding in lint(text, SCENE) if finding.rule == "scene"]
    assert [note.severity for note in notes] == ["note"]
    assert notes[0].text == (
        "not known from the text: applied force over time; compare --deck asks LAMMPS"
    )
    data = re.sub(r"variable i loop(?s:.*)jump SELF granule", "read_data chain.data", deck())
    (note,) = [finding for finding in lint(data, SCENE) if finding.rule == "scene"]
    assert note.text.startswith("not known from the text: granules and their places, ")


def test_units_with_factors_are_not_guessed() -> None:
    (note,) = [
        f for f in lint(deck().replace("units si", "units real"), SCENE) if f.rule == "scene"
    ]
    assert "units real" in note.text


def test_a_softer_chain_has_the_same_peaks() -> None:
    """E over 8 and times twice as long; only one of them is a mistake."""
    stretched = deck().replace("193000000000", "24125000000")
    assert "scene-stiffness" in rules(stretched)
    stretched = stretched.replace("time/5e-05", "time/1e-4").replace(
        "timestep 5e-08", "timestep 1e-7"
    )
    assert rules(stretched) == set()
    assert "scene-force" in rules(stretched.replace("24125000000", "193000000000"))


def test_a_striker_and_its_wall() -> None:
    scene = hc.Scene(CHAIN, hc.Striker(2.0), hc.Run(4e-4), wall=hc.Wall("rigid"))
    kn = 4 / 3 * STEEL["young_modulus"] / (1 - STEEL["poisson_ratio"] ** 2)
    text = re.sub(r"variable push.*\nfix shock.*\n|unfix shock\n", "", deck())
    text = text.replace(
        "fix motion",
        f"fix end all wall/gran granular hertz {kn!r} 0.0 tangential linear_nohistory 0.0 0.0"
        " xplane NULL 0.28025\nfix motion",
    ).replace("timestep", "velocity first set 2.0 0.0 0.0 units box\ntimestep")
    assert lint(text, scene) == []
    assert rules(text.replace("set 2.0", "set 2.1"), scene) == {"scene-velocity"}
    assert rules(text.replace("set 2.0", "set -2.0"), scene) == {"scene-velocity"}
    assert rules(text.replace("0.28025", "0.2803"), scene) == {"scene-wall"}
    assert rules(text.replace(repr(kn), repr(kn / 2)), scene) == {"scene-stiffness"}
    assert "scene-wall" in rules(re.sub(r"fix end.*\n", "", text), scene)


@pytest.mark.parametrize("units", ALL_UNITS[:4], ids=lambda units: units.name)
@pytest.mark.parametrize(("overlaps", "found"), [(0.5e-3, False), (2e-3, True), (-2e-3, True)])
def test_a_wall_may_stand_off_by_a_thousandth_of_an_overlap(
    overlaps: float, found: bool, units: Units
) -> None:
    scene = replace(SCENE, wall=hc.Wall("rigid"))
    kn = units.pressure(4 / 3 * STEEL["young_modulus"] / (1 - STEEL["poisson_ratio"] ** 2))
    place = units.number(59 * 4.75e-3 + overlaps * scene.units.length, 1)
    wall = f"fix end all wall/gran granular hertz {kn} 0.0 tangential linear_nohistory 0.0 0.0"
    text = deck(units).replace("fix motion", f"{wall} xplane NULL {place}\nfix motion")
    assert rules(text, scene) == ({"scene-wall"} if found else set())


def test_damping_of_the_scene() -> None:
    scene = replace(SCENE, contact=hc.Contact("restitution", restitution=0.8))
    right = (
        deck()
        .replace(" 0.0 0.3", " 0.8 0.3")
        .replace(
            "linear_nohistory 0.0 0.0",
            "linear_nohistory 0.0 0.0 damping coeff_restitution limit_damping",
        )
    )
    assert rules(right, scene) == set()
    assert rules(right.replace(" 0.8 0.3", " 0.7 0.3"), scene) == {"scene-damping"}
    assert rules(right.replace(" limit_damping", ""), scene) == {"scene-damping"}
    pulls = replace(SCENE, contact=hc.Contact("restitution", restitution=0.8, attraction=True))
    assert rules(right.replace(" limit_damping", ""), pulls) == set()
    assert "scene-damping" in rules(right.replace("coeff_restitution", "viscoelastic"), scene)
    assert "scene-damping" in rules(deck(), scene)


def test_the_command(tmp_path: Path, hertzchain: Command) -> None:
    SCENE.to_toml(tmp_path / "scene.toml")
    file = tmp_path / "in.chain"
    file.write_text(deck(), encoding="utf-8")
    assert hertzchain("lint", file, "--scene", tmp_path / "scene.toml").status == 0
    file.write_text(deck().replace("density 7958", "density 8958"), encoding="utf-8")
    assert hertzchain("lint", file).status == 0
    wrong = hertzchain("lint", file, "--scene", tmp_path / "scene.toml")
    assert wrong.status == 1
    assert f"{file}:15: error: the mass of granule 1 and 29 more is 0.00402143" in wrong.out
    document = hertzchain("lint", file, "--json", "--scene", tmp_path / "scene.toml").json()
    assert document["scene"] == str(tmp_path / "scene.toml")
    (one,) = document["decks"]
    (finding,) = one["findings"]
    assert finding["expected"] == pytest.approx(7958 / 8958 * finding["found"], rel=1e-9, abs=0)
    missing = hertzchain("lint", file, "--scene", tmp_path / "none.toml")
    assert missing.status == 2


def test_a_loop_that_defines_its_variable_after_its_label() -> None:
    """As it is often written; a density too high on every granule is found, and a second loop."""
    first = "variable i loop 30\nlabel granule\n"
    assert first in deck()
    swapped = deck().replace(first, "label granule\nvariable i loop 30\n")
    assert lint(swapped, SCENE) == []
    assert rules(swapped.replace("density 7958", "density 8958")) == {"scene-mass"}
    again = "label more\nvariable i loop 7 9\nset atom $i density 9000\nnext i\njump SELF more\n"
    (found,) = bad(lint(swapped.replace("neighbor", f"{again}neighbor", 1), SCENE))
    assert "granule 7 and 2 more" in found.text


def test_included_files_are_looked_at(tmp_path: Path) -> None:
    """As parts of the deck, and named where something is wrong in them; none without end."""
    text = deck().replace("density 7958", "density 8958")
    setup = text.partition("neighbor")[0]
    at = setup.partition("set group all density")[0].count("\n")
    (tmp_path / "setup.in").write_text(setup, encoding="utf-8")
    (tmp_path / "more.in").write_text("include setup.in\n", encoding="utf-8")
    file = tmp_path / "in.chain"
    file.write_text(f"# a chain\ninclude more.in  # made there\n{text[len(setup) :]}")
    (found,) = bad(lint_file(file, SCENE))
    assert (found.line, found.rule) == (2, "scene-mass")
    assert found.text.startswith(f"setup.in:{at + 1}: the mass of granule 1 and 29 more is")
    (tmp_path / "setup.in").write_text(deck().partition("neighbor")[0], encoding="utf-8")
    assert lint_file(file, SCENE) == []
    file.write_text("include none.in\ninclude in.chain\nrun 1\n")
    assert {one.rule for one in lint_file(file)} >= {"elsewhere"}


def test_variables_of_the_command_line(tmp_path: Path, hertzchain: Command) -> None:
    """As LAMMPS takes them: in place of the values of style index, and in loops."""
    values = "variable n index 10 20\nvariable F0 index 50\n"
    text = deck().replace("units si", f"{values}units si").replace("equal 100*", "equal ${F0}*")
    text = text.replace("loop 30", "loop $n")
    right = {"n": "30", "F0": "100"}
    assert rules(text) == {"scene-granules", "scene-force"}
    assert lint(text, SCENE, right) == []
    assert {one.rule for one in lint(text, SCENE, {**right, "F0": "90"})} == {"scene-force"}
    loop = "variable k index 1 2\nlabel more\nset atom $k density 9000\nnext k\njump SELF more\n"
    loop = deck().replace("neighbor", f"{loop}neighbor", 1)
    masses = [one.text for k in ("1 2", "7 8 9") for one in lint(loop, SCENE, {"k": k})]
    assert ["granule 1 and 1 more" in masses[0], "granule 7 and 2 more" in masses[1]] == [
        True,
        True,
    ]
    SCENE.to_toml(tmp_path / "scene.toml")
    (tmp_path / "in.chain").write_text(text, encoding="utf-8")
    given = ["lint", tmp_path / "in.chain", "--scene", tmp_path / "scene.toml"]
    assert hertzchain(*given).status == 1
    assert hertzchain(*given, "--var", "n", "30", "--var", "F0=100").status == 0
    refused = hertzchain("lint", tmp_path / "in.chain", "--var", "n=")
    assert (refused.status, refused.err.count("\n")) == (2, 1)


def test_a_text_that_is_no_deck_is_one_finding() -> None:
    for text in ("", "# a comment\n", "Dear all,\n"):
        assert [finding.rule for finding in lint(text, SCENE)] == ["no-deck"]


def test_numpy_is_loaded_for_a_scene_alone() -> None:
    code = "from hertzchain.decks.lint.rules import lint; lint('units si\\nrun 1\\n')"
    assert "numpy" not in modules_after(code)


@pytest.mark.parametrize("density", ["0", "-0.019"])
def test_granules_without_a_mass_have_no_longest_step(density: str) -> None:
    text = deck().replace("density 7958", f"density {density}")
    assert "scene-mass" in {finding.rule for finding in lint(text, SCENE)}
    assert "step-length" not in {finding.rule for finding in lint(text)}
