"""The end of the transition: peaks made by hand for each clause, and chains of two lengths."""

from __future__ import annotations

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.observables.transition import SolitaryWave, solitary_wave, transition_granules
from tests.conftest import paper_scene


def p_of(peaks: list[float], peaked_until: int | None = None) -> int | None:
    """The p of peaks F_2, F_3 ...; contacts up to ``peaked_until`` have peaked, by default all."""
    contact = np.arange(2, len(peaks) + 2)
    last = contact[-1] if peaked_until is None else peaked_until
    return transition_granules(np.array(peaks), contact <= last)


def growing(until: int, granules: int, rate: float = 1.02) -> list[float]:
    """Peaks F_2 ... F_N that change by 2 % up to contact ``until`` and not after it."""
    return [100.0 * rate ** min(i, until) for i in range(2, granules + 1)]


@pytest.mark.parametrize("until", [5, 6, 9, 20])
@pytest.mark.parametrize("rate", [1.02, 0.98])
def test_p_is_the_first_contact_after_the_last_change(until: int, rate: float) -> None:
    assert p_of(growing(until, 40, rate)) == until


@pytest.mark.parametrize("until", [2, 3, 4])
def test_p_is_at_least_5(until: int) -> None:
    assert p_of(growing(until, 40)) == 5


def test_an_early_plateau_is_not_the_end() -> None:
    """Steady from contact 4 to 15, then another change of 2 % each to contact 20."""
    peaks = [100.0] * 14 + [100.0 * 1.02**k for k in range(1, 6)] + [100.0 * 1.02**5] * 20
    assert peaks[15 - 2] == 100.0
    assert peaks[16 - 2] == 102.0
    assert p_of(peaks) == 20


def test_a_late_single_change_moves_the_end_behind_it() -> None:
    peaks = [100.0] * 20 + [103.0] * 10  # contact 22 is the first with 103 N
    assert p_of(peaks) == 22


def test_changes_are_relative_to_the_later_peak() -> None:
    """From 100 to 101 is 0.0099 of the later; from 101 to 100 is 0.01, which is not below 1 %."""
    assert p_of([100.0] * 8 + [101.0] * 8) == 5
    assert p_of([101.0] * 8 + [100.0] * 8) == 10


def test_a_change_of_exactly_1_percent_is_a_change() -> None:
    assert p_of([99.0] * 8 + [100.0] * 8) == 10
    assert p_of([99.001] * 8 + [100.0] * 8) == 5


def test_another_limit_than_1_percent() -> None:
    peaks, passed = np.array(growing(9, 40)), np.ones(39, np.bool_)  # changes of 2 %, 0.0196
    assert transition_granules(peaks, passed, 0.019) == 9
    assert transition_granules(peaks, passed, 0.02) == 5
    one_by_one = np.full(37, 0.019)  # of changes 2 ... 38
    one_by_one[[8 - 2, 7 - 2]] = 0.02
    assert transition_granules(peaks, passed, one_by_one) == 7


def test_the_contact_at_the_free_end_does_not_count() -> None:
    assert p_of([100.0] * 20 + [97.6]) == 5
    assert p_of([100.0] * 20 + [0.0]) == 5
    # The one before it does.
    assert p_of([100.0] * 19 + [97.6, 100.0]) is None


def test_one_change_after_contact_5_must_be_seen() -> None:
    """The condition is for k = i ... N - 2: with i = 5 it needs 7 granules."""
    assert p_of(growing(3, 7)) == 5
    assert p_of(growing(3, 6)) is None


@pytest.mark.parametrize("granules", [2, 3, 4, 5])
def test_too_short_a_chain_has_no_p(granules: int) -> None:
    assert p_of([100.0] * (granules - 1)) is None


def test_a_transition_longer_than_the_chain_has_no_p() -> None:
    assert p_of(growing(40, 20)) is None
    assert p_of(growing(18, 20)) == 18
    assert p_of(growing(19, 20)) is None


