"""The numbered equations of the paper, as corrected.

M. A. Hasan and S. Nemat-Nasser, "Growth of shock-induced solitary waves in granular crystals".
Equations 1 to 9 in their order, SI units unless a function says otherwise. Where the scan or the
paper is wrong, the docstring says what is printed and what is used instead.

The paper takes F_SW, the height of the wave, from its reference 22. Here it is an argument, as is
the number p of granules in the transition: both come from a simulation. p is defined in
hertzchain.observables.wave; F_SW is the peak of contact p + 1.

Arguments of one name are the same in all functions:

====================== ===========================================================================
chain, pulse           the granules; profile, F0 and n
rise_time              t0 [s]
contact, p             number i of a contact, from 2 to p or p + 1; granules in the transition
duration_ratio, ratio  n of Table 1; LM_ratio
wave_force             F_SW, as second_force (F_2) in the unit of the result, where no unit is given
====================== ===========================================================================

Contacts, forces and times may be arrays, which are broadcast against one another.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hertzchain.arrays import FloatArray
from hertzchain.contact import hertz
from hertzchain.errors import SceneError, require
from hertzchain.scene.chain import PAPER_MOMENTUM, Chain
from hertzchain.scene.keys import Count, Positive
from hertzchain.scene.shocks import PROFILES, Pulse

__all__ = [
    "acceleration", "applied_force", "applied_momentum", "contact_force",
    "effective_momentum_ratio", "ejection_momentum", "granule_velocity", "momentum_ratio",
    "normalized_contact", "normalized_peak_force", "outside_range", "passed_momentum",
    "peak_force", "peak_force_cubic", "peak_force_fit", "peak_shift", "solitary_wave_momentum",
    "solitary_wave_speed", "transition_granules", "unit_rise_time", "wave_momentum",
    "wave_profile",
]  # fmt: skip

SHIFT = 1.077  # peak-to-peak time shift of a solitary wave of height 1 (Eq. 4b)
FORCE_INTEGRAL = 1.543  # integral of S^(3/2) (Eq. 5)
WAVE_MOMENTUM = 53 / 32  # momentum of a solitary wave of height 1 (Eq. 5)
SPEED = 7 / 10  # coefficient of V_SW (section 4.1.1)


def outside_range(momentum_ratio: Positive, duration_ratio: Positive) -> str | None:
    """Return why a scene lies outside the range of the paper; None inside it."""
    if duration_ratio < 2:
        return "the paper's conditions on the profile need n of at least 2"
    if not (0.3 <= momentum_ratio <= 2.5 and duration_ratio <= 10):
        return "the paper's tables have LM_ratio 0.3 to 2.5 and n 2 to 10"
    return None


def acceleration(displacement: ArrayLike, applied_force: float, chain: Chain) -> FloatArray:
    """Eq. 1: acceleration of each granule [m/s^2], for u [m] and F(t) on the first granule [N].

    ``displacement`` and the result have the shape (granules,). The scan has E under the root of the
    contact stiffness; used here is sqrt(2R) E / (3 (1 - nu^2)).
    """
    u = np.asarray(displacement, np.float64)
    allowed = f"must be {chain.granules}, one for each granule"
    require(u.shape == (chain.granules,), "number of displacements", u.size, allowed)
    contact = hertz.force_of(chain.contact_stiffness, u[:-1] - u[1:])
    pushed = np.concatenate([[applied_force], contact])
    return np.asarray((pushed - np.concatenate([contact, [0.0]])) / chain.granule_mass)


def applied_force(time: ArrayLike, pulse: Pulse, rise_time: Positive) -> FloatArray:
    """Eq. 2 with Table 1: the force on the first granule [N] at times t [s], of any shape."""
    t, n = np.asarray(time, np.float64) / rise_time, pulse.duration_ratio
    rise, decay = PROFILES[pulse.profile]
    if not {rise, decay} <= {"linear", "cosine"}:
        allowed = "has a ramp that Table 1 does not have"
        raise SceneError("profile", pulse.profile, allowed)
    rising = {"linear": t, "cosine": (1 - np.cos(np.pi * t)) / 2}[rise]
    falling = {
        "linear": (n - t) / (n - 1),
        "cosine": (1 - np.cos(np.pi * (t + n - 2) / (n - 1))) / 2,
    }[decay]
    shape = np.where(t <= 1, rising, falling)
    return pulse.peak_force * np.where((t >= 0) & (t <= n), shape, 0.0)


def applied_momentum(pulse: Pulse, rise_time: Positive) -> float:
    """L_Applied(t0) [N s] (section 4.1); each profile of Table 1 has the area F0 n t0 / 2."""
    return pulse.peak_force * pulse.duration_ratio * rise_time / 2


def solitary_wave_momentum(chain: Chain, peak_force: Positive) -> float:
    """L_SW [N s]: momentum of a solitary wave of the given height [N] (section 4.1)."""
    chain.require_uniform("L_SW")
    nu, modulus = chain.poisson_ratio, chain.young_modulus
    inside = (1 - nu**2) * chain.radius**4 * chain.density**1.5 / modulus
    return PAPER_MOMENTUM * math.cbrt(inside) * math.pow(peak_force, 5 / 6)


def unit_rise_time(chain: Chain, pulse: Pulse) -> float:
    """t0_hat [s]: rise time with which L_Applied = L_SW(F0), for given n and F0 (section 4.1)."""
    momentum = solitary_wave_momentum(chain, pulse.peak_force)
    return 2 * momentum / (pulse.duration_ratio * pulse.peak_force)


def momentum_ratio(chain: Chain, pulse: Pulse, rise_time: Positive) -> float:
    """LM_ratio = L_Applied(t0) / L_Applied(t0_hat) (section 4.1)."""
    unit = unit_rise_time(chain, pulse)
    return applied_momentum(pulse, rise_time) / applied_momentum(pulse, unit)


def solitary_wave_speed(chain: Chain, peak_force: Positive) -> float:
    """V_SW [m/s] of a solitary wave of the given height [N] (section 4.1.1)."""
    chain.require_uniform("V_SW")
    nu, modulus = chain.poisson_ratio, chain.young_modulus
    inside = modulus / (chain.radius * (1 - nu**2) * chain.density**1.5)
    return SPEED * math.cbrt(inside) * math.pow(peak_force, 1 / 6)


def transition_granules(
    chain: Chain, pulse: Pulse, rise_time: Positive, wave_force: Positive
) -> float:
    """Eqs. 3a and 3b: p, not rounded; Eq. 3a for LM_ratio >= 1, Eq. 3b below; F_SW in N."""
    unit = unit_rise_time(chain, pulse)
    granules_per_second: float = solitary_wave_speed(chain, wave_force) / (2 * chain.radius)
    if rise_time >= unit:
        return 5 + pulse.duration_ratio * (rise_time - unit) * granules_per_second
    return 5 + (unit - rise_time) * granules_per_second


def ejection_momentum(chain: Chain, pulse: Pulse, rise_time: Positive) -> float:
    """Delta L [N s]: momentum that the chain gains by throwing back its first granules (4.1.2).

    The paper prints an integral without its differential; used here is twice the impulse of the
    profile with rise time t0_hat over the last t0_hat - t0 of its duration n t0_hat. 0 for LM_ratio
    >= 1.
    """
    unit = unit_rise_time(chain, pulse)
    if rise_time >= unit:
        return 0.0
    end = pulse.duration_ratio * unit
    start = end - (unit - rise_time)
    _, decay = pulse.ramps(unit)
    if start >= unit:
        return 2 * (decay.impulse - decay.impulse_until(start))
    rise, _ = pulse.ramps(unit)  # n below 2: the interval reaches into the rise
    return 2 * (decay.impulse + rise.impulse - rise.impulse_until(start))


def wave_profile(x: ArrayLike) -> FloatArray:
    """S(x) of Eq. 4a: Pade form of the overlap of a solitary wave over time, 1 at x = 0."""
    square = np.asarray(x, np.float64) ** 2
    series = 1 + square * (0.439 + square * (0.0994 + square * (0.0147 + square * 0.0013)))
    return series**-2


def contact_force(time: ArrayLike, peak_force: Positive, shift: Positive) -> FloatArray:
    """Eq. 4a: force in a contact, F_max S(t / T)^(3/2), at a time since its peak.

    ``shift`` is T, the time between the peaks of neighbouring contacts, in the unit of ``time``.
    """
    return peak_force * wave_profile(np.asarray(time) / shift) ** 1.5


def peak_shift(
    contact: ArrayLike, peak_force: ArrayLike, p: Count, duration_ratio: Positive, ratio: Positive
) -> FloatArray:
    """Eq. 4b: time between the peaks of neighbouring contacts, in natural units, from F_i / F0.

    The paper prints the exponent 25 (p - i) / (16 sqrt(n p)); used here is 25 (p - i) / (16 i p
    sqrt(n)), which follows from the corrected Eq. 6 and Eq. 5.
    """
    i = _in_transition(contact, p, p)
    exponent = 25 * (p - i) / (16 * i * p * math.sqrt(duration_ratio))
    return np.asarray(SHIFT * np.asarray(peak_force, np.float64) ** (-1 / 6) * ratio**exponent)


def wave_momentum(peak_force: ArrayLike) -> FloatArray:
    """Eq. 5, right end: momentum 53/32 F^(5/6) of a wave, in natural units."""
    return np.asarray(WAVE_MOMENTUM * np.asarray(peak_force, np.float64) ** (5 / 6))


def passed_momentum(peak_force: ArrayLike, shift: ArrayLike) -> FloatArray:
    """Eq. 5, middle: momentum 1.543 F_i T_i that passes a contact, in natural units."""
    return np.asarray(FORCE_INTEGRAL * np.asarray(peak_force, np.float64) * np.asarray(shift))


def peak_force(
    contact: ArrayLike,
    p: Count,
    wave_force: Positive,
    duration_ratio: Positive,
    effective_ratio: Positive,
) -> FloatArray:
    """Eqs. 6a and 6b: peak force of a contact in the transition, in the unit of ``wave_force``.

    The paper prints the exponent 15 (i - p) / (8 sqrt(n p)); used here is 15 (i - p) / (8 i p
    sqrt(n)), which gives all 92 entries of Tables 3 and 4. ``effective_ratio`` is LM_ratio (Eq. 6a)
    or, below 1, that of effective_momentum_ratio (Eq. 6b).
    """
    i = _in_transition(contact, p, p)
    exponent = 15 * (i - p) / (8 * i * p * math.sqrt(duration_ratio))
    return np.asarray(wave_force * effective_ratio**exponent)


def effective_momentum_ratio(chain: Chain, pulse: Pulse, rise_time: Positive) -> float:
    """Base of the power in Eq. 6: LM_ratio (6a); below 1 with the ejected momentum added (6b)."""
    applied = applied_momentum(pulse, rise_time) + ejection_momentum(chain, pulse, rise_time)
    return applied / applied_momentum(pulse, unit_rise_time(chain, pulse))


def normalized_contact(contact: ArrayLike, p: Count) -> FloatArray:
    """Eq. 7a: j = (i - 2) / (p - 1), from 0 at contact 2 to 1 at contact p + 1."""
    return np.asarray((_in_transition(contact, p, p + 1) - 2) / (p - 1))


def normalized_peak_force(
    peak_force: ArrayLike, second_force: Positive, wave_force: Positive
) -> FloatArray:
    """Eq. 7b: 1 at F_2, 0 at F_SW."""
    return 1 - (np.asarray(peak_force) - second_force) / (wave_force - second_force)


def peak_force_fit(normalized_contact: ArrayLike) -> FloatArray:
    """Eq. 8: the paper's cubic fit of the normalized peak force, for LM_ratio > 1."""
    j = np.asarray(normalized_contact, np.float64)
    return np.asarray(1 + j * (-2.5 + j * (2.4 - 0.9 * j)))


