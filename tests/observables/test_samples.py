"""What is read off samples: peaks, energy, impulses and histories, against known motions."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.polynomial import Polynomial
from scipy.integrate import quad

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.errors import SceneError, TooExpensive
from hertzchain.observables.error_bound import Peaks
from hertzchain.observables.observer import curvature_at, curve_of, slope_at, value_at
from hertzchain.observables.peaks import largest_difference
from hertzchain.observables.samples import (
    MOST_FRAMES,
    DampedLaw,
    History,
    Recorder,
    Samples,
    true_forces,
    wanted_times,
)
from hertzchain.observables.watch import PeakWatch
from hertzchain.scene.schedule import Leg
from tests.conftest import paper_scene
from tests.oracles.first_pulses import Trace

Motion = Callable[[FloatArray, int], FloatArray]
"""The k-th time derivative of each displacement, or overlap, at given times, shape (times, ...)."""


def of_granules(moves: Motion, time: FloatArray, jerk: bool = True) -> Samples:
    """Samples of granules whose contacts have k = 1."""
    u, v, a, growth = (moves(time, k) for k in range(4))
    overlap = u[:, :-1] - u[:, 1:]
    force = np.maximum(overlap, 0.0) ** 1.5
    return Samples(time, u, v, a, overlap, force, growth if jerk else None)


def of_contacts(
    overlap: Motion, time: FloatArray, jerk: bool = True, force: FloatArray | None = None
) -> Samples:
    """Samples of a chain whose last granule rests and whose contacts have the given overlaps."""

    def moves(time: FloatArray, k: int) -> FloatArray:
        rates = overlap(time, k)
        resting = np.zeros((time.size, 1))
        return np.hstack([np.cumsum(rates[:, ::-1], axis=1)[:, ::-1], resting])

    samples, pressed = of_granules(moves, time, jerk), overlap(time, 0)
    force = np.maximum(pressed, 0) ** 1.5 if force is None else force
    return replace(samples, overlap=pressed, contact_force=force)


def watched(*blocks: Samples, law: DampedLaw | None = None, **how: Any) -> PeakWatch:
    """Return the watch after successive blocks."""
    contacts = blocks[0].overlap.shape[1]
    law = law or DampedLaw.of_elastic(np.ones(contacts))
    watch = PeakWatch(law, np.ones(contacts + 1), **how)
    for block in blocks:
        watch.update(block)
    return watch


def cosines(height: Any, peak_time: Any) -> Motion:
    """One cosine for each contact: pressed for a time of pi around its maximum."""
    return lambda time, k: height * np.cos(time[:, None] - peak_time + k * np.pi / 2)


def bumps(height: Any, peak_time: Any, gap: float = 0.1) -> Motion:
    """Gaussian bumps, (bumps, contacts), of granules that are else apart by a gap."""

    def overlap(time: FloatArray, k: int) -> FloatArray:
        t = time[:, None, None] - np.array(peak_time)
        hermite = (1.0, -2 * t, 4 * t**2 - 2, -8 * t**3 + 12 * t)[k]
        rates = np.sum((np.array(height) + gap) * hermite * np.exp(-(t**2)), axis=1)
        return np.asarray(rates - (gap if k == 0 else 0.0))

    return overlap


def polynomials(*of_contacts: Polynomial) -> Motion:
    """One polynomial for each contact."""
    return lambda time, k: np.stack([(p.deriv(k) if k else p)(time) for p in of_contacts], axis=1)


def with_turns(slope: float, *turns: float) -> Polynomial:
    """An overlap of 1 at time 0, whose rate is 0 at the given times."""
    return (slope * Polynomial.fromroots(turns)).integ() + 1


numbers = st.floats(-1.0, 1.0)


@pytest.mark.parametrize("m", [2, 3])
@given(data=st.data(), start=numbers, h=st.floats(0.1, 2.0))
@settings(max_examples=50)
def test_polynomials_up_to_degree_2m_plus_1_are_met(
    m: int, data: st.DataObject, start: float, h: float
) -> None:
    terms = data.draw(st.lists(numbers, min_size=2 * m + 2, max_size=2 * m + 2))
    polynomial = Polynomial(terms)
    ends = [np.full(4, np.nan) for _ in range(2)]
    for values, time in zip(ends, (start, start + h), strict=True):
        values[: m + 1] = [polynomial(time), *(polynomial.deriv(k)(time) for k in range(1, m + 1))]
    curve = curve_of(*(tuple(values.tolist()) for values in ends), h)
    # Values and scaled derivatives go up to 1e5 (degree 7 at t = 3, third derivative times 2^3),
    # and the basis has coefficients up to 84.
    largest = np.abs(Polynomial(np.abs(terms))(abs(start) + h)) + 1
    tolerance = 1e-13 * (1 + h) ** m * math.factorial(2 * m + 1) * largest
    for s in np.linspace(0.0, 1.0, 21).tolist():
        slope, curvature = (polynomial.deriv(k)(start + s * h) * h**k for k in (1, 2))
        expected = polynomial(start + s * h), slope, curvature
        ours = value_at(curve, s), slope_at(curve, s), curvature_at(curve, s)
        assert ours == pytest.approx(expected, rel=0, abs=42 * tolerance)


# Peaks


@pytest.mark.parametrize(("jerk", "constant"), [(False, 1.5 / 46080), (True, 1.5 / 10321920)])
def test_error_vs_the_remainder_of_hermite_interpolation(jerk: bool, constant: float) -> None:
    """In the middle the remainder is (h/2)^q / q! times the q-th derivative, q 6 or 8.

    The force has 3/2 of that. A maximum in the very middle has the largest error; the q-th
    derivative is 1 within h^2 / 8.
    """
    h, places = 0.3, np.linspace(0.0, 1.0, 17)[:-1]
    time = 2.0 + h * np.arange(-3.0, 5.0)
    force = watched(of_contacts(cosines(np.ones(16), 2.0 + h * places), time, jerk)).force
    largest = np.max(np.abs(force - 1.0))
    assert largest == pytest.approx(constant * h ** (8 if jerk else 6), rel=0.02, abs=0)


ENDS, DENSE = np.array([0.0, 1.0]), np.arange(0.0, 30.0, 0.05)
TWICE = with_turns(-1.0, 0.3, 1.6) - 0.98
RISES, FALLS = with_turns(1.0, 0.2, 0.95), with_turns(-1.0, 0.05, 0.8)
THRICE = with_turns(-100.0, 0.2, 0.6, 0.9), with_turns(-100.0, 0.1, 0.3, 0.8)
HEIGHTS = np.array([[0.4, 1.2], [0.9, 0.2], [0.7, 0.8]])
AT = np.array([[3.013, 3.507], [15.027, 15.522], [27.041, 27.533]])
LITTLE = [THRICE[0] * (part ** (2 / 3) / THRICE[0](0.2)) for part in (0.9e-4, 1.1e-4)]
CURVES: dict[str, tuple[Motion, FloatArray, list[float], list[float]]] = {
    # overlaps; times of samples; the largest overlap of each contact, and when.
    **{
        f"the highest of bumps, {order}": (
            bumps(HEIGHTS[list(order)], AT), DENSE, [0.9, 1.2], [AT[order.index(1), 0],
            AT[order.index(0), 1]],
        )
        for order in ((0, 1, 2), (2, 0, 1), (1, 2, 0))
    },
    "rises at both samples": (polynomials(RISES), ENDS, [RISES(0.2)], [0.2]),
    "falls at both samples": (polynomials(FALLS), ENDS, [FALLS(0.8)], [0.8]),
    "two maxima between samples": (
        polynomials(*THRICE), ENDS, [THRICE[0](0.2), THRICE[1](0.8)], [0.2, 0.8]
    ),
    "a touch between samples": (
        polynomials(TWICE), np.array([0.0, 0.5, 2.5, 3.0]), [TWICE(1.6)], [1.6]
    ),
    "still rising at the end": (
        cosines(1.0, [1.4]), np.linspace(0.0, 1.0, 11), [math.cos(0.4)], [1.0]
    ),
    "never pressed": (
        polynomials(Polynomial([-2.0, 1.0, -1.0])), np.linspace(0, 2, 9), [0.0], [math.nan]
    ),
    # From a ten-thousandth of the largest force on; below, a front seems to have maxima.
    "too little to count": (
        polynomials(Polynomial([1.0]), LITTLE[0]), ENDS, [1.0, LITTLE[0](1.0)], [0.0, 1.0]
    ),
    "enough to count": (
        polynomials(Polynomial([1.0]), LITTLE[1]), ENDS, [1.0, LITTLE[1](0.2)], [0.0, 0.2]
    ),
}  # fmt: skip
"""All are met by the polynomial between samples, or all but met."""


@pytest.mark.parametrize("name", CURVES)
@pytest.mark.parametrize("stiffness", [1.0, 1.2345])
def test_peaks_of_known_curves(name: str, stiffness: float) -> None:
    """Also with another stiffness than the law: that of a code must show in its peaks."""
    overlap, time, most, when = CURVES[name]
    samples = of_contacts(overlap, time)
    samples = replace(samples, contact_force=stiffness * samples.contact_force)
    watch = watched(samples)
    # Remainder of a bump (h/2)^8 / 8! times an eighth derivative of 1680; rounding of the others.
    expected = stiffness * np.array(most) ** 1.5
    assert watch.force == pytest.approx(expected, rel=1e-12, abs=0)
    assert watch.time == pytest.approx(when, rel=0, abs=1e-11, nan_ok=True)
    # All maxima of a block are refined until the last has converged: some take one step more, and
    # the polynomial rounds at 84 times 1e-16.
    for split in {1, time.size // 2} - {time.size - 1}:
        parts = watched(*_cut(samples, split))
        assert parts.force == pytest.approx(watch.force, rel=2e-14, abs=0)
        assert parts.time == pytest.approx(watch.time, rel=0, abs=1e-12, nan_ok=True)


def _cut(samples: Samples, split: int) -> list[Samples]:
    """Two blocks; the first sample of the second is the last of the first."""
    parts = slice(None, split + 1), slice(split, None)
    values: dict[str, Any] = {field.name: getattr(samples, field.name) for field in fields(samples)}
    columns = {name: each for name, each in values.items() if each is not None}
    return [
        replace(samples, **{name: each[part] for name, each in columns.items()}) for part in parts
    ]


@pytest.mark.parametrize(
    ("turns", "times"),
    [((0.5, 1.5, 2.6), np.linspace(0.0, 3.0, 7)), ((0.32, 0.51, 1.05), np.arange(3.0))],
    ids=["", "within one interval"],
)
def test_a_rival_is_the_second_highest_maximum(turns: tuple[float, ...], times: FloatArray) -> None:
    curve, single = with_turns(-3.0, *turns), with_turns(-3.0, 0.5)
    low, high = sorted((curve(turns[0]), curve(turns[2])))
    watch = watched(of_contacts(polynomials(curve, single), times))
    assert watch.force[0] == pytest.approx(high**1.5, rel=1e-12, abs=0)
    assert watch.rival.tolist() == [pytest.approx(low**1.5, rel=1e-12, abs=0), 0.0]


def test_contacts_that_still_rise_are_told() -> None:
    rises, falls = Polynomial([1.0, 1.0]), with_turns(-1.0, 0.5)

    def is_rising(*curves: Polynomial) -> bool:
        watch = watched(of_contacts(polynomials(*curves), ENDS))
        return Peaks(watch.force, watch.time, watch.passed).any_rising

    assert is_rising(rises, falls)
    assert not is_rising(falls, falls)
    # Below half a thousandth of the largest force it does not count; above, it does.
    for part, counts in ((4e-4, False), (6e-4, True)):
        little = Polynomial([0.5, 0.5]) * (part * falls(0.5) ** 1.5) ** (2 / 3)
        assert is_rising(falls, little) == counts


def test_largest_difference_ignores_peaks_below_a_thousandth() -> None:
    expected = np.array([1000.0, 1.0, 0.999, 0.0])
    assert largest_difference(np.array([1000.0, 1.0, 5.0, 7.0]), expected) == 0.0
    assert largest_difference(np.array([1000.0, 1.5, 0.9, 0.0]), expected) == 0.5
    with pytest.raises(ValueError, match=r"\(3,\) and \(2,\)"):
        largest_difference(np.ones(3), np.ones(2))


# Damped contacts, energy and impulses


LEG = Leg(1.0, 1.3, 3, None)
TIME = np.array([1.0, 1.1, 1.2, 1.3])
CLOSES_AND_OPENS = np.array(
    [[0.2, 0.5, 0.4, 0.1], [3.0, 0.5, -1.0, -4.0], [-9.0, -20.0, -25.0, -30.0], [0.0] * 4]
)


@pytest.mark.parametrize("attraction", [True, False])
@pytest.mark.parametrize("exponent", [0.0, 0.25, 0.5])
def test_forces_become_those_of_the_velocities_of_their_time(
    exponent: float, attraction: bool
) -> None:
    """At the start of a leg they are, as forces are computed again there."""
    damped = DampedLaw(np.array([7.0]), np.array([0.6]), exponent, attraction)
    overlap, rate, growth, _ = CLOSES_AND_OPENS[:, :, np.newaxis]
    half = np.where(LEG.start < TIME, LEG.dt / 2, 0.0)[:, np.newaxis]
    given = damped.force(overlap, rate - half * growth)
    samples = of_contacts(lambda _, k: CLOSES_AND_OPENS[k][:, np.newaxis], TIME, force=given)
    force = true_forces(samples, damped, LEG).contact_force
    np.testing.assert_allclose(force, damped.force(overlap, rate), rtol=1e-14, atol=1e-14)
    assert force[0] == given[0]
    assert np.all(force[1:3] != given[1:3])
    # In a softer code the change is the law's own, of the full stiffness; what may not pull does
    # not.
    softer = 0.1 * damped.force(overlap, 0 * overlap)
    felt = damped.with_rate(softer, overlap, 0 * overlap, -4.0 + 0 * overlap)
    assert bool(np.any(felt < 0)) is attraction


@pytest.mark.parametrize("interval", [0.3, 1.0])
@pytest.mark.parametrize("offset", [0.0, 0.1, 0.5, 0.9])
def test_a_force_that_decays_faster_than_samples_come(interval: float, offset: float) -> None:
    """A sphere of mass 1 and speed 2 flies at a heavy one: the dashpot presses hardest at once."""
    damping, speed = 5.0, 2.0
    time = interval * (np.arange(4.0) - 1 - offset)
    later, pressed = np.maximum(time, 0.0), (time > 0) * 1.0
    decay = np.exp(-damping * later)
    velocity = np.where(time < 0, speed, speed * decay)
    place = np.where(time < 0, speed * time, speed * (1 - decay) / damping)
    moves = np.array([place, velocity, -damping * velocity * pressed, 0 * place])
    force = (damping * velocity * pressed)[:, np.newaxis]
    law = DampedLaw(np.array([1e-99]), np.array([damping]), 0.0, attraction=False)
    watch = PeakWatch(law, np.array([1.0, 0.0]))
    watch.update(of_contacts(lambda _, k: moves[k][:, np.newaxis], time, False, force))
    assert watch.force[0] == pytest.approx(damping * speed, rel=1e-12, abs=0)
    assert abs(watch.time[0]) < 1e-12
    assert watch.reading_error < 0.3  # the quintic right after the jump overshoots, not the force
    # All kinetic energy is lost; the nodes of the integral do not resolve the decay fully.
    assert watch.dissipated == pytest.approx(speed**2 / 2, rel=0.1)


def test_the_impulse_of_a_contact_that_only_pulls() -> None:
    """An overlap that shrinks at a steady rate under a dashpot stronger than the contact."""
    law = DampedLaw(np.array([1.0]), np.array([10.0]), 0.0, attraction=True)
    time = np.linspace(0.0, 2.0, 6)
    shrinks = polynomials(Polynomial([1.0, -0.2]))
    samples = of_contacts(shrinks, time, False, law.force(shrinks(time, 0), shrinks(time, 1)))
    watch = watched(samples, law=law, on_held=[1])
    # Integral of (1 - t / 5)^(3/2) - 2 from 0 to 2.
    assert watch.wall_impulse == pytest.approx(2 * (1 - 0.6**2.5) - 4, rel=1e-12, abs=0)
    assert watch.dissipated == pytest.approx(10 * 0.2**2 * 2, rel=1e-12, abs=0)
    assert watch.force[0] == 0


@pytest.mark.parametrize("exponent", [0.25, 0.5])
def test_the_energy_lost_from_a_touch_on(exponent: float) -> None:
    """An overlap of exactly 0 at the start, as of a striker that touches: sin(t), to its end."""
    law = DampedLaw(np.array([1.0]), np.array([1.0]), exponent, attraction=True)
    time = np.linspace(0.0, np.pi, 13)
    motion = cosines(1.0, np.pi / 2)
    touches = motion(time, 0)
    touches[0] = touches[-1] = 0.0
    samples = of_contacts(
        lambda time, k: motion(time, k) if k else touches, time, False,
        law.force(touches, motion(time, 1)),
    )  # fmt: skip
    exact = quad(lambda t: np.sin(t) ** exponent * np.cos(t) ** 2, 0.0, np.pi)[0]
    assert watched(samples, law=law).dissipated == pytest.approx(exact, rel=1e-5, abs=0)


@pytest.mark.parametrize("samples", [11, 12, 17, 31])
def test_impulse_of_a_bounce_off_a_wall(samples: int) -> None:
    """The wall is touched from 0.37 to 2.37, which are not times of samples."""
    bounces = polynomials(1 - Polynomial([-1.37, 1.0]) ** 2)
    watch = watched(of_contacts(bounces, np.linspace(0.0, 3.0, samples)), on_held=[1])
    # Integral of (1 - s^2)^(3/2) from -1 to 1. An opening just outside an interval leaves most:
    # 9e-7 of the whole.
    assert watch.wall_impulse == pytest.approx(3 * math.pi / 8, rel=1.5e-6, abs=0)


# Histories


@pytest.mark.parametrize(("jerk", "tolerance"), [(False, 2e-9), (True, 3e-12)])
def test_a_history_vs_analytic_motion(jerk: bool, tolerance: float) -> None:
    """In one block, or cut anywhere; forces have the stiffness of the samples."""

    def motion(time: FloatArray, k: int) -> FloatArray:
        return np.asarray(np.sin(time[:, None] + np.array([0.0, 0.4, 1.1]) + k * np.pi / 2))

    samples = of_granules(motion, np.linspace(0.0, 4.0, 41), jerk)
    samples = replace(samples, contact_force=7.0 * samples.contact_force)
    wanted = np.linspace(0.0, 4.0, 173)
    right = of_granules(motion, wanted)
    for blocks in ([samples], *(_cut(samples, split) for split in (1, 13, 39) if jerk)):
        recorder = Recorder(wanted, 3)
        for block in blocks:
            recorder.update(block, watched(block).signals)
        history = recorder.history(wanted)
        # The remainder of the velocity at h = 0.1 is h^5 / 1e4 or h^7 / 2e6; roundings of the
        # basis, up to 84, over h leave 1e-12.
        assert history.displacement == pytest.approx(right.displacement, rel=0, abs=tolerance)
        assert history.velocity == pytest.approx(right.velocity, rel=0, abs=tolerance)
        # 3/2 * 7 * overlap^(1/2) times the remainder of the overlap, 1e-14, or 1e-10.
        force = pytest.approx(7.0 * right.contact_force, rel=0, abs=tolerance)
        assert history.contact_force == force
    assert 0 == np.min(right.contact_force) < 1 < np.max(7 * right.contact_force)


@pytest.mark.parametrize(
    "record",
    [[], [0.2, 0.1], [-1e-9, 0.5], [0.5, 1.0000001], [0.1, math.nan], [[0.1, 0.2]], ["soon"]],
)
def test_impossible_times_are_refused(record: list[Any]) -> None:
    with pytest.raises(SceneError, match=r"record.*must be increasing times from 0 to the end"):
        wanted_times(record, 1.0)
    assert wanted_times([0, 0.5, 1.0], 1.0).tolist() == [0.0, 0.5, 1.0]
    assert wanted_times(0.25, 1.0).tolist() == [0.25]


def test_a_whole_number_is_so_many_frames_from_0_to_the_end() -> None:
    for count in (2, np.int32(5), MOST_FRAMES):
        time = wanted_times(count, 3.0)
        np.testing.assert_allclose(time, np.linspace(0.0, 3.0, count), rtol=1e-15)
    for count in (-1, 1, MOST_FRAMES + 1):
        with pytest.raises(SceneError, match=r"must be from 2 to 1,000,000 frames, or incr"):
            wanted_times(count, 1.0)


def test_a_history_that_does_not_fit_into_memory_is_refused() -> None:
    """As empty arrays it would be there, and fill the memory as the run goes on."""
    granules = 10**9  # 2.4e10 bytes for each time
    with pytest.raises(TooExpensive, match="GB of memory"):
        Recorder(np.arange(1000.0), granules)


SCENE = paper_scene("cosine-triangular", 1.3, 2.5, granules=6)


@pytest.fixture(scope="module")
def scipy_history() -> History:
    """A chain of six by SciPy's DOP853, in SI units."""
    trace, time = Trace(SCENE), np.linspace(0.0, SCENE.end_time, 201)
    states = trace.states(time)
    return History(time, states[:6].T, states[6:].T, trace.force(states).T)


