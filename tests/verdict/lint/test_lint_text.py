"""Lint's reading of a deck's text: loops, conditions, granules, contacts, the longest step."""

from __future__ import annotations

import re
from pathlib import Path
from random import Random

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hertzchain.engines.lammps.engine import command, engine
from hertzchain.verdict.lint.chain import Chain
from hertzchain.verdict.lint.rules import lint
from hertzchain.verdict.lint.script import parse
from hertzchain.verdict.lint.stability import impact_force, longest_step, spring
from tests.verdict.lint.test_lint import CLEAN, HEAP, MODEL, STYLE, planted
from tests.verdict.lint.test_lint import TRAPS as ALL_TRAPS

MASSES = st.lists(st.floats(1e-3, 1e3), min_size=2, max_size=12)


@given(MASSES, st.randoms(use_true_random=False), st.booleans())
def test_the_longest_step_is_two_over_the_largest_frequency(
    masses: list[float], random: Random, wall: bool
) -> None:
    springs = [random.uniform(1e-3, 1e3) for _ in masses[wall is False :]]
    matrix = np.zeros((len(masses),) * 2)
    for k, stiffness in enumerate(springs[: len(masses) - 1]):
        matrix[k : k + 2, k : k + 2] += stiffness * np.array([[1, -1], [-1, 1]])
    if wall:
        matrix[-1, -1] += springs[-1]
    root = np.sqrt(masses)
    largest = np.linalg.eigvalsh(matrix / np.outer(root, root))[-1]
    # Sturm's count stops at 1e-10 of the square.
    assert longest_step(masses, springs) == pytest.approx(2 / np.sqrt(largest), rel=1e-8, abs=0)


def test_a_long_chain_of_equal_granules_has_the_limit_of_natural_units() -> None:
    # m = A = F = 1: springs of 3/2, the limit is sqrt(m/k); 2 over 2 sqrt(k/m) cos(pi/2N).
    n = 40
    found = longest_step([1.0] * n, [spring(1.0, 1.0)] * (n - 1))
    expected = np.sqrt(2 / 3) / np.cos(np.pi / (2 * n))
    assert found == pytest.approx(float(expected), rel=1e-9, abs=0)


def test_the_force_of_an_impact_is_that_of_its_energy() -> None:
    # m* v^2 / 2 = 2/5 A d^(5/2) at the largest overlap.
    stiffness, mass, other, velocity = 3.0, 2.0, 5.0, 0.7
    d = (5 / 4 * (mass * other / (mass + other)) * velocity**2 / stiffness) ** 0.4
    found = impact_force(stiffness, mass, other, velocity)
    # The constant has nine digits.
    assert found == pytest.approx(stiffness * d**1.5, rel=1e-8, abs=0)


@pytest.mark.parametrize(("factor", "found"), [(0.99, False), (1.01, True)])
def test_springs_have_an_exact_limit(factor: float, found: bool) -> None:
    mass = np.pi / 6 * 0.0095**3 * 7958
    limit = float(np.sqrt(mass / 1e7) / np.cos(np.pi / 60))
    text = CLEAN.replace("hertz/material 193e9 0.0 0.3", "hooke 1e7 0.0")
    text = text.replace("run 3000", f"timestep {factor * limit!r}\nrun 100")
    assert ("step-length" in {finding.rule for finding in lint(text)}) is found


@pytest.mark.parametrize(("factor", "found"), [(0.99, False), (1.01, True)])
def test_a_chain_of_unknown_length_has_the_limit_of_a_long_one(factor: float, found: bool) -> None:
    mass, modulus = np.pi / 6 * 0.0095**3 * 7958, 193e9 / (2 * (1 - 0.3**2))
    stiffness = 4 / 3 * modulus * np.sqrt(0.0095 / 4)
    # F = A d^(3/2) under 100 N; from 12 granules on the limit is less than 1 % above sqrt(m/k).
    limit = float(np.sqrt(mass / (1.5 * stiffness ** (2 / 3) * 100 ** (1 / 3))))
    text = CLEAN.replace("variable N equal 30", "variable N equal round(random(20,40,3))")
    text = text.replace("unfix shock\nrun 3000", f"timestep {factor * limit!r}\nrun 100")
    assert chain(text).row is None
    errors = {finding.rule for finding in lint(text) if finding.severity == "error"}
    assert ("step-length" in errors) is found


