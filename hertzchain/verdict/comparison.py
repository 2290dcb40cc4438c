"""The comparison: numbers of every oracle in, rows, checks and a verdict out.

Three kinds of disagreement are kept apart. What LAMMPS makes of the deck, number by number, may
differ from the scene by round-off only: that names what is wrong. LAMMPS, LIGGGHTS and Yade against
native velocity Verlet at the same steps may differ by round-off only: that says whether a deck
means Eq. 1. Each simulation against the reference differs by its discretisation error: that says
what its answer is worth. The formulas never decide.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from hertzchain import theory
from hertzchain.arrays import Array, FloatArray
from hertzchain.engines.lammps import Examination, Lammps
from hertzchain.engines.native import METHODS, Native, Simulation, simulate, simulate_in_numpy
from hertzchain.engines.registry import ENGINES, Simulator, compared_by_default, label_of, others
from hertzchain.errors import BackendMissing, OverlapTooLarge, RunFailed, TooExpensive, require
from hertzchain.limits import TIME_LIMIT, Deadline
from hertzchain.observables.peaks import SIGNIFICANT, largest_difference
from hertzchain.observables.result import Result
from hertzchain.scene.pulse import Pulse
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg
from hertzchain.theory import solitary_wave as exact

if TYPE_CHECKING:
    import pandas

VELOCITY_VERLET = METHODS["velocity-verlet"].walker

SAME_STEPS_STATE = 10.0
"""Of the largest displacement and velocity: times what absolute coordinates cost at most, as the
only difference at the same steps. That bound is one of the peaks; collisions make more of it
(measured: up to 1.7 times in the paper's scenes)."""

SAME_STEPS_PEAKS = 7e-9
"""Of the peaks, at steps of 0.01 natural units, beside what coordinates cost: these codes are read
now and then, which costs that much at most. It grows as 1 / dt below that step."""

LONG_STEPS_PEAKS = 0.1
"""Of the peaks, times dt^4 in natural units: velocity Verlet's velocities are not the slopes of
its displacements, between which both interpolate."""

_ONE_OF_MANY = 3.0
"""Times what late collisions make of one small difference at the start, as another makes more."""

MUCH_GROWN = 0.01
"""Where late collisions widen a tolerance beyond this, only gross errors show, and it is said.

Decks that are right differ by more there: by 2.4e-3 in a velocity (5 granules, LM_ratio 316, n
565), by 0.35 in 12 of 300 random scenes with LM_ratio from 300 to 2500.
"""

_IN_NUMPY = 2e-8
"""Time of a granule and step in NumPy, twice, at least [s]."""

_ROUND_OFF = 1e-12
"""Of the states: what is left where coordinates cost nothing."""

MOMENTUM = 1e-12
"""Relative; steps end at the corners, so every method has the whole impulse."""

MOMENTUM_OF_A_STEP = 2e-17
"""Relative, times the number of steps: LAMMPS, as others, adds up the time, and so the force, from
one reading to the next (5e-18 to 1e-17 measured)."""

EXAMINED = 1e-12
"""Relative, of every number that LAMMPS is asked for by itself.

Its own digits and those of the deck are lost once, not at every step: 3e-15 measured, for radii
from 1e-8 to 1e3 m and up to 10,000 granules. A thousandth in any of them stands a billion times
above.
"""

YARDSTICK = 1e-6
"""Of the reference's own estimate; 1e-11 to 6e-10 measured, for LM_ratio from 1e-4 to 100."""


@dataclass(frozen=True)
class Check:
    """One comparison of a number with what it should be.

    Parameters
    ----------
    name
        What is compared.
    measured, expected, tolerance
        The numbers; None where nothing could be measured.
    passed
        Whether abs(measured - expected) <= tolerance; False where nothing could be measured.
    reason
        Why this tolerance, or why there is no number and what to do.
    """

    name: str
    measured: float | None
    expected: float | None
    tolerance: float | None
    passed: bool
    reason: str

    def to_dict(self) -> dict[str, Any]:
        """The check as JSON knows it."""
        return {
            "name": self.name,
            "measured": self.measured,
            "expected": self.expected,
            "tolerance": self.tolerance,
            "passed": self.passed,
            "reason": self.reason,
        }


@dataclass(frozen=True)
class Formulas:
    """What the paper's formulas say, given p and F_SW from a simulation.

    Parameters
    ----------
    applicable
        Why they do not apply, or None where they do.
    note
        Where the scene lies outside what the paper covers; None inside.
    transition_granules
        p of Eq. 3, not rounded.
    eq6, eq9
        Peak force of contacts 2 ... N [N], NaN where the formula says nothing, shape (N - 1,).
    speed, exact_speed
        V_SW of the paper and of the exact solitary wave, both at F_SW [m/s].
    """

    applicable: str | None
    note: str | None
    transition_granules: float | None
    eq6: FloatArray
    eq9: FloatArray
    speed: float | None
    exact_speed: float | None

    def to_dict(self) -> dict[str, Any]:
        """The formulas as JSON knows them; their peak forces are in the rows."""
        return {
            "not_applicable": self.applicable,
            "outside_range": self.note,
            "transition_granules": self.transition_granules,
            "speed_m_s": self.speed,
            "exact_speed_m_s": self.exact_speed,
        }


@dataclass(frozen=True)
class Comparison:
    """Every oracle on one scene, side by side.

    Parameters
    ----------
    scene
        The scene.
    results
        What each simulation found, by the names of the backends: the reference method as native,
        and the others that ran.
    wanted
        Names of the backends that have a column in the rows: native, LAMMPS and the others that
        were asked for.
    formulas
        The paper's formulas with p and F_SW of the reference.
    checks
        What the verdict rests on.
    missing
        Whether a backend that was asked for is not there.
    """

    scene: Scene
    results: Mapping[str, Result]
    wanted: tuple[str, ...]
    formulas: Formulas
    checks: tuple[Check, ...]
    missing: bool

    @property
    def native(self) -> Result:
        """The reference method."""
        return self.results["native"]

    @property
    def lammps(self) -> Result | None:
        """LAMMPS, or None where it was not asked for or did not run."""
        return self.results.get("lammps")

    @property
    def verdict(self) -> str:
        """``pass`` where every check passed, else ``fail``."""
        return "pass" if all(check.passed for check in self.checks) else "fail"

    @property
    def rows(self) -> list[dict[str, float | int | None]]:
        """One row per contact; None where undefined.

        contact, native_N, lammps_N, those of other backends asked for, eq6_N, eq9_N.
        """
        nothing = [None] * self.native.contact.size
        peaks = {name: result.peak_force.tolist() for name, result in self.results.items()}
        columns = {
            "contact": self.native.contact.tolist(),
            **{f"{name}_N": peaks.get(name, nothing) for name in self.wanted},
            "eq6_N": _or_none(self.formulas.eq6),
            "eq9_N": _or_none(self.formulas.eq9),
        }
        return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]

    def to_frame(self) -> pandas.DataFrame:
        """The rows as a table."""
        import pandas

        return pandas.DataFrame(self.rows)

    def to_dict(self) -> dict[str, Any]:
        """The comparison as JSON knows it."""
        return {
            "verdict": self.verdict,
            "rows": self.rows,
            "checks": [check.to_dict() for check in self.checks],
            "formulas": self.formulas.to_dict(),
            "results": {name: result.to_dict() for name, result in self.results.items()},
        }


