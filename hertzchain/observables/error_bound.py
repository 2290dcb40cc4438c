"""How wrong are the peaks: an upper bound from one run or two with other steps."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.errors import SceneError, StepUnstable, Unpredictable
from hertzchain.observables.peaks import largest_difference
from hertzchain.scene.natural_units import force_scale
from hertzchain.scene.pulse import Pulse
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg

_SHORTEST_CHAIN = 5.0  # granules over LM_ratio; collisions repeat below: 1.6 times the bound at 4.2

SHORT = 0.1  # natural time units; with shorter steps every method has all digits there are
_STRONGEST = 1e6  # rate of dampers over that of contacts (chosen); many runs stand still at 1e4
_SURELY_STABLE = 0.85  # of the longest stable step: contacts under 2.2 F0 are stiffer


def is_short(momentum_ratio: Any, granules: Any) -> Any:
    """Whether a chain is short for its pulse; numbers or arrays."""
    return np.asarray(granules < _SHORTEST_CHAIN * momentum_ratio)


def amplifies_errors(scene: Scene) -> bool:
    """Whether contacts open and close again and again, so that errors are erratic.

    In chains short for their pulse, and under tables, whose second push meets flying granules.
    """
    short = is_short(scene.momentum_ratio, scene.chain.granules)
    return not scene.is_plain or not isinstance(scene.shock, Pulse) or bool(short)


def second_order_safety(natural_step: float, rising: bool) -> float:
    """The bound over the estimate, for second-order methods; the step is in natural time units.

    Opening contacts add to h^2 some h^2.5, and steps above 0.15 some h^4 (1.95 times the estimate
    at 0.5 was seen). Where the run ended while contacts were pressed harder than before
    (``rising``), errors of 2.9 times the estimate were seen, with steps above 0.5 of 6.8 times.
    """
    if rising and natural_step > 0.5:
        return 8.0
    return 1.5 if natural_step <= 0.15 and not rising else 4.0


@dataclass(frozen=True)
class SecondRun:
    """A second run; ``factor`` times the difference of the peaks bounds the first run's error."""

    legs: tuple[Leg, ...]
    factor: float


