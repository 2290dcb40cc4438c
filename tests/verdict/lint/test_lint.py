"""Lint: every planted trap is found, a clean deck gets no finding, and no text breaks it."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from _pytest.mark.structures import ParameterSet
from hypothesis import given, settings
from hypothesis import strategies as st

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.decks.layout import KnownAnswer, Layout
from hertzchain.decks.standalone import standalone
from hertzchain.engines.lammps.dialect import PAIR_STYLES
from hertzchain.engines.lammps.engine import command, engine
from hertzchain.engines.lammps.reading import looking
from hertzchain.engines.lammps.reading.reading import Start
from hertzchain.errors import HertzchainError
from hertzchain.verdict.lint.deck import Finding
from hertzchain.verdict.lint.rules import RULES, findings, lint_file
from hertzchain.verdict.lint.script import script_of
from tests import scenes
from tests.command_line import Command
from tests.conftest import STEEL
from tests.effort import effort
from tests.places import ROOT
from tests.test_public_names import modules_after

SHIPPED = sorted((ROOT / "lammps_inputs").glob("in.*"))

CLEAN = """\
# Thirty steel spheres, pushed by 100 N for 100 us.
units si
atom_style sphere
boundary f f f
comm_modify vel yes
newton off

variable R equal 4.75e-3
variable N equal 30
region box block $(-2*v_R) $(2*v_R*(v_N+1)) $(-2*v_R) $(2*v_R) $(-2*v_R) $(2*v_R) units box
create_box 1 box
lattice sc $(2*v_R)
region chain block 0 $(v_N-1) 0 0 0 0
create_atoms 1 region chain
set group all diameter $(2*v_R)
set group all density 7958
neighbor $(v_R/2) bin
neigh_modify delay 0 every 1 check yes

pair_style granular
pair_coeff * * hertz/material 193e9 0.0 0.3 &
    tangential linear_nohistory 0.0 0.0