def compare(
    scene: Scene,
    backends: Sequence[str] | None = None,
    lammps: Lammps | None = None,
    progress: Callable[[str], object] | None = None,
    liggghts: Simulator | None = None,
    yade: Simulator | None = None,
    record: ArrayLike | None = None,
    engines: Mapping[str, Simulator] | None = None,
) -> Comparison:
    """Run every oracle on a scene and judge.

    Parameters
    ----------
    scene
        What to simulate.
    backends
        Which simulations to compare: native, lammps, liggghts, yade; by default native and lammps.
        The native reference always runs.
    lammps, liggghts, yade
        How these run; the same as ``engines`` with that name.
    progress
        Is called with a line of text before each part of the work.
    record
        Increasing times [s] within the run at which each of them keeps displacement, velocity and
        contact force; nothing is kept by default.
    engines
        How engines run, by name; by default with steps small enough for 1e-6 and the time limit of
        LAMMPS, which is that of the reference, too.

    Raises
    ------
    SceneError
        For a backend that does not exist, or times that cannot be.
    """
    backends = compared_by_default() if backends is None else backends
    for name in backends:
        require(name in ENGINES, "backend", name, f"must be one of {', '.join(ENGINES)}")
    tell = progress or (lambda _: None)
    tell("native: the reference method")
    named = {"lammps": lammps, "liggghts": liggghts, "yade": yade}
    given = {name: engine for name, engine in named.items() if engine} | dict(engines or {})
    limit = given["lammps"].time_limit if "lammps" in given else TIME_LIMIT
    native = Native("reference", time_limit=limit).run(scene, record)
    checks = [*balance_checks(native), yardstick_check(native)]
    results, missing = {"native": native}, False
    for name in others():
        if name not in backends:
            continue
        engine = given.get(name) or ENGINES[name].make(time_limit=limit)
        try:
            tell(f"{label_of(name)}: the generated deck")
            results[name] = engine.run(scene, record)
        except BackendMissing as problem:
            missing = True
            checks.append(Check(f"{name}: not run", None, None, None, False, str(problem)))
            continue
        except RunFailed as problem:
            checks.append(Check(f"{name}: failed", None, None, None, False, str(problem)))
            if isinstance(problem, OverlapTooLarge | TooExpensive):
                continue
        if isinstance(engine, Lammps):
            tell("LAMMPS: what it makes of the deck")
            checks += examined(scene, engine)
        if name in results:
            tell(f"native: velocity Verlet at the steps of {label_of(name)}")
            checks += code_checks(results[name], native, engine.time_limit)
    wanted = tuple(name for name in ENGINES if name in (*compared_by_default(), *backends))
    return Comparison(scene, results, wanted, formulas(native), tuple(checks), missing)


