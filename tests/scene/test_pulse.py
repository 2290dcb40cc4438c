"""The shock against a second copy of Table 1, SciPy's integrals and difference quotients."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

import hertzchain as hc
from hertzchain import theory
from hertzchain.engines.lammps.deck import force_formula
from hertzchain.engines.liggghts import deck as liggghts
from hertzchain.engines.native import METHODS, simulate
from hertzchain.engines.yade import deck as yade
from hertzchain.errors import RunFailed, SceneError
from hertzchain.scene.pulse import PROFILES, Profile, profile_named
from hertzchain.scene.ramp import SHAPES, Ramp, Shape
from hertzchain.scene.schedule import Leg
from hertzchain.scene.shock_table import read_table

F0, T0 = 100.0, 70e-6
"""Peak force [N] and rise time [s] of the pulses here."""

RATIOS = [1.5, 2.0, 8.0]
"""Duration ratios n."""

# Table 1: the force as a fraction of F0 during rise and decay, of the time since the last corner
# as a fraction of the length of the piece.
TABLE_1: dict[str, tuple[Callable[[float], float], Callable[[float], float]]] = {
    "cosine": (
        lambda s: (1 - math.cos(math.pi * s)) / 2,
        lambda s: (1 + math.cos(math.pi * s)) / 2,
    ),
    "triangular": (lambda s: s, lambda s: 1 - s),
    "cosine-triangular": (lambda s: (1 - math.cos(math.pi * s)) / 2, lambda s: 1 - s),
}

every_pulse = pytest.mark.parametrize(
    ("profile", "n"), [(profile, n) for profile in TABLE_1 for n in RATIOS]
)


def ramps_of(profile: str, n: float) -> tuple[Ramp, Ramp]:
    return hc.Pulse(profile_named(profile), F0, n, rise_time=T0).ramps(T0)


def test_the_profiles_are_those_of_table_1() -> None:
    assert PROFILES.keys() == TABLE_1.keys()


@every_pulse
def test_corners_are_at_0_t0_and_n_t0(profile: str, n: float) -> None:
    rise, decay = ramps_of(profile, n)
    assert (rise.start, rise.end, decay.start, decay.end) == (0.0, T0, T0, n * T0)
    assert (rise.start_force, rise.end_force) == (0.0, F0)
    assert (decay.start_force, decay.end_force) == (F0, 0.0)


@every_pulse
def test_force_vs_table_1(profile: str, n: float) -> None:
    for ramp, formula in zip(ramps_of(profile, n), TABLE_1[profile], strict=True):
        for s in np.linspace(0.0, 1.0, 41):
            time = ramp.start + s * (ramp.end - ramp.start)
            # The time is known to 1e-16 of n t0, which the steepest piece turns into 1e-15 F0.
            assert ramp.force(time) == pytest.approx(F0 * formula(float(s)), abs=3e-15 * n * F0)


@every_pulse
def test_force_of_an_array_is_that_of_its_elements(profile: str, n: float) -> None:
    for ramp in ramps_of(profile, n):
        times = np.linspace(ramp.start, ramp.end, 7)
        # NumPy's cosine of an array may differ in the last digit from that of a number.
        one_by_one = [float(ramp.force(float(time))) for time in times]
        assert ramp.force(times) == pytest.approx(one_by_one, abs=1e-15 * F0)
        one_by_one = [float(ramp.force_rate(float(time))) for time in times]
        assert ramp.force_rate(times) == pytest.approx(one_by_one, abs=1e-14 * F0 / T0)


@every_pulse
def test_impulse_is_f0_n_t0_over_2(profile: str, n: float) -> None:
    impulse = math.fsum(ramp.impulse for ramp in ramps_of(profile, n))
    assert impulse == pytest.approx(F0 * n * T0 / 2, rel=1e-15)  # a few roundings


@every_pulse
@pytest.mark.parametrize("part", [0.0, 0.1, 0.5, 0.77, 1.0])
def test_impulse_until_vs_quadrature(profile: str, n: float, part: float) -> None:
    for ramp in ramps_of(profile, n):
        until = ramp.start + part * (ramp.end - ramp.start)
        expected, error = quad(ramp.force, ramp.start, until, epsabs=0, epsrel=1e-13)
        # 1e-14 of the whole: both sides are sums that cancel where the force is near 0.
        assert ramp.impulse_until(until) == pytest.approx(expected, abs=1e-14 * ramp.impulse)
        assert error <= 1e-12 * ramp.impulse


@every_pulse
def test_impulse_vs_impulse_until_the_end(profile: str, n: float) -> None:
    for ramp in ramps_of(profile, n):
        assert ramp.impulse_until(ramp.end) == pytest.approx(ramp.impulse, rel=1e-15)


@every_pulse
def test_force_rate_vs_difference_quotient(profile: str, n: float) -> None:
    for ramp in ramps_of(profile, n):
        duration = ramp.end - ramp.start
        h = 1e-5 * duration
        times = np.linspace(ramp.start + h, ramp.end - h, 23)
        quotient = (ramp.force(times + h) - ramp.force(times - h)) / (2 * h)
        # Truncation pi^3 / 12 h^2 = 3e-10 and round-off 1e-16 n / h = 1e-10, of F0 / duration.
        assert ramp.force_rate(times) == pytest.approx(quotient, abs=2e-9 * F0 / duration)


force = st.floats(0.0, 1e6)


@pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES)
def test_a_shape_is_one_function(shape: Shape) -> None:
    """Its rate and its integral are those of its growth, by SciPy's quadrature; so is its text."""
    assert (shape.growth(0.0), shape.growth(1.0)) == pytest.approx((0.0, 1.0), abs=1e-15)
    assert shape.integral(1.0) == pytest.approx(shape.area, rel=1e-14)
    for s in (1e-3, 0.09 / math.pi, 0.11 / math.pi, 0.3, 0.8):
        # As Yade's script has it; rounding of a few operations.
        text = shape.for_numpy("s")
        assert eval(text, {"np": np, "s": s}) == pytest.approx(shape.growth(s), rel=1e-15)  # noqa: S307
        assert quad(shape.rate, 0.0, s)[0] == pytest.approx(shape.growth(s), rel=1e-12)
        assert quad(shape.growth, 0.0, s)[0] == pytest.approx(shape.integral(s), rel=1e-12)


