"""What a run found: against native at the same steps, against the reference, and its balances."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hertzchain.arrays import Array, FloatArray
from hertzchain.engines.external.step_error import DAMPED_READINGS
from hertzchain.engines.native import METHODS, Simulation, simulate, simulate_damped_verlet
from hertzchain.errors import RunFailed
from hertzchain.limits import TIME_LIMIT, Deadline
from hertzchain.observables.error_bound import highest_rate
from hertzchain.observables.peaks import judged_contacts, largest_difference
from hertzchain.observables.result import Result
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg
from hertzchain.verdict.check import Check, Kind, farthest, unmeasured, within

VELOCITY_VERLET = METHODS["velocity-verlet"].walker

SAME_STEPS_STATE = 10.0  # of the state, times what coordinates cost peaks at most; 1.7 measured
SAME_STEPS_PEAKS = 7e-9  # of the peaks at steps of 0.01 natural units, for reading; goes as 1 / dt
LONG_STEPS_PEAKS = 0.1  # of the peaks, times dt^4 [natural units]: velocities are no slopes
READINGS_WITH_TERMS = 0.02  # of the peaks, times dt^2 [natural units]: as readings are laid
LEAST_WITH_TERMS = 1e-7  # of the peaks, by readings at the shortest steps; 1.1e-7 measured at 0.01
DAMPER_ERROR = 1.0  # of the energy that dampers take, times steps over their time; 0.5 measured
IMPULSE_ERROR = 0.1  # the same for impulses of walls and pistons; 0.005 measured, of work 0.03
_ONE_OF_MANY = 3.0  # times the growth of one small difference at the start: another grows more
_NUDGES = 3  # differences at the start that are tried: one alone may grow little by chance (chosen)
MUCH_GROWN = 0.01  # a wider tolerance shows gross errors only: right decks differ by up to 0.35
_ROUND_OFF = 1e-12  # of the states: what is left where coordinates cost nothing
_HALVINGS = 20  # of the steps of extrapolated runs, at most that are looked for (chosen)
MOMENTUM_ERROR = 1e-12  # relative; steps end at the corners, so every method has the whole impulse
MOMENTUM_OF_A_STEP = 2e-17  # relative, times steps: codes add up the time; 5e-18 to 1e-17 measured
YARDSTICK = 1e-6  # of the reference's estimate; 1e-11 to 6e-10 measured, LM_ratio 1e-4 to 100

_OTHER_CHAIN = (
    "do not use this result; at the same steps it is another chain: look at what differs first in"
    " the checks above it, then at the force law and the integrator of the deck"
)

SAME_STEPS = tuple(
    Kind(f"{what}, same steps", _OTHER_CHAIN) for what in ("displacement", "velocity", "peaks")
)
SAME_STEPS_REFUSED = Kind("same steps")
PEAKS = Kind("peaks against the reference", "do not trust its error estimate; take shorter steps")
REFERENCE_ERROR = Kind(
    "error of the reference",
    "the reference cannot judge this scene: a shorter end_time or chain leaves it more digits",
)
MOMENTUM = Kind(
    "momentum [N s]",
    "do not use this result; what it was pushed with is not the pulse, or it was lost on the way",
)
ENERGY = Kind(
    "energy [J]",
    "do not use this result; something does work, or takes it, that is not in Eq. 1: damping,"
    " another law, or steps too long",
)


def code_checks(result: Result, reference: Result, time_limit: float) -> list[Check]:
    """What another code found: against native at the same steps, the reference and itself."""
    same_steps = []
    if result.scheme == "velocity-verlet":  # native steps by it, too; other schemes have no twin
        try:
            same_steps = same_steps_checks(result, time_limit)
        except RunFailed as problem:
            same_steps = [unmeasured(SAME_STEPS_REFUSED, result.backend, str(problem))]
    return [*same_steps, reference_check(result, reference), *balance_checks(result)]


def same_steps_checks(result: Result, time_limit: float = TIME_LIMIT) -> list[Check]:
    """Another code against native velocity Verlet at the same steps, within a time limit [s]."""
    scene, units = result.scene, result.scene.units
    legs = _legs(result)
    deadline = Deadline(time_limit)
    twin = _verlet(scene, legs, deadline)
    expected = _twin_peaks(result, legs, twin, deadline)
    step = result.dt / scene.contact_time
    lost = result.lost_digits.bound if result.lost_digits is not None else 0.0
    between = SAME_STEPS_PEAKS * max(1.0, 0.01 / step) + LONG_STEPS_PEAKS * step**4
    if scene.contact is not None:
        # Contacts that begin or end bend overlaps: as much as readings cost there. Extrapolation
        # multiplies what they cost both runs, and native reads at other times: the bound of the
        # run itself counts that. States are the stricter test.
        readings = math.inf if _is_extrapolated(result) else DAMPED_READINGS * step**2
        between += min(readings, result.error_estimate)
    elif not scene.is_plain:
        # A contact that opens next to one that is pressed most: readings see that less well.
        readings = max(LEAST_WITH_TERMS, READINGS_WITH_TERMS * step**2)
        between += min(readings, result.error_estimate)
    # What has come to rest by damping still has the rounding errors of its coordinates.
    least = 0.0 if scene.contact is None else 1.0
    state, peaks = _ROUND_OFF + SAME_STEPS_STATE * lost, between + lost
    measured = (
        _largest(result.displacement / units.length, twin.state.displacement, least),
        _largest(result.velocity / units.velocity, twin.state.velocity, least),
        largest_difference(result.all_peaks / units.force, expected),
    )
    remark = ""
    reason = "same scheme, same steps: only round-off may differ, and it adds up over the steps"
    if lost > 0 and not (max(measured[:2]) <= state and measured[2] <= peaks):
        grown = _grown(scene, legs, twin, lost, deadline, least)
        if max(grown) > lost:
            state = max(state, _ONE_OF_MANY * max(grown[:2]))
            peaks = max(peaks, between + _ONE_OF_MANY * grown[2])
            reason += f"; late collisions multiply any difference by {max(grown) / lost:.0f}"
            if max(state, peaks) > MUCH_GROWN:
                remark = "late collisions amplify rounding errors, so that only gross errors show"
    places = (
        f"granule {farthest(result.displacement / units.length, twin.state.displacement) + 1}",
        f"granule {farthest(result.velocity / units.velocity, twin.state.velocity) + 1}",
        f"contact {_farthest_peak(result.all_peaks / units.force, expected)}",
    )
    checks = []
    for kind, difference, tolerance, place in zip(
        SAME_STEPS, measured, (state, state, peaks), places, strict=True
    ):
        why = f"{reason}; largest at {place}"
        check = within(kind, result.backend, difference, 0.0, tolerance, why)
        checks.append(replace(check, remark=remark if tolerance > MUCH_GROWN else ""))
    return checks


def _is_extrapolated(result: Result) -> bool:
    return result.method.endswith("extrapolated")


def _legs(result: Result) -> Sequence[Leg]:
    """The legs of a run, of the finer one where its peaks are extrapolated from two.

    Their steps are those of a coarse run times a power of 2, and both runs are counted.
    """
    scene = result.scene
    for halvings in range(1, _HALVINGS + 1) if _is_extrapolated(result) else ():
        legs = [
            replace(leg, steps=2**halvings * leg.steps)
            for leg in scene.schedule(2**halvings * result.dt)
        ]
        if 3 * sum(leg.steps for leg in legs) == 2 * result.steps:
            return legs
    return scene.schedule(result.dt)


def _twin_peaks(
    result: Result, legs: Sequence[Leg], twin: Simulation, deadline: Deadline
) -> FloatArray:
    """Peaks of native [natural units], extrapolated where those of the code are."""
    if not _is_extrapolated(result):
        return np.asarray(twin.peaks.force)
    coarse = [replace(leg, steps=leg.steps // 2) for leg in legs]
    gain = 3 if result.scene.contact is None else 1  # 2^order - 1
    other = _verlet(result.scene, coarse, deadline)
    return np.asarray(twin.peaks.force + (twin.peaks.force - other.peaks.force) / gain)


def _verlet(
    scene: Scene, legs: Sequence[Leg], deadline: Deadline, start: FloatArray | None = None
) -> Simulation:
    """Native velocity Verlet; a start other than rest moves all granules."""
    if scene.contact is not None:
        return simulate_damped_verlet(scene, legs, deadline, start=start)
    return simulate(
        scene, legs, VELOCITY_VERLET, window=start is None, deadline=deadline, start=start
    )


def _farthest_peak(peak_force: FloatArray, expected: FloatArray) -> int:
    """The contact, by the paper's number, whose peak differs most of those that are judged."""
    judged = judged_contacts(expected)
    return farthest(peak_force / np.where(judged, expected, np.inf), 1.0 * judged) + 2


