"""First pulses of contacts, judged by an independent solver, and what they are for."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.errors import HertzchainError, SceneError
from hertzchain.observables import first_pulse
from hertzchain.observables.damped_law import DampedLaw
from tests.conftest import STEEL, paper_scene
from tests.oracles.first_pulses import Trace
from validation.random_scenes import random_damped_scene, random_scene_with_terms

LONGEST, LONGEST_TIME = 10, 150.0
"""Granules and natural time units of a random scene."""

ORACLE = 5e-9
"""Error of the judge, over the force and the time unit: with a fifth of its longest step an arrival
in random scene 99 changes by 3.3e-9, the most of all seen."""

SCENES = 300

traced = cache(Trace)
"""The motion of a scene, which several runs are held against."""


def shares(scene: hc.Scene, backend: hc.Native | hc.Lammps) -> list[float]:
    """Errors of first pulses, arrivals and widths over what was stated, contact by contact.

    Only of contacts whose pulse is clear: elsewhere its end is a choice.
    """
    result = backend.run(scene)
    first, errors, unit = result.first_pulses, result.errors, scene.contact_time
    truth = traced(scene).first_pulses(scene.granules.static_force)
    found = []
    for k in np.flatnonzero(first.is_clear & first.is_ended & ~first.is_front):
        true = truth[k]
        assert true is not None, k
        assert true.end is not None, k
        off = abs(first.force[k] / true.force - 1) - ORACLE
        late = abs(first.arrival[k] - true.arrival) - ORACLE * unit
        found += [off / errors.first[k], late / errors.arrival[k]]
        if first.is_steady[k]:
            wide = abs(first.width[k] - (true.end - true.arrival)) - ORACLE * unit
            found.append(wide / errors.width[k])
    return found


def random_scene(number: int) -> hc.Scene:
    rng = np.random.default_rng([35, number])
    draw = random_damped_scene if number % 3 == 0 else random_scene_with_terms
    while True:
        scene = draw(rng, LONGEST, LONGEST_TIME)
        if scene.piston is None and not first_pulse.is_driven_to_the_end(scene):
            return scene


@pytest.mark.parametrize(
    "number",
    [
        pytest.param(number, marks=[] if number in (0, 1, 2, 4) else pytest.mark.slow)
        for number in range(SCENES)
    ],
)
def test_random_scenes(number: int) -> None:
    """No first pulse is off by more than what is stated."""
    scene = random_scene(number)
    for rtol in (1e-3, 1e-6, 1e-9):
        try:
            found = shares(scene, hc.Native(rtol=rtol, wanted="first"))
        except HertzchainError:
            continue  # a refusal is honest
        assert max(found, default=0.0) <= 1, (number, rtol)


TAPER = hc.Scene(
    hc.Chain(
        32, radius=4.76e-3 * 0.9 ** np.arange(32.0), young_modulus=193e9, poisson_ratio=0.3,
        density=8000.0,
    ),
    hc.Striker(0.5),
    hc.Run(1.5e-4),
    wall=hc.Wall("same"),
)  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("first", range(0, 60, 10))
def test_lammps_on_random_scenes(first: int) -> None:
    """At 1e-4: none above its bound; a scene that it cannot reach in a minute is left out."""
    judged = 0
    for number in range(first, first + 10):
        try:
            found = shares(
                random_scene(number), hc.Lammps(rtol=1e-4, wanted="first", time_limit=60)
            )
        except HertzchainError:
            continue  # a refusal is honest
        judged += len(found)
        assert max(found, default=0.0) <= 1, number
    assert judged > 30


def test_plain_scenes() -> None:
    scene = paper_scene("cosine", 1.0, 2.0, 12)
    assert 0 < max(shares(scene, hc.Native(rtol=1e-6, wanted="first"))) <= 1


@pytest.mark.parametrize(
    "backend",
    [
        hc.Native("numpy", rtol=1e-6, wanted="first"),
        hc.Native("scipy", rtol=1e-4, wanted="first"),
        hc.Native("velocity-verlet", 2e-9, wanted="first"),
        hc.Lammps(rtol=1e-4, wanted="first"),
    ],
    ids=["numpy", "scipy", "verlet", "LAMMPS"],
)
def test_others_see_the_same(backend: hc.Native | hc.Lammps) -> None:
    scene = replace(TAPER, chain=hc.Chain(8, **STEEL), run=hc.Run(2e-4))
    assert 1e-4 < max(shares(scene, backend)) <= 1


def test_errors_that_are_too_small_are_seen() -> None:
    """The bounds of velocity Verlet are a few times its errors: a tenth of them is not enough."""
    scene = replace(TAPER, chain=hc.Chain(8, **STEEL), run=hc.Run(2e-4))
    assert max(shares(scene, hc.Native("velocity-verlet", 2e-8, wanted="first"))) > 0.1


def test_chaos_at_the_end_does_not_hide_the_first_pulses() -> None:
    """A taper that ends in granules of 0.2 mm: after 0.9 ms no digit of most peaks is left."""
    short = hc.Native(rtol=1e-8, wanted="first").run(TAPER).first_pulses
    late = replace(TAPER, run=hc.Run(9e-4))
    with pytest.raises(HertzchainError, match="no right digit"):
        hc.Native(rtol=1e-6, wanted="all").run(late)
    result = hc.Native(rtol=1e-6, wanted="first").run(late)
    assert result.errors.wanted <= 1e-6
    assert np.nanmax(result.peak_errors) > 0.01
    assert np.any(result.peak_errors < 1e-6)
    assert result.first_pulses.force == pytest.approx(short.force, rel=1e-6)
    assert "repeated collisions" in result.warnings[-1]


def test_the_incident_wave_not_the_reflected_one() -> None:
    """Near the free end of a long chain nothing is reflected yet when the wave comes by."""
    short, long = (
        hc.Scene(hc.Chain(granules, **STEEL), hc.Striker(1.0), hc.Run(1e-3), wall=wall)
        for granules, wall in ((31, hc.Wall("rigid")), (90, None))
    )
    runs = [hc.Native(rtol=1e-8, wanted="first").run(scene) for scene in (short, long)]
    reflected, incident = (run.first_pulses for run in runs)
    some = slice(0, 28)  # the last two contacts before the wall are pressed by both waves at once
    assert reflected.force[some] == pytest.approx(incident.force[some], rel=1e-7)
    assert reflected.arrival[some] == pytest.approx(incident.arrival[some], rel=1e-7)
    assert np.any(runs[0].peak_force[some] > 1.01 * reflected.force[some])


def test_without_a_wave_there_is_no_pulse() -> None:
    """A run that ends before the wave is there: empty, never 0."""
    scene = replace(TAPER, run=hc.Run(2e-5))
    result = hc.Native(rtol=1e-6, wanted="first").run(scene)
    assert np.isnan(result.first_pulses.force[10:]).all()
    frame = result.to_frame()
    assert frame["first_peak_force_N"].isna().sum() >= 22
    assert result.to_dict()["first_peak_force_N"][-1] is None


def test_what_was_not_asked_for_is_not_there() -> None:
    result = hc.Native().run(paper_scene("cosine", 1.0, 2.0, 8))
    assert result.first_pulses is None
    assert "arrival_time_s" not in result.to_frame()
    with pytest.raises(SceneError, match="wanted"):
        hc.Native(wanted="some")


def note(
    begin: float, length: float, before: float, after: float, largest: float, when: float
) -> FloatArray:
    """Note of one contact with k = 1, from forces at both ends."""
    ends = [(force ** (2 / 3), 0.0, 0.0, np.nan) for force in (before, after)]
    return np.array([0.0, begin, length, *ends[0], *ends[1], before, after, largest, when])


@pytest.mark.parametrize("growth", [1.003, 1.05])
def test_a_front_that_rises_slowly(growth: float) -> None:
    """What stood for ten units is the pulse, in however many steps it is exceeded."""
    notes = [note(0.0, 1.0, 0.0, 1.0, 1.0, 1.0)]
    time, force = 20.0, 1.0
    while force < 1.9:
        notes.append(note(time, 0.1, force, growth * force, growth * force, time + 0.1))
        time, force = time + 0.1, growth * force
    law = DampedLaw(np.ones(1), np.zeros(1), 0.5, False)
    contacts = first_pulse.Contacts(law, np.zeros(1), np.ones(1))
    found = first_pulse.first_pulses(np.array(notes), contacts, np.array([force]))
    assert (found.force[0], found.time[0]) == (1.0, 1.0)
    assert found.is_front[0]
    assert found.is_clear[0]
    ended = first_pulse.Contacts(law, np.zeros(1), None)
    assert first_pulse.first_pulses(np.array(notes), ended, np.array([force])).force[0] == force
