"""Each wrong number of a deck: what is measured, its line, and the corrections that are tried."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.engines.lammps.reading.deck import FoundDeck, FoundWall, Units
from hertzchain.engines.lammps.reading.probing import DAMPED, DEPTHS
from hertzchain.examiner.examined import Case
from hertzchain.examiner.examining import case_of
from hertzchain.examiner.probes import probes_of
from hertzchain.limits import Deadline
from tests.examiner.corpus import scene_of
from tests.examiner.made import (
    DECKS,
    Change,
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


UNITS = Units("odd", length=2.0, mass=3.0, time=5.0)

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
    pairs = [pairs_of(case, number) for case in (si, replace(si, units=UNITS))]
    assert [len(numbers) for numbers in pairs] == [len(units)] * 2
    for in_si, in_units, names in zip(*pairs, units, strict=True):
        for value, there, unit in zip(in_si, in_units, names, strict=True):
            assert value == pytest.approx(there * getattr(UNITS, unit) if unit else 0.0)