def coarser_run(legs: Sequence[Leg], stable: float, order: int = 2) -> SecondRun:
    """The cheapest second run in which every leg has another step: two thirds as many, or thrice.

    Two thirds, not half: a method that halves steps could end on the same ones. They are thrice as
    many where a leg has fewer than three steps, and where coarser ones come near ``stable`` [s].
    The factor takes the leg whose step changes least, for errors that go as the step to the power
    ``order``.
    """
    longest = max(leg.dt for leg in legs)
    if min(leg.steps for leg in legs) < 3 or 1.5 * longest > _SURELY_STABLE * stable:
        thrice = tuple(replace(leg, steps=3 * leg.steps) for leg in legs)
        return SecondRun(thrice, 1 / (1 - 3**-order))
    coarse = tuple(replace(leg, steps=2 * leg.steps // 3) for leg in legs)
    ratio = min(leg.steps / other.steps for leg, other in zip(legs, coarse, strict=True))
    return SecondRun(coarse, 1 / (ratio**order - 1))


def finer_run(legs: Sequence[Leg], order: int = 2) -> SecondRun:
    """A third run, with a quarter more steps, where one difference may be small by chance.

    In 1,500 random scenes one difference was up to 120 times too small, the larger of two 4.5 times
    at most.
    """
    finer = tuple(replace(leg, steps=max(leg.steps + 1, 5 * leg.steps // 4)) for leg in legs)
    ratio = min(other.steps / leg.steps for leg, other in zip(legs, finer, strict=True))
    return SecondRun(finer, 1 / (1 - ratio**-order))


def first_order_runs(legs: Sequence[Leg], stable: float) -> tuple[SecondRun, SecondRun]:
    """The runs that tell the error of velocity Verlet with damped contacts: always two.

    Contacts that begin at a speed begin anywhere within a step, so errors are erratic.
    """
    return coarser_run(legs, stable, order=1), finer_run(legs, order=1)


def first_order_safety(scene: Scene, rising: bool) -> float:
    """The bound over the estimate, the larger of ``first_order_runs``.

    In 1,200 random scenes errors were up to 3.4 times the estimate where granules fly at others,
    else up to 1.8 times.
    """
    flying = scene.striker is not None or bool(np.any(scene.granules.gap > 0))
    return 6.0 if flying or rising else 3.0


def stable_step(scene: Scene, interval: float) -> float:
    """The longest step with which a method is stable [s].

    Contacts pressed by F0 have the stiffness k = 3/2 in natural units, and neighbours among N
    granules swing against each other with at most the frequency 2 sqrt(k) cos(pi / 2N). Weak shocks
    make softer contacts. ``interval`` is the largest product of step and frequency with which the
    method does not make an oscillation grow: 2 for velocity Verlet.
    """
    if scene.contact is not None:
        # Of z^2 - (2 - r h - (w h)^2) z + 1 - r h, no root may be outside the unit circle, where r
        # is the rate at which dampers alone would stop a motion, taken with half a step's delay.
        frequency, rate = _highest_frequency(scene), highest_rate(scene)
        return 2 * interval / (rate + math.hypot(rate, 2 * frequency))
    if not scene.is_plain:
        return interval / _highest_frequency(scene)
    bound = math.cos(math.pi / (2 * scene.chain.granules))
    frequency = math.sqrt(6.0) * bound * math.pow(force_scale(scene.momentum_ratio), 1 / 6)
    return interval / frequency * scene.units.time


def _highest_frequency(scene: Scene) -> float:
    """Bound of the frequencies of a chain all of whose contacts the unit of force presses [1/s].

    No eigenvalue is larger than the largest sum of a row of the matrix of stiffnesses over masses
    (Gershgorin), twice that of the contacts of a granule over its mass.
    """
    granules = scene.granules
    pressed = 1.5 * np.cbrt(granules.stiffness**2 * scene.units.force)
    return math.sqrt(_largest_row(scene, pressed))


def highest_rate(scene: Scene) -> float:
    """Bound of the rates at which dampers stop motions, all pressed by the unit of force [1/s]."""
    granules, contact = scene.granules, scene.contact
    assert contact is not None
    assert granules.damping is not None
    overlap = (scene.units.force / granules.stiffness) ** (2 / 3)
    return _largest_row(scene, granules.damping * overlap**contact.exponent)


def refuse_strong_dampers(scene: Scene) -> None:
    """Raise a SceneError for dampers that no method can follow, with the strongest allowed.

    A restitution is never too strong: its dampers are about as fast as the contact itself.
    """
    contact = scene.contact
    if contact is None or contact.restitution is not None:
        return
    if contact.coefficient is not None:
        key, given, unit = "coefficient", contact.coefficient, "kg/s"
        one = replace(scene, contact=replace(contact, coefficient=1.0))
    else:
        key, given, unit = "relaxation_time", contact.relaxation_time or 0.0, "s"
        one = replace(scene, contact=replace(contact, relaxation_time=1.0))
    most = _STRONGEST / (highest_rate(one) * scene.contact_time)
    if given > most:
        allowed = (
            f"must be at most {most:.2g} {unit} in this scene: stronger dampers are beyond what"
            " can be computed"
        )
        raise SceneError(f"contact.{key}", given, allowed)


def _largest_row(scene: Scene, of_contact: FloatArray) -> float:
    """Largest sum of a row of the matrix of what contacts have, over masses."""
    around = np.zeros(scene.chain.granules + 1)
    around[1 : 1 + of_contact.size] = of_contact
    return float(np.max(2 * (around[:-1] + around[1:]) / scene.granules.mass))


def refuse_unstable(scene: Scene, legs: Sequence[Leg], interval: float, method: str) -> None:
    """Raise StepUnstable for steps longer than ``stable_step``: the motion would diverge."""
    longest, limit = max(leg.dt for leg in legs), stable_step(scene, interval)
    if longest > limit:
        raise StepUnstable(
            f"the step of {longest:.3g} s is unstable: {method} is stable up to {limit:.3g} s"
            f" ({limit / scene.contact_time:.3g} natural time units) in this scene, choose a"
            " smaller dt"
        )


def diverged(backend: str) -> StepUnstable:
    """What to say of a run whose energy grows without bound."""
    return StepUnstable(
        f"the {backend} run diverged: its step is too long for the method, choose a smaller dt"
    )


def refuse_meaningless(backend: str, error: float, too_long: bool) -> None:
    """Refuse a run whose error bound is not below 1; ``too_long``: shorter steps would help."""
    if error < 1:
        return
    if too_long:
        raise StepUnstable(
            f"the {backend} run has no right digit: its step is too long for the method, choose a"
            " smaller dt"
        )
    raise Unpredictable(
        f"no digit of the {backend} peaks is sure: granules knock against one another for so long"
        " that rounding errors grow to the size of the peaks; a shorter end_time or pulse helps"
    )


def second_order_step(
    peaks_at: Callable[[float], FloatArray], pilot: float, wanted: float
) -> float:
    """The step [s] for a wanted relative error of peaks, by trials at ``pilot`` and half of it."""
    difference = largest_difference(peaks_at(pilot), peaks_at(pilot / 2))
    error = 1.5 * difference / 3  # of the second trial, bounded as by second_order_safety
    return pilot / 2 * min(math.sqrt(0.9 * wanted / error), 4.0) if error > 0 else pilot


def first_order_step(
    scene: Scene, peaks_at: Callable[[float], FloatArray], pilot: float, wanted: float
) -> float:
    """As ``second_order_step`` for damped contacts."""
    difference = largest_difference(peaks_at(pilot), peaks_at(pilot / 2))
    error = first_order_safety(scene, rising=False) * difference
    return pilot / 2 * min(0.7 * wanted / error, 8.0) if error > 0 else pilot