@pytest.mark.lammps
@pytest.mark.parametrize(("factor", "grown"), [(0.99, False), (1.01, True)])
def test_lammps_is_unstable_above_that_limit(factor: float, grown: bool) -> None:
    """Granules pressed into one another, between two that are held, so that none lets go."""
    mass = np.pi / 6 * (1.01 * 0.0095) ** 3 * 7958
    limit = float(np.sqrt(mass / 1e7) / np.cos(np.pi / 60))
    text = CLEAN.split("group first")[0].replace("hertz/material 193e9 0.0 0.3", "hooke 1e7 0.0")
    text = text.replace("diameter $(2*v_R)", "diameter $(2*v_R*1.01)")
    with engine() as lammps:
        command(lammps, text)
        command(lammps, "group ends id 1 30\nfix still ends setforce 0.0 0.0 0.0")
        command(lammps, "group middle subtract all ends")
        command(lammps, "velocity middle create 1e15 4711\nvelocity middle set NULL 0 0")
        command(lammps, f"timestep {factor * limit!r}\nrun 0")
        before = lammps.get_thermo("ke")
        command(lammps, "run 200")
        after = lammps.get_thermo("ke")
    assert (after > 100 * before) is grown


def chain(text: str) -> Chain:
    return Chain(parse(text))


LOOPED = """\
variable i loop 3 5
label outer
variable j index a b
label inner
print "$i $j $(v_i*2)"
next j
jump SELF inner
next i
jump SELF outer
print "after"
"""


DEFINED_WITHIN = re.sub(r"(variable .*\n)(label .*\n)", r"\2\1", LOOPED)
"""The same: a loop ignores the definition of what it counts with in all rounds but the first."""


@pytest.mark.parametrize("text", [LOOPED, DEFINED_WITHIN], ids=["before", "within"])
def test_loops_are_written_out_as_lammps_runs_them(text: str) -> None:
    said = [command.words[1] for command in parse(text).named("print")]
    assert said == [f"{i} {j} {2.0 * i}" for i in (3, 4, 5) for j in "ab"] + ["after"]


@pytest.mark.lammps
@pytest.mark.parametrize("loops", [LOOPED, DEFINED_WITHIN], ids=["before", "within"])
def test_lammps_runs_these_loops_so(loops: str, tmp_path: Path) -> None:
    file = tmp_path / "in.loop"
    text = loops.replace("$(v_i*2)", "$(v_i*2:%.1f)")
    file.write_text(re.sub(r'^print (".*")$', rf"print \1 append {tmp_path}/out", text, flags=re.M))
    with engine() as lammps:
        lammps.file(str(file))
    said = [command.words[1] for command in parse(loops).named("print")]
    assert (tmp_path / "out").read_text().splitlines() == said


@pytest.mark.parametrize(
    "loop",
    [
        "variable i loop ${n}\nlabel a\nrun 1\nnext i\njump SELF a\n",
        'variable i loop 3\nlabel a\nrun 1\nif "$i > 2" then "jump SELF b"\nnext i\njump SELF a\n',
        "variable i loop 3\nlabel a\nrun 1\nnext i\njump other a\n",
        "variable i loop 100000\nlabel a\nrun 1\nnext i\njump SELF a\n",
        "label a\nrun 1\njump SELF a\n",
    ],
)
def test_loops_that_are_not_known_are_not_written_out(loop: str) -> None:
    (run,) = parse(loop).named("run")
    assert run.conditional


def test_a_branch_that_is_not_taken_does_nothing() -> None:
    text = (
        "variable a index 3\n"
        'if "${a} > 2" then "variable b equal 1" elif "${a} > 1" "variable b equal 2"'
        ' else "variable b equal 3"\n'
        'if "${a} < 2" then "variable c equal 1" elif "${a} > 2" "variable c equal 2"'
        ' else "variable c equal 3"\n'
        'if "${a} < 2" then "variable d equal 1" else "variable d equal 3"\n'
        'if "${x} < 2" then "variable e equal 1"\n'
    )
    script = parse(text)
    assert [script.value(f"v_{name}", 99) for name in "bcde"] == [1.0, 2.0, 3.0, None]


