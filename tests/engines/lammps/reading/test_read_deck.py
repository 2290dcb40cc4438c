"""LAMMPS's numbers of a deck, by its module and by a binary: in SI units, from the shock on."""

from __future__ import annotations

import math
import os
import re
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.engines.lammps.engine import binary_build
from hertzchain.engines.lammps.reading.deck import FoundDeck, units_of
from hertzchain.engines.lammps.reading.text import Rules, command_of, quoted, words_of
from hertzchain.errors import BackendMissing, RunFailed, TooExpensive
from hertzchain.limits import Deadline
from tests.engines.lammps.reading.chains import (
    BESIDE_PYTHON,
    OTHERS,
    SCENE,
    STEP,
    UNITS,
    Deck,
    read_deck,
)
from tests.engines.lammps.test_lammps import whole_deck
from tests.processes import children, posix

pytestmark = pytest.mark.lammps

slow = pytest.mark.slow

DIGITS = 1e-12
"""Relative: some operations in double precision, and numbers of 17 digits in the deck."""

MASS = 4 / 3 * math.pi * 4e-3**3 * 2500.0
STIFFNESS = 70e9 * math.sqrt(2 * 4e-3) / (3 * (1 - 0.25**2))


def pulse(time: np.ndarray) -> np.ndarray:
    """The force of ``SCENE``, typed again [N]."""
    inside = (time >= 0) & (time < 4e-5)
    return np.where(inside, 20.0 * np.sin(math.pi * time / 4e-5) ** 2, 0.0)


def written_at(deck: FoundDeck, index: int) -> str:
    return deck.commands[index].written


SETTLES = """group last id 6
fix load hit addforce 5 0 0
fix from last addforce -5 0 0
variable force equal 0
fix air all viscous 50
run 5000
unfix air
variable t0 equal $(time)
variable force equal "20*sin(PI*(time-v_t0)/4e-5)^2*(time<(v_t0+4e-5))"
"""
"""Before the first run of ``Deck``: a load of 5 N presses the chain, and a drag slows it down."""


@pytest.mark.parametrize("lmp", [None, pytest.param(BESIDE_PYTHON, marks=slow)])
def test_a_deck_that_settles_is_read_as_it_stands_then(lmp: str | None, tmp_path: Path) -> None:
    """Loads and the shock are those from there on, and time is counted from there."""
    path = Deck(more=SETTLES, steps=600).write(tmp_path)
    deck = read_deck(path, SCENE, lmp=lmp, begin=5000 * STEP)
    assert deck.before == pytest.approx(5000 * STEP, rel=DIGITS)
    assert written_at(deck, deck.first_run) == "run 600"
    assert [(run.start, run.steps) for run in deck.runs] == [(0.0, 600)]
    # The slowest motion dies away in 27 us, to 1e-8 in 500.
    apart = 8e-3 - (5 / STIFFNESS) ** (2 / 3)
    np.testing.assert_allclose(np.diff(deck.position), apart, atol=1e-5 * (8e-3 - apart))
    assert not np.any(deck.drag)
    assert deck.constant_force[[0, -1], 0] == pytest.approx([5, -5], rel=DIGITS)
    expected = pulse(deck.applied_time)
    np.testing.assert_allclose(deck.applied_force[:, 0], expected, atol=1e-9)
    assert [fix.style for fix in deck.fixes if not fix.moves] == ["addforce"] * 3


