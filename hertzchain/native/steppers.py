"""Methods for u'' = f(t, u): one step each, as tables of coefficients where there is a table."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

from hertzchain.arrays import Array, Scalar
from hertzchain.native.equations import acceleration

AppliedForce = Callable[[Any], Any]
"""The force on the first granule at a time, in the precision of that time."""


@dataclass(frozen=True)
class State:
    """Displacement, velocity and acceleration of all granules, each of shape (granules,)."""

    displacement: Array
    velocity: Array
    acceleration: Array


class Stepper(Protocol):
    """A method of some order that takes one step at a time."""

    @property
    def order(self) -> int:
        """Order of convergence where the motion is smooth."""

    def step(self, state: State, time: Scalar, h: Scalar, applied: AppliedForce) -> State:
        """Take one step of length h from ``time``."""


@dataclass(frozen=True)
class SymplecticNystrom:
    """Kicks b and drifts a in turn, a kick first and last.

    Parameters
    ----------
    order
        Order of convergence where the motion is smooth.
    kicks
        b_1 ... b_{s+1}, summing to 1.
    drifts
        a_1 ... a_s, summing to 1.
    """

    order: int
    kicks: tuple[float, ...]
    drifts: tuple[float, ...]

    def step(self, state: State, time: Scalar, h: Scalar, applied: AppliedForce) -> State:
        """Take one step of length h from ``time``; one force evaluation for each drift."""
        displacement = state.displacement.copy()
        velocity = state.velocity.copy()
        kick = state.acceleration
        for b, a in zip(self.kicks, self.drifts, strict=False):
            velocity += b * h * kick
            displacement += a * h * velocity
            time += a * h
            kick = acceleration(displacement, applied(time))
        velocity += self.kicks[-1] * h * kick
        return State(displacement, velocity, kick)


@dataclass(frozen=True)
class RungeKutta4:
    """The classical method of order 4, which the paper uses."""

    order: int = 4

    def step(self, state: State, time: Scalar, h: Scalar, applied: AppliedForce) -> State:
        """Take one step of length h from ``time``; four force evaluations."""
        u, v, k1 = state.displacement, state.velocity, state.acceleration
        half = h / 2
        v2 = v + half * k1
        k2 = acceleration(u + half * v, applied(time + half))
        v3 = v + half * k2
        k3 = acceleration(u + half * v2, applied(time + half))
        v4 = v + h * k3
        k4 = acceleration(u + h * v3, applied(time + h))
        displacement = u + h / 6 * (v + 2 * v2 + 2 * v3 + v4)
        velocity = v + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        return State(displacement, velocity, acceleration(displacement, applied(time + h)))


def _symmetric(free: tuple[float, ...], length: int, total: float = 1.0) -> tuple[float, ...]:
    """A palindrome of the given length that starts with ``free`` and sums to ``total``."""
    if length % 2:
        half = (*free, total - 2 * sum(free))
        return half + free[::-1]
    half = (*free, total / 2 - sum(free))
    return half + half[::-1]


VELOCITY_VERLET = SymplecticNystrom(2, kicks=(0.5, 0.5), drifts=(1.0,))

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
