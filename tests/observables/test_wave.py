"""The wave of a chain: the end of the transition, the far field, speed and width."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import hertzchain as hc
from hertzchain.errors import SceneError
from hertzchain.observables.wave import (
    UNSETTLED,
    WAVE_SPEED,
    SolitaryWave,
    places,
    solitary_wave,
    transition_granules,
)
from hertzchain.theory import solitary_wave as exact
from tests.conftest import STEEL, paper_scene

LONG = hc.Scene(hc.Chain(40, **STEEL), hc.Striker(1.0))


def test_the_errors_are_bounds() -> None:
    """Velocity Verlet is off by parts of its bounds, as ten times the accuracy tells."""
    true = hc.Native(rtol=1e-9).run(LONG).wave(20, 30)
    wave = hc.Native("velocity-verlet", 5e-7).run(LONG).wave(20, 30)
    for name in ("speed", "height", "width"):
        off = abs(getattr(wave, name) / getattr(true, name) - 1)
        assert off <= getattr(wave, f"{name}_error") + getattr(true, f"{name}_error"), name
        assert off > 1e-3 * getattr(wave, f"{name}_error"), name


def test_the_usual_pair_is_before_the_end() -> None:
    result = hc.Native(rtol=1e-6).run(LONG)
    wave = result.usual_wave
    assert wave == result.wave(28, 38)
    assert wave.width_granules == pytest.approx(1.41, abs=0.01)
    damped = replace(LONG, contact=hc.Contact("restitution", restitution=0.95))
    slow = hc.Native(rtol=1e-6).run(damped).usual_wave
    assert (slow.first, slow.last) == (23, 33)
    assert hc.Native().run(paper_scene("cosine", 1.0, 2.0, 12)).usual_wave is None
    assert result.to_dict()["wave"]["speed_m_s"] == wave.speed


def test_a_piston_that_squeezes_a_chain_sends_no_wave_from_its_end() -> None:
    """There the far contacts reach half of their largest force before those at the piston."""
    scene = hc.Scene(hc.Chain(6, **STEEL), hc.Piston(0.1), wall=hc.Wall("rigid"))
    result = hc.Native(rtol=1e-6).run(scene)
    assert result.usual_wave is None
    assert result.to_dict()["wave"] is None


def test_what_has_no_wave_is_refused() -> None:
    result = hc.Native(rtol=1e-6).run(replace(LONG, run=hc.Run(1e-4)))
    with pytest.raises(SceneError, match="must have clear first pulses"):
        result.wave(20, 40)
    walled = hc.Native(rtol=1e-6).run(replace(LONG, wall=hc.Wall("rigid")))
    with pytest.raises(SceneError, match="before the last two ahead of an end"):
        walled.wave(20, 40)
    for pair in ((5, 5), (1, 4), (4, 41)):
        with pytest.raises(SceneError, match="must be two contacts from 2 to 40, between granules"):
            walled.wave(*pair)
    with pytest.raises(SceneError, match="needs first pulses"):
        hc.Native(wanted="all").run(LONG).wave(20, 30)


def test_places_of_contacts_by_hand() -> None:
    """In the middle of a gap, and of an overlap: those of unlike spheres differ under one load."""
    r, shock = STEEL["radius"], hc.Striker(0.1, radius=2e-3)
    apart = hc.Scene(hc.Chain(3, **STEEL, gap=(0.0, 2e-6, 4e-6)), shock, wall=hc.Wall("rigid"))
    expected = [2e-3 + 1e-6, 2e-3 + 2 * r + 4e-6, 2e-3 + 4 * r + 6e-6]
    assert places(apart) == pytest.approx(expected, rel=1e-14)
    modulus = [193e9, 1e9, 193e9, 193e9]
    chain = hc.Chain(4, **{**STEEL, "young_modulus": modulus})
    load = hc.Precompression(20.0)
    pressed = hc.Scene(chain, hc.Pulse("cosine", 1.0, 2.0, rise_time=1e-5), precompression=load)
    first, two, last = pressed.granules.static_overlap
    assert first == two > 3 * last
    expected = [r - first / 2, 3 * r - 1.5 * first, 5 * r - 2 * first - last / 2]
    assert places(pressed) == pytest.approx(expected, rel=1e-14)


def test_contacts_near_the_end_are_marked() -> None:
    """Two, and seven where contacts are damped: there the usual wave does not go."""
    for contact, count in ((None, 2), (hc.Contact("restitution", restitution=0.9), 7)):
        scene = hc.Scene(hc.Chain(20, **STEEL), hc.Striker(1.0), contact=contact)
        result = hc.Native().run(scene)
        marked = result.contact[result.first_columns["near_end"]]
        assert marked.tolist() == list(range(21 - count, 21))
        assert result.usual_wave.last == 20 - count


def p_of(peaks: list[float], peaked_until: int | None = None) -> int | None:
    """The p of peaks F_2, F_3 ...; contacts up to ``peaked_until`` have peaked, by default all."""
    contact = np.arange(2, len(peaks) + 2)
    last = contact[-1] if peaked_until is None else peaked_until
    return transition_granules(np.array(peaks), contact <= last)


@given(
    early=st.lists(st.sampled_from([1.0, 1.005, 1.02, 0.98]), max_size=20),
    steady=st.integers(0, 10),
    end=st.sampled_from([1.0, 0.976, 0.0]),
    unseen=st.integers(0, 12),
)
def test_p_vs_its_definition(early: list[float], steady: int, end: float, unseen: int) -> None:
    """The smallest i >= 5 from which all changes k = i ... N - 2 are small, i + 2 having peaked."""
    peaks = [100.0, *(100.0 * np.cumprod([*early, *[1.0] * steady, end]))]
    granules, force = len(peaks) + 1, dict(enumerate(peaks, start=2))
    expected = None
    for i in range(5, granules - 1):
        changes = [abs(force[k + 1] / force[k] - 1) for k in range(i, granules - 1)]
        if max(changes) < 0.01:
            expected = i if i + 2 <= granules - unseen else None
            break
    assert p_of(peaks, granules - unseen) == expected


def test_changes_are_relative_to_the_later_peak() -> None:
    """From 100 to 101 is 0.0099 of the later; from 101 to 100 is 0.01, which is not below 1 %."""
    assert p_of([100.0] * 8 + [101.0] * 8) == 5
    assert p_of([101.0] * 8 + [100.0] * 8) == 10
    assert p_of([99.001] * 8 + [100.0] * 8) == 5
    assert p_of([0.0] * 19, 1) is None


# The wave


SLOWNESS = 2 * 0.9055 * 130 ** (1 / 6)
"""Natural time unit of contacts under 1 N [s N^(1/6)]: about 2 s a contact for waves of 130 N."""


def steady_wave(granules: int, p: int, peaked_until: int | None = None) -> SolitaryWave:
    """Peaks F_i = 100 + i, contacts half a metre apart: 2 s a contact from 10 to 20, else 7 s."""
    contact = np.arange(2.0, granules + 1.0)
    time = np.cumsum(np.where((contact > 10) & (contact <= 20), 2.0, 7.0))
    peaked = contact <= (peaked_until or granules)
    return solitary_wave(100.0 + contact, time, peaked, p, 0.5, SLOWNESS)


@pytest.mark.parametrize(
    ("granules", "peaked_until", "speed"),
    [
        *((granules, None, 0.25) for granules in (40, 21, 14, 13)),
        # From contact 10; the one at the free end, N, peaks early and is not a measure.
        *((granules, None, None) for granules in (11, 12)),
        (40, 12, 0.25),
        (40, 11, None),
    ],
)
def test_force_and_speed_of_a_wave(
    granules: int, peaked_until: int | None, speed: float | None
) -> None:
    """The speed is that from contact p + 1 to p + 11, or to an earlier end of the chain."""
    wave = steady_wave(granules, 9, peaked_until)
    assert (wave.peak_force, wave.speed) == (110.0, speed)
    ones = np.ones(10)
    assert solitary_wave(ones, ones, ones > 0, None, 1.0, 1.0) == SolitaryWave(None, None, None)


LENGTHS = (8, 10, 12, 14, 17, 20, 24, 28, 34, 40, 56, 80, 160, 320, 640)


def cut(long: hc.Result, granules: int) -> SolitaryWave:
    """The wave of a shorter chain, which has the same peaks up to its last two contacts."""
    chain = long.scene.chain
    slowness = 2 * chain.radius * WAVE_SPEED / exact.speed(chain, 1.0)
    force, time = long.peak_force[: granules - 1], long.peak_time[: granules - 1]
    passed = np.ones(force.size, bool)
    p = transition_granules(force, passed)
    return solitary_wave(force, time, passed, p, 2 * chain.radius, slowness)


def check(scene: hc.Scene) -> int:
    """Return the number of lengths with a far field; each is within its error."""
    long = hc.Native(rtol=1e-7, peaks_only=True).run(scene)
    settled, half = long.peak_force[-3], long.peak_force[scene.chain.granules // 2]
    # What is left to the long chain, and the accuracy of both peaks.
    room = abs(settled / half - 1) + 2e-7
    stated = 0
    for granules in LENGTHS:
        wave = cut(long, granules)
        if wave.far_field_force is None:
            assert wave.far_field_error is None or wave.far_field_error >= UNSETTLED
            continue
        stated += 1
        assert abs(wave.far_field_force / settled - 1) <= wave.far_field_error + room
        if wave.speed is not None:
            final = exact.speed(scene.chain, settled)
            assert abs(wave.speed / final - 1) <= wave.speed_error + room
    return stated


@pytest.mark.parametrize("duration_ratio", [1.2, 4.0])
@pytest.mark.parametrize(("momentum_ratio", "lengths"), [(0.1, 12), (2.0, 8), (5.0, 5)])
def test_the_wave_changes_by_no_more_than_stated(
    momentum_ratio: float, lengths: int, duration_ratio: float
) -> None:
    profile = "cosine-triangular"
    scene = paper_scene(profile, momentum_ratio, duration_ratio, granules=1000)
    assert check(scene) >= lengths


@pytest.mark.parametrize(("granules", "is_stated"), [(12, False), (20, True)])
def test_a_chain_that_is_too_short_has_no_far_field(granules: int, is_stated: bool) -> None:
    wave = hc.Native().run(paper_scene("cosine-triangular", 2.0, 2.0, granules)).solitary_wave
    assert (wave.far_field_error < UNSETTLED) is is_stated
    assert (wave.far_field_force is not None) is is_stated
    assert (wave.reason is None) is is_stated


def table(*rows: tuple[float, float], granules: int) -> hc.Scene:
    """Rows of time and force, in natural time units and N; F0 is 100 N."""
    pulse = paper_scene("cosine", 1.0, 2.0, granules)
    time, force = zip(*rows, strict=True)
    unit = pulse.contact_time
    return hc.Scene(pulse.chain, hc.PulseTable(tuple(unit * t for t in time), force))


def test_waves_of_a_table_may_catch_up_so_that_no_error_is_stated() -> None:
    rows = ((0, 0.0), (1, 60.0), (2, 0.0), (3, 0.0), (4, 100.0), (5, 0.0))
    wave = hc.Native().run(table(*rows, granules=24)).solitary_wave
    assert wave.far_field_force is not None
    assert wave.speed is not None
    assert wave.far_field_error is wave.speed_error is None
    assert "pulse table" in str(wave.reason)
    short = hc.Native().run(table((0, 0.0), (5, 100.0), (10, 0.0), granules=20)).solitary_wave
    assert short.far_field_force is short.speed_error is None
    assert (short.far_field_error or 0.0) >= UNSETTLED
    assert "more granules" in str(short.reason)