@pytest.mark.parametrize(
    "deck",
    [
        Deck("micro", "y", reversed=True),
        pytest.param(Deck("micro", "z", pair="history"), marks=slow),
        pytest.param(Deck("si", "z", reversed=True), marks=slow),
    ],
    ids=str,
)
def test_every_number_is_found(deck: Deck, tmp_path: Path) -> None:
    contents = read_deck(deck.write(tmp_path), SCENE)
    assert (contents.units, contents.axis) == (deck.units, deck.axis)
    assert written_at(contents, contents.first_run) == "run 1000"
    np.testing.assert_allclose(contents.radius, 4e-3, rtol=DIGITS)
    np.testing.assert_allclose(contents.mass, MASS, rtol=DIGITS)
    np.testing.assert_allclose(contents.position, 8e-3 * np.arange(6), rtol=DIGITS, atol=1e-18)
    assert contents.ids.tolist() == [1, 2, 3, 4, 5, 6]
    assert set(contents.types.tolist()) == {1}
    assert not np.any(contents.velocity)
    assert not np.any(contents.spin)
    assert not np.any(contents.sideways)
    assert contents.integrated.tolist() == [1] * 6
    assert (contents.reversed, contents.image_gap) == (deck.reversed, None)
    # The law, and no force in a gap.
    assert np.all(contents.contact_force[0] == 0)
    assert np.all(contents.overlap[0] < 0)
    np.testing.assert_allclose(
        contents.contact_force[1:], STIFFNESS * contents.overlap[1:] ** 1.5, rtol=1e-11
    )
    np.testing.assert_allclose(
        contents.damped_force, STIFFNESS * contents.damped_overlap**1.5, rtol=1e-11
    )
    assert np.all(np.abs(contents.closing) > 0)
    assert not np.any(contents.tangential_force)
    assert not np.any(contents.constant_force)
    assert not np.any(contents.drag)
    assert contents.walls == ()
    # The applied force, at each step of the pulse.
    np.testing.assert_allclose(
        contents.applied_force[:, 0], pulse(contents.applied_time), rtol=0, atol=20 * 1e-11
    )
    assert not np.any(contents.applied_force[:, 1:])
    assert contents.applied_sideways == 0
    assert np.max(np.diff(contents.applied_time[contents.applied_time < 4e-5])) < 1.01 * STEP
    # The runs, and the peaks of these steps by other code.
    (run,) = contents.runs
    assert (run.start, run.steps, run.command) == (0.0, 1000, contents.first_run)
    np.testing.assert_allclose([run.dt, contents.end_time], [STEP, 1e-4], rtol=DIGITS)
    same = hc.Native(method="velocity-verlet", dt=STEP).run(SCENE)
    np.testing.assert_allclose(contents.peak_force, same.peak_force, rtol=1e-6)  # of interpolation
    assert contents.peak_reading_error < 1e-5
    np.testing.assert_allclose(contents.final_velocity, same.velocity, atol=1e-6)
    assert contents.image_force < 1e-9
    assert contents.remarks == ()
    assert not contents.driven.any()
    assert not contents.missed_overlap.any()


CHAIN = SCENE.chain
TERMS = {
    "damped, on a wall": hc.Scene(
        replace(CHAIN, granules=4, radius=(4e-3, 3e-3, 4e-3, 5e-3)),
        SCENE.shock,
        hc.Run(end_time=1.5e-4),
        wall=hc.Wall("same"),
        contact=hc.Contact("restitution", restitution=0.7),
    ),
    "piston": hc.Scene(replace(CHAIN, granules=4), hc.Piston(velocity=0.3), hc.Run(end_time=1e-4)),
}


@pytest.mark.parametrize("name", ["damped, on a wall", pytest.param("piston", marks=slow)])
def test_peaks_of_scenes_with_terms(name: str, tmp_path: Path) -> None:
    """Their numbers are judged by the checks of generated decks."""
    scene = TERMS[name]
    deck, dt = tmp_path / "in.mine", 0.01 * scene.contact_time
    deck.write_text(whole_deck(scene, dt))
    contents = read_deck(deck, scene)
    same = hc.Lammps(dt=dt).run(scene)
    np.testing.assert_allclose(contents.peak_force, same.peak_force, rtol=2e-5)
    np.testing.assert_allclose(contents.final_velocity, same.velocity, atol=1e-6)
    if scene.piston:
        assert contents.driven.tolist() == [True, False, False, False]
        np.testing.assert_allclose(
            contents.driven_displacement, 0.3 * contents.driven_time, rtol=0, atol=1e-15
        )


def applied(more: str, tmp_path: Path, run: str = "run 1000") -> FoundDeck:
    """What is found of a deck with other commands before its run."""
    return read_deck(Deck(more=more, run=run).write(tmp_path), SCENE)


