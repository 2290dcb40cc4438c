"""Integration methods: tables of coefficients, how steps are halved, and methods by name.

Adaptive steps take SciPy's DOP853 (``damped_runs``).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from hertzchain.scene.ramp import SHAPES
from hertzchain.scene.schedule import Leg


@dataclass(frozen=True)
class SymplecticNystrom:
    """A symplectic method: kicks b and drifts a alternate, first and last a kick."""

    order: int  # order of convergence where the motion is smooth
    kicks: tuple[float, ...]  # b_1 ... b_{s+1}, summing to 1
    drifts: tuple[float, ...]  # a_1 ... a_s, summing to 1

    @property
    def stages(self) -> int:
        """Number of force evaluations in a step."""
        return len(self.drifts)


@dataclass(frozen=True)
class RungeKutta4:
    """The classical Runge-Kutta method, used in the paper; it is not symplectic."""

    order: ClassVar[int] = 4
    stages: ClassVar[int] = 4


Stepper = SymplecticNystrom | RungeKutta4
"""A method of some order that takes one step at a time."""


@dataclass(frozen=True)
class Walker:
    """A method, and how it goes from one wanted time to the next: in one step, or in halved steps.

    overlap^(3/2) has no second derivative at 0. A step of length h across the instant at which a
    contact opens or closes at the rate r' leaves an error of the velocity of about
    r'^(3/2) h^(5/2), whatever the order of the method. Such steps are halved repeatedly, until this
    error is below a tolerance, a fraction of the largest velocity: 1e-10 leaves about 1e-12 of the
    peaks of the paper's scenes. With a tolerance of 0 steps are taken as given.

    The front of a wave closes contacts too, but so smoothly that short steps everywhere are cheaper
    than halved steps there. So steps near every contact that hardly overlaps are halved only during
    the time ``starting`` from the start [natural time units], when the first granules begin to move
    as a power of time, or where only accuracy counts.

    ``cosine_steps`` is the least number of steps on a cosine ramp: the steps integrate its impulse,
    on which the motion after a short pulse depends, right to 1e-14 with 32 steps; one step, halved
    in places, leaves 4e-11.
    """

    stepper: Stepper
    tolerance: float = 0.0
    cosine_steps: int = 1
    starting: float = 0.0

    def cut(self, legs: Sequence[Leg]) -> tuple[Leg, ...]:
        """Return legs whose steps are cut into equal parts until each cosine ramp has enough."""
        fewest = self.cosine_steps
        return tuple(
            leg.in_steps(leg.steps * math.ceil(fewest / leg.steps))
            if leg.steps < fewest and leg.ramp is not None and SHAPES[leg.ramp.shape].is_curved
            else leg
            for leg in legs
        )


def _symmetric(free: tuple[float, ...], length: int) -> tuple[float, ...]:
    """Return a palindrome of the given length that starts with ``free`` and sums to 1."""
    if length % 2:
        half = (*free, 1.0 - 2 * sum(free))
        return half + free[::-1]
    half = (*free, 0.5 - sum(free))
    return half + half[::-1]


VELOCITY_VERLET = SymplecticNystrom(2, kicks=(0.5, 0.5), drifts=(1.0,))
"""Velocity Verlet, the scheme of LAMMPS."""

SRKN_6B = SymplecticNystrom(
    4,
    kicks=_symmetric((0.0829844064174052, 0.396309801498368, -0.0390563049223486), 7),
    drifts=_symmetric((0.245298957184271, 0.604872665711080), 6),
)
"""Blanes and Moan, J. Comput. Appl. Math. 142 (2002) 313: SRKN_6^b, 6 stages, order 4."""

SRKN_11B = SymplecticNystrom(
    6,
    kicks=_symmetric(
        (0.0414649985182624, 0.198128671918067, -0.0400061921041533, 0.0752539843015807,
         -0.0115113874206879), 12,
    ),
    drifts=_symmetric(
        (0.123229775946271, 0.290553797799558, -0.127049212625417, -0.246331761062075,
         0.357208872795928), 11,
    ),
)  # fmt: skip
"""Blanes and Moan, J. Comput. Appl. Math. 142 (2002) 313: SRKN_11^b, 11 stages, order 6."""


@dataclass(frozen=True)
class Method:
    """Settings of a named method.

    ``interval`` is the largest product of step and frequency at which oscillations grow by at most
    one per cent in a step (``error_bound.stable_step``), from the tables of coefficients. Motions
    of random scenes diverge at steps longer by a tenth (velocity Verlet, RK4) to a half.
    """

    walker: Walker
    step: float  # default step, natural time units
    interval: float
    safety: str = "equal steps"  # kind of run: see ``error_bound.SAFETIES``
    # error at any step, left by refinement; at most 4e-12 in the paper's scenes
    floor: float = 0.0


METHODS: dict[str, Method] = {
    "reference": Method(
        Walker(SRKN_11B, tolerance=1e-10, cosine_steps=32, starting=math.inf), step=0.05,
        interval=9.07, safety="refined steps", floor=1e-11,
    ),
    "srkn-11b": Method(Walker(SRKN_11B), step=0.2, interval=9.07),
    "rk4": Method(Walker(RungeKutta4()), step=0.0125, interval=2.83),
    "velocity-verlet": Method(Walker(VELOCITY_VERLET), step=0.002, interval=2.0),
}  # fmt: skip
"""Methods by name. The reference is SRKN_11^b with refined steps. The others take the given steps:
a symplectic Runge-Kutta-Nystrom method of Blanes and Moan, the paper's method and that of LAMMPS.
"""
