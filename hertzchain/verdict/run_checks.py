"""Checks of a run: against native at the same steps, against the reference, and balances."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.external.accuracy import DAMPED_READINGS
from hertzchain.engines.native.backend import by_velocity_verlet
from hertzchain.engines.native.plan import METHODS
from hertzchain.errors import RunFailed
from hertzchain.limits import TIME_LIMIT, Deadline
from hertzchain.observables.error_bound import highest_rate
from hertzchain.observables.peaks import judged_contacts, largest_difference
from hertzchain.observables.result import Result
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg
from hertzchain.scene.shocks import SHAPES
from hertzchain.verdict.check import Check, Kind, farthest, unmeasured, within

_ADVICE = "do not trust its error estimate; take shorter steps"
PEAKS = Kind("peaks against the reference", _ADVICE)
FIRST_PULSES = Kind("first pulses against the reference", _ADVICE)
GAUGES = Kind("gauges against the reference", _ADVICE)
ARRIVALS = Kind("arrivals against the reference [s]", _ADVICE)

REFERENCE_ERROR = Kind(
    "error of the reference",
    "the reference cannot judge this scene: a shorter end_time or chain leaves it more digits",
)
AS_WRITTEN = Kind(
    "compiled against Eq. 1 as written",
    "do not use this result; the compiled loops and hertzchain/engines/native/equations.py"
    " disagree: please report the scene",
)

_COMPARED_ERROR = 0.1
"""Sum of two errors from which on a contact is not compared: one has hardly a right digit."""


def reference_checks(result: Result, reference: Result) -> list[Check]:
    """Check a run against the reference, within the sum of both error estimates of each contact.

    First pulses and their arrivals are checked where both runs have them, and peaks of those
    contacts for which both have a right digit.
    """
    reason = "its own error estimate plus that of the reference"
    off = _differences(result.peak_force, reference.peak_force)
    of_peaks = result.peak_errors + reference.peak_errors
    peaks = _at_worst(PEAKS, result, off, of_peaks, reason)
    pulses, true, errors, true_errors = (
        result.first_pulses, reference.first_pulses, result.errors, reference.errors
    )  # fmt: skip
    if pulses is None or true is None or errors is None or true_errors is None:
        return [peaks]
    if errors.first is None or true_errors.first is None:
        return [peaks]
    if errors.arrival is None or true_errors.arrival is None:
        return [peaks]
    both = true.is_clear & np.isfinite(true.force)
    if not both.any():
        return [peaks, *_gauge_checks(result, reference, reason)]
    off = np.where(both, np.abs(pulses.force / true.force - 1.0), np.nan)
    allowed = errors.first + true_errors.first
    # A run without a pulse has no error; a run whose pulse has no right digit has one.
    none = np.isnan(pulses.force) & np.isnan(errors.first)
    # Fraction of the largest first pulse from which on both runs must have one: twice the least
    lacks = both & none & (true.force > 2e-3 * np.max(true.force[both], initial=0.0))
    off, allowed = np.where(lacks, 1.0, off), np.where(lacks, true_errors.first, allowed)
    compared = both & (allowed < _COMPARED_ERROR)
    late = np.where(compared, np.abs(pulses.arrival - true.arrival), np.nan)
    delay = errors.arrival + true_errors.arrival
    return [
        *([] if peaks.measured is None else [peaks]),
        _at_worst(FIRST_PULSES, result, off, allowed, reason),
        _at_worst(ARRIVALS, result, late, delay, reason, np.inf),
        *_gauge_checks(result, reference, reason),
    ]


def _gauge_checks(result: Result, reference: Result, reason: str) -> list[Check]:
    """Check the force of the gauge that is nearest to its tolerance; nothing without gauges."""
    pairs = [
        (abs(pulse.force / true.force - 1.0), pulse.force_error + true.force_error, pulse.gauge)
        for pulse, true in zip(result.gauges, reference.gauges, strict=True)
        if np.isfinite(pulse.force_error + true.force_error)
    ]
    if not pairs:
        return []
    off, allowed, gauge = max(pairs, key=lambda pair: pair[0] / pair[1])
    words = f"{reason}; nearest to it at {gauge.key} {gauge.number}"
    return [within(GAUGES, result.backend, off, 0.0, allowed, words)]


def _differences(peak_force: FloatArray, expected: FloatArray) -> FloatArray:
    """Relative differences of judged peaks, shape (contacts,); NaN where one is not judged."""
    judged = judged_contacts(expected)
    if not judged.any():  # then any force is entirely wrong
        return np.where(peak_force > 0, 1.0, 0.0)
    relative = np.abs(peak_force / np.where(judged, expected, np.nan) - 1.0)
    return np.asarray(np.where(judged, relative, np.nan), np.float64)


def _at_worst(
    kind: Kind, result: Result, off: FloatArray, allowed: FloatArray, reason: str,
    limit: float = _COMPARED_ERROR,
) -> Check:  # fmt: skip
    """Return the check of the contact nearest to its tolerance, or farthest beyond it."""
    with np.errstate(invalid="ignore", divide="ignore"):
        share = np.where(allowed < limit, np.where(off == 0, 0.0, off / allowed), np.nan)
    if np.isnan(share).all():
        return unmeasured(
            kind, result.backend, "no contact has a number with a right digit in both runs"
        )
    k = int(np.nanargmax(share))
    words = f"{reason}; nearest to it at {result.scene.contact_name(result.scene.contacts[k])}"
    return within(kind, result.backend, float(off[k]), 0.0, float(allowed[k]), words)


def yardstick_check(reference: Result) -> Check:
    """Check that the reference is accurate enough: with a large error anything would pass."""
    # Largest error estimate of the reference; measured 1e-11 to 6e-10, LM_ratio 1e-4 to 100
    return within(
        REFERENCE_ERROR,
        reference.backend,
        reference.wanted_error,
        0.0,
        1e-6,
        "what is asked of the others, 1e-6; a reference that says more of its own error judges"
        " nothing",
    )


def is_quickly_written(reference: Result) -> bool:
    """Return whether Eq. 1 as it is written takes about a second, by the reference's forces."""
    # Force evaluations of the reference up to which Eq. 1 as written is integrated by default: some
    # two seconds in SciPy; the cost of one of damped contacts over that; and the number of granules
    # that doubles the time of an evaluation (all measured).
    harder = 1.0 if reference.scene.contact is None else 7.0
    size = 1 + reference.scene.chain.granules / 1000.0
    return reference.force_evaluations * size * harder <= 250_000.0