fix motion all nve
group first id 1
timestep 5e-8
variable push equal 50*(1-cos(2*PI*time/1e-4))
fix shock first addforce v_push 0.0 0.0
run 1000
timestep 1e-7
run 500
unfix shock
run 3000
"""

MODEL = "hertz/material 193e9 0.0 0.3 &\n    tangential linear_nohistory 0.0 0.0"
STYLE = f"pair_style granular\npair_coeff * * {MODEL}"
ROOM = "$(-2*v_R) $(2*v_R) $(-2*v_R) $(2*v_R)"
KN = "1.4139e11"


@dataclass(frozen=True)
class Trap:
    """A mistake, and its effect.

    Parameters
    ----------
    rule, severity
        What has to be found.
    old, new
        What stands in the clean deck, and in its place.
    effect
        ``peaks`` moves those of the first 20 contacts, ``stops`` makes LAMMPS stop, ``none``
        costs time, or shows elsewhere.
    by
        The least that the worst peak moves by, relative.
    """

    rule: str
    severity: str
    old: str
    new: str
    effect: str = "none"
    by: float = 0.0


DIAMETER, DENSITY = "set group all diameter $(2*v_R)\n", "set group all density 7958\n"

TRAPS = {
    "density first": Trap(
        "density-before-diameter", "error", DIAMETER + DENSITY, DENSITY + DIAMETER, "peaks", 0.99
    ),
    "density first in one command": Trap(
        "density-before-diameter", "error", DIAMETER + DENSITY,
        "set group all density 7958 diameter $(2*v_R)\n", "peaks", 0.99,
    ),
    "one diameter later": Trap(
        "density-before-diameter", "warning", DENSITY,
        DENSITY + "set atom 5 diameter $(2.2*v_R)\n", "peaks", 1e-3,
    ),
    "no density": Trap("diameter-missing", "error", DENSITY, "", "peaks", 0.99),
    "no diameter": Trap("diameter-missing", "error", DIAMETER, "", "stops"),
    "no ghost velocities": Trap("ghost-velocity", "error", "comm_modify vel yes\n", "", "stops"),
    "excluded pairs": Trap(
        "neighbours", "warning", "delay 0 every 1 check yes",
        "delay 0 every 1 check yes exclude type 1 1", "peaks", 0.99,
    ),
    "tsuji, e 1": Trap(
        "damping", "warning", MODEL, MODEL.replace(" 0.0 0.3", " 1.0 0.3") + " damping tsuji",
        "peaks", 1e-3,
    ),
    "tsuji, e 0": Trap("damping", "error", MODEL, MODEL + " damping tsuji", "peaks", 0.8),
    "tsuji, e 0.9": Trap(
        "damping", "note", MODEL, MODEL.replace(" 0.0 0.3", " 0.9 0.3") + " damping tsuji", "peaks",
        0.05,
    ),
    "coeff_restitution, e 0": Trap(
        "damping", "error", MODEL, MODEL + " damping coeff_restitution", "stops"
    ),
    "damping none": Trap("text-alone", "error", MODEL, MODEL + " damping none", "stops"),
    "damped": Trap(
        "damping", "note", MODEL, MODEL.replace(" 0.0 0.3", " 1.0 0.3") + " damping velocity",
        "peaks", 0.01,
    ),
    "gamma_n": Trap(
        "damping", "note", STYLE,
        f"pair_style gran/hertz/history {KN} NULL 1e9 0.0 0.0 0\npair_coeff * *", "peaks", 0.01,
    ),
    "numbers in another order": Trap(
        "poisson-ratio", "warning", "193e9 0.0 0.3", "193e9 0.3 0.0", "peaks", 1e-3
    ),
    "a Poisson's ratio that cannot be": Trap(
        "poisson-ratio", "error", "193e9 0.0 0.3", "193e9 0.0 0.9", "peaks", 0.01
    ),
    "no tangential law": Trap(
        "text-alone", "error", " &\n    tangential linear_nohistory 0.0 0.0", "", "stops"
    ),
    "Kt of zero": Trap(
        "tangential", "warning", STYLE,
        f"pair_style gran/hertz/history {KN} 0.0 0.0 0.0 0.0 0\npair_coeff * *",
    ),
    "hooke": Trap(
        "not-hertz", "error", "hertz/material 193e9 0.0 0.3", "hooke 1e7 0.0", "peaks", 0.4
    ),
    "gran/hooke": Trap(
        "not-hertz", "error", STYLE, "pair_style gran/hooke 1e7 NULL 0.0 0.0 0.0 0\npair_coeff * *",
        "peaks", 0.4,
    ),
    "atoms": Trap(
        "not-hertz", "error", STYLE, "pair_style lj/cut 0.01\npair_coeff * * 1.0 0.0095", "peaks",
        0.9,
    ),
    "cohesion": Trap(
        "not-hertz", "warning", MODEL,
        MODEL.replace("hertz/material", "jkr").replace(" 0.3 ", " 0.3 0.1 "), "peaks", 2e-4,
    ),
    "no pair style": Trap("not-hertz", "error", STYLE, "", "peaks", 0.9),
    "step*dt": Trap("force-clock", "error", "time/1e-4", "step*dt/1e-4", "peaks", 0.3),
    "dt*step": Trap("force-clock", "error", "time/1e-4", "dt*step/1e-4", "peaks", 0.3),
    "elapsed": Trap("force-clock", "error", "time/1e-4", "elapsed*dt/1e-4", "peaks", 0.3),
    "a force filled in": Trap("force-frozen", "error", "v_push", "$(v_push)", "peaks", 0.99),
    "a force in braces": Trap("force-frozen", "error", "v_push", "${push}", "peaks", 0.99),
    "a force on all": Trap(
        "force-on-all", "warning", "fix shock first", "fix shock all", "peaks", 0.5
    ),
    "a force left on": Trap("force-left-on", "note", "unfix shock\n", "", "peaks", 0.01),
    "a force dropped early": Trap("force-cut", "warning", "run 500", "run 200", "peaks", 0.005),
    "periodic": Trap("periodic", "warning", "boundary f f f", "boundary f p p"),
    "all periodic": Trap("periodic", "warning", "boundary f f f", "boundary p p p"),
    "periodic by default": Trap("periodic", "warning", "boundary f f f\n", ""),
    "a ring": Trap(
        "periodic", "warning", f"boundary f f f|$(-2*v_R) $(2*v_R*(v_N+1)) {ROOM}",
        f"boundary p f f|$(-v_R) $(2*v_R*v_N-v_R) {ROOM}",
    ),
    "classic wall": Trap(
        "wall", "error", "fix motion all nve",
        f"fix motion all nve\nfix wall all wall/gran hertz/history {KN} NULL 0.0 0.0 0.0 0"
        " xplane NULL $(2*v_R*v_N-v_R)",
    ),
    "wall of the same": Trap(
        "wall", "note", "fix motion all nve",
        f"fix motion all nve\nfix wall all wall/gran granular {MODEL}"
        " xplane NULL $(2*v_R*v_N-v_R)",
    ),
    "wall of a material": Trap(
        "wall", "warning", "fix motion all nve",
        f"fix motion all nve\nfix wall all wall/gran granular {MODEL}"
        " xplane NULL $(2*v_R*v_N-v_R)",
    ),
    "contacts that pull": Trap("attraction", "warning", "193e9 0.0 0.3", "193e9 1e4 0.3"),
    "another restitution": Trap(
        "damping", "warning",
        "hertz/material 193e9 0.0 0.3 &\n    tangential linear_nohistory 0.0 0.0",
        "hertz/material 193e9 0.8 0.3 &\n    tangential linear_nohistory 0.0 0.0 damping tsuji"
        " limit_damping", "peaks", 0.1,
    ),
    "classic contacts that pull": Trap(
        "attraction", "warning", STYLE, f"pair_style gran/hertz/history {KN} NULL 1e9 0.0 0.0 0\n"
        "pair_coeff * *",
    ),
    "a pair left to LAMMPS": Trap(
        "mixed-pairs", "warning", f"create_box 1|pair_coeff * * {MODEL}",
        f"create_box 3|pair_coeff 1 1 {MODEL}\npair_coeff 2*3 2*3 {MODEL}\npair_coeff 1 3 {MODEL}",
    ),
    "no motion": Trap("motion", "error", "fix motion all nve\n", "", "peaks", 0.99),
    "two motions": Trap(
        "motion", "error", "fix motion all nve", "fix motion all nve\nfix two all nve", "peaks", 0.1
    ),
    "a thermostat": Trap("thermostat", "error", "all nve", "all nvt temp 300 300 1", "peaks", 0.9),
    "gaps": Trap("not-touching", "warning", "sc $(2*v_R)", "sc $(2*v_R*1.001)", "peaks", 0.5),
    "overlaps": Trap("not-touching", "warning", "sc $(2*v_R)", "sc $(2*v_R*0.999)", "peaks", 0.5),
    "a radius for a diameter": Trap(
        "not-touching", "warning", "diameter $(2*v_R)", "diameter ${R}", "peaks", 0.99
    ),
    "long steps": Trap(
        "step-length", "warning", "timestep 1e-7\nrun 500\n", "timestep 5e-6\nrun 10\n", "peaks",
        2e-3,
    ),
    "unstable steps": Trap(
        "step-length", "error", "unfix shock\nrun 3000", "unfix shock\ntimestep 2e-5\nrun 100",
        "stops",
    ),
    "unstable steps of a striker": Trap(
        "step-length", "error",
        "fix shock first addforce v_push 0.0 0.0\n|unfix shock\n|timestep 1e-7|run 500",
        "velocity first set 1.0 0.0 0.0 units box\n||timestep 1e-4|run 100", "stops",
    ),
    "unstable steps of a constant force": Trap(
        "step-length", "error", "v_push|1e-7\nrun 500", "100.0|2e-5\nrun 100", "stops"
    ),
    "unstable springs": Trap(
        "step-length", "error", "hertz/material 193e9 0.0 0.3|timestep 1e-7\nrun 500",
        "hooke 1e7 0.0|timestep 1.9e-5\nrun 1000", "stops",
    ),
    "thermal velocities": Trap(
        "random-velocities", "error", "fix motion all nve",
        "fix motion all nve\nvelocity all create 1e20 4928459", "peaks", 0.01,
    ),
    "a force on ten": Trap("force-on-all", "warning", "first id 1", "first id 1:10", "peaks", 0.5),
    "a constant force on all": Trap(
        "force-on-all", "warning", "fix shock first addforce v_push", "fix shock all addforce 50.0",
        "peaks", 0.5,
    ),
    "a force at one of ten steps": Trap(
        "force-in-steps", "error", "addforce v_push 0.0 0.0", "addforce v_push 0.0 0.0 every 10",
        "peaks", 0.3,
    ),
    "gravity across": Trap(
        "gravity", "error", "fix motion all nve",
        "fix motion all nve\nfix down all gravity 9.81 vector 0 0 -1",
    ),
    "gravity along a free chain": Trap(
        "gravity", "warning", "fix motion all nve",
        "fix motion all nve\nfix down all gravity 9.81 vector 1 0 0",
    ),
    "no units": Trap("units", "error", "units si\n", ""),
    "a misspelt command": Trap("text-alone", "warning", "pair_coeff", "pair_coef", "stops"),
    "points": Trap("text-alone", "error", "atom_style sphere", "atom_style atomic", "stops"),
}  # fmt: skip


def planted(trap: Trap, text: str = CLEAN) -> str:
    for old, new in zip(trap.old.split("|"), trap.new.split("|"), strict=True):
        assert old in text
        text = text.replace(old, new)
    return text


def lint(text: str, variables: dict[str, str] | None = None) -> list[Finding]:
    """The findings in a text, LAMMPS being asked in this process."""

    def here(path: Path, given: dict[str, str], _: float) -> looking.Look:
        return looking.looked(Start(path.parent, None, alone=False), path, path.parent, given)

    with tempfile.TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as patch:
        patch.setattr(looking, "look", here)
        path = Path(folder) / "in.chain"
        path.write_text(text, encoding="utf-8")
        return lint_file(path, variables)


def bad(findings: list[Finding]) -> list[Finding]:
    return [finding for finding in findings if finding.severity != "note"]


def test_nothing_is_said_of_a_clean_deck() -> None:
    assert lint(CLEAN) == []


FIRST = {trap.rule: name for name, trap in reversed(TRAPS.items())}
"""A trap of each rule: those that the default suite looks for."""


def each(names: Iterable[str]) -> list[ParameterSet]:
    quick = set(FIRST.values())
    return [pytest.param(k, marks=[] if k in quick else [pytest.mark.slow]) for k in names]


@pytest.mark.lammps
@pytest.mark.parametrize("name", each(TRAPS))
def test_a_planted_trap_is_found(name: str) -> None:
    trap = TRAPS[name]
    text = planted(trap)
    found = lint(text)
    assert (trap.rule, trap.severity) in {(f.rule, f.severity) for f in found}
    assert all(1 <= finding.line <= len(text.splitlines()) for finding in found)


def test_every_rule_has_a_planted_trap() -> None:
    elsewhere = {"no-deck", "elsewhere", "no-run", "no-chain"}  # tests of their own
    assert {trap.rule for trap in TRAPS.values()} | elsewhere == set(RULES)


def peaks(text: str) -> FloatArray:
    """The peak force of each contact, from the forces after each step, shape (contacts,)."""
    samples: list[FloatArray] = []
    with engine() as lammps:
        for line in re.sub(r"&\n", "", text).splitlines():
            words = line.split("#")[0].split()
            if words[:1] != ["run"]:
                command(lammps, line)
                continue
            for k in range(int(words[1]) // STRIDE):
                command(lammps, f"run {STRIDE} pre {'no' if k else 'yes'} post no")
                order = np.argsort(lammps.numpy.extract_atom("id")[: lammps.get_natoms()])
                force = np.array(lammps.numpy.extract_atom("f"))[order, 0]
                # What presses contact i is what moves all granules behind it.
                samples.append(np.cumsum(force[::-1])[::-1][1:])
    peak: FloatArray = np.max(samples, axis=0)
    return peak


STRIDE = 10
"""Steps between two looks; a peak lasts hundreds."""


@pytest.fixture(scope="module")
def clean_peaks() -> FloatArray:
    return peaks(CLEAN)


@pytest.mark.lammps
@pytest.mark.parametrize("name", each(n for n, trap in TRAPS.items() if trap.effect == "peaks"))
def test_a_trap_moves_the_peaks(name: str, clean_peaks: FloatArray) -> None:
    moved = np.abs(peaks(planted(TRAPS[name])) / clean_peaks - 1)[:20]
    assert np.max(moved) > TRAPS[name].by


@pytest.mark.lammps
@pytest.mark.parametrize("name", [n for n, trap in TRAPS.items() if trap.effect == "stops"])
def test_lammps_stops_at_a_trap(name: str) -> None:
    with pytest.raises(HertzchainError), engine() as lammps:
        command(lammps, planted(TRAPS[name]))


@pytest.mark.lammps
def test_a_classic_wall_without_damping_ends_in_nan() -> None:
    short = planted(TRAPS["classic wall"]).replace("N equal 30", "N equal 8")
    with engine() as lammps:
        if not 20230000 < lammps.version() < 20260000:
            pytest.skip("seen with LAMMPS 2023 to 2025")
        with pytest.raises(HertzchainError, match="Non-numeric"):
            command(lammps, short)


@pytest.mark.lammps
def test_without_units_a_lattice_is_another_one() -> None:
    with engine() as lammps:
        command(lammps, planted(TRAPS["no units"]).split("set group")[0])
        assert lammps.get_natoms() != 30


MEANT = {
    "in.damped": ["damping"],
    "in.damped_striker_on_a_wall": ["damping"] * 4,
    "in.gapped": ["not-touching"],
}
"""Findings in shipped decks whose granules are apart, pressed or damped on purpose."""


@pytest.mark.lammps
@pytest.mark.parametrize(
    "path",
    [pytest.param(p, marks=[pytest.mark.slow] * (p.name != "in.demo")) for p in SHIPPED],
    ids=lambda path: path.name,
)
def test_nothing_else_is_said_of_shipped_decks(path: Path) -> None:
    assert [finding.rule for finding in lint_file(path)] == MEANT.get(path.name, [])


def generated(scene: hc.Scene, watch_every: int, pair_style: str = "granular") -> str:
    """Return a deck of a scene; its expected peaks do not matter here."""
    layout = Layout(0.05, watch_every, pair_style, dump_every=20 * watch_every)
    ones = np.ones(scene.chain.granules - 1)
    known = KnownAnswer(ones, 1e-3 * ones) if watch_every else None
    return standalone(scene, layout, known)


@pytest.mark.parametrize("watch_every", [0, 2])
@pytest.mark.parametrize("pair_style", PAIR_STYLES)
@pytest.mark.parametrize(
    "name", ["demo", *(pytest.param(k, marks=pytest.mark.slow) for k in scenes.NAMES[::4])]
)
def test_nothing_is_said_of_generated_decks(name: str, pair_style: str, watch_every: int) -> None:
    assert lint(generated(scenes.load(name), watch_every, pair_style)) == []


@pytest.mark.parametrize(
    "radius", [1e-6, 50.0, *(pytest.param(r, marks=pytest.mark.slow) for r in (1e-4, 0.3))]
)
def test_nothing_is_said_of_generated_decks_of_any_size(radius: float) -> None:
    pulse = hc.PulseTable((0.0, 1e-5, 2e-5, 5e-5), (10.0, 40.0, 100.0, 30.0))
    scene = hc.Scene(hc.Chain(10, **{**STEEL, "radius": radius}), pulse)
    assert lint(generated(scene, 1)) == []


def test_a_chain_far_from_its_images_may_be_periodic() -> None:
    def in_a_box(x: float, y: float) -> list[Finding]:
        box = f"$(-{x}*v_R) $(2*v_R*v_N+{x}*v_R) $(-{y}*v_R) $({y}*v_R) -0.1 0.1"
        text = CLEAN.replace("boundary f f f", "boundary p p p")
        return lint(text.replace(f"$(-2*v_R) $(2*v_R*(v_N+1)) {ROOM}", box))

    assert in_a_box(3, 3) == []
    assert [finding.text[:15] for finding in in_a_box(3, 2)] == ["y is periodic: "]
    assert [finding.text[:15] for finding in in_a_box(1, 3)] == ["x is periodic: "]


@pytest.mark.slow
def test_a_deck_that_follows_a_long_table_is_read_in_seconds() -> None:
    times = np.linspace(0, 1e-4, 501)
    table = hc.PulseTable(tuple(times), tuple(100 * np.sin(np.pi * times / 1e-4) ** 2))
    scene = hc.Scene(hc.Chain(10, **STEEL), table)
    assert lint(generated(scene, 1)) == []


@pytest.mark.parametrize(
    ("old", "new", "line", "said"),
    [
        ("run 1000", "run", "run", "run needs at least 1 word more"),
        ("first addforce v_push", "first addforce v_f", "run 1000", "variable f of a force"),
        ("equal 50*(1", "equal v_F*(1", "run 1000", "reference v_F in"),
        ("units si", "include missing", "include", "cannot be read"),
    ],
)
def test_a_deck_that_lammps_refuses_is_an_error(old: str, new: str, line: str, said: str) -> None:
    """At the line where LAMMPS stops."""
    text = CLEAN.replace(old, new)
    found = [one for one in lint(text) if one.rule == "text-alone"]
    assert [one.severity for one in found] == ["error"]
    assert said in found[0].text
    assert text.split("\n")[found[0].line - 1].startswith(line)


def test_a_force_may_name_a_variable_that_is_made_before_the_run() -> None:
    """LAMMPS asks for it when the run begins."""
    made, used = CLEAN[CLEAN.index("variable push") : CLEAN.index("run 1000")].splitlines()
    assert lint(CLEAN.replace(f"{made}\n{used}", f"{used}\n{made}")) == []


def test_a_generated_deck_with_a_trap_is_not_clean() -> None:
    text = (ROOT / "lammps_inputs" / "in.demo").read_text(encoding="utf-8")
    assert bad(lint(text.replace("comm_modify vel yes", "")))
    assert bad(lint(text.replace("boundary s f f", "")))
    assert bad(lint(re.sub(r"(set .*diameter.*\n)(set .*density.*\n)", r"\2\1", text)))


@pytest.mark.parametrize(
    ("pairs", "found"),
    [
        (("1 1", "2 2", "1 2"), False),
        (("1 1", "2 2", "2 1"), False),
        (("* *",), False),
        (("1*2 2", "1 1"), False),
        (("1 1", "2 2"), True),
        (("1 1", "${i} 2"), False),  # cannot be known
    ],
)  # fmt: skip
def test_which_pairs_are_left_to_lammps(pairs: tuple[str, ...], found: bool) -> None:
    laws = "\n".join(f"pair_coeff {pair} {MODEL}" for pair in pairs)
    text = CLEAN.replace("create_box 1", "create_box 2").replace(f"pair_coeff * * {MODEL}", laws)
    said = {finding.rule for finding in lint(text)}
    assert ("mixed-pairs" in said) == found


@pytest.mark.parametrize(("limit", "given"), [("", "0.853"), (" limit_damping", "0.858")])
def test_the_restitution_of_tsuji_is_said(limit: str, given: str) -> None:
    text = CLEAN.replace("193e9 0.0 0.3", "193e9 0.8 0.3")
    law = "tangential linear_nohistory 0.0 0.0"
    said = [finding.text for finding in lint(text.replace(law, f"{law} damping tsuji{limit}"))]
    assert any(f"tsuji with 0.8 gives a restitution of {given} in LAMMPS" in one for one in said)


def test_a_wall_whose_stiffness_is_given_may_be_rigid() -> None:
    law = "hertz 2.8e11 0.0 tangential linear_nohistory 0.0 0.0"
    wall = f"fix motion all nve\nfix wall all wall/gran granular {law} xplane NULL $(2*v_R*v_N-v_R)"
    assert lint(CLEAN.replace("fix motion all nve", wall)) == []


HEAP = """\
units lj
atom_style sphere
region box block 0 20 0 20 0 30
create_box 2 box
change_box all boundary p p f
comm_modify vel yes
pair_style granular
pair_coeff 1 * hertz/material 1e5 0.2 0.3 tangential mindlin NULL 1.0 0.5 damping tsuji
pair_coeff 2 2 hertz 200.0 20.0 tangential linear_history 300.0 1.0 0.1
region top cylinder z 10 10 5 15 30
fix 1 all nve/sphere
fix down all gravity 10.0 vector 0 0 -1
fix rain all pour 1500 1 3123 region top diam range 0.5 1.0 dens 1.0 1.0
neighbor 0.3 bin
fix floor all wall/gran granular hertz/material 1e5 1e3 0.3 tangential mindlin NULL 1.0 0.5 &
    zplane 0 NULL
