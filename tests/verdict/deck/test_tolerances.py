"""Each tolerance of the examination: a third of what is allowed passes, three times it fails."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.engines.lammps.reading.found import FoundDeck
from hertzchain.verdict.deck import proving
from tests.verdict.deck.made import (
    STEP,
    Change,
    both,
    by_name,
    changed,
    examined,
    in_texts,
    plus,
    stiffer,
    times,
)

TOLERANCE = 1e-3


OF_EFFECT: dict[str, tuple[Callable[[float], Change], float]] = {
    "mass": (lambda size: times("mass", 1 + size), 1e-4),
    "stiffness": (lambda size: stiffer(1 + size), 1e-4),
    "peak of the applied": (lambda size: times("applied_force", 1 + size), 1e-4),
    "distance of": (lambda size: plus("position", slice(5, None), size), 1e-9),
}
"""By the start of a check's name: a difference of some size, and a size that is small."""


@pytest.mark.parametrize("name", OF_EFFECT)
def test_both_sides_of_an_effect(name: str, scene: hc.Scene, right: FoundDeck) -> None:
    """Effects of small differences are proportional to them."""
    made, small = OF_EFFECT[name]
    effect = by_name(examined(scene, made(small)(right)), name).effect
    both_sides(name, made, small * TOLERANCE / effect, scene, right)


def both_sides(
    name: str, made: Callable[[float], Change], most: float, scene: hc.Scene, right: FoundDeck
) -> None:
    """Assert that a third of a difference passes, and three times of it is to mend, with a line."""
    little, much = (examined(scene, made(share * most)(right)) for share in (1 / 3, 3.0))
    assert [check.sentence for check in little.checks[:-1] if not check.passed] == []
    check = by_name(much, name)
    assert not check.passed
    assert check.place.file == "in.made"
    assert check.corrections


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


def test_both_sides_of_what_is_allowed(scene: hc.Scene, right: FoundDeck) -> None:
    for name, (made, most) in most_that_passes(scene).items():
        both_sides(name, made, most, scene, right)


def test_a_granule_is_moved_once(scene: hc.Scene, right: FoundDeck) -> None:
    check = by_name(examined(scene, plus("integrated", 3, 1)(right)), "integrators")
    assert not check.passed
    assert check.corrections


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


def test_a_wrong_radius_is_no_wrong_stiffness(scene: hc.Scene, right: FoundDeck) -> None:
    """With the modulus of the scene, stiffnesses go as the root of the effective radius."""
    for factor in (1.02, 0.97):
        force = right.contact_force * math.sqrt(factor)
        deck = changed(
            right, radius=right.radius * factor, contact_force=force,
                damped_force=right.damped_force * math.sqrt(factor),
            mass=right.mass * factor**3,
        )  # fmt: skip
        names = [check.name for check in examined(scene, deck).to_mend]
        assert any(name.startswith("radius") for name in names)
        assert not any(name.startswith("stiffness") for name in names)


def test_both_sides_of_what_a_correction_may_add_to_an_error(
    scene: hc.Scene, right: FoundDeck
) -> None:
    truth, was = hc.Native("reference").run(scene).peak_force, 5e-3

    def off(error: float) -> hc.DeckExamination:
        return examined(scene, changed(right, peak_force=truth * (1 + error)))

    allowed = 1e-2 * was + 1e-5
    for share, no_worse in ((1 / 3, True), (3.0, False)):
        assert proving.is_no_worse(off(was), off(was + share * allowed)) is no_worse


def test_an_effect_counts_judged_contacts_alone(scene: hc.Scene, right: FoundDeck) -> None:
    """The deck ends before the last contacts peak: what changes only them changes no peak."""
    short = ended_early(right)
    place = np.array(short.position)
    place[-1] += 1e-6
    done = examined(scene, changed(short, position=place))
    assert not done.judged[-1]
    check = by_name(done, "distance of")
    assert check.effect == pytest.approx(0.0, abs=1e-9)


def test_a_deck_in_which_no_peak_is_judged(scene: hc.Scene, right: FoundDeck) -> None:
    """A single step tells nothing of its error, and is no reason to mend it."""
    runs = (replace(right.runs[0], steps=1),)
    done = examined(scene, changed(right, runs=runs, end_time=STEP))
    assert not np.any(done.judged)
    assert by_name(done, "time step").passed
    assert not done.passed