def code_checks(result: Result, reference: Result, time_limit: float) -> list[Check]:
    """What another code found: against native at the same steps, the reference and itself."""
    name = f"{result.backend}: same steps"
    return [
        *_unless_refused(name, same_steps_checks, result, time_limit),
        reference_check(result, reference),
        *balance_checks(result),
    ]


def _unless_refused(
    name: str, judge: Callable[[Result, float], list[Check]], result: Result, time_limit: float
) -> list[Check]:
    try:
        return judge(result, time_limit)
    except RunFailed as problem:
        return [Check(name, None, None, None, False, str(problem))]


def examined(scene: Scene, lammps: Lammps) -> list[Check]:
    """What LAMMPS makes of the deck of a scene, each number by itself."""
    try:
        return examination_checks(scene, lammps.examine(scene))
    except RunFailed as problem:
        return [Check("lammps: not examined", None, None, None, False, str(problem))]


def examination_checks(scene: Scene, found: Examination) -> list[Check]:
    """What LAMMPS makes of the deck against the scene: only round-off may differ."""
    granules = scene.chain.granules
    count = _within(
        "lammps: granules",
        float(found.mass.size),
        float(granules),
        0.0,
        "one more or less is another chain",
    )
    if not count.passed:
        return [count]
    return [
        count,
        *_granule_checks(scene, found),
        *_contact_checks(scene, found),
        _applied_force_check(scene, found),
    ]


def _granule_checks(scene: Scene, found: Examination) -> list[Check]:
    chain = scene.chain
    sites = 2 * chain.radius * np.arange(chain.granules)
    site, granule = _farthest(found.position, sites), _farthest(found.mass, chain.granule_mass)
    return [
        _within(
            "lammps: position at rest [m]",
            float(found.position[site]),
            float(sites[site]),
            EXAMINED * 2 * chain.radius * chain.granules,
            "granules touch, the first is at 0: only round-off may differ, as a fraction of the"
            f" chain; largest at granule {site + 1}",
        ),
        _within(
            "lammps: granule mass [kg]",
            float(found.mass[granule]),
            chain.granule_mass,
            EXAMINED * chain.granule_mass,
            "LAMMPS makes it from diameter and density, 4/3 pi R^3 rho: only round-off may differ;"
            f" largest at granule {granule + 1}",
        ),
    ]