def test_the_run_must_go_on_until_contact_p_plus_2_has_peaked() -> None:
    peaks = growing(9, 20)
    assert p_of(peaks, peaked_until=11) == 9
    assert p_of(peaks, peaked_until=10) is None


def test_contacts_that_the_wave_has_not_reached_are_no_plateau() -> None:
    assert p_of(growing(9, 12) + [0.0] * 8, peaked_until=12) is None
    assert p_of([0.0] * 19, peaked_until=1) is None


# The wave


SLOWNESS = 2 * 0.9055 * 130 ** (1 / 6)
"""Natural time unit of contacts under 1 N [s N^(1/6)]: about 2 s a contact for waves of 130 N."""


def steady_wave(granules: int, p: int, peaked_until: int | None = None) -> SolitaryWave:
    """Peaks F_i = 100 + i, one every 2 s, contacts half a metre apart."""
    contact = np.arange(2.0, granules + 1.0)
    peaked = contact <= (peaked_until or granules)
    return solitary_wave(100.0 + contact, 2.0 * contact, peaked, p, 0.5, SLOWNESS)


def test_wave_force_is_that_of_contact_p_plus_1() -> None:
    assert steady_wave(40, 9).peak_force == 110.0


@pytest.mark.parametrize("granules", [40, 21, 14, 13])
def test_speed_is_distance_over_time(granules: int) -> None:
    """Also where the chain ends before contact p + 11."""
    assert steady_wave(granules, 9).speed == 0.25


def test_speed_is_that_between_contacts_p_plus_1_and_p_plus_11() -> None:
    contact = np.arange(2.0, 41.0)
    # 2 s a contact from 10 to 20, else 7 s.
    time = np.cumsum(np.where((contact > 10) & (contact <= 20), 2.0, 7.0))
    peaked = contact > 0
    assert solitary_wave(100.0 + contact, time, peaked, 9, 0.5, SLOWNESS).speed == 0.25


@pytest.mark.parametrize("granules", [11, 12])
def test_there_is_no_speed_over_fewer_than_two_contacts(granules: int) -> None:
    """From contact 10; the one at the free end, N, peaks early and is no measure."""
    assert steady_wave(granules, 9).speed is None


def test_without_p_there_is_no_wave() -> None:
    ones = np.ones(10)
    assert solitary_wave(ones, ones, ones > 0, None, 1.0, 1.0) == SolitaryWave(None, None, None)


@pytest.mark.parametrize(("peaked_until", "speed"), [(40, 0.25), (12, 0.25), (11, None)])
def test_speed_takes_no_contact_that_has_not_peaked(peaked_until: int, speed: float | None) -> None:
    assert steady_wave(40, 9, peaked_until).speed == speed


@pytest.fixture(scope="module")
def short() -> hc.Result:
    """The demo with the free end at granule 20, contact p + 11."""
    return hc.Native("reference").run(paper_scene("cosine-triangular", 2.0, 2.0, granules=20))


def test_far_field_force_of_a_short_chain_vs_the_same_contact_of_a_long_one(
    short: hc.Result, demo_reference: hc.Result
) -> None:
    """The last contact that the free end does not touch: the last that both chains agree on."""
    same = np.abs(short.peak_force / demo_reference.peak_force[:19] - 1) < 1e-11
    last = int(np.nonzero(same)[0][-1])
    assert short.contact[last] == 18
    # Both runs are right to 1e-12.
    far = short.solitary_wave.far_field_force
    assert far == pytest.approx(demo_reference.peak_force[last], rel=1e-11, abs=0)


def test_speed_in_a_short_chain_vs_a_long_one(short: hc.Result, demo_reference: hc.Result) -> None:
    assert short.transition_granules == demo_reference.transition_granules == 9
    speed = demo_reference.solitary_wave.speed
    assert speed is not None
    # One contact fewer, over which the wave still gets 3e-5 faster. The peak of contact N, early
    # by 0.035 natural time units, would make it 3e-3.
    assert short.solitary_wave.speed == pytest.approx(speed, rel=1e-4, abs=0)