def test_a_further_shape_is_one_entry(monkeypatch: pytest.MonkeyPatch) -> None:
    """Kernels have formulas of their own, and refuse a shape without one."""
    third = Shape(lambda s: s**3, lambda s: 3 * s**2, lambda s: s**4 / 4, 0.25, "({}) ** 3")
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


@given(start=st.floats(0.0, 1.0), length=st.floats(1e-3, 10.0), before=force, after=force)
@pytest.mark.parametrize("shape", ["linear", "cosine"])
def test_a_ramp_stays_between_its_ends(
    shape: Any, start: float, length: float, before: float, after: float
) -> None:
    ramp = Ramp(start, start + length, before, after, shape)
    values = ramp.force(np.linspace(ramp.start, ramp.end, 33))
    slack = 1e-15 * max(before, after)  # roundings
    assert np.all(values >= min(before, after) - slack)
    assert np.all(values <= max(before, after) + slack)
    assert values[0] == before
    assert values[-1] == pytest.approx(after, abs=slack)


def test_a_pulse_keeps_what_it_was_given() -> None:
    pulse = hc.Pulse("cosine", 1, 2, momentum_ratio=3)
    assert (pulse.momentum_ratio, pulse.rise_time) == (3, None)
    assert hc.Pulse("cosine", 1, 2, rise_time=3).momentum_ratio is None


def test_a_pulse_has_one_measure_and_ramps_a_known_shape() -> None:
    with pytest.raises(SceneError, match="momentum_ratio and rise_time: both are given"):
        hc.Pulse("cosine", F0, 2.0, momentum_ratio=1.0, rise_time=T0)
    with pytest.raises(SceneError, match="momentum_ratio or rise_time: missing"):
        hc.Pulse("cosine", F0, 2.0)
    with pytest.raises(SceneError, match="must be one of linear, cosine"):
        Ramp(0.0, 1.0, 0.0, 1.0, "square")


def test_a_table_is_linear_between_its_rows() -> None:
    time, force = (0.5, 1.0, 3.0), (1.0, 5.0, 2.0)
    ramps = hc.PulseTable(time, force).ramps()
    assert [(ramp.start, ramp.end) for ramp in ramps] == [(0.5, 1.0), (1.0, 3.0)]
    for ramp in ramps:
        times = np.linspace(ramp.start, ramp.end, 9)
        assert ramp.force(times) == pytest.approx(np.interp(times, time, force), rel=1e-15)


def test_impulse_of_a_table_vs_trapezoids() -> None:
    rng = np.random.default_rng(7)
    time, force = np.cumsum(rng.random(50)), rng.random(50)
    ramps = hc.PulseTable(tuple(time.tolist()), tuple(force.tolist())).ramps()
    expected = np.trapezoid(force, time)
    # 50 roundings
    assert math.fsum(ramp.impulse for ramp in ramps) == pytest.approx(expected, rel=1e-14)


def test_peak_force_of_a_table_is_its_largest() -> None:
    assert hc.PulseTable((0.0, 1.0, 2.0), (0.0, 7.0, 3.0)).peak_force == 7.0


def test_a_table_may_start_and_end_with_a_jump() -> None:
    table = hc.PulseTable((0.0, 1.0), (3.0, 4.0))
    assert (table.ramps()[0].start_force, table.ramps()[-1].end_force) == (3.0, 4.0)