def _contact_checks(scene: Scene, found: Examination) -> list[Check]:
    stiffness = scene.chain.contact_stiffness
    force, larger = found.contact_force, found.contact_force[1]
    measured = (force / found.overlap**1.5).ravel()
    stiff = _farthest(measured, stiffness)
    # Contacts that are missing are named by their stiffness, 0, and have no exponent.
    there = np.all(np.abs(force) > 1e-6 * stiffness * found.overlap**1.5, axis=0)
    growth = np.where(there, np.abs(force[1] / np.where(there, force[0], 1.0)), np.nan)
    exponent = np.log(growth) / np.log(found.overlap[1] / found.overlap[0])
    bent = _farthest(np.where(there, exponent, 1.5), 1.5)
    unit = stiffness * found.overlap[1] ** 1.5
    change = (found.damped_force - larger) / unit
    damped = _farthest(change.ravel(), 0.0)
    spun = _farthest(found.tangential_force, 0.0)
    return [
        _within(
            "lammps: contact stiffness [N m^(-3/2)]",
            float(measured[stiff]),
            stiffness,
            EXAMINED * stiffness,
            "contact force over overlap^(3/2) is A at two known overlaps: only round-off may"
            f" differ; {_missing(there) or f'largest at contact {stiff % there.size + 2}'}",
        ),
        _within(
            "lammps: contact exponent",
            float(exponent[bent]),
            1.5,
            EXAMINED,
            "the contact force goes as overlap^(3/2): only round-off may differ;"
            f" {_missing(there) or f'largest at contact {bent + 2}'}",
        ),
        _within(
            "lammps: damping",
            float(change.ravel()[damped]),
            0.0,
            EXAMINED,
            "change of a contact force, as a fraction, when its granules approach or part: none;"
            f" largest at contact {damped % there.size + 2}",
        ),
        _within(
            "lammps: tangential force",
            float(found.tangential_force[spun] / np.min(unit)),
            0.0,
            EXAMINED,
            "sideways force and torque over radius, as a fraction of the contact force, when the"
            f" granules spin: none; largest at granule {spun + 1}",
        ),
    ]


def _missing(there: Array) -> str:
    """The contacts without a force, by the paper's numbers; empty where there are none."""
    missing = [str(contact) for contact in np.flatnonzero(np.logical_not(there)) + 2]
    if not missing:
        return ""
    shown = ", ".join(missing[:5]) + (" and more" if len(missing) > 5 else "")
    return f"no force in contact {shown}"


def _applied_force_check(scene: Scene, found: Examination) -> Check:
    """The force that LAMMPS applies against F(t) of the scene, at the corners from both sides."""
    expected = _applied_force(scene, found.time)
    leg, step = divmod(_farthest(found.applied_force, expected), expected.shape[1])
    # LAMMPS adds up the time leg by leg; a steep ramp makes more of what that loses.
    late = len(expected) * math.ulp(scene.ramps[-1].end)
    steepest = max(
        math.pi / 2 * abs(ramp.end_force - ramp.start_force) / (ramp.end - ramp.start)
        for ramp in scene.ramps
    )
    return _within(
        "lammps: applied force [N]",
        float(found.applied_force[leg, step]),
        float(expected[leg, step]),
        EXAMINED * scene.units.force + late * steepest,
        "the sum of all net forces is F(t), at the corners from both sides, and 0 after the"
        f" pulse: only round-off may differ; largest at {found.time[leg, step]:.6g} s",
    )


def _applied_force(scene: Scene, time: FloatArray) -> FloatArray:
    """F(t) of a scene [N], from Table 1 or the pulse table and not from the ramps of the schedule.

    Parameters
    ----------
    time
        As examined [s], shape (legs, readings).
    """
    if isinstance(scene.shock, Pulse):
        assert scene.rise_time is not None
        return theory.applied_force(time, scene.shock, scene.rise_time)
    table = scene.shock
    force = np.interp(time, table.time, table.force, left=0.0, right=0.0)
    # It may jump at its first and last row: legs end before a jump and start after it.
    force[:, 1:][time[:, 1:] <= table.time[0]] = 0.0
    force[:, 0][time[:, 0] >= table.time[-1]] = 0.0
    return force


def _farthest(measured: Array, expected: Array | float) -> int:
    """Where the difference is largest, or there is no number."""
    return int(np.argmax(np.abs(measured - expected)))