def as_written_check(reference: Result, time_limit: float = TIME_LIMIT) -> Check:
    """Check the compiled reference against Eq. 1 as ``equations`` writes it, by SciPy."""
    from hertzchain.engines.native.as_written import judging_peaks

    scene = reference.scene
    try:
        peaks, error = judging_peaks(scene, Deadline(time_limit))
    except RunFailed as problem:
        return unmeasured(AS_WRITTEN, reference.backend, str(problem))
    off = _differences(np.asarray(reference.peak_force / scene.units.force), peaks)
    reason = "its own error estimate plus that of SciPy"
    return _at_worst(AS_WRITTEN, reference, off, reference.peak_errors + error, reason)


VELOCITY_VERLET = METHODS["velocity-verlet"].walker

IMPULSE_ERROR = 0.1  # the same for impulses of walls and pistons; measured 0.005, for work 0.03
# factor on the growth of one small difference at the start: another may grow more
_GROWTH_FACTOR = 3.0
GROSS_ERROR = 0.01  # a wider tolerance shows only gross errors: right decks differ by up to 0.35
_STATE_ROUND_OFF = 1e-12  # error of the states without any by coordinates
# relative tolerance; steps end at the corners, so every method has the whole impulse
MOMENTUM_ERROR = 1e-12

_CHAIN_ADVICE = (
    "do not use this result; at the same steps it is another chain: look at what differs first in"
    " the checks above it, then at the force law and the integrator of the deck"
)

