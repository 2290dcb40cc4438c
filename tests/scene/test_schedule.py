"""The schedule: equal steps between corners, the same for every backend."""

from __future__ import annotations

import itertools
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

import hertzchain as hc
from hertzchain.errors import TooExpensive
from hertzchain.scene.ramp import Ramp
from hertzchain.scene.schedule import Leg, lay_steps

DECAY = Ramp(1.0, 3.5, 5.0, 0.0, "linear")


def bounds(legs: tuple[Leg, ...]) -> list[tuple[float, float]]:
    return [(leg.start, leg.end) for leg in legs]


def test_each_leg_has_length_over_dt_steps_rounded_up() -> None:
    legs = lay_steps([Ramp(0.0, 1.0, 0.0, 5.0, "cosine"), DECAY], 10.0, 0.25)  # no remainder
    assert [leg.steps for leg in legs] == [4, 10, 26]


def test_a_step_too_small_to_be_counted_is_an_error() -> None:
    with pytest.raises(TooExpensive, match="longer dt"):
        lay_steps([DECAY], 10.0, 5e-324)


@given(
    corners=st.lists(st.floats(0.0, 100.0), min_size=2, max_size=8, unique=True).map(sorted),
    end_time=st.floats(1e-3, 200.0),
    dt=st.floats(1e-3, 300.0),
)
def test_legs_cover_the_run_with_the_fewest_equal_steps(
    corners: list[float], end_time: float, dt: float
) -> None:
    ramps = [Ramp(a, b, 1.0, 2.0, "linear") for a, b in itertools.pairwise(corners)]
    legs = lay_steps(ramps, end_time, dt)
    assert legs[0].start == 0.0
    assert legs[-1].end == end_time
    for before, after in itertools.pairwise(legs):
        assert before.end == after.start
        assert before.end in corners
    for leg in legs:
        assert not any(leg.start < corner < leg.end for corner in corners)
        # At least 1: a length of 5e-324 over dt is rounded to 0. One fewer would be too long, but
        # for a rounding error of the quotient, (0.2 - 0.125) / 0.001 being above 75.
        quotient = (leg.end - leg.start) / dt
        assert max(1, math.ceil(quotient * (1 - 1e-15))) <= leg.steps
        assert leg.steps <= max(1, math.ceil(quotient))
        assert leg.dt == (leg.end - leg.start) / leg.steps
        assert leg.dt <= dt * (1 + 1e-15)  # the quotient is rounded twice
        assert (leg.ramp is None) == (leg.start >= corners[-1] or leg.end <= corners[0])
        if leg.ramp is not None:
            assert leg.ramp in ramps
            assert leg.ramp.start == leg.start
            assert leg.ramp.end >= leg.end


def test_a_leg_in_other_units_vs_by_hand() -> None:
    leg = Leg(1.0, 2.0, 7, DECAY).in_units(time=0.5, force=10.0)
    assert leg == Leg(2.0, 4.0, 7, Ramp(2.0, 7.0, 0.5, 0.0, "linear"))
    assert Leg(1.0, 2.0, 7, None).in_units(0.5, 10.0) == Leg(2.0, 4.0, 7, None)


def test_a_scenes_schedule_has_its_corners(demo: hc.Scene) -> None:
    assert demo.rise_time is not None
    legs = demo.schedule(1e-7)
    t0 = demo.rise_time
    assert bounds(legs) == [(0.0, t0), (t0, 2 * t0), (2 * t0, demo.end_time)]
    assert [leg.ramp for leg in legs] == [*demo.ramps, None]


@given(end=st.floats(1e-9, 1e3), dt=st.floats(1e-4, 1.0))
def test_the_largest_step_of_a_schedule_gives_that_schedule_again(end: float, dt: float) -> None:
    ramps = [Ramp(0.0, end / 3, 0.0, 1.0, "linear"), Ramp(end / 3, end, 1.0, 0.0, "linear")]
    legs = lay_steps(ramps, 2 * end, dt * end)
    assert lay_steps(ramps, 2 * end, max(leg.dt for leg in legs)) == legs