timestep 0.001
run 5000
"""


def test_a_deck_of_liggghts_is_known_as_one() -> None:
    text = CLEAN.replace(STYLE, "pair_style gran model hertz tangential off\npair_coeff * *")
    assert [(f.rule, f.severity) for f in lint(text)] == [("elsewhere", "note")]


def test_a_chain_made_in_a_loop_is_a_chain() -> None:
    made = """\
variable i loop 30
label more
variable x equal (v_i-1)*2*v_R
create_atoms 1 single ${x} 0 0 units box
next i
jump SELF more
"""
    text = CLEAN.replace("create_atoms 1 region chain\n", made)
    assert lint(text) == []
    assert {f.rule for f in lint(text.replace("boundary f f f", ""))} == {"periodic"}


def test_later_commands_count() -> None:
    assert lint(CLEAN.replace("run 1000", DIAMETER + DENSITY + "run 1000")) == []
    text = CLEAN.replace(DIAMETER + DENSITY, DENSITY + DIAMETER + DENSITY)
    assert lint(text) == []


def test_words_are_split_as_lammps_splits_them() -> None:
    text = """\
variable a index 3   # a comment
print "a # that is none" # but this is
if "${a} > 2" then "set group all diameter 1.0" &
    "run $( v_a + 1 )" else 'run 7'