def test_forces_of_all_kinds(tmp_path: Path) -> None:
    deck = applied(
        """group last id 6
fix load last addforce -0.5 0 0
fix weight all gravity 10 vector 0 -1 0
fix air all viscous 0.01
unfix push
""",
        tmp_path,
        """run 100
fix push hit addforce v_force 0 0 every 3
run 200
unfix push
variable ramp equal ramp(0,2)
fix sine hit addforce v_ramp 0 0
timestep 2e-7
run 100
unfix sine
run 50""",
    )
    np.testing.assert_allclose(deck.constant_force[:, 0], [0, 0, 0, 0, 0, -0.5])
    np.testing.assert_allclose(deck.constant_force[:, 1], -10 * MASS, rtol=DIGITS)
    np.testing.assert_allclose(deck.drag, 0.01, rtol=1e-9)
    assert [(run.steps, round(run.dt * 1e9), round(run.start * 1e9)) for run in deck.runs] == [
        (100, 100, 0), (200, 100, 10_000), (100, 200, 30_000), (50, 200, 50_000),
    ]  # fmt: skip
    time, force = deck.applied_time, deck.applied_force[:, 0]
    assert np.all(np.diff(time) >= 0)
    assert np.all(force[time < 1e-5] == 0)
    # Every third step alone.
    second = (time > 1.001e-5) & (time < 2.999e-5)
    step = np.round(time[second] / STEP).astype(int)
    assert step.size == 199
    np.testing.assert_allclose(
        force[second], np.where(step % 3 == 0, pulse(step * STEP), 0), rtol=0, atol=1e-9
    )
    third = (time > 3.001e-5) & (time < 4.999e-5)
    np.testing.assert_allclose(force[third], 2 * (time[third] - 3e-5) / 2e-5, rtol=0, atol=1e-9)
    assert np.all(force[time > 5.001e-5] == 0)
    assert time[-1] == pytest.approx(6e-5)
    by_style = {(fix.style, written_at(deck, fix.command)[:8]): fix for fix in deck.fixes}
    assert {style for style, _ in by_style} == {"nve", "addforce", "gravity", "viscous"}
    load = by_style["addforce", "fix load"]
    assert load.granules.tolist() == [False] * 5 + [True]
    assert load.largest[-1].tolist() == [0.5, 0.0]
    assert not load.moves


@pytest.mark.parametrize("run", ["run 20", pytest.param("run 0\nrun 20", marks=slow)])
def test_numbers_are_found_where_velocities_of_ghosts_are_missing(run: str, tmp_path: Path) -> None:
    path = tmp_path / "in.mine"
    path.write_text(Deck(run=run).text().replace("comm_modify vel yes\n", ""))
    deck = read_deck(path, SCENE)
    assert "velocit" in deck.stopped
    np.testing.assert_allclose(
        deck.contact_force[1:], STIFFNESS * deck.overlap[1:] ** 1.5, rtol=1e-11
    )
    (after,) = deck.runs
    assert (after.steps, written_at(deck, after.command)) == (20, "run 20")
    np.testing.assert_allclose(
        deck.applied_force[:, 0], pulse(deck.applied_time), rtol=0, atol=20 * 1e-11
    )
    assert np.all(np.isnan(deck.peak_force))


NO_PUSH = "unfix push\n"
LAW = "granular hertz 1e9 0 tangential linear_nohistory 0 0"
FLOOR = f"fix floor all wall/gran {LAW} yplane -0.0041 NULL\n"
WALL = f"{NO_PUSH}fix wall all wall/gran {LAW} xplane -0.0041 NULL\n"


@pytest.mark.parametrize(
    ("more", "is_reversed"),
    [
        (f"{FLOOR}{WALL}velocity hit set 0.1 0 0", False),
        pytest.param(NO_PUSH, False, marks=slow),
        pytest.param(f"{NO_PUSH}group last id 6\nvelocity last set -1 0 0", True, marks=slow),
        (f"{NO_PUSH}group last id 6\nfix push last addforce -1 0 0 every 2", True),
        pytest.param(WALL, True, marks=slow),
    ],
)
def test_the_shock_may_be_at_either_end(more: str, is_reversed: bool, tmp_path: Path) -> None:
    """By the force, by the speed of a striker, by the only wall; else granule 1 is the lowest."""
    deck = read_deck(Deck(more=more, steps=20).write(tmp_path), SCENE)
    assert deck.reversed == is_reversed
    assert deck.position[0] == 0
    assert deck.position[-1] == pytest.approx(0.04)
    if "velocity" in more:
        assert deck.velocity[0, 0] > 0
    assert len(deck.walls) == ("wall" in more)
    for wall in deck.walls:
        assert written_at(deck, wall.command).startswith("fix wall all")
        assert wall.end == ("last" if is_reversed else "first")
        place = 0.04 + 4.1e-3 if is_reversed else -4.1e-3
        assert wall.position == pytest.approx(place, rel=1e-9)


def test_a_deck_without_a_shock_lies_as_the_granules_of_its_scene_do(tmp_path: Path) -> None:
    """Its light granule is the last, that of the scene the first."""
    deck = Deck(more=f"{NO_PUSH}set atom 6 density 1000", run="run 20")
    light = replace(SCENE.chain, density=[1000.0] + [SCENE.chain.density] * 5)
    read = read_deck(deck.write(tmp_path), replace(SCENE, chain=light))
    assert read.reversed


