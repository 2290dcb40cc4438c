"""What an examination says as a whole: the fixed text, decks that are not chains, or that stop."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.reading.deck import FoundDeck
from hertzchain.engines.lammps.reading.text import Edits
from hertzchain.errors import RunFailed, SceneError
from tests.examiner.corpus import scene_of
from tests.examiner.made import (
    by_name,
    changed,
    deck_of,
    examined,
    first_guess,
    found,
    times,
)

DECK = "units si # of all\ninclude a.inc\ninclude b.inc\nset group all &\n density 1\nrun 5"
TEXTS = {"in.made": DECK, "a.inc": "pair_style none\ninclude b.inc\n", "b.inc": "fix 1 all nve\n"}


@pytest.mark.parametrize(
    ("edits", "fixed"),
    [
        ({}, f"{DECK}\n"),
        ({("in.made", 4): ("set group all density 2", "set group all diameter 3")},
         ("units si # of all\ninclude a.inc\ninclude b.inc\nset group all density 2\n"
         "set group all diameter 3\nrun 5\n")),
        ({("a.inc", 1): ("pair_style granular",), ("in.made", 6): ()},
         ("units si # of all\npair_style granular\ninclude b.inc\ninclude b.inc\n"
         "set group all &\n density 1\n")),
        ({("b.inc", 1): ("# fix 1 all nve",)},
         "units si # of all\ninclude a.inc\n# fix 1 all nve\nset group all &\n density 1\nrun 5\n"),
    ],
)  # fmt: skip
def test_the_fixed_deck(edits: Edits, fixed: str, scene: hc.Scene, right: FoundDeck) -> None:
    """Included files that change stand in it; all else is as it was."""
    done = replace(examined(scene, right), texts=tuple(TEXTS.items()), edits=edits)
    assert done.fix == fixed
    assert replace(done, texts=()).fix == ""


@pytest.mark.parametrize(
    ("sideways", "kind"),
    [
        (np.arange(20) % 4, "lie in 4 rows of 5, not in one"),
        (np.arange(20) % 19, "do not lie in one row along x, y or z"),
        (np.arange(20) // 16, "do not lie in one row along x, y or z"),
    ],
)
def test_rows(sideways: FloatArray, kind: str, scene: hc.Scene, right: FoundDeck) -> None:
    """Rows of as many granules each; nothing else is compared."""
    across = np.outer(sideways * 9.5e-3, [0.0, 1.0])
    done = examined(scene, changed(right, is_chain=False, sideways=across))
    (check,) = done.to_correct
    assert check.sentence == f"the deck is not a chain: its 20 granules {kind}"
    assert done.findings[0].checks == (check,)
    assert done.to_dict()["findings"][0]["correction"] is None
    assert done.small == ()
    assert not done.judged.any()
    assert done.judged.size == 19
    assert done.verdict == "fail"
    assert not done.checks[-1].passed


@pytest.mark.parametrize(
    ("name", "more"),
    [("steel", -1), ("wall", 1), ("precompressed", -1), ("precompressed", 1), ("column", -1)],
)
def test_another_number_of_granules(name: str, more: int) -> None:
    """The granules and contacts that both have are right, but for the load on the last one."""
    scene = scene_of(name)
    count = scene.chain.granules + more
    other = replace(scene, chain=replace(scene.chain, granules=count))
    deck = found(other) if name == "steel" else deck_of(name, other)
    decks = [deck] if name == "column" else [deck, changed(deck, units="lj")]
    for contents in decks:
        first, *rest = examined(scene, contents).to_correct
        assert (first.name, first.measured) == ("number of granules", count)
        assert first.expected == scene.chain.granules
        assert [check.kind for check in rest] == ["constant force"] * (name == "precompressed")


def test_a_deck_without_steps(scene: hc.Scene, right: FoundDeck) -> None:
    nothing = changed(right, runs=(), end_time=0.0, applied_time=np.zeros(0),
                      applied_force=np.zeros((0, 20)))  # fmt: skip
    with pytest.raises(RunFailed, match="it needs a run command"):
        examined(scene, nothing)


def test_a_deck_that_stops(scene: hc.Scene, right: FoundDeck) -> None:
    """Its numbers are judged, and nothing of its motion is."""
    wrong = changed(
        times("mass", 0.5)(right), stopped="granules left the box", end_time=1e-2,
        peak_force=np.full(19, np.nan),
    )  # fmt: skip
    done = examined(scene, wrong)
    assert [check.name for check in done.to_correct] == ["mass of all granules"]
    assert done.checks[-1].sentence == "the deck does not come to its end: granules left the box"
    assert not done.checks[-1].passed
    none = np.zeros((0, 20))
    refused = examined(
        scene, changed(wrong, applied_time=np.zeros(0), applied_force=none)
    )  # fmt: skip
    assert [check.name for check in refused.to_correct] == ["mass of all granules"]
    assert not any("applied" in check.name for check in refused.checks)


def test_contacts_that_were_not_tried(scene: hc.Scene, right: FoundDeck) -> None:
    """They have no law, and no other check says that they are right."""
    unknown = np.nan * right.contact_force
    done = examined(
        scene, changed(right, contact_force=unknown, damped_force=np.nan * right.closing)
    )
    check = by_name(done, "contacts")
    assert check.sentence == "LAMMPS stopped while the contacts were probed"
    assert done.to_correct == (check,)  # which explains any motion
    assert not any(check.name.startswith(("stiffness", "damping")) for check in done.checks)


def test_units_that_are_others(scene: hc.Scene, right: FoundDeck) -> None:
    """All lengths are those of cgs in metres, but for a tenth: the line of the units makes that."""
    for factor, is_unit in ((1e2, True), (1.09e2, True), (1.3e2, False)):
        large = times("radius", factor)(times("position", factor)(right))
        check = by_name(examined(scene, large), "radius")
        assert (str(check.place) == "in.made:1") == is_unit
        assert (first_guess(check) == ("units cgs",)) == is_unit


def test_damping_that_pulls(scene: hc.Scene, right: FoundDeck) -> None:
    """A try in which granules part faster than the contact pushes; else those of approach tell."""
    parts = right.closing < -0.5
    for factor, how in ((parts, "part"), (1 + parts, "approach")):
        damped = right.damped_force + 3.0 * right.closing * factor
        check = by_name(examined(scene, changed(right, damped_force=damped)), "damping")
        assert not check.passed
        assert f"granules {how} with" in check.sentence


def test_what_cannot_be_examined(scene: hc.Scene) -> None:
    for limit in (0.0, np.nan):
        with pytest.raises(SceneError, match=f"time_limit = {limit}: must be"):
            hc.examine(scene, "in.none", time_limit=limit)
    with pytest.raises(SceneError, match=r"tolerance = 1\.0: must be a number above 0"):
        hc.examine(scene, "in.none", tolerance=1.0)
    with pytest.raises(SceneError, match="near_wall: cannot be in the scene of a deck"):
        hc.examine(replace(scene, near_wall=hc.Wall("rigid")), "in.none")