print \"\"\"two
lines\"\"\"
run $(2*v_a:%.17g) every ${a} "set group all density 1"
"""
    commands = script_of(Path("in.chain"), text)
    assert [(c.line, c.words) for c in commands] == [
        (1, ("variable", "a", "index", "3")),
        (2, ("print", "a # that is none")),
        (
            3,
            (
                "if",
                "${a} > 2",
                "then",
                "set group all diameter 1.0",
                "run $(v_a+1)",
                "else",
                "run 7",
            ),
        ),
        (5, ("print", "two\nlines")),
        (7, ("run", "$(2*v_a:%.17g)", "every", "${a}", "set group all density 1")),
    ]


MORE_WORDS = 'set fix run if variable jump label next ${R} $(v_R) $( & # " \' """ v_push * 0 -1 nan'
WORDS = sorted(set((CLEAN + HEAP + MORE_WORDS).split()))


EXAMPLES = pytest.mark.parametrize("examples", [30, pytest.param(2000, marks=pytest.mark.slow)])


@EXAMPLES
def test_any_text_gives_findings(examples: int) -> None:
    settings(max_examples=examples)(given(st.text(max_size=300))(has_findings))()


def of_text(text: str) -> list[Finding]:
    """The findings in a text alone."""
    return findings(script_of(Path("in.chain"), text))


