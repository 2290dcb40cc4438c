"""Wrong numbers of a deck: lines and corrections, the scene's commands, and their proofs."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.engines.lammps.reading.deck import UNITS, Executed, FoundDeck, FoundWall, Units
from hertzchain.engines.lammps.reading.probing import DAMPED, DEPTHS
from hertzchain.engines.lammps.reading.text import Edits
from hertzchain.errors import RunFailed
from hertzchain.examiner import correct
from hertzchain.examiner.examined import Case, Changes, DeckCheck, Place
from hertzchain.examiner.examining import case_of
from hertzchain.examiner.probes import probes_of
from hertzchain.limits import Deadline
from tests.examiner.corpus import scene_of
from tests.examiner.made import (
    DECKS,
    Change,
    assert_alike,
    both,
    changed,
    deck_of,
    examined,
    in_texts,
    plus,
    times,
)

EXPECTED: dict[str, list[list[Any]]] = tomllib.loads(
    Path(__file__).with_name("corrections.toml").read_text(encoding="utf-8")
)
"""By a mistake, for each failed check: name, line, both numbers, and perhaps the effect."""

OF_SCENES: dict[str, tuple[str, dict[str, Any], str, str]] = {
    "a wall further away": (
        "wall", {"wall": hc.Wall("rigid", gap=1e-5)}, "NULL 0.095", "NULL 0.09501",
    ),
    "a soft wall": ("wall", {"wall": hc.Wall("same")}, "1.047394606e+11", "5.23697303e+10"),
    "a slow striker": ("wall", {"shock": hc.Striker(0.4)}, "set 0.5", "set 0.4"),
    "light granules": (
        "wall", {"chain": replace(scene_of("wall").chain, density=2e3)}, "2700", "2000",
    ),
    "a soft type": (
        "dimer", {"chain": replace(scene_of("dimer").chain, young_modulus=[2e11, 6e10] * 8)},
        "7e10", "6e10",
    ),
    "a longer pulse": (
        "precompressed", {"shock": hc.Pulse("cosine", 40.0, 2.0, rise_time=25e-6)},
        "40e-6", "50e-6",
    ),
    "a higher pulse": (
        "precompressed", {"shock": hc.Pulse("cosine", 44.0, 2.0, rise_time=20e-6)}, "40*", "44*",
    ),
    "a fast piston": ("piston", {"shock": hc.Piston(0.25)}, "linear 0.2", "linear 0.25"),
    "more damping": (
        "viscoelastic",
        {"contact": hc.Contact("viscoelastic", relaxation_time=6e-7, attraction=True)},
        "59366650.12", "71239980.14",
    ),
    "no damping": ("viscoelastic", {"contact": None}, "59366650.12", "0.0"),
}  # fmt: skip
"""Decks that compute another scene in all of their numbers and their motion."""


def without(style: str) -> Change:
    """Takes the fixes of a style out of a deck."""
    return lambda deck: changed(
        deck, fixes=tuple(fix for fix in deck.fixes if fix.style != style),
        walls=() if style.startswith("wall") else deck.walls,
    )  # fmt: skip


def in_wall(**numbers: Callable[[Any], Any]) -> Change:
    """Changes numbers of the wall."""

    def change(deck: FoundDeck) -> FoundDeck:
        (wall,) = deck.walls
        values = {name: of(getattr(wall, name)) for name, of in numbers.items()}
        return changed(deck, walls=(replace(wall, **values),))

    return change


def wall_behind(deck: FoundDeck) -> FoundDeck:
    """Also a wall that the last granule meets, ten times as soft as its contacts."""
    depth, closing = np.array(DEPTHS[1:]) * 5e-6, np.array([speed for _, speed in DAMPED])
    damped = np.array([depth for depth, _ in DAMPED]) * 5e-6
    soft = 0.1 * float(deck.contact_force[4, 0] / deck.overlap[4, 0] ** 1.5)
    wall = FoundWall("last", float(deck.position[-1]) + 4.75e-3 + 1e-7, depth, soft * depth**1.5,
                     closing, damped, soft * damped**1.5, 0.0, 7)  # fmt: skip
    return changed(deck, walls=(wall,))


def held_for_fifty_steps(deck: FoundDeck) -> FoundDeck:
    """The force is that of every fiftieth step."""
    at = np.arange(deck.applied_time.size) // 50 * 50
    return changed(deck, applied_force=deck.applied_force[at])


def with_steps(dt: float) -> Change:
    """The run takes other steps up to the same end."""

    def change(deck: FoundDeck) -> FoundDeck:
        (run,) = deck.runs
        steps = round(run.dt * run.steps / dt)
        deck = in_texts(f"run {run.steps}", f"run {steps} every 10 NULL")(deck)
        return changed(deck, runs=(replace(run, dt=dt, steps=steps),))

    return change


_POWERS = (
    np.maximum(np.array(DEPTHS), 1e-9) ** -0.5,
    np.array([depth for depth, _ in DAMPED]) ** -0.5,
)
"""What makes forces of Hertz's law proportional to overlaps."""