def test_a_group_of_a_region_and_velocities_that_are_set() -> None:
    text = CLEAN.replace(
        "fix motion",
        "region left block -0.5 1.5 INF INF INF INF\ngroup left region left\n"
        "set group left vy 2.0\nfix motion",
    )
    row = chain(text).row
    assert row is not None
    assert row.members("left") == frozenset((1, 2))
    assert [velocity[1] for velocity in row.velocity[:3]] == [2.0, 2.0, 0.0]


@pytest.mark.lammps
@pytest.mark.parametrize(
    "formula", ["ramp(1,5)", "swiggle(1,2,3e-6)", "cwiggle(1,2,3e-6)", "vdisplace(1,2e5)"]
)
def test_formulas_of_a_run_have_the_value_that_lammps_gives_them(formula: str) -> None:
    text = CLEAN.replace("50*(1-cos(2*PI*time/1e-4))", f'"{formula}"').split("run 500")[0]
    found = chain(f"{text}run 500\n")
    (force,) = found.forces
    run = force.runs[1]
    with engine() as lammps:
        # The formula is of the run that goes on: the mean over its last three steps.
        command(lammps, f"{text}fix mean all ave/time 1 1 1 v_push\nvariable now equal f_mean")
        command(lammps, "thermo_style custom step v_push\nrun 500")
        value = lammps.extract_fix("mean", 0, 0)
    assert run.end is not None
    # The time of LAMMPS is a sum of steps.
    assert force.at(found, 0, run, run.end) == pytest.approx(value, rel=1e-9, abs=1e-9)


def test_damping_of_nearly_nothing_is_none() -> None:
    for number, found in (("1e-300", False), ("1e-99", True)):
        text = CLEAN.replace("193e9 0.0 0.3", f"193e9 {number} 0.3")
        assert (lint(text) != []) is found
        contact = (chain(text).contacts or [])[0]
        assert (contact.damping != 0) is found


def test_a_formatted_variable_has_the_value_of_the_other() -> None:
    script = parse("variable a equal 1/8\nvariable b format a %.3g\nrun $(8*v_b)\n")
    assert script.commands[-1].words == ("run", "1.0")


def test_the_granules_of_a_deck() -> None:
    text = """\
units si
region box block -1 20 -1 1 -1 1
create_box 2 box
lattice sc 2.0
create_atoms 1 single 0 0 3
create_atoms 2 single 0 0 5.0 units box
create_atoms 1 single 0 0 4 units lattice
set type 1 diameter 1.0
set atom 2*3 diameter 2.0 density 3.0
group some id 1:3:2
group few id <= 2
group rest subtract all few
velocity rest set NULL 0.5 2.0 units box
velocity few set 0 0 1
displace_atoms some move 0 0 0.5
run 10
set group all diameter 7
"""
    row = chain(text).row
    assert row is not None
    assert row.axis == 2
    assert row.ids == (2, 1, 3)
    assert row.place == (5.0, 7.0, 9.0)
    assert row.diameter == (2.0, 1.0, 2.0)
    assert row.kind == (2, 1, 1)
    heavy = np.pi / 6 * 8 * 3
    assert row.mass == pytest.approx((heavy, np.pi / 6, heavy), rel=1e-14)
    assert [velocity[2] for velocity in row.velocity] == [2.0, 2.0, 2.0]
    assert row.velocity[2] == (0.0, 0.5, 2.0)
    assert row.groups["some"] == frozenset((1, 3))
    assert row.groups["rest"] == frozenset((3,))


@pytest.mark.lammps
def test_lammps_makes_the_same_granules() -> None:
    row = chain(CLEAN).row
    assert row is not None
    with engine() as lammps:
        command(lammps, CLEAN.split("timestep")[0])
        order = np.argsort(lammps.numpy.extract_atom("id")[:30])
        x = lammps.numpy.extract_atom("x")[:30][order, 0]
        mass = lammps.numpy.extract_atom("rmass")[:30][order]
    assert list(row.place) == pytest.approx(x.tolist(), rel=1e-15, abs=0)
    assert list(row.mass) == pytest.approx(mass.tolist(), rel=1e-14, abs=0)


