"""Decks of scenes with terms: their damping, their looks, their steps, and what is refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.decks.known_answer import deck_step, known_answer, lay_out, looked_at
from hertzchain.decks.standalone import standalone
from hertzchain.engines.native.damped_verlet import simulate_damped_verlet
from hertzchain.errors import TooExpensive, Unpredictable
from hertzchain.observables.peaks import largest_difference
from tests.conftest import STEEL
from tests.decks.test_scenes import ALL, CHAIN, RESTITUTION
from tests.decks.test_standalone_deck import peaks, run, verdict, written
from tests.engines.native.test_terms import PULSE
from tests.oracles.sampled_maxima import sampled_maxima

EVERY_TERM = ALL["all at once"]

RTOL = 1e-3
"""What the steps of these decks may cost the peaks: two to ten thousand steps."""


@pytest.mark.parametrize("name", ["restitution", "attraction"])
def test_contacts_pull_where_the_scene_says_so(name: str, tmp_path: Path) -> None:
    """Where they may not, every line with damping has the limit: peaks alone hardly show it."""
    lines = written(ALL[name], tmp_path, RTOL).read_text().splitlines()
    damped = [line for line in lines if "damping ${damping}" in line]
    assert damped
    is_limited = ALL[name].contact is RESTITUTION
    assert all(("limit_damping" in line) == is_limited for line in damped)


@pytest.mark.lammps
def test_the_damping_for_older_lammps_is_as_much(tmp_path: Path) -> None:
    path = written(ALL["restitution"], tmp_path, RTOL)
    text = path.read_text()
    assert text.count('"$(version) >= 20240829"') == 1
    path.write_text(text.replace('"$(version) >= 20240829"', '"1 == 0"'))
    status, screen = run(path, tmp_path)
    assert (status, verdict(screen)) == (0, "PASS"), screen


@pytest.mark.lammps
@pytest.mark.parametrize(
    ("name", "first", "since"),
    [
        ("restitution, wall", "20230802", "2 Aug 2023"),
        ("restitution that no old LAMMPS has", "20240829", "29 Aug 2024"),
    ],
)
def test_a_lammps_that_is_too_old_is_refused(
    name: str, first: str, since: str, tmp_path: Path
) -> None:
    scene = ALL[name]
    text = standalone(scene, lay_out(scene, rtol=RTOL, watch_every=0))
    assert f"for LAMMPS of {since} and later" in " ".join(text.replace("\n#", "").split())
    path = tmp_path / "in.chain"
    path.write_text(text.replace(f"$(version) < {first}", f"$(version) < 99{first}"))
    status, screen = run(path, tmp_path)
    assert status == 2
    assert f"This damping needs LAMMPS of {since} or later" in screen


@pytest.mark.parametrize("name", ["restitution", "dashpot"])
def test_what_looks_can_find_is_what_they_do_find(name: str) -> None:
    # Wherever the looks fall, the maxima of samples lie between the peak and the least of it.
    # Readings 0.1 natural time units apart cost the peak 7e-7, in the worst of 80 random scenes.
    scene = ALL[name]
    true = simulate_damped_verlet(scene, scene.schedule(0.005 * scene.units.time)).peaks.force
    for watch_every in (3, 20):
        peak, least = looked_at(scene, 0.005, watch_every)
        assert largest_difference(peak, true) < 1e-6
        for every in (1, watch_every - 1, watch_every):
            sampled = sampled_maxima(scene, 0.005, every)
            assert np.all(sampled <= peak * (1 + 1e-6))
            assert np.all(sampled >= least)


def test_steps_of_damped_contacts_are_by_default_for_a_smaller_accuracy() -> None:
    scene = ALL["viscoelastic"]
    assert deck_step(scene) == deck_step(scene, rtol=1e-4)
    elastic = replace(scene, contact=None)
    assert deck_step(elastic) == deck_step(elastic, rtol=1e-6)


@pytest.mark.parametrize("rtol", [1e-3, pytest.param(1e-4, marks=pytest.mark.slow)])
def test_the_step_is_one_for_the_wanted_accuracy(rtol: float) -> None:
    # First-order errors are erratic where contacts begin at a speed; 0.3 to 0.9 measured.
    for name in ("restitution", "viscoelastic", "dashpot"):
        scene = ALL[name]
        known = known_answer(scene, lay_out(scene, rtol=rtol))
        assert 0.2 * rtol < known.largest_error < 1.5 * rtol, name


@pytest.mark.parametrize("scene", [EVERY_TERM, hc.Scene(CHAIN, PULSE)], ids=["terms", ""])
def test_a_deck_in_which_no_peak_could_be_wrong_is_refused(scene: hc.Scene) -> None:
    # Its tolerance would be above 1, so that a force of 0 would pass.
    known_answer(scene, lay_out(scene, rtol=1e-4))
    rare = lay_out(scene, rtol=1e-4, watch_every=10**8)
    with pytest.raises(Unpredictable, match=r"judge nothing: steps of .*, 100000000 from one look"):
        known_answer(scene, rare)


def test_a_deck_that_would_take_too_many_steps_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    # It takes 26,000 steps.
    monkeypatch.setattr("hertzchain.decks.known_answer._MOST_STEPS", 2e4)
    with pytest.raises(TooExpensive, match=r"than 2e\+04: ask for a larger rtol"):
        deck_step(EVERY_TERM, rtol=1e-5)
    # Steps of 0.08 contact times, the longest that trials can find, are 1,143.
    monkeypatch.setattr("hertzchain.decks.known_answer._MOST_STEPS", 1e3)
    monkeypatch.setattr("hertzchain.decks.known_answer.second_order_step", None)  # no trials
    with pytest.raises(TooExpensive, match=r"steps, more than 1e\+03: ask for a dt, or"):
        deck_step(EVERY_TERM, rtol=1e-2)
    with pytest.raises(TooExpensive, match=r"1e\+03 steps, more than 1e\+03: ask for a larger dt"):
        deck_step(EVERY_TERM, EVERY_TERM.end_time / 1001)
    assert deck_step(EVERY_TERM, EVERY_TERM.end_time / 999) > 0


@pytest.mark.lammps
def test_a_weak_shock_passes_on_softer_granules(tmp_path: Path) -> None:
    weak = hc.Scene(replace(CHAIN, granules=12), hc.Striker(1e-8), wall=hc.Wall("rigid"))
    path = written(weak, tmp_path, 1e-4)
    assert "E / 8^14" in path.read_text()
    status, screen = run(path, tmp_path)
    assert (status, verdict(screen)) == (0, "PASS"), screen
    expected = hc.Native(rtol=1e-7).run(weak).peak_force
    # Steps for an error of 1e-4.
    assert largest_difference(peaks(tmp_path), expected) < 1e-4


def test_the_head_says_which_contacts_are_the_walls(tmp_path: Path) -> None:
    ends: dict[str, Any] = dict.fromkeys(("wall", "near_wall"), hc.Wall("rigid"))
    pulse = replace(PULSE, granule=2)
    said = {
        "wall": "Contact 7, on the screen, is the wall's.",
        "near_wall": "Contact 1 is the near",
    }
    for kept in ((), ("wall",), ("near_wall",), ("wall", "near_wall")):
        walls = {name: ends[name] for name in kept}
        scene = replace(hc.Scene(hc.Chain(6, **STEEL), pulse, hc.Run(5e-5)), **walls)
        text = " ".join(written(scene, tmp_path).read_text().replace("#", "").split())
        assert {name for name, words in said.items() if words in text} == set(kept)
