"""How wrong are the peaks: an upper bound from a second run with other steps."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from hertzchain.arrays import FloatArray
from hertzchain.errors import RunFailed
from hertzchain.peaks import largest_difference
from hertzchain.schedule import Leg


def second_order_safety(natural_step: float) -> float:
    """The bound over the estimate, for second-order methods.

    Opening contacts add to h^2 some h^2.5, and steps of more than 0.15 natural time units some h^4
    (1.95 times the estimate at 0.5 was seen).

    Parameters
    ----------
    natural_step
        The largest step, natural time units.
    """
    return 1.5 if natural_step <= 0.15 else 4.0


@dataclass(frozen=True)
class Companion:
    """A second run whose peaks tell the error of the first.

    Parameters
    ----------
    legs
        The steps of the second run.
    factor
        The error of the first run is at most this times the difference of their peaks, if errors
        fall at least as the square of the step.
    """

    legs: tuple[Leg, ...]
    factor: float


def companion(legs: Sequence[Leg]) -> Companion:
    """The cheapest second run in which every leg has another step: two thirds as many, or thrice.

    Two thirds, not half: a method that halves steps could end on the same ones. Where a leg has
    fewer than three steps there is no such number; the factor takes the leg whose step changes
    least.
    """
    if min(leg.steps for leg in legs) < 3:
        return Companion(tuple(replace(leg, steps=3 * leg.steps) for leg in legs), 9 / 8)
    coarse = tuple(replace(leg, steps=2 * leg.steps // 3) for leg in legs)
    ratio = min(leg.steps / other.steps for leg, other in zip(legs, coarse, strict=True))
    return Companion(coarse, 1 / (ratio**2 - 1))


def refuse_meaningless(backend: str, error: float) -> None:
    """Refuse a run whose peaks may be off by their own size.

    Raises
    ------
    RunFailed
        If the error bound is not below 1: the motion has diverged, or nearly so.
    """
    if not error < 1:
        raise RunFailed(
            f"the {backend} run diverged: its step is too large for the method, choose a smaller dt"
        )


def second_order_step(
    peaks_at: Callable[[float], FloatArray], pilot: float, wanted: float
) -> float:
    """The step with which a second-order method reaches a wanted error of the peaks.

    Parameters
    ----------
    peaks_at
        Peak forces at a step [s], shape (contacts,).
    pilot
        The step of the first of two trial runs [s]; the second has half of it.
    wanted
        Largest relative error of the peaks.
    """
    difference = largest_difference(peaks_at(pilot), peaks_at(pilot / 2))
    error = 1.5 * difference / 3  # of the second trial, bounded as by second_order_safety
    return pilot / 2 * min(math.sqrt(0.9 * wanted / error), 4.0) if error > 0 else pilot