SAME_STEPS = tuple(
    Kind(f"{what}, same steps", _CHAIN_ADVICE) for what in ("displacement", "velocity", "peaks")
)
SAME_STEPS_REFUSED = Kind("same steps")

MOMENTUM = Kind(
    "momentum [N s]",
    "do not use this result; the applied momentum is not that of the pulse, or momentum was lost",
)
ENERGY = Kind(
    "energy [J]",
    "do not use this result; something does work, or takes it, that is not in Eq. 1: damping,"
    " another law, or steps too long",
)


def code_checks(result: Result, reference: Result, time_limit: float) -> list[Check]:
    """Return checks of another code: against native at the same steps, the reference and itself."""
    same_steps = []
    if result.scheme == "velocity-verlet":  # native has this scheme too; other schemes have no twin
        try:
            same_steps = same_steps_checks(result, time_limit)
        except RunFailed as problem:
            same_steps = [unmeasured(SAME_STEPS_REFUSED, result.backend, str(problem))]
    return [*same_steps, *reference_checks(result, reference), *balance_checks(result)]


def same_steps_checks(result: Result, time_limit: float = TIME_LIMIT) -> list[Check]:
    """Check a code against native velocity Verlet at the same steps, within a time limit [s]."""
    scene, units, damped = result.scene, result.scene.units, result.scene.contact is not None
    is_extrapolated = result.method.endswith("extrapolated")
    legs, deadline = _legs(result, is_extrapolated), Deadline(time_limit)
    twin = by_velocity_verlet(scene, legs, deadline)
    expected = np.asarray(twin.peaks.force)
    if is_extrapolated:
        coarse = by_velocity_verlet(scene, [leg.in_steps(leg.steps // 2) for leg in legs], deadline)
        expected = expected + (expected - coarse.peaks.force) / (1 if damped else 3)  # 2^order - 1
    step = result.dt / scene.contact_time
    lost = result.lost_digits.bound if result.lost_digits is not None else 0.0
    # Error of the peaks by readings at steps of 0.01 natural units; goes as 1 / dt
    # Error of the peaks over dt^4 [natural units]: velocities are not slopes
    between = 7e-9 * max(1.0, 0.01 / step) + 0.1 * step**4
    if damped:
        # Overlaps bend where contacts close or open; readings there have errors of this size.
        # Extrapolation multiplies the errors of both runs, and native reads at other times: the
        # bound of the run itself includes that. States are the stricter test.
        readings = math.inf if is_extrapolated else DAMPED_READINGS * step**2
        between += min(readings, result.error_estimate)
    elif not scene.is_plain:
        # A contact that opens next to one at its peak increases the error by readings.
        # Error of the peaks over dt^2 [natural units], by the place of readings
        # Error of the peaks by readings at the shortest steps; measured 1.1e-7 at 0.01
        between += min(max(1e-7, 0.02 * step**2), result.error_estimate)
    # Steps from which on rounding errors of damped granules add up to more, as a random walk does:
    # after a million steps of granules with dashpots 1.5 times the tolerance below was measured
    more = math.sqrt(max(1.0, result.steps / 300_000)) if damped else 1.0
    # Error of the state over the bound of coordinates for peaks; measured 1.7
    state, peaks = _STATE_ROUND_OFF + 10.0 * lost * more, between + lost
    # The largest force of a contact that is still being pressed is one of the state at the end.
    expected = np.where(result.peak_passed | ~result.peak_passed.any(), expected, 0.0)
    peak_force = np.where(expected > 0, result.peak_force / units.force, 0.0)
    first = scene.first_granule
    motions = [
        (result.displacement / units.length, twin.displacement[first:]),
        (result.velocity / units.velocity, twin.velocity[first:]),
    ]
    measured = _differences_of([*motions, (peak_force, expected)], damped)
    remark = ""
    reason = "same scheme, same steps: only round-off may differ, and it adds up over the steps"
    if lost > 0 and not (max(measured[:2]) <= state and measured[2] <= peaks):
        grown = _grown(scene, legs, lost * float(np.max(twin.peaks.force)) ** (2 / 3), deadline)
        if max(grown) > lost:
            state = max(state, _GROWTH_FACTOR * max(grown[:2]))
            peaks = max(peaks, between + _GROWTH_FACTOR * grown[2])
            reason += f"; late collisions multiply any difference by {max(grown) / lost:.0f}"
            if max(state, peaks) > GROSS_ERROR:
                remark = "late collisions amplify rounding errors, so that only gross errors show"
    judged = judged_contacts(expected)
    worst = farthest(peak_force / np.where(judged, expected, np.inf), judged.astype(np.float64))
    places = [f"granule {farthest(*motion) + 1}" for motion in motions]
    places.append(scene.contact_name(scene.contacts[worst]))
    checks = []
    for kind, difference, tolerance, place in zip(
        SAME_STEPS, measured, (state, state, peaks), places, strict=True
    ):
        why = f"{reason}; largest at {place}"
        check = within(kind, result.backend, difference, 0.0, tolerance, why)
        checks.append(replace(check, remark=remark if tolerance > GROSS_ERROR else ""))
    return checks


def _legs(result: Result, is_extrapolated: bool) -> Sequence[Leg]:
    """Return the legs of a run, those of the finer run if its peaks are extrapolated.

    The finer run has the steps of a coarse run times a power of 2; the result counts both runs.
    """
    scene = result.scene
    finer, steps = 1, 0
    while is_extrapolated and 3 * steps < 2 * result.steps:
        finer *= 2
        legs = [leg.in_steps(finer * leg.steps) for leg in scene.schedule(finer * result.dt)]
        steps = sum(leg.steps for leg in legs)  # never less for a coarser run
        if 3 * steps == 2 * result.steps:
            return legs
    return scene.schedule(result.dt)


def _grown(scene: Scene, legs: Sequence[Leg], nudge: float, deadline: Deadline) -> list[float]:
    """Return differences of displacement, velocity and peaks after a small one at the start.

    ``nudge`` is the difference of places at the start [natural units]. The result is the largest
    of a few trials.
    """
    rng, largest = np.random.default_rng(0), np.zeros(3)
    # Number of differences tried at the start (chosen): one may grow little by chance
    for _ in range(3):
        start = np.zeros((2, scene.bodies))
        start[0] = nudge * rng.uniform(-1, 1, scene.bodies)
        runs = [by_velocity_verlet(scene, legs, deadline, start=each) for each in (start, -start)]
        pairs = zip(
            *((run.displacement, run.velocity, run.peaks.force) for run in runs), strict=True
        )
        largest = np.maximum(largest, _differences_of(pairs, scene.contact is not None))
    return largest.tolist()


def _differences_of(
    pairs: Iterable[tuple[FloatArray, FloatArray]], damped: bool
) -> tuple[float, float, float]:
    """Return the largest differences of displacements, of velocities and of judged peaks.

    Those of motions are relative to the largest expected value. Granules that damping has stopped
    still have the rounding errors of their coordinates: there it is at least one natural unit.
    """
    *motions, peaks = pairs
    scales = [max(float(np.max(np.abs(expected))), float(damped)) for _, expected in motions]
    u, v = (
        float(np.max(np.abs(measured - expected))) / (scale if scale > 0 else 1.0)
        for (measured, expected), scale in zip(motions, scales, strict=True)
    )
    return u, v, largest_difference(*peaks)


def balance_checks(result: Result) -> list[Check]:
    """Check momentum against the impulse, and energy against the work done by the shock."""
    balance, scene, piston = result.balance, result.scene, result.scene.piston
    units, given, error = scene.units, scene.largest_impulse, result.error_estimate
    # If the run ends before the shock, states have only rounding errors.
    energy = (2 * error + 1e-12) * balance.work + _STATE_ROUND_OFF**2 * units.energy
    # Relative error for a step: codes add up the time; measured 5e-18 to 1e-17
    momentum = MOMENTUM_ERROR + 2e-17 * result.steps
    reason = "steps end at the corners of the pulse, so its impulse is exact"
    inexact = {
        "the force on the wall is integrated from its overlap": scene.wall is not None,
        "the force on the near wall is integrated from its overlap": scene.near_wall is not None,
        "forces on fixed granules are integrated from overlaps": scene.chain.fixed is not False,
        "the run ends within the pulse": scene.end_time < scene.pulse_end,
        "the force of the piston is integrated from its overlap": piston is not None,
    }
    for why in (why for why, is_so in inexact.items() if is_so):
        reason = f"its own error estimate, as {why}"
    momentum += error if any(inexact.values()) else 0.0
    by_piston = 0.0  # work of the largest force all the time
    if piston is not None:
        pushed = float(np.max(result.peak_force))
        by_piston = pushed * piston.distance(scene.end_time)
        given += pushed * scene.end_time
        energy += 2 * error * by_piston
    if result.scheme == "velocity-verlet":
        energy += _work_error(result)
    if result.scheme == "velocity-verlet" and scene.contact is not None:
        rate = highest_rate(scene) * result.dt
        # Error over dampers' energy times step over their time; measured 0.5
        energy += rate * balance.dissipated + IMPULSE_ERROR * rate * by_piston
        if piston is not None or scene.wall is not None or scene.holds:
            # Peaks can be more accurate than the motion: with dashpots at first touch, or at the
            # end.
            reason += ", and dampers by velocities of half a step before"
            momentum += IMPULSE_ERROR * rate
    uneven = _impulse_error(result) if result.scheme == "velocity-verlet" else 0.0
    return [
        within(
            MOMENTUM,
            result.backend,
            balance.momentum,
            balance.impulse,
            momentum * given + uneven + _STATE_ROUND_OFF**2 * units.momentum,
            reason,
        ),
        within(
            ENERGY,
            result.backend,
            balance.energy + balance.dissipated,
            balance.work,
            energy,
            "energy goes as force to the power 5/3, so at most twice its own error estimate; and"
            " what velocity Verlet makes of the work of a short pulse",
        ),
    ]


def _impulse_error(result: Result) -> float:
    """Upper bound of the error of velocity Verlet's impulse on the ramps [N s].

    The error is that of the trapezoidal rule: dt^2/12 times the change of the rate over a ramp
    (Euler and Maclaurin), plus a tenth for higher orders; 0 on a ramp whose two halves are alike.
    """
    changes = (
        float(ramp.force_rate(ramp.end) - ramp.force_rate(ramp.start))
        for ramp in result.scene.ramps
        if SHAPES[ramp.shape].area != 0.5
    )
    return 1.1 * result.dt**2 / 12 * abs(math.fsum(changes))


def _work_error(result: Result) -> float:
    """Upper bound of the error of velocity Verlet's work on the ramps [J].

    The displacement of a step lacks F' dt^3 / 6m, so the work of a ramp lacks the change of F^2
    dt^2 / 12m; the bound is twice that. It matters for short pulses, which do little work.
    """
    legs, mass = result.scene.schedule(result.dt), result.scene.pushed_mass
    return math.fsum(
        leg.dt**2 / (6 * mass) * abs(leg.ramp.end_force**2 - leg.ramp.start_force**2)
        for leg in legs
        if leg.ramp is not None
    )