def has_findings(text: str) -> None:
    assert all(finding.rule in RULES for finding in of_text(text))


CHANGES = st.lists(st.tuples(st.integers(0, 400), st.sampled_from(["", "drop", "twice", *WORDS])))


@EXAMPLES
def test_any_change_of_a_deck_gives_findings_or_none(examples: int) -> None:
    changed = given(CHANGES, st.sampled_from([CLEAN, HEAP]))(is_found_or_not)
    settings(max_examples=examples)(changed)()


def is_found_or_not(changes: list[tuple[int, str]], text: str) -> None:
    pieces = re.split(r"(\s+)", text)
    for place, new in changes:
        at = place % len(pieces)
        pieces[at] = {"drop": "", "twice": pieces[at] * 2}.get(new, new)
    for finding in of_text("".join(pieces)):
        assert finding.line >= 1
        assert finding.text == " ".join(finding.text.split()) or "\n" in "".join(pieces)


HOSTILE = (
    '"' * 200_000, '"""' + "x\n" * 100_000, "&\n" * 100_000, "print $(" * 20_000, "((((" * 50_000,
    "variable a equal v_a\n" * 20_000, "set group all density 1\n" * 5_000,
    "fix a all addforce v_f 0 0\nrun 1\n" * 1_000, "label a\n" * 20_000 + "jump SELF a\n",
)  # fmt: skip


