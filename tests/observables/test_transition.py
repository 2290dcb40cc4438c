"""The end of the transition: peaks made by hand for each clause, and chains of two lengths."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hertzchain.observables.transition import SolitaryWave, solitary_wave, transition_granules


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


def test_another_limit_than_1_percent() -> None:
    passed = np.ones(39, np.bool_)
    peaks = 1.02 ** np.minimum(np.arange(2, 41), 9)  # changes of 2 %, 0.0196
    assert transition_granules(peaks, passed, 0.019) == 9
    assert transition_granules(peaks, passed, 0.02) == 5
    one_by_one = np.full(37, 0.019)  # of changes 2 ... 38
    one_by_one[[8 - 2, 7 - 2]] = 0.02
    assert transition_granules(peaks, passed, one_by_one) == 7


# The wave


SLOWNESS = 2 * 0.9055 * 130 ** (1 / 6)
"""Natural time unit of contacts under 1 N [s N^(1/6)]: about 2 s a contact for waves of 130 N."""


def steady_wave(granules: int, p: int, peaked_until: int | None = None) -> SolitaryWave:
    """Peaks F_i = 100 + i, one every 2 s, contacts half a metre apart."""
    contact = np.arange(2.0, granules + 1.0)
    peaked = contact <= (peaked_until or granules)
    return solitary_wave(100.0 + contact, 2.0 * contact, peaked, p, 0.5, SLOWNESS)


@pytest.mark.parametrize(
    ("granules", "peaked_until", "speed"),
    [
        *((granules, None, 0.25) for granules in (40, 21, 14, 13)),
        # From contact 10; the one at the free end, N, peaks early and is no measure.
        *((granules, None, None) for granules in (11, 12)),
        (40, 12, 0.25),
        (40, 11, None),
    ],
)
def test_force_and_speed_of_a_wave(
    granules: int, peaked_until: int | None, speed: float | None
) -> None:
    """Also where the chain ends before contact p + 11."""
    wave = steady_wave(granules, 9, peaked_until)
    assert (wave.peak_force, wave.speed) == (110.0, speed)
    ones = np.ones(10)
    assert solitary_wave(ones, ones, ones > 0, None, 1.0, 1.0) == SolitaryWave(None, None, None)


def test_speed_is_that_between_contacts_p_plus_1_and_p_plus_11() -> None:
    contact = np.arange(2.0, 41.0)
    # 2 s a contact from 10 to 20, else 7 s.
    time = np.cumsum(np.where((contact > 10) & (contact <= 20), 2.0, 7.0))
    peaked = contact > 0
    assert solitary_wave(100.0 + contact, time, peaked, 9, 0.5, SLOWNESS).speed == 0.25
