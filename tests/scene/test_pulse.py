"""Pulses, pistons and sines against Table 1, integrals and their tables; steps between corners."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

import hertzchain as hc
from hertzchain import theory
from hertzchain.engines import liggghts, yade
from hertzchain.engines.lammps.deck import force_formula
from hertzchain.engines.native.plan import METHODS
from hertzchain.engines.native.simulation import simulate
from hertzchain.errors import RunFailed, SceneError, TooExpensive
from hertzchain.scene.file import read_table
from hertzchain.scene.schedule import Leg, lay_steps
from hertzchain.scene.shocks import (
    PROFILES,
    SHAPES,
    Ramp,
    Shape,
    Stroke,
    profile_named,
)
from tests.conftest import STEEL
from tests.theory.test_theory_paper import table_1

F0, T0 = 100.0, 70e-6
"""Peak force [N] and rise time [s] of the pulses here."""


def ramps_of(profile: str, n: float) -> tuple[Ramp, Ramp]:
    return hc.Pulse(profile_named(profile), F0, n, rise_time=T0).ramps(T0)


@pytest.mark.parametrize("profile", PROFILES)
@pytest.mark.parametrize("n", [1.5, 2.0, 8.0])
def test_force_impulse_and_rate_vs_table_1(profile: str, n: float) -> None:
    ramps = ramps_of(profile, n)
    ends = (0.0, T0, n * T0)
    assert [(ramp.start, ramp.end) for ramp in ramps] == [ends[:2], ends[1:]]
    assert math.fsum(ramp.impulse for ramp in ramps) == pytest.approx(F0 * n * T0 / 2, rel=1e-15)
    formula = table_1(profile, n)
    for ramp in ramps:
        duration = ramp.end - ramp.start
        times = ramp.start + np.linspace(0.0, 1.0, 41) * duration
        expected = [F0 * formula(time / T0) for time in times]
        # The time is known to 1e-16 of n t0, which the steepest piece turns into 1e-15 F0.
        assert ramp.force(times) == pytest.approx(expected, abs=3e-15 * n * F0)
        assert [ramp.force(float(time)) for time in times] == pytest.approx(
            expected, abs=3e-15 * n * F0
        )
        h = 1e-5 * duration
        inside = np.linspace(ramp.start + h, ramp.end - h, 23)
        quotient = (ramp.force(inside + h) - ramp.force(inside - h)) / (2 * h)
        # Truncation pi^3 / 12 h^2 = 3e-10 and round-off 1e-16 n / h = 1e-10, of F0 / duration.
        assert ramp.force_rate(inside) == pytest.approx(quotient, abs=2e-9 * F0 / duration)
        for until in times[::8]:
            area, error = quad(ramp.force, ramp.start, until, epsabs=0, epsrel=1e-13)
            # 1e-14 of the whole: both sides are sums that cancel where the force is near 0.
            assert ramp.impulse_until(until) == pytest.approx(area, abs=1e-14 * ramp.impulse)
            assert error <= 1e-12 * ramp.impulse


@pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES)
def test_a_shape_is_one_function(shape: Shape) -> None:
    """Its rate and its area are those of its growth, by SciPy's quadrature; so is its text."""
    assert (shape.growth(0.0), shape.growth(1.0)) == pytest.approx((0.0, 1.0), abs=1e-15)
    assert quad(shape.growth, 0.0, 1.0)[0] == pytest.approx(shape.area, rel=1e-14)
    for s in (1e-3, 0.09 / math.pi, 0.11 / math.pi, 0.3, 0.8):
        # As Yade's script has it; rounding of a few operations.
        text = f"3.0 * {shape.for_numpy('(2 * s) / 2.0')} / 3.0"
        written = eval(text, {"np": np, "s": s})  # noqa: S307
        expected = pytest.approx(shape.growth(s), rel=1e-15)
        assert written == expected, "a formula needs brackets: decks multiply it"
        assert quad(shape.rate, 0.0, s)[0] == pytest.approx(shape.growth(s), rel=1e-12)