def _grown(
    scene: Scene,
    legs: Sequence[Leg],
    twin: Simulation,
    lost: float,
    deadline: Deadline,
    least: float,
) -> tuple[float, float, float]:
    """Differences of displacement, velocity and peaks that collisions make of one at the start.

    ``lost`` is that, relative to the largest overlap. The largest differences of a few are given.
    """
    nudge = lost * float(np.max(twin.peaks.force)) ** (2 / 3)
    rng, found = np.random.default_rng(0), np.zeros(3)
    for _ in range(_NUDGES):
        start = np.zeros((2, scene.chain.granules))
        start[0] = nudge * rng.uniform(-1, 1, scene.chain.granules)
        nudged, other = (_verlet(scene, legs, deadline, each) for each in (start, -start))
        differences = (
            _largest(nudged.state.displacement, other.state.displacement, least),
            _largest(nudged.state.velocity, other.state.velocity, least),
            largest_difference(nudged.peaks.force, other.peaks.force),
        )
        found = np.maximum(found, differences)
    return float(found[0]), float(found[1]), float(found[2])


def _largest(measured: Array, expected: Array, least: float = 0.0) -> float:
    """Largest difference as a fraction of the largest value expected, or of ``least``."""
    largest = max(float(np.max(np.abs(expected))), least)
    difference = float(np.max(np.abs(measured - expected)))
    return difference / largest if largest > 0 else difference


