"""Checks of a deck by their thresholds, on either side, without LAMMPS."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.engines.lammps.reading.deck import FoundDeck, FoundWall
from tests.examiner.corpus import scene_of
from tests.examiner.made import (
    STEP,
    by_name,
    changed,
    deck_of,
    examined,
    first_guess,
    in_texts,
    plus,
    stiffer,
    times,
)


@pytest.mark.parametrize(
    ("factor", "words"),
    [(1.02, "(1.02 times)"), (1 - 2e-5, "(2.0e-05 less)"), (1 + 2e-5, "(2.0e-05 more)")],
)
def test_a_small_difference_is_not_one_times(
    factor: float, words: str, scene: hc.Scene, right: FoundDeck
) -> None:
    assert words in by_name(examined(scene, stiffer(factor)(right)), "stiffness").sentence


def test_peaks_decide_on_both_sides(scene: hc.Scene, right: FoundDeck) -> None:
    assert examined(scene, times("peak_force", 1 + 8e-4)(right)).verdict == "pass"
    done = examined(scene, times("peak_force", 1 + 2e-3)(right))
    assert done.verdict == "fail"
    assert not by_name(done, "motion").passed  # all numbers are right: something else acts
    assert not done.checks[-1].passed


def test_the_end_of_a_run_that_is_ended_is_not_read(scene: hc.Scene, right: FoundDeck) -> None:
    halt = replace(right.fixes[0], style="halt")
    done = examined(scene, plus("final_velocity", ..., -0.05)(right))
    assert not done.passed
    ended = changed(right, fixes=(*right.fixes, halt))
    assert examined(scene, plus("final_velocity", ..., -0.05)(ended)).passed


def test_a_deck_that_ends_early(scene: hc.Scene, right: FoundDeck) -> None:
    runs = (replace(right.runs[0], steps=1000),)
    commands = (*right.commands[:-1], replace(right.commands[-1], written="run 1000"))
    early = changed(right, runs=runs, commands=commands, end_time=1000 * STEP)
    done = examined(scene, early)
    check = by_name(done, "end of the run")
    assert not check.passed
    assert first_guess(check) == ("run 2500",)
    assert not done.judged[-1]  # not seen yet
    assert done.judged[0]


def test_a_deck_that_ends_before_a_reflected_wave_is_back() -> None:
    scene = scene_of("wall")
    deck = deck_of("wall", scene, "run 3000", "run 1000")
    done = examined(scene, changed(deck, peak_force=hc.Native("reference").run(scene).peak_force))
    # Contacts 3 and 4 are pressed hardest at 0.31 and 0.29 ms, the deck ends at 0.2 ms.
    assert np.flatnonzero(~done.judged).tolist() == [1, 2]
    check = by_name(done, "end of the run")
    assert "2 contacts have not passed the peak by then" in check.sentence
    assert first_guess(check) == ("run 3000",)


def with_wall(deck: FoundDeck, room: float, sideways: float = 0.0) -> FoundDeck:
    """A deck with a wall at the far end, some way from the last granule."""
    depth = np.array([1e-6, 5e-6])
    force, beyond = 2e10 * depth**1.5, float(deck.position[-1]) + 4.75e-3 + room
    wall = FoundWall("last", beyond, depth, force, depth, depth, force, sideways, 4)
    return changed(deck, walls=(wall,))


def test_a_wall_that_is_never_reached(scene: hc.Scene, right: FoundDeck) -> None:
    for room, passed in ((1e-2, True), (1e-5, False)):
        done = examined(scene, with_wall(right, room))
        assert any(check.name == "wall at the far end" for check in done.to_correct) != passed


@pytest.mark.parametrize(
    ("granule", "column", "at_rest", "in_motion", "led", "told"),
    [
        # On either side of what counts as a force, and of readings at other times.
        (5, 0, 0.0, 9e-5, False, False), (5, 1, 0.0, 1.2e-4, False, True),
        (5, 0, 50.0, 54.0, False, False), (5, 1, 50.0, 56.0, False, True),
        # A force along the chain on a granule that is led changes nothing.
        (0, 0, 0.0, 1.0, True, False), (0, 1, 0.0, 1.0, True, True), (5, 0, 0.0, 1.0, True, True),
    ],
)  # fmt: skip
def test_a_fix_that_pushes_in_motion_alone(
    granule: int, column: int, at_rest: float, in_motion: float, led: bool, told: bool,
    scene: hc.Scene, right: FoundDeck,
) -> None:  # fmt: skip
    largest, moving = np.array(right.fixes[1].largest), np.array(right.fixes[1].largest_in_motion)
    largest[granule, column], moving[granule, column] = at_rest, in_motion
    fix = replace(right.fixes[1], largest=largest, largest_in_motion=moving)
    deck = changed(right, fixes=(right.fixes[0], fix))
    if led:
        deck = changed(deck, driven=np.arange(scene.chain.granules) == 0)
    checks = [c for c in examined(scene, deck).to_correct if c.name.startswith("force of fix")]
    way = ("along", "across")[column]
    assert [check.name for check in checks] == [f"force of fix addforce {way} the chain"] * told
    if told:
        before = f"{at_rest:g} N" if at_rest else "none"
        assert f"granule {granule + 1} in motion, and {before} at rest" in checks[0].sentence
        assert str(checks[0].place) == "in.made:11"


def test_a_chain_that_stays_at_rest_has_one_thing_to_correct(
    scene: hc.Scene, right: FoundDeck
) -> None:
    """Its force is missing; that rounded places move it by 1e-20 m is nothing to correct."""
    deck = changed(
        right, applied_force=0 * right.applied_force, fixes=right.fixes[:1],
        peak_force=0 * right.peak_force, final_velocity=0 * right.final_velocity,
    )  # fmt: skip
    done = examined(scene, deck)
    assert [check.name for check in done.to_correct] == ["applied force on granule 1"]


def test_a_wall_that_moves_away(scene: hc.Scene, right: FoundDeck) -> None:
    for missed, told in ((1e-8, False), (1e-6, True)):
        overlaps = np.append(right.missed_overlap, missed)
        done = examined(scene, changed(with_wall(right, 1e-2), missed_overlap=overlaps))
        assert [check.name for check in done.to_correct] == (["wall in motion"] if told else [])


def test_a_law_of_no_power_is_no_damping(scene: hc.Scene, right: FoundDeck) -> None:
    """Another force besides Hertz's, which counts where that is small."""
    least = 0.02 * right.contact_force[1]
    more = plus("damped_force", 6, least)(plus("contact_force", 1, least)(right))
    names = [check.name for check in examined(scene, more).to_correct]
    assert len(names) == 1
    assert re.fullmatch("force of contact .* at other overlaps", names[0])