def test_a_further_shape_is_one_entry(monkeypatch: pytest.MonkeyPatch) -> None:
    """Kernels have formulas of their own, and refuse a shape without one."""
    third = Shape(lambda s: s**3, lambda s: 3 * s**2, 0.25, "({}) ** 3")
    monkeypatch.setitem(SHAPES, "cubic", third)
    ramp = Ramp(1.0, 3.0, 2.0, 10.0, "cubic")
    assert quad(ramp.force, 1.0, 3.0)[0] == pytest.approx(ramp.impulse, rel=1e-12)
    assert quad(ramp.force, 1.0, 2.5)[0] == pytest.approx(ramp.impulse_until(2.5), rel=1e-12)
    assert quad(ramp.force_rate, 1.0, 2.5)[0] == pytest.approx(ramp.force(2.5) - 2.0, rel=1e-12)
    assert force_formula(ramp) == "2.0+8.0*((time-1.0)/2.0)^3"
    leg = Leg(1.0, 3.0, 10, ramp)
    pulse = hc.Pulse("cosine", 1.0, 2.0, rise_time=1.0)
    scene = hc.Scene(hc.Chain(3, 1.0, 1.0, 0.3, 1.0), pulse)
    assert "^3" in liggghts.watched(scene, [leg], [1])
    assert '"cubic": (part) ** 3' in yade.watched(scene, [leg], [1])
    with pytest.raises(RunFailed, match="no formula for a ramp of shape cubic"):
        simulate(scene, [leg], METHODS["velocity-verlet"].walker)
    monkeypatch.setitem(PROFILES, "cosine", ("cubic", "cosine"))
    with pytest.raises(SceneError, match="has a ramp that Table 1 does not have"):
        theory.applied_force(0.5, pulse, 1.0)


@pytest.mark.parametrize(
    "text",
    [
        "time_s,force_N\n0,0\n1e-5,100\n3e-5,0.5\n",
        "time_s,force_N\r\n0,0\r\n1e-5,100\r\n3e-5,0.5\r\n",
        "\ufefftime_s,force_N\n0,0\n1e-5,100\n3e-5,0.5",
        " time_s , force_N \n\n0, 0.0\n+1.0E-05 , 100\n\n3e-5,.5\n\n",
        '"time_s","force_N"\n"0","0"\n1e-5,1e2\n3e-5,5e-1\n',
        "force_N,time_s\n0,0\n100,1e-5\n0.5,3e-5\n",
    ],
    ids=["plain", "windows", "byte-order mark", "spaces and blank lines", "quotes", "order"],
)
def test_a_pulse_table_is_read(tmp_path: Path, text: str) -> None:
    path = tmp_path / "pulse.csv"
    path.write_text(text, encoding="utf-8", newline="")
    table = read_table(hc.PulseTable, path, "pulse.csv")
    assert table.time == (0.0, 1e-5, 3e-5)
    assert table.force == (0.0, 100.0, 0.5)
    assert table.file == "pulse.csv"


# Steps: equal between corners, the same for every backend


DECAY = Ramp(1.0, 3.5, 5.0, 0.0, "linear")


def test_each_leg_has_length_over_dt_steps_rounded_up() -> None:
    legs = lay_steps([Ramp(0.0, 1.0, 0.0, 5.0, "cosine"), DECAY], 10.0, 0.25)  # no remainder
    assert [leg.steps for leg in legs] == [4, 10, 26]
    with pytest.raises(TooExpensive, match="longer dt"):
        lay_steps([DECAY], 10.0, 5e-324)
    leg = Leg(1.0, 2.0, 7, DECAY).in_units(time=0.5, force=10.0)
    assert leg == Leg(2.0, 4.0, 7, Ramp(2.0, 7.0, 0.5, 0.0, "linear"))
    assert Leg(1.0, 2.0, 7, None).in_units(0.5, 10.0) == Leg(2.0, 4.0, 7, None)


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


@given(end=st.floats(1e-9, 1e3), dt=st.floats(1e-4, 1.0))
def test_the_largest_step_of_a_schedule_gives_that_schedule_again(end: float, dt: float) -> None:
    ramps = [Ramp(0.0, end / 3, 0.0, 1.0, "linear"), Ramp(end / 3, end, 1.0, 0.0, "linear")]
    legs = lay_steps(ramps, 2 * end, dt * end)
    assert lay_steps(ramps, 2 * end, max(leg.dt for leg in legs)) == legs


@pytest.mark.parametrize("rise", [0.1, 0.3, 0.7, 0.9])
def test_a_trapezoid_may_have_no_constant_force(rise: float) -> None:
    """Sums of times are rounded: 1 ms - 0.7 ms is not 0.3 ms."""
    first, last = hc.Trapezoid(1.0, 1e-3, 1e-3 * rise, 1e-3 * (1 - rise)).ramps()
    assert first.end == last.start


# Pistons