OF_NUMBERS: dict[str, tuple[str, Change]] = {
    "a wall for granule 1": (
        "wall", both(without("wall/gran"), in_texts("fix w all", "fix w first"))
    ),
    "no wall at all": (
        "wall", both(without("wall/gran"), in_texts("fix w all wall/gran", "print wall"))
    ),
    "two walls": (  # the other one is behind granule 1, which comes back to it
        "wall", lambda deck: changed(deck, walls=(
            *deck.walls, replace(deck.walls[0], end="first", position=-0.005 - 1e-6)))
    ),
    "friction of the wall": ("wall", in_wall(tangential_force=lambda _: 1.0)),
    "a wall with a limit": (
        "wall", in_wall(force=lambda force: np.minimum(force, force[3])),
    ),
    "spin": ("wall", plus("spin", (3, 1), 1.0)),
    "velocity across": ("wall", plus("velocity", (3, 1), 0.01)),
    "velocities at random": (
        "wall", both(plus("velocity", (3, 1), 0.01),
                     in_texts("set group all density 2700", "velocity all create 300 4928"))
    ),
    "a granule moves": ("wall", plus("velocity", (3, 0), 0.01)),
    "off the axis": ("wall", plus("sideways", (3, 1), 2e-4)),
    "more gravity": (
        "column", both(times("constant_force", 1.2), in_texts("9.81", "11.772"))
    ),
    "a large granule": ("piston", times("radius", 1.01, 4)),
    "a gap": ("piston", plus("position", slice(5, None), 1e-6)),
    "no gravity": ("column", both(times("constant_force", 0.0), without("gravity"))),
    "a load on granule 1": ("column", plus("constant_force", (0, 0), 0.01)),
    "a force across": ("column", plus("constant_force", (2, 1), 0.01)),
    "more load": (
        "precompressed", both(plus("constant_force", (0, 0), 2.0), in_texts("p first addforce 20",
                                                                            "p first addforce 22"))
    ),
    "no hold": ("precompressed", times("constant_force", 0.0, (13, 0))),  # -0 N
    "two granules pushed": (
        "precompressed",
        lambda deck: plus("applied_force", (..., 1), deck.applied_force[:, 0])(deck),
    ),
    "the last granule pushed": (
        "precompressed", lambda deck: changed(deck, applied_force=deck.applied_force[:, ::-1])
    ),
    "nothing pushed": ("precompressed", times("applied_force", 0.0)),
    "pushed across": ("precompressed", lambda deck: changed(deck, applied_sideways=40.0)),
    "the force held": ("precompressed", held_for_fifty_steps),
    "the force of every fiftieth step": (
        "precompressed", both(held_for_fifty_steps, in_texts("fix 2 first addforce",
                                                           "fix 2 first addforce every 50"))
    ),
    "drag": (
        "precompressed", both(plus("drag", slice(1, None), 0.5),
                              in_texts("group last id 14", "fix v all viscous 0.5"))
    ),
    "a force on a piston": ("piston", plus("applied_force", (slice(9), 2), 3.0)),
    "two pistons": ("piston", plus("driven", 1, True)),
    "no piston": ("piston", both(times("driven", False), without("move"))),
    "a granule fixed that is free": ("fixed", plus("integrated", 3, -1)),
    "a fixed granule that moves": ("fixed", plus("integrated", 8, 1)),
    "a granule moved twice": ("fixed", plus("integrated", 3, 1)),
    "long steps": (
        "piston", both(with_steps(3e-6), in_texts("timestep 2e-7", "timestep 3e-6"))
    ),
    "long steps of no command": (
        "piston", both(with_steps(3e-6), in_texts("timestep 2e-7", "print no_step"))
    ),
    "neighbours": ("piston", plus("missed_overlap", 3, 1e-6)),
    "a contact of Hooke": (
        "piston", both(times("contact_force", _POWERS[0], (slice(None), 4)),
                       times("damped_force", _POWERS[1], (slice(None), 4)))
    ),
    "a contact that is excluded": (
        "piston", both(times("contact_force", 0.0, (..., 4)), times("damped_force", 0.0, (..., 4)),
                       in_texts("group rest subtract all first",
                                "neigh_modify exclude group first rest"))
    ),
    "a wall of old": (
        "wall", both(lambda deck: changed(deck, version="20220603"),
                     in_wall(force=lambda f: 1.33 * f, damped_force=lambda f: 1.33 * f))
    ),
    "a wall that is not met": (
        "column", both(lambda deck: changed(deck, walls=()), in_texts("NULL 0.18", "-0.5 0.25"))
    ),
    "contacts across the box": (
        "piston", lambda deck: changed(deck, image_gap=1e-4, image_force=3.0)
    ),
    "another fix": (
        "piston", both(times("peak_force", 1.1), in_texts("group rest subtract all first",
                                                          "fix v all viscous 3.0"))
    ),
    "a change between runs": (
        "piston", both(times("peak_force", 1.1), lambda deck: changed(deck, first_run=3))
    ),
    "a wall behind the chain": (
        "piston", both(wall_behind, in_texts("group rest subtract all first",
                                             "fix w all wall/gran granular hertz 1e9 0"))
    ),
    "a wall that moves": (
        "wall", both(plus("missed_overlap", -1, 1e-6), in_texts("0.095", "0.095 wiggle x 1e-6 1"))
    ),
    "forces at random": (
        "piston", in_texts("group rest subtract all first", "fix h all langevin 300 300 1 9")
    ),
    "another velocity at the end": ("piston", plus("final_velocity", 5, 0.05)),
}  # fmt: skip
"""Decks with the motion of the scene, but with a wrong number."""