@pytest.mark.parametrize("text", HOSTILE, ids=lambda text: text[:12].split("\n")[0])
def test_a_hostile_text_is_soon_read(text: str) -> None:
    assert effort(lambda: of_text(text)) < 300


def test_files_that_cannot_be_read_are_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(HertzchainError, match="cannot be read"):
        lint_file(tmp_path / "none")
    with pytest.raises(HertzchainError, match="cannot be read"):
        lint_file(tmp_path)
    large = tmp_path / "in.large"
    large.write_bytes(b"run 1\n" * 1_000_000)
    with pytest.raises(HertzchainError, match="larger than 5 MB"):
        lint_file(large)


def test_comments_may_be_in_another_encoding(tmp_path: Path) -> None:
    file = tmp_path / "in.chain"
    file.write_bytes("# Stoß\n".encode("latin-1") + CLEAN.encode())
    assert lint_file(file) == []


def test_text_that_is_no_deck_is_named() -> None:
    assert [finding.rule for finding in lint("Dear all,\nplease find attached.\n")] == ["no-deck"]


def test_a_deck_that_never_runs_is_named() -> None:
    text = re.sub(r"^run ", "runn ", CLEAN, flags=re.MULTILINE)
    assert [finding.rule for finding in bad(lint(text))] == ["no-run"]


