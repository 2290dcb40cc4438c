"""Each tolerance of the examination: a third of what is allowed passes, three times it fails."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.engines.lammps.reading.deck import FoundDeck
from tests.examiner.corpus import scene_of
from tests.examiner.made import (
    STEP,
    Change,
    both,
    by_name,
    changed,
    deck_of,
    examined,
    in_texts,
    plus,
    stiffer,
    times,
)
from tests.examiner.test_corrections import in_wall

TOLERANCE = 1e-3


OF_EFFECT: dict[str, tuple[str, Callable[[float], Change], float]] = {
    "mass": ("steel", lambda size: times("mass", 1 + size), 1e-4),
    "radius": ("steel", lambda size: times("radius", 1 + size, 5), 1e-7),
    "stiffness": ("steel", lambda size: stiffer(1 + size), 1e-4),
    "peak of the applied": ("steel", lambda size: times("applied_force", 1 + size), 1e-4),
    "distance of": ("steel", lambda size: plus("position", slice(5, None), size), 1e-9),
    "place of the wall": ("wall", lambda size: in_wall(position=lambda at: at + size), 1e-9),
    "velocity of granule 1": ("wall", lambda size: times("velocity", 1 + size, (0, 0)), 1e-5),
    "displacement of the piston": (
        "piston", lambda size: times("driven_displacement", 1 + size), 1e-5
    ),
    "constant force on": ("column", lambda size: times("constant_force", 1 + size), 1e-4),
    "damping": ("viscoelastic", lambda size: times("damped_force", 1 + size), 1e-5),
}  # fmt: skip
"""By the start of a check's name: a scene, a difference of some size, and a size that is small."""


@pytest.mark.parametrize("name", OF_EFFECT)
def test_both_sides_of_an_effect(name: str, right: FoundDeck) -> None:
    """Effects of small differences are proportional to them."""
    of_scene, change, small = OF_EFFECT[name]
    scene = scene_of(of_scene)
    deck = right if of_scene == "steel" else deck_of(of_scene, scene)
    effect = by_name(examined(scene, change(small)(deck)), name).effect
    both_sides(name, change, small * TOLERANCE / effect, scene, deck)


def both_sides(
    name: str, change: Callable[[float], Change], most: float, scene: hc.Scene, right: FoundDeck
) -> hc.DeckCheck:
    """A difference of which a third passes, and three times of it is to correct, with a line."""
    little, much = (examined(scene, change(share * most)(right)) for share in (1 / 3, 3.0))
    assert [check.sentence for check in little.checks[:-1] if not check.passed] == []
    check = by_name(much, name)
    assert not check.passed
    assert check.place.file == "in.made"
    return check


def most_that_passes(scene: hc.Scene) -> dict[str, tuple[Callable[[float], Change], float]]:
    """By the start of a check's name: a difference of some size, and the size that is allowed.

    A contact that tilts by s / 2R loses s^2 / 4R of its overlap, its force half as much again.
    """
    peaks = np.asarray(hc.Native("reference").run(scene).peak_force)
    deep = (peaks / scene.chain.contact_stiffness) ** (2 / 3)
    radius, units = float(scene.chain.radius), scene.units
    tilt = TOLERANCE * float(np.max(deep)) * 4 * radius / 1.5
    none, quiet = 1e-9, 1e-7 * float(np.max(peaks))  # the latter of the largest force of a contact
    return {
        "distance from": (lambda s: plus("sideways", (3, 1), math.sqrt(s)), tilt),
        "velocity of granule 4": (lambda s: plus("velocity", (3, 0), s), none * units.velocity),
        "velocity across": (lambda s: plus("velocity", (3, 1), s), none * units.velocity),
        "spin": (lambda s: plus("spin", (3, 1), s), none * units.velocity / radius),
        "constant force on": (lambda s: plus("constant_force", (3, 0), s), none * units.force),
        "constant force across": (lambda s: plus("constant_force", (3, 1), s), none * units.force),
        "drag": (
            lambda s: both(plus("drag", 3, s), in_texts("group first id 1", "fix v all viscous 1")),
            none * units.force / units.velocity,
        ),
        "friction": (lambda s: plus("tangential_force", 3, s), quiet),
        "damping": (lambda s: times("damped_force", 1 + s, (2, 3)), 1e-7),
        "neighbours": (lambda s: plus("missed_overlap", 3, s), 0.1 * float(deep[3])),
    }


NAMES = tuple(most_that_passes(scene_of("steel")))


@pytest.mark.parametrize("name", NAMES)
def test_both_sides_of_what_is_allowed(name: str, scene: hc.Scene, right: FoundDeck) -> None:
    assert both_sides(name, *most_that_passes(scene)[name], scene, right).corrections


