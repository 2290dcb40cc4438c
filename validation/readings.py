"""Readings of the paper's misprints and open points, on simulated peaks in units of F0.

The first of each is that of hertzchain.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.integrate import quad

import hertzchain as hc
from hertzchain import theory
from hertzchain.arrays import FloatArray
from hertzchain.observables.wave import SMALLEST, STEADY
from validation.claims import far_field, first_within
from validation.shipped import eq3, pulse_of


@dataclass(frozen=True, eq=False)
class Simulated:
    """A scene of Tables 2 to 4 with its peaks by one backend, forces in F0."""

    scene: hc.Scene
    peak_force: FloatArray  # of contacts 2 ... N, shape (N - 1,)
    p: int  # by hertzchain's criterion

    @property
    def pulse(self) -> hc.Pulse:
        """Profile, F0 and n."""
        return pulse_of(self.scene)[0]

    @property
    def after(self) -> float:
        """The peak of contact p + 1."""
        return float(self.peak_force[self.p - 1])

    @property
    def far(self) -> float:
        """The last peak that the free end does not touch."""
        return far_field(self.peak_force)

    def eq3(self, wave_force: float) -> float:
        """Eq. 3, with V_SW of a wave of this height, in F0."""
        return eq3(self.scene, wave_force * self.pulse.peak_force)


def simulated(result: hc.Result) -> Simulated:
    """Return the needed part of a result; the transition of each of these scenes ends."""
    p = result.transition_granules
    assert p is not None
    return Simulated(result.scene, result.peak_force / result.scene.units.force, p)


# Criteria for p (not defined in the paper)

Criterion = Callable[[FloatArray], int]
"""A criterion: from F_2 ... F_N to p."""


def by_changes(
    threshold: float = STEADY, every: bool = True, floor: int = SMALLEST, of_first: bool = False
) -> Criterion:
    """The change from a peak to the next is below a threshold, a fraction of the second of the two.

    With ``every`` all later changes have to be, too; p is at least ``floor``; ``of_first`` takes a
    fraction of the first of the two.
    """

    def p(peak_force: FloatArray) -> int:
        before, after = peak_force[:-2], peak_force[1:-1]
        steady = np.abs(after - before) / (before if of_first else after) < threshold
        contact = np.arange(2, steady.size + 2)
        if every:
            unsteady = contact[~steady]
            return max(floor, int(unsteady[-1]) + 1 if unsteady.size else 2)
        allowed = contact[steady & (contact >= floor)]
        return int(allowed[0])

    return p


def by_far_field(threshold: float = STEADY) -> Criterion:
    """All later peaks are within a threshold of the far field."""

    def p(peak_force: FloatArray) -> int:
        return max(SMALLEST, first_within(peak_force, threshold))

    return p


CRITERIA: dict[str, Criterion] = {
    "every change below 1 % of F_{k+1}, at least 5": by_changes(),
    "first change below 1 %, at least 5": by_changes(every=False),
    "every change below 1 % of F_k": by_changes(of_first=True),
    "every change below 1 %, no floor": by_changes(floor=2),
    "every change below 0.5 %": by_changes(0.005),
    "every change below 0.9 %": by_changes(0.009),
    "every change below 1.1 %": by_changes(0.011),
    "every change below 2 %": by_changes(0.02),
    "within 1 % of the far field": by_far_field(),
    "within 2 % of the far field": by_far_field(0.02),
    "within 5 % of the far field": by_far_field(0.05),
}
"""The first is that of hertzchain."""


# Exponents of Eq. 6

PeakForce = Callable[[FloatArray, float, float, float, float], FloatArray]
"""Takes contacts, p, F_SW, n and the ratio."""


def _eq6(divisor: Callable[[FloatArray, float], FloatArray | float]) -> PeakForce:
    """Exponent 15 (i - p) / (8 sqrt(n) divisor)."""

    def formula(contact: FloatArray, p: float, wave: float, n: float, ratio: float) -> FloatArray:
        exponent = 15 * (contact - p) / (8 * math.sqrt(n) * divisor(contact, p))
        return np.asarray(wave * ratio**exponent)

    return formula


def corrected_peak_force(
    contact: FloatArray, p: float, wave: float, n: float, ratio: float
) -> FloatArray:
    """Return Eq. 6 as used here; p need not be whole, so that p of Eq. 3 can be tried."""
    return _eq6(lambda i, p: i * p)(contact, p, wave, n, ratio)


EXPONENTS: dict[str, PeakForce] = {
    "15 (i - p) / (8 i p sqrt(n))": corrected_peak_force,
    "printed: 15 (i - p) / (8 sqrt(n p))": _eq6(lambda _, p: math.sqrt(p)),
    "15 (i - p) / (8 i sqrt(n p))": _eq6(lambda i, p: i * math.sqrt(p)),
    "15 (i - p) / (8 p sqrt(n))": _eq6(lambda _, p: p),
    "15 (i - p) / (8 i^2 sqrt(n))": _eq6(lambda i, _: i * i),
}


# Readings of Delta L


def ejected(
    case: Simulated, start: float, end: float, times: float = 2.0, rise_time: float | None = None
) -> float:
    """Integral of a pulse's force from start to end [s], times a factor, over L_Applied(t0_hat).

    The rise time of the pulse is t0_hat by default [s].
    """
    unit = theory.unit_rise_time(case.scene.chain, case.pulse)
    rise_time = unit if rise_time is None else rise_time

    def force(time: float) -> float:
        return float(theory.applied_force(time * unit, case.pulse, rise_time))

    begin, stop = start / unit, end / unit
    corners = [x for x in (rise_time / unit, case.pulse.duration_ratio * rise_time / unit)
               if begin < x < stop]  # fmt: skip
    area = quad(force, begin, stop, points=corners or None, epsabs=1e-10)[0]
    return float(times * area * unit / theory.applied_momentum(case.pulse, unit))


def delta_l(case: Simulated) -> dict[str, float]:
    """Delta L over L_Applied(t0_hat), read in several ways; for LM_ratio below 1."""
    unit = theory.unit_rise_time(case.scene.chain, case.pulse)
    rise_time, n = pulse_of(case.scene)[1], case.pulse.duration_ratio
    less, end = unit - rise_time, n * unit
    return {
        "twice the last t0_hat - t0 of the pulse of t0_hat": ejected(case, end - less, end),
        "the same, not doubled": ejected(case, end - less, end, 1.0),
        "twice the last n (t0_hat - t0) of it": ejected(case, end - n * less, end),
        "twice the first t0_hat - t0 of it": ejected(case, 0, less),
        "twice the last t0_hat - t0 of the pulse of t0": ejected(
            case, max(n * rise_time - less, 0.0), n * rise_time, rise_time=rise_time
        ),
        "none": 0.0,
    }
