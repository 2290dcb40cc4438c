"""Methods of steps, and the cheapest of them for a wanted accuracy."""

from __future__ import annotations

import functools
import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from hertzchain.arrays import Quantity
from hertzchain.errors import is_finite, require
from hertzchain.limits import TIGHTEST
from hertzchain.observables.error_bound import SAFETIES, Safety, is_short
from hertzchain.observables.first_pulse import LATEST, finds_end, usual_end
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg
from hertzchain.scene.shocks import SHAPES


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
    """A method that advances to the next wanted time, in one step or in halved steps.

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
    safety: str = "erratic"  # kind of run: see ``error_bound.SAFETIES``
    # error at any step, left by refinement; at most 4e-12 in the paper's scenes
    floor: float = 0.0


METHODS: dict[str, Method] = {
    "reference": Method(
        Walker(SRKN_11B, tolerance=1e-10, cosine_steps=32, starting=math.inf), step=0.05,
        interval=9.07, safety="regular", floor=1e-11,
    ),
    "srkn-11b": Method(Walker(SRKN_11B), step=0.2, interval=9.07),
    "rk4": Method(Walker(RungeKutta4()), step=0.0125, interval=2.83),
    "velocity-verlet": Method(Walker(VELOCITY_VERLET), step=0.002, interval=2.0),
}  # fmt: skip
"""Methods by name. The reference is SRKN_11^b with refined steps. The others take the given steps:
a symplectic Runge-Kutta-Nystrom method of Blanes and Moan, the paper's method and that of LAMMPS.
"""


LOOSEST = 0.01
"""Loosest accuracy that can be wanted (chosen)."""

_LONGEST_STEP = 0.8
"""Longest step [natural time units]; at 1.0 the methods begin to fail."""

_LONGEST_CHECKED_STEP = 0.52
"""Longest step if a second run, with steps 1.5 times as long, estimates the error."""

_STEP_RATIO = 0.92
"""Ratio of steps with a second run to those without: one scene in fifty needs a further
plan; at ratio 1, one in four.
"""

_CHECKED_ERROR_RATIO, _UNCHECKED_ERROR_RATIO = 0.55, 0.9
"""Ratio of the error to the wanted accuracy in the worst random scene, rounded up, with and without
a second run. Estimates are never lower, because a difference can be small by chance.
"""

TRIES = 6
"""Most plans for one scene; one in fifty random scenes needs a second."""

_MOST_ERROR_RATIO = 0.8
"""Ratio of a plan's error to that of the plan before, above which the error is amplified round-off;
where shorter steps help, they usually halve the error.
"""

_CHEAP_WORK = 1e8
"""Granules times force evaluations (a few tenths of a second) below which all plans are tried."""

_LEAST_RTOL_RATIO, _LEAST_RTOL_RATIO_WITH_TERMS = 1e-3, 1e-5
"""Least ratio of a further plan's accuracy to that of the plan before. Beyond a uniform chain
errors fall in proportion to it: eight long runs of dimers needed a third fewer plans.
"""

_UNREFINED_RTOL = 1e-4
"""Accuracy from which on opening contacts need no shorter steps."""

_KNOWN_RATIOS, _KNOWN_DURATIONS, _KNOWN_GRANULES = (0.05, 10.0), (1.1, 60.0), 500
"""Ranges of LM_ratio, n and N of the random scenes."""

_FIRST_RTOL_RATIO, _LARGEST_FIRST_RTOL = 64.0, 2.5e-5
"""Wanted accuracy over that of the plan that such scenes try first where first pulses are wanted,
and its largest (chosen). Measured with 264 scenes of eleven
kinds at 1e-4, 1e-6 and 1e-8: at 48 the work is the same; at 24 three of ten need a second plan and
all together 1.2 times the work, though the shipped dimer takes 0.8."""

_ERRATIC_ERROR_RATIO = 6.0
"""Ratio of the error that no difference shows, in such scenes, to that in others: a contact closes
at any place of a step. In the worst of 6,000 random scenes it was 4.4, at the first contacts.
"""

_HARD_RTOL_RATIO, _HARD_RTOL = 30.0, 1e-6
"""Hard scenes run with a thirtieth of the wanted accuracy, or this one: long steps make them
chaotic, and a tenth left errors of up to eleven times the wanted accuracy.
"""


@dataclass(frozen=True)
class Plan:
    """A plan of a run: method and steps."""

    method: str
    walker: Walker
    step: float  # largest step, natural time units
    error: float  # error of the peaks in the worst random scene
    safety: Safety  # of differences from runs with other steps

    @functools.cached_property
    def coarser(self) -> Walker:
        """Return the walker of a second run for the error, on legs that are already cut."""
        return replace(self.walker, tolerance=8 * self.walker.tolerance, cosine_steps=1)

    def closer(self, rtol: float, error: float, has_terms: bool = False) -> Plan:
        """Return a plan for ``rtol`` after one that had ``error``."""
        least = _LEAST_RTOL_RATIO_WITH_TERMS if has_terms else _LEAST_RTOL_RATIO
        factor = max(0.5 * rtol / error, least) if error < 1 else _LEAST_RTOL_RATIO
        step = self.step * factor ** (1 / (self.walker.stepper.order + 1))
        walker = replace(self.walker, tolerance=self.walker.tolerance * factor)
        return replace(self, step=step, walker=walker)

    def hopeless(self, error: float, before: float, evaluations: float) -> bool:
        """Return whether this plan cost much and its error is hardly below that of the plan before.

        ``evaluations`` counts forces times granules. The constant part of both estimates is
        subtracted.
        """
        hardly = error - self.error > _MOST_ERROR_RATIO * (before - self.error)
        return hardly and evaluations > _CHEAP_WORK

    def least(self, evaluations: Quantity) -> Any:
        """Error that no difference shows, from force evaluations; also of arrays."""
        return self.error + round_off(evaluations)

    def legs(self, scene: Scene, end_time: float | None = None) -> tuple[Leg, ...]:
        """Return the legs of a run of a scene, or of one with another end [s]."""
        step = self.step * scene.contact_time  # kept, so that the copy has it
        scene = scene if end_time is None else scene.until(end_time)
        return self.walker.cut(scene.schedule(step))

    def first_legs(self, scene: Scene, first: bool) -> tuple[tuple[Leg, ...], float]:
        """Return the legs of the first run of a scene, and its usual end, NaN if it is given.

        ``first``: first pulses are wanted. Then a run may find its end, and the legs go on until
        the latest possible one.
        """
        if not (first and finds_end(scene)):
            return self.legs(scene), math.nan
        return self.legs(scene, LATEST * scene.end_time), usual_end(scene)

    def other_legs(self, legs: Sequence[Leg]) -> tuple[Leg, ...]:
        """Return the legs of the run that estimates the error."""
        counts = [2 * leg.steps // 3 if leg.steps > 2 else leg.steps + 1 for leg in legs]
        return tuple(leg.in_steps(count) for leg, count in zip(legs, counts, strict=True))


def is_known(momentum_ratio: Quantity, duration_ratio: Quantity, granules: int) -> Any:
    """Whether a profile of the paper with LM_ratio and n (arrays) is in the measured range."""
    (low, high), (short, long) = _KNOWN_RATIOS, _KNOWN_DURATIONS
    in_range = (momentum_ratio >= low) & (momentum_ratio <= high)
    in_range &= (duration_ratio >= short) & (duration_ratio <= long)
    is_long = np.logical_not(is_short(momentum_ratio, granules))
    return in_range & is_long & (granules <= _KNOWN_GRANULES)


def is_calibrated(scene: Scene) -> bool:
    """Return whether one run of a scene is as accurate as its plan says, without a second one."""
    pulse, granules = scene.pulse, scene.chain.granules
    if pulse is None or not scene.is_plain or scene.run.end_time is not None:
        return False
    return bool(is_known(scene.momentum_ratio, pulse.duration_ratio, granules))


@functools.lru_cache
def cheapest(rtol: float, checked: bool = True, hard: bool = False) -> Plan:
    """Return the cheapest plan for peaks of relative accuracy ``rtol``, TIGHTEST to LOOSEST.

    Where ``checked``, a second run will estimate the error. ``hard`` halves steps near every
    contact that hardly overlaps, for scenes that amplify errors and runs that end while the wave
    still presses contacts: at the front the force grows tenfold within a granule's distance, and
    the place of the front depends on all steps before. Errors of the worst of the random scenes:
    3e-9 (h / 0.2)^6.5, and 2e-4 times the refinement tolerance.
    """
    tight = max(0.0, -math.log10(rtol) - 6)
    aim = rtol / 2.4  # the rest of the error has no estimate
    if hard:
        aim = min(aim / _HARD_RTOL_RATIO, _HARD_RTOL)
    cosine_steps = 8 if rtol > 1e-8 else 16
    step = min(0.2 * (aim / 3e-9) ** (1 / 6.5), _LONGEST_STEP)
    if not checked and rtol >= _UNREFINED_RTOL:
        plain = Walker(SRKN_11B, 0.0, cosine_steps, 0.0)
        error = _UNCHECKED_ERROR_RATIO * rtol
        return Plan("srkn-11b", plain, _LONGEST_STEP, error, SAFETIES["planned"])
    starting = math.inf if hard else 4 + 2 * tight
    walker = Walker(SRKN_11B, 5e3 * aim, cosine_steps, starting)
    if checked:
        step = min(_STEP_RATIO * step, _LONGEST_CHECKED_STEP)
    error = (_CHECKED_ERROR_RATIO if checked else _UNCHECKED_ERROR_RATIO) * rtol
    return Plan("srkn-11b", walker, step, error, SAFETIES["erratic" if hard else "planned"])


def first_plan(rtol: float, hard: bool, first: bool) -> Plan:
    """Return the plan that is tried first; ``hard``: see ``cheapest``, ``first``: first pulses.

    For first pulses of hard scenes its steps are not halved near every contact: it costs half of a
    hard plan or less, and its error bound is nearly always as small as wanted.
    """
    if not (hard and first):
        return cheapest(rtol, hard=hard)
    accuracy = min(max(rtol / _FIRST_RTOL_RATIO, TIGHTEST), _LARGEST_FIRST_RTOL)
    plan, safety = cheapest(accuracy), SAFETIES["tried first"]
    return replace(plan, error=_ERRATIC_ERROR_RATIO * plan.error, safety=safety)


def round_off(evaluations: Quantity) -> Any:
    """Upper bound of the error of the peaks by rounding, from force evaluations; also of arrays."""
    return 4 * sys.float_info.epsilon * evaluations**0.5


def check(rtol: float) -> None:
    """Raise a SceneError for an accuracy that is not a number from 1e-10 to 0.01."""
    allowed = f"must be a number from {TIGHTEST:g} to {LOOSEST:g}"
    require(is_finite(rtol) and TIGHTEST <= rtol <= LOOSEST, "rtol", rtol, allowed)