@pytest.mark.parametrize(
    "text",
    [
        CLEAN.replace("create_atoms 1 region chain", "read_data file"),
        CLEAN.replace("boundary", "include more\nboundary"),
        CLEAN.replace("lattice sc", "lattice fcc"),
        CLEAN.replace("0 $(v_N-1) 0 0 0 0", "0 $(v_N-1) 0 1 0 0"),
        CLEAN.replace("0 $(v_N-1) 0 0 0 0", "0 1e12 0 0 0 0"),
        HEAP,
    ],
)
def test_granules_that_are_not_known(text: str) -> None:
    assert chain(text).row is None


HERTZ = "hertz {} {} tangential linear_nohistory 0.0 0.0"
LAW = "gran/hertz/history {} NULL {} 0.0 0.0 0"


@pytest.mark.lammps
@pytest.mark.parametrize(
    "style",
    [
        STYLE,
        f"pair_style granular\npair_coeff * * {HERTZ.format('1.4e11', '0.0')}",
        f"pair_style {LAW.format('1.4e11', '0.0')}\npair_coeff * *",
        f"pair_style {LAW.format('1.4e11', '3e9')}\npair_coeff * *",
        f"pair_style granular\npair_coeff * * {HERTZ.format('1.4e11', '3e9')}",
        f"pair_style granular\npair_coeff * * {HERTZ.format('1.4e11', '0.8')} damping tsuji",
        f"pair_style granular\npair_coeff * * {HERTZ.format('1.4e11', '30.')} damping velocity",
        f"pair_style granular\npair_coeff * * {HERTZ.format('1e11', '9.')} damping mass_velocity",
        f"pair_style granular\npair_coeff * * {MODEL.replace(' 0.0 0.3', ' 2e9 0.3')}",
    ],
)
def test_contacts_have_the_force_that_lammps_gives_them(style: str) -> None:
    """Granule 1 is larger; pressed by 1e-6 m, it approaches the next at 0.1 m/s."""
    larger = "set atom 1 diameter 0.012\nset atom 1 density 7958\n"
    text = CLEAN.replace(STYLE, style).replace("neighbor", f"{larger}neighbor", 1)
    (contact, *_) = chain(text).contacts or []
    depth, rate = 1e-6, 0.1
    with engine() as lammps:
        command(lammps, text.split("group first")[0])
        command(lammps, f"set atom 1 x {-(0.012 + 0.0095) / 2 + 0.0095 + depth!r}")
        command(lammps, f"group first id 1\nvelocity first set {rate} 0 0 units box")
        command(lammps, "group rest subtract all first\nneigh_modify exclude group rest rest")
        command(lammps, "run 0")
        order = np.argsort(lammps.numpy.extract_atom("id")[:30])
        force = -float(lammps.numpy.extract_atom("f")[:30][order[0], 0])
    assert contact.stiffness is not None
    assert contact.damping is not None
    elastic = contact.stiffness * depth**contact.exponent
    expected = elastic + contact.damping * depth**contact.power * rate
    # The place has so many digits: 1e-17 m of an overlap of 1e-6 m.
    assert force == pytest.approx(expected, rel=1e-9, abs=0)


@pytest.mark.parametrize(
    ("vector", "found"),
    [
        ("vector 0 1 0", "error"),
        ("vector 1 1 0", "error"),
        ("vector -1 0 0", "warning"),
        ("chute 0", "error"),
        ("chute 90", "warning"),
        ("spherical 0 90", "warning"),
        ("spherical 90 90", "error"),
    ],
)
def test_where_gravity_points(vector: str, found: str) -> None:
    text = CLEAN.replace("fix motion", f"fix down all gravity 9.81 {vector}\nfix motion")
    assert {f.severity for f in lint(text) if f.rule == "gravity"} == {found}
    wall = "fix w all wall/gran granular hertz 1e11 0.0 tangential linear_nohistory 0.0 0.0"
    along = text.replace("fix motion", f"{wall} xplane NULL 0.28025\nfix motion")
    assert bool([f for f in lint(along) if f.rule == "gravity"]) is (found == "error")
    across = text.replace("fix motion", f"{wall} yplane -0.00475 NULL\nfix motion")
    assert not [f for f in lint(across) if f.rule == "gravity"]