def test_random_forces_are_no_shock_of_a_striker(tmp_path: Path) -> None:
    """By their signs alone the chain would begin at the wall."""
    struck = hc.Scene(SCENE.chain, hc.Striker(0.3), hc.Run(1e-4), wall=hc.Wall("rigid"))
    wall = WALL.replace("-0.0041 NULL", "NULL 0.044")
    heat = "fix heat all langevin 300 300 1e-3 9\n"
    text = f"{wall}velocity hit set 0.3 0 0\n{heat}"
    assert not read_deck(Deck(more=text, steps=20).write(tmp_path), struck).reversed


# Safety, and other LAMMPS


WRONG: dict[str, tuple[str, str | None, str]] = {
    "endless": ("", "label a\nrun 0\njump SELF a", "not over after 1 s"),
    "a value of the environment": (
        "variable e getenv HOME\nfix z all addforce ${e} 0 0", None, "environment",
    ),
    "a condition on the environment": (
        'variable e getenv HOME\nif "${e} == a" then "run 1"', None, "environment: give its value",
    ),
    "fewer granules": (
        "", "run 10\ngroup last id 4\ndelete_atoms group last\nrun 10", "makes or deletes granules",
    ),
    "crashes": (
        f"variable a equal {'-' * 200_000}1\nvariable b equal $(v_a)", None,
        "in.mine:26: variable b equal $(v_a)",
    ),
}  # fmt: skip
RARELY_WRONG: dict[str, tuple[str, str | None, str]] = {
    "error": ("units real", None, "LAMMPS stopped"),
    "pre no": (
        "",
        "run 9\nunfix push\nrun 9 pre no",
        "in.mine:28: with pre no LAMMPS takes no note",
    ),
    "no end": ("include /dev/zero", None, "cannot be read (no such file)"),
    "no step": ("", "run 0", "takes no step"),
    "no granules": ("delete_atoms group all", None, "has made no granules"),
}


@pytest.mark.parametrize(
    "what", [*WRONG, *(pytest.param(what, marks=slow) for what in RARELY_WRONG)]
)
def test_what_goes_wrong_is_one_sentence(what: str, tmp_path: Path) -> None:
    more, run, words = (WRONG | RARELY_WRONG)[what]
    deck = Deck(more=more, run=run, steps=20).write(tmp_path)
    before = children(os.getpid())
    limit = 1.0 if what == "endless" else 600.0
    with pytest.raises(RunFailed) as caught:
        read_deck(deck, SCENE, time_limit=limit)
    assert isinstance(caught.value, TooExpensive) == (limit == 1.0)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)
    assert "Traceback" not in str(caught.value)
    assert children(os.getpid()) == before
    assert [path.name for path in tmp_path.iterdir()] == ["in.mine"]


def test_units_are_those_of_the_manual() -> None:
    for name, (length, mass, time) in UNITS.items():
        unit = units_of(name)
        assert (unit.length, unit.mass, unit.time) == (length, mass, time)
        assert unit.force == pytest.approx(mass * length / time**2, rel=1e-15)
    for name in ("real", "metal", "electron"):
        with pytest.raises(RunFailed, match=f"units {name} are those of atoms"):
            units_of(name)