def test_both_sides_of_a_force_across_the_box(scene: hc.Scene, right: FoundDeck) -> None:
    def change(force: float) -> Change:
        return lambda deck: changed(deck, image_gap=1e-4, image_force=force)

    both_sides("contacts across", change, 1e-7 * scene.units.force, scene, right)


def ended_early(deck: FoundDeck) -> FoundDeck:
    """A deck that ends before the last contacts peak: they are not judged."""
    steps = 1200
    runs = (replace(deck.runs[0], steps=steps),)
    return changed(deck, runs=runs, end_time=steps * STEP)


def test_both_sides_of_the_digits_of_a_number(scene: hc.Scene, right: FoundDeck) -> None:
    """A hundredth of a number where no judged peak shows it: the mass of the last granule."""
    for share, passed in ((1 / 3, True), (3.0, False)):
        mass = np.array(right.mass)
        mass[-1] *= 1 + share * 10 * TOLERANCE
        check = by_name(examined(scene, changed(ended_early(right), mass=mass)), "mass")
        assert check.effect == pytest.approx(0.0, abs=1e-9)
        assert check.passed == passed


def test_both_sides_of_a_time_step(scene: hc.Scene, right: FoundDeck) -> None:
    """Errors of velocity Verlet go as the square of its step; the step that is named is right."""

    def with_step(dt: float) -> hc.DeckCheck:
        steps = math.ceil(right.end_time / dt)
        runs = (replace(right.runs[0], dt=dt, steps=steps),)
        deck = changed(right, runs=runs, end_time=dt * steps)
        return by_name(examined(scene, deck), "time step")

    effect = with_step(3 * STEP).effect
    allowed = 3 * STEP * math.sqrt(TOLERANCE / effect)
    assert with_step(allowed * math.sqrt(1 / 3)).passed
    wrong = with_step(allowed * math.sqrt(3.0))
    assert not wrong.passed
    assert wrong.expected is not None
    named = with_step(wrong.expected)
    assert named.passed
    # 0.8 of the tolerance is aimed at; a step has two digits.
    assert named.effect > 0.5 * TOLERANCE
    unstable = with_step(100 * STEP)
    assert unstable.effect == math.inf
    assert "longest stable" in unstable.sentence
    # No error tells how much shorter it should be: that of a chain of equal granules does.
    aimed_at = 0.8 * math.sqrt(TOLERANCE / 0.5) * scene.units.time
    assert 0.9 * aimed_at < unstable.expected <= aimed_at


def test_a_wrong_radius_is_no_wrong_stiffness(scene: hc.Scene, right: FoundDeck) -> None:
    """With the modulus of the scene, stiffnesses go as the root of the effective radius."""
    for factor in (1.02, 0.97):
        force = right.contact_force * math.sqrt(factor)
        deck = changed(
            right, radius=right.radius * factor, contact_force=force,
                damped_force=right.damped_force * math.sqrt(factor),
            mass=right.mass * factor**3,
        )  # fmt: skip
        names = [check.name for check in examined(scene, deck).to_correct]
        assert any(name.startswith("radius") for name in names)
        assert not any(name.startswith("stiffness") for name in names)


def test_both_sides_of_numbers_that_explain_the_peaks(scene: hc.Scene, right: FoundDeck) -> None:
    """By half of the error of the peaks: the rest is of how effects add up."""
    lighter = times("mass", 0.8)(right)
    (mass,) = examined(scene, lighter).to_correct
    for share, names in ((0.52, [mass.name]), (0.48, ["motion", mass.name])):
        peaks = right.peak_force * (1 + mass.effect / share)
        to_correct = examined(scene, changed(lighter, peak_force=peaks)).to_correct
        assert [check.name.split(",")[0] for check in to_correct] == names


def test_both_sides_of_the_motion_at_the_end(scene: hc.Scene, right: FoundDeck) -> None:
    """A fiftieth of the largest velocity, if by as much for all granules."""
    allowed = 0.02 * float(np.max(np.abs(right.final_velocity)))
    for share, names in ((1 / 3, []), (3.0, ["motion, by velocities at the end"])):
        done = examined(scene, plus("final_velocity", ..., share * allowed)(right))
        assert [check.name for check in done.to_correct] == names


def test_numbers_that_are_off_by_the_same_are_one_finding(
    scene: hc.Scene, right: FoundDeck
) -> None:
    """By a hundredth of it; the rest of many different ones is one finding, too."""
    two = both(times("mass", 1.2, 3), times("mass", 1.2006, 4), times("mass", 1.206, 9))
    names = [check.name for check in examined(scene, two(right)).checks if check.name[:4] == "mass"]
    assert sorted(names) == ["mass of granule 10", "mass of granules 4 to 5"]
    many = both(*(times("mass", 1 + 0.1 * k, k) for k in range(1, 6)))
    names = [c.name for c in examined(scene, many(right)).checks if c.name[:4] == "mass"]
    assert sorted(names) == ["mass of granule 5", "mass of granule 6", "mass of granules 2 to 4"]