@pytest.mark.parametrize(("step", "found"), [(0.198, False), (0.202, True)])
def test_from_a_fifth_of_the_natural_time_on_steps_are_long(step: float, found: bool) -> None:
    mass, modulus = np.pi / 6 * 0.0095**3 * 7958, 193e9 / (2 * (1 - 0.3**2))
    stiffness = 4 / 3 * modulus * np.sqrt(0.0095 / 4)
    unit = float(np.sqrt(mass) / (stiffness ** (1 / 3) * 100 ** (1 / 6)))  # under 100 N
    text = CLEAN.replace("unfix shock\nrun 3000", f"timestep {step * unit!r}\nrun 100")
    assert [f.severity for f in lint(text) if f.rule == "step-length"] == ["warning"] * found


def said(text: str, rule: str) -> bool:
    return rule in {finding.rule for finding in lint(text)}


LANDINGS = "25*(floor(v_s)+ternary(v_s-floor(v_s)<{0},(v_s-floor(v_s))/{0},1))*(v_s<4)".replace(
    "v_s", "(time/2.5e-5)"
)
"""A formula of four ramps, each for a part of 25 us that is filled in, and a level after each."""


@pytest.mark.parametrize(
    ("push", "found"),
    [
        ("50*(1-cos(2*PI*time/1e-4))", False),
        ("100*(time<1e-4)", False),  # a rectangle
        ("100*(time<5e-5)+50*(time>=5e-5)*(time<1e-4)", False),  # two levels
        ("(time<5e-6)*time/5e-6*100+(time>=5e-6)*100", False),  # a ramp, then one level
        ("100*ternary(time<5e-5,time/5e-5,2-time/5e-5)*(time<1e-4)", False),
        ("10*ceil(10*sin(PI*time/1e-4))*(time<1e-4)", True),
        ("10*round(10*sin(PI*time/1e-4))*(time<1e-4)", True),
        (LANDINGS.format(0.5), False),  # as long on ramps as on levels
        (LANDINGS.format(0.3), False),
        (LANDINGS.format(0.1), True),
    ],
)
def test_which_formulas_are_staircases(push: str, found: bool) -> None:
    assert said(CLEAN.replace("50*(1-cos(2*PI*time/1e-4))", f'"{push}"'), "force-in-steps") is found


def test_static_loads_are_no_staircase_and_push_one_granule_each() -> None:
    held = "".join(f"fix p{k} first addforce {k} 0.0 0.0\n" for k in (1, 2, 3))
    text = CLEAN.replace("timestep 5e-8", f"group last id 30\n{held}timestep 5e-8")
    assert lint(text) == []


@pytest.mark.parametrize(("factor", "found"), [(1.5, True), (1.5 * 1.003, False), (1.0, False)])
def test_kn_of_a_material_that_is_named(factor: float, found: bool) -> None:
    kn = factor * 2 * 193e9 / (3 * (1 - 0.3**2))
    style = f"pair_style gran/hertz/history {kn!r} NULL 0.0 0.0 0.0 0\npair_coeff * *"
    text = "# Young's modulus 193 GPa, Poisson's ratio 0.3\n" + CLEAN.replace(STYLE, style)
    assert said(text, "stiffness-of-material") is found
    two = "# the wall has E = 70 GPa\n" + text
    assert not said(two, "stiffness-of-material")  # which is meant is not known


def test_messages_have_the_numbers_of_the_deck() -> None:
    def sentence(name: str, rule: str) -> str:
        return next(f.text for f in lint(planted(ALL_TRAPS[name])) if f.rule == rule)

    assert "collide at 1 make" in sentence("unstable steps of a striker", "step-length")
    assert "for contacts of this deck, whatever" in sentence("unstable springs", "step-length")
    assert "temperature 1e20" in sentence("thermal velocities", "random-velocities")
    assert "the 10 granules of group first" in sentence("a force on ten", "force-on-all")
    assert "has 9 levels" in sentence("a force in ten steps", "force-in-steps")
    assert "3 steps, 14, 85, 14" in sentence("a force in runs", "force-in-steps")
    assert "gravity of 9.81 pulls across" in sentence("gravity across", "gravity")
    assert "1.5 times" in sentence("no 2/3 in Kn", "stiffness-of-material")


def test_an_empty_variable_of_the_caller_is_read() -> None:
    """A command line refuses one."""
    assert {finding.rule for finding in lint("print ${a}\n", {"a": ""})} == {"no-deck"}
