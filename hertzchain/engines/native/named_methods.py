"""Methods that are asked for by name: coefficients, default steps, stability."""

from __future__ import annotations

from dataclasses import dataclass

from hertzchain.engines.native.methods import (
    DPRKN_6,
    RUNGE_KUTTA_4,
    SRKN_6B,
    SRKN_11B,
    VELOCITY_VERLET,
)
from hertzchain.engines.native.refinement import Fixed, Refined, Walker


@dataclass(frozen=True)
class Method:
    """Settings of a named method.

    ``interval`` is the largest product of step and frequency at which oscillations grow by at most
    one per cent in a step (``error_bound.stable_step``), from the tables of coefficients. Motions
    of random scenes diverge at steps longer by a tenth (velocity Verlet, RK4) to a half.
    """

    walker: Walker  # stepper
    step: float  # default step, natural time units
    interval: float
    safety: float = 6.0  # ratio of bound to differences; opening contacts make errors erratic
    # error at any step, left by refinement; at most 4e-12 in the paper's scenes
    floor: float = 0.0


METHODS: dict[str, Method] = {
    "reference": Method(
        Refined(SRKN_11B, tolerance=1e-10), step=0.05, interval=9.07, safety=3.0, floor=1e-11
    ),
    "srkn-11b": Method(Fixed(SRKN_11B), step=0.2, interval=9.07),
    "srkn-6b": Method(Fixed(SRKN_6B), step=0.1, interval=5.02),
    "dprkn-6": Method(Fixed(DPRKN_6), step=0.1, interval=3.12),
    "rk4": Method(Fixed(RUNGE_KUTTA_4), step=0.0125, interval=2.83),
    "velocity-verlet": Method(Fixed(VELOCITY_VERLET), step=0.002, interval=2.0),
}
"""Methods by name. The reference is SRKN_11^b with refined steps. The others take the given steps:
two symplectic Runge-Kutta-Nystrom methods of Blanes and Moan, one of Dormand, El-Mikkawy and
Prince, the paper's method and that of LAMMPS.
"""