GIVEN = """
print 'a b' file x screen no => print "a b" screen no
print 'a' append x => print a
print file x => print file x
print 'file' => print file
print 'a' file => print a file
print 'see b.gz, 5 %' => print "see b.gz, 5 %"
print '$(v_a:%s)' => refused
print '$(v_a:%-8.2f)' => print "$(v_a:%-8.2f)"
fix 1 all ave/time 1 1 1 c_x file y mode vector => fix 1 all ave/time 1 1 1 c_x mode vector
fix 1 all nve => fix 1 all nve
fix 1 all => fix 1 all
fix 1 all print 1 'x' =>
fix 1 all external pf/callback 1 1 => refused
compute 1 all pressure thermo_temp => compute 1 all pressure thermo_temp
compute 1 all => compute 1 all
compute 1 all mliap => refused
compute 1 all mliap/kk => refused
create_atoms 1 mesh there => refused
timer timeout 1 =>
timer full => timer full
variable a python f => refused
variable a getenv HOME => variable a string ValueOfTheEnvironment
variable a equal 1 => variable a equal 1
variable a => variable a
variable a shell ls => refused
variable a file there => variable a file {there}
variable a file lost => refused
variable a file /etc/passwd => refused
variable a format b %8.3f => variable a format b %8.3f
variable a format b %n => refused
print "$(1:%g()%s)" => refused
thermo_modify format float %20.15g => thermo_modify format float %20.15g
thermo_modify format line '%d %*f' => refused
fix 1 all ave/time 1 1 1 c_x format %999f => refused
read_data there add there => read_data {there} add there
read_data there.gz => refused
read_data 'a;b' => refused
read_restart there => refused
molecule there there offset 1 0 0 0 0 => molecule there {there} offset 1 0 0 0 0
pair_coeff * * t.table.xz 1 => refused
pair_style granular => pair_style granular
pair_style => pair_style
pair_style hybrid/overlay granular kim => refused
pair_style hybrid granular v_a lj/cut 2.5 => pair_style hybrid granular v_a lj/cut 2.5
pair_style hybrid granular eam => refused
pair_style python 1 => refused
unfix 9 => unfix 9
shell ls =>
tad 1 2 => refused
"""
"""Commands, and what LAMMPS is given in their place."""


@pytest.mark.parametrize("line", GIVEN.strip().splitlines())
def test_what_lammps_is_given(line: str, tmp_path: Path) -> None:
    for name in ("there", "there.gz", "a;b"):
        (tmp_path / name).write_text("1")
    command, _, given = line.replace("{there}", quoted(str(tmp_path / "there"))).partition(" =>")
    words = [word.value for word in words_of(command)]
    rules = Rules((tmp_path / "nowhere", tmp_path))
    if given == " refused":
        with pytest.raises(RunFailed):
            command_of(rules.decide(words)[0] or [])
        return
    new_words, why = rules.decide(words)
    assert command_of(new_words or []) == given.strip()
    assert new_words is None or (why is None) == (new_words == words or "there" in command)


EXACT = ("ids", "types", "position", "sideways", "radius", "mass", "velocity", "spin", "integrated")

ALL_FORCES = """group last id 6
fix load last addforce 0 0.5 0
fix weight all gravity 10 vector 0 -1 0
fix air all viscous 1e-3
fix wall last wall/gran granular hertz 1e10 0 tangential linear_nohistory 0 0 yplane NULL 4.5
velocity last set 0 0 0.1
"""


def numbers(deck: FoundDeck, name: str) -> np.ndarray:
    """Return the numbers and arrays that were found."""
    return np.asarray(getattr(deck, name), np.float64)


@pytest.mark.parametrize(
    "lmp", [BESIDE_PYTHON, *(pytest.param(path, marks=slow) for path in OTHERS)]
)
def test_a_binary_makes_of_a_deck_what_the_module_makes(lmp: str, tmp_path: Path) -> None:
    run = "run 150\nrun 300 pre no\nunfix push\nrun 100 every 30 NULL"
    deck = Deck("cgs", "y", more=ALL_FORCES, run=run)
    path = deck.write(tmp_path)
    by_module, by_binary = read_deck(path, SCENE), read_deck(path, SCENE, lmp=lmp)
    assert [path.name for path in tmp_path.iterdir()] == ["in.mine"]
    for name in EXACT:
        assert np.array_equal(numbers(by_module, name), numbers(by_binary, name)), name
    for name in ("units", "axis", "reversed", "image_gap", "first_run", "runs", "commands"):
        assert getattr(by_module, name) == getattr(by_binary, name), name
    # Numbers of 17 digits go to and fro; versions from 2022 on differ by round-off.
    close = [
        field.name
        for field in fields(FoundDeck)
        if isinstance(getattr(by_module, field.name), np.ndarray | float)
        and field.name not in (*EXACT, "applied_time", "applied_force", "driven_time",
                               "peak_reading_error", "image_force")
    ]  # fmt: skip
    assert {"contact_force", "damped_force", "peak_force", "constant_force", "drag"} <= set(close)
    for name in close:
        expected = numbers(by_module, name)
        largest = np.max(np.abs(expected), initial=0.0, where=np.isfinite(expected))
        np.testing.assert_allclose(
            numbers(by_binary, name), expected, rtol=1e-9, atol=1e-9 * largest, err_msg=name
        )
    there = [
        np.interp(by_module.applied_time, contents.applied_time, contents.applied_force[:, 0])
        for contents in (by_module, by_binary)
    ]
    np.testing.assert_allclose(there[1], there[0], rtol=0, atol=1e-9 * 20)
    (ours,), (theirs,) = by_module.walls, by_binary.walls
    np.testing.assert_allclose(theirs.position, ours.position, rtol=1e-12)
    np.testing.assert_allclose(theirs.force, ours.force, rtol=1e-9)


