"""Coefficient of restitution of two spheres that meet head-on in a damped Hertz contact.

The contact force is F = k d^(3/2) + eta(d) d' at an overlap d > 0, where k = 4/3 E* sqrt(R*), and
the overlap moves as m* d'' = -F. A contact that may pull ends where d is 0 again. A contact that
may not pull, F = max(F, 0), ends where F is 0: the spheres then part at the speed that they have.

Three laws of damping:

============ ============================= ====================================================
restitution  eta = alpha sqrt(m* k) d^1/4  e depends on alpha alone: closed form, ``of_ratio``
viscoelastic eta = 3/2 A k d^1/2           e depends on the velocity: ``viscoelastic``
dashpot      eta constant                  e depends on the velocity: ``dashpot``
============ ============================= ====================================================

Kuwabara and Kono, Jpn. J. Appl. Phys. 26 (1987) 1230; Brilliantov, Spahn, Hertzsch and Poeschel,
Phys. Rev. E 53 (1996) 5382; Schwager and Poeschel, Granular Matter 9 (2007) 465 (contacts that do
not pull); Thornton, Cummins and Cleary, Powder Technology 233 (2013) 30.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.contact import hertz
from hertzchain.errors import require
from hertzchain.scene.chain import granule_mass, length_and_time
from hertzchain.scene.keys import Key, NotNegative, check, key
from hertzchain.scene.scene import Scene
from hertzchain.theory.solitary_wave import solitary_wave

VISCOELASTIC, DASHPOT = 0.5, 0.0
"""Exponent q of the overlap in eta = c d^q."""


@dataclass(frozen=True)
class Collision:
    """Two spheres that meet.

    Parameters
    ----------
    mass
        m* = m1 m2 / (m1 + m2) [kg].
    stiffness
        k = 4/3 E* sqrt(R*) [N m^(-3/2)].
    velocity
        Relative velocity of the impact [m/s].
    """

    mass: float = field(metadata=key("kg", above=0))
    stiffness: float = field(metadata=key("N m^-1.5", above=0))
    velocity: float = field(metadata=key("m/s", above=0))

    def __post_init__(self) -> None:
        check(self)

    @property
    def length(self) -> float:
        """Unit of the overlap, (m* v^2 / k)^(2/5) [m]; the largest overlap is 1.09 of it."""
        return float((self.mass * self.velocity**2 / self.stiffness) ** 0.4)

    def unit(self, exponent: float) -> float:
        """Return the unit of c in eta = c d^q [N s m^(-1-q)] where m*, k and the velocity are 1."""
        return float(self.mass * self.velocity / self.length ** (1 + exponent))


# ---- The restitution law


def damping_ratio(restitution: Annotated[float, Key(above=0, most=1)]) -> float:
    """Return alpha / sqrt(5) that gives a restitution where contacts may pull: beta(e).

    beta = -ln e / sqrt(pi^2 + ln^2 e), between 0 and 1.
    """
    logarithm = math.log(restitution)
    return abs(logarithm) / math.hypot(math.pi, logarithm)


def of_ratio(ratio: NotNegative, pulls: bool) -> float:
    """Return e of eta = alpha sqrt(m* k) d^(1/4), where ``ratio`` is z = alpha / sqrt(5).

    d^(5/4) is the displacement of a damped linear oscillator in a transformed time, and z is its
    damping ratio. Where contacts pull, e = exp(-pi z / sqrt(1 - z^2)), and 0 from z = 1 on: the
    spheres stay together. Where they do not, e = exp(-2 z arccos(z) / sqrt(1 - z^2)), exp(-2) at z
    = 1 and exp(-2 z arcosh(z) / sqrt(z^2 - 1)) above.
    """
    other = math.sqrt(abs(1 - ratio)) * math.sqrt(1 + ratio)
    if pulls:
        return math.exp(-math.pi * ratio / other) if ratio < 1 else 0.0
    if ratio < 1:
        return math.exp(-2 * ratio * math.atan2(other, ratio) / other)
    return math.exp(-2 * (ratio / other) * math.asinh(other)) if other else math.exp(-2)


# ---- Laws whose restitution depends on the velocity


def dashpot(coefficient: NotNegative, collision: Collision, pulls: bool) -> float:
    """Return e of a constant eta, ``coefficient`` [kg/s]."""
    return of_natural(coefficient / collision.unit(DASHPOT), DASHPOT, pulls)


def viscoelastic(relaxation_time: NotNegative, collision: Collision, pulls: bool) -> float:
    """Return e of F = k (d^(3/2) + 3/2 A d^(1/2) d'), A = ``relaxation_time`` [s].

    For a small A, e = 1 - C1 x + 0.6 C1^2 x^2, x = 3/2 A (k/m*)^(2/5) v^(1/5), C1 = 1.15344886.
    """
    damping = 1.5 * relaxation_time * collision.stiffness
    return of_natural(damping / collision.unit(VISCOELASTIC), VISCOELASTIC, pulls)


def of_natural(damping: NotNegative, exponent: float, pulls: bool) -> float:
    """Return e of d'' = -d^(3/2) - c d^q d' from d = 0, d' = 1; right to 1e-10.

    Parameters
    ----------
    damping
        The coefficient c.
    exponent
        The exponent q: 0 (dashpot) or 1/2 (viscoelastic).
    pulls
        Whether the contact may pull.
    """
    allowed = "must be 0 (dashpot) or 0.5 (viscoelastic)"
    require(exponent in (DASHPOT, VISCOELASTIC), "exponent", exponent, allowed)
    # Damping in natural units below which e is 1 within 2e-12 (derived: 1 - e is at most 1.8 c)
    if damping < 1e-12:
        return 1.0
    # Damping in natural units above which e is below 1e-16, and counts as 0 (measured)
    if damping > 1e10:
        return 0.0
    # Above this damping (chosen) all such contacts creep back along one path, d' = -d/c, and e
    # scales as c^-5: the effect of the approach has decayed by exp(-2 * 8^2)
    creeping = 8.0
    if pulls and exponent == VISCOELASTIC and damping > creeping:
        return _speed(creeping, exponent, pulls) * (creeping / damping) ** 5
    return _speed(damping, exponent, pulls)


def _speed(damping: float, exponent: float, pulls: bool) -> float:
    """Return the speed -v at the end of a contact; 0.0 if the spheres never part.

    With d = u^2 and dt = 2 u dtau the motion is u' = v, v' = -2 u^4 - 2 c u^(1 + 2q) v: a
    polynomial, also where the contact begins and ends.

    A contact that may not pull ends where (u^3 + c u^(2q) v) / u^(2q) is 0. This quotient is odd in
    u: where c is small, a single step goes from above 0 to below 0, past all small values.

    A contact that pulls ends where u is 0; spheres with a dashpot may stay together. Let
    s = -v / (c u^2): then s' = 2 c u (u / c^2 - s (1 - s)). While v < 0 and u < c^2 / 4, an s below
    1/2 stays below: the overlap creeps to 0 and never passes it.
    """
    from scipy.integrate import solve_ivp

    power = int(1 + 2 * exponent)

    def motion(_: float, state: FloatArray) -> tuple[float, float]:
        u, v = float(state[0]), float(state[1])
        return v, -2 * u**4 - 2 * damping * u**power * v

    def overlap(_: float, state: FloatArray) -> float:
        return float(state[0])

    def force(_: float, state: FloatArray) -> float:
        u, v = state
        return float(math.copysign(abs(u) ** (3 - 2 * exponent), u) + damping * v)

    def sticks(_: float, state: FloatArray) -> float:
        u, v = state
        return float(max(v, -v - damping * u * u / 2, u - damping * damping / 4))

    ends = [overlap if pulls else force, *([sticks] if pulls and exponent == DASHPOT else [])]
    for event in ends:
        event.terminal, event.direction = True, -1.0  # type: ignore[attr-defined]
    # Relative error of a step of the integration; e is then right to 1e-10 (measured)
    solution = solve_ivp(
        motion, (0.0, math.inf), (0.0, 1.0), "DOP853", events=ends,
        rtol=1e-13, atol=1e-16, first_step=1e-6 / (1 + damping),
    )  # fmt: skip
    assert solution.status == 1, solution.message
    assert solution.y_events is not None
    parted = solution.y_events[0]
    return float(-parted[0][1]) if len(parted) else 0.0


# ---- Two spheres of a scene


@dataclass(frozen=True)
class Parting:
    """Two like spheres that meet head-on and part."""

    restitution: float  # speed of parting over speed of closing
    speed: float | None = None  # of closing [m/s]; None where the restitution does not depend on it
    whose: str = ""  # where the speed comes from


def parting(scene: Scene) -> Parting | None:
    """Return the rebound of two spheres like granule 2; None in a scene without damping.

    They close with the velocity of the striker, the largest speed of the piston or, where a force
    pushes the chain, the largest velocity of a granule in a solitary wave of the largest applied
    force.
    """
    law, granules, shock = scene.contact, scene.granules, scene.shock
    if law is None:
        return None
    if law.restitution is not None:
        return Parting(of_ratio(damping_ratio(law.restitution), law.attraction))
    properties = (granules.radius, granules.young_modulus, granules.poisson_ratio, granules.density)
    radius, modulus, poisson, density = (float(values[1]) for values in properties)
    stiffness = float(hertz.stiffness_of_equals(radius, modulus, poisson))
    mass = float(granule_mass(radius, density))
    if shock.impact_velocity is not None:
        speed = shock.impact_velocity
        whose = "the striker's" if scene.striker is not None else "the piston's largest"
    else:
        length, time = length_and_time(stiffness, mass, scene.peak_force)
        speed = float(_wave_velocity() * length / time)
        whose = f"a granule's in a wave of {scene.peak_force:.3g} N"
    spheres = Collision(mass / 2, stiffness, speed)
    of_law = viscoelastic if law.damping == "viscoelastic" else dashpot
    return Parting(of_law(law.parameter, spheres, law.attraction), speed, whose)


@functools.cache
def _wave_velocity() -> float:
    """Return the largest velocity of a granule in a solitary wave of height 1, in natural units.

    A granule is fastest when the wave is between its two contacts. Its velocity is then the
    integral of the force from x = -1/2 to 1/2, divided by the wave speed c, because the
    difference of the two contact forces accelerates it.
    """
    from scipy.integrate import simpson

    wave = solitary_wave()
    inside = np.abs(wave.x) <= 0.5
    return float(simpson(wave.overlap[inside] ** 1.5, x=wave.x[inside]) / wave.speed)
