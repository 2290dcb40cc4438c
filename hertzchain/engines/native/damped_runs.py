"""Scenes beyond the uniform chain by adaptive steps: one run, and runs of a wanted accuracy."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.native.equations import Chain
from hertzchain.engines.native.plan import round_off
from hertzchain.engines.native.simulation import (
    MOVING,
    Run,
    Simulation,
    finished,
    leg_rows,
    room_for,
    start_of,
)
from hertzchain.errors import RunFailed, TooExpensive
from hertzchain.limits import Deadline, refuse_memory
from hertzchain.observables.error_bound import SAFETIES, ContactErrors, Peaks
from hertzchain.observables.first_pulse import LATEST, Signals, finds_end, usual_end
from hertzchain.observables.samples import Recorder
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg

if TYPE_CHECKING:
    from hertzchain.engines.native.damped_kernel import Method
    from hertzchain.engines.native.elastic_chain import Record
    from hertzchain.observables.observer import Watch

LONGEST = 0.8
"""Longest step, natural time units of the fastest contact."""

LOOSEST, TIGHTEST = 2e-5, 7e-13
"""Tolerances: a thousandth of the wanted accuracy is enough above; below is round-off."""

_FIRST_TOLERANCE_RATIO = 0.02
"""The first tolerance over the wanted accuracy: in 19 of 20 random chains no second is needed."""

_COARSEST_RATIOS, _COARSER_RATIOS = (30.0, 1.5), (4.0, 1.2)
"""Tolerance and longest step of the two runs that give the error, over those of the run itself: one
difference may be small by chance, but seldom both."""

_DIFFERENCE_WEIGHTS = 0.15, 1.0
"""Weights of their differences (chosen): that of the much coarser run is ten times as large
where errors go as the tolerance."""

_HIDDEN_ERROR_RATIO, _LEAST_HIDDEN_ERROR = 2.5, 2e-11
"""Error that no difference shows, over the tolerance, and what is added to that: with the tightest
one it was 1.5e-11 once."""

_MOST_TOLERANCES = 5
"""Most tolerances that are tried."""

_NUMBERS_PER_GRANULE = 51
"""Numbers that a run keeps for each granule."""

_ZERO_PRODUCT = 1e-14
"""Limit below which products of coefficients are 0 up to round-off; all others are far above."""


class TooMuchWork(RunFailed):
    """A run takes more work than allowed, or its steps do not advance."""


class Adaptive(NamedTuple):
    """Limits of adaptive steps, natural units.

    ``tolerance`` is the error of the velocities in a step over the largest velocity. Steps may be
    ``longer``, at most 1.5 times, than ``longest``, also those that strong dampers allow. The run
    ends after ``most_work`` force evaluations of a granule; a step counts as further 500.
    """

    tolerance: float
    longest: float
    longer: float = 1.0
    most_work: float = math.inf


def integrate_damped(
    chain: Chain, rows: FloatArray, start: FloatArray, steps: Adaptive,
    record: Record | None = None, control: FloatArray | None = None, watch: Watch | None = None,
    usual: float = math.nan,
) -> Simulation:  # fmt: skip
    """Integrate a chain of damped contacts with the compiled kernel.

    ``rows`` are legs of the applied force from ``simulation.leg_rows``; ``start`` is displacement
    and velocity, shape (2, granules), or (0, 0) for a chain at rest. Record, control, watch and
    usual are as for ``elastic.march``.
    """
    from hertzchain.engines.native import damped_kernel
    from hertzchain.engines.native.damped_kernel import Steps, at_the_start
    from hertzchain.engines.native.elastic_chain import Seen, Start

    granules, contacts = chain.inverse_mass.size, chain.stiffness.size
    record = room_for() if record is None else record
    # The front of a wave moves granules smoothly, but not across a gap or under a static load.
    has_front = start.size == 0 and not chain.gap.any() and not chain.constant.any()
    has_front = has_front and chain.pushed == 0
    force, time = np.zeros(contacts), np.full(contacts, np.nan)
    method = _method()
    state = at_the_start(granules, method.nodes.size)
    outcome = damped_kernel.march(
        Steps(
            rows, method, steps.tolerance, damped_kernel.SLOWEST, steps.longer * steps.longest,
            steps.longer * damped_kernel.STABLE, steps.most_work,
        ),
        chain.padded(),
        Start(
            start if start.size else np.zeros((2, granules)), MOVING if has_front else granules
        ),
        state, Seen(force, time, record), watch, usual,
        np.zeros(3) if control is None else control,
    )  # fmt: skip
    peaks = Peaks(force, time, time < outcome.end)
    return Simulation.of(outcome, state.start.u[:granules], state.start.v[:granules], peaks)


@functools.cache
def _method() -> Method:
    """Return the coefficients of DOP853 in the form of the kernel."""
    from scipy.integrate import DOP853

    from hertzchain.engines.native.damped_kernel import Method

    rows = np.concatenate([DOP853.A, [DOP853.B]])
    squares = rows @ rows[:-1]
    squares[abs(squares) < _ZERO_PRODUCT] = 0.0
    return Method(np.array(DOP853.C), rows, squares, DOP853.E5[:-1], DOP853.E3[:-1])


def simulate_damped(
    scene: Scene, tolerance: float, deadline: Deadline, recorder: Recorder | None = None,
    legs: Sequence[Leg] | None = None, longer: float = 1.0, most_work: float = math.inf,
    first: bool = False,
) -> Simulation:  # fmt: skip
    """Integrate a scene once; ``first``: first pulses are wanted, and the end if it is not given.

    ``legs`` [s, N] have the applied force, by default that of the scene; with ``longer`` steps may
    be longer by that factor. Raises StepUnstable if the motion diverges, TooExpensive if the run
    has taken too long, TooMuchWork after ``most_work`` force evaluations of a granule.
    """
    from hertzchain.engines.native import elastic_chain

    if deadline.left <= 0:
        raise deadline.passed()
    recorded = 0 if recorder is None else 3 * recorder.time.size
    try:
        refuse_memory(8.0 * scene.bodies * (_NUMBERS_PER_GRANULE + recorded))
    except TooExpensive as problem:
        if most_work < math.inf:  # another method takes less
            raise TooMuchWork(str(problem)) from problem
        raise
    units, usual, end_time = scene.units, math.nan, scene.end_time
    if first and finds_end(scene):
        usual, end_time = usual_end(scene), LATEST * end_time
    # Steps are cut by the integrator: of the legs only the corners count.
    rows = leg_rows(legs or scene.until(end_time).schedule(end_time), units)
    signals = Signals.of(scene).in_units(units) if first else None
    record, control = room_for(recorder), np.zeros(3)
    steps = Adaptive(tolerance, LONGEST * scene.contact_time / units.time, longer, most_work)
    chain, start = Chain.of(scene), start_of(scene)

    def integrate() -> tuple[Simulation, Watch | None]:
        watch = None if signals is None else signals.watch()
        return integrate_damped(chain, rows, start, steps, record, control, watch, usual), watch

    run = finished(integrate, control, deadline)
    if run.status == elastic_chain.STUCK:
        raise TooMuchWork(
            "the native run does not advance: a contact opens and closes within"
            " rounding errors; ask for less accuracy, or for a shorter end_time"
        )
    if run.status == elastic_chain.TOO_MUCH:
        raise TooMuchWork("the native run takes more work than it may")
    return run


Integrate = Callable[[float, float, bool], Simulation]


def first_tolerance(rtol: float) -> float:
    """Tolerance that is tried first for a wanted accuracy of the peaks."""
    return max(min(_FIRST_TOLERANCE_RATIO * rtol, LOOSEST), TIGHTEST)


def accurate(integrate: Integrate, rtol: float) -> tuple[Simulation, ContactErrors]:
    """Return a run whose bounds of errors are at most ``rtol``, in a few tries, and these bounds.

    ``integrate`` makes a run from a tolerance, a factor for the longest step, and whether this run
    may be the result or only gives the error of another. The bound of the returned run may be
    larger: collisions can multiply rounding errors.
    """
    tolerance = first_tolerance(rtol)
    for left in reversed(range(_MOST_TOLERANCES)):
        rough, coarse = (
            integrate(looser * tolerance, longer, False)
            for looser, longer in (_COARSEST_RATIOS, _COARSER_RATIOS)
        )
        run = integrate(tolerance, 1.0, True)
        differences = [run.peaks.differences(other.peaks) for other in (rough, coarse)]
        rest = _HIDDEN_ERROR_RATIO * tolerance + _LEAST_HIDDEN_ERROR + round_off(run.evaluations)
        errors = SAFETIES["adaptive"].bounds(differences, _DIFFERENCE_WEIGHTS, rest)
        bound = errors.wanted
        if bound <= rtol or tolerance <= TIGHTEST or not left:
            break
        tolerance = max(tolerance * max(0.5 * rtol / bound, 1e-3), TIGHTEST)
    return run, errors


def accurate_enough(
    scene: Scene, rtol: float, deadline: Deadline, recorder: Recorder | None = None,
    most_work: float = math.inf, first: bool = False,
) -> Run:  # fmt: skip
    """Return a run of the wanted accuracy, if it can be reached.

    The recorder has the history of that run, which is always the last. Raises TooMuchWork if the
    first and coarsest run takes more than ``most_work`` force evaluations of a granule, or another
    one more than five times as many.
    """
    allowed = iter((most_work,))

    def integrate(tolerance: float, longer: float, may_be_last: bool) -> Simulation:
        nonlocal scene
        kept, most = recorder if may_be_last else None, next(allowed, 5 * most_work)
        run = simulate_damped(
            scene, tolerance, deadline, kept, longer=longer, most_work=most, first=first
        )
        if first and finds_end(scene):
            scene = scene.until(run.end * scene.units.time)
        return run

    return Run("dop853", LONGEST * scene.contact_time, *accurate(integrate, rtol))