@pytest.mark.parametrize("name", DECKS)
def test_a_right_deck_passes(name: str) -> None:
    done = examined(scene_of(name), deck_of(name, scene_of(name)))
    assert [check.sentence for check in done.checks if not check.passed or check.differs] == []
    reasons = {check.name: check.reason for check in done.checks}
    assert reasons["number of granules"] == "counts must be equal"
    digits = "allowed is what changes no peak by more than 0.001, and 0.01 of the number"
    assert reasons["radius"] == reasons["mass"] == digits


def is_as_expected(name: str, done: hc.DeckExamination) -> None:
    """Assert what a table says of each failed check; of the motion only where nothing else did."""
    failed = {
        check.name: check
        for check in done.to_correct
        if len(done.to_correct) == 1 or not check.name.startswith("motion")
    }
    assert [*failed] == [row[0] for row in EXPECTED[name]]
    for check, (_, line, *expected) in zip(failed.values(), EXPECTED[name], strict=True):
        numbers = [check.measured, check.expected, check.effect][: len(expected)]
        assert numbers == pytest.approx(expected, rel=1e-6)  # of a thousand steps
        if check.is_sure:  # another line is blamed only where a trial shows it
            assert (check.place and check.place.line) == line
        for edits in check.corrections:
            for (_, _, written), lines in edits.items():
                for needed in ("run ", "timestep "):
                    kept = any(line.startswith(needed) for line in lines)
                    assert not written.startswith(needed) or kept
                # A load takes the place of loads, a formula that of formulas.
                is_load = check.role == "constant force" and lines[0].startswith("fix")
                assert not is_load or "v_F" not in written


