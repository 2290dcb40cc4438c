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

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

from hertzchain.arrays import FloatArray
from hertzchain.errors import POSITIVE, is_positive, require
from hertzchain.scene.keys import Key, NotNegative
from hertzchain.scene.scene import Scene

VISCOELASTIC, DASHPOT = 0.5, 0.0
"""Exponent q of the overlap in eta = c d^q."""


_CREEP_DAMPING = 8.0
"""Viscoelastic damping in natural units from which a contact that pulls creeps back (chosen).

By then the effect of the approach has decayed by exp(-2 * 8^2)."""


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

    Raises
    ------
    SceneError
        For a value that is not a finite number above 0.
    """

    mass: float
    stiffness: float
    velocity: float

    def __post_init__(self) -> None:
        for key in ("mass", "stiffness", "velocity"):
            value = getattr(self, key)
            require(is_positive(value), key, value, POSITIVE)

    @property
    def length(self) -> float:
        """Unit of the overlap, (m* v^2 / k)^(2/5) [m]; the largest overlap is 1.09 of it."""
        return float((self.mass * self.velocity**2 / self.stiffness) ** 0.4)

    def unit(self, exponent: float) -> float:
        """Return the unit of c in eta = c d^q [N s m^(-1-q)] where m*, k and the velocity are 1."""
        return float(self.mass * self.velocity / self.length ** (1 + exponent))


def collision_of(scene: Scene) -> Collision:
    """Return the collision of a scene's striker with granule 2; SceneError without a striker."""
    striker = scene.striker
    allowed = "needs a scene with a [striker]: it is the velocity of the impact"
    require(striker is not None, "striker", None, allowed)
    granules = scene.granules
    return Collision(
        mass=float(granules.contact_mass[0]),
        stiffness=float(granules.stiffness[0]),
        velocity=float(scene.shock.start_velocity),
    )


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
    if not pulls:
        return _parted(damping, exponent)
    if exponent == VISCOELASTIC and damping > _CREEP_DAMPING:
        # All such contacts creep back along one path, d' = -d/c, and e scales as c^-5.
        return _parted_at_rest(_CREEP_DAMPING, exponent) * (_CREEP_DAMPING / damping) ** 5
    return _parted_at_rest(damping, exponent)


def _parted(damping: float, exponent: float) -> float:
    """Return the speed at which the force is 0, where (u^3 + c u^(2q) v) / u^(2q) is 0.

    The quotient is odd in u: where c is small, a single step goes from above 0 to below 0, past all
    small values.
    """

    def force(_: float, state: FloatArray) -> float:
        u, v = state
        return float(math.copysign(abs(u) ** (3 - 2 * exponent), u) + damping * v)

    return _speed(damping, exponent, force)


def _parted_at_rest(damping: float, exponent: float) -> float:
    """Return the speed at which the overlap is 0, or 0 where the spheres never part.

    They stay together only with a dashpot. In the variables of ``_speed`` let s = -v / (c u^2):
    then s' = 2 c u (u / c^2 - s (1 - s)). While v < 0 and u < c^2 / 4, an s below 1/2 stays below:
    the overlap creeps to 0 and never passes it.
    """

    def overlap(_: float, state: FloatArray) -> float:
        return float(state[0])

    def sticks(_: float, state: FloatArray) -> float:
        u, v = state
        return float(max(v, -v - damping * u * u / 2, u - damping * damping / 4))

    return _speed(damping, exponent, overlap, *([sticks] if exponent == DASHPOT else []))


Event = Callable[[float, FloatArray], float]


def _speed(damping: float, exponent: float, end: Event, *others: Event) -> float:
    """Return the speed -v where ``end`` falls to 0; 0.0 if one of ``others`` falls to 0 first.

    With d = u^2 and dt = 2 u dtau the motion is u' = v, v' = -2 u^4 - 2 c u^(1 + 2q) v: a
    polynomial, also where the contact begins and ends.
    """
    from scipy.integrate import solve_ivp

    power = int(1 + 2 * exponent)

    def motion(_: float, state: FloatArray) -> tuple[float, float]:
        u, v = float(state[0]), float(state[1])
        return v, -2 * u**4 - 2 * damping * u**power * v

    events = (end, *others)
    for event in events:
        event.terminal, event.direction = True, -1.0  # type: ignore[attr-defined]
    # Relative error of a step of the integration; e is then right to 1e-10 (measured)
    solution = solve_ivp(
        motion, (0.0, math.inf), (0.0, 1.0), "DOP853", events=events,
        rtol=1e-13, atol=1e-16, first_step=1e-6 / (1 + damping),
    )  # fmt: skip
    assert solution.status == 1, solution.message
    assert solution.y_events is not None
    ends = solution.y_events[0]
    return float(-ends[0][1]) if len(ends) else 0.0
