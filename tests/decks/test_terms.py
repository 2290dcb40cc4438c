"""Scenes with terms: LAMMPS decks that judge themselves; other writers of decks refuse them."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import hertzchain as hc
from hertzchain.decks.known_answer import deck_step, known_answer, lay_out
from hertzchain.errors import TooExpensive, Unpredictable
from hertzchain.observables.peaks import largest_difference
from tests.conftest import STEEL
from tests.decks.test_standalone_deck import peaks, run, verdict, written
from tests.engines.native.test_terms import PULSE, SCENES
from tests.oracles.sampled_maxima import sampled_maxima

RTOL = 1e-4
"""What the steps of these decks may cost the peaks: two thousand steps or so."""

ALL = SCENES["all at once"]

PASSING = {
    **SCENES,
    "force, rigid wall": hc.Scene(
        hc.Chain(3, **STEEL), PULSE, wall=hc.Wall("rigid"), precompression=hc.Precompression(5.0)
    ),
    "one granule and its wall count two contacts": hc.Scene(
        hc.Chain(2, **STEEL), PULSE, wall=hc.Wall("same", gap=1e-6)
    ),
    "pulse table": hc.Scene(
        replace(hc.Chain(8, **STEEL), gap=1e-6),
        hc.PulseTable((1e-5, 3e-5, 6e-5), (40.0, 100.0, 30.0)),
    ),
    "end in the pulse": hc.Scene(
        hc.Chain(8, **STEEL), PULSE, hc.Run(3e-5), precompression=hc.Precompression(20.0)
    ),
}

QUICK = ("gaps, wall", "all at once")


def slow_but(quick: Iterable[str], names: Iterable[str]) -> list[Any]:
    """Names, of which all but the quick ones are slow: each takes LAMMPS a third of a second."""
    return [name if name in quick else pytest.param(name, marks=pytest.mark.slow) for name in names]


@pytest.mark.lammps
@pytest.mark.parametrize("name", slow_but(QUICK, PASSING))
def test_every_term_passes(name: str, tmp_path: Path) -> None:
    scene = PASSING[name]
    path = written(scene, tmp_path, RTOL)
    status, screen = run(path, tmp_path)
    assert (status, verdict(screen)) == (0, "PASS"), screen
    assert "WARNING" not in screen
    step = lay_out(scene, rtol=RTOL).step
    legs = scene.schedule(step * scene.units.time)
    assert re.findall(r"Current step  : (\d+)", screen)[-1] == str(sum(leg.steps for leg in legs))
    found, expected = peaks(tmp_path), sampled_maxima(scene, step, 1) * scene.units.force
    assert found.size == scene.last_contact - 1
    # Round-off of absolute coordinates over about 3,000 steps; 2e-9 measured.
    assert largest_difference(found, expected) < 1e-8


MISTAKES = {
    "wall twice as stiff": ("all at once", r"(variable k_wall equal )", r"\g<1>2*"),
    "no wall": ("striker, rigid wall", r"fix wall last wall", "fix wall empty wall"),
    "pair mixed wrongly": ("dimer", r"(pair_coeff 1 2 hertz )\$\{k1_2\}", r"\g<1>${k1_1}"),
    "stiffness": ("dimer", r"(variable k1_2 equal )", r"\g<1>1.01*"),
    "exponent": ("large striker", r"(pair_coeff 1 1) hertz \S+", r"\1 hooke 1e7"),
    "radius": ("dimer", r"(set atom 5 diameter 0\.0095)", r"\g<1>01"),
    "density": ("dimer", r"(set atom 5 density )", r"\g<1>1"),
    "gap lost": ("gaps", r"(create_atoms 1 single 0\.038)04", r"\g<1>03"),
    "gravity the wrong way": ("column", r"vector 1 0 0", "vector -1 0 0"),
    "no load": ("precompression", r"(fix press first addforce) 20.0", r"\1 0.0"),
    "load on one end": ("precompression", r"(fix hold last addforce) -20.0", r"\1 0.0"),
    "velocity of granule 2": ("large striker", r"velocity first", "velocity second"),
    "velocity": ("large striker", r"(velocity first set) 1.0", r"\1 1.001"),
    "damping": ("all at once", r"(pair_coeff 1 2 \S+ \S+) 0.0", r"\1 1e6"),
    "step": ("all at once", r"timestep (\S+)", r"timestep $(1.5*\1:%.17g)"),
    "pulse": ("gaps", r"(variable force equal 0\.0\+)100\.0", r"\g<1>100.1"),
    "wall's peak": (
        "all at once",
        r"(variable known_true atom \"[^\"]*\(id==12\)\*2\.)7",
        r"\g<1>8",
    ),
    "a true peak": (
        "all at once",
        r"(variable known_true atom \"[^\"]*\(id==4\)\*)\d\.",
        r"\g<1>9.",
    ),
    "overlap": ("gaps", r"f_known\[1\]\+x-c_ahead", r"f_known[1]*1.0000001+x-c_ahead"),
    "stale positions": ("gaps", r"(fix look all ave/time) \S+ 1 \S+", r"\1 100 1 100"),
}

QUICK_MISTAKES = ("wall twice as stiff", "pair mixed wrongly", "gap lost")


@pytest.mark.lammps
@pytest.mark.parametrize("mistake", slow_but(QUICK_MISTAKES, MISTAKES))
def test_a_mistake_in_a_deck_fails(mistake: str, tmp_path: Path) -> None:
    name, right, wrong = MISTAKES[mistake]
    path = written(SCENES[name], tmp_path, RTOL)
    text, count = re.subn(right, wrong, path.read_text())
    assert count == 1
    groups = "group second id 2\ngroup empty empty\n"
    path.write_text(text.replace("group first id 1\n", "group first id 1\n" + groups))
    status, screen = run(path, tmp_path)
    assert (status, verdict(screen)) == (1, "FAIL"), screen


@pytest.mark.lammps
def test_a_weak_shock_passes_on_softer_granules(tmp_path: Path) -> None:
    weak = hc.Scene(hc.Chain(12, **STEEL), hc.Striker(1e-8), wall=hc.Wall("rigid"))
    path = written(weak, tmp_path, RTOL)
    assert "E / 8^14" in path.read_text()
    status, screen = run(path, tmp_path)
    assert (status, verdict(screen)) == (0, "PASS"), screen
    expected = hc.Native(rtol=1e-7).run(weak).peak_force
    # Steps for an error of 1e-4.
    assert largest_difference(peaks(tmp_path), expected) < 1e-4


@pytest.mark.parametrize("scene", [ALL, hc.Scene(hc.Chain(8, **STEEL), PULSE)], ids=["terms", ""])
def test_a_deck_in_which_no_peak_could_be_wrong_is_refused(scene: hc.Scene) -> None:
    # Its tolerance would be above 1, so that a force of 0 would pass.
    known_answer(scene, lay_out(scene, rtol=RTOL))
    rare = lay_out(scene, rtol=RTOL, watch_every=10**8)
    with pytest.raises(Unpredictable, match=r"judge nothing: steps of .*, 100000000 from one look"):
        known_answer(scene, rare)


def test_a_deck_that_would_take_too_many_steps_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    # It takes 26,000 steps.
    monkeypatch.setattr("hertzchain.decks.known_answer._MOST_STEPS", 2e4)
    with pytest.raises(TooExpensive, match=r"than 2e\+04: ask for a larger rtol"):
        deck_step(ALL, rtol=1e-5)
    # Steps of 0.08 contact times, the longest that trials can find, are 1,143.
    monkeypatch.setattr("hertzchain.decks.known_answer._MOST_STEPS", 1e3)
    monkeypatch.setattr("hertzchain.decks.known_answer.second_order_step", None)  # no trials
    with pytest.raises(TooExpensive, match=r"steps, more than 1e\+03: ask for a dt, or"):
        deck_step(ALL, rtol=1e-2)
    with pytest.raises(TooExpensive, match=r"1e\+03 steps, more than 1e\+03: ask for a larger dt"):
        deck_step(ALL, ALL.end_time / 1001)
    assert deck_step(ALL, ALL.end_time / 999) > 0


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