@pytest.mark.parametrize("name", OF_SCENES)
def test_a_deck_of_another_scene(name: str) -> None:
    """The effect of the number is what it changes in the reference; the motion is not a finding."""
    deck, change, old, new = OF_SCENES[name]
    scene = scene_of(deck)
    other = replace(scene, **change)
    done = examined(scene, deck_of(deck, other, old, new))
    is_as_expected(name, done)
    assert len(done.to_correct) == 1
    right, wrong = (hc.Native("reference").run(each).peak_force for each in (scene, other))
    off = np.abs(wrong / right - 1)[done.judged]
    # Steps of the deck change both peaks by less than 1e-4.
    assert done.to_correct[0].effect == pytest.approx(float(np.max(off)), abs=1e-4)


@pytest.mark.parametrize("name", OF_NUMBERS)
def test_a_deck_with_a_wrong_number(name: str) -> None:
    deck, change = OF_NUMBERS[name]
    scene = scene_of(deck)
    is_as_expected(name, examined(scene, change(deck_of(deck, scene))))


@pytest.mark.parametrize("name", ["spin", "two pistons", "a wall with a limit"])
def test_numbers_that_no_chain_on_a_line_has_explain_any_motion(name: str) -> None:
    deck, change = OF_NUMBERS[name]
    scene = scene_of(deck)
    done = examined(scene, times("peak_force", 1.1)(change(deck_of(deck, scene))))
    assert [check.name for check in done.to_correct] == [row[0] for row in EXPECTED[name]]


ODD = Units("odd", length=2.0, mass=3.0, time=5.0)

IN_UNITS: list[tuple[str, str, list[tuple[str, str]]]] = [
    ("a large granule", "radius", [("length", "length")] * 2),
    ("a gap", "distance of neighbours", [("length", "length")] * 2),
    ("off the axis", "distance from the axis", [("length", "")]),
    ("a granule moves", "velocity at the start", [("velocity", "")]),
    ("velocity across", "velocity across the chain", [("velocity", "")]),
    ("spin", "spin at the start", [("spin", "")]),
    ("a wall further away", "place of the wall", [("length", "length")]),
    ("a soft wall", "stiffness of the contacts", [("pressure", "pressure")] * 3),
    ("light granules", "mass", [("mass", "density"), ("density", "density"), ("mass", "mass")]),
    ("a higher pulse", "applied force", [("force", "force")] * 2),
    ("a fast piston", "displacement of the piston", [("velocity", "velocity")]),
    ("more gravity", "constant force", [("acceleration", "acceleration"), ("force", "force")]),
    ("more load", "constant force", [("force", "force")]),
    ("long steps", "time step", [("time", "time")]),
]
"""A mistake, a number, and the units of what may stand in its line as the wrong and right one."""


def pairs_of(case: Case, name: str) -> list[tuple[float, float]]:
    """Pairs of the wrong and right number that may stand in a line, where a probe differs most."""
    numbers = next(probe for probe in probes_of(case) if probe.name == name).compare(case)
    (number,) = (number for number in numbers if number.differs)
    return list(number.stands)