def peak_force_cubic(
    contact: ArrayLike, p: Count, second_force: Positive, wave_force: Positive
) -> FloatArray:
    """Eq. 9: peak force of contact i, 2 <= i <= p + 1; the paper takes F_2 from Eq. 6."""
    grown = 1 - peak_force_fit(normalized_contact(contact, p))
    return np.asarray(second_force + (wave_force - second_force) * grown)


def granule_velocity(x: ArrayLike, wave_force: Positive = 1.0) -> FloatArray:
    """Velocity of the granules as a function of position, once the wave has formed (section 5.1).

    The integral of F_SW (S(x)^(3/2) - S(x - 1)^(3/2)) from far behind the wave, as printed. The
    factor T = 1.077 F_SW^(-1/6), the time that the wave takes for one granule, is missing there;
    times T the result is in natural units. ``x`` is the position in the frame of the wave, in
    granules, F_SW is in units of F0.
    """

    def net(y: float) -> float:
        return float(wave_profile(y) ** 1.5 - wave_profile(y - 1) ** 1.5)

    from scipy.integrate import quad

    far = -12.0  # S^(3/2) is below 1e-25 there
    integrals = [
        quad(net, far, float(end), epsabs=1e-12, limit=200)[0]
        for end in np.ravel(np.asarray(x, np.float64))
    ]
    return np.asarray(wave_force * np.reshape(integrals, np.shape(x)))


def _in_transition(contact: ArrayLike, p: Count, last: int) -> NDArray[np.int_]:
    i = np.asarray(contact)
    allowed = f"must be from 2 to {last}, with p = {p}"
    require(bool(np.all((i >= 2) & (i <= last))), "contact", contact, allowed)
    return i
