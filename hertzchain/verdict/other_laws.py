"""Mistakes in the contact law, and forces that act late, by the chain that any numbers make."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterator

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.limits import Deadline
from hertzchain.scene.scene import Scene
from hertzchain.scene.watching import watched_time
from hertzchain.verdict.case import Case, Found, Mistake
from hertzchain.verdict.deck.twin import Stretch, run_twin, twin_of

# natural time units: errors of 1e-5 of the peaks, and half a step's lag of damping (1e-3 where it
# takes 2 % of them, measured)
_STEP = 0.01

HERTZ = 1.5  # exponent of the overlap

_OTHERS = {
    "contact force linear in the overlap": 1.0,
    "contact force that goes as overlap^(5/4)": 1.25,
    "contact force that goes as overlap^2": 2.0,
}

# trial coefficients of damping, natural units: dense near 0
_FORWARD = np.linspace(0.0, 1.25, 14) ** 2
_BACKWARD = -(np.linspace(0.6, 0.0, 10) ** 2)

_OF_DRAG = 0.2  # fraction of these coefficients for a drag, which acts on a granule for long


def peaks(
    scene: Scene,
    deadline: Deadline,
    exponent: float = HERTZ,
    stretched: float = 1.0,
    damping: float = 0.0,
    drag: float = 0.0,
) -> FloatArray:
    """Return peak forces over F0 under a law overlap^exponent, (contacts,).

    They are not finite where the motion diverged. ``stretched`` is a factor of the pulse's
    duration. ``damping`` of the contacts goes as overlap^(1/2) times the rate, ``drag`` as the
    velocity of each granule, both in natural units with stiffness 1. Raises TooExpensive if they
    are not done by the deadline.
    """
    unit, twin = scene.units, twin_of(scene)
    pulse_end = scene.ramps[-1].end / unit.time * stretched
    end = pulse_end + float(watched_time(scene.chain.granules, scene.momentum_ratio * stretched))
    if scene.run.end_time is not None:
        end = scene.end_time / unit.time
    steps = math.ceil(end / _STEP)
    time = np.linspace(0.0, end * unit.time, steps + 1)
    applied = np.asarray(scene.applied_force(time / stretched))[:, np.newaxis]
    rate = unit.force * unit.time / unit.length
    law = twin._replace(
        stiffness=np.full_like(twin.stiffness, unit.force / unit.length**exponent),
        exponent=np.full_like(twin.exponent, exponent),
        damping=np.full_like(twin.damping, damping * rate / math.sqrt(unit.length)),
        damping_exponent=0.5,
        attraction=True,
        drag=np.full_like(twin.drag, drag * rate),
    )
    stretches = [Stretch(end * unit.time / steps, applied, np.zeros(0))]
    return run_twin(law, stretches, deadline).peak_force / unit.force


def other_contacts(case: Case) -> Iterator[Mistake]:
    """Yield another exponent, with any stiffness."""
    for text, exponent in _OTHERS.items():

        def made(log: float, exponent: float = exponent) -> FloatArray:
            found = peaks(case.scene, case.deadline, exponent, math.exp(log))
            return found * case.scene.units.force

        def words(log: float, text: str = text, exponent: float = exponent) -> str:
            times = math.exp(2 * exponent * log)
            return f"{text}, with {times:.3g} times the stiffness at F0"

        yield Mistake(words, search=functools.partial(_search, made=made))


def _search(case: Case, made: Callable[[float], FloatArray]) -> Found:
    """Find the stretch, if one of the trials is nearer to the peaks than the scene itself."""
    tried = {log: case.residual(made(log)) for log in np.linspace(-2.0, 2.0, 17).tolist()}
    best = min(tried, key=lambda log: tried[log])
    return case.fit(made, list(tried)) if tried[best] < case.size else Found(best, tried[best])


def late_forces(case: Case) -> Iterator[Mistake]:
    """Yield late forces, which act like negative damping, and a drag."""
    units = case.scene.units
    by_hertz = peaks(case.scene, case.deadline)

    def made(trial: float, acting: str) -> FloatArray:
        """Peaks [N], corrected by the error of the steps for Eq. 1."""
        found = peaks(case.scene, case.deadline, **{acting: trial})
        ratio = found / np.where(by_hertz > 0, by_hertz, np.inf)
        return np.asarray(ratio * case.reference.peak_force)

    def drag(x: float) -> str:
        coefficient = x * units.force * units.time / units.length
        return f"damping on, a drag on each granule, coefficient {coefficient:.3g} N s/m"

    def late(x: float) -> str:
        # F(t - dt) = F - 3/2 dt overlap^(1/2) overlap': negative damping.
        return (
            f"contact forces {-x / 1.5 * units.time:.3g} s late, a step: explicit Euler, or forces"
            " from positions of the step before"
        )

    of_drag = _OF_DRAG * _FORWARD
    yield Mistake(drag, functools.partial(made, acting="drag"), of_drag.tolist())
    yield Mistake(late, functools.partial(made, acting="damping"), _BACKWARD.tolist())