def test_strokes_follow_the_table() -> None:
    rows = (1.0, 3.0, 4.0), (0.0, 4.0, 1.0)
    piston = hc.Piston(None, *rows)
    assert piston.strokes == (
        Stroke(0.0, 0.0, 0.0), Stroke(1.0, 0.0, 2.0), Stroke(3.0, 4.0, -3.0), Stroke(4.0, 1.0, 0.0)
    )  # fmt: skip
    assert piston.impact_velocity == 3.0
    travelled = [piston.distance(t) for t in (0.5, 2.0, 3.5, 9.0)]
    assert travelled == pytest.approx([0.0, 2.0, 5.5, 7.0], rel=1e-14)
    times = np.linspace(0.0, 6.0, 25)
    place = [max((s for s in piston.strokes if s.start <= t), key=lambda s: s.start)
             .displacement_at(t) for t in times]  # fmt: skip
    assert place == pytest.approx(np.interp(times, *rows), abs=1e-15)
    # Without a row at 0 there is no rest before it.
    assert hc.Piston(None, (0.0, 1.0), (0.0, 1.0)).strokes[0] == Stroke(0.0, 0.0, 1.0)


def test_the_mass_of_a_piston_is_infinite() -> None:
    chain, load = hc.Chain(6, **STEEL), hc.Precompression(2.0, 9.81)
    scene = hc.Scene(chain, hc.Piston(0.1), wall=hc.Wall("same"), precompression=load)
    granules = scene.granules
    assert math.isinf(granules.mass[0])
    assert granules.contact_mass[0] == granules.mass[1]
    assert granules.contact_mass[1:-1] == pytest.approx(granules.mass[2:] / 2)
    assert granules.constant_force[0] == 0
    # The static load is that of a free granule 1, whose weight is carried, too.
    free = replace(scene, shock=hc.Striker(0.1, loaded=True)).granules
    assert np.array_equal(granules.static_force, free.static_force)


def test_the_scale_is_a_collision_with_the_fastest_stroke() -> None:
    chain = hc.Chain(6, **STEEL)
    slow = hc.Scene(chain, hc.Piston(0.1))
    table = hc.Scene(chain, hc.Piston(None, (0.0, 1e-4, 2e-4), (0.0, 2e-6, -8e-6)))
    # Energy m v^2 / 2 = 2/5 A d^(5/2).
    force = (1.25 * chain.granule_mass * 0.1**2) ** 0.6 * chain.contact_stiffness**0.4
    for scene in (slow, table):
        assert scene.peak_force == pytest.approx(force, rel=1e-14)
    # A striker of the same mass gives m* v, with m* = m / 2, twice; a piston with m* = m.
    striker = hc.Scene(chain, hc.Striker(0.1))
    units = [s.units.momentum for s in (slow, striker)]
    assert slow.momentum_ratio == pytest.approx(striker.momentum_ratio, rel=1e-12)
    assert units[0] / units[1] == pytest.approx(2.0, rel=1e-12)


def test_a_chain_between_piston_and_wall_has_the_scale_of_its_rest() -> None:
    chain, far = hc.Chain(6, **STEEL), 1e-4
    table = hc.Piston(None, (0.0, 1.0), (0.0, far))
    scene = hc.Scene(chain, table, wall=hc.Wall("same"))
    overlaps = (scene.units.force / scene.granules.stiffness) ** (2 / 3)
    assert np.sum(overlaps) == pytest.approx(far, rel=1e-12)
    free = hc.Scene(chain, table)
    assert free.units.force == free.peak_force
    # A constant velocity goes as far as the run lasts.
    run = hc.Run(0.5)
    long = hc.Scene(chain, hc.Piston(2 * far), run, wall=hc.Wall("same"))
    assert long.units.force == pytest.approx(scene.units.force, rel=1e-12)
    # A run that ends before has another.
    half = hc.Scene(chain, table, hc.Run(0.5), wall=hc.Wall("same"))
    assert half.units.force == pytest.approx(scene.units.force / 2**1.5, rel=1e-12)


# Sines


def test_the_impulse_of_a_sine_is_that_of_half_a_cycle() -> None:
    shock, load = hc.Sine(5.0, 8000.0, 3), hc.Precompression(5.0)
    scene = hc.Scene(hc.Chain(5, **STEEL), shock, precompression=load)
    # Whole cycles leave nothing.
    assert scene.impulse == pytest.approx(0.0, abs=1e-15 * shock.compared_impulse)
    half = replace(scene, run=hc.Run(0.5 / 8000))
    assert half.applied_impulse == pytest.approx(shock.compared_impulse, rel=1e-14)
    assert half.momentum_ratio > 0
    assert [ramp.start for ramp in scene.ramps] == [k / 32000 for k in range(12)]