def same_steps_checks(result: Result, time_limit: float = TIME_LIMIT) -> list[Check]:
    """Another code against native velocity Verlet at the same steps: only round-off may differ.

    Parameters
    ----------
    result
        What it found.
    time_limit
        How long that may take [s].
    """
    scene, units = result.scene, result.scene.units
    legs = scene.schedule(result.dt)
    deadline = Deadline(time_limit)
    twin = simulate(scene, legs, VELOCITY_VERLET, deadline=deadline)
    step = result.dt / units.time
    lost = result.lost_digits.bound if result.lost_digits is not None else 0.0
    between = SAME_STEPS_PEAKS * max(1.0, 0.01 / step) + LONG_STEPS_PEAKS * step**4
    state, peaks = _ROUND_OFF + SAME_STEPS_STATE * lost, between + lost
    measured = (
        _largest(result.displacement / units.length, twin.state.displacement),
        _largest(result.velocity / units.velocity, twin.state.velocity),
        largest_difference(result.peak_force / units.force, twin.peaks.force),
    )
    reason = "same scheme, same steps: only round-off may differ, and it adds up over the steps"
    if lost > 0 and not (max(measured[:2]) <= state and measured[2] <= peaks):
        deadline.refuse(result.steps * scene.chain.granules * _IN_NUMPY)
        grown = _grown(scene, legs, twin, lost)
        if max(grown) > lost:
            state = max(state, _ONE_OF_MANY * max(grown[:2]))
            peaks = max(peaks, between + _ONE_OF_MANY * grown[2])
            reason += f"; late collisions multiply any difference by {max(grown) / lost:.0f}"
            if max(state, peaks) > MUCH_GROWN:
                reason += ", so that only gross errors show"
    places = (
        f"granule {_farthest(result.displacement / units.length, twin.state.displacement) + 1}",
        f"granule {_farthest(result.velocity / units.velocity, twin.state.velocity) + 1}",
        f"contact {_farthest_peak(result.peak_force / units.force, twin.peaks.force)}",
    )
    names = ("displacement", "velocity", "peaks")
    tolerances = (state, state, peaks)
    return [
        _within(
            f"{result.backend}: {name}, same steps",
            difference,
            0.0,
            tolerance,
            f"{reason}; largest at {place}",
        )
        for name, difference, tolerance, place in zip(
            names, measured, tolerances, places, strict=True
        )
    ]


def _farthest_peak(peak_force: FloatArray, expected: FloatArray) -> int:
    """The contact, by the paper's number, whose peak differs most of those that are judged."""
    judged = (expected > 0) & (expected >= SIGNIFICANT * np.max(expected))
    return _farthest(peak_force / np.where(judged, expected, np.inf), 1.0 * judged) + 2


def _grown(
    scene: Scene, legs: Sequence[Leg], twin: Simulation, lost: float
) -> tuple[float, float, float]:
    """What the motion makes of a small difference in where the granules start.

    Granules that are left behind collide again, late and slowly; in long chains under long pulses
    such collisions make any round-off grow.

    Parameters
    ----------
    scene, legs, twin
        The scene, the steps and what came of them.
    lost
        The difference, of the largest overlap.

    Returns
    -------
    Differences of displacement, velocity and peaks.
    """
    nudge = lost * float(np.max(twin.peaks.force)) ** (2 / 3)
    start = nudge * np.random.default_rng(0).uniform(-1, 1, scene.chain.granules)
    nudged = simulate_in_numpy(scene, legs, VELOCITY_VERLET, displacement=start)
    # Not the twin: what finds its peaks in another way must not widen the tolerance.
    other = simulate_in_numpy(scene, legs, VELOCITY_VERLET, displacement=-start)
    return (
        _largest(nudged.state.displacement, other.state.displacement),
        _largest(nudged.state.velocity, other.state.velocity),
        largest_difference(nudged.peaks.force, other.peaks.force),
    )


def _largest(measured: Array, expected: Array) -> float:
    """Largest difference as a fraction of the largest value expected."""
    largest = float(np.max(np.abs(expected)))
    difference = float(np.max(np.abs(measured - expected)))
    return difference / largest if largest > 0 else difference


