"""The error of a far field: short chains against what long ones end with."""

from __future__ import annotations

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.observables.far_field import UNSETTLED, WAVE_SPEED, unsettled
from hertzchain.observables.transition import SolitaryWave, solitary_wave, transition_granules
from hertzchain.theory import solitary_wave as exact
from tests.conftest import paper_scene

LENGTHS = (8, 10, 12, 14, 17, 20, 24, 28, 34, 40, 56, 80, 160, 320, 640)


def test_the_speed_is_that_of_the_exact_wave() -> None:
    assert exact.solitary_wave().speed == pytest.approx(WAVE_SPEED, abs=5e-11)


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


@pytest.mark.parametrize("last", range(4, 12))
def test_the_half_of_a_short_chain_near_the_shock_does_not_count(last: int) -> None:
    """There the pulse still acts, so that its peaks say nothing of the growth of the wave."""
    force, time = 100.0 - 10.0 / np.arange(1.0, 13.0), np.arange(1.0, 13.0)
    other = np.where(np.arange(12) < last - last // 2, 2.0, 1.0)
    at, speed = np.array([last]), np.array([0.5])
    bound = unsettled(force[None], time[None], at, speed)
    assert unsettled((force * other)[None], (time / other)[None], at, speed) == bound
    changed = np.where(np.arange(12) == last - min(4, last // 2), 1.01, 1.0)
    assert unsettled((force * changed)[None], time[None], at, speed) != bound


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


def test_a_chain_too_short_for_its_table_says_so() -> None:
    wave = hc.Native().run(table((0, 0.0), (5, 100.0), (10, 0.0), granules=20)).solitary_wave
    assert wave.far_field_force is wave.speed_error is None
    assert wave.far_field_error is not None
    assert wave.far_field_error >= UNSETTLED
    assert "more granules" in str(wave.reason)