@pytest.mark.parametrize(("name", "number", "units"), IN_UNITS)
def test_numbers_in_the_units_of_a_deck(
    name: str, number: str, units: list[tuple[str, str]]
) -> None:
    if name in OF_SCENES:
        deck, scene_change, old, new = OF_SCENES[name]
        scene = scene_of(deck)
        contents = deck_of(deck, replace(scene, **scene_change), old, new)
    else:
        deck, change = OF_NUMBERS[name]
        scene = scene_of(deck)
        contents = change(deck_of(deck, scene))
    si, _ = case_of(scene, contents, 1e-3, Deadline(60.0), {})
    pairs = [pairs_of(case, number) for case in (si, replace(si, units=ODD))]
    assert [len(numbers) for numbers in pairs] == [len(units)] * 2
    for in_si, in_units, names in zip(*pairs, units, strict=True):
        for value, there, unit in zip(in_si, in_units, names, strict=True):
            assert value == pytest.approx(there * getattr(ODD, unit) if unit else 0.0)


FRICTION = "tangential linear_nohistory 0.0 0.0"
DOWN: dict[str, Any] = {
    "axis": "z",
    "direction": np.array([0, 0, -1.0]),
    "origin": np.array([0.01, 0, 0.3]),
}


@cache
def right_case(name: str) -> Case:
    """What checks share of a right deck."""
    scene = scene_of(name)
    return case_of(scene, deck_of(name, scene), 1e-3, Deadline(60.0), {})[0]


def case(name: str, units: str = "si", **numbers: Any) -> Case:
    """The same with other units or numbers of its granules."""
    example = right_case(name)
    return replace(example, units=UNITS[units], deck=changed(example.deck, **numbers))


def later(name: str, units: str = "si", **numbers: Any) -> Callable[[], Case]:
    """The same, which is computed when a test wants it."""
    return partial(case, name, units, **numbers)


def modulus(young: float, poisson: float) -> float:
    """Of a contact of two granules of one material: E* = E / (2 (1 - nu^2)) [Pa]."""
    return young / (2 * (1 - poisson**2))


STEEL = 4 / 3 * modulus(193e9, 0.3)
RUBBER = 4 / 3 * modulus(5e6, 0.45)
MIXED = 4 / 3 / ((1 - 0.3**2) / 200e9 + (1 - 0.34**2) / 70e9)

Commands = Callable[[Case], list[str] | None]

