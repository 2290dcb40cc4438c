"""Integration methods as tables of coefficients.

``in_numpy.step`` takes them for u'' = f(t, u).
Adaptive steps take SciPy's DOP853 (``damped_runs``).
"""

from __future__ import annotations

from dataclasses import dataclass


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
class RungeKuttaNystrom:
    """An explicit, not symplectic method; its first stage is the end of the step before.

    ``last_weight`` is the b of an additional stage at the end of the step; it costs nothing,
    because it is the first stage of the next step.
    """

    order: int  # order of convergence where the motion is smooth
    nodes: tuple[float, ...]  # c_1 ... c_s, the first 0
    position: tuple[tuple[float, ...], ...]  # rows of a: a_21; a_31, a_32; and so on
    position_weights: tuple[float, ...]  # b-bar, s of them
    velocity_weights: tuple[float, ...]  # b, s of them
    last_weight: float = 0.0

    @property
    def stages(self) -> int:
        """Number of force evaluations in a step."""
        return len(self.nodes)


Stepper = SymplecticNystrom | RungeKuttaNystrom
"""A method of some order that takes one step at a time."""


def _symmetric(free: tuple[float, ...], length: int) -> tuple[float, ...]:
    """Return a palindrome of the given length that starts with ``free`` and sums to 1."""
    if length % 2:
        half = (*free, 1.0 - 2 * sum(free))
        return half + free[::-1]
    half = (*free, 0.5 - sum(free))
    return half + half[::-1]


VELOCITY_VERLET = SymplecticNystrom(2, kicks=(0.5, 0.5), drifts=(1.0,))
"""Velocity Verlet, the scheme of LAMMPS."""

RUNGE_KUTTA_4 = RungeKuttaNystrom(
    4,
    nodes=(0.0, 0.5, 0.5, 1.0),
    position=((0.0,), (0.25, 0.0), (0.0, 0.5, 0.0)),
    position_weights=(1 / 6, 1 / 6, 1 / 6, 0.0),
    velocity_weights=(1 / 6, 1 / 3, 1 / 3, 1 / 6),
)
"""The classical Runge-Kutta method, used in the paper, in its form for u'' = f(t, u)."""

DPRKN_6 = RungeKuttaNystrom(
    6,
    nodes=(0.0, 1 / 10, 3 / 10, 7 / 10, 17 / 25),
    position=(
        (1 / 200,),
        (-1 / 2200, 1 / 22),
        (637 / 6600, -7 / 110, 7 / 33),
        (225437 / 1968750, -30073 / 281250, 65569 / 281250, -9367 / 984375),
    ),
    position_weights=(151 / 2142, 5 / 116, 385 / 1368, 55 / 168, -6250 / 28101),
    velocity_weights=(151 / 2142, 25 / 522, 275 / 684, 275 / 252, -78125 / 112404),
    last_weight=1 / 12,
)
"""Dormand, El-Mikkawy and Prince, IMA J. Numer. Anal. 7 (1987) 235: RKN6(4)6FM."""

SRKN_6B = SymplecticNystrom(
    4,
    kicks=_symmetric((0.0829844064174052, 0.396309801498368, -0.0390563049223486), 7),
    drifts=_symmetric((0.245298957184271, 0.604872665711080), 6),
)
"""Blanes and Moan, J. Comput. Appl. Math. 142 (2002) 313: SRKN_6^b, 6 stages, order 4."""

SRKN_11B = SymplecticNystrom(
    6,
    kicks=_symmetric(
        (
            0.0414649985182624,
            0.198128671918067,
            -0.0400061921041533,
            0.0752539843015807,
            -0.0115113874206879,
        ),
        12,
    ),
    drifts=_symmetric(
        (
            0.123229775946271,
            0.290553797799558,
            -0.127049212625417,
            -0.246331761062075,
            0.357208872795928,
        ),
        11,
    ),
)
"""Blanes and Moan, J. Comput. Appl. Math. 142 (2002) 313: SRKN_11^b, 11 stages, order 6."""