@pytest.mark.parametrize("more", [0.0, 1e9])
def test_damping_of_a_contact_without_an_elastic_force_comes_first(
    more: float, scene: hc.Scene, right: FoundDeck
) -> None:
    """It has no size next to which it could be small, whatever the damping of another contact."""
    elastic, damped = right.contact_force.copy(), right.damped_force.copy()
    elastic[:, 1], damped[:, 1] = 0.0, 1e-3 * right.closing[:, 1]
    damped[2, 5] += more * damped[2, 5]
    done = examined(scene, changed(right, contact_force=elastic, damped_force=damped))
    check = by_name(done, "damping of contact")
    assert check.name == "damping of contact 3"
    assert "the elastic force is 0 N" in check.sentence
    assert check in done.to_correct


def test_a_crest_between_readings_is_no_smaller_peak(scene: hc.Scene, right: FoundDeck) -> None:
    """The scene itself is as high at these readings; a peak that is off has digits that tell."""
    thin = changed(right, applied_time=right.applied_time[::7],
                   applied_force=right.applied_force[::7])  # fmt: skip
    check = by_name(examined(scene, thin), "applied force")
    assert check.passed
    assert check.measured == np.max(thin.applied_force) > 99.0
    check = by_name(examined(scene, times("applied_force", 1 + 1e-5)(thin)), "peak of the applied")
    assert check.sentence.startswith("peak of the applied force is 100.00")
    assert check.measured == pytest.approx(100.001, rel=1e-6)


def test_granules_that_settle_elsewhere_than_the_scene_has_them(
    scene: hc.Scene, right: FoundDeck
) -> None:
    """Their places stand in no text: the last run before the shock is to blame."""
    settles = replace(right.commands[-1], text="run 100", written="run 100")
    last = replace(right.commands[-1], line=14)
    deck = changed(plus("position", slice(5, None), 1e-6)(right), before=2e-5,
                   commands=(*right.commands[:-1], settles, last), first_run=13)  # fmt: skip
    deck = changed(deck, runs=(replace(deck.runs[0], command=13),))
    check = by_name(examined(scene, deck), "distance of")
    assert " when the shock begins is " in check.sentence
    assert str(check.place) == "in.made:13"
    assert ("run 100",) not in check.corrections[0].values()


def test_the_document(scene: hc.Scene, right: FoundDeck) -> None:
    done = examined(scene, in_texts("7958", "3979")(times("mass", 0.5)(right)))
    numbers = done.to_dict()
    assert (numbers["verdict"], numbers["peak_reading_error"]) == ("fail", 0)
    assert numbers["peak_force_N"] == right.peak_force.tolist()
    first = next(check for check in numbers["checks"] if check["name"].startswith("mass"))
    # The variable that the density is; nothing is proven.
    assert (first["line"], first["command"]) == (2, None)
    assert first_guess(done.to_correct[0]) == ("variable rho equal 7958",)
    assert list(done.to_frame()["name"]) == [check.name for check in done.checks]
