"""Each tolerance of the examination: a third of what is allowed passes, three times it fails."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.engines.lammps.reading import FoundDeck
from tests.verdict.deck.corpus import scene_of
from tests.verdict.deck.made import STEP, by_name, changed, examined, found

TOLERANCE = 1e-3


@pytest.fixture(scope="module")
def scene() -> hc.Scene:
    return scene_of("steel")


@pytest.fixture(scope="module")
def right(scene: hc.Scene) -> FoundDeck:
    return found(scene)


def off(deck: FoundDeck, what: str, size: float) -> FoundDeck:
    """A deck in which a number is off by so much: relative, or in m."""
    if what == "mass":
        return changed(deck, mass=deck.mass * (1 + size))
    if what == "stiffness":
        force, damped = deck.contact_force * (1 + size), deck.damped_force * (1 + size)
        return changed(deck, contact_force=force, damped_force=damped)
    if what == "peak of the applied":
        return changed(deck, applied_force=deck.applied_force * (1 + size))
    place = np.array(deck.position)
    place[5:] += size
    return changed(deck, position=place)


@pytest.mark.parametrize(
    ("what", "small"),
    [("mass", 1e-4), ("stiffness", 1e-4), ("peak of the applied", 1e-4), ("distance of", 1e-9)],
)
def test_both_sides_of_an_effect(
    what: str, small: float, scene: hc.Scene, right: FoundDeck
) -> None:
    """Effects of small differences are proportional to them."""
    effect = by_name(examined(scene, off(right, what, small)), what).effect
    assert effect is not None
    allowed = small * TOLERANCE / effect
    for share, passed in ((1 / 3, True), (3.0, False)):
        check = by_name(examined(scene, off(right, what, share * allowed)), what)
        assert check.passed == passed


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


def test_both_sides_of_a_tilt(scene: hc.Scene, right: FoundDeck) -> None:
    """A contact that tilts by s / 2R loses s^2 / 4R of its overlap, its force half as much again.

    The overlap is that of the largest peak, by Hertz's law.
    """
    radius = float(scene.chain.radius)
    result = hc.Native("reference").run(scene)
    deep = (float(np.max(result.peak_force)) / scene.chain.contact_stiffness) ** (2 / 3)
    allowed = math.sqrt(TOLERANCE * deep * 4 * radius / 1.5)
    for share, passed in ((1 / 3, True), (3.0, False)):
        aside = np.array(right.sideways)
        aside[3, 1] = math.sqrt(share) * allowed
        check = by_name(examined(scene, changed(right, sideways=aside)), "distance from")
        assert check.passed == passed


def test_both_sides_of_a_time_step(scene: hc.Scene, right: FoundDeck) -> None:
    """Errors of velocity Verlet go as the square of its step; the step that is named is right."""

    def with_step(dt: float) -> hc.DeckCheck:
        steps = math.ceil(right.end_time / dt)
        runs = (replace(right.runs[0], dt=dt, steps=steps),)
        deck = changed(right, runs=runs, end_time=dt * steps)
        return by_name(examined(scene, deck), "time step")

    effect = with_step(3 * STEP).effect
    assert effect is not None
    allowed = 3 * STEP * math.sqrt(TOLERANCE / effect)
    assert with_step(allowed * math.sqrt(1 / 3)).passed
    wrong = with_step(allowed * math.sqrt(3.0))
    assert not wrong.passed
    assert wrong.expected is not None
    named = with_step(wrong.expected)
    assert named.passed
    assert named.effect is not None
    # 0.8 of the tolerance is aimed at; a step has two digits.
    assert named.effect > 0.5 * TOLERANCE


def test_a_wrong_radius_is_no_wrong_stiffness(scene: hc.Scene, right: FoundDeck) -> None:
    """With the modulus of the scene, stiffnesses go as the root of the effective radius."""
    for factor in (1.02, 0.97):
        force = right.contact_force * math.sqrt(factor)
        deck = changed(
            right, radius=right.radius * factor, contact_force=force, damped_force=force,
            mass=right.mass * factor**3,
        )  # fmt: skip
        names = [check.name for check in examined(scene, deck).to_mend]
        assert any(name.startswith("radius") for name in names)
        assert not any(name.startswith("stiffness") for name in names)


def test_both_sides_of_friction_and_damping(scene: hc.Scene, right: FoundDeck) -> None:
    """1e-7 of the force of a contact at its largest overlap is round-off."""
    result = hc.Native("reference").run(scene)
    largest = float(np.max(result.peak_force))
    for share, passed in ((1 / 3, True), (3.0, False)):
        aside = np.array(right.tangential_force)
        aside[3] = share * 1e-7 * largest
        check = by_name(examined(scene, changed(right, tangential_force=aside)), "friction")
        assert check.passed == passed
        damped = np.array(right.damped_force)
        damped[2, 3] *= 1 + share * 1e-7
        check = by_name(examined(scene, changed(right, damped_force=damped)), "damping")
        assert check.passed == passed


def test_both_sides_of_neighbours(scene: hc.Scene, right: FoundDeck) -> None:
    """A tenth of the overlap that is expected may be missed."""
    result = hc.Native("reference").run(scene)
    deep = (float(result.peak_force[3]) / scene.chain.contact_stiffness) ** (2 / 3)
    for share, passed in ((1 / 3, True), (3.0, False)):
        missed = np.array(right.missed_overlap)
        missed[3] = share * 0.1 * deep
        check = by_name(examined(scene, changed(right, missed_overlap=missed)), "neighbours")
        assert check.passed == passed


def test_both_sides_of_the_peaks(scene: hc.Scene, right: FoundDeck) -> None:
    truth = hc.Native("reference").run(scene).peak_force
    for share, passed in ((1 / 3, True), (3.0, False)):
        peaks = np.array(truth) * (1 + share * TOLERANCE)
        assert examined(scene, changed(right, peak_force=peaks)).checks[-1].passed == passed


def test_an_effect_counts_judged_contacts_alone(scene: hc.Scene, right: FoundDeck) -> None:
    """The deck ends before the last contacts peak: what changes only them changes no peak."""
    short = ended_early(right)
    place = np.array(short.position)
    place[-1] += 1e-6
    done = examined(scene, changed(short, position=place))
    assert not done.judged[-1]
    check = by_name(done, "distance of")
    assert check.effect == pytest.approx(0.0, abs=1e-9)
