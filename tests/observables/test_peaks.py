"""Peaks of sampled overlaps against bumps with known maxima and against SciPy's dense output."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from hertzchain.arrays import FloatArray
from hertzchain.observables.error_bound import Peaks
from hertzchain.observables.peaks import largest_difference
from hertzchain.observables.samples import DampedLaw, Samples
from hertzchain.observables.watch import PeakWatch

Overlap = Callable[[FloatArray, int], FloatArray]
"""The k-th time derivative of the overlap of each contact at given times."""


def samples_of(
    overlap: Overlap, time: FloatArray, jerk: bool = True, stiffness: float = 1.0
) -> Samples:
    """Samples of a chain whose last granule rests and whose contacts have the given overlaps."""

    def granules(k: int) -> FloatArray:
        rates = overlap(time, k)
        resting = np.zeros((time.size, 1), time.dtype)
        return np.hstack([np.cumsum(rates[:, ::-1], axis=1)[:, ::-1], resting])

    pressed = overlap(time, 0)
    return Samples(
        time=time,
        displacement=granules(0),
        velocity=granules(1),
        acceleration=granules(2),
        overlap=pressed,
        contact_force=stiffness * np.maximum(pressed, 0) ** 1.5,
        jerk=granules(3) if jerk else None,
    )


def watched(*blocks: Samples) -> PeakWatch:
    """Return the watch after successive blocks."""
    contacts = np.ones(blocks[0].overlap.shape[1], blocks[0].time.dtype)
    watch = PeakWatch(DampedLaw.of_elastic(contacts), np.ones(contacts.size + 1))
    for block in blocks:
        watch.update(block)
    return watch


def cosines(height: FloatArray, peak_time: FloatArray) -> Overlap:
    """One cosine for each contact: pressed for a time of pi around its maximum."""
    return lambda time, k: height * np.cos(time[:, None] - peak_time + k * np.pi / 2)


def bumps(height: FloatArray, peak_time: FloatArray, gap: float) -> Overlap:
    """Gaussian bumps, far from each other, of granules that are else apart.

    Parameters
    ----------
    height, peak_time
        Shape (bumps, contacts).
    gap
        Distance without any bump.
    """

    def overlap(time: FloatArray, k: int) -> FloatArray:
        t = time[:, None, None] - peak_time
        hermite = (1.0, -2 * t, 4 * t**2 - 2, -8 * t**3 + 12 * t)[k]
        rates = np.sum((height + gap) * hermite * np.exp(-(t**2)), axis=1)
        return np.asarray(rates - (gap if k == 0 else 0.0))

    return overlap


PHASES = np.linspace(0.0, 1.0, 17)[:-1]
"""Places of the maxima between two samples, as fractions of the interval."""


def cosine_error(h: float, jerk: bool) -> float:
    """Largest relative error of the force of cosines with maxima at all places of an interval."""
    peak_time = 2.0 + h * PHASES
    time = 2.0 + h * np.arange(-3.0, 5.0)
    force = watched(samples_of(cosines(np.ones(16), peak_time), time, jerk)).force
    return float(np.max(np.abs(force - 1.0)))


@pytest.mark.parametrize(("jerk", "constant"), [(False, 1.5 / 46080), (True, 1.5 / 10321920)])
def test_error_vs_the_remainder_of_hermite_interpolation(jerk: bool, constant: float) -> None:
    """In the middle the remainder is (h/2)^q / q! times the q-th derivative, q 6 or 8.

    The force has 3/2 of that.
    """
    h, order = 0.3, 8 if jerk else 6
    # A maximum in the very middle has the largest error; the q-th derivative is 1 within h^2 / 8.
    assert cosine_error(h, jerk) == pytest.approx(constant * h**order, rel=0.02, abs=0)


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 0, 1), (1, 2, 0)])
def test_the_highest_of_several_bumps_wins(order: tuple[int, ...]) -> None:
    height = np.array([[0.4, 1.2], [0.9, 0.2], [0.7, 0.8]])[list(order)]
    peak_time = np.array([[3.013, 3.507], [15.027, 15.522], [27.041, 27.533]])
    watch = watched(samples_of(bumps(height, peak_time, 0.1), np.arange(0.0, 30.0, 0.05)))
    best = height.argmax(axis=0)
    # Remainder (h/2)^8 / 8! times an eighth derivative of 1680: 6e-15, over 0.9.
    assert watch.force == pytest.approx(height.max(axis=0) ** 1.5, rel=2e-14, abs=0)
    assert watch.time == pytest.approx(peak_time[best, [0, 1]], rel=0, abs=1e-12)


@pytest.mark.parametrize("split", [1, 10, 20, 38])
def test_blocks_vs_one_block(split: int) -> None:
    """Wherever the samples are cut, in the middle of a bump too; blocks share their ends."""
    overlap = bumps(np.array([[1.0, 0.5, 0.8]]), np.array([[1.02, 2.03, 2.9]]), 0.1)
    time = np.linspace(0.0, 4.0, 40)
    whole = watched(samples_of(overlap, time))
    parts = watched(samples_of(overlap, time[: split + 1]), samples_of(overlap, time[split:]))
    # All maxima of a block are refined until the last has converged: some take one step more,
    # and the polynomial rounds at 84 times 1e-16.
    assert parts.force == pytest.approx(whole.force, rel=2e-14, abs=0)
    # The place of a maximum is the round-off of the slope, 1e-14, over the curvature in s, 0.02.
    assert parts.time == pytest.approx(whole.time, rel=0, abs=1e-12)


def test_a_contact_that_is_never_pressed_has_no_force_and_no_time() -> None:
    def overlap(time: FloatArray, k: int) -> FloatArray:
        bump = cosines(np.array([1.0]), np.array([1.0]))(time, k)
        apart = bump - (3.0 if k == 0 else 0.0)  # comes closer, does not touch
        return np.hstack([bump, apart])

    watch = watched(samples_of(overlap, np.arange(0.0, 2.0, 0.1)))
    assert watch.force[1] == 0.0
    assert np.isnan(watch.time[1])
    assert watch.force[0] > 0.9


def test_a_contact_still_pressed_harder_at_the_end_has_its_last_sample() -> None:
    time = np.linspace(0.0, 1.0, 11)
    watch = watched(samples_of(cosines(np.array([1.0]), np.array([1.4])), time))
    # One rounding of the power.
    assert watch.force[0] == pytest.approx(math.cos(0.4) ** 1.5, rel=1e-15, abs=0)
    assert watch.time[0] == 1.0


def test_peaks_keep_the_stiffness_of_the_backend() -> None:
    """A wrong stiffness in a backend must show in its peaks, not be corrected by the watch."""
    overlap = cosines(np.array([1.0, 0.2]), np.array([1.03, 1.17]))
    time = np.arange(0.0, 2.5, 0.1)
    right = watched(samples_of(overlap, time))
    wrong = watched(samples_of(overlap, time, stiffness=1.2345))
    # A few roundings.
    assert wrong.force == pytest.approx(1.2345 * right.force, rel=1e-15, abs=0)
    assert np.array_equal(wrong.time, right.time)


# largest_difference


def test_largest_difference_ignores_peaks_below_a_thousandth() -> None:
    expected = np.array([1000.0, 1.0, 0.999, 0.0])
    assert largest_difference(np.array([1000.0, 1.0, 5.0, 7.0]), expected) == 0.0
    assert largest_difference(np.array([1000.0, 1.5, 0.9, 0.0]), expected) == 0.5


def test_largest_difference_refuses_different_numbers_of_contacts() -> None:
    with pytest.raises(ValueError, match=r"\(3,\) and \(2,\)"):
        largest_difference(np.ones(3), np.ones(2))


def polynomials(*of_contacts: np.polynomial.Polynomial) -> Overlap:
    def overlap(time: FloatArray, k: int) -> FloatArray:
        return np.stack([(p.deriv(k) if k else p)(time) for p in of_contacts], axis=1)

    return overlap


def with_turns(slope: float, *turns: float) -> np.polynomial.Polynomial:
    """An overlap of 1 at time 0, whose rate is 0 at the given times."""
    return (slope * np.polynomial.Polynomial.fromroots(turns)).integ() + 1


@pytest.mark.parametrize(
    ("curve", "at", "jerk"),
    [
        (with_turns(1.0, 0.2, 0.95), 0.2, True),
        (with_turns(1.0, 0.2, 0.95), 0.2, False),
        (with_turns(-1.0, 0.05, 0.8), 0.8, True),
    ],
    ids=["rises at both", "rises at both, no jerk", "falls at both"],
)
def test_a_maximum_where_the_rate_has_the_same_sign_at_both_samples(
    curve: np.polynomial.Polynomial, at: float, jerk: bool
) -> None:
    watch = watched(samples_of(polynomials(curve), np.array([0.0, 1.0]), jerk))
    assert curve(at) > max(curve(0.0), curve(1.0))
    assert curve.deriv()(0.0) * curve.deriv()(1.0) > 0
    # The interpolant is the polynomial itself; rounding.
    assert watch.force[0] == pytest.approx(curve(at) ** 1.5, rel=1e-13, abs=0)
    assert watch.time[0] == pytest.approx(at, rel=1e-12, abs=0)


def test_the_higher_of_two_maxima_between_two_samples() -> None:
    first = with_turns(-100.0, 0.2, 0.6, 0.9)
    second = with_turns(-100.0, 0.1, 0.3, 0.8)
    watch = watched(samples_of(polynomials(first, second), np.array([0.0, 1.0])))
    assert watch.force[0] == pytest.approx(first(0.2) ** 1.5, rel=1e-12, abs=0)
    assert watch.force[1] == pytest.approx(second(0.8) ** 1.5, rel=1e-12, abs=0)


def test_a_touch_between_two_samples_of_a_contact_that_was_pressed_before() -> None:
    curve = with_turns(-1.0, 0.3, 1.6) - 0.98
    times = np.array([0.0, 0.5, 2.5, 3.0])
    assert curve(0.0) > 0 > max(curve(0.5), curve(2.5))
    watch = watched(samples_of(polynomials(curve), times, stiffness=7.0))
    assert watch.force[0] == pytest.approx(7 * curve(1.6) ** 1.5, rel=1e-12, abs=0)


@pytest.mark.parametrize(
    ("turns", "times"),
    [((0.5, 1.5, 2.6), np.linspace(0.0, 3.0, 7)), ((0.32, 0.51, 1.05), np.arange(3.0))],
    ids=["", "within one interval"],
)
def test_a_rival_is_the_second_highest_maximum(turns: tuple[float, ...], times: FloatArray) -> None:
    curve, single = with_turns(-3.0, *turns), with_turns(-3.0, 0.5)
    low, high = sorted((curve(turns[0]), curve(turns[2])))
    watch = watched(samples_of(polynomials(curve, single), times))
    assert watch.force[0] == pytest.approx(high**1.5, rel=1e-12, abs=0)
    assert watch.rival.tolist() == [pytest.approx(low**1.5, rel=1e-12, abs=0), 0.0]


def test_contacts_that_still_rise_are_told() -> None:
    rises, falls = np.polynomial.Polynomial([1.0, 1.0]), with_turns(-1.0, 0.5)
    times = np.array([0.0, 1.0])

    def is_rising(*curves: np.polynomial.Polynomial) -> bool:
        watch = watched(samples_of(polynomials(*curves), times))
        return Peaks(watch.force, watch.time, watch.passed).any_rising

    assert is_rising(rises, falls)
    assert not is_rising(falls, falls)
    # Below half a thousandth of the largest force it does not count; above, it does.
    for part, counts in ((4e-4, False), (6e-4, True)):
        little = np.polynomial.Polynomial([0.5, 0.5]) * (part * falls(0.5) ** 1.5) ** (2 / 3)
        assert is_rising(falls, little) == counts


@pytest.mark.parametrize(("part", "counts"), [(0.9e-4, False), (1.1e-4, True)])
def test_maxima_between_two_samples_where_the_force_counts(part: float, counts: bool) -> None:
    """From a ten-thousandth of the largest force on; below, a front seems to have some."""
    several = with_turns(-100.0, 0.2, 0.6, 0.9)
    little = several * (part ** (2 / 3) / several(0.2))
    curves = polynomials(np.polynomial.Polynomial([1.0]), little)
    watch = watched(samples_of(curves, np.array([0.0, 1.0])))
    expected = little(0.2) if counts else little(1.0)
    assert little(0.2) > 1.2 * little(1.0) > little(0.0)
    assert watch.force[1] == pytest.approx(expected**1.5, rel=1e-12, abs=0)