OF_2021 = r"s/stride([0-9]*,\([0-9]*\),\([0-9]*\))/(& * (step+\2<=\1))/"
"""What sed makes of our commands: a dump needs a next step, as in LAMMPS of 2021."""

NO_FIX = "s,^fix hertzchain0 .*,fix hertzchain0 all no/such,"
NO_DUMP = "s/^variable hertzchain_next .*/variable hertzchain_next equal 0/"


@posix
@pytest.mark.parametrize("change", [OF_2021, NO_FIX, NO_DUMP])
def test_a_lammps_that_refuses_commands_of_ours_judges_no_deck(change: str, tmp_path: Path) -> None:
    deck, lmp = Deck(steps=40).write(tmp_path), tmp_path / "lmp"
    changed = f"<(exec sed -u '{change}' 2> /dev/null)"
    lmp.write_text(f'#!/bin/bash\nexec "{BESIDE_PYTHON}" "$@" < {changed}\n')
    lmp.chmod(0o755)
    if change == OF_2021:
        assert read_deck(deck, SCENE, lmp=lmp).stopped == ""
        return
    with pytest.raises(BackendMissing, match="a command that hertzchain adds to the deck: take"):
        read_deck(deck, SCENE, lmp=lmp)


@pytest.mark.parametrize("lmp", [pytest.param(None, marks=slow), BESIDE_PYTHON])
def test_a_force_may_follow_the_steps_of_its_run(lmp: str | None, tmp_path: Path) -> None:
    """Runs are not cut where they are read."""
    path = tmp_path / "in.mine"
    text = re.sub(r"\btime\b", "(elapsed*dt)", Deck(steps=450).text())
    path.write_text(text)
    deck = read_deck(path, SCENE, lmp=lmp)
    expected = SCENE.applied_force(deck.applied_time)
    assert deck.applied_force[:, 0] == pytest.approx(expected, rel=1e-9, abs=1e-9)
    assert deck.runs[0].steps == 450


@pytest.mark.parametrize("lmp", [None, pytest.param(BESIDE_PYTHON, marks=slow)])
def test_numbers_of_a_deck_that_stops(lmp: str | None, tmp_path: Path) -> None:
    """They are known before its run, and its runs and forces without its motion."""
    more = "timestep 1e-3\nvelocity hit set 1e3 0 0"
    deck = read_deck(Deck(more=more, steps=20).write(tmp_path), SCENE, lmp=lmp, time_limit=60.0)
    assert deck.stopped
    assert "\n" not in deck.stopped
    assert deck.velocity[0, 0] == 1e3
    assert [run.steps for run in deck.runs] == [20]
    assert np.all(np.isnan(deck.peak_force))


WALL_OF_MATERIAL = (
    "fix wall all wall/gran granular hertz/material 70000000000.0 0 0.25"
    " tangential linear_nohistory 0 0 xplane NULL 0.044"
)


@slow
@pytest.mark.parametrize("lmp", [BESIDE_PYTHON, *OTHERS])
def test_a_wall_of_hertz_material_is_wrong_on_lammps_before_2023(lmp: str, tmp_path: Path) -> None:
    """It takes E/(2(1-nu)) there in place of E/(2(1-nu^2)): 1 + nu times the stiffness."""
    scene = replace(SCENE, wall=hc.Wall("same"), run=hc.Run(end_time=2e-4))
    path = Deck(more=WALL_OF_MATERIAL, steps=2000).write(tmp_path)
    version = binary_build(lmp, Deadline(60)).version
    of_2022 = version < "2023"
    examined = hc.examine(scene, path, lmp=lmp)
    assert examined.verdict == ("fail" if of_2022 else "pass")
    failed = {check.name: check for check in examined.checks if not check.passed}
    assert set(failed) == ({"stiffness of the wall", "peaks"} if of_2022 else set())
    if of_2022:
        check = failed["stiffness of the wall"]
        told = f"(1.25 times: LAMMPS of {version[:4]} takes E/(2(1-nu)) for a wall"
        assert told in check.sentence
        path.write_text(path.read_text().replace(WALL_OF_MATERIAL, check.command))
        assert hc.examine(scene, path, lmp=lmp).verdict == "pass"