TABLE: list[tuple[Commands, Callable[[], Case], list[str] | None]] = [
    (correct.granule_commands, later("dimer", "micro"),
     ["set type 1 diameter 12000", "set type 2 diameter 6000",
      "set type 1 density 7.8", "set type 2 density 2.7"]),
    (correct.granule_commands, later("dimer", types=np.ones(16, np.int64)),
     [*(f"set atom {k} diameter {(0.006, 0.012)[k % 2]}" for k in range(1, 17)),
      *(f"set atom {k} density {(2700, 7800)[k % 2]}" for k in range(1, 17))]),
    (correct.granule_commands, later("piston", ids=np.arange(11)), []),
    (correct.velocity_commands, later("wall", "cgs"),
     ["velocity all set 0.0 0.0 0.0 units box", "velocity first set 50 0.0 0.0 units box"]),
    (correct.velocity_commands, later("piston", spin=np.ones((12, 3))),
     ["velocity all set 0.0 0.0 0.0 units box", "set group all omega 0.0 0.0 0.0"]),
    (correct.law_commands, later("dimer", "micro"),
     ["pair_style granular", f"pair_coeff * * hertz {MIXED / 1e3:.10g} 0.0 {FRICTION}"]),
    (correct.law_commands, later("viscoelastic"),
     ["pair_style granular", (f"pair_coeff * * hertz {STEEL:.10g}"
      # eta m* a v with a = sqrt(R* d) is tau times dF/dt = 3/2 A d^1/2 v, A = 4/3 E* sqrt(R*).
      f" {0.5e-6 * 2 * modulus(193e9, 0.3) / (2 / 3 * np.pi * 4.75e-3**3 * 7958):.10g}"
      f" {FRICTION} damping viscoelastic")]),
    (correct.wall_commands, later("piston"), None),
    (correct.wall_commands, later("column", "cgs", **DOWN),
     [(f"fix wall all wall/gran granular hertz {20 * RUBBER:.10g} 1e-300 {FRICTION}"
      " damping velocity zplane 11.0792756751313 NULL")]),
    (correct.load_commands, later("piston"), []),
    (correct.load_commands, later("column", "cgs", **DOWN),
     ["fix gravity all gravity 981 vector 0.0 0.0 -1"]),
    (correct.load_commands, later("precompressed", **DOWN, ids=np.arange(14) + 3),
     ["group granule1 id 3", "fix load1 granule1 addforce 0.0 0.0 -20",
      "group granule14 id 16", "fix load14 granule14 addforce 0.0 0.0 20"]),
    (correct.load_commands, later("fixed"),  # its striker is not pressed; the fixed one holds
     ["group granule2 id 2", "fix load2 granule2 addforce 5 0.0 0.0"]),
    (correct.motion_commands, later("wall"), ["fix motion all nve"]),
    (correct.motion_commands, later("piston"),
     ["group others subtract all first", "fix motion others nve"]),
    (correct.motion_commands, later("fixed"),
     ["group fixed id 9", "group others subtract all fixed", "fix motion others nve"]),
    (correct.piston_commands, later("wall"), []),
    (correct.piston_commands, later("piston", "cgs"),
     ["fix piston first move linear 20 0.0 0.0 units box"]),
    (correct.shock_commands, later("wall"), []),
    (correct.shock_commands, later("column", "cgs", **DOWN),
     [('variable F_2 equal "-((time>=0)*(time<0.002)*(200000.0*time/0.002)+(time>=0.002)*'
      '(time<0.004)*(200000.0-200000.0*(time-0.002)/0.002))"'),
      "fix shock first addforce 0.0 0.0 v_F_2"]),
    (correct.shock_commands, later("dimer", "micro"),
     [('variable F equal "(time>=0)*(time<25)*(150000000000.0*time/25.0)+(time>=25)*'
      '(time<50)*(150000000000.0-150000000000.0*(time-25.0)/25.0)"'),
      "fix shock first addforce v_F 0.0 0.0"]),
]  # fmt: skip


@pytest.mark.parametrize("row", range(len(TABLE)))
def test_commands_of_a_scene(row: int) -> None:
    commands, example_of, expected = TABLE[row]
    lines = commands(example_of())
    assert (lines is None) == (expected is None)
    assert_alike(lines or [], expected or [])


LINES = ("variable V equal 1", "set all mass", "pair_coeff", "fix load", "run 10")

Outcome = Callable[[set[str]], tuple[Sequence[str], float]]
"""Function from the lines of a deck to the names of failed checks and the error of its peaks."""


def edit(line: int, *lines: str) -> Changes:
    """What stands in place of a line of the deck, counted from 1."""
    return {("in.made", line, LINES[line - 1]): lines}


def failed(name: str, line: int, *tried: Changes) -> DeckCheck:
    """A failed check of a line."""
    place = Place("in.made", line, LINES[line - 1], line - 1)
    return DeckCheck(name, "", 1.0, 2.0, 0.1, False, True, f"{name} is wrong", "", place,
                     corrections=tried)  # fmt: skip