def reference_check(result: Result, reference: Result) -> Check:
    """Peaks of a simulation against the reference: within what both say of their own error."""
    return _within(
        f"{result.backend}: peaks against the reference",
        largest_difference(result.peak_force, reference.peak_force),
        0.0,
        result.error_estimate + reference.error_estimate,
        "its own error estimate plus that of the reference; largest at contact"
        f" {_farthest_peak(result.peak_force, reference.peak_force)}",
    )


def yardstick_check(reference: Result) -> Check:
    """Whether the reference is good enough to judge by: a wide error would let anything pass."""
    return _within(
        "native: error of the reference",
        reference.error_estimate,
        0.0,
        YARDSTICK,
        "what is asked of the others, 1e-6; a reference that says more of its own error judges"
        " nothing",
    )


def balance_checks(result: Result) -> list[Check]:
    """Momentum against the impulse, energy against the work done by the shock."""
    balance = result.balance
    units = result.scene.units
    energy = (2 * result.error_estimate + 1e-12) * balance.work
    energy += _ROUND_OFF**2 * units.energy  # where nothing has been pushed yet, states are rounded
    if "velocity-verlet" in result.method:
        energy += _work_error(result)
    ends_inside = result.scene.end_time < result.scene.ramps[-1].end
    momentum = (
        MOMENTUM
        + MOMENTUM_OF_A_STEP * result.steps
        + (result.error_estimate if ends_inside else 0.0)
    )
    return [
        _within(
            f"{result.backend}: momentum [N s]",
            balance.momentum,
            balance.impulse,
            momentum * balance.impulse + _ROUND_OFF**2 * units.momentum,
            "its own error estimate, as the run ends within the pulse"
            if ends_inside
            else "steps end at the corners of the pulse, so its impulse is exact",
        ),
        _within(
            f"{result.backend}: energy [J]",
            balance.energy,
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
    legs, mass = result.scene.schedule(result.dt), result.scene.chain.granule_mass
    return math.fsum(
        leg.dt**2 / (6 * mass) * abs(leg.ramp.end_force**2 - leg.ramp.start_force**2)
        for leg in legs
        if leg.ramp is not None
    )


def formulas(reference: Result) -> Formulas:
    """The paper's formulas with p and F_SW of a simulation, and the exact solitary wave."""
    scene, p, wave = reference.scene, reference.transition_granules, reference.solitary_wave
    nothing = np.full(reference.contact.size, np.nan)
    if not isinstance(scene.shock, Pulse):
        reason = "the shock is a pulse table: Eqs. 3 to 9 are about the profiles of Table 1"
        return Formulas(reason, None, None, nothing, nothing, None, None)
    if p is None or wave.peak_force is None:
        reason = "the transition does not end within this chain and run: no p, no F_SW"
        return Formulas(reason, None, None, nothing, nothing, None, None)
    chain, pulse, rise_time = scene.chain, scene.shock, scene.rise_time
    assert rise_time is not None
    ratio = theory.effective_momentum_ratio(chain, pulse, rise_time)
    transition = np.arange(2, p + 1)
    eq6, eq9 = nothing.copy(), nothing.copy()
    eq6[: p - 1] = theory.peak_force(transition, p, wave.peak_force, pulse.duration_ratio, ratio)
    eq9[:p] = theory.peak_force_cubic(np.arange(2, p + 2), p, float(eq6[0]), wave.peak_force)
    return Formulas(
        applicable=None,
        note=theory.outside_range(scene.momentum_ratio, pulse.duration_ratio),
        transition_granules=theory.transition_granules(chain, pulse, rise_time, wave.peak_force),
        eq6=eq6,
        eq9=eq9,
        speed=theory.solitary_wave_speed(chain, wave.peak_force),
        exact_speed=exact.speed(chain, wave.peak_force),
    )


def _within(name: str, measured: float, expected: float, tolerance: float, reason: str) -> Check:
    passed = bool(abs(measured - expected) <= tolerance)
    # JSON has no word for what is not a number.
    known = measured if math.isfinite(measured) else None
    return Check(name, known, expected, tolerance, passed, reason)


def _or_none(values: FloatArray) -> list[float | None]:
    return [None if np.isnan(value) else value for value in values.tolist()]