def reference_check(result: Result, reference: Result) -> Check:
    """Peaks of a simulation against the reference: within what both say of their own error."""
    return within(
        PEAKS,
        result.backend,
        largest_difference(result.all_peaks, reference.all_peaks),
        0.0,
        result.error_estimate + reference.error_estimate,
        "its own error estimate plus that of the reference; largest at contact"
        f" {_farthest_peak(result.all_peaks, reference.all_peaks)}",
    )


def yardstick_check(reference: Result) -> Check:
    """Whether the reference is good enough to judge by: a wide error would let anything pass."""
    return within(
        REFERENCE_ERROR,
        reference.backend,
        reference.error_estimate,
        0.0,
        YARDSTICK,
        "what is asked of the others, 1e-6; a reference that says more of its own error judges"
        " nothing",
    )


def balance_checks(result: Result) -> list[Check]:
    """Momentum against the impulse, energy against the work done by the shock."""
    balance, scene = result.balance, result.scene
    units, given = scene.units, scene.largest_impulse
    energy = (2 * result.error_estimate + 1e-12) * balance.work
    energy += _ROUND_OFF**2 * units.energy  # where nothing has been pushed yet, states are rounded
    if result.scheme == "velocity-verlet":
        energy += _work_error(result)
        if scene.contact is not None:
            energy += DAMPER_ERROR * highest_rate(scene) * result.dt * balance.dissipated
    reason = "steps end at the corners of the pulse, so its impulse is exact"
    momentum = MOMENTUM_ERROR + MOMENTUM_OF_A_STEP * result.steps
    if scene.end_time < scene.pulse_end:
        reason = "its own error estimate, as the run ends within the pulse"
        momentum += result.error_estimate
    elif scene.wall is not None:
        reason = "its own error estimate, as the force on the wall is integrated from its overlap"
        momentum += result.error_estimate
    pushed = 0.0
    if scene.piston is not None:
        reason = "its own error estimate, as the force of the piston is integrated from its overlap"
        momentum = MOMENTUM_ERROR + MOMENTUM_OF_A_STEP * result.steps + result.error_estimate
        pushed = float(np.max(result.all_peaks))
        given += pushed * scene.end_time
        energy += 2 * result.error_estimate * pushed * scene.piston.distance(scene.end_time)
    if (
        (scene.piston is not None or scene.wall is not None)
        and result.scheme == "velocity-verlet"
        and scene.contact is not None
    ):
        # Peaks can be much better than the motion: that of a dashpot as it begins, or at the end.
        reason += ", and dampers by velocities of half a step before"
        missed = IMPULSE_ERROR * highest_rate(scene) * result.dt
        momentum += missed
        if scene.piston is not None:
            energy += missed * pushed * scene.piston.distance(scene.end_time)
    return [
        within(
            MOMENTUM,
            result.backend,
            balance.momentum,
            balance.impulse,
            momentum * given + _ROUND_OFF**2 * units.momentum,
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


def _work_error(result: Result) -> float:
    """Error of the work that velocity Verlet does on the ramps, at most [J].

    Its displacement over a step misses F' dt^3 / 6m, so the work over a ramp misses the change of
    F^2 dt^2 / 12m; twice that. It matters where the pulse is short and its work small.
    """
    legs, mass = result.scene.schedule(result.dt), result.scene.first_mass
    return math.fsum(
        leg.dt**2 / (6 * mass) * abs(leg.ramp.end_force**2 - leg.ramp.start_force**2)
        for leg in legs
        if leg.ramp is not None
    )