class Deck:
    """A deck with some checks, and what is found of it with edits."""

    def __init__(
        self, scene: hc.Scene, right: FoundDeck, checks: Sequence[DeckCheck], outcome: Outcome
    ) -> None:
        self.done = examined(scene, right)
        self.checks, self.outcome = checks, outcome
        self.tried: list[Edits] = []
        commands = tuple(Executed(t, "in.made", k, t) for k, t in enumerate(LINES, start=1))
        self.contents = changed(right, commands=commands)

    def __call__(self, edits: Edits, limit: float = math.inf) -> hc.DeckExamination:
        """The examination of the deck with edits."""
        assert limit > 0
        self.tried.append(edits)
        lines = {("in.made", line): (text,) for line, text in enumerate(LINES, start=1)}
        assert edits.keys() <= lines.keys()
        now = {text for texts in (lines | dict(edits)).values() for text in texts}
        if "bad syntax" in now:
            raise RunFailed("LAMMPS stopped")
        names, error = self.outcome(now)
        checks = [
            c if c.name in names else replace(c, passed=True, differs=False, effect=0.0)
            for c in self.checks if c.name in names or c.role != "motion"
        ]  # fmt: skip
        peaks = replace(self.done.checks[-1], passed=error < 1e-3)
        stopped = "granules left the box" if "stops" in now else ""
        contents = changed(
            self.contents, peak_force=self.done.reference.peak_force * (1 + error), stopped=stopped
        )
        return replace(self.done, checks=(*checks, peaks), contents=contents)

    def proven(self) -> hc.DeckExamination:
        """The examination of the deck as it is, with its proven corrections."""
        return correct.with_findings(correct.Prover(self({}), self, 1e3))


def shown(done: hc.DeckExamination) -> list[tuple[str, list[str], bool, int | None]]:
    """Of each finding its checks, its lines, whether only with others, and what it follows."""
    return [
        (
            " ".join(check.name for check in finding.checks),
            [f"{line.line}: {'; '.join(line.commands)}" for line in finding.correction],
            finding.with_others,
            finding.follows,
        )
        for finding in done.findings
    ]


MASS, LAW, LOAD = edit(2, "right mass"), edit(3, "right law"), edit(4, "right load")


def wrong(now: set[str], **needs: str) -> list[str]:
    """Names of the checks whose line is not there."""
    return [name for name, line in needs.items() if line.replace("_", " ") not in now]


def mass_and_law(now: set[str]) -> tuple[list[str], float]:
    names = wrong(now, mass="right mass", law="right law")
    return names, 0.1 * len(names)


def law_explains_mass(now: set[str]) -> tuple[list[str], float]:
    return ([] if "right law" in now else ["mass", "law"]), 0.1 * ("right law" not in now)


def make_up(now: set[str]) -> tuple[list[str], float]:
    """Two errors that make up for one another: with one of them alone peaks are further off."""
    names = wrong(now, mass="right mass", law="right law")
    return names, (0.0, 0.3, 0.1)[len(names)]


def load_behind_mass(now: set[str]) -> tuple[list[str], float]:
    """The motion is looked at only where no number explains the peaks."""
    if "right mass" not in now:
        return ["mass"], 0.1
    names = wrong(now, motion="right load")
    return names, 0.04 * len(names)


def load_breaks(now: set[str]) -> tuple[list[str], float]:
    """A wrong line makes the mass right, and something else wrong."""
    names = wrong(now, mass="right mass", law="right law")
    if "other mass" in now:
        names = ["law", "load"]
    return names, 0.1


NOT_FIRST = edit(2, "bad syntax"), edit(2, "no help"), edit(2, "stops"), edit(2, "other mass")