def test_the_command(tmp_path: Path, hertzchain: Command) -> None:
    good, wrong = tmp_path / "in.good", tmp_path / "in.wrong"
    good.write_text(CLEAN, encoding="utf-8")
    wrong.write_text(planted(TRAPS["density first"]), encoding="utf-8")
    clean = hertzchain("lint", good)
    assert (clean.status, clean.out) == (0, "0 errors, 0 warnings, 0 notes\n")
    found = hertzchain("lint", good, wrong)
    assert found.status == 1
    assert found.out.startswith(f"{wrong}:15: error: the density is set before the diameter")
    assert found.out.endswith("[density-before-diameter]\n1 error, 0 warnings, 0 notes\n")
    decks = hertzchain("lint", "--json", good, wrong).json()["decks"]
    assert [len(one["findings"]) for one in decks] == [0, 1]
    assert decks[1]["findings"][0]["line"] == 15
    missing = hertzchain("lint", tmp_path / "none")
    assert missing.status == 2
    assert missing.err.count("\n") == 1


def test_notes_leave_the_status_at_0(tmp_path: Path, hertzchain: Command) -> None:
    file = tmp_path / "in.chain"
    file.write_text(planted(TRAPS["a force left on"]), encoding="utf-8")
    outcome = hertzchain("lint", file)
    assert outcome.status == 0
    assert ": note: " in outcome.out