@pytest.mark.parametrize(
    ("backend", "tolerance"),
    [
        # SciPy's own error; the septic of the velocity has a remainder of h^7 / 2e6 = 1e-15.
        (hc.Native("reference"), 1e-10),
        # A step across an opening contact leaves r'^(3/2) h^(5/2) = 2e-5 times a small factor; the
        # displacements of what is thrown back keep that. Measured 7e-8.
        (hc.Native("rk4"), 2e-7),
        # Velocity Verlet at 0.005 units: about dt^2 / 2 = 1.3e-5.
        pytest.param(hc.Lammps(dt=0.005 * SCENE.units.time), 2e-5, marks=pytest.mark.lammps),
    ],
)
def test_a_history_vs_scipy(
    scipy_history: History, backend: hc.Native | hc.Lammps, tolerance: float
) -> None:
    history = backend.run(SCENE, record=scipy_history.time).history
    assert np.array_equal(history.time, scipy_history.time)
    for name in ("displacement", "velocity", "contact_force"):
        values, expected = getattr(history, name), getattr(scipy_history, name)
        assert np.abs(values - expected).max() < tolerance * np.abs(expected).max(), name


@pytest.mark.parametrize("rise_times", np.linspace(0.5, 3.0, 26))
def test_the_end_of_a_native_run_can_be_recorded(rise_times: float) -> None:
    """Among so many ends some are a rounding after their last sample."""
    scene = paper_scene("triangular", 1.0, 2.0, granules=3)
    assert scene.rise_time is not None
    scene = replace(scene, run=hc.Run(float(rise_times) * scene.rise_time))
    native = hc.Native("srkn-11b", dt=0.05 * scene.units.time)
    result = native.run(scene, record=[0.0, scene.end_time])
    assert result.history is not None
    # The last sample is the end of the run, but for roundings: of the basis, up to 35, times
    # displacements of 8 units, and over steps of 0.05 for the velocity.
    displacement = result.history.displacement[-1] - result.displacement
    velocity = result.history.velocity[-1] - result.velocity
    assert np.abs(displacement).max() < 1e-13 * scene.units.length
    assert np.abs(velocity).max() < 2e-12 * scene.units.velocity


def test_force_over_time_is_that_of_the_contact() -> None:
    """By the paper's numbers; peaks of neighbours differ by a hundredth and more."""
    filmed = hc.Native().run(SCENE, record=2000)
    for contact in range(2, 7):
        force = filmed.force_at(contact)
        assert force.shape == (2000,)
        # Frames lie 0.0094 natural time units apart: maxima between them are higher by 2e-5.
        assert force.max() == pytest.approx(filmed.peak_force[contact - 2], rel=5e-5)
        at = filmed.history.time[np.argmax(force)]
        assert at == pytest.approx(filmed.peak_time[contact - 2], abs=filmed.history.time[1])
    for wrong in (-2, 1, 7, 2.5, "2"):
        with pytest.raises(SceneError, match=r"contact.*must be a whole number from 2 to 6"):
            filmed.force_at(wrong)  # type: ignore[arg-type]
    with pytest.raises(SceneError, match="run with record = a number of frames, or times"):
        hc.Native().run(SCENE).force_at(2)