CASES: dict[str, tuple[list[DeckCheck], Outcome, list[tuple[str, list[str], bool, int | None]],
                       dict[int, tuple[str, ...]]]] = {
    "the first that helps": (
        [failed("mass", 2, *NOT_FIRST, MASS), failed("law", 3, LAW), failed("load", 4)],
        load_breaks,
        [("mass", ["2: right mass"], False, None), ("law", ["3: right law"], False, None)],
        {2: ("right mass",), 3: ("right law",)},
    ),
    "one that no correction helps": (
        [failed("mass", 2, *NOT_FIRST[:2]), failed("law", 3, LAW)],
        mass_and_law,
        [("mass", [], False, None), ("law", ["3: right law"], False, None)],
        {3: ("right law",)},
    ),
    "two numbers of one line": (
        [failed("mass", 2, edit(2, "half", "x")), failed("size", 2, edit(2, "y", "half"))],
        lambda now: (wrong(now, mass="x", size="y"), 0.1),
        [("mass size", [], False, None)],
        {},
    ),
    "two numbers of one line, one after the other": (
        [failed("mass", 2, edit(2, "right mass", LINES[1])),
         failed("size", 2, edit(2, LINES[1], "right size"))],
        lambda now: (wrong(now, mass="right_mass", size="right_size"), 0.1),
        [("mass size", ["2: right mass; set all mass; right size"], False, None)],
        {2: ("right mass", "set all mass", "right size")},
    ),
    "what follows stands behind": (
        [failed("mass", 2), failed("law", 3, LAW)],
        law_explains_mass,
        [("law", ["3: right law"], False, None), ("mass", [], False, 0)],
        {3: ("right law",)},
    ),
    "what follows is not tried": (
        [failed("law", 3, LAW), failed("mass", 2, MASS)],
        law_explains_mass,
        [("law", ["3: right law"], False, None), ("mass", [], False, 0)],
        {3: ("right law",)},
    ),
    "errors that make up for one another": (
        [failed("mass", 2, MASS), failed("law", 3, LAW)],
        make_up,
        [("mass", ["2: right mass"], True, None), ("law", ["3: right law"], True, None)],
        {2: ("right mass",), 3: ("right law",)},
    ),
    "something else acts, too": (
        [failed("mass", 2, MASS), replace(failed("motion", 4, LOAD), role="motion")],
        load_behind_mass,
        [("mass", ["2: right mass"], False, None), ("motion", ["4: right load"], False, None)],
        {2: ("right mass",), 4: ("right load",)},
    ),
    "together no better": (
        [failed("mass", 2, MASS), failed("law", 3, LAW)],
        lambda now: (make_up(now)[0], 0.3 - 0.1 * len(make_up(now)[0])),
        [("mass", [], False, None), ("law", [], False, None)],
        {},
    ),
}  # fmt: skip
"""Checks that fail in front, what follows from edits, the findings, and all edits together."""


@pytest.mark.parametrize("name", CASES)
def test_corrections(name: str, scene: hc.Scene, right: FoundDeck) -> None:
    checks, outcome, findings, edits = CASES[name]
    deck = Deck(scene, right, checks, outcome)
    done = deck.proven()
    assert shown(done) == findings
    assert done.edits == {("in.made", line): lines for line, lines in edits.items()}
    assert done.remarks == deck.done.remarks
    for finding in done.findings:
        for check in finding.checks:
            assert check in done.checks
            commands = [line.commands for line in finding.correction]
            assert check.command == ("\n".join(commands[0]) if commands else "")
    assert len(deck.tried) == len({frozenset(edit.items()) for edit in deck.tried})  # none twice
    printed = repr(done)
    assert printed.count("correct only together with") == sum(row[2] for row in findings)
    assert printed.count("this follows from 1") == sum(row[3] == 0 for row in findings)


def test_time_is_over(scene: hc.Scene, right: FoundDeck) -> None:
    """What is proven by then is in the fixed deck, with a remark that not all was tried."""
    deck = Deck(scene, right, [failed("mass", 2, MASS), failed("law", 3, LAW)], mass_and_law)

    def slowly(edits: Edits, limit: float) -> hc.DeckExamination:
        prover._begun -= 40.0
        return deck(edits, limit)

    prover = correct.Prover(deck({}), slowly, 2.0)
    assert prover.left == pytest.approx(32.0, abs=1.0)  # sixteen readings of the deck
    assert replace(prover, seconds=0.5).left == pytest.approx(8.0, abs=1.0)  # or 8 s
    done = correct.with_findings(prover)
    assert shown(done) == [
        ("mass", ["2: right mass"], False, None), ("law", [], False, None)
    ]  # fmt: skip
    assert done.edits == {("in.made", 2): ("right mass",)}
    assert done.remarks[-1].startswith("not all corrections were tried")