@pytest.mark.parametrize(
    ("time", "force", "key"),
    [
        ((), (), "rows"),
        ((0.0,), (1.0,), "rows"),
        ((0.0, 1.0), (1.0,), "rows of force_N"),
        ((-1e-9, 1.0), (1.0, 1.0), "time_s in row 1"),
        ((0.0, 0.0), (1.0, 1.0), "time_s in row 2"),
        ((0.0, 2.0, 1.0), (1.0, 1.0, 1.0), "time_s in row 3"),
        ((0.0, math.inf), (1.0, 1.0), "time_s in row 2"),
        ((math.nan, 1.0), (1.0, 1.0), "time_s in row 1"),
        ((0.0, 1.0), (1.0, -1e-9), "force_N in row 2"),
        ((0.0, 1.0), (math.inf, 1.0), "force_N in row 1"),
        ((0.0, 1.0), (1.0, math.nan), "force_N in row 2"),
        ((0.0, 1.0), (0.0, 0.0), "force_N"),
    ],
    ids=str,
)
def test_an_impossible_table_is_an_error_with_its_row(
    time: tuple[float, ...], force: tuple[float, ...], key: str
) -> None:
    with pytest.raises(SceneError, match="must") as caught:
        hc.PulseTable(time, force)
    assert caught.value.key == key


@pytest.mark.parametrize(
    "text",
    [
        "time_s,force_N\n0,0\n1e-5,100\n3e-5,0.5\n",
        "time_s,force_N\r\n0,0\r\n1e-5,100\r\n3e-5,0.5\r\n",
        "\ufefftime_s,force_N\n0,0\n1e-5,100\n3e-5,0.5",
        " time_s , force_N \n\n0, 0.0\n+1.0E-05 , 100\n\n3e-5,.5\n\n",
        '"time_s","force_N"\n"0","0"\n1e-5,1e2\n3e-5,5e-1\n',
    ],
    ids=["plain", "windows", "byte-order mark", "spaces and blank lines", "quotes"],
)
def test_a_pulse_table_is_read(tmp_path: Path, text: str) -> None:
    path = tmp_path / "pulse.csv"
    path.write_text(text, encoding="utf-8", newline="")
    table = read_table(hc.PulseTable, path, "pulse.csv")
    assert table.time == (0.0, 1e-5, 3e-5)
    assert table.force == (0.0, 100.0, 0.5)
    assert table.file == "pulse.csv"


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "time_s,force_N"),
        (b"t,f\n0,1\n1,1\n", "time_s,force_N"),
        (b"force_N,time_s\n0,1\n1,1\n", "time_s,force_N"),
        (b"time_s;force_N\n0;1\n1;1\n", "time_s,force_N"),
        (b"time_s,force_N\n0,1\n", "at least 2 rows"),
        (b"time_s,force_N\n0,1\n1,one\n", "row 2 = '1,one': must be two numbers"),
        (b"time_s,force_N\n0,1\n1\n", "row 2 = '1': must be two numbers"),
        (b"time_s,force_N\n0,1,2\n1,1,2\n", "row 1 = '0,1,2': must be two numbers"),
        (b"time_s,force_N\n0,1\n0,2\n", "time_s in row 2 = 0.0: must be above 0.0"),
        (b"time_s,force_N\n0,1\n1,1e999\n", "force_N in row 2 = inf: must be"),
        (b"time_s,force_N\n0,1\nnan,1\n", "time_s in row 2 = nan: must be"),
        (b"time_s,force_N\n0,1\n1,\x00\n", "row 2"),
        (b"\x89PNG\r\n\x1a\n\x00\xff\xfe", "must be a CSV file"),
    ],
    ids=repr,
)
def test_an_impossible_file_is_an_error_with_its_name(
    tmp_path: Path, content: bytes, words: str
) -> None:
    path = tmp_path / "pulse.csv"
    path.write_bytes(content)
    with pytest.raises(SceneError) as caught:
        read_table(hc.PulseTable, path)
    assert str(path) in str(caught.value)
    assert words in str(caught.value)


@pytest.mark.parametrize("name", ["missing.csv", ".", "with\0nul.csv", "x" * 5000])
def test_a_file_that_cannot_be_read_is_an_error(tmp_path: Path, name: str) -> None:
    with pytest.raises(SceneError, match="must be a CSV file"):
        read_table(hc.PulseTable, tmp_path / name)


def test_the_names_of_profiles_are_typed() -> None:
    assert set(get_args(Profile)) == set(TABLE_1) == set(PROFILES)
    assert profile_named("cosine") == "cosine"
    with pytest.raises(SceneError, match=r"^profile = 'square': must be one of cosine, triang"):
        profile_named("square")