def test_included_files_are_looked_at(tmp_path: Path) -> None:
    """As parts of the deck, and named where something is wrong in them; none without end."""
    wrong = planted(TRAPS["density first"])
    setup, rest = wrong[: wrong.index("neighbor")], wrong[wrong.index("neighbor") :]
    at = setup.partition("set group all density")[0].count("\n") + 1
    (tmp_path / "setup.in").write_text(setup, encoding="utf-8")
    (tmp_path / "more.in").write_text("include setup.in\n", encoding="utf-8")
    file = tmp_path / "in.chain"
    file.write_text(f"# a chain\ninclude more.in  # made there\n{rest}", encoding="utf-8")
    (found,) = bad(lint_file(file))
    assert (found.line, found.rule) == (2, "density-before-diameter")
    assert found.text.startswith(f"setup.in:{at}: the density is set before the diameter")
    (tmp_path / "setup.in").write_text(CLEAN[: CLEAN.index("neighbor")], encoding="utf-8")
    assert lint_file(file) == []
    file.write_text("include none.in\ninclude in.chain\nrun 1\n", encoding="utf-8")
    assert {one.rule for one in lint_file(file)} >= {"elsewhere"}


def test_variables_of_the_command_line(tmp_path: Path, hertzchain: Command) -> None:
    """As LAMMPS takes them: in place of the values of style index."""
    step = re.search(r"^timestep .*$", CLEAN, flags=re.MULTILINE)
    assert step is not None
    text = CLEAN.replace(step[0], "variable dt index 1.0\ntimestep ${dt}")
    assert "step-length" in {finding.rule for finding in bad(lint(text))}
    assert bad(lint(text, {"dt": step[0].split()[1]})) == []
    file = tmp_path / "in.chain"
    file.write_text(text, encoding="utf-8")
    assert hertzchain("lint", file).status == 1
    assert hertzchain("lint", file, "--var", f"dt={step[0].split()[1]}").status == 0
    refused = hertzchain("lint", file, "--var", "n=")
    assert (refused.status, refused.err.count("\n")) == (2, 1)


def test_numpy_is_not_needed() -> None:
    code = (
        "from pathlib import Path; from hertzchain.verdict.lint.rules import *;"
        " findings(script_of(Path('a'), 'units si\\nrun 1\\n'))"
    )
    assert "numpy" not in modules_after(code)
