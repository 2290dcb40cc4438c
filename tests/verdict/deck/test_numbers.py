"""Numbers of a deck one by one: what a case is, what it expects and what room it has."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.engines.lammps.reading.found import FoundDeck
from hertzchain.limits import Deadline
from hertzchain.verdict.deck import deck_check
from hertzchain.verdict.deck.contact_numbers import _wall
from hertzchain.verdict.deck.deck_check import ACTS, Case
from hertzchain.verdict.deck.examining import case_of, numbers_of
from hertzchain.verdict.deck.force_numbers import _constant_across
from hertzchain.verdict.deck.number import Difference, differences
from hertzchain.verdict.deck.pulse import of_shock, pulse
from hertzchain.verdict.deck.right_commands import wall_plane
from hertzchain.verdict.deck.run_numbers import _found_twin
from tests.verdict.deck.corpus import scene_of
from tests.verdict.deck.made import (
    both,
    changed,
    deck_of,
    found,
    in_texts,
    plus,
    times,
)
from tests.verdict.deck.test_corrections import OF_NUMBERS, held_for_fifty_steps


def given(scene: hc.Scene, deck: FoundDeck) -> Case:
    """What checks of a deck share."""
    return case_of(scene, deck, 1e-3, Deadline(60.0), {})[0]


def test_digits_of_a_pulse_are_those_of_its_impulse() -> None:
    scene = scene_of("precompressed")
    (one,) = pulse(given(scene, times("applied_force", 1.02)(deck_of("precompressed", scene))))
    assert one.relative == pytest.approx(0.02, rel=1e-6)
    (held,) = pulse(given(scene, held_for_fifty_steps(deck_of("precompressed", scene))))
    assert held.relative == 0


def test_a_force_at_a_jump_is_that_of_either_side() -> None:
    """The pulse ends at the reading 200, up to less than a millionth of a step."""
    table = hc.PulseTable((0.0, 2e-5, 4e-5), (100.0, 80.0, 100.0))
    scene = replace(scene_of("steel"), shock=table)
    deck = found(scene)
    for late in (-1e-14, 1e-14):
        for more in (0.0, -100.0):
            change = both(plus("applied_time", 200, late), plus("applied_force", (200, 0), more))
            (one,) = pulse(given(scene, change(deck)))
            assert one.measured == one.expected == 100.0


def test_a_force_that_is_a_shock() -> None:
    """On either side of a billionth of the unit of force."""
    scene = scene_of("steel")
    deck = found(scene)
    for share, command in ((1 / 3, 10), (3.0, 9)):
        force = np.full((20, 2), share * ACTS * scene.units.force)
        weak = replace(deck.fixes[-1], command=9, largest=force)
        case = given(scene, changed(deck, fixes=(*deck.fixes, weak)))
        one = of_shock(case, Difference(1.0, 2.0, stands=[(1.0, 2.0)]))
        assert one.at == command


def test_gravity_across_moves_all_granules_as_one() -> None:
    scene = scene_of("dimer")
    for force, as_one in ((9.81 * scene.granules.mass, True), (np.ones(16), False)):
        case = given(scene, plus("constant_force", (..., 1), force)(deck_of("dimer", scene)))
        assert (_constant_across(case).effect == 0) == as_one


def test_a_deck_without_its_wall_moves_without_one() -> None:
    scene = scene_of("wall")
    deck = OF_NUMBERS["no wall at all"][1](deck_of("wall", scene))
    stiffness = _found_twin(given(scene, deck))[0].stiffness
    assert stiffness[-1] == 0 < stiffness[-2]


def test_a_wall_that_misses_the_chain_is_found_on_either_side_of_its_fix() -> None:
    scene = scene_of("wall")
    deck = OF_NUMBERS["a wall for granule 1"][1](deck_of("wall", scene))
    turned = in_texts("NULL 0.095", "0.095 NULL")(deck)
    places = [_wall(given(scene, one)).at for one in (deck, turned)]
    assert places[0] == places[1] is not None


def test_a_wall_stands_behind_the_last_of_unlike_granules() -> None:
    scene = scene_of("wall")
    chain = replace(scene.chain, radius=[*[4.75e-3] * 9, 2e-3])
    unlike = replace(scene, chain=chain)
    end = unlike.granules.position[-1] + 2e-3
    assert wall_plane(given(unlike, deck_of("wall", unlike))) == pytest.approx(end, rel=1e-12)


def test_rounding_of_a_force_grows_as_an_overlap_falls() -> None:
    """By the distance of the two centres, 9 mm."""
    scene = scene_of("dimer")
    rounding = given(scene, deck_of("dimer", scene)).rounding(2, np.array([1e-12, 1e-3]))
    assert rounding == pytest.approx([6 * np.finfo(np.float64).eps * 9e-3 / 1e-12, 1e-9])


@pytest.mark.parametrize(("more", "stands"), [(1, [(13, 12)]), (2, [(14, 12), (13, 11)])])
def test_a_count_may_stand_as_that_of_contacts(more: int, stands: list[tuple[int, int]]) -> None:
    """Unless that number is the right count of granules."""
    scene = scene_of("piston")
    other = replace(scene, chain=replace(scene.chain, granules=12 + more))
    case = given(scene, deck_of("piston", other))
    assert differences(case, numbers_of(case)[0])[0].stands == stands


def test_granules_in_words() -> None:
    words = {"granule 4": [3], "granules 4 to 6": [3, 4, 5], "granules 4, 8": [3, 7],
             "all granules": range(20), "no granule": [],
             "granules 1, 3, 5, 7 and 2 more": [0, 2, 4, 6, 8, 10]}  # fmt: skip
    for name, granules in words.items():
        assert deck_check.names(np.array(granules, np.intp), 20, "granule", 1) == name
